//! Promise: a region that transmits, such as cloth, shows what lies behind it, at the level and the apparent range that a
//! transfer matrix over the radar's sweep gives, and the radar reports the returns that it is asked for.

use std::f64::consts::{LN_2, PI, TAU};
use std::path::Path;

use crate::support::{self, matdb, read_cloud, refused};
use glam::DVec3;
use matdb::brdf::{Brdf, Fresnel, Lambert, Layered, Scattering, Sum};
use matdb::frames::{Direction, Point};
use matdb::geometry::Mesh;
use matdb::radar::scan::Raster;
use matdb::radar::{Channel, Chirps, Footprint, Pattern, Polarisation, Radar, Receiver, Returns};
use matdb::render::{
    Batch, Bounce, Echo, Observer, RenderError, Setup, Sheet, Surface, Take, shade, trace_placed,
};
use matdb::scene::solids;
use matdb::trace::{Bvh, ScanGeometry};
use num_complex::Complex;

const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;
const METAL: Fresnel = Fresnel { eps_real: 1.0, eps_imag: 1e9, lobe_rad: None };

/// The table over the angle, the search for the peak, and echoes between sheets that the renderer leaves out.
const LEVEL_DB: f64 = 0.02;
const RANGE_M: f64 = 20e-6;

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// A shirt: 0.5 mm of ε = 1.6 − j0.08.
const CLOTH: Layer = Layer { thickness_m: 0.5e-3, eps: [1.6, 0.08] };
const AIR: [f64; 2] = [1.0, 0.0];

#[derive(Clone, Copy, Debug)]
struct Layer {
    thickness_m: f64,
    eps: [f64; 2],
}

impl Layer {
    fn air(thickness_m: f64) -> Layer {
        Layer { thickness_m, eps: AIR }
    }
}

/// r and t of layers in air for s-polarisation, by 2×2 matrices of the waves that go down and up in every layer.
fn waves(layers: &[Layer], behind: [f64; 2], cos: f64, frequency_hz: f64) -> [Complex<f64>; 2] {
    let k0 = TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S;
    let p_of = |[re, im]: [f64; 2]| {
        let root = (Complex::new(re, -im) - (1.0 - cos * cos)).sqrt();
        if root.im > 0.0 { -root } else { root }
    };
    let one = Complex::new(1.0, 0.0);
    let mut all = [[one, 0.0 * one], [0.0 * one, one]];
    let times = |a: [[Complex<f64>; 2]; 2], b: [[Complex<f64>; 2]; 2]| {
        [0, 1].map(|i| [0, 1].map(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
    };
    let mut above = Complex::new(cos, 0.0);
    for layer in layers {
        let p = p_of(layer.eps);
        let (same, other) = (0.5 * (one + p / above), 0.5 * (one - p / above));
        let turn = Complex::new(0.0, 1.0) * p * k0 * layer.thickness_m;
        all = times(all, [[same, other], [other, same]]);
        all = times(all, [[turn.exp(), 0.0 * one], [0.0 * one, (-turn).exp()]]);
        above = p;
    }
    let p = p_of(behind);
    let (same, other) = (0.5 * (one + p / above), 0.5 * (one - p / above));
    all = times(all, [[same, other], [other, same]]);
    [all[1][0] / all[0][0], 1.0 / all[0][0]]
}

/// The amplitude of a response to frequencies over the default sweep at a range, m, by Hann's window.
fn swept(amplitude: &dyn Fn(f64) -> Complex<f64>, range_m: f64) -> Complex<f64> {
    const COUNT: usize = 1024;
    let mut sum = Complex::new(0.0, 0.0);
    for number in 0..COUNT {
        let share = number as f64 / COUNT as f64;
        let frequency_hz = 300e9 + 27e9 * (share - 0.5);
        let weight = 2.0 * (PI * share).sin().powi(2) / COUNT as f64;
        let turn = 2.0 * TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S * range_m;
        sum += weight * amplitude(frequency_hz) * Complex::cis(turn);
    }
    sum
}

/// Power and range of the highest peak between two ranges, m.
fn peak(amplitude: &dyn Fn(f64) -> Complex<f64>, ends_m: [f64; 2]) -> (f64, f64) {
    highest(&|range_m| swept(amplitude, range_m).norm_sqr(), ends_m)
}

/// The greatest power between two ranges, m, and its range.
fn highest(power: &dyn Fn(f64) -> f64, [from_m, to_m]: [f64; 2]) -> (f64, f64) {
    let mut best = (0.0, 0.0);
    let (mut middle_m, mut half_m) = (0.5 * (from_m + to_m), 0.5 * (to_m - from_m));
    while half_m > 1e-7 {
        for step in -20..=20 {
            let range_m = middle_m + half_m * f64::from(step) / 20.0;
            let power = power(range_m);
            best = if power > best.0 { (power, range_m) } else { best };
        }
        (middle_m, half_m) = (best.1, half_m / 8.0);
    }
    best
}

/// What stands in front of the radar: plates across its axis at distances behind the focus, m, turned about x.
struct Stage<'a> {
    mesh: Mesh,
    region_of_facet: Vec<u16>,
    surfaces: Vec<Surface<'a>>,
}

impl<'a> Stage<'a> {
    fn new() -> Stage<'a> {
        Stage { mesh: Mesh::default(), region_of_facet: Vec::new(), surfaces: Vec::new() }
    }

    fn with(
        mut self,
        mut part: Mesh,
        place: impl Fn(DVec3) -> DVec3,
        surface: Surface<'a>,
    ) -> Self {
        part.vertices.iter_mut().for_each(|vertex| *vertex = place(*vertex) + DVec3::Y * 1.1);
        self.region_of_facet.extend(vec![self.surfaces.len() as u16; part.facets.len()]);
        self.mesh.append(&part).unwrap();
        self.surfaces.push(surface);
        self
    }

    fn plate(self, z_m: f64, tilt_rad: f64, surface: Surface<'a>) -> Self {
        let turn = glam::DMat3::from_rotation_x(tilt_rad);
        self.with(solids::plate(4.0, 4.0), move |v| turn * v - z_m * DVec3::Z, surface)
    }

    /// The echo of what lies behind one sheet on the radar's axis, in a channel.
    fn behind(&self, radar: &Radar, channel: Channel) -> Echo {
        let found = self.received(radar, 1, None, Observer::Radar, channel);
        *found.iter().find(|echo| echo.truth.unwrap().sheets == 1).unwrap()
    }

    fn echoes(
        &self,
        radar: &Radar,
        rays: usize,
        bounce: Option<Bounce>,
        observer: Observer,
    ) -> Vec<Echo> {
        self.received(radar, rays, bounce, observer, Channel::CoPolar)
    }

    fn received(
        &self,
        radar: &Radar,
        rays: usize,
        bounce: Option<Bounce>,
        observer: Observer,
        channel: Channel,
    ) -> Vec<Echo> {
        let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
        let bvh = Bvh::new(&self.mesh);
        let geometry = ScanGeometry::new(radar, &chirps, &bvh, &self.region_of_facet);
        let setup = Setup { bounce, channel, ..Setup::new(geometry, &self.surfaces) };
        let footprints = trace_placed(&setup, rays, &|_| {}).unwrap();
        shade(&setup, &footprints, observer, &|_| {}).unwrap().echoes
    }

    /// What the radar reports of a chirp along its axis.
    fn seen(&self, radar: &Radar) -> Vec<Echo> {
        self.echoes(radar, 1, None, Observer::Radar)
    }
}

