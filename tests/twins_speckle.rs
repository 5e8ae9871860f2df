//! Promise: the speckle of sealed twins is a field on the surface, with the correlation and the contrast that
//! one Gaussian beam gives it, and their lobes are as wide as that beam shows them.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::fs;

use crate::twins::made::base::{Base, Local, Slopes};
use crate::twins::made::field::Field;
use crate::twins::made::instrument::Speckle;
use crate::twins::made::noise::{Grain, observe, shares};
use crate::twins::made::physics::{Acting, Displacement, Effect, means};
use crate::twins::made::scan::{Sight, World};
use crate::twins::made::scatterers::{Scatterers, places};
use crate::twins::made::target::overlap;
use glam::{DMat3, DVec3};
use matdb::scene::Scene;
use num_complex::Complex;
use serde_json::Value;

/// Seeds over which an estimate is averaged: 1/√N of it is its standard error.
const SEEDS: u64 = 25;
/// An average is as expected within so many of its standard errors.
const ERRORS: f64 = 3.5;
const WAVELENGTH_M: f64 = 0.299_792_458 / 300.0;
/// 16 mm at half the intensity.
const WAIST_M: f64 = 0.013_589;
/// Where the radar stands, m.
const HEIGHT_M: f64 = 1.1;
const STANDOFF_M: f64 = 8.0;
/// Beams this far apart share no scatterers, m.
const APART_M: f64 = 0.06;
/// So many of them beside each other and above.
const BEAMS: i32 = 7;

/// A law without a mirror-like part, so that all of it speckles.
const DIFFUSE: Base =
    Base { slopes: Slopes::Beckmann, m: 0.3, alpha: 2.0, k: 0.2, f_lambda: 1e-9, r_s: 0.02 };

/// Plates, x and y of their middles, their depths and their sizes, in m.
type Plate = [f64; 4];

/// A scene of plates across the radar's axis, under parallel beams of one waist.
fn scene(plates: &[Plate], beams: impl Iterator<Item = [f64; 2]>) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let mut rays = "chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n".to_owned();
    for (chirp, [x, y]) in beams.enumerate() {
        let time_s = 2e-4 * chirp as f64;
        writeln!(rays, "{chirp},{time_s},{x},{},{STANDOFF_M},0,0,-1", HEIGHT_M + y).unwrap();
    }
    let mut text = "name = \"Plates\"\nseed = 1\n\n[radar]\npreset = \"upm-300ghz\"\n\
                    threshold_dbm = -120.0\n\n[radar.beam]\nedge_growth = 1.0\n\n\
                    [radar.noise]\nlevel_dbm = -250.0\nrange_sd_m = 0.0\n\n\
                    [radar.scan]\npattern = \"rays\"\nfile = \"rays.csv\"\n\n"
        .to_owned();
    for (number, [x, y, z, size_m]) in plates.iter().enumerate() {
        // The front is at z.
        write!(
            text,
            "[[mesh]]\nname = \"plate-{number}\"\nfile = \"builtin:cuboid\"\n\
             size_m = [{size_m:?}, {size_m:?}, 0.01]\ntranslation_m = [{x:?}, {:?}, {:?}]\n\n",
            HEIGHT_M + y,
            z - 0.005
        )
        .unwrap();
    }
    text += "[[region]]\nname = \"surface\"\nmaterial = \"plate\"\n";
    fs::write(folder.path().join("rays.csv"), rays).unwrap();
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    Scene::load(&folder.path().join("scene.toml")).unwrap()
}

/// Beams that share nothing.
fn grid() -> impl Iterator<Item = [f64; 2]> {
    let steps = || (0..BEAMS).map(|step| APART_M * f64::from(step - BEAMS / 2));
    steps().flat_map(move |y| steps().map(move |x| [x, y]))
}

/// What all sets of one beam add up to.
fn amplitudes(field: &Field, sight: &Sight) -> Vec<Complex<f64>> {
    field.sum(sight, sight.look.unwrap().range_m).unwrap().amplitudes
}

/// Mean and standard error of an estimate over the seeds.
fn over_seeds(estimate: impl Fn(u64) -> f64) -> [f64; 2] {
    let each: Vec<f64> = (0..SEEDS).map(estimate).collect();
    let count = each.len() as f64;
    let mean = each.iter().sum::<f64>() / count;
    let variance = each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, (variance / count).sqrt()]
}

/// An average lies about what is expected, and its error is small enough to tell.
fn assert_near([mean, error]: [f64; 2], expected: f64, most_error: f64, what: &str) {
    assert!(error < most_error, "{what}: standard error {error}");
    assert!((mean - expected).abs() < ERRORS * error, "{what}: {mean} ± {error}, not {expected}");
}

