//! Scattering models: bidirectional reflectance f(i, o) in 1/sr, seen from the surface's own frame.
//!
//! `i` points to the source and `o` to the receiver, both away from the surface; z is the normal.
//! Radar data are the monostatic case i = o. Below the horizon every model returns zero.
//!
//! | model | file | equation |
//! |---|---|---|
//! | [`Mixture`] of a diffuse and a specular part | `mixture.rs` | (12) |
//! | [`CookTorrance`] | `cook_torrance.rs` | (13), (14) |
//! | [`BlinnPhong`] | `blinn_phong.rs` | (15) |
//! | [`Lambert`] | `lambert.rs` | f = ρ/π |
//! | [`Tabulated`], a measured curve as it is | `tabulated.rs` | (10) solved for f |
//! | [`Sum`] of any models | `sum.rs` | f = Σ f_p |
//! | [`Fresnel`], a smooth half space | `fresnel.rs` | R of ε as a narrow lobe |
//! | [`Layered`], smooth layers on one | `layered.rs` | R of the stack as a narrow lobe |
//! | [`Kirchhoff`], a rough surface by its heights | `kirchhoff.rs` | physical optics, series |
//! | [`KirchhoffGo`], the same by its slopes | `kirchhoff_go.rs` | its geometric-optics limit |
//! | [`Directive`], lobes of effective roughness | `directive.rs` | Degli-Esposti et al. 2007 |
//!
//! ```
//! use matdb::brdf::{Lambert, Scattering};
//! let chalk = Lambert { albedo: 0.8 };
//! // Equation (10) at 60°: 4π · 0.8/π · cos² 60°.
//! assert!((chalk.sigma0(60f64.to_radians()) - 0.8).abs() < 1e-12);
//! ```

mod backscatter;
mod blinn_phong;
mod cook_torrance;
mod directive;
mod fresnel;
mod kirchhoff;
mod kirchhoff_go;
mod lambert;
mod layered;
mod mixture;
mod outline;
mod parameter;
mod permittivity;
mod sum;
mod tabulated;

use serde::{Deserialize, Serialize};

use crate::frames::{Direction, Surface};

pub(crate) use backscatter::Retro;
pub use backscatter::{Facets, Term};
pub use blinn_phong::BlinnPhong;
pub use cook_torrance::{CookTorrance, Distribution, Shadowing};
pub use directive::Directive;
pub use fresnel::Fresnel;
pub use kirchhoff::{Correlation, Kirchhoff};
pub use kirchhoff_go::KirchhoffGo;
pub use lambert::Lambert;
pub use layered::{Layer, Layered};
pub use mixture::Mixture;
pub use outline::{DEGREES, Outline};
pub use parameter::{Parameter, ParameterError};
pub use sum::Sum;
pub use tabulated::{Tabulated, TabulatedError};

use parameter::Visitor;

/// Anything that scatters. A closure `Fn(i, o) -> f` is one, so a caller's own model needs no type.
///
/// ```
/// use matdb::brdf::Scattering;
/// use matdb::frames::{Direction, Surface};
/// let mine = |i: Direction<Surface>, o: Direction<Surface>| 0.1 * i.cos_theta() * o.cos_theta();
/// assert!((mine.retro_per_sr(0.0) - 0.1).abs() < 1e-15);
/// ```
pub trait Scattering: Sync {
    /// f(i, o), 1/sr: reflected radiance per incident irradiance, equation (9).
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64;

    /// f(i, o), 1/sr, and the share of it, 0 to 1, that facets reflect like mirrors, rough or not; the
    /// rest is diffuse. A model that cannot tell, such as a closure or a measured curve, counts as diffuse.
    fn f_and_specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> (f64, f64) {
        (self.f_per_sr(i, o), 0.0)
    }

    /// The second of [`f_and_specular_share`](Scattering::f_and_specular_share).
    fn specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.f_and_specular_share(i, o).1
    }

    /// f in exact backscatter as a sum of closed forms; none for a law with a grain, or that has no such sum.
    fn backscatter(&self) -> Option<Vec<Term>> {
        None
    }

    /// f in exact backscatter at incidence `theta_rad`, 1/sr.
    fn retro_per_sr(&self, theta_rad: f64) -> f64 {
        let i = Direction::from_angles(theta_rad, 0.0);
        self.f_per_sr(i, i)
    }

    /// Equation (10): differential scattering coefficient σ⁰(θ) = 4π·f(θ)·cos²θ, a pure number.
    fn sigma0(&self, theta_rad: f64) -> f64 {
        4.0 * std::f64::consts::PI * self.retro_per_sr(theta_rad) * theta_rad.cos().powi(2)
    }
}

impl<F> Scattering for F
where
    F: Fn(Direction<Surface>, Direction<Surface>) -> f64 + Sync,
{
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self(i, o)
    }
}

