//! Every scattering model that can be stored, one file each, and the type that is any of them.

mod weighted;

use serde::{Deserialize, Serialize};

use super::backscatter::Term;
use super::kind::Kind;
use super::parameter::{Parameter, ParameterError, Visitor};
use super::scattering::{Scattering, ScatteringModel};
use crate::frames::{Direction, Surface};

pub use cook_torrance::Shadowing;
pub use kirchhoff::Correlation;
pub use layered::Layer;
pub use tabulated::TabulatedError;

/// Levels of models in models that can be stored; deeper ones could not be read everywhere.
pub const MOST_LEVELS: usize = 8;

/// Models within one that can be stored, itself included.
pub const MOST_MODELS: usize = 64;

/// Declares the file of every model and makes of them the type [`Brdf`].
macro_rules! models {
    ($($file:ident::$model:ident $(<$part:ty>)?),+ $(,)?) => {
        $(
            mod $file;
            pub use $file::$model;
        )+

        /// Every model that can be stored in a database or a material file, told apart by `model`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "model", rename_all = "kebab-case")]
        pub enum Brdf {
            $(
                #[allow(missing_docs)]
                $model($model $(<$part>)?),
            )+
        }

        impl Brdf {
            /// What is known of every kind of model.
            pub const KINDS: &[Kind] = &[$($file::KIND),+];

            fn model(&self) -> &dyn ScatteringModel {
                match self {
                    $(Brdf::$model(model) => model,)+
                }
            }

            fn model_mut(&mut self) -> &mut dyn ScatteringModel {
                match self {
                    $(Brdf::$model(model) => model,)+
                }
            }
        }
    };
}

// Another model is a file and a line of this list. `cargo fmt` does not follow modules in a macro:
// `rustfmt src/brdf/models/*.rs` does them.
models! {
    lambert::Lambert,
    blinn_phong::BlinnPhong,
    cook_torrance::CookTorrance,
    tabulated::Tabulated,
    mixture::Mixture<Brdf>,
    sum::Sum<Brdf>,
    fresnel::Fresnel,
    layered::Layered,
    kirchhoff::Kirchhoff,
    kirchhoff_go::KirchhoffGo,
    directive::Directive,
}

impl Scattering for Brdf {
    /// Zero below the horizon, where a model by itself is not to be asked.
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        if is_below_horizon(i, o) { 0.0 } else { self.model().f_per_sr(i, o) }
    }

    fn f_and_specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> (f64, f64) {
        if is_below_horizon(i, o) {
            return (0.0, 0.0);
        }
        self.model().f_and_specular_share(i, o)
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        self.model().backscatter()
    }
}

fn is_below_horizon(i: Direction<Surface>, o: Direction<Surface>) -> bool {
    i.cos_theta() <= 0.0 || o.cos_theta() <= 0.0
}

impl ScatteringModel for Brdf {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        self.model_mut().visit_parameters(prefix, visitor);
    }

    fn is_smooth(&self) -> bool {
        self.model().is_smooth()
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        self.model().permittivity()
    }

    fn f_lambda(&self) -> Option<f64> {
        self.model().f_lambda()
    }

    fn has_curve(&self) -> bool {
        self.model().has_curve()
    }
}

