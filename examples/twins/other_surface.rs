//! Effects of what the surface is made of in their other forms.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use matdb::radar::random::Draws;
use num_complex::Complex;
use serde_json::{Value, json};

use super::base::{Base, Local};
use super::physics::{Effect, ratio};
use super::scan::{Shot, World};
use super::surface::reflectance;
use super::waves::Waves;

/// Incidence angle of a look, rad.
fn theta_rad(look: &Shot) -> f64 {
    look.cos_theta().clamp(0.0, 1.0).acos()
}

/// Standard deviation of the logarithm of what lies unevenly.
const UNEVEN: f64 = 0.3;

/// How much of something uneven is at a place, over its mean.
fn uneven(field: &Waves, look: &Shot) -> f64 {
    (UNEVEN * field.at(look.point) - 0.5 * UNEVEN * UNEVEN).exp()
}

/// Cosine of the angle that a ray has inside, by Snell's law.
fn cos_inside(theta_rad: f64, index: f64) -> f64 {
    (1.0 - (theta_rad.sin() / index).powi(2)).sqrt()
}

/// Single scattering below a border that refracts, as in snow (Ulaby, Moore and Fung, Microwave Remote Sensing,
/// vol. 3): σ⁰ falls with the cosine of the angle θ' inside, and the border lets through T(θ) on the way in and
/// out (Fresnel, the mean of both polarisations). What scatters, such as glass fibre, lies unevenly.
pub struct Subsurface {
    index: f64,
    content: Waves,
}

impl Subsurface {
    pub fn new(random: &mut Draws) -> Subsurface {
        Subsurface { index: 1.4 + 0.8 * random.uniform(), content: Waves::new(random, [0.08, 0.4]) }
    }

    fn let_through(&self, theta_rad: f64) -> f64 {
        1.0 - reflectance(theta_rad, 1.0, 0.0, self.index)
    }
}

impl Effect for Subsurface {
    fn name(&self) -> &'static str {
        "subsurface"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-7, 0.3]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "sigma0 = sigma0(0) cos(theta') T(theta)^2/T(0)^2, theta' inside",
            "sigma0_at_normal_db": 10.0 * size.log10(),
            "index": self.index,
            "sd_of_ln_content": UNEVEN,
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        let theta_rad = theta_rad(look);
        let through = self.let_through(theta_rad) / self.let_through(0.0);
        let inside = cos_inside(theta_rad, self.index) * uneven(&self.content, look);
        law.sigma0_volume += size * inside * through * through;
    }
}

/// A piece of cloth with a curved outline and an uneven thickness. The wave crosses it at the angle of
/// refraction, so that its way grows to a limit and not as 1/cos θ.
pub struct CoveringLayer {
    centre: DVec3,
    reach_m: f64,
    /// Size and phase of the waves of the outline, of which 2, 3 and 5 go around.
    outline: [[f64; 2]; 3],
    thickness: Waves,
    index: f64,
}

/// Waves that go around the outline.
const AROUND: [f64; 3] = [2.0, 3.0, 5.0];
impl CoveringLayer {
    /// Covers a quarter to six tenths of what is met, about a point of it.
    pub fn new(random: &mut Draws, world: &World) -> CoveringLayer {
        let points: Vec<DVec3> =
            world.sights.iter().filter_map(|sight| Some(sight.look?.point)).collect();
        let place = (random.uniform() * points.len() as f64) as usize;
        let mut cloth = CoveringLayer {
            centre: points.get(place).copied().unwrap_or(world.middle),
            reach_m: 1.0,
            outline: [0.3, 0.2, 0.12].map(|size| [size, TAU * random.uniform()]),
            thickness: Waves::new(random, [0.06, 0.2]),
            index: 1.2 + 0.4 * random.uniform(),
        };
        let mut reaches_m: Vec<f64> = points.iter().map(|point| cloth.reached(*point)).collect();
        reaches_m.sort_by(f64::total_cmp);
        let covered = (0.25 + 0.35 * random.uniform()) * reaches_m.len() as f64;
        cloth.reach_m = reaches_m.get(covered as usize).copied().unwrap_or(0.0);
        cloth
    }

    /// Distance from the centre in the plane across the radar's axis, over that of the outline for a reach of 1.
    fn reached(&self, point: DVec3) -> f64 {
        let off_m = (point - self.centre).truncate();
        let azimuth = off_m.y.atan2(off_m.x);
        let mut outline = 1.0;
        for (around, [size, phase]) in std::iter::zip(AROUND, self.outline) {
            outline += size * (around * azimuth + phase).sin();
        }
        off_m.length() / outline
    }
}

