//! Terms that a scattering model can lack in a curve, one small object each.
//!
//! With its parameters at their `absent` values a term changes nothing, exactly.

use std::cell::OnceCell;
use std::f64::consts::{PI, TAU};

use super::points::Point;
use crate::brdf::{Brdf, CookTorrance, Distribution, Scattering, Seen, Shadowing};
use crate::effects::{EffectParameter, Level};
use crate::frames::{Direction, Surface};

/// A term that a scattering model can lack.
pub trait Term: Sync {
    /// Its name, as reports write it.
    fn name(&self) -> &'static str;

    /// The level it belongs to.
    fn level(&self) -> Level;

    /// Its parameters.
    fn parameters(&self) -> &'static [EffectParameter];

    /// Description in one sentence.
    fn description(&self) -> &'static str;

    /// Its signature in a curve, and how it differs from similar terms.
    fn signature(&self) -> &'static str;

    /// Whether it only gives a law another shape, as other laws have it.
    fn is_shape(&self) -> bool {
        false
    }

    /// Starts of a search.
    fn starts(&self) -> Vec<Vec<f64>>;

    /// f with this term at a point, 1/sr; `f_per_sr` is f without it.
    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64;
}

/// A scattering model at a point. What its terms need of it is computed once.
pub struct LawAt<'a> {
    /// The model.
    pub law: &'a Brdf,
    /// The point.
    pub point: &'a Point,
    /// f of the model alone, 1/sr.
    pub f_per_sr: f64,
    parts_per_sr: OnceCell<[f64; 2]>,
}

impl<'a> LawAt<'a> {
    /// A scattering model of which f at this point is known, 1/sr.
    pub fn new(law: &'a Brdf, point: &'a Point, f_per_sr: f64) -> LawAt<'a> {
        LawAt { law, point, f_per_sr, parts_per_sr: OnceCell::new() }
    }

    /// Its specular and its diffuse part, 1/sr.
    fn parts_per_sr(&self) -> [f64; 2] {
        *self.parts_per_sr.get_or_init(|| {
            let Seen { f_per_sr, specular_share, .. } =
                self.law.seen_by(0.0, self.point.i, self.point.o);
            [specular_share, 1.0 - specular_share].map(|share| share * f_per_sr)
        })
    }

    /// Sum of its Cook–Torrance lobes, each times a factor, 1/sr.
    fn lobes_per_sr(&self, factor: &dyn Fn(&CookTorrance) -> f64) -> f64 {
        self.law.sum_over_parts(&|part| match part {
            Brdf::CookTorrance(lobe) => factor(lobe) * part.f_per_sr(self.point.i, self.point.o),
            _ => 0.0,
        })
    }
}

/// Every term, in the order in which they act.
pub fn terms() -> [&'static dyn Term; 10] {
    [
        &DiffuseLobe,
        &LimbDarkening,
        &SecondLobe,
        &FresnelGrowth,
        &Subsurface,
        &ThinFilm,
        &Opposition,
        &AngleOffset,
        &InstrumentLobe,
        &StrayLight,
    ]
}

/// The term of that name.
pub fn term(name: &str) -> Option<&'static dyn Term> {
    terms().into_iter().find(|term| term.name() == name)
}

/// Every pair of two lists.
fn pairs(first: &[f64], second: &[f64]) -> Vec<Vec<f64>> {
    first.iter().flat_map(|&a| second.iter().map(move |&b| vec![a, b])).collect()
}

/// Name, level, texts and parameters of a term.
macro_rules! described {
    ($name:literal, $level:ident, $is:literal, $shows:literal, $($parameter:expr),+ $(,)?) => {
        fn name(&self) -> &'static str {
            $name
        }

        fn level(&self) -> Level {
            Level::$level
        }

        fn parameters(&self) -> &'static [EffectParameter] {
            const PARAMETERS: &[EffectParameter] = &[$($parameter),+];
            PARAMETERS
        }

        fn description(&self) -> &'static str {
            $is
        }

        fn signature(&self) -> &'static str {
            $shows
        }
    };
}

/// Cosine between the normal and the half direction, and between that and the receiver.
fn half(point: &Point) -> [f64; 2] {
    let sum = point.i.xyz() + point.o.xyz();
    let h = sum / sum.length().max(f64::MIN_POSITIVE);
    [h.z, point.o.xyz().dot(h)].map(|cos: f64| cos.clamp(0.0, 1.0))
}

struct DiffuseLobe;

