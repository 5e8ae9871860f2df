//! Promise: speckle is a field fixed to the surface. Neighbouring chirps share it as their beams overlap, another pose,
//! frequency or direction sees another one, a mirror does not speckle, and a repeated scan differs by its noise.

use std::f64::consts::TAU;

use crate::support;
use glam::DVec3;
use matdb::brdf::{Brdf, Fresnel, Lambert, Scattering};
use matdb::frames::Point;
use matdb::geometry::Mesh;
use matdb::radar::scan::{Elliptical, Raster};
use matdb::radar::{Chirps, Noise, Pattern, Radar, Speckle, SpeckleForm};
use matdb::render::{Echo, Observer, RenderError, Setup, Surface, shade, trace};
use matdb::scene::solids;
use matdb::trace::{Bvh, ScanGeometry};
use matdb::units::watts_from_dbm;
use rayon::prelude::*;

const SEEDS: u64 = 25;
const FIELDS: [SpeckleForm; 2] = [SpeckleForm::Law, SpeckleForm::Scatterers];
const DIFFUSE: Lambert = Lambert { albedo: 0.5 };

/// The paper's radar with speckle and a beam that is as wide everywhere.
fn radar(scan: Pattern, form: SpeckleForm, looks: f64) -> Radar {
    let mut radar = Radar {
        scan,
        threshold_dbm: -300.0,
        speckle: Some(Speckle { looks, form: Some(form), ..Default::default() }),
        ..Radar::default()
    };
    radar.beam.edge_growth = 1.0;
    radar
}

/// Chirps `step_m` apart along a line of the target plane, `lines` of them 0.1 m apart.
fn lines(lines: usize, step_m: f64) -> Pattern {
    let chirps_per_line = 21;
    let width_m = step_m * (chirps_per_line - 1) as f64;
    Pattern::Raster(Raster { lines, chirps_per_line, width_m, height_m: 0.1 * (lines - 1) as f64 })
}

fn plate() -> Mesh {
    moved(solids::plate(1.6, 1.6), DVec3::new(0.0, 1.1, 0.0))
}

fn moved(mut mesh: Mesh, by_m: DVec3) -> Mesh {
    mesh.vertices.iter_mut().for_each(|vertex| *vertex += by_m);
    mesh
}

/// A rendering of one mesh of one material.
struct Scene<'a> {
    radar: &'a Radar,
    mesh: &'a Mesh,
    law: &'a dyn Scattering,
    rays: usize,
    observer: Observer,
}

impl<'a> Scene<'a> {
    fn new(radar: &'a Radar, mesh: &'a Mesh) -> Scene<'a> {
        Scene { radar, mesh, law: &DIFFUSE, rays: 1, observer: Observer::Radar }
    }

    /// The echoes of a seed, and of a seed of the noise.
    fn echoes(&self, seed: u64, noise_seed: Option<u64>) -> Result<Vec<Echo>, RenderError> {
        let chirps = Chirps::draw(self.radar, |_| Err("no file".to_owned())).unwrap();
        let (bvh, regions) = (Bvh::new(self.mesh), vec![0; self.mesh.facets.len()]);
        let geometry = ScanGeometry::new(self.radar, &chirps, &bvh, &regions);
        let footprints = trace(&geometry, self.rays, &|_| {})?;
        let surfaces = [Surface::new(self.law)];
        let setup = Setup { seed, noise_seed, ..Setup::new(geometry, &surfaces) };
        Ok(shade(&setup, &footprints, self.observer, &|_| {})?.echoes)
    }

    fn powers_w(&self, seed: u64) -> Vec<f64> {
        self.echoes(seed, None).unwrap().iter().map(|echo| echo.power_w).collect()
    }
}

/// Mean, and standard deviation over the mean.
fn contrast(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
    (mean, variance.sqrt() / mean)
}