impl Effect for CoveringLayer {
    fn name(&self) -> &'static str {
        "covering-layer"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.02, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "a curved outline in x and y; uneven thickness; a refracted way",
            "loss_db": size,
            "meaning": "two-way, at normal incidence, the mean over the thickness",
            "sd_of_ln_thickness": UNEVEN,
            "index": self.index,
            "centre_m": self.centre.to_array(),
            "mean_radius_m": self.reach_m,
            "outline_waves_around": AROUND,
            "outline_share_and_phase_rad": self.outline,
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        if self.reached(look.point) < self.reach_m {
            let cos_inside = cos_inside(theta_rad(look), self.index);
            law.gain *= ratio(-size * uneven(&self.thickness, look) / cos_inside);
        }
    }
}

/// A brushed surface: a share of the facets lies in its grooves and is steep across the grain alone, the others
/// have the base law.
pub struct Anisotropy {
    grain: DVec3,
    share: f64,
}

impl Anisotropy {
    pub fn new(random: &mut Draws) -> Anisotropy {
        let grain = DVec2::from_angle(0.5 * TAU * random.uniform()).extend(0.0);
        Anisotropy { grain, share: 0.4 + 0.3 * random.uniform() }
    }
}

impl Effect for Anisotropy {
    fn name(&self) -> &'static str {
        "anisotropy"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.005, 3.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "two populations of facets, one isotropic and one brushed",
            "brushed_share": self.share,
            "brushed_m_across_over_along": size.exp(),
            "grain": self.grain.to_array(),
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        let [grain, radar] = [self.grain, look.to_radar]
            .map(|v| (v - v.dot(look.normal) * look.normal).normalize_or_zero());
        law.cos2_azimuth = grain.dot(radar).powi(2);
        let half = (0.5 * size).exp();
        law.brushed = Some((self.share, [law.m[0] / half, law.m[1] * half]));
    }
}

/// A lossy film of uneven thickness on a share of every spot: the fringes move over the target.
pub struct ThinFilm {
    index: Complex<f64>,
    thickness_m: f64,
    uneven: Waves,
    uneven_m: f64,
    substrate: f64,
}

impl ThinFilm {
    pub fn new(random: &mut Draws, base: &Base) -> ThinFilm {
        let index = 1.4 + 0.4 * random.uniform();
        let loss_tangent = 0.02 + 0.04 * random.uniform();
        let root = base.f_lambda.sqrt();
        ThinFilm {
            // For a small loss, ε = n²·(1 + i·tan δ) has the index n·(1 + i·tan δ/2).
            index: Complex::new(index, 0.5 * index * loss_tangent),
            thickness_m: 4e-4 + 8e-4 * random.uniform(),
            uneven: Waves::new(random, [0.15, 0.5]),
            // A fringe is half a wave in the film, some 0.3 mm: a third of it and less.
            uneven_m: 4e-5 + 6e-5 * random.uniform(),
            substrate: (1.0 + root) / (1.0 - root),
        }
    }

    fn thickness_m(&self, point: DVec3) -> f64 {
        (self.thickness_m + self.uneven_m * self.uneven.at(point)).max(0.0)
    }

    /// Reflectance of the coated surface over that of the bare one.
    fn change(&self, theta_rad: f64, thickness_m: f64) -> f64 {
        let [coated, bare] =
            [thickness_m, 0.0].map(|d| lossy_film(theta_rad, self.index, d, self.substrate));
        coated / bare
    }
}

impl Effect for ThinFilm {
    fn name(&self) -> &'static str {
        "thin-film"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.003, 1.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "a lossy film of uneven thickness",
            "index": self.index.re,
            "extinction": self.index.im,
            "mean_thickness_m": self.thickness_m,
            "thickness_sd_m": self.uneven_m,
            "substrate_index": self.substrate,
            "coated_share": size,
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        let thickness_m = self.thickness_m(look.point);
        // Facets send back what they meet at normal incidence; fine unevenness is lit at the angle of the surface.
        law.specular *= 1.0 - size + size * self.change(0.0, thickness_m);
        law.diffuse *= 1.0 - size + size * self.change(theta_rad(look), thickness_m);
    }
}

