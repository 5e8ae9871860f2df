//! From the base law to the mean power of every chirp, with whatever effects act on the way.

use std::f64::consts::{LN_2, TAU};

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use serde_json::Value;

use super::base::{Base, Local};
use super::scan::{Shot, Sight, Stream, World, draws, look, ray};

/// How strong an effect is to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    Weak,
    Moderate,
    Strong,
}

impl Class {
    pub const ALL: [Class; 3] = [Class::Weak, Class::Moderate, Class::Strong];

    /// What the refitted base law leaves, dB rms.
    pub fn rms_db(self) -> f64 {
        match self {
            Class::Weak => 0.35,
            Class::Moderate => 0.9,
            Class::Strong => 2.2,
        }
    }
}

/// A ratio of powers from decibels.
pub fn ratio(db: f64) -> f64 {
    10f64.powf(0.1 * db)
}

/// Law of the fluctuation about the mean.
#[derive(Clone, Copy, Debug)]
pub enum Fluctuation {
    /// Gamma of this many looks, not necessarily whole.
    Looks(f64),
    /// Gaussian in decibels.
    LogNormal { sd_db: f64 },
}

/// What a detection says.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    pub range_m: f64,
    pub power_w: f64,
}

/// A rigid displacement of the target: v becomes R·(v − pivot) + pivot + t.
#[derive(Clone, Copy, Debug)]
pub struct Displacement {
    pub rotation: DMat3,
    pub translation_m: DVec3,
    pub pivot: DVec3,
}

impl Displacement {
    /// Where a point of the displaced target is in its own frame.
    pub fn undo(&self, at: DVec3) -> DVec3 {
        self.undo_turn(at - self.pivot - self.translation_m) + self.pivot
    }

    /// The same for a direction.
    pub fn undo_turn(&self, along: DVec3) -> DVec3 {
        self.rotation.transpose() * along
    }
}

/// The echo of one chirp before it fluctuates.
#[derive(Clone, Copy, Debug)]
pub struct Echo {
    /// Mean power, and the range that is reported.
    pub report: Report,
    /// Share of the power that facets return together, as a mirror does. It does not fluctuate.
    pub mirrored: f64,
    /// Share of the power that comes by way of a second surface.
    pub bounced: f64,
    /// Middle of the range cell that returns most, m.
    pub cell_m: f64,
}

/// Something the base law does not know. Each hook is a place where physics can act; `size` is the
/// number that the calibration turns, and more of it means more effect.
pub trait Effect: Sync {
    fn name(&self) -> &'static str;
    /// Least and largest size that make sense.
    fn sizes(&self) -> [f64; 2];
    /// What the label says, with units in the keys.
    fn parameters(&self, size: f64) -> Value;
    /// The size of a class, for effects whose strength is no residual of the mean.
    fn size_of(&self, _class: Class, _world: &World) -> Option<f64> {
        None
    }
    /// The material that such a case needs.
    fn material(&self, _size: f64, _base: &mut Base) {}
    fn displacement(&self, _size: f64, _sight: &Sight) -> Option<Displacement> {
        None
    }
    /// Diameter at half the intensity over which a chirp averages, m.
    fn spot_diameter_m(&self, _size: f64) -> Option<f64> {
        None
    }
    /// Where a ray of the spot lies, in m across the beam, that has this share of the power inside its radius
    /// and stands at this share of a turn. What is sent and received alike, exp(−8 ln 2·r²/D²), is a Gaussian
    /// of one standard deviation in each direction.
    fn spot_place_m(&self, diameter_m: f64, [inside, turn]: [f64; 2]) -> DVec2 {
        let sd_m = diameter_m / (16.0 * LN_2).sqrt();
        let radius_m = sd_m * (-2.0 * (1.0 - inside).ln()).sqrt();
        radius_m * DVec2::from_angle(TAU * turn)
    }
    /// Tilt of the true normal, as tangents along the two directions that
    /// `DVec3::any_orthonormal_pair` gives for the declared normal.
    fn tilt(&self, _size: f64, _chirp: usize, _look: &Shot) -> DVec2 {
        DVec2::ZERO
    }
    fn surface(&self, _size: f64, _look: &Shot, _law: &mut Local) {}
    /// Power and range that arrive by other ways, W and m.
    fn detour(&self, _size: f64, _chirp: usize) -> Option<Report> {
        None
    }
    fn receive_w(&self, _size: f64, _sight: &Sight, report: Report) -> f64 {
        report.power_w
    }
    fn thermal_w(&self, _size: f64) -> Option<f64> {
        None
    }
    fn fluctuation(&self, _size: f64) -> Option<Fluctuation> {
        None
    }
    /// What becomes of a detection; `None` when it is lost.
    fn reported(&self, _size: f64, _chirp: usize, report: Report) -> Option<Report> {
        Some(report)
    }
}