/// Correlation of intensities of unit mean, over many pairs: ⟨(a − 1)(b − 1)⟩, and its standard error.
fn correlation(pairs: &[[f64; 2]]) -> [f64; 2] {
    let mean = pairs.iter().flatten().sum::<f64>() / (2 * pairs.len()) as f64;
    let products: Vec<f64> =
        pairs.iter().map(|[a, b]| (a / mean - 1.0) * (b / mean - 1.0)).collect();
    let found = products.iter().sum::<f64>() / products.len() as f64;
    let variance = products.iter().map(|x| (x - found).powi(2)).sum::<f64>();
    [found, variance.sqrt() / products.len() as f64]
}

#[test]
fn chirps_share_their_speckle_as_their_beams_overlap() {
    // At the focus and out of it alike: the overlap of two beams does not change along their way.
    for form in FIELDS {
        for z_m in [0.0, -0.4] {
            let radar = radar(lines(15, 0.25 * Radar::default().waist_m()), form, 1.0);
            let waist_m = radar.waist_m();
            let mesh = moved(plate(), DVec3::new(0.0, 0.0, z_m));
            let mut pairs = vec![Vec::new(); 9];
            let scans: Vec<Vec<f64>> = (0..SEEDS)
                .into_par_iter()
                .map(|seed| Scene::new(&radar, &mesh).powers_w(seed))
                .collect();
            for line in scans.iter().flat_map(|scan| scan.chunks(21)) {
                for (lag, pairs) in pairs.iter_mut().enumerate() {
                    // Lines are far apart, and of one line a pair every two waists is independent enough.
                    pairs.extend((0..21 - lag).step_by(8).map(|i| [line[i], line[i + lag]]));
                }
            }
            for (lag, pairs) in pairs.iter().enumerate() {
                let d = 0.25 * lag as f64;
                let [found, error] = correlation(pairs);
                let expected = (-2.0 * d * d).exp();
                assert!(
                    (found - expected).abs() < 4.0 * error,
                    "{form:?}, z = {z_m}, {d} w0: {found} +- {error} is not {expected}, w0 = {waist_m}"
                );
            }
        }
    }
}

#[test]
fn the_contrast_is_that_of_the_looks() {
    let sparse = Raster { lines: 12, chirps_per_line: 12, width_m: 0.9, height_m: 0.9 };
    for form in FIELDS {
        for (looks, rays) in [(1.0, 1), (4.0, 1), (1.0, 16)] {
            let radar = radar(Pattern::Raster(sparse.clone()), form, looks);
            let mesh = plate();
            let scene = Scene { rays, ..Scene::new(&radar, &mesh) };
            // The mean falls towards the corners by the cosine and the ranges.
            let scans: Vec<Vec<f64>> =
                (0..SEEDS).into_par_iter().map(|seed| scene.powers_w(seed)).collect();
            let quiet = Radar { speckle: None, ..radar.clone() };
            let means = Scene { rays, ..Scene::new(&quiet, &mesh) }.powers_w(0);
            let ratios: Vec<f64> = scans
                .iter()
                .flat_map(|scan| scan.iter().zip(&means).map(|(power, mean)| power / mean))
                .collect();
            let (mean, found) = contrast(&ratios);
            let count = (ratios.len() as f64).sqrt();
            assert!((mean - 1.0).abs() < 4.0 / looks.sqrt() / count, "{form:?} {looks}: {mean}");
            // The standard error of a contrast of exponential powers is 1/√n.
            let expected = 1.0 / looks.sqrt();
            assert!((found / expected - 1.0).abs() < 5.0 / count, "{form:?} {looks}: {found}");
        }
    }
}