impl Term for DiffuseLobe {
    described!(
        "diffuse-lobe",
        Material,
        "The diffuse part is a broad lobe (equation (15)) where the law is flat: facets of many slopes, \
         or rough layers below the surface.",
        "The level falls with the angle between the normal and the direction midway between source and \
         receiver, smoothly and at all incidences alike. Limb darkening depends on each of the two angles.",
        EffectParameter::new("alpha", "1", [0.0, 50.0], 0.0, 0.1),
    );

    fn is_shape(&self) -> bool {
        true
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.3, 2.0, 8.0].map(|alpha| vec![alpha]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[alpha] = values else { return f_per_sr };
        let shape = (alpha + 2.0) / 2.0 * half(at.point)[0].powf(alpha);
        f_per_sr + at.parts_per_sr()[1] * (shape - 1.0)
    }
}

struct LimbDarkening;

/// Least cosine of a direction: grazing directions have f of 0.
const LEAST_COS: f64 = 1e-3;

impl Term for LimbDarkening {
    described!(
        "limb-darkening",
        Material,
        "The diffuse part goes as (cos θ_i·cos θ_s)^k (Minnaert's law): shadows between grains, or light \
         that leaves a deep layer.",
        "The diffuse level falls (k above 0) or rises (below 0) towards grazing angles of the source \
         and of the receiver, whatever lies between them.",
        EffectParameter::new("k", "1", [-0.9, 5.0], 0.0, 0.05),
    );

    fn is_shape(&self) -> bool {
        true
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [-0.3, 0.3].map(|k| vec![k]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[k] = values else { return f_per_sr };
        let cosines = at.point.i.cos_theta() * at.point.o.cos_theta();
        f_per_sr + at.parts_per_sr()[1] * (cosines.max(LEAST_COS).powf(k) - 1.0)
    }
}

struct SecondLobe;

impl Term for SecondLobe {
    described!(
        "second-lobe",
        Material,
        "A second population of facets of another roughness scatters a lobe of its own about the mirror \
         direction (GGX).",
        "A narrow core on a broad foot, or the reverse, that follows the mirror direction and grows \
         towards grazing incidence. Which of two lobes is called the second means nothing. A lobe of the \
         instrument keeps its width at all incidences.",
        EffectParameter::new("f_lambda", "1", [0.0, 1.0], 0.0, 1e-3),
        EffectParameter::new("m", "1", [0.01, 1.5], 0.3, 0.01),
    );

