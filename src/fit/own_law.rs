//! A law of a program's own: σ⁰ of the angle of incidence, as a function of free numbers.

use std::fmt;
use std::sync::Arc;

use thiserror::Error;

use super::settings::LOOKS;
use crate::brdf::{Brdf, Lambert, ParameterError};
use crate::material::sampled_law;

/// A free number of a law of a program's own.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnParameter {
    /// Its name.
    pub name: String,
    /// Smallest value.
    pub min: f64,
    /// Largest value, above the smallest.
    pub max: f64,
    /// Where a search starts.
    pub start: f64,
}

/// σ⁰, dB, at angles of incidence, degrees: a function of the values of the parameters, in their order, and of the angles.
pub type OwnFunction = dyn Fn(&[f64], &[f64]) -> Vec<f64> + Send + Sync;

/// A law of a program's own, of backscatter alone.
///
/// ```
/// use matdb::fit::{Fit, OwnLaw, OwnParameter};
/// use matdb::measure::curve::Curve;
/// let curve = Curve::read(b"theta_deg,sigma0_db\n0,-20\n20,-21\n40,-22\n60,-23\n")?;
/// let number = |name: &str, min, max| OwnParameter { name: name.to_owned(), min, max, start: min };
/// let straight = OwnLaw::new(
///     vec![number("level_db", -60.0, 10.0), number("slope_db_per_deg", -1.0, 1.0)],
///     |values, theta_deg| theta_deg.iter().map(|angle| values[0] + values[1] * angle).collect(),
/// )?;
/// let found = Fit { looks: Some(100.0), ..Fit::default() }.run_own(&straight, &curve)?;
/// assert!((found.estimates[1].value + 0.05).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct OwnLaw {
    parameters: Vec<OwnParameter>,
    sigma0_db: Arc<OwnFunction>,
}

/// Why parameters are none of a law.
#[derive(Debug, Error, PartialEq)]
pub enum OwnLawError {
    /// A start or a range.
    #[error(transparent)]
    Range(#[from] ParameterError),
    /// Two of a name, or that of the looks of the speckle, which a fit finds by itself.
    #[error("a parameter cannot be called `{name}`, which is taken; take another name")]
    Name {
        /// The name.
        name: String,
    },
}

/// Level of a law of nothing, dB.
const NOTHING_DB: f64 = -300.0;

impl OwnLaw {
    /// A law of its parameters and its function, which must give a level for every angle.
    ///
    /// # Errors
    /// A start outside its range; a range that is empty or not finite; a name that is taken.
    pub fn new(
        parameters: Vec<OwnParameter>,
        sigma0_db: impl Fn(&[f64], &[f64]) -> Vec<f64> + Send + Sync + 'static,
    ) -> Result<OwnLaw, OwnLawError> {
        for (number, OwnParameter { name, min, max, start }) in parameters.iter().enumerate() {
            if *name == LOOKS || parameters[..number].iter().any(|other| other.name == *name) {
                return Err(OwnLawError::Name { name: name.clone() });
            }
            let is_range = min.is_finite() && max.is_finite() && min < max;
            if !(is_range && (min..=max).contains(&start)) {
                let (path, value) = (name.clone(), *start);
                return Err(ParameterError { path, value, min: *min, max: *max }.into());
            }
        }
        Ok(OwnLaw { parameters, sigma0_db: Arc::new(sigma0_db) })
    }

    /// Its free numbers.
    pub fn parameters(&self) -> &[OwnParameter] {
        &self.parameters
    }

    /// The law at these values of the parameters, sampled; one of nothing where the function gives no levels of a law.
    pub fn at(&self, values: &[f64]) -> Brdf {
        let given = sampled_law(|angles_deg| (self.sigma0_db)(values, angles_deg));
        let law = given.or_else(|_| sampled_law(|angles_deg| vec![NOTHING_DB; angles_deg.len()]));
        law.unwrap_or(Brdf::Lambert(Lambert { albedo: 0.0 }))
    }
}

impl PartialEq for OwnLaw {
    fn eq(&self, other: &OwnLaw) -> bool {
        self.parameters == other.parameters && Arc::ptr_eq(&self.sigma0_db, &other.sigma0_db)
    }
}

impl fmt::Debug for OwnLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OwnLaw").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Scattering};
    use crate::fit::twin::Twin;
    use crate::fit::{Fit, FitError};
    use crate::measure::curve::Curve;

    fn number(name: &str, [min, max]: [f64; 2], start: f64) -> OwnParameter {
        OwnParameter { name: name.to_owned(), min, max, start }
    }

    /// The law of the model of Blinn and Phong in backscatter.
    fn lobe() -> OwnLaw {
        let parameters = vec![number("r_s", [1e-6, 1.0], 0.1), number("alpha", [1.0, 100.0], 20.0)];
        let sigma0_db = |values: &[f64], theta_deg: &[f64]| {
            let law = BlinnPhong { r_s: values[0], alpha: values[1] };
            theta_deg.iter().map(|angle| 10.0 * law.sigma0(angle.to_radians()).log10()).collect()
        };
        OwnLaw::new(parameters, sigma0_db).unwrap()
    }

