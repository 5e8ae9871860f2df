//! A term that is put into a curve is found, with its numbers; nothing is found in a complete one.

use std::f64::consts::PI;

use nalgebra::DVector;

use super::model::Model;
use super::terms::LawAt;
use super::testing::{curve_of, noisy};
use super::*;
use crate::brdf::{Brdf, KirchhoffGo, Scattering};
use crate::fit;
use crate::formats::ColumnNames;
use crate::material::file::in_plane::InPlane;
use crate::material::file::points;
use crate::material::{Censor, Observation};
use crate::measure::Curve;
use crate::units::{db_from_ratio, ratio_from_db};

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
fn values_with(name: &str, numbers: &[f64]) -> Vec<InPlane> {
    values_of(name, numbers, NOISE_DB)
}

/// The same with this noise, dB.
fn values_of(name: &str, numbers: &[f64], noise_db: f64) -> Vec<InPlane> {
    let (law, term) = (law(), term(name));
    noisy(&INCIDENCES_DEG, 2.0, noise_db, |point| {
        let f = law.f_per_sr(point.i, point.o);
        db_from_ratio(term.map_or(f, |term| term.scatter(numbers, &LawAt::new(&law, point, f), f)))
    })
}

/// The same, with its noise declared.
fn curve_with(name: &str, numbers: &[f64]) -> Points {
    curve_of(&values_with(name, numbers), Some(NOISE_DB))
}

fn diagnosed(points: &Points) -> CurveReport {
    CurveDiagnosis::default().run(points, &base_law(), &terms()).unwrap()
}

#[test]
fn a_complete_curve_lacks_nothing() {
    let report = diagnosed(&curve_with("", &[]));
    assert_eq!(report.verdict, CurveVerdict::NoMissingEffect, "{report:#?}");
    assert!(report.laws.len() == 1 && report.ranking.is_empty(), "no other law was asked for");
    let report = diagnosed(&curve_of(&values_with("", &[]), None));
    assert_eq!(report.verdict, CurveVerdict::NoiseUnknown, "{report:#?}");
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
    /// Standard deviations that a number may be off. All curves have the same noise.
    const OFF: f64 = 4.0;
    for (name, numbers) in [
        ("limb-darkening", vec![0.6]),
        ("fresnel-growth", vec![6.0]),
        ("subsurface", vec![0.06]),
        ("thin-film", vec![0.8, 3.2]),
        ("opposition", vec![1.0, 8.0]),
        ("instrument-lobe", vec![2.0, 4.0]),
        ("stray-light", vec![0.01]),
    ] {
        let report = diagnosed(&curve_with(name, &numbers));
        let names: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
        assert_eq!(names, [name], "{report:#?}");
        assert_eq!(report.verdict, CurveVerdict::Explained, "{name}: {:#?}", report.unexplained);
        assert!(report.error.after.rmse_db < 1.2 * NOISE_DB, "{name}: {:?}", report.error);
        assert!(report.error.after.rmse_db < report.error.before.rmse_db);
        let parameters = term(name).unwrap().parameters();
        for (known, truth) in parameters.iter().zip(numbers) {
            let found = &report.effects[0].parameters[known.name];
            let off = (found.value - truth) / found.sd.unwrap();
            assert!(off.abs() < OFF, "{name} {}: {found:?}", known.name);
        }
    }
}