/// One chirp along the axis, without losses.
fn radar(returns: Returns) -> Radar {
    let scan = Raster { lines: 1, chirps_per_line: 1, width_m: 1e-6, height_m: 1e-6 };
    Radar {
        transmit_power_dbm: 30.0,
        system_loss_db: 0.0,
        threshold_dbm: -300.0,
        footprint: Footprint::Projected,
        scan: Pattern::Raster(scan),
        returns,
        ..Radar::default()
    }
}

/// What a facing mirror loses at a distance from the focus: 1 + ζ².
fn out_of_focus(z_m: f64) -> f64 {
    let (wavelength_m, waist_m) = (SPEED_OF_LIGHT_M_PER_S / 300e9, 0.016 / (2.0 * LN_2).sqrt());
    1.0 + (z_m * wavelength_m / (PI * waist_m * waist_m)).powi(2)
}

/// The sheet of a layer whose lobe is the beam's.
fn sheet(layer: Layer) -> Sheet {
    let smooth = Brdf::Fresnel(Fresnel { lobe_rad: None, ..METAL });
    Sheet::of_thickness(&smooth, layer.thickness_m, layer.eps, &Radar::default())
}

#[test]
fn a_thick_sheet_returns_its_front_face_and_not_the_mean_of_both() {
    // n = 1.6, 8 mm: the front face alone returns ((n − 1)/(n + 1))².
    let layer = Layer { thickness_m: 8e-3, eps: [2.56, 0.0] };
    let front_db = db((0.6f64 / 2.6).powi(2));
    let found_db = db(sheet(layer).reflectance(1.0));
    // A side lobe of the back face, −31.5 dB, lies below the peak.
    assert!((found_db - front_db).abs() < 0.25 && (front_db + 12.74).abs() < 0.01, "{found_db}");
    let both = |f: f64| waves(&[layer], AIR, 1.0, f)[0];
    let expected_db = db(peak(&both, [-0.005, 0.005]).0);
    assert!((found_db - expected_db).abs() < 1e-3, "{found_db} is not {expected_db}");
    // Over two whole turns of the phase between its faces, c/(2nd) each.
    let turn_hz = SPEED_OF_LIGHT_M_PER_S / (2.0 * 1.6 * layer.thickness_m);
    let hz = |k: u32| 300e9 + turn_hz * 2.0 * f64::from(k) / 1000.0;
    let mean = |k: u32| waves(&[layer], AIR, 1.0, hz(k))[0].norm_sqr();
    let mean_db = db((0..1000).map(mean).sum::<f64>() / 1000.0);
    assert!((mean_db + 9.96).abs() < 0.05, "{mean_db}");
    // Cloth is too thin for its faces to part: they interfere.
    let cloth = |f: f64| waves(&[CLOTH], AIR, 1.0, f)[0];
    let expected_db = db(peak(&cloth, [-0.01, 0.01]).0);
    let found_db = db(sheet(CLOTH).reflectance(1.0));
    assert!((found_db - expected_db).abs() < 1e-3, "{found_db} is not {expected_db}");
}