/// A scene of a plate under a line scan, tilted away from the mirror of its material, so that what is left is diffuse.
const LINES: &str = "seed = 0\n[radar]\nthreshold_dbm = -300\n[radar.beam]\nedge_growth = 1\n[radar.speckle]\n\
                     [radar.scan]\npattern = \"raster\"\nlines = 12\nchirps_per_line = 41\nwidth_m = 0.27179\nheight_m = 1.1\n\
                     [[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\nsize_m = [1.6, 1.6, 0]\nrotation_deg = [0, 30, 0]\ntranslation_m = [0, 1.1, 0]\n\
                     [[region]]\nname = \"all\"\nmaterial = \"spectralon\"\n";

#[test]
fn a_rendered_scan_shows_the_lag_correlations() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines = Vec::new();
    for seed in 0..SEEDS {
        let text = LINES.replace("seed = 0", &format!("seed = {seed}"));
        std::fs::write(folder.path().join("scene.toml"), text).unwrap();
        let out = format!("out{seed}");
        support::matdb(folder.path())
            .args(["render", "-q", "scene.toml", "-o", &out])
            .assert()
            .success();
        let cloud = support::read_cloud(&folder.path().join(out).join("cloud.ply"));
        let powers_w: Vec<f64> =
            cloud["power_dbm"].iter().map(|dbm| 10f64.powf(0.1 * dbm)).collect();
        assert_eq!(powers_w.len(), 12 * 41);
        lines.extend(powers_w.chunks(41).map(<[f64]>::to_vec));
    }
    // Neighbours are half a waist apart: 13.589 mm/2 by 40 steps.
    for lag in 0..5 {
        let pairs: Vec<[f64; 2]> = lines
            .iter()
            .flat_map(|line| (0..41 - lag).step_by(5).map(|i| [line[i], line[i + lag]]))
            .collect();
        let [found, error] = correlation(&pairs);
        let d = 0.5 * lag as f64;
        let expected = (-2.0 * d * d).exp();
        assert!((found - expected).abs() < 4.0 * error, "{d} w0: {found} is not {expected}");
    }
}

/// Plates of steel and of paint that face the radar, one chirp each, one look.
const ONE_CHIRP_EACH: &str = "[radar]\nthreshold_dbm = -300\n[radar.speckle]\n\
                              [radar.scan]\npattern = \"rays\"\nfile = \"rays.csv\"\n\
                              [[mesh]]\nname = \"polished\"\nfile = \"builtin:plate\"\nsize_m = [0.3, 0.3, 0]\ntranslation_m = [-0.2, 1.1, 0]\n\
                              [[mesh]]\nname = \"painted\"\nfile = \"builtin:plate\"\nsize_m = [0.3, 0.3, 0]\ntranslation_m = [0.2, 1.1, 0]\n\
                              [[region]]\nname = \"polished\"\nmesh = \"polished\"\nmaterial = \"steel\"\n\
                              [[region]]\nname = \"painted\"\nmesh = \"painted\"\nmaterial = \"mannequin-paint\"\n";
const TWO_RAYS: &str = "chirp,ox_m,oy_m,oz_m,dx,dy,dz\n0,-0.2,1.1,8,0,0,-1\n1,0.2,1.1,8,0,0,-1\n";

/// Powers, mW, that the program reports of both plates, one run a seed.
fn powers_mw(seeds: std::ops::Range<u64>) -> Vec<[f64; 2]> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rays.csv"), TWO_RAYS).unwrap();
    let mut powers = Vec::new();
    for seed in seeds {
        let scene = format!("seed = {seed}\n{ONE_CHIRP_EACH}");
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let mut render = support::matdb(folder.path());
        render.env("RAYON_NUM_THREADS", "1").args(["render", "-q", "scene.toml", "-o", "out"]);
        render.assert().success();
        let cloud = support::read_cloud(&folder.path().join("out/cloud.ply"));
        assert_eq!(cloud["chirp"], [0.0, 1.0]);
        powers.push([0, 1].map(|chirp| 10f64.powf(0.1 * cloud["power_dbm"][chirp])));
    }
    powers
}