#[test]
fn an_offset_of_the_angle_is_found_within_its_deviations() {
    // It changes the levels by half a decibel; less than 0.3 dB gets no name.
    const OFFSET_DEG: f64 = 4.0;
    const DRAWS: usize = 20;
    let (law, term) = (law(), term("angle-offset").unwrap());
    let drawn = |draw: usize| {
        let count = std::cell::Cell::new(1000 * draw);
        let values = noisy(&INCIDENCES_DEG, 2.0, 0.0, |point| {
            count.set(count.get() + 1);
            let f = law.f_per_sr(point.i, point.o);
            let level_db =
                db_from_ratio(term.scatter(&[OFFSET_DEG], &LawAt::new(&law, point, f), f));
            level_db + NOISE_DB * testing::normal(count.get())
        });
        curve_of(&values, Some(NOISE_DB))
    };
    let report = diagnosed(&drawn(1));
    assert_eq!(report.effects.len(), 1, "{report:#?}");
    assert_eq!(report.effects[0].name, "angle-offset");
    let model = Model::new(&law, Kind::InPlane).unwrap().with(term);
    let step_deg = term.parameters()[0].step;
    let start: Vec<f64> = model.start().iter().copied().chain([OFFSET_DEG / step_deg]).collect();
    let mut squares = 0.0;
    for draw in 0..DRAWS {
        let points = drawn(draw);
        let all = vec![true; points.points.len()];
        let fit = model.fit(&points, &all, &DVector::from_vec(start.clone()));
        let sd = model.deviations(&fit, 1.0).pop().flatten().unwrap();
        let offset = fit.at[fit.at.len() - 1];
        squares += ((offset - OFFSET_DEG / step_deg) / sd).powi(2);
    }
    // The mean square of twenty normal numbers is below 2.0 in 99.5 of 100 cases.
    assert!(squares / (DRAWS as f64) < 2.0, "{squares}");
}

#[test]
fn a_lobe_of_another_shape_is_another_law_and_no_effect() {
    for (name, numbers, law) in [
        ("diffuse-lobe", vec![3.0], "mixture-ggx"),
        ("second-lobe", vec![0.01, 0.05], "two GGX lobes over Lambert"),
    ] {
        let report = diagnosed(&curve_with(name, &numbers));
        assert_eq!(report.verdict, CurveVerdict::AnotherLaw, "{name}: {report:#?}");
        assert_eq!(report.base.law, law);
        assert!(report.effects.is_empty(), "{report:#?}");
        assert!(report.error.after.rmse_db < 1.3 * NOISE_DB, "{name}: {:?}", report.error);
    }
    // Kirchhoff's geometric optics, as of the sea.
    let sea = |theta_rad: f64| {
        0.49 / (2.0 * 0.017) / theta_rad.cos().powi(4) * (-theta_rad.tan().powi(2) / 0.034).exp()
    };
    let report = diagnosed(&backscatter_of(0.5, 36, NOISE_DB, sea));
    assert!(report.effects.is_empty() && report.may_be.is_empty(), "{report:#?}");
    assert_eq!(report.verdict, CurveVerdict::AnotherLaw, "{report:#?}");
}

#[test]
fn beside_another_law_no_effect_has_a_name() {
    let mut laws = laws::other_laws(&base_law());
    laws.retain(|(name, _)| *name == "two GGX lobes over Lambert");
    let (_, mut law) = laws.pop().unwrap();
    for (path, value) in [
        ("0.albedo", 0.06),
        ("1.f_lambda", 0.02),
        ("1.m", 0.06),
        ("2.f_lambda", 0.04),
        ("2.m", 0.4),
    ] {
        law.set_parameter(path, value);
    }
    let light = term("stray-light").unwrap();
    for (name, numbers, tried) in [
        ("thin-film", vec![0.8, 3.2], vec![term("thin-film").unwrap()]),
        ("stray-light", vec![0.01], vec![light]),
        // A second lobe makes the other law of the declared one.
        ("stray-light", vec![0.01], vec![light, term("second-lobe").unwrap()]),
    ] {
        let values = noisy(&INCIDENCES_DEG, 2.0, NOISE_DB, |point| {
            let f = law.f_per_sr(point.i, point.o);
            db_from_ratio(term(name).unwrap().scatter(&numbers, &LawAt::new(&law, point, f), f))
        });
        let points = curve_of(&values, Some(NOISE_DB));
        let report = CurveDiagnosis::default().run(&points, &base_law(), &tried).unwrap();
        assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
        assert!(report.effects.is_empty() && report.may_be.contains(&name), "{report:#?}");
    }
}

