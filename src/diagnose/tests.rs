//! Synthetic scans of a known truth: a sphere before a plate, drawn chirp by chirp from the observation model, so
//! that these tests are of the search and not of the model.

use glam::DVec3;

use super::choose::choose_effects;
use super::likelihood::Likelihood;
use super::observation::NO_LIMIT_W;
use super::problem::{ENOUGH, Problem, Sample};
use super::refit::Fit;
use super::scorer::Scorer;
use super::shared::ALONE;
use super::space::Space;
use super::trial::Search;
use super::*;
use crate::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Shadowing};
use crate::effects::{
    About, Effect, EffectParameter, Level, Model, Place, Receiver, Shot, Stage, find,
};
use crate::frames::{Global, Point, Pose, Ray};
use crate::geometry::Mesh;
use crate::radar::random::{Key, Purpose};
use crate::radar::{Chirps, Link, Radar, Returns};
use crate::scene::solids;
use crate::trace::{Bvh, ScanGeometry};
use crate::units::{db_from_ratio, watts_from_dbm};

const SIDE: usize = 56;
/// Complete scans. Of 40, one (seed 38) was called unexplained, where a family error of 2 % has 0.8.
const SEEDS: u64 = 12;
const RANGE_SD_M: f64 = 1e-3;

/// −77 dBm.
const THRESHOLD_W: f64 = 2e-11;

/// The paper's mixture with S and R that backscatter sees.
fn law() -> Brdf {
    let specular = CookTorrance {
        f_lambda: 0.055,
        m: 0.1,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let diffuse = Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.03, alpha: 3.0 }));
    Brdf::Mixture(Mixture { k: 0.1, diffuse, specular: Box::new(Brdf::CookTorrance(specular)) })
}

/// A plate 0.9 m wide and a sphere that bulges out of it.
fn target() -> Mesh {
    let mut mesh = solids::plate(0.9, 0.9);
    mesh.vertices.iter_mut().for_each(|v| *v += DVec3::new(0.0, 1.1, 0.0));
    let mut sphere = solids::icosphere(0.35, 5);
    sphere.vertices.iter_mut().for_each(|v| *v += DVec3::new(0.1, 1.1, 0.1));
    mesh.append(&sphere).unwrap();
    mesh
}

/// A square grid of chirps over 1 m.
fn chirps(radar: &Radar) -> crate::radar::Chirps {
    let origin = radar.frames().origin();
    let ray = |index: usize| {
        let at = |i: usize| (i as f64 / (SIDE - 1) as f64 - 0.5) * 0.96;
        let direction = origin.towards(Point::new(at(index % SIDE), 1.1 + at(index / SIDE), 0.0));
        Ray { origin, direction: direction.unwrap() }
    };
    let count = SIDE * SIDE;
    crate::radar::Chirps {
        number: (0..count as u32).collect(),
        time_s: (0..count).map(|i| 2e-4 * i as f64).collect(),
        rays: (0..count).map(ray).collect(),
        ..Default::default()
    }
}

/// An effect that changes the gain over the shots.
pub(super) struct Gain {
    about: About,
    db: fn(&Shot) -> f64,
}

const EDGE: EffectParameter =
    EffectParameter { name: "edge_db", unit: "dB", min: -8.0, max: 8.0, absent: 0.0, step: 0.3 };

impl Gain {
    const fn new(name: &'static str, db: fn(&Shot) -> f64) -> Gain {
        let about = About {
            name,
            level: Level::Instrument,
            description: "",
            signature: "",
            parameters: &[EDGE],
            conflicts: &[],
            has_one_form: false,
        };
        Gain { about, db }
    }
}

pub(super) static BOWL: Gain =
    Gain::new("bowl", |shot| (shot.xt_m.powi(2) + shot.yt_m.powi(2)) / 0.25);
pub(super) static DRIFT: Gain = Gain::new("trend", |shot| shot.progress - 0.5);
static SLANT: Gain = Gain::new("slant", |shot| shot.xt_m);
/// A slant with a step, and the step where it is in the middle rows alone.
static BENT: Gain = Gain::new("bent", |shot| shot.xt_m + 0.1 * shot.xt_m.signum());
static STEP: Gain =
    Gain::new("step", |shot| if shot.yt_m.abs() < 0.15 { shot.xt_m.signum() } else { 0.0 });
/// Stripes that no effect of the tests has.
static STRIPES: Gain = Gain::new("stripes", |shot| (9.0 * shot.xt_m).sin().signum());

impl Effect for Gain {
    fn about(&self) -> &About {
        &self.about
    }
    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.3], vec![-0.3]]
    }
    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        10f64.powf(0.1 * values.first().unwrap() * (self.db)(shot))
    }
}

static LIBRARY: [&dyn Effect; 3] = [&BOWL, &DRIFT, &SLANT];