/// Levels of models in models that can be stored; deeper ones could not be read everywhere.
pub const MOST_LEVELS: usize = 8;

/// Models within one that can be stored, itself included.
pub const MOST_MODELS: usize = 64;

/// Every model that can be stored in a database or a material file, told apart by `model`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "kebab-case")]
pub enum Brdf {
    #[allow(missing_docs)]
    Lambert(Lambert),
    #[allow(missing_docs)]
    BlinnPhong(BlinnPhong),
    #[allow(missing_docs)]
    CookTorrance(CookTorrance),
    #[allow(missing_docs)]
    Tabulated(Tabulated),
    #[allow(missing_docs)]
    Mixture(Mixture),
    #[allow(missing_docs)]
    Sum(Sum),
    #[allow(missing_docs)]
    Fresnel(Fresnel),
    #[allow(missing_docs)]
    Layered(Layered),
    #[allow(missing_docs)]
    Kirchhoff(Kirchhoff),
    #[allow(missing_docs)]
    KirchhoffGo(KirchhoffGo),
    #[allow(missing_docs)]
    Directive(Directive),
}

impl Brdf {
    /// Every free number of the model with its unit and range, in a fixed order.
    ///
    /// Paths name the place in a mixture: `k`, `specular.m`, `diffuse.alpha`.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut found = Vec::new();
        self.clone().visit("", &mut |parameter, _| found.push(parameter));
        found
    }

    /// Sets one parameter by its path; `false` when the model has none of that path.
    pub fn set_parameter(&mut self, path: &str, value: f64) -> bool {
        let mut known = false;
        self.visit("", &mut |parameter, slot| {
            if parameter.path == path {
                *slot = value;
                known = true;
            }
        });
        known
    }

    /// The two levels that monostatic data can tell of the paper's five-parameter mixture, up to the
    /// calibration: S = (1 − k)·f_λ and R = k·r_s. `None` for other models.
    pub fn identified_products(&self) -> Option<[f64; 2]> {
        let Brdf::Mixture(Mixture { k, diffuse, specular }) = self else { return None };
        match (&**specular, &**diffuse) {
            (Brdf::CookTorrance(specular), Brdf::BlinnPhong(diffuse)) => {
                Some([(1.0 - k) * specular.f_lambda, k * diffuse.r_s])
            }
            _ => None,
        }
    }

    /// Checks every parameter against its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.parameters().iter().try_for_each(Parameter::validate)
    }

    /// Checks how deep parts stand in parts, at most [`MOST_LEVELS`], and how many models there are in all, at
    /// most [`MOST_MODELS`].
    ///
    /// # Errors
    /// When there are more, in words for a sentence.
    pub fn check_size(&self) -> Result<(), String> {
        let mut level = vec![self];
        let mut models = 0;
        for depth in 1.. {
            models += level.len();
            if models > MOST_MODELS {
                return Err(format!("it has more than {MOST_MODELS} models in it"));
            }
            if depth > MOST_LEVELS {
                return Err(format!("parts stand in parts more than {MOST_LEVELS} deep"));
            }
            level = level.into_iter().flat_map(Brdf::parts).collect();
            if level.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// The models that this one is made of; none but for a mixture and a sum.
    fn parts(&self) -> Vec<&Brdf> {
        match self {
            Brdf::Mixture(Mixture { diffuse, specular, .. }) => vec![&**diffuse, &**specular],
            Brdf::Sum(Sum { parts }) => parts.iter().collect(),
            _ => Vec::new(),
        }
    }

    fn visit(&mut self, prefix: &str, visitor: &mut Visitor) {
        match self {
            Brdf::Lambert(model) => model.visit(prefix, visitor),
            Brdf::BlinnPhong(model) => model.visit(prefix, visitor),
            Brdf::CookTorrance(model) => model.visit(prefix, visitor),
            Brdf::Tabulated(_) => {}
            Brdf::Mixture(model) => model.visit(prefix, visitor),
            Brdf::Sum(model) => model.visit(prefix, visitor),
            Brdf::Fresnel(model) => model.visit(prefix, visitor),
            Brdf::Layered(model) => model.visit(prefix, visitor),
            Brdf::Kirchhoff(model) => model.visit(prefix, visitor),
            Brdf::KirchhoffGo(model) => model.visit(prefix, visitor),
            Brdf::Directive(model) => model.visit(prefix, visitor),
        }
    }
}

impl Scattering for Brdf {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        if i.cos_theta() <= 0.0 || o.cos_theta() <= 0.0 {
            return 0.0;
        }
        match self {
            Brdf::Lambert(model) => model.f_per_sr(i, o),
            Brdf::BlinnPhong(model) => model.f_per_sr(i, o),
            Brdf::CookTorrance(model) => model.f_per_sr(i, o),
            Brdf::Tabulated(model) => model.f_per_sr(i, o),
            Brdf::Mixture(model) => model.f_per_sr(i, o),
            Brdf::Sum(model) => model.f_per_sr(i, o),
            Brdf::Fresnel(model) => model.f_per_sr(i, o),
            Brdf::Layered(model) => model.f_per_sr(i, o),
            Brdf::Kirchhoff(model) => model.f_per_sr(i, o),
            Brdf::KirchhoffGo(model) => model.f_per_sr(i, o),
            Brdf::Directive(model) => model.f_per_sr(i, o),
        }
    }

    fn f_and_specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> (f64, f64) {
        let share = match self {
            Brdf::Lambert(_) | Brdf::BlinnPhong(_) | Brdf::Tabulated(_) | Brdf::Directive(_) => 0.0,
            Brdf::CookTorrance(_) | Brdf::Fresnel(_) | Brdf::Layered(_) => 1.0,
            Brdf::Kirchhoff(_) | Brdf::KirchhoffGo(_) => 1.0,
            Brdf::Mixture(model) => return model.f_and_specular_share(i, o),
            Brdf::Sum(model) => return model.f_and_specular_share(i, o),
        };
        (self.f_per_sr(i, o), share)
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        match self {
            Brdf::Lambert(model) => model.backscatter(),
            Brdf::BlinnPhong(model) => model.backscatter(),
            Brdf::CookTorrance(model) => model.backscatter(),
            Brdf::Mixture(model) => model.backscatter(),
            Brdf::Sum(model) => model.backscatter(),
            Brdf::Fresnel(model) => model.backscatter(),
            Brdf::Layered(model) => model.backscatter(),
            Brdf::KirchhoffGo(model) => model.backscatter(),
            Brdf::Tabulated(_) | Brdf::Kirchhoff(_) | Brdf::Directive(_) => None,
        }
    }
}

