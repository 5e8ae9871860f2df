//! A stored fit made again: what a material says of a fit must follow from its own curve.

use crate::fit::{Fit, Method};
use crate::material::{self, FitReport, Material};
use crate::measure::curve::Curve;

/// Difference in ln likelihood (or half the sum of squares) that is only where the search stopped.
/// One standard deviation of a parameter is half a unit.
const OBJECTIVE_TOLERANCE: f64 = 0.01;
/// Difference in a parameter, in its standard deviations, that means the same.
const SD_TOLERANCE: f64 = 0.1;
/// The same for numbers that are known all too well, relative.
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// Fits the curve of a stored fit again, from the stored values on, with its own method and settings.
/// `None` when the fit has no report or no curve here; else what is wrong with it, or that nothing is.
pub fn refit(material: &Material, fit: &material::Fit) -> Option<Result<(), String>> {
    let report = fit.report.as_ref()?;
    let curve = material.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref())?;
    let curve = match Curve::from_observations(&curve.observations) {
        Ok(curve) => curve,
        Err(error) => return Some(Err(error.to_string())),
    };
    Some(compare(fit, report, &curve))
}

fn compare(fit: &material::Fit, report: &FitReport, curve: &Curve) -> Result<(), String> {
    let again = settings(report)?.run(&fit.model, curve).map_err(|error| error.to_string())?;
    if again.data_hash != report.data_hash {
        return Err(format!(
            "was made of data with hash {}, but its curve has {}",
            report.data_hash, again.data_hash
        ));
    }
    let (stored, found) = (report.objective, again.objective);
    if (stored - found).abs() > OBJECTIVE_TOLERANCE + RELATIVE_TOLERANCE * stored.abs() {
        return Err(format!("says that its objective is {stored}, but its curve gives {found}"));
    }
    for stored in &report.estimates {
        let (Some(sd), Some(found)) = (stored.sd, again.estimate(&stored.name)) else { continue };
        let tolerance = SD_TOLERANCE * sd + RELATIVE_TOLERANCE * stored.value.abs();
        if (stored.value - found.value).abs() > tolerance {
            return Err(format!(
                "says {} = {}, but its curve gives {}",
                stored.name, stored.value, found.value
            ));
        }
    }
    Ok(())
}

/// The settings that a report keeps.
fn settings(report: &FitReport) -> Result<Fit, String> {
    let mut fit = Fit { starts: 1, seed: report.seed, ..Fit::default() };
    let given = |name: &str| {
        let found = report.given.iter().find(|given| given.name == name);
        found.map(|given| given.value).ok_or(format!("does not say its {name}"))
    };
    fit.method = match report.method.as_str() {
        "mse" => Method::Mse { split_rad: given("method.split_rad")? },
        "tls" | "tls-tail" => Method::Tls {
            theta_sd_rad: given("method.theta_sd_rad")?,
            level_sd_db: given("method.level_sd_db")?,
        },
        "censored" => Method::Censored,
        other => return Err(format!("was made by the method `{other}`, which is not known")),
    };
    fit.looks = given("looks").ok();
    fit.noise_w = Some(report.noise_w).filter(|noise_w| *noise_w > 0.0);
    for material::Given { name, value } in &report.given {
        if let Some(path) = name.strip_suffix(".min") {
            fit.bounds.push((path.to_owned(), [*value, given(&format!("{path}.max"))?]));
        } else if name != "looks" && !name.starts_with("method.") && !name.ends_with(".max") {
            fit.fixed.push((name.clone(), *value));
        }
    }
    Ok(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::model;
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
            assert!(refit(&material, &moved).unwrap().unwrap_err().contains("objective"));
            let mut moved = fit.clone();
            let estimate = &mut moved.report.as_mut().unwrap().estimates[0];
            estimate.value += estimate.sd.unwrap();
            assert!(refit(&material, &moved).unwrap().unwrap_err().contains("but its curve gives"));
            let mut other = material.clone();
            other.curves.last_mut().unwrap().observations[3].sigma0 = Some(1e-3);
            assert!(refit(&other, fit).unwrap().unwrap_err().contains("hash"));
        }
    }
}
