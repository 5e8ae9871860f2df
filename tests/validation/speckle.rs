//! Speckle and phases as the program renders them, against circular Gaussian fields and the length of the way.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use matdb::brdf::Brdf;
use matdb::material::builtin;
use matdb::radar::scan::Raster;
use matdb::radar::{Chirps, Pattern, Radar, Speckle, SpeckleForm};
use matdb::render::{Observer, Setup, Surface, shade, trace};
use matdb::scene::solids;
use matdb::trace::{Bvh, ScanGeometry};
use rayon::prelude::*;

use super::chirp_chain::around;
use super::fixture::Beam;
use super::page::{Row, Table, Tolerance::Below, Tolerance::Within};
use super::stage::{Aim, FOCUS_M, Keys, MIRROR, SENT_DBM, Stage, part_at, plate};

const CHALK: &str = r#"{"model":"lambert","albedo":0.5}"#;

/// Fields over which a statistic is taken.
const SEEDS: u64 = 25;

/// Between the beams of two chirps, waists.
const LAGS: [f64; 4] = [0.3, 0.7, 1.0, 1.5];

/// Groups of chirps along x and y. The last chirp of one is three waists from the first of the next, where intensities
/// share exp(−18): the groups are independent. Their beams come from one reflector and meet the plate within 7° of its
/// normal.
const GROUPS: [usize; 2] = [23, 33];
const PITCH: [f64; 2] = [4.5, 3.0];

/// Standard errors that a statistic may be off by.
const SIGMAS: f64 = 4.0;

/// Seeds of a single chirp.
const CHIRP_SEEDS: u64 = 4000;

/// The phase of a beam turns by λ/(8·z_R), 0.012°, where the target moves by λ/8.
const TURN_DEG: f64 = 0.02;

/// Rounding of 2kR over 16 m, and 4000 rays.
const PHASE_DEG: f64 = 0.05;

/// Whether a mirror's phase has the beam's own part, arctan(z/z_R). Set this, and the rows must pass.
const PHASES_KNOW_THE_BEAM: bool = false;

/// Why the rows of a mirror's phase off the focus fail, if they do.
const RANGE_ALONE: &str =
    "The phase of a mirror counts the range of its rays and leaves out the beam's own phase.";

/// The first aim of every group, m from the middle of the plate.
fn places() -> Vec<DVec3> {
    let waist_m = Beam::of_the_fixture().waist_m;
    let [across, along] = GROUPS;
    let middle = [0.5 * (across - 1) as f64, 0.5 * (along - 1) as f64];
    let place = |number: usize| {
        let x = PITCH[0] * ((number % across) as f64 - middle[0]) - 0.5 * LAGS[3];
        let y = PITCH[1] * ((number / across) as f64 - middle[1]);
        waist_m * DVec3::new(x, y, 0.0)
    };
    (0..across * along).map(place).collect()
}

/// A ray from the middle of the reflector, so far from the plate's middle, to a place on the plate.
fn aim_at(at: DVec3, reflector_m: f64) -> Aim {
    let way = DVec3::new(0.0, 0.0, reflector_m) - at;
    let back = way.normalize();
    let z_m = way.length() - FOCUS_M;
    Aim { at, z_m, yaw_rad: back.x.atan2(back.z), pitch_rad: back.y.asin() }
}

/// A plate of chalk under a scan.
struct Scan {
    stage: Stage,
    aims: Vec<Aim>,
    /// Received over sent without speckle.
    means: Vec<f64>,
}

impl Scan {
    /// Of places on the plate, which stands so far behind the focus.
    fn new(places: &[DVec3], z_m: f64) -> Scan {
        let aims: Vec<Aim> = places.iter().map(|&at| aim_at(at, FOCUS_M + z_m)).collect();
        let stage = Stage::with(&[("chalk", CHALK)]);
        let mut scan = Scan { stage, aims, means: Vec::new() };
        scan.means = scan.ratios("", "");
        scan
    }

    /// Received over sent, with keys at the start of the scene and of the radar.
    fn ratios(&self, top: &str, radar: &str) -> Vec<f64> {
        let keys = Keys { top, rays: 1, radar, more: "" };
        let echoes = self.stage.render(&plate("chalk"), &self.aims, keys);
        echoes.iter().map(|echoes| echoes[0].ratio).collect()
    }