#[test]
fn over_a_thousand_seeds_a_polished_plate_is_calm_and_paint_speckles() {
    // Two runs at a time.
    let halves = std::thread::scope(|scope| {
        let runs = [1..501, 501..1001].map(|seeds| scope.spawn(|| powers_mw(seeds)));
        runs.map(|run| run.join().unwrap())
    });
    let powers = halves.concat();
    let [calm, rough] = [0, 1]
        .map(|chirp| contrast(&powers.iter().map(|both| both[chirp]).collect::<Vec<f64>>()).1);
    assert!(calm < 0.05, "{calm}");
    // The standard error of a thousand exponential powers is 0.03; the seeds are fixed.
    assert!((rough - 1.0).abs() < 0.05, "{rough}");
}

#[test]
fn a_repeated_scan_differs_by_its_noise_alone() {
    for form in FIELDS {
        let mut radar = radar(lines(5, 0.01), form, 1.0);
        let mesh = plate();
        let quiet = Scene::new(&radar, &mesh);
        assert_eq!(quiet.echoes(1, Some(1)).unwrap(), quiet.echoes(1, Some(2)).unwrap());
        assert_ne!(quiet.powers_w(1), quiet.powers_w(2));
        let level_dbm = Some(-100.0);
        radar.noise = Some(Noise { level_dbm, range_sd_m: 0.0, ..Noise::default() });
        let noisy = Scene::new(&radar, &mesh);
        let scans = [1, 2].map(|seed| noisy.echoes(1, Some(seed)).unwrap());
        assert_ne!(scans[0], scans[1]);
        let pairs: Vec<[f64; 2]> =
            std::iter::zip(&scans[0], &scans[1]).map(|(a, b)| [a.power_w, b.power_w]).collect();
        // The echoes are at some −60 dBm: what both have in common is their speckle.
        let alone: Vec<f64> = pairs.iter().map(|[a, _]| *a).collect();
        let [common, _] = correlation(&pairs);
        assert!(common > 0.95 * contrast(&alone).1.powi(2), "{common}");
    }
}

#[test]
fn another_pose_or_frequency_sees_another_field() {
    for form in FIELDS {
        let radar = radar(lines(9, 0.03), form, 1.0);
        let other = Radar { centre_frequency_ghz: 310.0, ..radar.clone() };
        let (mesh, shifted) = (plate(), moved(plate(), DVec3::new(0.05, 0.0, 0.0)));
        let all = |a: &Scene, b: &Scene| -> Vec<[f64; 2]> {
            let pairs =
                (0..SEEDS).flat_map(|seed| std::iter::zip(a.powers_w(seed), b.powers_w(seed)));
            pairs.map(|(a, b)| [a, b]).collect()
        };
        let here = Scene::new(&radar, &mesh);
        for (name, there) in
            [("pose", Scene::new(&radar, &shifted)), ("frequency", Scene::new(&other, &mesh))]
        {
            let [found, error] = correlation(&all(&here, &there));
            assert!(found.abs() < 4.0 * error.max(0.02), "{form:?} {name}: {found} +- {error}");
        }
    }
}

#[test]
fn the_law_s_field_is_another_one_where_the_radar_has_moved_and_the_same_for_a_slightly_wider_beam()
{
    let radar = radar(lines(9, 0.03), SpeckleForm::Law, 1.0);
    let mesh = plate();
    let correlated = |other: &Radar| {
        let (here, there) = (Scene::new(&radar, &mesh), Scene::new(other, &mesh));
        shared(|seed| here.powers_w(seed), |seed| there.powers_w(seed))
    };
    for (axis, by_m) in [(0, 0.3), (1, 0.2), (2, 0.3)] {
        let mut moved = radar.clone();
        moved.primary_focus_m[axis] += by_m;
        let [found, error] = correlated(&moved);
        assert!(found.abs() < 4.0 * error.max(0.02), "axis {axis}: {found} +- {error}");
    }
    let wider = Radar { spot_diameter_m: 1.06 * radar.spot_diameter_m, ..radar.clone() };
    let [found, _] = correlated(&wider);
    assert!(found > 0.95, "{found}");
}