#[test]
fn what_neither_a_law_nor_a_term_is_like_stays_unknown() {
    let law = law();
    let step = noisy(&INCIDENCES_DEG, 2.0, NOISE_DB, |point| {
        let apart_deg = (point.theta_s_rad - point.theta_i_rad).to_degrees();
        db_from_ratio(law.f_per_sr(point.i, point.o)) + if apart_deg < -60.0 { 1.0 } else { 0.0 }
    });
    let report = diagnosed(&curve_of(&step, Some(NOISE_DB)));
    assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
    assert!(report.effects.is_empty());
    let covariates: Vec<&str> = report.unexplained.iter().map(|found| found.covariate).collect();
    assert!(covariates.contains(&"theta_s - theta_i"), "{covariates:?}");
    // White noise of 5 dB that was declared as 0.1 dB.
    let white =
        noisy(&INCIDENCES_DEG, 2.0, 5.0, |point| db_from_ratio(law.f_per_sr(point.i, point.o)));
    let report = diagnosed(&curve_of(&white, Some(0.1)));
    assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
    assert_eq!(report.unexplained.last().unwrap().covariate, "scatter");
    // A model error of 0.12 dB, and one of 0.04 dB, beside a noise of 0.03 dB.
    for bump_db in [0.4, 0.16] {
        let smooth = backscatter_of(0.5, 160, 0.03, |theta_rad| {
            let bump_db = bump_db * (-((theta_rad - 0.7) / 0.12).powi(2)).exp();
            law.sigma0(theta_rad) * ratio_from_db(bump_db)
        });
        let report = diagnosed(&smooth);
        assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
        assert!(report.effects.is_empty());
    }
}

#[test]
fn an_effect_that_changes_little_has_no_name() {
    const LITTLE: f64 = 0.001;
    let report = |light: f64| {
        let values = values_of("stray-light", &[light], 0.05);
        diagnosed(&curve_of(&values, Some(0.05)))
    };
    let (little, more) = (report(LITTLE), report(3.0 * LITTLE));
    assert_eq!(little.verdict, CurveVerdict::Unexplained, "{little:#?}");
    assert!(little.effects.is_empty() && little.may_be.contains(&"stray-light"), "{little:#?}");
    assert!(little.doubts.contains(&NameDoubt::Small), "{:?}", little.doubts);
    assert!(little.ranking.iter().all(|one| !one.accepted), "{:?}", little.ranking);
    let light = little.ranking.iter().find(|one| one.name == "stray-light").unwrap();
    assert!((0.1..0.3).contains(&light.size_db), "{light:?}");
    assert_eq!(more.effects[0].name, "stray-light", "{more:#?}");
}

#[test]
fn numbers_that_the_data_do_not_determine_do_not_count() {
    // An exponential correlation of k·s = 1.39 and k·l = 29.1: the two parts of its permittivity act only together.
    let mut laws = laws::other_laws(&base_law());
    laws.retain(|(name, _)| *name == "kirchhoff with exponential correlation");
    let (name, mut law) = laws.pop().unwrap();
    law.set_parameter("rms_height_m", 2.217e-4);
    law.set_parameter("correlation_length_m", 4.632e-3);
    let points = backscatter_of(0.3, 100, 0.1, |theta_rad| law.sigma0(theta_rad));
    let report = diagnosed(&points);
    assert_eq!((report.verdict, report.base.law), (CurveVerdict::AnotherLaw, name), "{report:#?}");
    let fitted = Model::new(&law, Kind::Backscatter).unwrap();
    let fit = fitted.fit(&points, &[true; 100], &fitted.start());
    let counted = (fit.criterion() + fit.log_p) / (0.5 * 100f64.ln());
    assert_eq!((fitted.unknowns(), counted.round()), (5, 4.0), "{counted}");
}