#[test]
fn beams_share_speckle_as_far_as_the_waist_reaches_at_every_range() {
    const LAGS_M: [f64; 3] = [0.003, 0.006_15, 0.012];
    const SETS: usize = 4;
    // In front of the focus, in it, and behind it.
    for z in [0.4, 0.0, -0.4] {
        let beams = grid().flat_map(|[x, y]| {
            let along = LAGS_M.map(|lag| [x + 0.6 * lag, y + 0.8 * lag]);
            std::iter::once([x, y]).chain(along)
        });
        let scene = scene(&[[0.0, 0.0, z, 0.5]], beams);
        let world = World::new(&scene, &scene.target.mesh);
        let fields: Vec<Vec<Vec<Complex<f64>>>> = (0..SEEDS)
            .map(|seed| {
                let field = Field::new(&world, seed, &DIFFUSE, &[], SETS);
                world.sights.iter().map(|sight| amplitudes(&field, sight)).collect()
            })
            .collect();
        for (number, lag_m) in LAGS_M.iter().enumerate() {
            let mean = |seed: u64, of: fn(Complex<f64>, Complex<f64>) -> f64| {
                let pairs: Vec<f64> = fields[seed as usize]
                    .chunks(LAGS_M.len() + 1)
                    .flat_map(|beams| std::iter::zip(&beams[0], &beams[number + 1]))
                    .map(|(a, b)| of(*a, *b))
                    .collect();
                pairs.iter().sum::<f64>() / pairs.len() as f64
            };
            let field = over_seeds(|seed| mean(seed, |a, b| (a * b.conj()).re));
            let intensity =
                over_seeds(|seed| mean(seed, |a, b| (a.norm_sqr() - 1.0) * (b.norm_sqr() - 1.0)));
            let near = (lag_m / WAIST_M).powi(2);
            assert_near(field, (-near).exp(), 0.02, &format!("field, z {z}, lag {lag_m}"));
            let what = format!("intensity, z {z}, lag {lag_m}");
            assert_near(intensity, (-2.0 * near).exp(), 0.05, &what);
        }
    }
}

/// Variance of the intensity that the radar reports of a plate over its mean power squared.
fn variance(base: &Base, looks: f64) -> [f64; 2] {
    let scene = scene(&[[0.0, 0.0, 0.0, 0.5]], grid());
    let world = World::new(&scene, &scene.target.mesh);
    over_seeds(|seed| {
        let acting: [Acting; 1] = [(&Speckle, looks)];
        let means = means(&world, seed, base, &acting, 1);
        let seen = observe(&world, seed, base, &means, &acting, Grain::Field);
        assert_eq!(seen.len(), grid().count());
        let mean_w = means[0].unwrap().report.power_w;
        let off = seen
            .iter()
            .map(|detection| 1e-3 * 10f64.powf(0.1 * detection.power_dbm) / mean_w)
            .map(|intensity| (intensity - 1.0).powi(2));
        off.sum::<f64>() / seen.len() as f64
    })
}

#[test]
fn contrast_is_one_over_the_root_of_the_looks() {
    for looks in [1.0, 2.5, 4.0, 8.0] {
        let most_error = 0.15 / looks;
        assert_near(variance(&DIFFUSE, looks), 1.0 / looks, most_error, &format!("{looks} looks"));
    }
}

#[test]
fn what_facets_mirror_together_does_not_speckle() {
    let delta = WAVELENGTH_M / (TAU * WAIST_M);
    // As smooth as the beam is narrow: half of the lobe is a mirror's.
    let smooth = Base { m: delta, k: 0.0, f_lambda: 0.1, ..DIFFUSE };
    let seen = Local { beam_slope: delta, ..smooth.local() };
    for cos in [1.0, 0.9998, 0.999] {
        let [speckled, mirrored] = seen.parts_per_sr(cos);
        assert!((mirrored / speckled - 1.0).abs() < 1e-12);
    }
    // A constant and a circular Gaussian of half the power each: 1 − ½².
    assert_near(variance(&smooth, 1.0), 0.75, 0.1, "half mirrored");
}

#[test]
fn a_part_of_a_look_widens_as_it_should() {
    assert_eq!(shares(4.0), [0.25; 4]);
    assert_eq!(shares(1.0), [1.0]);
    for looks in [1.3, 2.5, 3.999] {
        let shares = shares(looks);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let squares: f64 = shares.iter().map(|share| share * share).sum();
        assert!((squares * looks - 1.0).abs() < 1e-12);
        assert!(shares.iter().all(|share| *share >= 0.0));
    }
}

/// Moves the target under every beam: by so much, and turns it about what the beam meets.
struct Moved {
    by_m: DVec3,
    turn_rad: f64,
}

