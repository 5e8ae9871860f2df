//! Every scattering model that can be stored, one file each, and the type that is any of them.

#[cfg(test)]
pub(super) mod tests;
mod weighted;

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use super::backscatter::Term;
use super::kind::Kind;
use super::lobe::Lobe;
use super::parameter::{Parameter, ParameterError, Visitor};
use super::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use super::validity::Condition;
use crate::frames::{Direction, Surface};

pub use cook_torrance::Shadowing;
pub use kirchhoff::Correlation;
pub use layered::{Amplitudes, Layer};
pub use tabulated::TabulatedError;

/// Levels of models in models that can be stored; deeper ones could not be read everywhere.
pub const MOST_LEVELS: usize = 8;

/// Models within one that can be stored, itself included.
pub const MOST_MODELS: usize = 64;

/// Declares the file of every model, and the type [`Brdf`] that is any of them.
macro_rules! models {
    ($($file:ident::$model:ident $(<$part:ty>)?),+ $(,)?) => {
        $(
            mod $file;
            pub use $file::$model;
        )+

        /// Every model that can be stored in a database or a material file, which the key `model` names.
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

            // These two are called for every ray: static calls, since dynamic ones take a third longer.

            fn f_above_horizon_per_sr(
                &self,
                i: Direction<Surface>,
                o: Direction<Surface>,
            ) -> f64 {
                match self {
                    $(Brdf::$model(model) => model.f_per_sr(i, o),)+
                }
            }

            fn seen_above_horizon(
                &self,
                beam_rad: f64,
                i: Direction<Surface>,
                o: Direction<Surface>,
            ) -> Seen {
                match self {
                    $(Brdf::$model(model) => model.seen_by(beam_rad, i, o),)+
                }
            }

            // All else forwards by these.

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
    /// Zero below the horizon, where a model by itself is not defined.
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        if is_below_horizon(i, o) { 0.0 } else { self.f_above_horizon_per_sr(i, o) }
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if is_below_horizon(i, o) {
            Seen::default()
        } else {
            self.seen_above_horizon(beam_rad, i, o)
        }
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        self.model().facet_amplitudes(i, o)
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        self.model().narrow_lobes(i)
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if is_below_horizon(i, o) {
            Seen::default()
        } else {
            self.model().apart_from_narrow_lobes(i, o)
        }
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        self.model().backscatter()
    }

    fn lobes(&self) -> Option<Vec<Lobe>> {
        self.model().lobes()
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

    fn has_smooth_mirror(&self) -> bool {
        self.model().has_smooth_mirror()
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

    fn lobe_rad(&self, beam_rad: f64) -> Option<f64> {
        let parts = self.parts();
        if parts.is_empty() {
            return self.model().lobe_rad(beam_rad);
        }
        parts.into_iter().filter_map(|part| part.lobe_rad(beam_rad)).min_by(f64::total_cmp)
    }

    fn conditions(&self, wavelength_m: f64, rms_height_m: Option<f64>) -> Vec<Condition> {
        let mut conditions = self.model().conditions(wavelength_m, rms_height_m);
        for part in self.parts() {
            conditions.extend(part.conditions(wavelength_m, rms_height_m));
        }
        conditions
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

    /// Paths of the parameters that are widths of lobes, as tangents or in rad.
    pub fn lobe_widths(&self) -> Vec<String> {
        const NAMES: [&str; 4] = ["m", "m_across", "rms_slope", "lobe_rad"];
        let paths = self.parameters().into_iter().map(|parameter| parameter.path);
        paths
            .filter(|path| path.rsplit('.').next().is_some_and(|name| NAMES.contains(&name)))
            .collect()
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
        let mut models = 0;
        let mut level = vec![self];
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
            Brdf::Mixture(mixture) => mixture.weighted().map(|(_, part)| part).collect(),
            Brdf::Sum(sum) => sum.parts.iter().collect(),
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