    /// The same over the mean of each chirp.
    fn over_mean(&self, top: &str, radar: &str) -> Vec<f64> {
        self.over_mean_and_noise(top, radar, 0.0)
    }

    /// The same where noise adds this power.
    fn over_mean_and_noise(&self, top: &str, radar: &str, noise: f64) -> Vec<f64> {
        let ratios = self.ratios(top, radar);
        std::iter::zip(ratios, &self.means).map(|(ratio, mean)| ratio / (mean + noise)).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Variance over the squared mean.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    mean_of(values.iter().map(|x| (x / mean - 1.0).powi(2)), values.len())
}

fn mean_of(values: impl Iterator<Item = f64>, count: usize) -> f64 {
    values.sum::<f64>() / count as f64
}

/// Covariance of two intensities over their squared mean, which is the correlation of fully developed speckle.
fn correlation(pairs: &[[f64; 2]]) -> f64 {
    let all: Vec<f64> = pairs.iter().flatten().copied().collect();
    let mean = mean(&all);
    mean_of(pairs.iter().map(|[a, b]| (a / mean - 1.0) * (b / mean - 1.0)), pairs.len())
}

/// Its standard error from so many independent pairs of exponential intensities that share ρ, by their moments up to the
/// fourth.
fn error_of_correlation(rho: f64, pairs: usize) -> f64 {
    ((1.0 + rho * (4.0 + rho * (2.0 * rho - 3.0))) / pairs as f64).sqrt()
}

/// Standard error of the variance over the squared mean, from so many Gamma variates of shape L.
fn error_of_variance(looks: f64, count: usize) -> f64 {
    (2.0 * (1.0 + 1.0 / looks) / count as f64).sqrt() / looks
}

/// A correlation that should be ρ.
fn correlation_row(what: String, pairs: &[[f64; 2]], rho: f64) -> Row {
    let allowed = around(rho, SIGMAS * error_of_correlation(rho, pairs.len()));
    Row::new(what, correlation(pairs), allowed)
}

fn form_key(form: &str) -> String {
    format!("speckle = {{ form = \"{form}\" }}")
}

/// Neighbouring chirps.
fn lags() -> Vec<Row> {
    let waist_m = Beam::of_the_fixture().waist_m;
    let mut rows = Vec::new();
    for z_m in [0.0, 0.5] {
        // Lags count where the beams pass the focus.
        let unit_m = waist_m * (1.0 + z_m / FOCUS_M);
        let mut all = Vec::new();
        for place in places() {
            all.push(place);
            all.extend(LAGS.map(|lag| place + lag * unit_m * DVec3::X));
        }
        let scan = Scan::new(&all, z_m);
        for form in ["law", "scatterers", "independent"] {
            let mut pairs = [const { Vec::new() }; LAGS.len()];
            for seed in 0..SEEDS {
                let powers = scan.over_mean(&format!("seed = {seed}"), &form_key(form));
                for group in powers.chunks_exact(1 + LAGS.len()) {
                    for (pairs, &other) in pairs.iter_mut().zip(&group[1..]) {
                        pairs.push([group[0], other]);
                    }
                }
            }
            for (lag, pairs) in LAGS.iter().zip(&pairs) {
                let rho = if form == "independent" { 0.0 } else { (-2.0 * lag * lag).exp() };
                let what = format!("{lag} w₀ apart: `{form}`, z = {z_m} m, share of two chirps");
                rows.push(correlation_row(what, pairs, rho).digits(3));
            }
        }
    }
    rows
}

/// One chirp of a plate of a built-in material, one look, over many seeds: sd/mean.
fn contrast(material: &str, form: SpeckleForm, rays: usize) -> f64 {
    let law = builtin::get(material).unwrap().unwrap().scattering().unwrap();
    let one = Raster { lines: 1, chirps_per_line: 1, width_m: 1e-3, height_m: 1e-3 };
    let radar = Radar {
        scan: Pattern::Raster(one),
        threshold_dbm: -300.0,
        speckle: Some(Speckle { looks: 1.0, form: Some(form), ..Speckle::default() }),
        ..Radar::default()
    };
    let mut mesh = solids::plate(0.3, 0.3);
    mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let (bvh, regions) = (Bvh::new(&mesh), vec![0; mesh.facets.len()]);
    let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &regions);
    let footprints = trace(&geometry, rays, &|_| {}).unwrap();
    let surfaces: [Surface; 1] = [Surface::new(&law as &Brdf)];
    let power_w = |seed: u64| {
        let setup = Setup { seed, ..Setup::new(geometry, &surfaces) };
        shade(&setup, &footprints, Observer::Radar, &|_| {}).unwrap().echoes[0].power_w
    };
    let powers_w: Vec<f64> = (1..=CHIRP_SEEDS).into_par_iter().map(power_w).collect();
    variance(&powers_w).sqrt()
}