#[test]
fn isolated_peaks_are_not_taken_for_an_effect() {
    // A grating on a flat base: peaks at sin θ = n·λ/2d, a degree wide.
    let grating = |theta_rad: f64| {
        let order = |n: i32| (theta_rad - (0.31 * f64::from(n)).asin()) / 0.01;
        let peaks: f64 = (1..=3).map(|n| (-0.5 * order(n).powi(2)).exp()).sum();
        4.0 * theta_rad.cos().powi(2) * (0.05 + peaks)
    };
    let report = diagnosed(&backscatter_of(1.0, 80, NOISE_DB, grating));
    assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
    assert!(report.effects.is_empty() && report.ranking.is_empty(), "{:?}", report.unexplained);
    let peaks = &report.unexplained[0];
    assert_eq!((report.unexplained.len(), peaks.covariate), (1, "isolated angles"));
    for sine in [0.31f64, 0.62, 0.93] {
        let peak_deg = sine.asin().to_degrees();
        let nearest = peaks.at_deg.iter().map(|[i, _]| (i - peak_deg).abs()).fold(90.0, f64::min);
        assert!(nearest < 1.0, "{peaks:?}");
    }
}

#[test]
fn one_bad_level_is_not_all_that_remains_of_a_film() {
    let report_of = |name: &str| {
        let mut values = values_with(name, &[0.8, 3.2]);
        values[100].f_per_sr *= ratio_from_db(15.0);
        let report = diagnosed(&curve_of(&values, Some(NOISE_DB)));
        assert_eq!(report.verdict, CurveVerdict::Unexplained, "{report:#?}");
        report
    };
    let [complete, film] = ["", "thin-film"].map(report_of);
    assert_eq!(complete.unexplained[0].covariate, "isolated angles", "{complete:#?}");
    assert_eq!((complete.unexplained.len(), complete.unexplained[0].at_deg.len()), (1, 1));
    assert!(film.unexplained.iter().all(|one| one.at_deg.is_empty()), "{film:#?}");
    assert!(film.may_be.contains(&"thin-film"), "{film:#?}");
}

#[test]
fn an_effect_must_hold_in_every_repeat() {
    let [clean, film] = [("", vec![]), ("thin-film", vec![0.8, 3.2])]
        .map(|(name, numbers)| values_with(name, &numbers));
    let repeated = |film_in_second: bool| {
        let second = if film_in_second { &film } else { &clean };
        let mut values = film.clone();
        values.extend(second.iter().enumerate().map(|(index, value)| {
            let more_db = NOISE_DB * (testing::normal(10_000 + index) - testing::normal(index));
            InPlane { f_per_sr: value.f_per_sr * ratio_from_db(more_db), ..*value }
        }));
        diagnosed(&curve_of(&values, Some(NOISE_DB)))
    };
    let both = repeated(true);
    assert_eq!(both.effects[0].name, "thin-film", "{both:#?}");
    let one = repeated(false);
    assert_eq!(one.verdict, CurveVerdict::Unexplained, "{one:#?}");
    assert!(one.effects.is_empty() && one.may_be.contains(&"thin-film"), "{:?}", one.may_be);
    assert!(one.doubts.contains(&NameDoubt::NotInRepeats), "{:?}", one.doubts);
}

/// A backscatter curve without a threshold.
fn backscatter_of(
    step_deg: f64,
    count: usize,
    noise_db: f64,
    sigma0: impl Fn(f64) -> f64,
) -> Points {
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for k in 0..count {
        let theta_deg = step_deg * k as f64;
        let level_db =
            db_from_ratio(sigma0(theta_deg.to_radians())) + noise_db * testing::normal(k);
        text += &format!("{theta_deg},{level_db:.4}\n");
    }
    Points::of_curve(&Curve::read(text.as_bytes()).unwrap(), &[], Some(noise_db)).unwrap()
}

/// A backscatter curve of 60 angles with a term of these numbers; step in degrees, noise in dB.
fn backscatter_with(
    law: &Brdf,
    name: &str,
    numbers: &[f64],
    [step_deg, noise_db]: [f64; 2],
) -> Points {
    let (term, points) = (term(name).unwrap(), backscatter_of(step_deg, 60, 1.0, |_| 1.0).points);
    backscatter_of(step_deg, 60, noise_db, |theta_rad| {
        let point = &points[(theta_rad.to_degrees() / step_deg).round() as usize];
        let f_per_sr = law.f_per_sr(point.i, point.o);
        let at = LawAt::new(law, point, f_per_sr);
        law.sigma0(theta_rad) * term.scatter(numbers, &at, f_per_sr) / f_per_sr
    })
}

