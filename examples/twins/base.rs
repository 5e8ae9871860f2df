//! The base law, equations (12) to (15), written anew: two lobes in backscatter, and bistatic for
//! second segments.

use std::f64::consts::PI;

use glam::DVec3;
use matdb::radar::random::Draws;
use serde::Serialize;

/// Law of the facet slopes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Slopes {
    Beckmann,
    Ggx,
}

/// The five parameters of the paper's mixture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Base {
    pub slopes: Slopes,
    pub m: f64,
    pub alpha: f64,
    pub k: f64,
    pub f_lambda: f64,
    pub r_s: f64,
}

/// The law at one place, as effects change it.
#[derive(Clone, Copy, Debug)]
pub struct Local {
    pub slopes: Slopes,
    /// S = (1 − k)·f_λ.
    pub specular: f64,
    /// Roughness along the grain and across it.
    pub m: [f64; 2],
    /// cos² of the radar's azimuth about the normal, from the grain.
    pub cos2_azimuth: f64,
    /// Power of G1: 2 for the paper's product.
    pub shadowings: f64,
    /// R = k·r_s.
    pub diffuse: f64,
    pub alpha: f64,
    /// θ-independent σ⁰ of a volume.
    pub sigma0_volume: f64,
    /// Two-way loss of whatever lies above, as a ratio.
    pub gain: f64,
}

impl Base {
    /// A base law from sensible ranges: lobes of 5° to 24°, a skirt that reaches the threshold
    /// between 50° and 75°.
    pub fn draw(draws: &mut Draws) -> Base {
        let mut log = |low: f64, high: f64| low * (high / low).powf(draws.uniform());
        let (m, f_lambda, r) = (log(0.08, 0.45), log(0.03, 0.2), log(0.0015, 0.01));
        let k = 0.08 + 0.22 * draws.uniform();
        let alpha = 2.0 + 6.0 * draws.uniform();
        let slopes = if draws.uniform() < 0.5 { Slopes::Beckmann } else { Slopes::Ggx };
        Base { slopes, m, alpha, k, f_lambda, r_s: r / k }
    }

    /// The same with every parameter wrong by up to ±30 %: where a fit has to start.
    pub fn misjudged(self, draws: &mut Draws) -> Base {
        let mut wrong = |value: f64| value * (0.7 + 0.6 * draws.uniform());
        let (m, alpha, k) = (wrong(self.m), wrong(self.alpha), wrong(self.k));
        Base { m, alpha, k, f_lambda: wrong(self.f_lambda), r_s: wrong(self.r_s), ..self }
    }

    pub fn local(&self) -> Local {
        Local {
            slopes: self.slopes,
            specular: (1.0 - self.k) * self.f_lambda,
            m: [self.m; 2],
            cos2_azimuth: 1.0,
            shadowings: 2.0,
            diffuse: self.k * self.r_s,
            alpha: self.alpha,
            sigma0_volume: 0.0,
            gain: 1.0,
        }
    }

    /// f(i, o), 1/sr, for unit vectors away from a surface with normal n.
    pub fn bistatic_per_sr(&self, n: DVec3, i: DVec3, o: DVec3) -> f64 {
        let (cos_i, cos_o) = (n.dot(i), n.dot(o));
        let Some(h) = (i + o).try_normalize() else { return 0.0 };
        if cos_i <= 0.0 || cos_o <= 0.0 {
            return 0.0;
        }
        let cos_h = n.dot(h).clamp(0.0, 1.0);
        let fresnel = self.f_lambda + (1.0 - self.f_lambda) * (1.0 - o.dot(h).abs()).powi(5);
        let g = self.slopes.g1(tan(cos_i), self.m) * self.slopes.g1(tan(cos_o), self.m);
        let specular = fresnel * self.slopes.d_per_sr(cos_h, self.m) * g / (4.0 * cos_i * cos_o);
        let diffuse = self.r_s * (self.alpha + 2.0) / (2.0 * PI) * cos_h.powf(self.alpha);
        self.k * diffuse + (1.0 - self.k) * specular
    }
}

impl Local {
    /// f(θ) in backscatter, 1/sr.
    pub fn f_per_sr(&self, cos_theta: f64) -> f64 {
        if cos_theta <= 1e-6 {
            return 0.0;
        }
        let (cos2, tan) = (cos_theta * cos_theta, tan(cos_theta));
        let [along, across] = self.m;
        let share = self.cos2_azimuth;
        let slope2 = tan * tan * (share / (along * along) + (1.0 - share) / (across * across));
        let d = self.slopes.law(slope2) / (PI * along * across * cos2 * cos2);
        let m = (along * along * share + across * across * (1.0 - share)).sqrt();
        let g = self.slopes.g1(tan, m).powf(self.shadowings);
        let specular = self.specular * d * g / (4.0 * cos2);
        let diffuse = self.diffuse * (self.alpha + 2.0) / (2.0 * PI) * cos_theta.powf(self.alpha);
        self.gain * (specular + diffuse + self.sigma0_volume / (4.0 * PI * cos2))
    }
}

impl Slopes {
    fn law(self, slope2: f64) -> f64 {
        match self {
            Slopes::Beckmann => (-slope2).exp(),
            Slopes::Ggx => (1.0 + slope2).powi(-2),
        }
    }

    /// Facet normals per steradian.
    pub fn d_per_sr(self, cos: f64, m: f64) -> f64 {
        self.law((tan(cos) / m).powi(2)) / (PI * m * m * cos.powi(4).max(1e-12))
    }

    /// tan² of a facet's slope, of a uniform draw: facets as often as D·cos says.
    pub fn sampled_tan2(self, uniform: f64, m: f64) -> f64 {
        match self {
            Slopes::Beckmann => -m * m * (1.0 - uniform).ln(),
            Slopes::Ggx => m * m * uniform / (1.0 - uniform),
        }
    }

    /// Smith's G1 in Walter's forms.
    fn g1(self, tan: f64, m: f64) -> f64 {
        match self {
            Slopes::Ggx => 2.0 / (1.0 + (1.0 + (m * tan).powi(2)).sqrt()),
            Slopes::Beckmann if m * tan <= 1.0 / 1.6 => 1.0,
            Slopes::Beckmann => {
                let a = 1.0 / (m * tan);
                a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a))
            }
        }
    }
}

fn tan(cos: f64) -> f64 {
    (1.0 - cos * cos).max(0.0).sqrt() / cos.max(1e-9)
}