fn contrasts() -> Vec<Row> {
    let mut rows = Vec::new();
    for (form, name) in [
        (SpeckleForm::Law, "law"),
        (SpeckleForm::Scatterers, "scatterers"),
        (SpeckleForm::Independent, "independent"),
    ] {
        for rays in [1, 16] {
            for (material, allowed) in
                [("steel", Below(0.05)), ("mannequin-paint", Within(0.95, 1.05))]
            {
                let what = format!("`{name}`, rays = {rays}: contrast of `{material}`");
                rows.push(Row::new(what, contrast(material, form, rays), allowed).digits(3));
            }
        }
    }
    rows
}

/// Chirps far apart, several looks: the variance is 1/L.
fn looks() -> Vec<Row> {
    let scan = Scan::new(&places(), 0.0);
    let mut rows = Vec::new();
    for (form, looks) in [
        ("law", 1.0),
        ("law", 2.0),
        ("law", 5.0),
        ("law", 16.0),
        ("scatterers", 1.0),
        ("scatterers", 2.0),
        ("scatterers", 5.0),
        ("scatterers", 16.0),
        ("independent", 1.0),
        ("independent", 2.5),
        ("independent", 16.0),
    ] {
        let radar = format!("speckle = {{ form = \"{form}\", looks = {looks} }}");
        let powers: Vec<f64> =
            (0..5).flat_map(|seed| scan.over_mean(&format!("seed = {seed}"), &radar)).collect();
        let allowed = around(1.0, looks * SIGMAS * error_of_variance(looks, powers.len()));
        let what = format!("L = {looks}: `{form}`, L times the variance");
        rows.push(Row::new(what, looks * variance(&powers), allowed).digits(3));
    }
    rows
}

/// Noise over the mean echo in [`repeats`].
const NOISE: f64 = 0.25;

/// The same target scanned again.
fn repeats() -> Vec<Row> {
    let scan = Scan::new(&places(), 0.0);
    let noise = NOISE * mean(&scan.means);
    let level_dbm = SENT_DBM + 10.0 * noise.log10();
    // Amplitudes s + n and s + n′ share S/(S + N), intensities its square.
    let rho = mean_of(scan.means.iter().map(|s| (s / (s + noise)).powi(2)), scan.means.len());
    let mut rows = Vec::new();
    for form in ["law", "scatterers"] {
        let quiet = form_key(form);
        let noisy = format!("{quiet}\nnoise = {{ level_dbm = {level_dbm}, range_sd_m = 0 }}");
        let (mut again, mut other) = (Vec::new(), Vec::new());
        let mut most: f64 = 0.0;
        for seed in 0..5 {
            let [first, second] =
                [1, 2].map(|noise_seed| scan.over_mean(&seeds(seed, noise_seed), &quiet));
            let changes = std::iter::zip(&first, &second).map(|(a, b)| (a / b - 1.0).abs());
            most = changes.fold(most, f64::max);
            let another = scan.over_mean(&seeds(seed + 100, 1), &quiet);
            other.extend(std::iter::zip(first, another).map(|(a, b)| [a, b]));
            let [first, second] = [1, 2].map(|noise_seed| {
                scan.over_mean_and_noise(&seeds(seed, noise_seed), &noisy, noise)
            });
            again.extend(std::iter::zip(first, second).map(|(a, b)| [a, b]));
        }
        let what = format!("`{form}`, no noise: largest change with another `noise_seed`");
        rows.push(Row::new(what, most, Below(1e-12)));
        let what = format!("`{form}`, echo 6 dB above the noise: share with another `noise_seed`");
        rows.push(correlation_row(what, &again, rho).digits(3));
        let what = format!("`{form}`, no noise: share with another `seed`");
        rows.push(correlation_row(what, &other, 0.0));
    }
    rows
}

fn seeds(seed: u64, noise_seed: u64) -> String {
    format!("seed = {seed}\nnoise_seed = {noise_seed}")
}