impl Brdf {
    /// Every free number of the model with its unit and range, in a fixed order.
    ///
    /// Paths name the place in a mixture: `k`, `specular.m`, `diffuse.alpha`.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut found = Vec::new();
        self.clone().visit_parameters("", &mut |parameter, _| found.push(parameter));
        found
    }

    /// Sets one parameter by its path; `false` when the model has none of that path.
    pub fn set_parameter(&mut self, path: &str, value: f64) -> bool {
        let mut known = false;
        self.visit_parameters("", &mut |parameter, slot| {
            if parameter.path == path {
                *slot = value;
                known = true;
            }
        });
        known
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

    /// The models that this one is made of; none except for a mixture and a sum.
    fn parts(&self) -> Vec<&Brdf> {
        match self {
            Brdf::Mixture(Mixture { diffuse, specular, .. }) => vec![&**diffuse, &**specular],
            Brdf::Sum(Sum { parts }) => parts.iter().collect(),
            _ => Vec::new(),
        }
    }

    /// The sum of a quantity of the models without parts that this one is made of, each by its weight.
    pub fn sum_over_parts(&self, of: &dyn Fn(&Brdf) -> f64) -> f64 {
        match self {
            Brdf::Mixture(mixture) => {
                mixture.weighted().map(|(weight, part)| weight * part.sum_over_parts(of)).sum()
            }
            Brdf::Sum(sum) => sum.parts.iter().map(|part| part.sum_over_parts(of)).sum(),
            model => of(model),
        }
    }

    /// The two levels that monostatic data determine of the paper's five-parameter mixture, up to the
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
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::brdf::Distribution;
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

    pub(in crate::brdf) fn every_model() -> Vec<Brdf> {
        let mut models = every_isotropic_model();
        models.extend(anisotropic_models());
        for (name, json) in Brdf::KINDS.iter().flat_map(|kind| kind.starts) {
            models.push(serde_json::from_str(json).expect(name));
        }
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
    fn the_enum_answers_as_the_model_by_itself() {
        for model in every_model() {
            for (theta_i, theta_o, azimuth) in [(0.0, 0.0, 0.0), (0.2, 0.2, 0.0), (0.4, 1.1, 2.0)] {
                let i = Direction::from_angles(theta_i, 0.3);
                let o = Direction::from_angles(theta_o, 0.3 + azimuth);
                let alone = model.model();
                assert_eq!(model.f_per_sr(i, o), alone.f_per_sr(i, o), "{model:?}");
                let shares = [model.f_and_specular_share(i, o), alone.f_and_specular_share(i, o)];
                assert_eq!(shares[0], shares[1], "{model:?}");
                assert_eq!(model.specular_share(i, o), alone.specular_share(i, o), "{model:?}");
                assert_eq!(model.sigma0(theta_i), alone.sigma0(theta_i), "{model:?}");
            }
            assert_eq!(model.backscatter(), model.model().backscatter(), "{model:?}");
            assert_eq!(model.is_smooth(), model.model().is_smooth(), "{model:?}");
            assert_eq!(model.permittivity(), model.model().permittivity(), "{model:?}");
            assert_eq!(model.f_lambda(), model.model().f_lambda(), "{model:?}");
            assert_eq!(model.has_curve(), model.model().has_curve(), "{model:?}");
        }
    }

    /// What is wrapped in the enum and what is not must not differ in what reflects like a mirror.
    #[test]
    fn models_of_facets_are_specular_by_themselves() {
        let i = Direction::from_angles(0.2, 0.0);
        let share = |model: &dyn Scattering| model.specular_share(i, i);
        for model in every_model() {
            match &model {
                Brdf::CookTorrance(model) => assert_eq!(share(model), 1.0),
                Brdf::Fresnel(model) => assert_eq!(share(model), 1.0),
                Brdf::Layered(model) => assert_eq!(share(model), 1.0),
                Brdf::Kirchhoff(model) => assert_eq!(share(model), 1.0),
                Brdf::KirchhoffGo(model) => assert_eq!(share(model), 1.0),
                Brdf::Mixture(model) => assert!(share(model) > 0.0 && share(model) < 1.0),
                Brdf::Sum(model) => assert!(share(model) > 0.0 && share(model) < 1.0),
                Brdf::Lambert(model) => assert_eq!(share(model), 0.0),
                _ => {}
            }
        }
    }

    /// The keys of a kind are those that its models are written with, in that order.
    #[test]
    fn every_kind_has_its_name_and_its_keys() {
        let mut seen = Vec::new();
        for model in every_model() {
            let json = serde_json::to_string(&model).unwrap();
            let name = json.split('"').nth(3).unwrap();
            let kind = Brdf::KINDS.iter().find(|kind| kind.name == name).unwrap();
            seen.push(kind.name);
            let written = serde_json::to_value(&model).unwrap();
            let written = written.as_object().unwrap();
            let required = kind.keys.iter().filter(|key| key.required);
            assert!(required.clone().all(|key| written.contains_key(key.name)), "{json}");
            let is_known = |key: &&String| kind.keys.iter().any(|known| known.name == **key);
            assert_eq!(written.keys().filter(is_known).count(), written.len() - 1, "{json}");
            for parameter in model.parameters() {
                let (key, _) = parameter.path.split_once('.').unwrap_or((&parameter.path, ""));
                let is_part = key.parse::<usize>().is_ok();
                assert!(is_part || written.contains_key(key), "{}", parameter.path);
            }
        }
        for kind in Brdf::KINDS {
            assert!(seen.contains(&kind.name), "give every_model one of `{}`", kind.name);
        }
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
