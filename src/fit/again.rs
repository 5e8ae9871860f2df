//! Repeats a stored fit and says whether its curve and its settings still give it.

mod compare;

use super::coordinates::LOOKS;
use super::error::FitError;
use super::models::{model, model_names};
use super::settings::{Fit, Method};
use crate::brdf::Brdf;
use crate::material::{self, BEAM, FitReport, FixedNumber, Material};
use crate::measure::curve::Curve;

/// Estimators of fits that this program made.
const METHODS: [&str; 4] = ["censored", "mse", "tls", "tls-tail"];

/// The settings that a fit was made with; `None` where its report does not say them.
pub fn settings(report: &FitReport) -> Option<Fit> {
    let method = match report.method.as_str() {
        "censored" => Method::Censored,
        "mse" => Method::Mse { split_rad: given(report, "method.split_rad")? },
        "tls" | "tls-tail" => Method::Tls {
            theta_sd_rad: given(report, "method.theta_sd_rad")?,
            level_sd_db: given(report, "method.level_sd_db")?,
        },
        _ => return None,
    };
    let (mut fixed, mut bounds) = (Vec::new(), Vec::new());
    for FixedNumber { name, value } in &report.given {
        if let Some(path) = name.strip_suffix(".min") {
            let max = given(report, &format!("{path}.max"));
            bounds.extend(max.map(|max| (path.to_owned(), [*value, max])));
        } else if !name.ends_with(".max")
            && !name.starts_with("method.")
            && ![LOOKS, BEAM].contains(&name.as_str())
        {
            fixed.push((name.clone(), *value));
        }
    }
    Some(Fit {
        method,
        fixed,
        bounds,
        looks: given(report, LOOKS),
        beam_rad: given(report, BEAM),
        noise_w: Some(report.noise_w).filter(|noise_w| *noise_w > 0.0),
        starts: report.starts as usize,
        seed: report.seed,
    })
}

fn given(report: &FitReport, name: &str) -> Option<f64> {
    report.given.iter().find(|given| given.name == name).map(|given| given.value)
}

/// Whether a fit says that this program made it but has no report.
pub fn lacks_report(fit: &material::Fit) -> bool {
    fit.curve.is_some() && fit.report.is_none() && METHODS.contains(&fit.estimator.as_str())
}

/// What is wrong with a material's fit, a sentence each: it must follow from its own curve. `None` when
/// the fit has no report, or no curve here.
pub fn problems(material: &Material, fit: &material::Fit) -> Option<Vec<String>> {
    fit.report.as_ref()?;
    let curve = material.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref())?;
    let curve = match Curve::of_material(curve) {
        Ok(curve) => curve,
        Err(error) => return Some(vec![error.to_string()]),
    };
    if fit.beam_rad().is_some_and(|beam_rad| curve.illumination.beam_rad != Some(beam_rad)) {
        return Some(vec!["its beam is not that of its curve".to_owned()]);
    }
    let found = differences(fit, &curve).unwrap_or_else(|error| vec![error.to_string()]);
    if found.is_empty() {
        return Some(found);
    }
    for start in starts(material, fit) {
        if differences_from(fit, &start, &curve).is_ok_and(|found| found.is_empty()) {
            return Some(Vec::new());
        }
    }
    // A search that had fewer starts may have ended in another optimum, which is still found from where it is.
    let mut alone = fit.clone();
    alone.report.iter_mut().for_each(|report| report.starts = 1);
    let near = differences(&alone, &curve).unwrap_or_else(|error| vec![error.to_string()]);
    Some(if near.is_empty() { near } else { found })
}

/// Models from which the search may have started. A report does not say it, and the result depends on it where the data
/// hardly determine the numbers, or where pieces are fitted one after the other.
fn starts(material: &Material, fit: &material::Fit) -> Vec<Brdf> {
    let same = paths(&fit.model);
    let others = material.fits.iter().map(|other| other.model.clone());
    let named = model_names().filter_map(model);
    named.chain(others).filter(|start| paths(start) == same).collect()
}

fn paths(model: &Brdf) -> Vec<String> {
    model.parameters().into_iter().map(|parameter| parameter.path).collect()
}

/// Fits the curve of a stored fit again, from what was found, and says what differs, a sentence each.
/// Nothing is said of a fit without a report.
///
/// # Errors
/// When the curve cannot be fitted with these settings.
pub fn differences(stored: &material::Fit, curve: &Curve) -> Result<Vec<String>, FitError> {
    differences_from(stored, &stored.model, curve)
}

fn differences_from(
    stored: &material::Fit,
    start: &Brdf,
    curve: &Curve,
) -> Result<Vec<String>, FitError> {
    let Some(report) = &stored.report else { return Ok(Vec::new()) };
    if stored.lobes.is_of_both() == stored.beam_rad().is_some() {
        return Ok(vec!["it does not have the lobes that its report says".to_owned()]);
    }
    let Some(fit) = settings(report) else {
        let method = &report.method;
        return Ok(vec![format!("the report does not say how the fit `{method}` was made")]);
    };
    let found = fit.run(start, curve)?;
    if found.data_hash != report.data_hash {
        return Ok(vec!["the curve is not the one that was fitted".to_owned()]);
    }
    Ok(compare::compare(stored, &found, curve))
}

