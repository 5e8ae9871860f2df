//! The four geometries, as scene files and meshes.

use std::f64::consts::TAU;
use std::fmt::Write;

use glam::DVec3;
use matdb::radar::random::Draws;

/// What stands in front of the radar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    Mannequin,
    SphereAndPlate,
    TorsoAndArm,
    WavyPanel,
}

impl Geometry {
    pub const ALL: [Geometry; 4] =
        [Geometry::Mannequin, Geometry::SphereAndPlate, Geometry::TorsoAndArm, Geometry::WavyPanel];
}

/// What the data is declared to be.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Declared {
    pub geometry: Geometry,
    pub chirps: usize,
    pub explicit_rays: bool,
    pub looks: u32,
    pub level_dbm: f64,
    pub range_sd_m: f64,
}

impl Declared {
    pub fn draw(geometry: Geometry, chirps: usize, random: &mut Draws) -> Declared {
        Declared {
            geometry,
            chirps,
            explicit_rays: random.uniform() < 0.25,
            looks: 4 + (5.0 * random.uniform()) as u32,
            level_dbm: (-100.0 + 8.0 * random.uniform()).round(),
            range_sd_m: 0.0005 + 0.001 * (10.0 * random.uniform()).round() / 10.0,
        }
    }
}

/// Name and content of every file that a scene needs, except its material.
pub fn files(declared: &Declared, random: &mut Draws) -> Vec<(&'static str, String)> {
    let (meshes, mut files) = geometry(declared.geometry, random);
    let scan = if declared.explicit_rays {
        files.push(("rays.csv", rays(declared.chirps, random)));
        "pattern = \"rays\"\nfile = \"rays.csv\"".to_owned()
    } else {
        format!("pattern = \"elliptical\"\nchirps = {}", declared.chirps)
    };
    let Declared { looks, level_dbm, range_sd_m, .. } = declared;
    let scene = format!(
        "name = \"Twin\"\nseed = 1\n\n[radar]\npreset = \"upm-300ghz\"\nthreshold_dbm = -77.0\n\n\
         [radar.speckle]\nlooks = {looks}\n\n\
         [radar.noise]\nlevel_dbm = {level_dbm}\nrange_sd_m = {range_sd_m}\n\n\
         [radar.scan]\n{scan}\n\n{meshes}\
         [[region]]\nname = \"surface\"\nmaterial = \"twin-surface\"\n"
    );
    files.push(("scene.toml", scene));
    files
}

fn entry(name: &str, file: &str, size: Option<DVec3>, turn_deg: DVec3, shift_m: DVec3) -> String {
    let size = size.map_or(String::new(), |size| format!("size_m = {:?}\n", size.to_array()));
    format!(
        "[[mesh]]\nname = \"{name}\"\nfile = \"{file}\"\n{size}rotation_deg = {:?}\n\
         translation_m = {:?}\n\n",
        turn_deg.to_array(),
        shift_m.to_array()
    )
}