#[test]
fn two_sheets_and_a_metal_plate_return_what_one_transfer_matrix_gives() {
    let thick = Layer { thickness_m: 3e-3, eps: [2.0, 0.05] };
    let (z_m, gaps_m) = ([-0.17, -0.07, 0.06], [0.1, 0.13]);
    let (front, middle) = (sheet(CLOTH), sheet(thick));
    let stage = Stage::new()
        .plate(z_m[0], 0.0, Surface::of_sheet(&front))
        .plate(z_m[1], 0.0, Surface::of_sheet(&middle))
        .plate(z_m[2], 0.0, Surface::new(&METAL));
    let found = stage.seen(&radar(Returns::All));
    assert_eq!(found.len(), 3);
    // Meshes are the outer faces of their sheets: the air between is shorter by what the sheet takes.
    let layers = [
        CLOTH,
        Layer::air(gaps_m[0] - CLOTH.thickness_m),
        thick,
        Layer::air(gaps_m[1] - thick.thickness_m),
    ];
    let all = |f: f64| waves(&layers, [1.0, 1e9], 1.0, f)[0];
    for ((echo, z_m), number) in found.iter().zip(z_m).zip(0u8..) {
        let place_m = z_m - (-0.17);
        let (power, range_m) = peak(&all, [place_m - 0.008, place_m + 0.012]);
        let expected_db = db(power / out_of_focus(z_m));
        assert!(
            (db(echo.power_w) - expected_db).abs() < LEVEL_DB,
            "{number}: {expected_db} {}",
            db(echo.power_w)
        );
        let found_m = echo.range_m - (8.0 - 0.17);
        assert!((found_m - range_m).abs() < RANGE_M, "{number}: {found_m} is not {range_m}");
        let truth = echo.truth.unwrap();
        assert_eq!((truth.sheets, truth.region), (number, u16::from(number)));
        assert!((truth.hit.range_m - (8.0 + z_m)).abs() < 1e-9);
    }
    let ranks: Vec<u16> = found.iter().map(|echo| echo.rank).collect();
    assert_eq!(ranks, [3, 2, 1]);
}

/// A radar whose antenna is turned from upright.
fn turned(turn_deg: f64) -> Radar {
    let polarisation = Polarisation { turn_deg, ..Polarisation::default() };
    Radar { polarisation, ..radar(Returns::All) }
}

/// Shares of the power that come back along and across a field that is turned by an angle from the plane of incidence,
/// having passed a layer with these amplitudes there and back.
fn there_and_back([t_s, t_p]: [Complex<f64>; 2], turn_rad: f64) -> [f64; 2] {
    let (s, p) = (t_s * t_s, t_p * t_p);
    let (sin, cos) = turn_rad.sin_cos();
    [(s * sin * sin + p * cos * cos).norm_sqr(), ((s - p) * sin * cos).norm_sqr()]
}

/// Polyimide, whose faces return one polarisation much more than the other on a slant.
const FILM: Layer = Layer { thickness_m: 125e-6, eps: [3.4248, 0.02181] };