#[test]
fn a_lobe_that_one_run_holds_is_named_where_nothing_is_left_with_it() {
    // Held out, a lobe within a run of angles is not predicted by the others.
    let law = Brdf::KirchhoffGo(KirchhoffGo { rms_slope: 0.945, eps_real: 2.25, eps_imag: 0.0 });
    let height_per_sr = 0.9 * law.sigma0(0.0) / (4.0 * PI);
    let points = backscatter_with(&law, "instrument-lobe", &[height_per_sr, 4.4], [1.33, 0.1]);
    let report = CurveDiagnosis::default().run(&points, &law, &terms()).unwrap();
    assert_eq!(report.verdict, CurveVerdict::Explained, "{report:#?}");
    let found = &report.effects[0];
    assert_eq!(found.name, "instrument-lobe", "{report:#?}");
    let evidence = &found.evidence;
    assert!(evidence.held_out_gain < 2.0 * evidence.held_out_se, "{evidence:?}");
}

#[test]
fn effects_that_leave_nothing_alike_are_named_together() {
    let law = Brdf::KirchhoffGo(KirchhoffGo { rms_slope: 0.967, eps_real: 9.0, eps_imag: 0.0 });
    let points = backscatter_with(&law, "stray-light", &[3e-6], [1.356, 0.1]);
    let report = CurveDiagnosis::default().run(&points, &law, &terms()).unwrap();
    assert_eq!(report.verdict, CurveVerdict::Explained, "{report:#?}");
    let found = &report.effects[0];
    let mut names: Vec<&str> =
        [found.name].into_iter().chain(found.class.iter().copied()).collect();
    names.sort_unstable();
    assert_eq!(names, ["second-lobe", "stray-light", "subsurface"], "{report:#?}");
    // The likeliest of them comes first.
    let gain = |name: &str| report.ranking.iter().find(|one| one.name == name).unwrap().gain;
    let one_number = ["stray-light", "subsurface"];
    assert!(one_number.iter().all(|name| gain(found.name) >= gain(name)), "{report:#?}");
    assert_ne!(found.name, "second-lobe");
}

#[test]
fn a_level_at_its_bound_does_not_hide_what_is_added() {
    // Without the subsurface return the best mixture has no diffuse part.
    let mut law = fit::model("mixture-ggx").unwrap();
    for (path, value) in [
        ("k", 0.5),
        ("specular.f_lambda", 0.138),
        ("specular.m", 0.229),
        ("diffuse.r_s", 0.0704),
        ("diffuse.alpha", 10.46),
    ] {
        assert!(law.set_parameter(path, value), "{path}");
    }
    let points = backscatter_with(&law, "subsurface", &[0.00285], [1.33, 0.1]);
    let declared = fit::model("mixture-ggx").unwrap();
    let report = CurveDiagnosis::default().run(&points, &declared, &terms()).unwrap();
    let found: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
    assert_eq!(found, ["subsurface"], "{report:#?}");
}

#[test]
fn a_film_of_deep_fringes_is_found() {
    let mut law = law();
    law.set_parameter("0.albedo", 0.02);
    law.set_parameter("1.f_lambda", 0.32);
    law.set_parameter("1.m", 0.21);
    let report = diagnosed(&backscatter_with(&law, "thin-film", &[0.8, 9.5], [0.5, 0.5]));
    assert_eq!(report.verdict, CurveVerdict::Explained, "{report:#?}");
    assert_eq!(report.effects[0].name, "thin-film", "{report:#?}");
    // Other films have as many fringes over 30°.
    let thickness = report.effects[0].parameters["thickness"].value;
    assert!((7.0..12.0).contains(&thickness), "{thickness}");
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
    Points::of_curve(&Curve::read(text.as_bytes()).unwrap(), &[], Some(NOISE_DB)).unwrap()
}