    fn curve() -> Curve {
        let truth = Brdf::BlinnPhong(BlinnPhong { r_s: 0.01, alpha: 4.0 });
        Twin { model: truth, rows: 600, ..Twin::default() }.curve(3)
    }

    #[test]
    fn it_is_fitted_as_the_model_that_it_copies() {
        let quick = Fit { starts: 1, ..Fit::default() };
        let own = quick.run_own(&lobe(), &curve()).unwrap();
        let start = Brdf::BlinnPhong(BlinnPhong { r_s: 0.1, alpha: 20.0 });
        let known = quick.run(&start, &curve()).unwrap();
        assert!(own.converged && (own.objective - known.objective).abs() < 0.01);
        for (a, b) in own.estimates.iter().zip(&known.estimates) {
            assert_eq!(a.name, b.name);
            let sd = b.sd.unwrap();
            assert!((a.value - b.value).abs() < 0.05 * sd, "{a:?} {b:?}");
            assert!((a.sd.unwrap() / sd - 1.0).abs() < 0.05, "{a:?} {b:?}");
        }
        let theta_rad = 0.5;
        assert!((own.model.sigma0(theta_rad) / known.model.sigma0(theta_rad)).ln().abs() < 0.01);
        assert!(own.hold_out(&curve()).is_some());
    }

    #[test]
    fn what_is_held_stays_and_what_is_unknown_is_refused() {
        let held = |name: &str, value| {
            let fixed = vec![(name.to_owned(), value)];
            Fit { fixed, starts: 1, ..Fit::default() }.run_own(&lobe(), &curve())
        };
        let found = held("alpha", 5.0).unwrap();
        assert!(found.estimate("alpha").is_none() && found.estimate("r_s").is_some());
        let slope = |law: &Brdf| law.sigma0(1.0) / law.sigma0(0.0);
        let wanted = slope(&Brdf::BlinnPhong(BlinnPhong { r_s: 0.01, alpha: 5.0 }));
        assert!((slope(&found.model) / wanted).ln().abs() < 1e-3);
        assert!(matches!(held("beta", 1.0), Err(FitError::UnknownParameter { .. })));
        assert!(matches!(held("alpha", 1000.0), Err(FitError::Parameter(_))));
        let outside = OwnLaw::new(vec![number("m", [0.0, 1.0], 2.0)], |_, _| Vec::new());
        assert!(outside.unwrap_err().to_string().contains("m = 2"));
        for names in [["looks", "m"], ["m", "m"]] {
            let parameters = names.map(|name| number(name, [0.0, 1.0], 0.5));
            let taken = OwnLaw::new(parameters.into(), |_, _| Vec::new()).unwrap_err();
            assert!(taken.to_string().contains("which is taken"), "{taken}");
        }
    }

    #[test]
    fn relative_levels_above_any_model_are_no_matter_to_a_law_of_its_own() {
        let parameters = vec![number("R", [1e-6, 1e9], 1.0)];
        let flat = OwnLaw::new(parameters, |values, theta_deg| {
            theta_deg.iter().map(|_| 10.0 * values[0].log10()).collect()
        });
        let mut curve = curve();
        curve.illumination.relative = true;
        for row in &mut curve.observations {
            row.sigma0 = row.sigma0.map(|sigma0| 1e6 * sigma0);
            row.threshold_sigma0 = row.threshold_sigma0.map(|limit| 1e6 * limit);
        }
        let found = Fit { starts: 1, ..Fit::default() }.run_own(&flat.unwrap(), &curve);
        assert!(found.unwrap().estimate("R").unwrap().value > 1.0);
    }

    #[test]
    fn a_slope_alone_is_found() {
        let parameters = vec![number("slope_db_per_deg", [-5.0, 0.0], -0.5)];
        let falling = |values: &[f64], theta_deg: &[f64]| {
            theta_deg.iter().map(|angle| values[0] * angle - 8.4).collect()
        };
        let falling = OwnLaw::new(parameters, falling).unwrap();
        let truth = falling.at(&[-0.2]);
        let curve = Twin { model: truth, rows: 600, ..Twin::default() }.curve(3);
        let found = Fit::default().run_own(&falling, &curve).unwrap();
        let slope = found.estimate("slope_db_per_deg").unwrap();
        assert!(found.converged, "{found:?}");
        assert!((slope.value + 0.2).abs() < 4.0 * slope.sd.unwrap(), "{slope:?}");
    }

    #[test]
    fn a_function_of_no_levels_ends_a_fit_without_a_panic() {
        for levels in [Vec::new(), vec![f64::NAN; 1025], vec![f64::INFINITY; 1025]] {
            let parameters = vec![number("m", [0.1, 1.0], 0.5)];
            let law = OwnLaw::new(parameters, move |_, _| levels.clone()).unwrap();
            let found = Fit { starts: 1, ..Fit::default() }.run_own(&law, &curve()).unwrap();
            assert!(found.estimate("m").unwrap().sd.is_none());
        }
    }
}