#[test]
fn a_plate_behind_a_slanting_sheet_loses_what_both_polarisations_lose_and_seems_farther() {
    let (chalk, brass) = (Lambert { albedo: 0.5 }, METAL);
    let slants =
        [(CLOTH, 0.0f64), (CLOTH, 0.4), (CLOTH, 0.9), (CLOTH, 1.2), (FILM, 0.7), (FILM, 1.05)];
    for (layer, tilt_rad) in slants {
        let (sheet, (amplitudes, expected_m)) = (sheet(layer), passed(layer, tilt_rad.cos()));
        for law in [&chalk as &dyn Scattering, &brass] {
            let plate = Surface::new(law);
            let bare = Stage::new().plate(0.3, 0.0, plate).seen(&turned(0.0));
            let covered = Stage::new()
                .plate(-0.3, tilt_rad, Surface::of_sheet(&sheet))
                .plate(0.3, 0.0, plate);
            // Tilted about x, the sheet is met in an upright plane.
            for turn_deg in [0.0, 90.0, 30.0, -45.0f64] {
                let [co, cross] = there_and_back(amplitudes, turn_deg.to_radians());
                let [along, across] = [Channel::CoPolar, Channel::CrossPolar]
                    .map(|channel| covered.behind(&turned(turn_deg), channel));
                let found_db = db(along.power_w / bare[0].power_w);
                let place = format!("{layer:?} {tilt_rad} {turn_deg}");
                assert!((found_db - db(co)).abs() < LEVEL_DB, "{place}: {found_db} {}", db(co));
                let told_db = db(along.truth.unwrap().passed_share);
                assert!((told_db - found_db).abs() < 1e-9, "{place}: {told_db} {found_db}");
                let crossed = across.power_w / bare[0].power_w;
                assert!(
                    (crossed - cross).abs() < 0.01 * cross + 1e-9,
                    "{place}: {crossed} {cross}"
                );
                let longer_m = along.range_m - bare[0].range_m;
                assert!(
                    (longer_m - expected_m).abs() < RANGE_M,
                    "{place}: {longer_m} {expected_m}"
                );
            }
        }
    }
    // Near (n − 1)·d, up to the waves that go to and fro within.
    let straight_m = (1.6f64.sqrt() - 1.0) * CLOTH.thickness_m;
    let (_, longer_m) = passed(CLOTH, 1.0);
    assert!((longer_m / straight_m - 1.0).abs() < 0.05, "{longer_m} {straight_m}");
}

/// Amplitudes of s and p that pass a layer one way over the sweep, and the lengthening of the way, m.
fn passed(layer: Layer, cos: f64) -> ([Complex<f64>; 2], f64) {
    let s = |f: f64| waves(&[layer], AIR, cos, f)[1] * beyond_air(layer, cos, f);
    let p = |f: f64| p_waves(layer, cos, f)[1] * beyond_air(layer, cos, f);
    let power = |range_m: f64| swept(&s, range_m).norm_sqr() + swept(&p, range_m).norm_sqr();
    let (_, range_m) = highest(&power, [-0.004, 0.004]);
    // The peak's phase runs with one way here, and with twice the range in `swept`.
    ([swept(&s, range_m), swept(&p, range_m)], 2.0 * range_m)
}

/// r and t of a layer in air for p-polarisation, by Fresnel's amplitudes and the sum of the inner echoes.
fn p_waves(layer: Layer, cos: f64, frequency_hz: f64) -> [Complex<f64>; 2] {
    let eps = Complex::new(layer.eps[0], -layer.eps[1]);
    let root = (eps - (1.0 - cos * cos)).sqrt();
    let inner = if root.im > 0.0 { -root } else { root };
    // Of the electric field: as that of s at normal incidence.
    let face = (inner - eps * cos) / (inner + eps * cos);
    let k0 = TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S;
    let once = (Complex::new(0.0, -1.0) * inner * k0 * layer.thickness_m).exp();
    let sum = 1.0 - (face * once).powi(2);
    [face * (1.0 - once * once) / sum, (1.0 - face * face) * once / sum]
}

/// What a layer's place would do to a wave if it held air.
fn beyond_air(layer: Layer, cos: f64, frequency_hz: f64) -> Complex<f64> {
    Complex::cis(TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S * cos * layer.thickness_m)
}

#[test]
fn a_film_reflects_each_polarisation_with_its_own_amplitude() {
    let film = sheet(FILM);
    for theta_rad in [0.2f64, 0.8, 1.2] {
        let (i, cos) = (Direction::from_angles(theta_rad, 0.3), theta_rad.cos());
        let [r_s, r_p] = film.facet_amplitudes(i, i.mirrored());
        let expected_p = swept(&|f| p_waves(FILM, cos, f)[0], 0.0);
        let expected_s = swept(&|f| waves(&[FILM], AIR, cos, f)[0], 0.0);
        let (found, expected) = (r_p / r_s, expected_p / expected_s);
        assert!((found - expected).norm() < 0.02 * expected.norm(), "{found} {expected}");
    }
}