#[cfg(test)]
mod tests {
    use super::super::twin::{Twin, mixture};
    use super::*;
    use crate::material::builtin;

    #[test]
    fn a_fit_is_found_again_and_a_changed_one_is_not() {
        let curve = Twin { rows: 300, ..Twin::default() }.curve(3);
        let fixed = vec![("diffuse.alpha".to_owned(), 3.0)];
        let bounds = vec![("specular.m".to_owned(), [0.01, 1.0])];
        let fit = Fit { fixed, bounds, looks: Some(1.0), starts: 1, seed: 7, ..Fit::default() };
        let found = fit.run(&mixture(0.1, 3.0, 0.02, 0.004), &curve).unwrap();
        let mut stored = found.stored("fit", "scan", "bench");
        assert_eq!(settings(stored.report.as_ref().unwrap()), Some(fit));
        assert_eq!(differences(&stored, &curve), Ok(Vec::new()));
        let other = Twin { rows: 300, ..Twin::default() }.curve(4);
        let said = differences(&stored, &other).unwrap();
        assert!(said[0].contains("not the one that was fitted"), "{said:?}");
        let report = stored.report.as_mut().unwrap();
        let told = report.estimates.iter_mut().find(|e| e.sd.is_some()).unwrap();
        told.value += told.sd.unwrap();
        report.objective += 1.0;
        assert_eq!(differences(&stored, &curve).unwrap().len(), 2);
    }

    #[test]
    fn a_fit_in_pieces_is_found_from_where_a_search_begins() {
        let method = Method::Mse { split_rad: 6f64.to_radians() };
        let fit = Fit { method, starts: 1, ..Fit::default() };
        let curve = Twin { rows: 300, ..Twin::default() }.curve(3);
        let found = fit.run(&model("mixture").unwrap(), &curve).unwrap();
        let mut material = builtin::get("ptfe").unwrap().unwrap();
        let source = material.sources[0].key.clone();
        let stored = found.stored("pieces", "scan", &source);
        let observations = curve.observations.clone();
        material.curves = vec![material::Curve {
            name: "scan".to_owned(),
            source,
            instrument: None,
            session: None,
            illumination: curve.illumination,
            observations,
        }];
        assert_ne!(differences(&stored, &curve), Ok(Vec::new()), "the end is no start");
        assert_eq!(problems(&material, &stored), Some(Vec::new()));
    }

    type Forge = fn(&mut material::Fit);

    /// A material with a curve and the fit of it.
    fn material_with(fit: &Fit) -> Material {
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
            illumination: curve.illumination,
            observations: curve.observations,
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
        let said =
            |material: &Material, fit: &material::Fit| problems(material, fit).unwrap().join("; ");
        for settings in fits {
            let material = material_with(&settings);
            let fit = material.fits.last().unwrap();
            assert_eq!(problems(&material, fit), Some(Vec::new()), "{settings:?}");
            assert_eq!(problems(&material, &material.fits[0]), None, "nothing was fitted there");
            let mut moved = fit.clone();
            moved.report.as_mut().unwrap().objective += 0.1;
            assert!(said(&material, &moved).contains("its objective is stored"));
            let mut moved = fit.clone();
            let estimate = &mut moved.report.as_mut().unwrap().estimates[0];
            estimate.value += estimate.sd.unwrap();
            assert!(said(&material, &moved).contains("a new fit gives"));
            let forgeries: [(&str, Forge); 5] = [
                ("in its model r_s", |fit| {
                    let r_s = fit.model.parameters().into_iter().find(|p| p.path == "r_s").unwrap();
                    fit.model.set_parameter("r_s", (r_s.value * 0.5).max(r_s.min));
                }),
                ("the deviation of r_s", |fit| {
                    let report = fit.report.as_mut().unwrap();
                    report.estimates.iter_mut().for_each(|e| e.sd = e.sd.map(|sd| sd / 5.0));
                }),
                ("the interval of r_s", |fit| {
                    for e in &mut fit.report.as_mut().unwrap().estimates {
                        e.interval_95 = e.interval_95.map(|_| [0.999 * e.value, 1.001 * e.value]);
                    }
                }),
                ("its rms_db", |fit| fit.report.as_mut().unwrap().goodness.rms_db = 0.01),
                ("its verdict says", |fit| {
                    fit.report.as_mut().unwrap().verdict.push("every number is certain".to_owned());
                }),
            ];
            for (what, forge) in forgeries {
                let mut forged = fit.clone();
                forge(&mut forged);
                assert!(
                    said(&material, &forged).contains(what),
                    "{what}: {}",
                    said(&material, &forged)
                );
            }
            let mut other = material.clone();
            other.curves.last_mut().unwrap().observations[3].sigma0 = Some(1e-3);
            assert!(said(&other, fit).contains("not the one that was fitted"));
        }
    }
}