impl Effect for Moved {
    fn name(&self) -> &'static str {
        "moved"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 1.0]
    }
    fn parameters(&self, _: f64) -> Value {
        Value::Null
    }
    fn displacement(&self, _: f64, sight: &Sight) -> Option<Displacement> {
        let rotation = DMat3::from_axis_angle(DVec3::Y, self.turn_rad);
        Some(Displacement { rotation, translation_m: self.by_m, pivot: sight.look?.point })
    }
}

/// Correlation of the fields of a plate as it stands and as it was moved.
fn after(moved: &Moved, further_m: f64) -> [[f64; 2]; 2] {
    let scene = scene(&[[0.0, 0.0, 0.0, 0.5]], grid());
    let world = World::new(&scene, &scene.target.mesh);
    let sums: Vec<Complex<f64>> = (0..SEEDS)
        .map(|seed| {
            let acting: [Acting; 1] = [(moved, 1.0)];
            let [still, moved] =
                [&[][..], &acting[..]].map(|acting| Field::new(&world, seed, &DIFFUSE, acting, 4));
            let products = world.sights.iter().flat_map(|sight| {
                let range_m = sight.look.unwrap().range_m + further_m;
                let there = moved.sum(sight, range_m).unwrap().amplitudes;
                std::iter::zip(amplitudes(&still, sight), there).map(|(a, b)| a.conj() * b)
            });
            products.sum::<Complex<f64>>() / (4 * world.sights.len()) as f64
        })
        .collect();
    [|z: Complex<f64>| z.re, |z: Complex<f64>| z.im]
        .map(|part| over_seeds(|seed| part(sums[seed as usize])))
}

#[test]
fn a_moved_target_has_moved_its_speckle() {
    let still = Moved { by_m: DVec3::ZERO, turn_rad: 0.0 };
    // Sideways: as for beams so far apart.
    let [re, im] = after(&Moved { by_m: DVec3::new(0.004, -0.005, 0.0), ..still }, 0.0);
    assert_near(re, (-(4.1e-5 / (WAIST_M * WAIST_M))).exp(), 0.02, "sideways");
    assert_near(im, 0.0, 0.02, "sideways, turned in phase");
    // Away by an eighth of a wave: all of it, a quarter of a turn later.
    let [re, im] =
        after(&Moved { by_m: -WAVELENGTH_M / 8.0 * DVec3::Z, ..still }, WAVELENGTH_M / 8.0);
    assert!(re[0].abs() < 1e-3, "{re:?}");
    assert_near(im, 1.0, 0.03, "away");
    // Turned by the width of the beam's slopes, and by twice that.
    let delta = WAVELENGTH_M / (TAU * WAIST_M);
    for turns in [1.0, 2.0] {
        let [re, im] = after(&Moved { turn_rad: turns * delta, ..still }, 0.0);
        assert_near(re, (-turns * turns / 4.0).exp(), 0.03, "turned");
        assert_near(im, 0.0, 0.03, "turned, in phase");
    }
}

#[test]
fn only_scatterers_that_are_seen_count_and_each_range_cell_for_itself() {
    const SPACING_M: f64 = 0.0045;
    // A plate half of which hides behind another, less than a spot and more than two range cells in front.
    const FRONT_M: f64 = 0.02;
    let (behind, front) = ([0.0, 0.0, 0.0, 0.4], [0.15, 0.0, FRONT_M, 0.3]);
    let beams = || (-8..=8).map(|step| [0.01 * f64::from(step), 0.0]);
    let both = scene(&[front, behind], beams());
    let world = World::new(&both, &both.target.mesh);
    let seen = Scatterers::new(&world, 1, &DIFFUSE, &[], SPACING_M, 1).seen;
    for scatterer in &seen {
        let DVec3 { x, y, z } = scatterer.point;
        let on_front = z > FRONT_M - 2e-6;
        // Seen from 8 m, the edge of the front at x = 0 hides what is beyond x = 0 at z = 0.
        let shown = x < 1e-6 || (y - HEIGHT_M).abs() > 0.15;
        assert!(on_front || (z > -2e-6 && shown), "{:?}", scatterer.point);
    }
    let [on_front, on_behind] = [true, false]
        .map(|front| seen.iter().filter(|s| (s.point.z > 0.5 * FRONT_M) == front).count() as f64);
    let each_m2 = SPACING_M * SPACING_M;
    assert!((on_front * each_m2 / 0.09 - 1.0).abs() < 0.01, "{on_front}");
    // Half of it, and strips above and below the front.
    let shown_m2 = 0.08 + 2.0 * 0.2 * 0.05;
    assert!((on_behind * each_m2 / shown_m2 - 1.0).abs() < 0.03, "{on_behind}");
    // The front alone returns the same from its own range: what lies behind is in other cells.
    let alone = scene(&[front], beams());
    let lone = World::new(&alone, &alone.target.mesh);
    let [with, without] = [&world, &lone].map(|world| Field::new(world, 1, &DIFFUSE, &[], 1));
    for (sight, same) in std::iter::zip(&world.sights, &lone.sights) {
        let Some(look) = same.look else { continue };
        let [with, without] = [(&with, sight), (&without, same)]
            .map(|(field, sight)| field.sum(sight, look.range_m).unwrap().amplitudes[0]);
        assert!((with - without).norm() < 1e-9, "{with} {without}");
    }
}