/// Phase, rad, of a facing mirror so far behind the focus.
fn mirror_phase_rad(stage: &Stage, behind_m: f64, rays: usize) -> f64 {
    let place = DVec3::new(0.0, 0.0, -behind_m);
    let parts = part_at("target", "builtin:plate", place, "size_m = [2, 2, 0]", "mirror", "");
    let keys = Keys { rays, radar: "phases = true", ..Keys::default() };
    stage.render(&parts, &[Aim::facing(0.0)], keys);
    stage.column("phase_rad")[0]
}

/// An angle between −π and π.
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// A mirror moved by λ/8, and from the focus to places far from it.
fn phases() -> Vec<Row> {
    let stage = Stage::with(&[("mirror", MIRROR)]);
    let beam = Beam::of_the_fixture();
    let eighth_m = beam.wavelength_m / 8.0;
    let mut rows = Vec::new();
    for (rays, kind) in [(1, "one ray"), (4000, "4000 rays")] {
        let focus_rad = mirror_phase_rad(&stage, 0.0, rays);
        let mut most_deg: f64 = 0.0;
        for z_m in [-0.5, -0.2, 0.0, 0.2, 0.5] {
            let here_rad = mirror_phase_rad(&stage, z_m, rays);
            for (step_m, way) in [(eighth_m, "away"), (-eighth_m, "nearer")] {
                let turn_rad = wrapped(mirror_phase_rad(&stage, z_m + step_m, rays) - here_rad);
                let expected_deg = step_m.signum() * FRAC_PI_2.to_degrees();
                let what = format!("z = {z_m} m, {kind}: turn of a mirror's phase, λ/8 {way}");
                let allowed = Within(expected_deg - TURN_DEG, expected_deg + TURN_DEG);
                rows.push(Row::new(what, turn_rad.to_degrees(), allowed).digits(5).unit("°"));
            }
            let way_rad = 2.0 * TAU / beam.wavelength_m * z_m - (z_m / beam.rayleigh_m).atan();
            most_deg = most_deg.max(wrapped(here_rad - focus_rad - way_rad).to_degrees().abs());
        }
        let what = format!(
            "z = ±0.2 and ±0.5 m, {kind}: worst error of a mirror's phase against that at the focus"
        );
        let row = Row::new(what, most_deg, Below(PHASE_DEG)).unit("°");
        rows.push(if PHASES_KNOW_THE_BEAM { row } else { row.fails_because(RANGE_ALONE) });
    }
    rows
}

pub fn tables() -> Vec<Table> {
    let lags = "Speckle of neighbouring chirps at a large white plate, 25 seeds of 759 groups of chirps. The groups are 3 w₀ apart, so \
                that all 18 975 are independent. The beams come from one reflector and pass the focus d apart. At the focus and behind \
                it intensities share ρ = exp(−2d²/w₀²) of their variance, and nothing where each chirp draws its own. The tolerance is \
                four standard errors, √((1 + 4ρ − 3ρ² + 2ρ³)/n) for n pairs of exponential intensities; that the beams turn about \
                the reflector takes at most 0.002.";
    let contrasts = "One chirp, one look, 4000 seeds, by the library: standard deviation of the power over its mean, at plates that face \
                     the radar. A mirror does not speckle. Paint does, but for the 5 % of its lobe that are coherent, which take \
                     0.1 % off its contrast. The standard error is 0.03; the seeds are fixed.";
    let looks = "L looks, 759 chirps 3 w₀ and more apart, five seeds: L times the variance over the squared mean, which is 1. The tolerance is four \
                 standard errors of Gamma's law, √(2(1 + 1/L)/n).";
    let repeats = "The same plates scanned again, five seeds. Another `noise_seed` must leave the speckle: without noise \
                   nothing changes, with noise N below the mean echo S the intensities share (S/(S + N))². Another `seed` is \
                   another surface. Tolerances are as for neighbouring chirps.";
    let phases = "Phases of a facing mirror that moves by λ/8, away and nearer: a quarter of a turn. The beam's own phase is at most \
                  0.012° of it, hence 0.02°. Between the focus and z the phase has to turn by 2kz − arctan(z/z_R).";
    let tables = [
        (lags, self::lags()),
        (contrasts, self::contrasts()),
        (looks, self::looks()),
        (repeats, self::repeats()),
        (phases, self::phases()),
    ];
    tables.map(|(text, rows)| Table { text: text.to_owned(), rows }).into()
}