#[test]
fn the_receiver_reports_what_it_is_asked_for() {
    let (cloth, glass) = (sheet(CLOTH), Fresnel { eps_real: 1.5, eps_imag: 0.0, lobe_rad: None });
    let stage = Stage::new()
        .plate(-0.1, 0.0, Surface::of_sheet(&cloth))
        .plate(0.0, 0.0, Surface::new(&METAL))
        .plate(0.1, 0.0, Surface::new(&glass));
    let sheets = |radar: &Radar| {
        let found = stage.seen(radar);
        found.iter().map(|echo| echo.truth.unwrap().sheets).collect::<Vec<_>>()
    };
    // The metal is opaque: the glass behind it is not seen.
    assert_eq!(sheets(&radar(Returns::All)), [0, 1]);
    assert_eq!(sheets(&radar(Returns::Strongest)), [1]);
    assert_eq!(sheets(&radar(Returns::First)), [0]);
    // A first return has to reach the threshold.
    let deaf = Radar { threshold_dbm: 20.0, ..radar(Returns::First) };
    assert_eq!(sheets(&deaf), [1]);
    // The beat signal gives the same.
    let beats = |returns| Radar {
        receiver: Some(Receiver { temperature_k: 0.0, zero_padding: 4, ..Receiver::default() }),
        threshold_dbm: -60.0,
        ..radar(returns)
    };
    for returns in [Returns::All, Returns::Strongest, Returns::First] {
        let found = stage.seen(&beats(returns));
        let exact = stage.seen(&radar(returns));
        assert_eq!(found.len(), exact.len(), "{returns:?}: {found:?} {exact:?}");
        for (beat, exact) in found.iter().zip(&exact) {
            assert!((db(beat.power_w / exact.power_w)).abs() < 0.05, "{beat:?} {exact:?}");
            assert!((beat.range_m - exact.range_m).abs() < 1e-4);
            assert_eq!(beat.truth.unwrap().sheets, exact.truth.unwrap().sheets);
        }
    }
}

#[test]
fn echoes_within_a_range_cell_add_up() {
    let (cloth, chalk) = (sheet(CLOTH), Lambert { albedo: 0.5 });
    let apart = |gap_m: f64| {
        let stage = Stage::new().plate(0.0, 0.0, Surface::of_sheet(&cloth)).plate(
            gap_m,
            0.0,
            Surface::new(&chalk),
        );
        stage.seen(&radar(Returns::All))
    };
    let (near, far) = (apart(0.0105), apart(0.0115));
    assert_eq!([near.len(), far.len()], [1, 2]);
    let sum_w: f64 = far.iter().map(|echo| echo.power_w).sum();
    assert!((db(near[0].power_w / sum_w)).abs() < 0.01);
}

#[test]
fn another_antenna_sees_through_cloth_as_the_radar_does() {
    let (cloth, chalk) = (sheet(CLOTH), Lambert { albedo: 0.5 });
    let stage = Stage::new().plate(-0.2, 0.3, Surface::of_sheet(&cloth)).plate(
        0.0,
        0.0,
        Surface::new(&chalk),
    );
    let own = stage.seen(&radar(Returns::All));
    let position = Point::new(0.0, 1.1, 8.0);
    let beside = Observer::Receiver { number: 1, position, aperture_m2: None };
    let other = stage.echoes(&radar(Returns::All), 1, None, beside);
    assert_eq!(own.len(), other.len());
    for (own, other) in own.iter().zip(&other) {
        assert!(own.power_w == 0.0 || db(own.power_w / other.power_w).abs() < 1e-9);
        assert!((own.range_m - other.range_m).abs() < 1e-9);
    }
    // From the other side nothing that the plate returns can be seen.
    let position = Point::new(0.0, 1.1, -8.0);
    let behind = Observer::Receiver { number: 1, position, aperture_m2: None };
    assert!(stage.echoes(&radar(Returns::All), 1, None, behind).iter().all(|e| e.power_w == 0.0));
}

#[test]
fn a_second_surface_behind_cloth_loses_the_same() {
    let (cloth, chalk) = (sheet(CLOTH), Lambert { albedo: 0.8 });
    // A right angle that opens towards the radar, its edge along y. It is small, so that the cloth in front is near: the
    // rays of a spot stand on the wavefront at the first surface.
    let wall = |side: f64| {
        let turn = glam::DMat3::from_rotation_y(-side * 45f64.to_radians());
        move |v: DVec3| turn * (v * 0.06 + side * DVec3::X * 0.03)
    };
    let build = |covered: bool| {
        let mut stage = Stage::new();
        for side in [-1.0, 1.0] {
            stage = stage.with(solids::plate(1.0, 1.0), wall(side), Surface::new(&chalk));
        }
        if covered {
            stage = stage.plate(-0.06, 0.0, Surface::of_sheet(&cloth));
        }
        stage
    };
    let bounce = Bounce { rays: 256, outside_spot: 0.1, in_phase: false };
    let all_w = |covered: bool, bounce| -> f64 {
        let echoes = build(covered).echoes(&radar(Returns::All), 16, bounce, Observer::Radar);
        echoes.iter().map(|echo| echo.power_w).sum()
    };
    let second_w = |covered| all_w(covered, Some(bounce)) - all_w(covered, None);
    assert!(second_w(false) > 0.1 * all_w(false, None));
    let expected_db = db(there_and_back(passed(CLOTH, 1.0).0, 0.0)[0]);
    let found_db = db(second_w(true) / second_w(false));
    assert!((found_db - expected_db).abs() < 0.05, "{found_db} {expected_db}");
}

