//! A stored fit made again: what a material says of a fit must follow from its own curve.

use crate::fit::again::differences;
use crate::material::{self, Material};
use crate::measure::curve::Curve;

/// Fits the curve of a stored fit again, from the stored values on, with its own method and settings.
/// `None` when the fit has no report or no curve here; else what is wrong with it, or that nothing is.
pub fn refit(material: &Material, fit: &material::Fit) -> Option<Result<(), String>> {
    fit.report.as_ref()?;
    let curve = material.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref())?;
    let curve = Curve::from_observations(&curve.observations).map_err(|error| error.to_string());
    let wrong = curve.and_then(|curve| differences(fit, &curve).map_err(|error| error.to_string()));
    Some(wrong.and_then(|wrong| if wrong.is_empty() { Ok(()) } else { Err(wrong.join("; ")) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Fit, Method, model};
    use crate::material::builtin;

    /// A material with a curve and the fit of it.
    fn fitted(fit: &Fit) -> Material {
        let mut text = "theta_deg,sigma0_db\n".to_owned();
        for step in 0..60 {
            let theta_deg = f64::from(step);
            let ripple = f64::from((step * 7) % 11) / 2.0 - 2.5;
            text += &format!("{theta_deg},{}\n", ripple - theta_deg / 4.0);
        }
        let curve = Curve::read(text.as_bytes()).unwrap();
        let mut material = builtin::get("ptfe").unwrap().unwrap();
        let source = material.sources[0].key.clone();
        let found = fit.run(&model("blinn-phong").unwrap(), &curve).unwrap();
        material.fits.push(found.stored("again", "scan", &source));
        material.curves.push(material::Curve {
            name: "scan".to_owned(),
            source,
            instrument: None,
            session: None,
            observations: curve.observations(),
        });
        material
    }

    #[test]
    fn a_fit_follows_from_its_curve_and_nothing_else_does() {
        let tls = Method::Tls { theta_sd_rad: 0.01, level_sd_db: 3.0 };
        let held = vec![("alpha".to_owned(), 2.0)];
        let fits = [
            Fit::default(),
            Fit { looks: Some(3.0), ..Fit::default() },
            Fit { method: tls, fixed: held, ..Fit::default() },
        ];
        for settings in fits {
            let material = fitted(&settings);
            let fit = material.fits.last().unwrap();
            assert_eq!(refit(&material, fit), Some(Ok(())), "{settings:?}");
            assert_eq!(refit(&material, &material.fits[0]), None, "nothing was fitted there");
            let mut moved = fit.clone();
            moved.report.as_mut().unwrap().objective += 0.1;
            assert!(refit(&material, &moved).unwrap().is_err());
            let mut moved = fit.clone();
            let estimate = &mut moved.report.as_mut().unwrap().estimates[0];
            estimate.value += estimate.sd.unwrap();
            assert!(refit(&material, &moved).unwrap().is_err());
            let mut other = material.clone();
            other.curves.last_mut().unwrap().observations[3].sigma0 = Some(1e-3);
            assert!(refit(&other, fit).unwrap().is_err());
        }
    }
}
