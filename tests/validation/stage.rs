//! Scenes that the compiled program renders: a target, rays of the radar's beam at it, and the power of their echoes.

use std::fmt::Write;

use glam::DVec3;
use tempfile::TempDir;

use crate::support::{matdb, read_cloud};

/// Range of the focus, m.
pub const FOCUS_M: f64 = 8.0;

/// The middle of the field of view, where targets stand.
const CENTRE: DVec3 = DVec3::new(0.0, 1.1, 0.0);

/// Sent through a radar without loss, W.
pub const SENT_DBM: f64 = 30.0;

/// A smooth metal without loss.
pub const MIRROR: &str = r#"{"model":"fresnel","eps_real":1,"eps_imag":1e9}"#;

/// Where the beam's axis meets the target, and how.
#[derive(Clone, Copy, Default)]
pub struct Aim {
    /// From the middle of the target, which faces +z, m.
    pub at: DVec3,
    /// How far behind the focus that lies, m.
    pub z_m: f64,
    /// Turn of the beam about the vertical, rad.
    pub yaw_rad: f64,
    /// Its elevation, rad.
    pub pitch_rad: f64,
}

impl Aim {
    /// At the middle of a target that faces the radar.
    pub fn facing(z_m: f64) -> Aim {
        Aim { z_m, ..Aim::default() }
    }

    /// The chirp's ray in a CSV file.
    fn line(&self, chirp: usize) -> String {
        let (sin, cos) = self.yaw_rad.sin_cos();
        let level = self.pitch_rad.cos();
        let back = DVec3::new(sin * level, self.pitch_rad.sin(), cos * level);
        let from = CENTRE + self.at + (FOCUS_M + self.z_m) * back;
        let [x, y, z] = from.to_array();
        let [dx, dy, dz] = (-back).to_array();
        format!("{chirp},{x},{y},{z},{dx},{dy},{dz}\n")
    }
}

/// What the program reports of an echo.
#[derive(Clone, Copy)]
pub struct Echo {
    /// Received over sent.
    pub ratio: f64,
    /// Apparent range, m.
    pub range_m: f64,
}

impl Echo {
    /// Received over sent, dB.
    pub fn db(&self) -> f64 {
        10.0 * self.ratio.log10()
    }
}

/// Keys of a scene besides its meshes and regions.
#[derive(Clone, Copy, Default)]
pub struct Keys<'a> {
    /// At the start.
    pub top: &'a str,
    /// Rays of a spot.
    pub rays: usize,
    /// Below `[radar]`.
    pub radar: &'a str,
    /// At the end.
    pub more: &'a str,
}

/// A folder with materials and meshes of its own.
pub struct Stage {
    folder: TempDir,
}

impl Stage {
    /// With the materials that are given as name and law (JSON).
    pub fn with(materials: &[(&str, &str)]) -> Stage {
        let folder = tempfile::tempdir().unwrap();
        for (name, law) in materials {
            let of_its_own = folder.path().join("materials").join(name);
            std::fs::create_dir_all(&of_its_own).unwrap();
            std::fs::write(of_its_own.join("material.toml"), Stage::material(name, law)).unwrap();
        }
        if !materials.is_empty() {
            let mut add = matdb(folder.path());
            add.args(["add", "-q", "--from", "materials"]).assert().success();
        }
        Stage { folder }
    }

    fn material(name: &str, law: &str) -> String {
        let json: serde_json::Value = serde_json::from_str(law).unwrap();
        let law = toml::Value::try_from(json).unwrap();
        format!(
            "slug = \"{name}\"\nname = \"{name}\"\nclass = \"test\"\ndescription = \"For a test.\"\n\
             licence = \"CC0-1.0\"\ntags = [\"test\"]\nfrequency_ghz = [290, 310]\ntheta_deg = [0, 85]\n\
             render = \"stated\"\n[[source]]\nkey = \"chosen\"\nkind = \"synthetic\"\ntitle = \"Chosen\"\n\
             licence = \"CC0-1.0\"\n[[fit]]\nname = \"stated\"\nestimator = \"stated\"\nsource = \"chosen\"\nlobes = \"surface\"\n\
             scattering = {law}\n"
        )
    }