#[test]
fn a_sheet_that_no_ray_meets_changes_nothing() {
    let (cloth, chalk) = (sheet(CLOTH), Lambert { albedo: 0.5 });
    let ball = || solids::icosphere(0.2, 3);
    let bare = Stage::new().with(ball(), |v| v, Surface::new(&chalk));
    let beside = Stage::new().with(ball(), |v| v, Surface::new(&chalk)).with(
        solids::plate(0.1, 0.1),
        |v| v + 3.0 * DVec3::X,
        Surface::of_sheet(&cloth),
    );
    let wide = Raster { lines: 30, chirps_per_line: 30, width_m: 0.5, height_m: 0.5 };
    let radar = Radar { scan: Pattern::Raster(wide), ..radar(Returns::Strongest) };
    for rays in [1, 16] {
        let [bare, beside] =
            [&bare, &beside].map(|stage| stage.echoes(&radar, rays, None, Observer::Radar));
        // Where a spot meets the ball's edge its far rays are one echo with the near ones.
        assert_eq!(bare, beside, "{rays}");
    }
}

#[test]
fn a_law_with_layers_in_air_is_a_sheet_and_others_are_none() {
    let radar = Radar::default();
    let stack = Layered::sheet(CLOTH.thickness_m, CLOTH.eps);
    let weave = Brdf::Lambert(Lambert { albedo: 0.02 });
    let law = Brdf::Sum(Sum { parts: vec![weave.clone(), Brdf::Layered(stack.clone())] });
    let sheet = Sheet::of_law(&law, &radar).unwrap();
    // Off its lobe it returns what the other part does.
    assert!((sheet.retro_per_sr(0.8) - 0.02 / PI).abs() < 1e-12);
    let whole = Sheet::of_law(&Brdf::Layered(stack.clone()), &radar).unwrap();
    let expected = whole.retro_per_sr(0.0) + 0.02 / PI;
    assert!((sheet.retro_per_sr(0.0) / expected - 1.0).abs() < 1e-12);
    let on_glass = Layered { eps_real: 5.8, ..stack.clone() };
    let empty = Layered { layers: Vec::new(), ..stack };
    for law in [weave, Brdf::Layered(on_glass), Brdf::Layered(empty)] {
        assert!(Sheet::of_law(&law, &radar).is_none(), "{law:?}");
    }
}

#[test]
fn a_batch_refuses_sheets() {
    let cloth = sheet(CLOTH);
    let stage = Stage::new().plate(0.0, 0.0, Surface::of_sheet(&cloth));
    let radar = radar(Returns::Strongest);
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let bvh = Bvh::new(&stage.mesh);
    let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &stage.region_of_facet);
    let target = matdb::frames::Pose::new(glam::DMat3::IDENTITY, DVec3::ZERO);
    let take = Take { target, surfaces: &stage.surfaces, seed: 0, noise_seed: None };
    let refused = Batch { geometry, rays_per_chirp: 1 }.run(&[take]);
    assert_eq!(refused, Err(RenderError::Sheets));
}

/// A plate behind a sheet, 60 chirps; `more` goes into the region of the sheet and `before` to the top.
fn scene(folder: &Path, before: &str, material: &str, more: &str) -> std::path::PathBuf {
    let file = folder.join("scene.toml");
    let text = format!(
        "{before}
[radar.scan]
pattern = \"raster\"
lines = 6
chirps_per_line = 10
[[mesh]]
name = \"body\"
file = \"builtin:plate\"
size_m = [2, 2, 0]
translation_m = [0, 1.1, 0]
[[mesh]]
name = \"cloth\"
file = \"builtin:plate\"
size_m = [2, 2, 0]
translation_m = [0, 1.1, 0.1]
[[region]]
name = \"body\"
material = \"mannequin-paint\"
mesh = \"body\"
[[region]]
name = \"cloth\"
material = \"{material}\"
mesh = \"cloth\"
{more}
"
    );
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn the_cloud_has_every_return_with_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), "[radar]\nreturns = \"all\"", "ptfe", "thickness_m = 0.0005");
    matdb(folder.path()).args(["render", "-q", "-o", "out", "--all"]).arg(&file).assert().success();
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    assert_eq!(cloud["chirp"].len(), 120);
    for (number, sheets) in cloud["sheets"].iter().enumerate() {
        // The nearest echo of a chirp comes first.
        assert_eq!(*sheets, (number % 2) as f64);
        assert_eq!(cloud["region"][number], 1.0 - sheets);
        let longer_m = cloud["range_m"][number] - cloud["true_range_m"][number];
        assert!((0.0..4e-4).contains(&longer_m), "{longer_m}");
    }
    let plain = scene(folder.path(), "", "ptfe", "");
    matdb(folder.path()).args(["render", "-q", "-o", "plain"]).arg(&plain).assert().success();
    let cloud = read_cloud(&folder.path().join("plain/cloud.ply"));
    assert!(!cloud.contains_key("sheets") && !cloud.contains_key("rank"));
}