#[test]
fn scatterers_lie_evenly_whatever_the_size_of_the_facets() {
    const SPACING_M: f64 = 0.005;
    let scene = scene(&[[0.0, 0.0, 0.0, 0.5]], grid());
    let places: Vec<DVec3> = places(&scene.target.mesh, 3, SPACING_M)
        .into_iter()
        .filter(|place| place.z > -1e-9)
        .collect();
    // In squares of 36 scatterers: their number varies by far less than the 6 of Poisson's law.
    // And not on a lattice.
    let columns: BTreeSet<i64> = places.iter().map(|place| (1e9 * place.x) as i64).collect();
    assert!(columns.len() > places.len() - 5, "{} of {}", columns.len(), places.len());
    let mut counts = [[0.0; 16]; 16];
    for place in places {
        let [x, y] = [place.x, place.y - HEIGHT_M].map(|at| ((at + 0.24) / 0.03).floor());
        if (0.0..16.0).contains(&x) && (0.0..16.0).contains(&y) {
            counts[y as usize][x as usize] += 1.0;
        }
    }
    let all: Vec<f64> = counts.into_iter().flatten().collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let variance = all.iter().map(|count| (count - mean).powi(2)).sum::<f64>() / all.len() as f64;
    assert!((mean - 36.0).abs() < 0.5 && variance.sqrt() < 3.5, "{mean} {}", variance.sqrt());
}

/// Density of the slopes of one law, smoothed by the beam's, by a sum over a plane.
fn smoothed(law: &Local, slope: f64, delta: f64) -> f64 {
    const STEPS: i32 = 240;
    let step = 5.0 * delta / f64::from(STEPS / 2);
    let mut sum = [0.0; 2];
    for i in -STEPS / 2..=STEPS / 2 {
        for j in -STEPS / 2..=STEPS / 2 {
            let (x, y) = (step * f64::from(i), step * f64::from(j));
            let weight = (-(x * x + y * y) / (delta * delta)).exp();
            let tan2 = (slope + x).powi(2) + y * y;
            let density = match law.slopes {
                Slopes::Beckmann => (-tan2 / law.m[0].powi(2)).exp(),
                Slopes::Ggx => (1.0 + tan2 / law.m[0].powi(2)).powi(-2),
            };
            sum[0] += weight * density;
            sum[1] += weight;
        }
    }
    sum[0] / sum[1] / (PI * law.m[0].powi(2))
}

#[test]
fn lobes_are_as_wide_as_the_beam_shows_them() {
    let delta = WAVELENGTH_M / (TAU * WAIST_M);
    for slopes in [Slopes::Beckmann, Slopes::Ggx] {
        for (m, most) in [(0.05, 3e-4), (0.08, 1e-4), (0.3, 1e-4)] {
            let own = Base { slopes, m, k: 0.0, f_lambda: 0.1, ..DIFFUSE }.local();
            let seen = Local { beam_slope: delta, ..own };
            for slope in [0.0, 0.02, 0.05, 0.1, 0.2] {
                let cos = 1.0 / f64::hypot(1.0, slope);
                let wider = seen.f_per_sr(cos) / own.f_per_sr(cos);
                let expected = smoothed(&own, slope, delta) / smoothed(&own, slope, 1e-6);
                let off = wider / expected - 1.0;
                assert!(off.abs() < most, "{slopes:?}, m {m}, slope {slope}: {off:e}");
            }
        }
    }
}

#[test]
fn a_second_surface_is_seen_as_far_as_two_spots_overlap() {
    const STEP_M: f64 = 0.001;
    let spot_m2 = WAIST_M * WAIST_M;
    let steps = || (-60..=60).map(|step| STEP_M * f64::from(step));
    let overlapping = |aside_m: f64| {
        let u = |x: f64, y: f64| (-2.0 * (x * x + y * y) / spot_m2).exp();
        let row = |y: f64| steps().map(|x| u(x, y) * u(x + aside_m, y)).sum::<f64>();
        steps().map(row).sum::<f64>()
    };
    for aside_m in [0.0, 0.005, 0.0136, 0.02] {
        let expected = overlapping(aside_m) / overlapping(0.0);
        assert!((overlap(aside_m * aside_m, spot_m2) / expected - 1.0).abs() < 1e-6, "{aside_m}");
    }
    assert_eq!(overlap(0.04, spot_m2), 0.01);
}
