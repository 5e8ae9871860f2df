//! Promise: a specular path keeps the polarisation that its facets give it, what is depolarised adds across it, and
//! without a word on polarisation nothing changes.

use crate::support;
use glam::DVec3;
use matdb::brdf::{KirchhoffGo, Lambert, Scattering};
use matdb::formats::ply;
use matdb::geometry::Mesh;
use matdb::radar::polarisation::Linear;
use matdb::radar::scan::Raster;
use matdb::radar::{Channel, Chirps, Pattern, Polarisation, Radar};
use matdb::render::{Bounce, Observer, Setup, Surface, shade, trace};
use matdb::trace::{Bvh, ScanGeometry};

/// Glass at 300 GHz with a narrow lobe.
const GLASS: KirchhoffGo = KirchhoffGo { rms_slope: 0.03, eps_real: 5.8, eps_imag: 0.0 };
const METAL: KirchhoffGo = KirchhoffGo { eps_imag: 1e9, ..GLASS };

/// Two plates at right angles whose upright edge lies away from the radar.
fn corner() -> Mesh {
    let (left, right) = (DVec3::new(-1.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 1.0));
    let (down, up) = (DVec3::new(0.0, 0.6, 0.0), DVec3::new(0.0, 1.6, 0.0));
    let vertices = vec![down, up, left + down, left + up, right + down, right + up];
    let facets = vec![[0, 1, 2], [2, 1, 3], [0, 4, 1], [4, 5, 1]];
    Mesh { vertices, facets, labels: vec![] }
}

/// Power, W, that a channel receives from a corner, for a chirp along the axis of the field of view, and the number of
/// surfaces of its strongest path.
fn received(law: &dyn Scattering, polarisation: Polarisation, channel: Channel) -> (f64, u8) {
    let scan = Raster { lines: 1, chirps_per_line: 1, width_m: 1e-6, height_m: 1e-6 };
    let radar = Radar {
        polarisation,
        scan: Pattern::Raster(scan),
        threshold_dbm: -300.0,
        ..Radar::default()
    };
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let mesh = corner();
    let (bvh, regions) = (Bvh::new(&mesh), vec![0; mesh.facets.len()]);
    let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &regions);
    let footprints = trace(&geometry, 64, &|_| {}).unwrap();
    let surfaces = [Surface::new(law)];
    let bounce = Some(Bounce { rays: 4000, outside_spot: 1e-2, in_phase: false });
    let setup = Setup { bounce, channel, ..Setup::new(geometry, &surfaces) };
    let scan = shade(&setup, &footprints, Observer::Radar, &|_| {}).unwrap();
    let [echo] = &scan.echoes[..] else { panic!("one chirp has one echo: {:?}", scan.echoes) };
    (echo.power_w, echo.truth.unwrap().surfaces)
}

/// The power, W, of a corner that is too narrow a mirror to return anything by one surface alone.
fn second_order_w(law: &dyn Scattering, polarisation: Polarisation, channel: Channel) -> f64 {
    let (power_w, surfaces) = received(law, polarisation, channel);
    assert_eq!(surfaces, 2);
    power_w
}

fn antenna(transmit: Linear, turn_deg: f64) -> Polarisation {
    Polarisation { transmit, turn_deg, ..Polarisation::default() }
}

#[test]
fn a_corner_of_glass_returns_what_fresnel_gives_each_polarisation() {
    // By hand at 45°: cos θ_t = √(1 − ½/5.8), n = √5.8.
    let (cos, n) = (0.5f64.sqrt(), 5.8f64.sqrt());
    let inside = (1.0 - 0.5 / 5.8f64).sqrt();
    let r_s = ((cos - n * inside) / (cos + n * inside)).powi(2);
    let r_p = ((inside - n * cos) / (inside + n * cos)).powi(2);
    let [vertical, horizontal] = [Linear::Vertical, Linear::Horizontal]
        .map(|transmit| second_order_w(&GLASS, antenna(transmit, 0.0), Channel::CoPolar));
    let found_db = 10.0 * (vertical / horizontal).log10();
    let expected_db = 20.0 * (r_s / r_p).log10();
    // The two reflections happen at 45° within the width of the lobe; r_p changes fast there.
    assert!((found_db - expected_db).abs() < 0.5, "{found_db} dB is not {expected_db} dB");
    // Along the edge the unpolarised mean of both would be 3 to 5 dB too low.
    let mean_db = 20.0 * (r_s / (0.5 * (r_s + r_p))).log10();
    assert!((3.0..5.0).contains(&mean_db), "{mean_db}");
}

#[test]
fn a_corner_of_metal_turned_by_45_degrees_crosses_the_field() {
    let total = second_order_w(&METAL, antenna(Linear::Vertical, 0.0), Channel::CoPolar);
    let turned = antenna(Linear::Vertical, 45.0);
    let [co, cross] = [Channel::CoPolar, Channel::CrossPolar]
        .map(|channel| second_order_w(&METAL, turned, channel));
    assert!((cross / total - 1.0).abs() < 0.02, "{}", cross / total);
    assert!(co / total < 0.01, "{}", co / total);
}