/// A garment of a name of its own whose permittivity is not known.
fn add_rag(folder: &Path) {
    let text =
        std::fs::read_to_string(support::root().join("materials/garment/material.toml")).unwrap();
    let (before, rest) = text.split_once("[[permittivity]]").unwrap();
    let after = rest.split_once("[[fit]]").unwrap().1;
    let text = format!("{before}[[fit]]{after}").replace("\"garment\"", "\"rag\"");
    std::fs::write(folder.join("rag.toml"), text).unwrap();
    matdb(folder).args(["add", "--from", "rag.toml"]).assert().success();
}

/// A film of a name of its own with a key of its layer replaced; what `add` says of it.
fn add_film(folder: &Path, from: &str, to: &str) -> std::process::Output {
    let text = std::fs::read_to_string(support::root().join("materials/kapton/material.toml"));
    let text = text.unwrap().replace("\"kapton\"\nname", "\"film\"\nname").replace(from, to);
    std::fs::write(folder.join("film.toml"), text).unwrap();
    matdb(folder).args(["add", "--from", "film.toml"]).output().unwrap()
}

#[test]
fn what_cannot_transmit_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    add_rag(folder.path());
    let gain = add_film(folder.path(), "eps_imag = 0.02181", "eps_imag = -0.02");
    let gain = String::from_utf8(gain.stderr).unwrap();
    assert!(gain.contains("layers.0.eps_imag = -0.02 is out of range"), "{gain}");
    assert!(add_film(folder.path(), "thickness_m = 125e-6", "thickness_m = 0").status.success());
    for (before, material, more, expected) in [
        ("", "film", "transmits = true", "layers in air with a thickness above 0"),
        ("", "ptfe", "thickness_m = -0.001", "has thickness_m = -0.001"),
        ("", "ptfe", "thickness_m = 0", "has thickness_m = 0"),
        ("", "ptfe", "thickness_m = 0.3", "at most 0.1"),
        ("", "ptfe", "thickness_m = nan", "thickness_m = NaN"),
        ("", "ptfe", "transmits = true", "is not rendered by layers in air"),
        ("", "kapton", "thickness_m = 0.001", "write transmits = true"),
        ("", "kapton", "thickness_m = 0.001\ntransmits = true", "both thickness_m and transmits"),
        ("", "rag", "thickness_m = 0.001", "has no permittivity"),
        (
            "[transmission]\nsheets = 0",
            "kapton",
            "transmits = true",
            "transmission.sheets: 0 sheets",
        ),
        ("[transmission]\nsheets = 17", "kapton", "transmits = true", "give 1 to 16"),
        ("[radar]\nreturns = \"last\"", "kapton", "transmits = true", "last"),
        (
            "[[effect]]\nname = \"pose\"\ntranslation_x_m = 0.01",
            "kapton",
            "transmits = true",
            "effect `pose` follows rays to the first surface",
        ),
    ] {
        let file = scene(folder.path(), before, material, more);
        let text = refused(matdb(folder.path()).args(["render", "-o", "out"]).arg(&file));
        assert!(text.contains(expected), "{more}: {text}");
        assert!(!folder.path().join("out").exists(), "{text}");
    }
    // A measurement knows one surface.
    let file = scene(folder.path(), "", "kapton", "transmits = true");
    matdb(folder.path()).args(["render", "-q", "-o", "out"]).arg(&file).assert().success();
    let cloud = folder.path().join("out/cloud.ply");
    let mut run = matdb(folder.path());
    let text =
        refused(run.arg("measure").arg(&cloud).arg("--scene").arg(&file).args(["-o", "why"]));
    assert!(text.contains("transmits"), "{text}");
}