/// Intensity correlation of scatterers between two renderings, over seeds and over spots far apart.
fn shared(a: impl Fn(u64) -> Vec<f64> + Sync, b: impl Fn(u64) -> Vec<f64> + Sync) -> [f64; 2] {
    let pairs: Vec<[f64; 2]> = (0..SEEDS)
        .into_par_iter()
        .flat_map_iter(|seed| std::iter::zip(a(seed), b(seed)).map(|(a, b)| [a, b]))
        .collect();
    correlation(&pairs)
}

#[test]
fn receivers_apart_see_less_of_each_other_s_speckle() {
    // Amplitudes exp(−β²/16δ²), hence intensities exp(−β²/8δ²).
    let mut radar = radar(lines(9, 0.05), SpeckleForm::Scatterers, 1.0);
    radar.primary_focus_m[1] = 1.1;
    let mesh = plate();
    let delta_rad = radar.wavelength_m() / (TAU * radar.waist_m());
    let at = |angle_rad: f64| {
        let (sin, cos) = angle_rad.sin_cos();
        let position = Point::new(8.0 * sin, 1.1, 8.0 * cos);
        let observer = Observer::Receiver { number: 1, position, aperture_m2: None };
        Scene { observer, ..Scene::new(&radar, &mesh) }
    };
    // The plate is lit from the middle: at its ends the receivers see it under other angles, by less than a hundredth.
    for turn in [0.0, 1.0, 2.0, 4.0] {
        let beta_rad = turn * delta_rad;
        let (first, second) = (at(0.05), at(0.05 + beta_rad));
        let [found, error] = shared(|seed| first.powers_w(seed), |seed| second.powers_w(seed));
        let expected = (-turn * turn / 8.0).exp();
        let bound = 4.0 * error + 0.02;
        assert!((found - expected).abs() < bound, "{turn}: {found} +- {error} is not {expected}");
    }
}

#[test]
fn phases_count_the_range_in_half_waves() {
    for (rays, form) in [(1, SpeckleForm::Scatterers), (16, SpeckleForm::Law)] {
        let mut radar = radar(lines(3, 0.05), form, 1.0);
        radar.phases = true;
        let mirror = Brdf::Fresnel(Fresnel { eps_real: 1.0, eps_imag: 1e6, lobe_rad: None });
        let near = moved(plate(), DVec3::new(0.0, 0.0, radar.wavelength_m() / 8.0));
        let far = plate();
        let of = |mesh: &Mesh| {
            let scene = Scene { law: &mirror, rays, ..Scene::new(&radar, mesh) };
            scene.echoes(1, None).unwrap()
        };
        let middle = of(&far).len() / 2;
        let [a, b] = [&far, &near].map(|mesh| of(mesh)[middle].phase_rad.unwrap());
        let turn_rad = (a - b).rem_euclid(TAU);
        assert!((turn_rad - TAU / 4.0).abs() < 0.02, "{turn_rad}");
    }
}

#[test]
fn several_looks_have_no_phase_and_beats_of_several_paths_no_law() {
    let refused = |radar: &Radar| radar.validate().unwrap_err().to_string();
    let mut radar = radar(Pattern::Elliptical(Elliptical::default()), SpeckleForm::Law, 4.0);
    radar.phases = true;
    assert!(refused(&radar).contains("has no phase; set looks = 1"));
    radar.speckle =
        Some(Speckle { looks: 1.0, form: Some(SpeckleForm::Independent), ..Default::default() });
    assert!(refused(&radar).contains("a law of powers without phases"));
    radar.speckle =
        Some(Speckle { looks: 1.0, form: Some(SpeckleForm::Law), ..Default::default() });
    radar.phases = false;
    radar.receiver = Some(Default::default());
    let mesh = plate();
    let scene = Scene { rays: 4, ..Scene::new(&radar, &mesh) };
    let error = scene.echoes(0, None).unwrap_err().to_string();
    assert!(error.contains("form = \"law\"") && error.contains("scatterers"), "{error}");
}

