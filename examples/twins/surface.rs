//! Effects of what the surface is made of.

use glam::DVec3;
use matdb::radar::random::Draws;
use num_complex::Complex;
use serde_json::{Value, json};

use super::base::{Base, Local};
use super::physics::{Effect, ratio};
use super::scan::{Shot, World};

/// A volume below: a σ⁰ that does not depend on θ.
pub struct Subsurface;

impl Effect for Subsurface {
    fn name(&self) -> &'static str {
        "subsurface"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-7, 0.3]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "sigma0_db": 10.0 * size.log10(), "form": "constant sigma0, f = sigma0/(4 pi cos^2)" })
    }
    fn surface(&self, size: f64, _: &Shot, law: &mut Local) {
        law.sigma0_volume += size;
    }
}

/// A lossy layer over the part of the target on one side of a plane.
pub struct CoveringLayer {
    axis: DVec3,
    at_m: f64,
}

impl CoveringLayer {
    /// Covers a quarter to three quarters of what is met, above or below a height or beside a plane.
    pub fn new(random: &mut Draws, world: &World) -> CoveringLayer {
        let sides = [DVec3::Y, -DVec3::Y, DVec3::X, -DVec3::X];
        let axis = sides[(4.0 * random.uniform()) as usize % 4];
        let mut along: Vec<f64> =
            world.sights.iter().filter_map(|s| Some(s.look?.point.dot(axis))).collect();
        along.sort_by(f64::total_cmp);
        let place = (0.25 + 0.5 * random.uniform()) * along.len() as f64;
        CoveringLayer { axis, at_m: along.get(place as usize).copied().unwrap_or(0.0) }
    }
}

impl Effect for CoveringLayer {
    fn name(&self) -> &'static str {
        "covering-layer"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.02, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "loss_db": size,
            "meaning": "two-way, at normal incidence; grows as 1/cos theta",
            "half_space": { "normal": self.axis.to_array(), "offset_m": self.at_m },
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        if look.point.dot(self.axis) > self.at_m {
            law.gain *= ratio(-size / look.cos_theta().max(0.05));
        }
    }
}

/// Lobes of another width across the grain than along it.
pub struct Anisotropy {
    grain: DVec3,
}

impl Anisotropy {
    pub fn new(random: &mut Draws) -> Anisotropy {
        let turn = std::f64::consts::PI * random.uniform();
        Anisotropy { grain: DVec3::new(turn.cos(), turn.sin(), 0.0) }
    }
}

impl Effect for Anisotropy {
    fn name(&self) -> &'static str {
        "anisotropy"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.005, 2.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "ratio": size.exp(), "meaning": "m along the grain over m across it", "grain": self.grain.to_array() })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        let flat = |v: DVec3| (v - v.dot(look.normal) * look.normal).normalize_or_zero();
        law.cos2_azimuth = flat(self.grain).dot(flat(look.to_radar)).powi(2);
        let half = (0.5 * size).exp();
        law.m = [law.m[0] * half, law.m[1] / half];
    }
}

/// A coating on a share of every spot: interference in the specular part, whose facets are met at normal incidence, and
/// in the diffuse part, which comes from fine unevenness of the same surface.
pub struct ThinFilm {
    index: f64,
    thickness_m: f64,
    substrate: f64,
    /// Reflectance of the coated and of the bare surface, every tenth of a degree.
    table: Vec<[f64; 2]>,
}

impl ThinFilm {
    pub fn new(random: &mut Draws, base: &Base) -> ThinFilm {
        let index = 1.3 + 0.5 * random.uniform();
        let thickness_m = 2e-3 + 4e-3 * random.uniform();
        let root = base.f_lambda.sqrt();
        let substrate = (1.0 + root) / (1.0 - root);
        let at = |tenth: i32| {
            let theta_rad = (0.1 * f64::from(tenth)).to_radians();
            [thickness_m, 0.0].map(|d| reflectance(theta_rad, index, d, substrate))
        };
        ThinFilm { index, thickness_m, substrate, table: (0..900).map(at).collect() }
    }
}