    fn is_shape(&self) -> bool {
        true
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        pairs(&[1e-3, 1e-2, 0.1], &[0.03, 0.1, 0.3, 0.8])
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[f_lambda, m] = values else { return f_per_sr };
        let (distribution, shadowing) = (Distribution::Ggx, Shadowing::Separable);
        let lobe = CookTorrance { f_lambda, m, m_across: None, distribution, shadowing };
        // Schlick's factor does not vanish with f_λ.
        let share = f_lambda / (f_lambda + 1e-6);
        f_per_sr + share * lobe.f_per_sr(at.point.i, at.point.o)
    }
}

struct FresnelGrowth;

impl Term for FresnelGrowth {
    described!(
        "fresnel-growth",
        Material,
        "The lobe's level is not the reflectance of its facets: at normal incidence they reflect level_db \
         less, and towards grazing everything (another index of refraction).",
        "The specular level rises more steeply (above 0) or less (below 0) from one incidence to \
         the next than its level says. In backscatter the wave meets facets at normal incidence, and the \
         term does not show.",
        EffectParameter::new("level_db", "dB", [-30.0, 30.0], 0.0, 0.2),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        [-6.0, -1.0, 1.0, 6.0].map(|db| vec![db]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[level_db] = values else { return f_per_sr };
        let amount = 10f64.powf(0.1 * level_db);
        let growth = (1.0 - half(at.point)[1]).powi(5);
        let schlick = |r0: f64| r0 + (1.0 - r0) * growth;
        f_per_sr
            + at.lobes_per_sr(&|lobe| {
                let f = lobe.f_lambda.max(1e-9);
                amount * schlick((f / amount).min(1.0)) / schlick(f) - 1.0
            })
    }
}

struct Subsurface;

impl Term for Subsurface {
    described!(
        "subsurface",
        Material,
        "Part of the wave enters the material, scatters inside and comes out with the same strength at \
         every angle: f rises as 1/(cos θ_i·cos θ_s).",
        "The curve flattens, or bends upwards, towards grazing angles of source and receiver alike. Stray \
         light rises with the receiver's angle alone, at every incidence by the same amount.",
        EffectParameter::new("sigma_v", "1", [0.0, 1.0], 0.0, 5e-4),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        [5e-4, 5e-3, 5e-2].map(|sigma_v| vec![sigma_v]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[sigma_v] = values else { return f_per_sr };
        let cos = [at.point.i, at.point.o].map(|d| d.cos_theta().max(LEAST_COS));
        f_per_sr + sigma_v / (4.0 * PI * cos[0] * cos[1])
    }
}

pub(super) struct ThinFilm;

/// Index of refraction of a film: paints and oxides have 1.4 to 1.8, and the ripple hardly depends on it.
const FILM_INDEX: f64 = 1.5;

impl Term for ThinFilm {
    described!(
        "thin-film",
        Material,
        "A flat film of index 1.5 interferes with itself: the lobes ripple with the path through it. The \
         thickness is optical, in wavelengths.",
        "Maxima and minima over the angle, in backscatter densest near 50°. No other term goes up and down more \
         than once. Thicknesses with the same number of ripples over the angles cannot be distinguished.",
        EffectParameter::new("visibility", "1", [-0.99, 0.99], 0.0, 0.02),
        EffectParameter::new("thickness", "1", [0.1, 22.0], 1.0, 0.01),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        // A tenth of a wavelength is a fifth of the period of the ripple's phase.
        let thicknesses: Vec<f64> = (2..=220).map(|k| 0.1 * f64::from(k)).collect();
        pairs(&[-0.5, -0.2, 0.2, 0.5], &thicknesses)
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[visibility, _] = values else { return f_per_sr };
        let phase_rad = ThinFilm::phase_rad(values, at.point);
        f_per_sr + at.parts_per_sr()[0] * visibility * phase_rad.cos()
    }
}

impl ThinFilm {
    /// Phase between the two waves that a film of these numbers returns at a point, rad.
    pub fn phase_rad(values: &[f64], point: &Point) -> f64 {
        let thickness = values.get(1).copied().unwrap_or(0.0);
        let [i, o] = [point.i, point.o].map(cos_inside);
        TAU * thickness * (i + o)
    }
}

/// Cosine between the normal and a direction refracted into a film.
fn cos_inside(d: Direction<Surface>) -> f64 {
    (1.0 - (1.0 - d.cos_theta().powi(2)) / FILM_INDEX.powi(2)).max(0.0).sqrt()
}

struct Opposition;

impl Term for Opposition {
    described!(
        "opposition",
        Material,
        "More comes straight back than to the sides: the source sees no grain's shadow, and waves on a \
         path and on its reverse interfere.",
        "A peak about the direction of the source at every incidence, where the detector does not hide \
         it. A backscatter curve lies in the peak and does not show it.",
        EffectParameter::new("height", "1", [0.0, 3.0], 0.0, 0.02),
        EffectParameter::new("width_deg", "deg", [0.5, 30.0], 5.0, 0.2),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        pairs(&[0.1, 0.5], &[2.0, 6.0, 15.0])
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[height, width_deg] = values else { return f_per_sr };
        let apart_rad = at.point.i.xyz().dot(at.point.o.xyz()).clamp(-1.0, 1.0).acos();
        f_per_sr * (1.0 + height * (-apart_rad / width_deg.to_radians()).exp())
    }
}

struct AngleOffset;

impl Term for AngleOffset {
    described!(
        "angle-offset",
        Instrument,
        "The receiver stands at another angle than the file says, or the sample is tilted by half as \
         much: every angle is off by offset_deg. A level of backscatter is the σ⁰ of the other angle.",
        "The peaks of all incidences are shifted to the same side by the same angle, and each flank errs \
         by its slope.",
        EffectParameter::new("offset_deg", "deg", [-10.0, 10.0], 0.0, 0.1),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        [-9.0, -6.0, -3.0, -1.0, 1.0, 3.0, 6.0, 9.0].map(|offset| vec![offset]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        const GRAZING_RAD: f64 = 1.57;
        let &[offset_deg] = values else { return f_per_sr };
        let LawAt { law, point, .. } = *at;
        // In backscatter the source moves with the receiver, on its own side.
        let is_backscatter = point.i == point.o;
        let theta_rad = if is_backscatter {
            -point.theta_i_rad - offset_deg.to_radians()
        } else {
            point.theta_s_rad + offset_deg.to_radians()
        };
        let theta_rad = theta_rad.clamp(-GRAZING_RAD, GRAZING_RAD);
        let o = Direction::from_angles(theta_rad.abs(), if theta_rad < 0.0 { PI } else { 0.0 });
        let i = if is_backscatter { o } else { point.i };
        let ratio = if at.f_per_sr > 0.0 { law.f_per_sr(i, o) / at.f_per_sr } else { 1.0 };
        // σ⁰ = 4π·f·cos²θ was turned into f at the angle of the file.
        let cosines = if is_backscatter { o.cos_theta() / point.o.cos_theta() } else { 1.0 };
        f_per_sr * ratio * cosines.powi(2)
    }
}

struct InstrumentLobe;

impl Term for InstrumentLobe {
    described!(
        "instrument-lobe",
        Instrument,
        "A narrow lobe of fixed width in the mirror direction: the mirror image of the source, as wide as \
         the beam and the receiver's aperture.",
        "A peak a few degrees wide, and equally wide at all incidences, exactly in the mirror direction.",
        EffectParameter::new("level_per_sr", "sr-1", [0.0, 1e4], 0.0, 1e-3),
        EffectParameter::new("width_deg", "deg", [0.1, 5.0], 1.0, 0.05),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        pairs(&[1e-3, 1e-1, 10.0], &[0.5, 1.5, 4.0])
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[level_per_sr, width_deg] = values else { return f_per_sr };
        let (i, o) = (at.point.i.xyz(), at.point.o.xyz());
        let off_rad = (2.0 * i.z * o.z - i.dot(o)).clamp(-1.0, 1.0).acos();
        f_per_sr + level_per_sr * (-0.5 * (off_rad / width_deg.to_radians()).powi(2)).exp()
    }
}

struct StrayLight;

impl Term for StrayLight {
    described!(
        "stray-light",
        Instrument,
        "The same power is added at every angle, or too much was taken off with the blank; divided by the \
         receiver's cosine it becomes s/cos θ_s.",
        "The curve rises (s above 0) or falls (below 0) towards grazing receivers, most where the sample is \
         darkest, and by the same amount at every incidence.",
        EffectParameter::new("s_per_sr", "sr-1", [-0.1, 0.1], 0.0, 1e-4),
    );