#[test]
fn backscatter_is_diagnosed_with_its_silent_angles() {
    let complete = diagnosed(&backscatter(-18.0, |_| 0.0));
    assert!(complete.curve.censored > 5, "{:?}", complete.curve);
    assert_eq!(complete.verdict, CurveVerdict::NoMissingEffect, "{complete:#?}");
    let inside = diagnosed(&backscatter(-30.0, |_| 0.02));
    assert_eq!(inside.effects[0].name, "subsurface", "{inside:#?}");
    let sigma_v = &inside.effects[0].parameters["sigma_v"];
    assert!(((sigma_v.value - 0.02) / sigma_v.sd.unwrap()).abs() < 3.5, "{sigma_v:?}");
}

/// Two runs over the same angles, the second higher by so much at normal incidence and at the other end.
fn two_runs([near_db, far_db]: [f64; 2]) -> Points {
    let law = law();
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for k in 0..160usize {
        let theta_deg = (k % 80) as f64;
        let level_db = db_from_ratio(law.sigma0(theta_deg.to_radians()));
        let apart_db = near_db + (far_db - near_db) * (k % 80) as f64 / 79.0;
        let level_db = level_db + NOISE_DB * testing::normal(k) + apart_db * (k / 80) as f64;
        text += &format!("{theta_deg},{level_db:.4}\n");
    }
    Points::of_curve(&Curve::read(text.as_bytes()).unwrap(), &[], None).unwrap()
}

#[test]
fn repeats_of_backscatter_give_the_noise() {
    let points = two_runs([0.0; 2]);
    assert_eq!((points.points.len(), points.noise.source), (80, NoiseSource::Repeats));
    assert!((points.noise.sd_db * 2f64.sqrt() / NOISE_DB - 1.0).abs() < 0.2, "{:?}", points.noise);
    let report = diagnosed(&points);
    assert_eq!(report.verdict, CurveVerdict::NoMissingEffect, "{report:#?}");
}

#[test]
fn repeats_that_contradict_each_other_are_refused() {
    let run = |points: &Points| CurveDiagnosis::default().run(points, &law(), &terms());
    let error = run(&two_runs([6.0; 2])).unwrap_err().to_string();
    assert!(
        error.starts_with("repeats 1 and 2 of the angles contradict each other: they are 6.1 dB"),
        "{error}"
    );
    let error = run(&two_runs([-3.0, 3.0])).unwrap_err().to_string();
    assert!(error.contains("contradict each other: they are 3."), "{error}");
    assert!(run(&two_runs([0.5; 2])).is_ok());
}

#[test]
fn a_single_angle_among_repeats_stays_a_point() {
    let mut text = "theta_deg,sigma0_db\n71.5,-20\n".to_owned();
    for k in 0..144usize {
        let theta_deg = (k % 72) as f64;
        let level_db = db_from_ratio(law().sigma0(theta_deg.to_radians()));
        text += &format!("{theta_deg},{:.4}\n", level_db + NOISE_DB * testing::normal(k));
    }
    let curve = Curve::read(text.as_bytes()).unwrap();
    let points = Points::of_curve(&curve, &[], None).unwrap();
    assert_eq!((points.points.len(), points.noise.source), (73, NoiseSource::Repeats));
    // One level scatters more than the mean of two.
    let [pair, single] = [points.points[0].spread, points.points[72].spread];
    assert!((single / pair - 2f64.sqrt()).abs() < 1e-12, "{pair} {single}");
}

#[test]
fn declared_noise_is_that_of_a_row() {
    let values = values_with("", &[]);
    let many: Vec<InPlane> = (0..9).flat_map(|_| values.clone()).collect();
    let points = curve_of(&many, Some(0.3));
    assert!((points.noise.sd_db - 0.1).abs() < 1e-12, "{:?}", points.noise);
    let one = points.repeat(8);
    assert!((one.noise.sd_db * one.points[0].spread - 0.3).abs() < 1e-12);
}