impl Effect for ThinFilm {
    fn name(&self) -> &'static str {
        "thin-film"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.003, 1.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "index": self.index,
            "thickness_m": self.thickness_m,
            "substrate_index": self.substrate,
            "coated_share": size,
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        let tenth = 10.0 * look.cos_theta().clamp(-1.0, 1.0).acos().to_degrees();
        let low = (tenth as usize).min(self.table.len() - 2);
        let part = (tenth - low as f64).clamp(0.0, 1.0);
        let at = |n: usize| self.table[low][n] * (1.0 - part) + self.table[low + 1][n] * part;
        // Facets send back what they meet at normal incidence; fine unevenness is lit at the angle of the surface.
        let [film_on_facet, bare_facet] = self.table[0];
        law.specular *= 1.0 - size + size * film_on_facet / bare_facet;
        law.diffuse *= 1.0 - size + size * at(0) / at(1);
    }
}

/// Reflectance of a film on a half space by characteristic matrices (Born & Wolf, Principles of
/// Optics, sec. 1.6) at 300 GHz, the mean of both polarisations.
pub fn reflectance(theta_rad: f64, index: f64, thickness_m: f64, substrate: f64) -> f64 {
    let wave_per_m = std::f64::consts::TAU * 300e9 / 299_792_458.0;
    let cos = |n: f64| (1.0 - (theta_rad.sin() / n).powi(2)).sqrt();
    let phase = wave_per_m * index * thickness_m * cos(index);
    let polarised = |parallel: bool| {
        let admittance = |n: f64| if parallel { n / cos(n) } else { n * cos(n) };
        let [air, film, below] = [1.0, index, substrate].map(admittance);
        let electric = Complex::new(phase.cos(), phase.sin() * below / film);
        let magnetic = Complex::new(below * phase.cos(), film * phase.sin());
        ((electric * air - magnetic) / (electric * air + magnetic)).norm_sqr()
    };
    0.5 * (polarised(false) + polarised(true))
}

/// G1 once, on a surface as rough as it takes to be seen.
pub struct CorrelatedShadowing;

impl Effect for CorrelatedShadowing {
    fn name(&self) -> &'static str {
        "correlated-shadowing"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.1, 1.5]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "m": size, "meaning": "G1 instead of G1 squared; the size is the roughness of the base law" })
    }
    fn material(&self, size: f64, base: &mut Base) {
        base.m = size;
    }
    fn surface(&self, _: f64, _: &Shot, law: &mut Local) {
        law.shadowings = 1.0;
    }
}

/// A disc of another material.
pub struct ForeignPatch {
    centre: DVec3,
    radius_m: f64,
    m: f64,
}

impl ForeignPatch {
    /// Lies about a point that is met under less than 40°.
    pub fn new(random: &mut Draws, world: &World) -> ForeignPatch {
        let near = |c: f64| c > 40f64.to_radians().cos();
        let looks: Vec<Shot> = world.sights.iter().filter_map(|sight| sight.look).collect();
        let facing: Vec<&Shot> = looks.iter().filter(|look| near(look.cos_theta())).collect();
        let place = (random.uniform() * facing.len() as f64) as usize;
        let centre = facing.get(place).map_or(world.middle, |look| look.point);
        let radius_m = 0.04 + 0.05 * random.uniform();
        ForeignPatch { centre, radius_m, m: 0.8 + 0.6 * random.uniform() }
    }
}

impl Effect for ForeignPatch {
    fn name(&self) -> &'static str {
        "foreign-patch"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.05, 25.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "centre_m": self.centre.to_array(),
            "radius_m": self.radius_m,
            "brighter_db": size,
            "m_ratio": self.m,
        })
    }
    fn surface(&self, size: f64, look: &Shot, law: &mut Local) {
        if look.point.distance(self.centre) < self.radius_m {
            law.specular *= ratio(size);
            law.diffuse *= ratio(size);
            // A material hardly brighter is hardly other.
            law.m = law.m.map(|m| m * self.m.powf((size / 6.0).min(1.0)));
        }
    }
}
