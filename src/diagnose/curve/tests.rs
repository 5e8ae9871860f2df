//! A term that is put into a curve is found, with its numbers; nothing is found in a complete one.

use super::testing::{curve_of, noisy};
use super::*;
use crate::brdf::{Brdf, Scattering};
use crate::diagnose::report::Verdict;
use crate::measure::Curve;
use crate::units::db_from_ratio;

const INCIDENCES_DEG: [f64; 4] = [10.0, 30.0, 50.0, 70.0];
const NOISE_DB: f64 = 0.2;

fn law() -> Brdf {
    let mut law = base_law();
    law.set_parameter("0.albedo", 0.06);
    law.set_parameter("1.f_lambda", 0.04);
    law.set_parameter("1.m", 0.25);
    law
}

/// A curve of the law with a term of these numbers.
fn curve_with(name: &str, numbers: &[f64]) -> Points {
    let (law, term) = (law(), term(name));
    curve_of(noisy(&INCIDENCES_DEG, 2.0, NOISE_DB, |point| {
        let f = law.f_per_sr(point.i, point.o);
        db_from_ratio(term.map_or(f, |term| term.scatter(numbers, &law, point, f)))
    }))
}

fn diagnosed(points: &Points) -> CurveReport {
    CurveDiagnosis::default().run(points, &base_law(), &terms()).unwrap()
}

#[test]
fn a_complete_curve_lacks_nothing() {
    let report = diagnosed(&curve_with("", &[]));
    assert_eq!(report.verdict, Verdict::NoMissingEffect, "{report:#?}");
    assert_eq!(report.error.noise_source, NoiseSource::Neighbours);
    assert!((report.error.noise_floor_db / NOISE_DB - 1.0).abs() < 0.15, "{:?}", report.error);
    assert!(report.error.before.rmse_db < 1.15 * NOISE_DB);
    assert_eq!(report.error.before, report.error.after);
    let albedo = &report.base.parameters[0];
    let off = (albedo.value.value - 0.06) / albedo.value.sd.unwrap();
    assert!(off.abs() < 4.0, "{albedo:?}");
}

#[test]
fn what_is_put_in_is_found_with_its_numbers() {
    /// Standard deviations that a number may be off. All curves have the same noise; the offset of the
    /// angle is 3.6 off in it.
    const OFF: f64 = 4.0;
    for (name, numbers) in [
        ("diffuse-lobe", vec![3.0]),
        ("limb-darkening", vec![0.3]),
        ("second-lobe", vec![0.01, 0.05]),
        ("fresnel-growth", vec![6.0]),
        ("subsurface", vec![0.02]),
        ("thin-film", vec![0.4, 3.2]),
        ("opposition", vec![0.5, 6.0]),
        ("angle-offset", vec![1.5]),
        ("instrument-lobe", vec![0.6, 2.5]),
        ("stray-light", vec![0.003]),
    ] {
        let report = diagnosed(&curve_with(name, &numbers));
        let names: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
        assert_eq!(names, [name], "{report:#?}");
        assert_eq!(report.verdict, Verdict::Explained, "{name}: {:#?}", report.unexplained);
        assert!(report.error.after.rmse_db < 1.2 * NOISE_DB, "{name}: {:?}", report.error);
        assert!(report.error.after.rmse_db < report.error.before.rmse_db);
        if name == "second-lobe" {
            // The two lobes may change places.
            let value =
                |name: &str| &report.base.parameters.iter().find(|p| p.name == name).unwrap().value;
            for (path, truth) in [("1.f_lambda", numbers[0]), ("1.m", numbers[1])] {
                let found = value(path);
                assert!(((found.value - truth) / found.sd.unwrap()).abs() < OFF, "{found:?}");
            }
            continue;
        }
        let parameters = term(name).unwrap().parameters();
        for (known, truth) in parameters.iter().zip(numbers) {
            let found = &report.effects[0].parameters[known.name];
            let off = (found.value - truth) / found.sd.unwrap();
            assert!(off.abs() < OFF, "{name} {}: {found:?}", known.name);
        }
    }
}

#[test]
fn what_no_term_is_like_stays_unknown() {
    let law = law();
    let points = curve_of(noisy(&INCIDENCES_DEG, 2.0, NOISE_DB, |point| {
        let apart_deg = (point.theta_s_rad - point.theta_i_rad).to_degrees();
        db_from_ratio(law.f_per_sr(point.i, point.o)) + if apart_deg < -60.0 { 1.0 } else { 0.0 }
    }));
    let report = diagnosed(&points);
    assert_eq!(report.verdict, Verdict::Unexplained, "{report:#?}");
    assert!(report.unexplained.iter().all(|found| found.name == "unknown"));
}

/// A backscatter curve every half degree, with a threshold.
fn backscatter(threshold_db: f64, extra: impl Fn(f64) -> f64) -> Points {
    let law = law();
    let mut text = "theta_deg,sigma0_db,censored\n".to_owned();
    for k in 0..160 {
        let theta_deg = 0.5 * f64::from(k);
        let theta_rad = theta_deg.to_radians();
        let sigma0 = law.sigma0(theta_rad) + extra(theta_rad);
        let level_db = db_from_ratio(sigma0) + NOISE_DB * testing::normal(k as usize);
        let censored = u8::from(level_db < threshold_db);
        text += &format!("{theta_deg},{:.3},{censored}\n", level_db.max(threshold_db));
    }
    Points::backscatter(&Curve::read(text.as_bytes()).unwrap(), Some(NOISE_DB))
}

#[test]
fn backscatter_is_diagnosed_with_its_silent_angles() {
    let complete = diagnosed(&backscatter(-18.0, |_| 0.0));
    assert!(complete.curve.censored > 5, "{:?}", complete.curve);
    assert_eq!(complete.verdict, Verdict::NoMissingEffect, "{complete:#?}");
    let inside = diagnosed(&backscatter(-30.0, |_| 0.02));
    assert_eq!(inside.effects[0].name, "subsurface", "{inside:#?}");
    let sigma_v = &inside.effects[0].parameters["sigma_v"];
    assert!(((sigma_v.value - 0.02) / sigma_v.sd.unwrap()).abs() < 3.5, "{sigma_v:?}");
}

#[test]
fn too_little_is_refused() {
    let law = base_law();
    let run = |points: &Points| CurveDiagnosis::default().run(points, &law, &terms()).unwrap_err();
    let few = curve_of(noisy(&[30.0], 10.0, 0.1, |_| -10.0));
    assert!(matches!(run(&few), CurveDiagnoseError::TooFew { detected: 17 }));
    let short = curve_of(noisy(&[30.0], 2.0, 0.1, |_| -10.0));
    let none = Points { noise: Noise { sd_db: 0.0, ..short.noise }, ..short };
    assert!(matches!(run(&none), CurveDiagnoseError::Noise { .. }));
}