#[test]
fn levels_with_noise_of_their_own_are_weighed_by_it() {
    // Half a decibel is missing where the noise is 0.05 dB; it is 2 dB at the other angles.
    let drawn = |missing_db: f64| {
        let law = law();
        let mut text = "theta_deg,sigma0_db,sd_db\n".to_owned();
        for k in 0..160usize {
            let theta_deg = 0.5 * k as f64;
            let sd_db = if theta_deg < 40.0 { 0.05 } else { 2.0 };
            let bend_db = missing_db * (theta_deg / 6.0).sin();
            let level_db = db_from_ratio(law.sigma0(theta_deg.to_radians())) + bend_db;
            text += &format!("{theta_deg},{:.4},{sd_db}\n", level_db + sd_db * testing::normal(k));
        }
        let table = points(text.as_bytes(), &ColumnNames::default()).unwrap();
        let sd_db = table.sd_db.clone();
        let (curve, _) = Curve::of_points(table).unwrap();
        diagnosed(&Points::of_curve(&curve, &sd_db, None).unwrap())
    };
    let complete = drawn(0.0);
    assert_eq!(complete.verdict, CurveVerdict::NoMissingEffect, "{complete:#?}");
    assert!((complete.error.noise_floor_db - 0.05 * 2f64.sqrt()).abs() < 0.001);
    let missing = drawn(0.5);
    assert_ne!(missing.verdict, CurveVerdict::NoMissingEffect, "{missing:#?}");
}

#[test]
fn levels_at_a_right_angle_are_no_points() {
    let row = |receiver_deg: f64| {
        let angles = [30f64, receiver_deg].map(f64::to_radians);
        let observation = Observation::backscatter(angles[0], Some(1e-3), None);
        Observation { theta_r_rad: angles[1], ..observation }
    };
    let observations = [20.0, 50.0, 90.0].map(row).to_vec();
    let curve = Curve { observations, ..Curve::default() };
    let points = Points::of_curve(&curve, &[], Some(NOISE_DB)).unwrap();
    assert_eq!((points.kind, points.points.len()), (Kind::InPlane, 2));
}

#[test]
fn a_repeat_of_few_levels_takes_no_part() {
    let mut values = values_with("thin-film", &[0.8, 3.2]);
    let clean = values_with("", &[]);
    for repeat in 1..40 {
        values.push(clean[7 * repeat]);
        values.extend([clean[7]; 2]);
    }
    let points = curve_of(&values, Some(NOISE_DB));
    assert_eq!(points.most_repeats(1), 80);
    assert_eq!([points.most_repeats(12), points.most_repeats(400)], [2, 0]);
}

#[test]
fn limits_in_the_plane_of_incidence_hold_a_law_down() {
    // Beyond 40° behind the normal nothing is above a blank so far above the law.
    let drawn = |above_db: f64| {
        let law = law();
        let values = values_with("", &[]);
        let observations = values.iter().map(InPlane::observation).map(|row| {
            if row.aspect().theta_s_rad().unwrap() > -0.7 {
                return row;
            }
            let limit = row.aspect().sigma0(&law) * ratio_from_db(above_db);
            Observation { sigma0: None, censor: Censor::Left, threshold_sigma0: Some(limit), ..row }
        });
        let curve = Curve { observations: observations.collect(), ..Curve::default() };
        diagnosed(&Points::of_curve(&curve, &[], Some(NOISE_DB)).unwrap())
    };
    let complete = drawn(3.0);
    assert_eq!(complete.verdict, CurveVerdict::NoMissingEffect, "{complete:#?}");
    assert!(complete.curve.censored > 50, "{:?}", complete.curve);
    assert_ne!(drawn(-10.0).verdict, CurveVerdict::NoMissingEffect);
}

#[test]
fn too_little_is_refused() {
    let law = base_law();
    let run = |points: &Points| CurveDiagnosis::default().run(points, &law, &terms()).unwrap_err();
    let few = curve_of(&noisy(&[30.0], 10.0, 0.1, |_| -10.0), None);
    assert!(matches!(run(&few), CurveDiagnoseError::TooFew { detected: 17 }));
    let short = curve_of(&noisy(&[30.0], 2.0, 0.1, |_| -10.0), None);
    let none = Points { noise: Noise { sd_db: 0.0, ..short.noise }, ..short };
    assert!(matches!(run(&none), CurveDiagnoseError::Noise { .. }));
}