#[test]
fn a_sheet_with_gain_is_named_with_its_incidence_and_excess() {
    let folder = tempfile::tempdir().unwrap();
    let chalk = |albedo: f64| {
        format!(
            r#"
slug = "chalk"
name = "Chalk for tests"
class = "mineral"
licence = "CC0-1.0"
frequency_ghz = [200, 400]
theta_deg = [0, 90]
render = "law"
[[source]]
key = "here"
kind = "synthetic"
title = "Made for tests"
[[permittivity]]
key = "chalk"
source = "here"
frequency_ghz = 300
real = 1.1
imaginary = 0
[[fit]]
name = "law"
estimator = "assumed"
source = "here"
scattering = {{ model = "lambert", albedo = {albedo} }}
"#
        )
    };
    let file = scene(folder.path(), "", "chalk", "thickness_m = 0.0005");
    for (albedo, is_named) in [(1.0, true), (0.1, true), (0.004, false)] {
        std::fs::write(folder.path().join("chalk.toml"), chalk(albedo)).unwrap();
        matdb(folder.path()).args(["add", "-q", "--from", "chalk.toml"]).assert().success();
        let output =
            matdb(folder.path()).args(["render", "-o", "out"]).arg(&file).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        let words = "the sheet of region `cloth`, the law of `chalk` with what its permittivity lets through, returns";
        assert_eq!(said.matches(words).count(), usize::from(is_named), "{albedo}: {said}");
        if albedo == 1.0 {
            assert!(said.contains("returns 100 % of what it receives"), "{said}");
            assert!(said.contains("% too much; nothing is cut off"), "{said}");
        }
    }
}

#[test]
fn a_ray_ends_at_the_sheet_after_the_last_that_it_may_pass() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), "[transmission]\nsheets = 1\n", "kapton", "transmits = true");
    let text = std::fs::read_to_string(&file).unwrap();
    let second = "[[mesh]]\nname = \"lining\"\nfile = \"builtin:plate\"\nsize_m = [2, 2, 0]\ntranslation_m = [0, 1.1, 0.05]\n\
                  [[region]]\nname = \"lining\"\nmaterial = \"kapton\"\nmesh = \"lining\"\ntransmits = true\n";
    std::fs::write(&file, format!("{text}{second}")).unwrap();
    let run = |sheets: &str| {
        let text = std::fs::read_to_string(&file).unwrap().replace("sheets = 1\n", sheets);
        std::fs::write(&file, text).unwrap();
        let mut command = matdb(folder.path());
        let output = command.args(["render", "-o", "out", "--all"]).arg(&file).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let ended = run("sheets = 1\n");
    assert!(ended.contains("60 rays end at a sheet"), "{ended}");
    assert!(!run("sheets = 2\n").contains("end at a sheet"));
}

#[test]
fn what_the_scene_conceals_lies_under_its_shirt_and_outshines_it() {
    let folder = tempfile::tempdir().unwrap();
    let scene = support::root().join("scenes/concealed-object.toml");
    let output =
        matdb(folder.path()).args(["render", "-o", "out", "--all"]).arg(&scene).output().unwrap();
    let summary = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !summary.contains("rays end"), "{summary}");
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    let [skin, ceramic, metal, shirt] = [0.0, 1.0, 2.0, 3.0];
    let column = |name: &str, point: usize| cloud[name][point];
    for object in [ceramic, metal] {
        let of_object = |point: &usize| column("region", *point) == object;
        let points: Vec<usize> = (0..cloud["chirp"].len()).filter(of_object).collect();
        assert!(points.len() > 250, "{}", points.len());
        let mut strongest = 0;
        for &point in &points {
            // Under one layer of the shirt: −2.03 dB at the angles of a belly.
            assert_eq!(column("sheets", point), 1.0);
            assert!((column("passed_db", point) + 2.05).abs() < 0.1);
            strongest += usize::from(column("rank", point) == 1.0);
            let chirp = column("chirp", point);
            let front = (0..point).rev().take_while(|&other| column("chirp", other) == chirp);
            for front in front.filter(|&front| column("region", front) == shirt) {
                let gap_m = column("true_range_m", point) - column("true_range_m", front);
                assert!((0.005..0.05).contains(&gap_m), "{gap_m}");
            }
        }
        assert!(strongest * 10 > points.len() * 9, "{strongest} of {}", points.len());
    }
    // The body and the far side of the shirt are returns of their own, with their own truth.
    let covered = |region: f64| {
        let all = (0..cloud["chirp"].len()).filter(|&point| column("region", point) == region);
        all.filter(|&point| column("sheets", point) > 0.0).count()
    };
    assert!(covered(skin) > 5000 && covered(shirt) > 1000);
}

#[test]
fn the_skin_of_the_person_is_seen_through_the_shirt() {
    let folder = tempfile::tempdir().unwrap();
    let scene = support::root().join("scenes/human.toml");
    matdb(folder.path()).args(["render", "-q", "-o", "out"]).arg(&scene).assert().success();
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    let points = || std::iter::zip(&cloud["region"], &cloud["sheets"]);
    let seen = |region: f64, sheets: f64| points().filter(|&of| of == (&region, &sheets)).count();
    let (skin, buckle) = (0.0, 2.0);
    assert!(seen(skin, 1.0) > 2000, "{}", seen(skin, 1.0));
    // Nothing passes the buckle, which is a part of the shirt.
    assert!(seen(buckle, 0.0) > 40 && seen(buckle, 1.0) == 0);
}