    fn starts(&self) -> Vec<Vec<f64>> {
        [-1e-3, -1e-4, 1e-4, 1e-3].map(|s| vec![s]).to_vec()
    }

    fn scatter(&self, values: &[f64], at: &LawAt, f_per_sr: f64) -> f64 {
        let &[s_per_sr] = values else { return f_per_sr };
        f_per_sr + s_per_sr / at.point.o.cos_theta().max(LEAST_COS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::curve::base_law;
    use crate::diagnose::curve::testing::in_plane;

    #[test]
    fn absent_numbers_change_nothing_and_every_start_does() {
        let law = base_law();
        let points = in_plane(&law, &[10.0, 40.0, 65.0], 5.0);
        for term in terms() {
            let change = |values: &[f64]| {
                let one = |point: &Point| {
                    let f = law.f_per_sr(point.i, point.o);
                    (term.scatter(values, &LawAt::new(&law, point, f), f) / f - 1.0).abs()
                };
                points.iter().map(one).fold(0.0, f64::max)
            };
            let absent: Vec<f64> = term.parameters().iter().map(|known| known.absent).collect();
            assert!(change(&absent) < 1e-12, "{}", term.name());
            for start in term.starts() {
                let inside = |(known, value): (&EffectParameter, &f64)| {
                    (known.min..=known.max).contains(value)
                };
                assert!(term.parameters().iter().zip(&start).all(inside), "{}", term.name());
                assert!(change(&start) > 1e-6, "{} {start:?}", term.name());
            }
        }
    }

    #[test]
    fn a_shifted_receiver_sees_the_peak_beside_the_mirror() {
        let mut law = base_law();
        law.set_parameter("1.m", 0.03);
        let points = in_plane(&law, &[40.0], 1.0);
        let seen = |point: &Point| {
            let f = law.f_per_sr(point.i, point.o);
            AngleOffset.scatter(&[3.0], &LawAt::new(&law, point, f), f)
        };
        let peak = |f: &dyn Fn(&Point) -> f64| {
            points.iter().max_by(|a, b| f(a).total_cmp(&f(b))).unwrap().theta_s_rad.to_degrees()
        };
        let moved = peak(&seen) - peak(&|point| law.f_per_sr(point.i, point.o));
        assert!((moved + 3.0).abs() < 0.6, "{moved}");
    }
}