/// The report on a scan whose truth has these effects.
fn diagnosed(truth: &[(&'static dyn Effect, f64)], seed: u64) -> Report {
    diagnosed_with(&LIBRARY, truth, seed)
}

/// The report on a scan whose truth has these effects, searched in a library.
fn diagnosed_with(
    library: &[&'static dyn Effect],
    truth: &[(&'static dyn Effect, f64)],
    seed: u64,
) -> Report {
    let effects = truth.iter().map(|(effect, value)| (*effect, vec![*value]));
    diagnosed_of(library, effects.collect(), &without_controls(seed))
}

/// Controls change no answer.
fn without_controls(seed: u64) -> Diagnosis {
    Diagnosis { seed, controls: false, ..Diagnosis::default() }
}

/// A scan of a mesh with one region.
struct Bench {
    radar: Radar,
    chirps: Chirps,
    bvh: Bvh<'static>,
    regions: Vec<u16>,
}

impl Bench {
    fn new(mesh: Mesh) -> Bench {
        let (radar, regions) = (Radar::default(), vec![0; mesh.facets.len()]);
        Bench { chirps: chirps(&radar), radar, bvh: Bvh::new(Box::leak(Box::new(mesh))), regions }
    }

    fn stage(&self) -> Stage<'_> {
        let Bench { radar, chirps, bvh, regions } = self;
        Stage {
            geometry: ScanGeometry::new(radar, chirps, bvh, regions),
            link: Link::new(radar),
            grain_of_region: &[DVec3::Y],
            seen_lobe_rad: &[],
            on_wavefront: false,
            antenna: None,
            middle: DVec3::new(0.0, 1.1, 0.0),
        }
    }
}

/// Four looks in weak noise.
fn receiver() -> Receiver {
    Receiver { looks: 4.0, noise_w: watts_from_dbm(-100.0), ..Receiver::LINEAR }
}

fn declared() -> ReceiverLimits {
    ReceiverLimits { threshold_w: watts_from_dbm(-77.0), range_sd_m: RANGE_SD_M }
}

/// The law where searches begin.
fn near_law() -> Brdf {
    let mut start = law();
    start.set_parameter("specular.m", 0.08);
    start
}

/// What is observed of a truth with these effects.
fn observed(
    stage: &Stage,
    shots: &[Shot],
    effects: Vec<(&'static dyn Effect, Vec<f64>)>,
    seed: u64,
) -> Vec<Observation> {
    let (receiver, declared) = (receiver(), declared());
    let model = Model { laws: vec![law()], receiver, effects, level: 1.0 };
    let prediction = model.predict(stage, shots);
    let seen = |(shot, arrived): (usize, &Option<crate::effects::MeanEcho>)| {
        let Some(arrived) = arrived else { return Observation::default() };
        let key = Key { seed, chirp: shot as u64, sub_ray: 0, purpose: Purpose::Speckle };
        let mut draws = key.draws();
        let mean_w = arrived.power_w + receiver.noise_w;
        let power_w = mean_w * draws.gamma(receiver.looks);
        let power_w = prediction.saturating.passed_w(mean_w, power_w);
        let range_m = arrived.range_m + RANGE_SD_M * draws.gaussian();
        if power_w >= declared.threshold_w {
            Observation::detected(power_w, Some(range_m))
        } else {
            Observation::default()
        }
    };
    prediction.arrived.iter().enumerate().map(seen).collect()
}

/// Hands on a search in a scan whose truth has one effect, and the space of its laws without effects.
pub(super) fn searched(
    truth: (&'static dyn Effect, Vec<f64>),
    settings: &Diagnosis,
    check: &dyn Fn(&Search, Space),
) {
    let bench = Bench::new(target());
    let stages = [bench.stage()];
    let views = &views::Views::new(&stages).unwrap();
    let shots = &trace_shots(&stages[0]).unwrap()[..];
    let observations = &observed(&stages[0], shots, vec![truth], settings.seed)[..];
    let (receiver, declared, laws) = (receiver(), declared(), [near_law()]);
    let (alarms, shared, traced) = (&[Alarms::default()][..], &ALONE, &problem::caches(1)[..]);
    let problem =
        Problem { views, shots, observations, declared, receiver, alarms, shared, traced };
    let Diagnosis { block_m, folds, seed, .. } = *settings;
    let folds = &Folds::new(shots, block_m, folds, seed);
    let (scorer, sample) = (Scorer { problem, folds, settings }, &Sample::new(&problem, ENOUGH));
    let space = problem.with_levels(Space::new(shots, receiver.looks, &laws, &[]).unwrap());
    check(&Search { scorer, sample, notify: &|_| () }, space);
}

/// The report on a scan whose truth has these effects with all their parameters, searched in a library.
fn diagnosed_of(
    library: &[&'static dyn Effect],
    effects: Vec<(&'static dyn Effect, Vec<f64>)>,
    settings: &Diagnosis,
) -> Report {
    let bench = Bench::new(target());
    let stage = bench.stage();
    let shots = trace_shots(&stage).unwrap();
    let (receiver, declared) = (receiver(), declared());
    let observations = observed(&stage, &shots, effects, settings.seed);
    let start = near_law();
    let (shots, observations, laws) = (&shots[..], &observations[..], &[start][..]);
    let subject = Subject {
        stages: &[stage],
        laws,
        at_work: &[],
        receiver,
        declared,
        shots,
        observations,
        strays: &[],
        alarms: &[Alarms::default()],
        pose: &[],
    };
    let started = std::time::Instant::now();
    let report = settings.run(&subject, library).unwrap();
    let detected = observations.iter().filter(|o| o.power_w.is_some()).count();
    eprintln!("{} shots, {detected} detected, {:?}", shots.len(), started.elapsed());
    report
}

/// Checks that the rows reproduce the errors.
fn assert_row_errors(report: &Report) {
    let off =
        report.rows.iter().filter_map(|row| Some(db_from_ratio(row.observed_w? / row.after_w)));
    let squares: Vec<f64> = off.map(|db| db * db).collect();
    let rmse_db = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((rmse_db - report.error.after.rmse_db).abs() < 1e-9);
    let z2 = report.rows.iter().map(|row| row.z_after * row.z_after).sum::<f64>();
    // The mean of n squares of a normal variate has the deviation √(2/n); four of these.
    let n = report.rows.len() as f64;
    assert!((z2 / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", z2 / n);
}

#[test]
fn nothing_is_found_where_nothing_is_missing() {
    let mut alarms = Vec::new();
    for seed in 0..SEEDS {
        let report = diagnosed(&[], seed);
        if report.verdict != Verdict::NoMissingEffect {
            alarms.push((seed, report.effects.len(), report.unexplained.clone()));
            continue;
        }
        assert!(report.base.converged);
        // The sampling error of an rmse over 2400 detections is 1.5 %; four of these.
        let ratio = report.error.before.rmse_db / report.error.before.noise_floor_db;
        assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
        assert!((report.error.before.coverage_90 - 0.9).abs() < 0.02);
        assert_eq!(report.error.before, report.error.after);
        assert!(report.rows.iter().all(|row| row.unknown_db == 0.0));
        assert_row_errors(&report);
    }
    // Two or more of 12 have a chance of 2 % at the declared family error.
    assert!(alarms.len() <= 1, "{alarms:?}");
}

#[test]
fn a_missing_effect_is_named_and_its_number_found() {
    for (effect, value) in [(&BOWL, -2.0), (&DRIFT, 3.0)] {
        let with_controls = Diagnosis { seed: 11, ..Diagnosis::default() };
        let report = diagnosed_of(&LIBRARY, vec![(effect, vec![value])], &with_controls);
        assert_eq!(report.verdict, Verdict::Explained, "{report:#?}");
        let names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
        assert_eq!(names, [effect.name()]);
        let found = &report.effects[0].parameters["edge_db"];
        let sd = found.sd.unwrap();
        assert!((found.value - value).abs() < 4.0 * sd && sd < 0.5, "{found:?}");
        let error = &report.error;
        assert!((error.after.rmse_db / error.after.noise_floor_db - 1.0).abs() < 0.045);
        assert!(error.after.log_score > error.before.log_score);
        // 2400 shots of 2 dB show a tenth of the injected effect, of which the scattering models absorb a part.
        // The missed size is the next smaller one.
        let powers = &report.controls.injection_recovery;
        let power = powers.iter().find(|power| power.name == effect.name()).unwrap();
        let least_db = power.least_db.unwrap();
        assert!((0.1..1.0).contains(&least_db), "{power:?}");
        assert!(power.missed_db.is_none_or(|db| db < least_db && db > 0.2 * least_db), "{power:?}");
    }
}

#[test]
fn two_missing_effects_are_both_found() {
    let report = diagnosed(&[(&BOWL, 2.5), (&DRIFT, -3.0)], 21);
    let mut names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
    names.sort_unstable();
    assert_eq!(names, ["bowl", "trend"], "{report:#?}");
}

#[test]
fn a_weak_effect_beside_a_strong_one_gets_no_name() {
    let report = diagnosed(&[(&BOWL, -7.5), (&DRIFT, 1.5)], 7);
    let names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
    assert_eq!((names, report.verdict), (vec!["bowl"], Verdict::Unexplained), "{report:#?}");
    let hidden = report.unexplained.iter().find(|one| one.covariate == "may be trend").unwrap();
    // A slope of 1.5 dB over the scan has 0.43 dB.
    assert!((hidden.strength_db - 0.43).abs() < 0.15 && hidden.p_value < 1e-3, "{hidden:?}");
    // Alone it has a name.
    let report = diagnosed(&[(&DRIFT, 1.5)], 7);
    assert_eq!(report.effects.first().map(|e| e.name), Some("trend"), "{report:#?}");
}

#[test]
fn a_search_that_finds_better_laws_at_each_start_has_failed() {
    for (most_starts, fails) in [(1, true), (4, false)] {
        let settings = Diagnosis { most_starts, ..without_controls(3) };
        searched((&BOWL, vec![-4.0]), &settings, &|search, space| {
            // The laws as stored, which nobody has fitted.
            let at = space.start();
            let ln_likelihood = search.scorer.problem.ln_likelihood(&space, &at);
            let fit = Fit { at, ln_likelihood, converged: false, is_stuck: false };
            let base = search.scorer.state(space, fit);
            let chosen = choose_effects(search, base, &LIBRARY);
            match chosen.map(|choice| choice.model.added.len()) {
                Err(DiagnoseError::SearchFailed { gain }) => assert!(fails && gain > 5.0),
                chosen => assert!(!fails && chosen.is_ok_and(|added| added == 1)),
            }
        });
    }
}

/// The shift is farther than a search by powers leads, which jump at every facet.
#[test]
fn a_target_that_has_moved_far_is_found_by_its_ranges() {
    let library = ["pose", "motion"].map(|name| find(name).unwrap());
    let mut path = vec![0.0; library[1].parameters().len()];
    let way_m = [("z1_m", 0.03), ("x2_m", -0.02), ("y3_m", 0.01)];
    for (known, value) in library[1].parameters().iter().zip(&mut path) {
        *value = way_m.iter().find(|(name, _)| *name == known.name).map_or(0.0, |(_, m)| *m);
    }
    let report = diagnosed_of(&library, vec![(library[1], path.clone())], &without_controls(5));
    let names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
    assert_eq!(names, ["motion"], "{report:#?}");
    let found = &report.effects[0].parameters;
    assert!(found.get("z4_m").is_none(), "slow shifts are enough: {:?}", found);
    for (name, m) in way_m {
        let Value { value, sd, .. } = found[name];
        let sd = sd.unwrap();
        // Towards the edge of the field the beam is wider and the echoes are weaker.
        assert!((value - m).abs() < 4.0 * sd && sd < 0.025, "{name}: {:?}", found[name]);
    }
    // Only the sphere shows a shift along the plate, and the scan passes it in these rows.
    let number = |known: &EffectParameter| found.get(known.name).map_or(0.0, |number| number.value);
    let values: Vec<f64> = library[1].parameters().iter().map(number).collect();
    let (bench, origin) = (Bench::new(target()), Point::new(0.0, 0.0, 0.0));
    for index in (bench.chirps.rays.len() / 2..bench.chirps.rays.len() * 4 / 5).step_by(40) {
        let shot = Shot::missed(&bench.chirps, index, bench.chirps.progress()[index]);
        let [found, truth] = [&values, &path]
            .map(|values| library[1].motion(values, &bench.stage(), &shot).unwrap() * origin);
        assert!(found.distance_m(truth) < 0.003, "{index}: {found:?}");
    }
    // A page draws the target where it stood as the scan met it first and last.
    let [first, last] = report.effects[0].motions[..] else { panic!() };
    assert!((first * origin).distance_m(last * origin) > 0.03);
    assert!(report.error.after.rmse_db < 1.05 * report.error.after.noise_floor_db);
}

/// A pose is the constant case and cannot follow.
#[test]
fn a_target_that_turns_while_it_is_scanned_has_moved() {
    let library = ["pose", "motion"].map(|name| find(name).unwrap());
    let mut path = vec![0.0; library[1].parameters().len()];
    let truth = [("z1_m", 0.006), ("rotation_x1_deg", 1.0), ("rotation_y2_deg", -1.5)];
    for (known, value) in library[1].parameters().iter().zip(&mut path) {
        *value = truth.iter().find(|(name, _)| *name == known.name).map_or(0.0, |(_, by)| *by);
    }
    let report = diagnosed_of(&library, vec![(library[1], path)], &without_controls(5));
    let names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
    assert_eq!(names, ["motion"], "{report:#?}");
    for (name, by) in truth {
        // Facets and edges may leave a turn without a standard deviation; it is found all the same.
        let Value { value, sd, .. } = report.effects[0].parameters[name];
        let most_off = sd.map_or(0.25 * by.abs(), |sd| 4.0 * sd);
        assert!((value - by).abs() < most_off, "{name}: {value} for {by}, {sd:?}");
    }
    assert!(report.error.after.rmse_db < 1.05 * report.error.after.noise_floor_db);
}

#[test]
fn an_effect_that_took_what_another_left_gives_way() {
    // Without the step, the bent slant predicts better than the true slant.
    let report = diagnosed_with(&[&BENT, &SLANT, &STEP], &[(&SLANT, 6.0), (&STEP, 1.5)], 5);
    let first = report.ranking.first().unwrap();
    assert_eq!((first.round, first.name), (1, "bent"), "{:#?}", report.ranking);
    // It did not stay, and the ranking does not show it as added.
    assert!(report.ranking.iter().all(|candidate| candidate.name != "bent" || !candidate.accepted));
    let mut names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
    names.sort_unstable();
    assert_eq!(names, ["slant", "step"], "{:#?}", report.effects);
}

#[test]
fn what_no_effect_explains_is_called_unexplained() {
    let report = diagnosed(&[(&STRIPES, 1.2)], 31);
    assert_eq!(report.verdict, Verdict::Unexplained, "{report:#?}");
    assert!(report.unexplained.iter().any(|u| u.covariate == "x_t"), "{report:#?}");
    let with_unknown = report.error.with_unknown.as_ref().unwrap().rmse_db;
    assert!(with_unknown < report.error.after.rmse_db, "{:#?}", report.error);
    assert!(with_unknown > 0.98 * report.error.noise_floor_db, "{:#?}", report.error);
    // The map of the unknown structure has the stripes, of 1.2 dB less the shrinkage by the field's prior.
    let stripe = |row: &Row| row.unknown_db * (9.0 * row.xt_m).sin().signum();
    let mean_db = report.rows.iter().map(stripe).sum::<f64>() / report.rows.len() as f64;
    assert!((0.4..1.3).contains(&mean_db), "{mean_db}");
}

#[test]
fn places_are_on_the_target() {
    let bench = Bench::new(target());
    let stage = bench.stage();
    let shots = trace_shots(&stage).unwrap();
    let (plate_z_m, on_sphere_z_m) = (0.0, 0.1 + 0.35);
    let round = Place::Round { x_m: 0.1, y_m: 0.0, radius_m: 0.1 };
    let (centre, extent) = round.on_target_m(&shots).unwrap();
    assert!(extent.is_none() && (centre.z - on_sphere_z_m).abs() < 0.01, "{centre}");
    // Left of the sphere there is the plate alone, to x = −0.45 m.
    let beyond = Place::Beyond { off_m: 0.3, direction_deg: 180.0 };
    let (centre, extent) = beyond.on_target_m(&shots).unwrap();
    let extent = extent.unwrap();
    assert!((centre.z - plate_z_m).abs() < 1e-6 && extent.z < 1e-6, "{centre} {extent}");
    assert!((centre.x - 0.5 * extent.x + 0.45).abs() < 0.02 && extent.y > 0.8, "{centre} {extent}");
    assert_eq!(Place::Beyond { off_m: 2.0, direction_deg: 0.0 }.on_target_m(&shots), None);
}

#[test]
fn a_scan_with_too_little_says_so() {
    let bench = Bench::new(target());
    let stage = bench.stage();
    let shots = trace_shots(&stage).unwrap();
    let receiver = Receiver { looks: 4.0, noise_w: 0.0, ..Receiver::LINEAR };
    let declared = ReceiverLimits { threshold_w: 1e-11, range_sd_m: RANGE_SD_M };
    let observations = vec![Observation::default(); shots.len()];
    let subject = Subject {
        stages: &[stage],
        laws: &[law()],
        at_work: &[],
        receiver,
        declared,
        shots: &shots,
        observations: &observations,
        strays: &[],
        alarms: &[Alarms::default()],
        pose: &[],
    };
    let refused = |powers_w: &dyn Fn(usize) -> f64| {
        let seen = |shot| Observation::detected(powers_w(shot), None);
        let observations: Vec<Observation> = (0..shots.len()).map(seen).collect();
        let subject = Subject { observations: &observations, ..subject };
        Diagnosis::default().run(&subject, &LIBRARY).unwrap_err()
    };
    let silent = Diagnosis::default().run(&subject, &LIBRARY).unwrap_err();
    assert!(matches!(silent, DiagnoseError::TooFew { detected: 0 }), "{silent}");
    // Every other power is below the threshold, or as of another target.
    let below = refused(&|shot| if shot % 2 == 0 { 1e-10 } else { 1e-12 });
    assert!(matches!(below, DiagnoseError::Threshold { below, .. } if below > 500), "{below}");
    let unlike = refused(&|shot| if shot % 2 == 0 { 2e-11 } else { 1e-5 });
    assert!(matches!(unlike, DiagnoseError::Unlike { .. }), "{unlike}");
    // None of the effects makes random steps of 15 dB.
    let far = refused(&|shot| if (shot * 7919) % 13 < 6 { 2e-11 } else { 6e-10 });
    assert!(matches!(far, DiagnoseError::FarOff { .. }), "{far}");
}

/// What a radar of this kind reports, of a gate that is not declared.
fn reported(returns: Returns) -> Reported {
    Reported { threshold_w: THRESHOLD_W, returns, ..Reported::default() }
}

#[test]
fn a_cloud_finds_its_shots() {
    use crate::measure::cloud::{Cloud, CloudPoint};
    let bench = Bench::new(target());
    let (stage, chirps) = (bench.stage(), &bench.chirps);
    let shots = trace_shots(&stage).unwrap();
    let missed = (0..(SIDE * SIDE) as u32).find(|c| shots.iter().all(|l| l.chirp != *c)).unwrap();
    let point = |shot: &Shot, chirp: u32, off_m: f64| {
        let range_m = shot.hit.range_m + off_m;
        let point = Point::from(shot.ray.origin.xyz + range_m * shot.ray.direction.xyz());
        CloudPoint { chirp: Some(chirp), point, range_m: None, power_w: 1e-9 }
    };
    // All on their shots but one half a metre behind its shot, and one of a chirp that meets nothing.
    let mut points: Vec<CloudPoint> =
        shots[20..28].iter().map(|shot| point(shot, shot.chirp, 1e-3)).collect();
    points.push(point(&shots[8], shots[8].chirp, 0.5));
    let numbered = Cloud::new(points.clone()).unwrap();
    points.push(point(&shots[9], missed, 0.0));
    let cloud = Cloud::new(points.clone()).unwrap();
    let found = match_cloud(&cloud, chirps, &shots, reported(Returns::Strongest)).unwrap();
    let [behind, beside] = &found.strays[..] else { panic!("{:?}", found.strays) };
    assert_eq!(behind.shot, Some(shots[8]));
    assert!((behind.range_m - shots[8].hit.range_m - 0.5).abs() < 1e-9);
    assert_eq!(beside.shot.map(|shot| shot.chirp), Some(missed));
    assert_eq!(found.observations.iter().filter(|o| o.power_w.is_some()).count(), 8);
    // They stay where the cloud has them.
    assert_eq!(found.observations[20].point, Some(points[0].point));
    // Without their numbers, points find their chirps by their directions.
    points.pop();
    points.iter_mut().for_each(|point| point.chirp = None);
    let cloud = Cloud::new(points.clone()).unwrap();
    let by_direction = match_cloud(&cloud, chirps, &shots, reported(Returns::Strongest)).unwrap();
    assert_eq!(by_direction.observations, found.observations);
    // Points with the numbers of other chirps are refused.
    for off in [1, -1] {
        let mut points = numbered.points().to_vec();
        for point in &mut points {
            point.chirp = point.chirp.and_then(|chirp| chirp.checked_add_signed(off));
        }
        let refused =
            match_cloud(&Cloud::new(points).unwrap(), chirps, &shots, reported(Returns::Strongest));
        let Err(DiagnoseError::Misnumbered { off: found }) = refused else { panic!("{refused:?}") };
        assert_eq!(found, i64::from(off));
    }
    // A scan that goes twice over its rays has two chirps for every place.
    let mut passes = chirps.clone();
    passes.rays.extend_from_slice(&chirps.rays);
    passes.number.extend(chirps.number.iter().map(|number| number + (SIDE * SIDE) as u32));
    passes.time_s.extend_from_slice(&chirps.time_s);
    let shots_twice = trace_shots(&Stage {
        geometry: ScanGeometry { chirps: &passes, ..stage.geometry },
        ..stage
    })
    .unwrap();
    for first in [0, (SIDE * SIDE) as u32] {
        let of_pass = numbered.points()[..8]
            .iter()
            .map(|point| CloudPoint { chirp: point.chirp.map(|chirp| chirp + first), ..*point });
        let cloud = Cloud::new(of_pass.collect()).unwrap();
        let found =
            match_cloud(&cloud, &passes, &shots_twice, reported(Returns::Strongest)).unwrap();
        assert_eq!(found.observations.iter().filter(|o| o.power_w.is_some()).count(), 8);
    }
    // Row numbers in place of chirp numbers are refused.
    let given = |points: Vec<CloudPoint>| {
        match_cloud(&Cloud::new(points).unwrap(), chirps, &shots, reported(Returns::Strongest))
            .unwrap_err()
    };
    let on_target = &numbered.points()[..8];
    let rows =
        on_target.iter().zip(0..).map(|(point, row)| CloudPoint { chirp: Some(5 * row), ..*point });
    let strange = given(rows.collect());
    assert!(
        matches!(strange, DiagnoseError::Strange { placed: 8, matched: 0, points: 8 }),
        "{strange}"
    );
    // A cloud that lies off its rays as a whole is out of place.
    let aside = on_target.iter().enumerate().map(|(number, point)| {
        // By 9 or 10 chirps, so that no one number is added to all.
        let shift = DVec3::new(if number % 2 == 0 { 0.15 } else { 0.175 }, 0.0, 0.0);
        CloudPoint { point: Point::from(point.point.xyz + shift), ..*point }
    });
    let aside = given(aside.collect());
    assert!(matches!(aside, DiagnoseError::Elsewhere { matched: 0, points: 8 }), "{aside}");
    let nameless = on_target.iter().map(|point| CloudPoint { chirp: None, ..*point });
    let twice = given(nameless.clone().chain(nameless).collect());
    assert!(matches!(twice, DiagnoseError::Repeated { second: 8, points: 16 }), "{twice}");
    // A cloud of something else is refused.
    points.iter_mut().for_each(|p| p.point = Point::from(p.point.xyz + DVec3::new(0.0, 0.0, 3.0)));
    let elsewhere =
        match_cloud(&Cloud::new(points).unwrap(), chirps, &shots, reported(Returns::Strongest));
    assert!(matches!(elsewhere, Err(DiagnoseError::Elsewhere { matched: 0, points: 9 })));
    assert!((found.observations[20].power_w.unwrap() - 1e-9).abs() < 1e-20);
    assert!((found.observations[20].range_m.unwrap() - shots[20].hit.range_m - 1e-3).abs() < 1e-9);
}

#[test]
fn a_false_alarm_at_the_target_says_what_its_kind_of_return_says() {
    use crate::measure::cloud::{Cloud, CloudPoint};
    let bench = Bench::new(target());
    let (stage, chirps) = (bench.stage(), &bench.chirps);
    let shots = trace_shots(&stage).unwrap();
    let point = |shot: usize, off_m: f64, power_w: f64| {
        let Shot { ray, hit, chirp, .. } = shots[shot];
        let xyz = ray.origin.xyz + (hit.range_m + off_m) * ray.direction.xyz();
        CloudPoint { chirp: Some(chirp), point: Point::from(xyz), range_m: None, power_w }
    };
    let weak_w = 1.5 * THRESHOLD_W;
    // The false alarms lie before and behind the target, where nothing else is detected.
    let [before, behind] = [40, 41];
    let mut points = vec![point(before, -0.5, weak_w), point(behind, 0.5, weak_w)];
    points.extend((20..28).map(|shot| point(shot, 1e-3, 1e-9)));
    let matched = |points: &[CloudPoint], returns| {
        let cloud = Cloud::new(points.to_vec()).unwrap();
        match_cloud(&cloud, chirps, &shots, reported(returns)).unwrap()
    };
    let limits = |found: &CloudMatch| [before, behind].map(|shot| found.observations[shot].limit_w);
    let strongest = matched(&points, Returns::Strongest);
    assert_eq!(limits(&strongest), [Some(weak_w); 2]);
    let count = |found: &CloudMatch| [found.alarms.count(), found.alarms.powers_w.len()];
    let sent = chirps.rays.len();
    assert_eq!((count(&strongest), strongest.alarms.silent), ([2, 2], sent - points.len()));
    let first = matched(&points, Returns::First);
    assert_eq!(limits(&first), [Some(NO_LIMIT_W), None]);
    assert_eq!((count(&first), first.alarms.silent), ([2, 0], sent - shots.len()));
    // Several detections of a chirp: the nearest to the target is the echo, in whatever order they come.
    points.insert(0, point(21, -0.05, weak_w));
    points.extend([point(20, -0.5, weak_w), point(20, 0.5, weak_w)]);
    // A numbered cloud has one point per chirp.
    points.iter_mut().for_each(|point| point.chirp = None);
    let all = matched(&points, Returns::All);
    assert_eq!(limits(&all), [None; 2]);
    assert_eq!((count(&all), all.alarms.silent, all.strays.len()), ([5, 5], sent, 0));
    for (one, alone) in std::iter::zip(&all.observations[20..28], &first.observations[20..28]) {
        assert_eq!(*one, Observation { rank: Some(1), ..*alone });
    }
    // A stronger detection elsewhere on its ray makes an echo the second of its chirp.
    points.push(CloudPoint { chirp: None, ..point(22, 0.5, 1e-8) });
    let second = matched(&points, Returns::All);
    assert_eq!([21, 22].map(|shot| second.observations[shot].rank), [Some(1), Some(2)]);
    // What a limit makes likely: silence least, and a hidden echo whatever it is.
    let model = Model { laws: vec![law()], receiver: receiver(), effects: vec![], level: 1.0 };
    let prediction = model.predict(&stage, &shots);
    let seen = [None, Some(prediction.mean_w(before)), Some(NO_LIMIT_W)]
        .map(|limit_w| (before, Observation { limit_w, ..Observation::default() }));
    let terms = Likelihood::new(&prediction, declared(), &ALONE).terms_of(&seen);
    assert!(terms[0].ln_p < terms[1].ln_p - 0.01 && terms[1].ln_p < terms[2].ln_p, "{terms:?}");
    assert!(terms[2].ln_p.abs() < 1e-3 && terms[2].slope.abs() < 1e-9, "{:?}", terms[2]);
}

/// Noise that most chirps report which miss the target is no other target; the target's own chirps then report as often.
#[test]
fn false_alarms_of_chirps_that_miss_may_be_the_most_of_a_cloud() {
    use crate::measure::cloud::{Cloud, CloudPoint};
    let mut mesh = solids::plate(0.5, 0.5);
    mesh.vertices.iter_mut().for_each(|v| *v += DVec3::new(0.0, 1.1, 0.0));
    let bench = Bench::new(mesh);
    let (stage, chirps) = (bench.stage(), &bench.chirps);
    let shots = trace_shots(&stage).unwrap();
    let echo = |shot: &Shot| CloudPoint {
        chirp: Some(shot.chirp),
        point: shot.hit.point,
        range_m: None,
        power_w: 1e-9,
    };
    let noise = chirps.number.iter().zip(&chirps.rays).filter_map(|(chirp, ray)| {
        let misses = shots.iter().all(|shot| shot.chirp != *chirp);
        let point = Point::from(ray.origin.xyz + 7.3 * ray.direction.xyz());
        let (chirp, power_w) = (Some(*chirp), 1.5 * THRESHOLD_W);
        misses.then_some(CloudPoint { chirp, point, range_m: None, power_w })
    });
    let noise: Vec<CloudPoint> = noise.collect();
    let matched = |echoes: usize| {
        let echoes = shots.iter().take(echoes).map(echo);
        let cloud = Cloud::new(noise.iter().copied().chain(echoes).collect()).unwrap();
        match_cloud(&cloud, chirps, &shots, reported(Returns::Strongest))
    };
    let found = matched(shots.len()).unwrap();
    assert!(noise.len() > shots.len() && found.alarms.of_misses.len() == noise.len());
    // Where others report and those towards the target do not, it is not there.
    assert!(matches!(matched(shots.len() / 4), Err(DiagnoseError::Elsewhere { .. })));
}

#[test]
fn a_wide_spot_sees_past_the_edge() {
    use crate::measure::cloud::{Cloud, CloudPoint};
    let mut mesh = solids::plate(0.5, 0.5);
    mesh.vertices.iter_mut().for_each(|v| *v += DVec3::new(0.0, 1.1, 0.0));
    let bench = Bench::new(mesh);
    let (stage, chirps) = (bench.stage(), &bench.chirps);
    let shots = trace_shots(&stage).unwrap();
    // Every chirp within 8 cm of the plate answers, at the plate's range.
    let cloud = |by_m: f64| {
        let point = |(chirp, ray): (&u32, &Ray<_>)| {
            let range_m = (0.0 - ray.origin.xyz.z) / ray.direction.xyz().z;
            let xyz = ray.origin.xyz + range_m * ray.direction.xyz();
            let is_near = (xyz - DVec3::new(0.0, 1.1, 0.0)).abs().max_element() < 0.33;
            let point = Point::from(xyz + by_m * ray.direction.xyz());
            is_near.then_some(CloudPoint {
                chirp: Some(*chirp),
                point,
                range_m: None,
                power_w: 1e-9,
            })
        };
        Cloud::new(chirps.number.iter().zip(&chirps.rays).filter_map(point).collect()).unwrap()
    };
    let seen = cloud(0.0);
    let found = match_cloud(&seen, chirps, &shots, reported(Returns::Strongest)).unwrap();
    assert!(found.strays.len() * 3 > seen.points().len(), "{}", found.strays.len());
    // The radar's own beam, of 16 mm, reaches some of them, of the 80 mm beside the plate.
    let model = Model { laws: vec![law()], receiver: receiver(), effects: vec![], level: 1.0 };
    let beside = found.strays.iter().filter(|stray| stray.is_beside_edge(&model, &stage)).count();
    let share = beside as f64 / found.strays.len() as f64;
    assert!((0.1..0.4).contains(&share), "{share}");
    // Twice as often, and half a metre behind, they are not of it.
    let stray = |point: &&CloudPoint| shots.iter().all(|shot| Some(shot.chirp) != point.chirp);
    let strays: Vec<CloudPoint> = seen.points().iter().filter(stray).copied().collect();
    let mut twice = [seen.points(), &strays, &strays].concat();
    twice.iter_mut().for_each(|point| point.chirp = None);
    let twice = Cloud::new(twice).unwrap();
    let twice = match_cloud(&twice, chirps, &shots, reported(Returns::Strongest)).unwrap_err();
    assert!(matches!(twice, DiagnoseError::Repeated { .. }), "{twice}");
    let behind =
        match_cloud(&cloud(0.5), chirps, &shots, reported(Returns::Strongest)).unwrap_err();
    assert!(matches!(behind, DiagnoseError::Elsewhere { matched: 0, .. }), "{behind}");
}

/// One of several scans that are diagnosed together, with the truth of its data.
struct Part {
    bench: Bench,
    laws: Vec<Brdf>,
    effects: Vec<(&'static dyn Effect, Vec<f64>)>,
    level_db: f64,
    seed: u64,
}

impl Part {
    /// The target turned about its vertical axis, deg, seen by a radar of this power, dBm.
    fn new(turn_deg: f64, transmit_power_dbm: f64, seed: u64) -> Part {
        let mut mesh = target();
        let turn = Pose::<Global, Global>::from_euler_xyz(
            DVec3::new(0.0, turn_deg.to_radians(), 0.0),
            DVec3::ZERO,
        );
        mesh.vertices.iter_mut().for_each(|v| *v = (turn * Point::from(*v)).xyz);
        let mut bench = Bench::new(mesh);
        bench.radar.transmit_power_dbm = transmit_power_dbm;
        Part { bench, laws: vec![law()], effects: Vec::new(), level_db: 0.0, seed }
    }

    /// What the chirps of the scan report, by the observation model. `regions`: the region of every facet in truth.
    fn observations(&self, regions: &[u16], shots: &[Shot]) -> Vec<Observation> {
        let stage = self.bench.stage();
        let stage = Stage {
            geometry: ScanGeometry { region_of_facet: regions, ..stage.geometry },
            ..stage
        };
        let in_truth: Vec<Shot> = shots
            .iter()
            .map(|shot| Shot { region: regions[shot.hit.facet as usize], ..*shot })
            .collect();
        let (laws, effects) = (self.laws.clone(), self.effects.clone());
        let level = 10f64.powf(0.1 * self.level_db);
        let model = Model { laws, receiver: receiver(), effects, level };
        let prediction = model.predict(&stage, &in_truth);
        let mut seen = Vec::new();
        for (shot, arrived) in prediction.arrived.iter().enumerate() {
            let key =
                Key { seed: self.seed, chirp: shot as u64, sub_ray: 0, purpose: Purpose::Speckle };
            let (mut draws, arrived) = (key.draws(), arrived.unwrap());
            let power_w = (arrived.power_w + receiver().noise_w) * draws.gamma(receiver().looks);
            let range_m = arrived.range_m + RANGE_SD_M * draws.gaussian();
            let is_seen = power_w >= THRESHOLD_W;
            seen.push(if is_seen {
                Observation::detected(power_w, Some(range_m))
            } else {
                Observation::default()
            });
        }
        seen
    }
}

/// The joint report on some scans, by a model of one region.
fn diagnosed_together(parts: &[Part], library: &[&'static dyn Effect]) -> Report {
    let regions: Vec<Vec<u16>> = parts.iter().map(|part| part.bench.regions.clone()).collect();
    diagnosed_as(parts, &regions, library)
}

/// As [`diagnosed_together`], where the facets are of these regions in truth.
fn diagnosed_as(parts: &[Part], regions: &[Vec<u16>], library: &[&'static dyn Effect]) -> Report {
    let stages: Vec<Stage> = parts.iter().map(|part| part.bench.stage()).collect();
    let (mut shots, mut observations) = (Vec::new(), Vec::new());
    for (scan, (part, stage)) in parts.iter().zip(&stages).enumerate() {
        let mut own = trace_shots(stage).unwrap();
        own.iter_mut().for_each(|shot| shot.scan = scan as u16);
        observations.extend(part.observations(&regions[scan], &own));
        shots.extend(own);
    }
    let mut start = law();
    start.set_parameter("specular.m", 0.08);
    let declared = ReceiverLimits { threshold_w: THRESHOLD_W, range_sd_m: RANGE_SD_M };
    let subject = Subject {
        stages: &stages,
        laws: &[start],
        at_work: &[],
        receiver: receiver(),
        declared,
        shots: &shots,
        observations: &observations,
        strays: &vec![Vec::new(); parts.len()],
        alarms: &vec![Alarms::default(); parts.len()],
        pose: &[],
    };
    without_controls(3).run(&subject, library).unwrap()
}

#[test]
fn two_poses_of_a_complete_target_share_its_laws_and_have_levels_of_their_own() {
    let second = Part { level_db: 3.0, ..Part::new(12.0, 10.0, 2) };
    let report = diagnosed_together(&[Part::new(0.0, 7.0, 1), second], &LIBRARY);
    assert_eq!(report.verdict, Verdict::NoMissingEffect, "{report:#?}");
    let [a, b] = &report.clouds[..] else { panic!("{:?}", report.clouds) };
    let [a_db, b_db] = [a, b].map(|part| part.level_db.unwrap().value);
    // The difference of two levels of 2 400 shots of 4 looks each has the deviation 0.06 dB, and laws take a part.
    assert!((b_db - a_db - 3.0).abs() < 0.3, "{a_db} {b_db}");
    assert!(report.clouds.iter().all(|part| part.chirps > 2000 && part.detected > 1000));
    let m = report.base.parameters.iter().find(|number| number.name == "specular.m").unwrap();
    let sd = m.value.sd.unwrap();
    assert!((m.value.value - 0.1).abs() < 4.0 * sd && sd < 0.01, "{m:?}");
    // Both scans are of one table.
    assert_eq!(report.rows.iter().filter(|row| row.scan == 1).count(), b.chirps);
    assert_row_errors(&report);
}

#[test]
fn a_drift_of_one_of_two_instruments_is_named_for_that_one() {
    let second = Part { effects: vec![(&DRIFT, vec![3.0])], ..Part::new(12.0, 10.0, 2) };
    let report = diagnosed_together(&[Part::new(0.0, 7.0, 1), second], &LIBRARY);
    assert_eq!(report.verdict, Verdict::Explained, "{report:#?}");
    let found: Vec<_> = report.effects.iter().map(|one| (one.name, &one.scans[..])).collect();
    assert_eq!(found, [("trend", &[1u16][..])]);
    let Value { value, sd, .. } = report.effects[0].parameters["edge_db"];
    assert!((value - 3.0).abs() < 4.0 * sd.unwrap(), "{value} {sd:?}");
    let [first, second] = report.effects[0].evidence.by_cloud[..] else { panic!() };
    assert!(second.gain > 4.0 * second.se && first.gain.abs() < 0.1 * second.gain);
    assert!(report.clouds[1].before.rmse_db > report.clouds[1].after.rmse_db + 0.05);
}

/// The place is one of the target, not of the field of view: 12° move it by 10 cm there.
#[test]
fn a_patch_that_two_poses_see_gains_more_than_in_either() {
    let patch = [find("foreign-patch").unwrap()];
    let part = |turn_deg: f64, seed: u64| {
        let mut bright = law();
        bright.set_parameter("specular.f_lambda", 0.22);
        bright.set_parameter("diffuse.r_s", 0.12);
        Part { laws: vec![law(), bright], ..Part::new(turn_deg, 7.0, seed) }
    };
    // Facets of the target itself within 9 cm of a place on the sphere.
    let mesh = target();
    let centre = DVec3::new(0.2, 1.2, 0.1 + 0.32);
    let of_facet = |facet: &[u32; 3]| {
        let middle = facet.iter().map(|v| mesh.vertices[*v as usize]).sum::<DVec3>() / 3.0;
        u16::from(middle.distance(centre) < 0.09)
    };
    let regions: Vec<u16> = mesh.facets.iter().map(of_facet).collect();
    let alone = [part(0.0, 1), part(12.0, 2)].map(|part| {
        let report = diagnosed_as(&[part], std::slice::from_ref(&regions), &patch);
        report.effects.first().unwrap().evidence.held_out_gain
    });
    let both = [part(0.0, 1), part(12.0, 2)];
    let report = diagnosed_as(&both, &[regions.clone(), regions], &patch);
    assert_eq!(report.effects.len(), 1, "{report:#?}");
    let gain = report.effects[0].evidence.held_out_gain;
    assert!(alone.iter().all(|one| gain > 1.4 * one), "{gain} {alone:?}");
    let place = report.effects[0].parameters.triples["centre_m"].value;
    assert!(DVec3::from(place).distance(centre) < 0.04, "{place:?}");
}

#[test]
fn a_cloud_of_another_material_contradicts_the_others() {
    let mut other = law();
    other.set_parameter("specular.m", 0.25);
    other.set_parameter("diffuse.alpha", 1.0);
    let second = Part { laws: vec![other], ..Part::new(12.0, 7.0, 2) };
    let report = diagnosed_together(&[Part::new(0.0, 7.0, 1), second], &LIBRARY);
    assert_eq!(report.verdict, Verdict::Contradictory, "{report:#?}");
    let first = &report.contradictions[0];
    assert!(
        first.effect.is_none() && first.gain > 4.0 * first.se && first.size_db > 0.3,
        "{first:?}"
    );
}

/// One instrument has one drift.
#[test]
fn an_effect_that_one_cloud_excludes_is_a_contradiction() {
    let second = Part { effects: vec![(&DRIFT, vec![4.0])], ..Part::new(12.0, 7.0, 2) };
    let report = diagnosed_together(&[Part::new(0.0, 7.0, 1), second], &LIBRARY);
    assert_eq!(report.verdict, Verdict::Contradictory, "{report:#?}");
    assert!(report.effects.is_empty(), "{:#?}", report.effects);
    let of_drift = report.contradictions.iter().find(|one| one.effect == Some("trend")).unwrap();
    assert_eq!(of_drift.cloud, 1);
}

#[test]
fn the_first_scan_sees_the_points_of_the_others_where_they_are() {
    let parts = [Part::new(0.0, 7.0, 1), Part::new(12.0, 7.0, 2), Part::new(-5.0, 9.0, 3)];
    let stages: Vec<Stage> = parts.iter().map(|part| part.bench.stage()).collect();
    let views = views::Views::new(&stages).unwrap();
    assert_eq!(views.instruments(), [0, 0, 2]);
    let mut hidden = 0;
    let shots = trace_shots(&stages[1]).unwrap();
    for shot in &shots {
        let there = views.in_first(&Shot { scan: 1, ..*shot });
        // Its ray meets the same facet, unless something stands before it.
        let hit = stages[0].geometry.bvh.closest(&there.ray).unwrap();
        if hit.facet == shot.hit.facet {
            assert!(hit.point.xyz.distance(there.hit.point.xyz) < 1e-9);
        } else {
            hidden += 1;
        }
    }
    assert!(hidden < shots.len() / 20, "{hidden}");
    // Another mesh is another target.
    let other = Bench::new(solids::plate(0.9, 0.9));
    let refused = [stages[0], other.stage()];
    assert!(matches!(views::Views::new(&refused), Err(DiagnoseError::OtherTarget { cloud: 2 })));
}

/// Of two echoes of a chirp one is reported, and what that says of the other depends on which is.
#[test]
fn a_reported_echo_limits_the_others_of_its_chirp() {
    use crate::measure::cloud::{Cloud, CloudPoint};
    let bench = Bench::new(target());
    let stage = bench.stage();
    const BEHIND_M: f64 = 0.03;
    let layers = |shot: Shot| [shot, Shot { sheets: 1, longer_m: BEHIND_M, ..shot }];
    let shots: Vec<Shot> = trace_shots(&stage).unwrap().into_iter().flat_map(layers).collect();
    let point = |shot: usize, power_w: f64| {
        let Shot { ray, hit, chirp, longer_m, .. } = shots[shot];
        let xyz = ray.origin.xyz + (hit.range_m + longer_m + 1e-3) * ray.direction.xyz();
        CloudPoint { chirp: Some(chirp), point: Point::from(xyz), range_m: None, power_w }
    };
    // Of one chirp the nearer echo, of another the farther one, and of a third both where all are reported.
    let [near_w, far_w] = [10.0 * THRESHOLD_W, 7.0 * THRESHOLD_W];
    let mut points = vec![point(40, near_w), point(43, far_w)];
    let observed = |points: &[CloudPoint], returns| {
        let cloud = Cloud::new(points.to_vec()).unwrap();
        let found = match_cloud(&cloud, &bench.chirps, &shots, reported(returns)).unwrap();
        assert!(found.strays.is_empty());
        let seen = &found.observations[40..46];
        seen.iter().map(|one| (one.power_w.is_some(), one.limit_w)).collect::<Vec<_>>()
    };
    let [is_seen, silent] = [(true, None), (false, None)];
    let below = |limit_w| (false, Some(limit_w));
    assert_eq!(
        observed(&points, Returns::Strongest),
        [is_seen, below(near_w), below(far_w), is_seen, silent, silent]
    );
    // The nearer one would have been reported in place of the farther one.
    assert_eq!(
        observed(&points, Returns::First),
        [is_seen, below(NO_LIMIT_W), silent, is_seen, silent, silent]
    );
    points.extend([point(44, near_w), point(45, far_w)]);
    points.iter_mut().for_each(|point| point.chirp = None);
    assert_eq!(
        observed(&points, Returns::All),
        [is_seen, silent, silent, is_seen, is_seen, is_seen]
    );
}