    /// Writes a mesh that has the depth (m, away from the radar) over the points of a grid, without the cells where that is
    /// not a number; the name of its file.
    pub fn relief(
        &self,
        name: &str,
        xs: &[f64],
        ys: &[f64],
        depth_m: impl Fn(f64, f64) -> f64,
    ) -> String {
        let mut vertices = String::new();
        let mut depths = Vec::new();
        for y in ys {
            for x in xs {
                let depth = depth_m(*x, *y);
                depths.push(depth);
                writeln!(vertices, "{x} {y} {}", if depth.is_nan() { 0.0 } else { -depth })
                    .unwrap();
            }
        }
        let (mut faces, mut count) = (String::new(), 0);
        for row in 1..ys.len() {
            for column in 1..xs.len() {
                let d = row * xs.len() + column;
                let [a, b, c] = [d - xs.len() - 1, d - xs.len(), d - 1];
                if [a, b, c, d].iter().all(|corner| !depths[*corner].is_nan()) {
                    count += 2;
                    writeln!(faces, "3 {a} {b} {d}\n3 {a} {d} {c}").unwrap();
                }
            }
        }
        let head = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {count}\nproperty list uchar int vertex_indices\nend_header\n",
            depths.len()
        );
        let file = format!("{name}.ply");
        std::fs::write(self.folder.path().join(&file), head + &vertices + &faces).unwrap();
        file
    }

    /// Renders parts with rays of their own; the echoes of every chirp in order of range.
    pub fn render(&self, parts: &str, aims: &[Aim], keys: Keys) -> Vec<Vec<Echo>> {
        let lines: String = aims.iter().enumerate().map(|(chirp, aim)| aim.line(chirp)).collect();
        let csv = format!("chirp,ox_m,oy_m,oz_m,dx,dy,dz\n{lines}");
        std::fs::write(self.folder.path().join("rays.csv"), csv).unwrap();
        let scan = "pattern = \"rays\"\nfile = \"rays.csv\"";
        self.render_by(scan, parts, keys, aims.len())
    }

    /// The same with any pattern.
    pub fn render_by(&self, scan: &str, parts: &str, keys: Keys, chirps: usize) -> Vec<Vec<Echo>> {
        self.run(scan, parts, keys);
        self.cloud("out/cloud.ply", chirps)
    }

    fn run(&self, scan: &str, parts: &str, Keys { top, rays, radar, more }: Keys) {
        let text = format!(
            "{top}\n[radar]\ntransmit_power_dbm = {SENT_DBM}\nsystem_loss_db = 0\nthreshold_dbm = -300\n\
             footprint = \"projected\"\nbeam.edge_growth = 1\n{radar}\n[radar.scan]\n{scan}\n[spot]\nrays = {rays}\n\
             {more}\n{parts}"
        );
        std::fs::write(self.folder.path().join("scene.toml"), text).unwrap();
        let mut render = matdb(self.folder.path());
        render.args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
    }

    /// What the last run says of models that are used outside of their derivation, but for facets: meshes are coarse far
    /// from their glints.
    pub fn validity(&self) -> usize {
        let text = std::fs::read_to_string(self.folder.path().join("out/scan.json")).unwrap();
        let record: serde_json::Value = serde_json::from_str(&text).unwrap();
        let limits = record["validity"].as_array().map_or(&[][..], Vec::as_slice);
        limits.iter().filter(|limit| limit["model"] != "a mesh of facets").count()
    }

    /// A column of the last run's cloud.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let mut cloud = read_cloud(&self.folder.path().join("out/cloud.ply"));
        cloud.remove(name).unwrap_or_else(|| panic!("the cloud has no {name}"))
    }

    /// What a cloud of the last run holds, by chirp.
    pub fn cloud(&self, name: &str, chirps: usize) -> Vec<Vec<Echo>> {
        let mut found = vec![Vec::new(); chirps];
        let cloud = read_cloud(&self.folder.path().join(name));
        for (number, chirp) in cloud["chirp"].iter().enumerate() {
            let ratio = 10f64.powf(0.1 * (cloud["power_dbm"][number] - SENT_DBM));
            found[*chirp as usize].push(Echo { ratio, range_m: cloud["range_m"][number] });
        }
        found
    }

    /// The strongest echo of every chirp over what was sent, dB.
    pub fn levels_db(&self, parts: &str, aims: &[Aim], keys: Keys) -> Vec<f64> {
        let strongest =
            |echoes: &Vec<Echo>| echoes.iter().map(Echo::db).fold(f64::NEG_INFINITY, f64::max);
        self.render(parts, aims, keys).iter().map(strongest).collect()
    }
}

/// A mesh in the middle of the field of view, and its material.
pub fn part(file: &str, mesh: &str, material: &str, region: &str) -> String {
    part_at("target", file, DVec3::ZERO, mesh, material, region)
}

/// The same of any name and place.
pub fn part_at(
    name: &str,
    file: &str,
    place: DVec3,
    mesh: &str,
    material: &str,
    region: &str,
) -> String {
    let [x, y, z] = (CENTRE + place).to_array();
    format!(
        "[[mesh]]\nname = \"{name}\"\nfile = \"{file}\"\ntranslation_m = [{x}, {y}, {z}]\n{mesh}\n\
         [[region]]\nname = \"{name}\"\nmesh = \"{name}\"\nmaterial = \"{material}\"\n{region}\n"
    )
}

/// A large plate of a material that faces the radar.
pub fn plate(material: &str) -> String {
    part("builtin:plate", "size_m = [2, 2, 0]", material, "")
}

/// Places from −`reach_m` to `reach_m`: steps of `fine_m` up to `within_m`, then of `coarse_m`.
pub fn graded(reach_m: f64, fine_m: f64, within_m: f64, coarse_m: f64) -> Vec<f64> {
    let mut half = Vec::new();
    let mut at = 0.5 * fine_m;
    while at < reach_m {
        half.push(at);
        at += if at < within_m { fine_m } else { coarse_m };
    }
    half.iter().rev().map(|x| -x).chain(half.iter().copied()).collect()
}