/// f of weighted parts that add up in power, 1/sr, and its specular share.
fn f_and_specular_share<'a>(
    parts: impl Iterator<Item = (f64, &'a Brdf)>,
    i: Direction<Surface>,
    o: Direction<Surface>,
) -> (f64, f64) {
    let (all, specular) = parts.fold((0.0, 0.0), |(all, specular), (weight, part)| {
        let (f, share) = part.f_and_specular_share(i, o);
        (all + weight * f, specular + weight * f * share)
    });
    (all, if all > 0.0 { specular / all } else { 0.0 })
}

/// h = (i + o)/|i + o|, the normal of a facet that would mirror i into o.
fn half_vector(i: Direction<Surface>, o: Direction<Surface>) -> Direction<Surface> {
    Direction::new(i.xyz() + o.xyz()).unwrap_or(i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn every_isotropic_model() -> Vec<Brdf> {
        let cook_torrance = |distribution, shadowing| CookTorrance {
            f_lambda: 0.3,
            m: 0.2,
            m_across: None,
            distribution,
            shadowing,
        };
        let blinn_phong = BlinnPhong { r_s: 0.2, alpha: 3.0 };
        let beckmann = cook_torrance(Distribution::Beckmann, Shadowing::Separable);
        let mut models = vec![
            Brdf::Lambert(Lambert { albedo: 0.7 }),
            Brdf::BlinnPhong(blinn_phong),
            Brdf::Tabulated(Tabulated::new(&[(0.0, 2.0), (0.3, 0.1), (1.2, 0.01)]).unwrap()),
            Brdf::Mixture(Mixture {
                k: 0.4,
                diffuse: Box::new(Brdf::BlinnPhong(blinn_phong)),
                specular: Box::new(Brdf::CookTorrance(beckmann)),
            }),
        ];
        models.push(Brdf::Sum(Sum { parts: models.clone() }));
        models.extend(smooth_models());
        models.extend(rough_models());
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for shadowing in [Shadowing::Separable, Shadowing::Correlated] {
                models.push(Brdf::CookTorrance(cook_torrance(distribution, shadowing)));
            }
        }
        models
    }

    pub(super) fn every_model() -> Vec<Brdf> {
        let mut models = every_isotropic_model();
        models.extend(anisotropic_models());
        models
    }

    fn smooth_models() -> Vec<Brdf> {
        let (eps_real, eps_imag, lobe_rad) = (4.67, 5.0, 0.1);
        let layers = vec![Layer { thickness_m: 3e-4, eps_real: 2.6, eps_imag: 0.1 }];
        let frequency_hz = 300e9;
        vec![
            Brdf::Fresnel(Fresnel { eps_real, eps_imag, lobe_rad }),
            Brdf::Layered(Layered { layers, eps_real, eps_imag, frequency_hz, lobe_rad }),
        ]
    }

    fn rough_models() -> Vec<Brdf> {
        let (eps_real, eps_imag, lobe_rad, frequency_hz) = (4.67, 5.0, 0.1, 300e9);
        let kirchhoff = |rms_height_m, correlation| {
            let correlation_length_m = 1e-3;
            Brdf::Kirchhoff(Kirchhoff {
                rms_height_m,
                correlation_length_m,
                correlation,
                eps_real,
                eps_imag,
                frequency_hz,
                lobe_rad,
            })
        };
        vec![
            kirchhoff(5e-5, Correlation::Gaussian),
            kirchhoff(3e-4, Correlation::Gaussian),
            kirchhoff(5e-5, Correlation::Exponential),
            Brdf::KirchhoffGo(KirchhoffGo { rms_slope: 0.2, eps_real, eps_imag }),
            Brdf::Directive(Directive { s: 0.4, alpha_r: 4.0, lambda: 1.0, alpha_i: 1.0 }),
            Brdf::Directive(Directive { s: 0.4, alpha_r: 30.0, lambda: 0.6, alpha_i: 2.5 }),
        ]
    }

    fn anisotropic_models() -> Vec<Brdf> {
        let brushed = |distribution| {
            let shadowing = Shadowing::Correlated;
            let (m, m_across) = (0.1, Some(0.4));
            Brdf::CookTorrance(CookTorrance { f_lambda: 0.9, m, m_across, distribution, shadowing })
        };
        vec![brushed(Distribution::Beckmann), brushed(Distribution::Ggx)]
    }

    proptest! {
        #[test]
        fn every_model_is_reciprocal_finite_and_not_negative(
            ti in 0.0f64..1.57, to in 0.0f64..1.57, pi in -3.1f64..3.1, po in -3.1f64..3.1,
        ) {
            let (i, o) = (Direction::from_angles(ti, pi), Direction::from_angles(to, po));
            for model in every_model() {
                let (there, back) = (model.f_per_sr(i, o), model.f_per_sr(o, i));
                prop_assert!(there >= 0.0 && there.is_finite(), "{model:?}: {there}");
                prop_assert!((there - back).abs() <= 1e-12 * there.abs(), "{model:?}");
            }
        }

        #[test]
        fn every_model_without_a_grain_is_isotropic(ti in 0.0f64..1.5, to in 0.0f64..1.5, turn in -3.0f64..3.0) {
            for model in every_isotropic_model() {
                let f = |azimuth: f64| model.f_per_sr(
                    Direction::from_angles(ti, azimuth),
                    Direction::from_angles(to, azimuth + 1.0),
                );
                prop_assert!((f(0.0) - f(turn)).abs() <= 1e-9 * f(0.0).abs());
            }
        }
    }

    #[test]
    fn the_specular_share_is_that_of_the_powers() {
        let i = Direction::from_angles(0.2, 0.0);
        let Brdf::Mixture(mixture) = every_model().remove(3) else { panic!("not the mixture") };
        let specular = 0.6 * mixture.specular.f_per_sr(i, i);
        let expected = specular / mixture.f_per_sr(i, i);
        assert!(expected > 0.1 && expected < 0.9, "{expected}");
        assert!((mixture.specular_share(i, i) - expected).abs() < 1e-12);
        let parts = vec![Brdf::Mixture(mixture.clone()), Brdf::Lambert(Lambert { albedo: 0.7 })];
        let sum = Sum { parts };
        let expected = specular / sum.f_per_sr(i, i);
        assert!((sum.specular_share(i, i) - expected).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_scattered_below_the_horizon() {
        let (up, down) = (Direction::from_angles(0.3, 0.0), Direction::from_angles(2.0, 0.0));
        for model in every_model() {
            assert_eq!(model.f_per_sr(up, down), 0.0);
            assert_eq!(model.f_per_sr(down, up), 0.0);
        }
    }

    #[test]
    fn parameters_can_be_read_set_and_checked_by_path() {
        let mut model = every_model().remove(3);
        let paths: Vec<_> = model.parameters().into_iter().map(|p| p.path).collect();
        assert_eq!(paths, ["k", "diffuse.r_s", "diffuse.alpha", "specular.f_lambda", "specular.m"]);
        assert!(model.set_parameter("specular.m", 0.0));
        assert!(!model.set_parameter("specular.n", 0.1));
        let message = model.validate().unwrap_err().to_string();
        assert!(message.contains("specular.m = 0"), "{message}");
    }

    #[test]
    fn models_survive_json() {
        for model in every_model() {
            let text = serde_json::to_string(&model).unwrap();
            let back: Brdf = serde_json::from_str(&text).unwrap();
            for theta_rad in [0.0, 0.1, 0.5, 1.0, 1.4] {
                let (a, b) = (model.sigma0(theta_rad), back.sigma0(theta_rad));
                assert!((a - b).abs() <= 1e-12 * a, "{text}");
            }
        }
    }
}