/// Reflectance of an absorbing film on a half space by Airy's sum of its echoes (Born & Wolf, Principles of
/// Optics, sec. 1.6.4 and 14.4) at 300 GHz, the mean of both polarisations.
pub fn lossy_film(theta_rad: f64, index: Complex<f64>, thickness_m: f64, substrate: f64) -> f64 {
    let wave_per_m = TAU * 300e9 / 299_792_458.0;
    let indices: [Complex<f64>; 3] = [Complex::ONE, index, Complex::from(substrate)];
    let sin2 = theta_rad.sin().powi(2);
    let [air, film, below] = indices.map(|n| (1.0 - sin2 / (n * n)).sqrt());
    let phase = 2.0 * wave_per_m * thickness_m * index * film;
    let there_and_back = (phase * Complex::I).exp();
    let mut sum = 0.0;
    for parallel in [false, true] {
        let [air, film, below] = std::array::from_fn(|n| {
            let cos = [air, film, below][n];
            if parallel { indices[n] / cos } else { indices[n] * cos }
        });
        let [top, bottom] =
            [[air, film], [film, below]].map(|[above, under]| (above - under) / (above + under));
        let echoes = (top + bottom * there_and_back) / (1.0 + top * bottom * there_and_back);
        sum += 0.5 * echoes.norm_sqr();
    }
    sum
}

/// Shadowing and masking that are the same event the more, the flatter the radar looks: G1 to the power
/// 1 + exp(−θ/θ₀), from the product at normal incidence towards one G1 at grazing.
pub struct CorrelatedShadowing {
    within_rad: f64,
}

impl CorrelatedShadowing {
    pub fn new(random: &mut Draws) -> CorrelatedShadowing {
        CorrelatedShadowing { within_rad: (15.0 + 20.0 * random.uniform()).to_radians() }
    }
}

impl Effect for CorrelatedShadowing {
    fn name(&self) -> &'static str {
        "correlated-shadowing"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.1, 1.5]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "G1 to the power 1 + exp(-theta/theta0)",
            "m": size,
            "theta0_deg": self.within_rad.to_degrees(),
        })
    }
    fn material(&self, size: f64, base: &mut Base) {
        base.m = size;
    }
    fn surface(&self, _: f64, look: &Shot, law: &mut Local) {
        law.shadowings = 1.0 + (-theta_rad(look) / self.within_rad).exp();
    }
}

/// Blots that run into each other, of a material with lobes of its own.
pub struct ForeignPatch {
    /// Middles and radii, m.
    blots: Vec<(DVec3, f64)>,
    diffuse_share: f64,
    m: f64,
}

/// A material this much brighter, dB, has its own roughness; one hardly brighter is hardly other.
const OTHER_DB: f64 = 4.0;

impl ForeignPatch {
    /// Three or four blots about a point that is met under less than 40°.
    pub fn new(random: &mut Draws, world: &World) -> ForeignPatch {
        let mut facing: Vec<Shot> = world.sights.iter().filter_map(|sight| sight.look).collect();
        facing.retain(|look| look.cos_theta() > 40f64.to_radians().cos());
        let place = (random.uniform() * facing.len() as f64) as usize;
        let [middle, normal] =
            facing.get(place).map_or([world.middle, DVec3::Z], |look| [look.point, look.normal]);
        let (u, v) = normal.any_orthonormal_pair();
        let mut blots = Vec::new();
        for _ in 0..3 + (2.0 * random.uniform()) as usize {
            let off_m =
                (0.02 + 0.06 * random.uniform()) * DVec2::from_angle(TAU * random.uniform());
            blots.push((middle + off_m.x * u + off_m.y * v, 0.025 + 0.025 * random.uniform()));
        }
        ForeignPatch {
            blots,
            diffuse_share: 0.2 + random.uniform(),
            m: 0.6 * (1.6f64 / 0.6).powf(random.uniform()),
        }
    }

    /// A single blot ends at its radius; two whose fields overlap are joined by a neck.
    fn covers(&self, point: DVec3) -> bool {
        let field: f64 = self
            .blots
            .iter()
            .map(|(middle, radius_m)| (1.0 - (point.distance(*middle) / radius_m).powi(2)).exp())
            .sum();
        field > 1.0
    }
}

impl Effect for ForeignPatch {
    fn name(&self) -> &'static str {
        "foreign-patch"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.05, 25.0]
    }
    fn parameters(&self, size: f64) -> Value {
        let blots: Vec<Value> = self
            .blots
            .iter()
            .map(
                |(middle, radius_m)| json!({ "middle_m": middle.to_array(), "radius_m": radius_m }),
            )
            .collect();
        json!({
            "form": "several blots joined",
            "blots": blots,
            "specular_brighter_db": size,
            "diffuse_brighter_db": size * self.diffuse_share,
            "m_ratio": self.m.powf((size / OTHER_DB).min(1.0)),
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        if self.covers(look.point) {
            law.specular *= ratio(size);
            law.diffuse *= ratio(size * self.diffuse_share);
            law.m = law.m.map(|m| m * self.m.powf((size / OTHER_DB).min(1.0)));
        }
    }
}