/// An effect and its size.
pub type Acting<'a> = (&'a dyn Effect, f64);

/// Rays that stand for a spot: one at a random place of every cell of equal power, so many by radius and by
/// angle. Placed freely, so few would scatter by more than a weak effect changes.
const SPOT_CELLS: usize = 16;

/// Mean echo without thermal noise of every `stride`-th chirp; `None` where nothing is met.
pub fn means(
    world: &World,
    seed: u64,
    base: &Base,
    acting: &[Acting],
    stride: usize,
) -> Vec<Option<Echo>> {
    let chirps: Vec<&Sight> = world.sights.iter().step_by(stride).collect();
    chirps.into_par_iter().map(|sight| mean(world, seed, base, acting, sight)).collect()
}

fn mean(world: &World, seed: u64, base: &Base, acting: &[Acting], sight: &Sight) -> Option<Echo> {
    let looks = looks(world, seed, acting, sight);
    let parts: Vec<Part> =
        looks.iter().flatten().map(|look| part(world, base, acting, sight, look)).collect();
    let cell_m = brightest_cell_m(world, &parts)?;
    let (mut sum, mut mirrored_w, mut bounced_w) =
        (Report { range_m: 0.0, power_w: 0.0 }, 0.0, 0.0);
    for part in &parts {
        let power_w = part.power_w / looks.len() as f64;
        sum.power_w += power_w;
        sum.range_m += power_w * part.range_m;
        mirrored_w += part.mirrored_w / looks.len() as f64;
    }
    for (effect, size) in acting {
        if let Some(detour) = effect.detour(*size, sight.chirp) {
            sum.power_w += detour.power_w;
            sum.range_m += detour.power_w * detour.range_m;
            bounced_w += detour.power_w;
        }
    }
    if sum.power_w <= 0.0 {
        return None;
    }
    let (mirrored, bounced) = (mirrored_w / sum.power_w, bounced_w / sum.power_w);
    sum.range_m /= sum.power_w;
    for (effect, size) in acting {
        sum.power_w = effect.receive_w(*size, sight, sum);
    }
    Some(Echo { report: sum, mirrored, bounced, cell_m })
}

/// What one ray of a spot returns, as if it were the only one.
struct Part {
    range_m: f64,
    power_w: f64,
    /// What of it does not speckle.
    mirrored_w: f64,
}

/// Equation (11) at one place.
fn part(world: &World, base: &Base, acting: &[Acting], sight: &Sight, look: &Shot) -> Part {
    let tilt: DVec2 =
        acting.iter().map(|(effect, size)| effect.tilt(*size, sight.chirp, look)).sum();
    let mut look = *look;
    if tilt != DVec2::ZERO {
        let (u, v) = look.normal.any_orthonormal_pair();
        look.normal = (look.normal + tilt.x * u + tilt.y * v).normalize();
    }
    // Rays that stand on the curved wavefront meet a lobe as wide as the beam is here; a single one, which
    // stands for all of them, as it is at the waist.
    let beam_slope = if spot_diameter_m(acting).is_some() {
        world.waist.slope_at(sight.place_m, look.range_m)
    } else {
        world.waist.slope(sight.place_m)
    };
    let law = law(base, acting, &look, beam_slope);
    let cos = look.cos_theta().max(0.0);
    let received_sr = world.waist.received_sr(sight.place_m, look.range_m);
    let watts_per_f = world.sent_w * received_sr * cos * cos;
    let [speckled_w, mirrored_w] = law.parts_per_sr(cos).map(|f| watts_per_f * f);
    Part { range_m: look.range_m, power_w: speckled_w + mirrored_w, mirrored_w }
}