#[test]
fn a_beat_signal_speckles_as_its_powers_do() {
    let sparse = Raster { lines: 6, chirps_per_line: 6, width_m: 0.6, height_m: 0.6 };
    for (form, rays) in
        [(SpeckleForm::Law, 1), (SpeckleForm::Scatterers, 1), (SpeckleForm::Scatterers, 16)]
    {
        let mut radar = radar(Pattern::Raster(sparse.clone()), form, 1.0);
        let mesh = plate();
        let exact: Vec<Vec<f64>> =
            (0..8).map(|seed| Scene { rays, ..Scene::new(&radar, &mesh) }.powers_w(seed)).collect();
        radar.receiver = Some(matdb::radar::Receiver { temperature_k: 0.0, ..Default::default() });
        let beats: Vec<Vec<f64>> =
            (0..8).map(|seed| Scene { rays, ..Scene::new(&radar, &mesh) }.powers_w(seed)).collect();
        let pairs: Vec<[f64; 2]> = std::iter::zip(exact.concat(), beats.concat())
            .map(|(exact, beat)| [exact, beat])
            .collect();
        let alone: Vec<f64> = pairs.iter().map(|pair| pair[0]).collect();
        let [common, _] = correlation(&pairs);
        // Towards the corners a spot spreads over a few millimetres of range, a good part of a cell.
        let own = contrast(&alone).1.powi(2);
        assert!(common > 0.9 * own, "{form:?}, {rays} rays: {common} of {own}");
    }
}

#[test]
fn the_edge_of_a_mirror_keeps_a_quarter_and_a_diffuse_one_a_half() {
    let one = Raster { lines: 1, chirps_per_line: 1, width_m: 1e-6, height_m: 1e-6 };
    let radar = Radar { scan: Pattern::Raster(one), threshold_dbm: -300.0, ..Radar::default() };
    let whole = plate();
    let half = moved(solids::plate(0.8, 1.6), DVec3::new(0.4, 1.1, 0.0));
    let mirror = Brdf::Fresnel(Fresnel { eps_real: 1.0, eps_imag: 1e6, lobe_rad: None });
    for (law, expected_db) in [(&mirror as &dyn Scattering, -6.02), (&DIFFUSE, -3.01)] {
        let power_w = |mesh: &Mesh| {
            let scene = Scene { law, rays: 4000, ..Scene::new(&radar, mesh) };
            scene.powers_w(0)[0]
        };
        let found_db = 10.0 * (power_w(&half) / power_w(&whole)).log10();
        // Rays drawn from u² give the share of u to a hundredth, twice that in power.
        assert!((found_db - expected_db).abs() < 0.15, "{found_db} is not {expected_db}");
    }
    // Beside the glint of a small ball its rim returns nothing, and nothing is cut: closed form of a sphere at the focus.
    let (radius_m, rays) = (0.006, 60_000);
    let cap = solids::sphere_cap(radius_m, 0.5, 0.004);
    let cap = moved(cap, DVec3::new(0.0, 1.1, 0.0));
    let power_w = Scene { law: &mirror, rays, ..Scene::new(&radar, &cap) }.powers_w(0)[0];
    let wavenumber = TAU / radar.wavelength_m();
    let spread = wavenumber * radar.waist_m().powi(2) / (2.0 * radius_m);
    let sent_w = watts_from_dbm(radar.transmit_power_dbm - radar.system_loss_db);
    let found_db = 10.0 * (power_w / sent_w * (1.0 + spread * spread)).log10();
    assert!(found_db.abs() < 0.3, "{found_db}");
}