/// The `[[mesh]]` tables and the mesh files.
fn geometry(geometry: Geometry, random: &mut Draws) -> (String, Vec<(&'static str, String)>) {
    let mut within = |half: f64| half * (2.0 * random.uniform() - 1.0);
    match geometry {
        Geometry::Mannequin => {
            let turn = DVec3::new(0.0, within(20.0), 0.0);
            (entry("body", "builtin:mannequin", None, turn, DVec3::ZERO), vec![])
        }
        Geometry::SphereAndPlate => {
            let sphere = Some(DVec3::splat(0.42 + within(0.03)));
            let at = DVec3::new(within(0.02), 1.31, 0.0);
            let plate = Some(DVec3::new(0.42, 0.36, 0.01));
            let turn = DVec3::new(-15.0 + within(10.0), 10.0 + within(10.0), 0.0);
            let tables = entry("sphere", "builtin:sphere", sphere, DVec3::ZERO, at)
                + &entry("plate", "builtin:cuboid", plate, turn, DVec3::new(0.0, 0.87, 0.0));
            (tables, vec![])
        }
        Geometry::TorsoAndArm => {
            let turn = DVec3::new(0.0, within(15.0), 0.0);
            let tables = entry("torso", "torso.ply", None, turn, DVec3::new(0.0, 1.1, 0.0))
                + &entry("arm", "arm.ply", None, DVec3::new(0.0, 0.0, 90.0 + within(35.0)), {
                    DVec3::new(within(0.04), 1.1 + within(0.15), 0.19 + within(0.02))
                });
            // The torso narrows at the waist.
            let torso = tube([0.19, 0.12], 1.0, |y| 1.0 - 0.2 * (3.0 * y).cos().powi(2));
            let arm = tube([0.045, 0.045], 0.44, |y| 1.0 - 0.3 * (y / 0.22).powi(2));
            (tables, vec![("torso.ply", torso), ("arm.ply", arm)])
        }
        Geometry::WavyPanel => {
            let depth = [0.022 + within(0.003), 0.018 + within(0.003)];
            let length = [0.13 + within(0.02), 0.19 + within(0.03)];
            let shift = [within(0.1), within(0.1)];
            let at = DVec3::new(0.0, 1.1, 0.0);
            let tables = entry("panel", "panel.ply", None, DVec3::ZERO, at);
            (tables, vec![("panel.ply", panel(depth, length, shift))])
        }
    }
}

/// A closed-looking tube about y: half axes (x, z), height, and its width over y.
fn tube([a, b]: [f64; 2], height_m: f64, width: impl Fn(f64) -> f64) -> String {
    let (around, up) = (120, 90);
    let point = |j: usize, i: usize| {
        let (turn, y) = (i as f64 / around as f64 * TAU, (j as f64 / up as f64 - 0.5) * height_m);
        DVec3::new(a * width(y) * turn.sin(), y, b * width(y) * turn.cos())
    };
    let vertices = (0..=up).flat_map(|j| (0..around).map(move |i| (j, i)));
    let vertices: Vec<DVec3> = vertices.map(|(j, i)| point(j, i)).collect();
    let quad = |j: usize, i: usize| {
        let at = |j: usize, i: usize| j * around + i % around;
        [at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)]
    };
    let facets: Vec<[usize; 4]> =
        (0..up).flat_map(|j| (0..around).map(move |i| quad(j, i))).collect();
    ply(&vertices, &facets)
}

/// A panel that waves in both directions.
fn panel(depth: [f64; 2], length: [f64; 2], shift: [f64; 2]) -> String {
    let (columns, rows) = (100, 160);
    let point = |j: usize, i: usize| {
        let (x, y) = (0.6 * (i as f64 / columns as f64 - 0.5), j as f64 / rows as f64 - 0.5);
        let wave = |n: usize, at: f64| depth[n] * (TAU * (at + shift[n]) / length[n]).sin();
        DVec3::new(x, y, wave(0, x) + wave(1, y + 0.3 * x))
    };
    let vertices = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (j, i)));
    let vertices: Vec<DVec3> = vertices.map(|(j, i)| point(j, i)).collect();
    let at = |j: usize, i: usize| j * (columns + 1) + i;
    let quad = |j: usize, i: usize| [at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)];
    let facets: Vec<[usize; 4]> =
        (0..rows).flat_map(|j| (0..columns).map(move |i| quad(j, i))).collect();
    ply(&vertices, &facets)
}

fn ply(vertices: &[DVec3], quads: &[[usize; 4]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        2 * quads.len()
    );
    for v in vertices {
        let _ = writeln!(text, "{:.6} {:.6} {:.6}", v.x, v.y, v.z);
    }
    for [a, b, c, d] in quads {
        let _ = writeln!(text, "3 {a} {b} {c}\n3 {a} {c} {d}");
    }
    text
}

/// A raster to and fro with a little jitter and a pause at the end of each line.
fn rays(chirps: usize, random: &mut Draws) -> String {
    let (width_m, height_m, origin) = (0.5, 0.9, DVec3::new(0.0, 1.1, 8.0));
    let lines = ((chirps as f64 * height_m / width_m).sqrt().round() as usize).max(2);
    let per_line = chirps.div_ceil(lines).max(2);
    let mut text = "chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n".to_owned();
    for chirp in 0..chirps {
        let (line, step) = (chirp / per_line, chirp % per_line);
        let step = if line % 2 == 0 { step } else { per_line - 1 - step };
        let jitter = [(); 2].map(|()| 0.3 * (random.uniform() - 0.5));
        let x = width_m * ((step as f64 + jitter[0]) / (per_line - 1) as f64 - 0.5);
        let y = height_m * ((line as f64 + jitter[1]) / (lines - 1) as f64 - 0.5);
        let d = (DVec3::new(x, 1.1 + y, 0.0) - origin).normalize();
        let time_s = 2e-4 * chirp as f64 + 5e-3 * line as f64;
        let [ox, oy, oz] = origin.to_array();
        let _ = writeln!(text, "{chirp},{time_s:.6},{ox},{oy},{oz},{},{},{}", d.x, d.y, d.z);
    }
    text
}