#[test]
fn a_channel_and_its_turn_by_90_degrees_see_the_same_of_a_law_without_facets() {
    let law = Lambert { albedo: 0.5 };
    let upright = received(&law, antenna(Linear::Vertical, 0.0), Channel::CoPolar);
    let turned = received(&law, antenna(Linear::Horizontal, 20.0), Channel::CoPolar);
    assert_eq!(upright, turned);
    let crossed = received(&law, antenna(Linear::Vertical, 0.0), Channel::CrossPolar);
    assert_eq!(crossed.0, 0.0);
}

/// Powers, dBm, of the points of a cloud by chirp.
fn powers_dbm(file: &std::path::Path) -> Vec<(u32, f64)> {
    let table = ply::read_table(&std::fs::read(file).unwrap()).unwrap();
    let values = |name: &str| {
        table.columns.iter().find(|column| column.name == name).unwrap().values.clone()
    };
    std::iter::zip(values("chirp"), values("power_dbm")).map(|(c, p)| (c as u32, p)).collect()
}

/// A plate of a diffuse built-in material.
fn scene(radar: &str, region: &str) -> String {
    format!(
        "name = \"plate\"\n[radar]\nthreshold_dbm = -200\n{radar}\n[radar.scan]\npattern = \"raster\"\nlines = 5\n\
         chirps_per_line = 5\n[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\nsize_m = [1, 1, 0]\n\
         translation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\nmaterial = \"human-skin\"\n{region}\n"
    )
}

#[test]
fn the_cross_polar_cloud_is_written_when_asked_for_with_the_depolarised_share() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let render = |text: &str, out: &str| {
        std::fs::write(&path, text).unwrap();
        support::matdb(folder.path()).args(["render", "scene.toml", "-o", out]).assert()
    };
    render(&scene("", ""), "co").success();
    assert!(!folder.path().join("co/cross-cloud.ply").exists());
    let both = "polarisation.receive = \"both\"";
    let rendered = render(&scene(both, "depolarised_share = 0.2"), "both").success();
    let summary = String::from_utf8(rendered.get_output().stdout.clone()).unwrap();
    assert!(
        summary.contains("cross-polar: ") && summary.contains("start with cross-"),
        "{summary}"
    );
    let co = powers_dbm(&folder.path().join("co/cloud.ply"));
    assert_eq!(co, powers_dbm(&folder.path().join("both/cloud.ply")));
    let crossed = powers_dbm(&folder.path().join("both/cross-cloud.ply"));
    assert_eq!(crossed.len(), co.len());
    // Off the normal the lobe is over, and the diffuse part is all: 0.2/0.8 of it is crossed.
    for ((_, co), (_, cross)) in co.iter().zip(&crossed) {
        assert!(cross - co < 10.0 * 0.25f64.log10() + 1e-4, "{cross} {co}");
    }
    for name in ["cross-power.exr", "cross-power.png"] {
        assert!(folder.path().join("both").join(name).exists(), "{name}");
    }
    let record = std::fs::read_to_string(folder.path().join("both/scan.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    assert_eq!(record["cross_polar"][0]["detections"], crossed.len());
}

#[test]
fn what_is_no_polarisation_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    for (radar, region, expected) in [
        ("polarisation.transmit = \"circular\"", "", "circular"),
        ("polarisation.receive = \"cross\"", "", "cross"),
        ("polarisation.turn_deg = 200", "", "polarisation.turn_deg"),
        ("", "depolarised_share = 0.7", "depolarised_share = 0.7"),
        ("", "depolarised_share = -0.1", "depolarised_share = -0.1"),
        ("", "depolarised_share = nan", "depolarised_share = NaN"),
    ] {
        std::fs::write(&path, scene(radar, region)).unwrap();
        let refused =
            support::matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert();
        let output = refused.failure().get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(expected), "{radar}{region}: {message}");
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn a_curve_measured_across_the_polarisation_that_was_sent_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../src/setup/material-template.toml");
    std::fs::write(folder.path().join("scan.csv"), "theta_deg,sigma0_db\n0,5\n20,-10\n").unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene("", "").replace("human-skin", "my-paint")).unwrap();
    for (received, is_named) in [("V", false), ("H", true)] {
        let stated = format!("\nreceive_polarisation = \"{received}\"");
        let text = text.replace("\nreceive_polarisation = \"V\"", &stated);
        std::fs::write(folder.path().join("material.toml"), text).unwrap();
        let add = ["add", "--from", "material.toml"];
        support::matdb(folder.path()).args(add).assert().success();
        let run =
            support::matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert();
        let said = String::from_utf8(run.success().get_output().stderr.clone()).unwrap();
        let notice = "curve `scan` of `my-paint` was measured across the polarisation";
        assert_eq!(said.contains(notice), is_named, "{said}");
    }
}