/// The base law at one place, as the effects change it and as a beam of these slopes sees it.
fn law(base: &Base, acting: &[Acting], look: &Shot, beam_slope: f64) -> Local {
    let mut law = Local { beam_slope, ..base.local() };
    acting.iter().for_each(|(effect, size)| effect.surface(*size, look, &mut law));
    law
}

/// The part of f that speckles, 1/sr, in the middle of the field.
pub fn incoherent_per_sr(world: &World, base: &Base, acting: &[Acting], look: &Shot) -> f64 {
    let [speckled, _] =
        law(base, acting, look, world.waist.slope(DVec2::ZERO)).parts_per_sr(look.cos_theta());
    speckled
}

/// Mean range of those that fill the range cell with the most power, m; cells count from the nearest.
fn brightest_cell_m(world: &World, parts: &[Part]) -> Option<f64> {
    let nearest_m = parts.iter().map(|part| part.range_m).reduce(f64::min)?;
    let mut cells: Vec<Report> = Vec::new();
    for part in parts {
        let cell = ((part.range_m - nearest_m) / world.range_cell_m) as usize;
        if cells.len() <= cell {
            cells.resize(cell + 1, Report { range_m: 0.0, power_w: 0.0 });
        }
        cells[cell].power_w += part.power_w;
        cells[cell].range_m += part.power_w * part.range_m;
    }
    let brightest = cells.iter().max_by(|a, b| a.power_w.total_cmp(&b.power_w))?;
    if brightest.power_w > 0.0 {
        Some(brightest.range_m / brightest.power_w)
    } else {
        Some(nearest_m)
    }
}

/// How the effects move the target under a chirp.
pub fn moves(acting: &[Acting], sight: &Sight) -> Vec<Displacement> {
    acting.iter().filter_map(|(effect, size)| effect.displacement(*size, sight)).collect()
}

/// Diameter at half the intensity over which a chirp averages, m.
pub fn spot_diameter_m(acting: &[Acting]) -> Option<f64> {
    spot(acting).map(|(_, diameter_m)| diameter_m)
}

/// The effect that widens the spot, and the diameter.
fn spot<'a>(acting: &[Acting<'a>]) -> Option<Acting<'a>> {
    acting.iter().find_map(|(effect, size)| Some((*effect, effect.spot_diameter_m(*size)?)))
}

/// Origin and direction of a chirp's ray in the frame of the target, which stands still there.
pub fn into_target(acting: &[Acting], sight: &Sight) -> [DVec3; 2] {
    let ray = [sight.ray.origin.xyz, sight.ray.direction.xyz()];
    moves(acting, sight)
        .iter()
        .fold(ray, |[at, along], moved| [moved.undo(at), moved.undo_turn(along)])
}

/// What the rays of one chirp meet on the target as it really stands.
fn looks(world: &World, seed: u64, acting: &[Acting], sight: &Sight) -> Vec<Option<Shot>> {
    let spot = spot(acting);
    let moved = moves(acting, sight);
    if moved.is_empty() && spot.is_none() {
        return vec![sight.look];
    }
    let [origin, forward] = into_target(acting, sight);
    let Some((spot, diameter_m)) = spot else {
        return vec![ray(origin, forward).and_then(|ray| look(&world.bvh, &ray))];
    };
    let range_m = sight.look.map_or(8.0, |look| look.range_m);
    let turn_per_m = world.waist.towards(sight.place_m).turn_per_m(range_m);
    let (u, v) = forward.any_orthonormal_pair();
    let mut random = draws(seed, sight.chirp, Stream::Spot);
    let mut within = |cell: usize| (cell as f64 + random.uniform()) / SPOT_CELLS as f64;
    let aside = |cell: usize| {
        let shares = [within(cell / SPOT_CELLS), within(cell % SPOT_CELLS)];
        let place_m = spot.spot_place_m(diameter_m, shares);
        place_m.x * u + place_m.y * v
    };
    // The wave runs at right angles to its front, on which all rays have come equally far.
    let bent = |aside_m: DVec3| {
        let along = forward + turn_per_m * aside_m;
        let way_m = range_m + 0.5 * turn_per_m * aside_m.length_squared();
        ray(origin + range_m * forward + aside_m - way_m * along.normalize(), along)
    };
    (0..SPOT_CELLS * SPOT_CELLS)
        .map(aside)
        .map(|aside_m| look(&world.bvh, &bent(aside_m)?))
        .collect()
}
