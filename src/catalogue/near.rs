//! Which known material a measured curve is nearest to.
//!
//! The curve is gathered by angle and averaged in linear power, as its statistics are; where source and receiver were in
//! two directions, by the pair of these. Where all was
//! detected the mean is one value; what was below the threshold leaves it anywhere between two. The
//! difference to a material is that of its own mean over the same angles to the nearer end, in dB, and 0
//! between the ends. Every angle within the material's range counts, also one with a bound that the
//! material respects, where the difference is 0; there must be some at which something was detected, so
//! that silence makes nothing alike.

use serde::Serialize;

use crate::brdf::{Brdf, DEGREES, Outline, Scattering, ThroughBeam};
use crate::frames::{Direction, Surface};
use crate::material::{Aspect, Censor, Illumination, Lobes, Observation};
use crate::measure::statistics::by_angle;
use crate::radar::Footprint;
use crate::units::db_from_ratio;

/// Least number of common angles with an echo; half of the curve's angles must be common, too.
const LEAST_COMMON: usize = 3;
/// Most pairs of directions that are compared, evenly among all.
const MOST_PAIRS: usize = 500;
/// Angles at which a material's mean over a bin is computed.
const ANGLES_PER_BIN: usize = 8;

/// A curve to be compared with many materials.
#[derive(Clone, Debug)]
pub struct Probe {
    bins: Vec<Bin>,
    /// Lowest level of the curve, dB: an upper bound for a material without an echo.
    floor_db: f64,
    noise_db: Option<f64>,
    illumination: Illumination,
}

/// The curve at one angle, within one degree, or at one pair of directions.
#[derive(Clone, Debug)]
struct Bin {
    aspects: Vec<Aspect>,
    /// The first and the last degree of incidence that these lie in; `None` where it is not backscatter.
    degrees: Option<[usize; 2]>,
    /// Least and greatest mean, dB; the least is −∞ where nothing was detected.
    level_db: [f64; 2],
}

/// What a search ranks materials by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// [`Distance::rms_db`].
    Level,
    /// [`Distance::rms_shape_db`].
    Shape,
}

/// How far a curve is from a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distance {
    /// Root mean square difference, dB.
    pub rms_db: f64,
    /// Root mean square difference after the best common offset, for a curve whose level is not known, dB.
    pub rms_shape_db: f64,
    /// The best common offset: how much higher the curve is than the material, dB.
    pub offset_db: f64,
    /// Angles that are compared: those of the curve within the material's range.
    pub common_angles: usize,
    /// Angles of the curve beyond the material's range.
    pub angles_beyond: usize,
    /// Angles at which the curve has only a bound, and the material lies above it.
    pub above_bound: usize,
    /// Angles at which the curve has an echo and the material none: the distance is then a lower bound.
    pub silent: usize,
}

impl Distance {
    /// What a search ranks by, dB.
    pub fn rank_db(&self, rank: Rank) -> f64 {
        match rank {
            Rank::Level => self.rms_db,
            Rank::Shape => self.rms_shape_db,
        }
    }
}

impl Probe {
    /// Gathers a curve; `None` when nothing was detected, or a point lies above the instrument's range.
    pub fn new(observations: &[Observation]) -> Option<Probe> {
        let (retro, others): (Vec<&Observation>, Vec<&Observation>) =
            observations.iter().partition(|o| o.is_retro());
        if retro.iter().any(|o| o.censor == Censor::Right) {
            return None;
        }
        let (mut bins, mut repeats) = (Vec::new(), Vec::new());
        for row in by_angle(observations) {
            let points = within(&retro, row.theta_rad);
            repeats.push(detected(&points));
            bins.extend(Bin::of_backscatter(&points, row.mean.map(db_from_ratio)));
        }
        let pairs = by_aspect(others);
        let every = pairs.len().div_ceil(MOST_PAIRS).max(1);
        for points in pairs.iter().step_by(every) {
            repeats.push(detected(points));
            bins.extend(Bin::of_aspect(points));
        }
        let levels = bins.iter().flat_map(|bin| bin.level_db).filter(|level| level.is_finite());
        let floor_db = levels.min_by(f64::total_cmp)?;
        let has_echo = bins.iter().any(|bin| bin.level_db[0].is_finite());
        let illumination = Illumination::default();
        has_echo.then(|| Probe { bins, floor_db, noise_db: noise_db(&repeats), illumination })
    }

    /// The same curve, of which it is known how its target was lit. A material is then compared as this footprint
    /// would have reduced it and as this beam sees it.
    pub fn lit(self, illumination: Illumination) -> Probe {
        Probe { illumination, ..self }
    }

    /// Whether a material with these lobes is another one to the beam of this curve.
    pub(super) fn widens(&self, lobes: Lobes) -> bool {
        lobes == Lobes::Surface && self.illumination.beam_rad.is_some()
    }

    /// The [`distance`](Probe::distance) of what was reduced in this form of the footprint and has these lobes.
    pub(super) fn distance_of(
        &self,
        law: &Brdf,
        theta_rad: [f64; 2],
        footprint: Option<Footprint>,
        lobes: Lobes,
    ) -> Option<Distance> {
        let beam_rad = if self.widens(lobes) { self.illumination.beam_rad } else { None };
        let own = Illumination { footprint, beam_rad, ..self.illumination };
        let seen = ThroughBeam { law, beam_rad: beam_rad.unwrap_or(0.0) };
        let reduced = |i: Direction<Surface>, o: Direction<Surface>| {
            own.factor_to(self.illumination.footprint, i.cos_theta()) * seen.f_per_sr(i, o)
        };
        self.distance(&reduced, theta_rad)
    }

    /// Whether some of it was lit and seen from two directions.
    pub fn has_pairs(&self) -> bool {
        self.bins.iter().any(|bin| bin.degrees.is_none())
    }

    /// Number of angles, or of degrees, and pairs of directions at which the curve says something.
    pub fn angles(&self) -> usize {
        self.bins.len()
    }

    /// Expected distance to the true material from noise alone, dB, by the scatter of repeats; none where nothing was
    /// repeated.
    pub fn noise_db(&self) -> Option<f64> {
        self.noise_db
    }

    /// The distance to what scenes render of a material whose numbers are claimed for these angles of
    /// incidence, rad; `None` when too few angles are common.
    pub fn distance(&self, scattering: &dyn Scattering, [low, high]: [f64; 2]) -> Option<Distance> {
        let common = self.common([low, high])?;
        let mut silent = 0;
        let mut pairs = Vec::with_capacity(common.len());
        for bin in &common {
            let sum: f64 = bin.aspects.iter().map(|aspect| aspect.sigma0(scattering)).sum();
            let mut level_db = db_from_ratio(sum / bin.aspects.len().max(1) as f64);
            if !level_db.is_finite() {
                silent += usize::from(bin.level_db[0].is_finite());
                level_db = self.floor_db;
            }
            pairs.push(Pair { ends_db: bin.level_db, level_db });
        }
        let offset_db = best_offset(&pairs);
        let above_bound = pairs.iter().filter(|p| p.is_bound() && p.difference_db(0.0) != 0.0);
        Some(Distance {
            rms_db: rms_db(&pairs, 0.0),
            rms_shape_db: rms_db(&pairs, offset_db),
            offset_db,
            common_angles: common.len(),
            angles_beyond: self.bins.len() - common.len(),
            above_bound: above_bound.count(),
            silent,
        })
    }

    /// A distance, dB, that [`Probe::distance`] of a model with this outline, which was reduced in this form of the
    /// footprint, is not below; `None` where there is none.
    pub(super) fn at_least(
        &self,
        outline: &Outline,
        theta_rad: [f64; 2],
        footprint: Option<Footprint>,
        rank: Rank,
    ) -> Option<f64> {
        // More than what the sums of many squares lose.
        const ROUNDING_DB: f64 = 1e-6;
        let common = self.common(theta_rad)?;
        let mut sums = Gaps::default();
        for bin in &common {
            sums.add(bin.level_db, self.ends_db(outline, footprint, bin));
        }
        Some(sums.least_db(rank, common.len()) - ROUNDING_DB)
    }

    /// Least and greatest level that stands for a material at an angle, dB.
    fn ends_db(&self, outline: &Outline, footprint: Option<Footprint>, bin: &Bin) -> [f64; 2] {
        // Of other directions than backscatter the outline says nothing.
        let Some([first, last]) = bin.degrees else { return [f64::NEG_INFINITY, f64::INFINITY] };
        let Some([low, high]) = outline.ends_db(first..=last) else { return [self.floor_db; 2] };
        let own = Illumination { footprint, ..Illumination::default() };
        // The factor of a footprint rises or falls throughout.
        let [first_db, last_db] = [first, last + 1].map(|degree| {
            let cos_theta = (degree as f64).to_radians().cos();
            db_from_ratio(own.factor_to(self.illumination.footprint, cos_theta))
        });
        let (low, high) = (low + first_db.min(last_db), high + first_db.max(last_db));
        // Where it may be silent, the floor may stand for it.
        if low.is_finite() { [low, high] } else { [low, high.max(self.floor_db)] }
    }

    /// The bins within these angles, rad; `None` when they are too few.
    fn common(&self, [low, high]: [f64; 2]) -> Option<Vec<&Bin>> {
        const ROUNDING: f64 = 1e-9;
        let claimed = low - ROUNDING..=high + ROUNDING;
        let common: Vec<&Bin> = self
            .bins
            .iter()
            .filter(|bin| {
                bin.aspects.iter().all(|aspect| claimed.contains(&aspect.half_angle_rad()))
            })
            .collect();
        let echoes = common.iter().filter(|bin| bin.level_db[0].is_finite()).count();
        let enough = echoes >= LEAST_COMMON && common.len() * 2 >= self.bins.len();
        enough.then_some(common)
    }
}

impl Bin {
    /// The bin of some points of backscatter; none where there are no points.
    fn of_backscatter(points: &[&Observation], level_db: [f64; 2]) -> Option<Bin> {
        let mut theta_rad: Vec<f64> = points.iter().map(|o| o.theta_i_rad).collect();
        theta_rad.sort_by(f64::total_cmp);
        let theta_rad = thinned(&theta_rad);
        let degrees = Some([degree(*theta_rad.first()?), degree(*theta_rad.last()?)]);
        let aspects = theta_rad.into_iter().map(Aspect::retro).collect();
        Some(Bin { aspects, degrees, level_db })
    }

    /// The bin of points of one pair of directions; none where one has no level, or lies above the instrument's range.
    fn of_aspect(points: &[&Observation]) -> Option<Bin> {
        let (mut least, mut greatest) = (0.0, 0.0);
        for point in points {
            if point.censor == Censor::Right {
                return None;
            }
            let level = point.level_sigma0()?;
            least += if point.is_censored() { 0.0 } else { level };
            greatest += level;
        }
        let level_db = [least, greatest].map(|sum: f64| db_from_ratio(sum / points.len() as f64));
        let aspects = points.first().map(|point| point.aspect()).into_iter().collect();
        Some(Bin { aspects, degrees: None, level_db })
    }
}

/// Detected levels, σ⁰.
fn detected(points: &[&Observation]) -> Vec<f64> {
    let detected = points.iter().filter(|o| o.censor == Censor::None);
    detected.filter_map(|o| o.sigma0).collect()
}

/// The points of each pair of directions.
fn by_aspect(mut points: Vec<&Observation>) -> Vec<Vec<&Observation>> {
    points.sort_by(|a, b| a.aspect().in_order(&b.aspect()));
    points.chunk_by(|a, b| a.aspect() == b.aspect()).map(<[&Observation]>::to_vec).collect()
}

/// The whole degree of incidence that an angle lies in.
fn degree(theta_rad: f64) -> usize {
    (theta_rad.to_degrees() as usize).min(DEGREES - 1)
}

/// The points at one angle, or within a range of angles without its upper end.
fn within<'a>(points: &[&'a Observation], [low, high]: [f64; 2]) -> Vec<&'a Observation> {
    let is_one_angle = high - low < 1e-6;
    let within = points.iter().filter(|o| {
        let theta = o.theta_i_rad;
        theta >= low && (theta < high || is_one_angle && theta <= high)
    });
    within.copied().collect()
}

/// Sums over bins at which a curve and a material each lie within some range.
#[derive(Default)]
struct Gaps {
    /// Squares of the gaps between the ranges, dB².
    gaps: f64,
    /// Of bins of which all ends are known: how many,
    number: f64,
    /// the differences between the middles and their squares, dB and dB²,
    middles: f64,
    middles_squared: f64,
    /// and the squares of half the widths together, dB².
    widths_squared: f64,
}

impl Gaps {
    fn add(&mut self, curve: [f64; 2], material: [f64; 2]) {
        let gap = (curve[0] - material[1]).max(material[0] - curve[1]).max(0.0);
        self.gaps += gap * gap;
        if curve[0].is_finite() && material.iter().all(|end| end.is_finite()) {
            let middle = 0.5 * (curve[0] + curve[1] - material[0] - material[1]);
            let width = 0.5 * (curve[1] - curve[0] + material[1] - material[0]);
            self.number += 1.0;
            self.middles += middle;
            self.middles_squared += middle * middle;
            self.widths_squared += width * width;
        }
    }

    /// What the root mean square over so many bins is not below, dB. Whatever the offset, the
    /// differences are those of the middles but for half the widths: by the triangle inequality.
    fn least_db(&self, rank: Rank, bins: usize) -> f64 {
        let squares = match rank {
            Rank::Level => self.gaps,
            Rank::Shape => {
                let spread =
                    self.middles_squared - self.middles * self.middles / self.number.max(1.0);
                (spread.max(0.0).sqrt() - self.widths_squared.sqrt()).max(0.0).powi(2)
            }
        };
        (squares / bins.max(1) as f64).sqrt()
    }
}

/// What the curve and the material say of one bin.
struct Pair {
    ends_db: [f64; 2],
    level_db: f64,
}

impl Pair {
    /// How much the curve lies above the material, dB; 0 where the material lies between its ends.
    fn difference_db(&self, offset_db: f64) -> f64 {
        let [least, greatest] = self.ends_db;
        let level = self.level_db + offset_db;
        (least - level).max(0.0) + (greatest - level).min(0.0)
    }

    fn is_bound(&self) -> bool {
        !self.ends_db[0].is_finite()
    }
}

/// Root mean square over all of them, dB.
fn rms_db(pairs: &[Pair], offset_db: f64) -> f64 {
    let squares: f64 = pairs.iter().map(|pair| pair.difference_db(offset_db).powi(2)).sum();
    (squares / pairs.len().max(1) as f64).sqrt()
}

/// The offset of the least sum of squares, which has one minimum: by bisection of its slope.
fn best_offset(pairs: &[Pair]) -> f64 {
    let (mut low, mut high) = (-400.0, 400.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let slope: f64 = pairs.iter().map(|pair| pair.difference_db(middle)).sum();
        if slope > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A few of many angles, evenly among them.
fn thinned(theta_rad: &[f64]) -> Vec<f64> {
    let n = theta_rad.len();
    if n <= ANGLES_PER_BIN {
        return theta_rad.to_vec();
    }
    let places = (0..ANGLES_PER_BIN).map(|k| (2 * k + 1) * n / (2 * ANGLES_PER_BIN));
    places.filter_map(|place| theta_rad.get(place).copied()).collect()
}

/// From the scatter of repeats, relative to their means and pooled over all angles.
fn noise_db(repeats: &[Vec<f64>]) -> Option<f64> {
    let db_per_share = 10.0 / std::f64::consts::LN_10;
    let (mut squares, mut freedom) = (0.0, 0.0);
    let repeats: Vec<&Vec<f64>> = repeats.iter().filter(|values| !values.is_empty()).collect();
    for values in &repeats {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        squares += values.iter().map(|value| (value / mean - 1.0).powi(2)).sum::<f64>();
        freedom += values.len() as f64 - 1.0;
    }
    let share = (freedom > 0.0).then(|| squares / freedom)?;
    let variances = repeats.iter().map(|values| share / values.len() as f64);
    Some(db_per_share * (variances.sum::<f64>() / repeats.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Material, builtin};
    use crate::units::ratio_from_db;

    fn curve(points: &[(f64, f64)]) -> Vec<Observation> {
        points.iter().map(|&(theta_deg, level_db)| at(theta_deg, level_db, Censor::None)).collect()
    }

    fn at(theta_deg: f64, level_db: f64, censor: Censor) -> Observation {
        let (theta_rad, level) = (theta_deg.to_radians(), ratio_from_db(level_db));
        let is_detected = censor == Censor::None;
        let (sigma0, limit) = (is_detected.then_some(level), (!is_detected).then_some(level));
        Observation { censor, ..Observation::backscatter(theta_rad, sigma0, limit) }
    }

    fn flat(observations: &[Observation], level_db: f64) -> Option<Distance> {
        let level = ratio_from_db(level_db);
        let points: Vec<(f64, f64)> = [0.0, 0.7, 1.5].map(|theta| (theta, level)).to_vec();
        let table = crate::brdf::Tabulated::new(&points).unwrap();
        Probe::new(observations)?.distance(&Brdf::Tabulated(table), [0.0, 1.0])
    }

    #[test]
    fn a_material_is_nearest_to_itself_and_an_offset_is_found() {
        let materials: Vec<Material> =
            builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
        for own in &materials {
            let scattering = own.scattering().unwrap();
            let degrees = [0.2, 0.5, 1.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 40.0];
            let level = |deg: f64| db_from_ratio(scattering.sigma0(deg.to_radians()));
            let points = degrees.map(|deg| (deg, level(deg))).into_iter();
            let points: Vec<_> = points.filter(|(_, level)| *level > -100.0).collect();
            let lifted: Vec<_> = points.iter().map(|(deg, level)| (*deg, level + 7.0)).collect();
            let probe = Probe::new(&curve(&points)).unwrap();
            let to = |probe: &Probe, other: &Material| {
                probe.distance(&other.scattering().unwrap(), other.theta_rad)
            };
            let near = |other: &&Material| to(&probe, other).map_or(1e9, |d| d.rms_db);
            let first = materials.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            assert_eq!(first.slug, own.slug);
            assert!(near(&own) < 1e-9);
            let far = to(&Probe::new(&curve(&lifted)).unwrap(), own).unwrap();
            assert!((far.rms_db - 7.0).abs() < 1e-6 && (far.offset_db - 7.0).abs() < 1e-6);
            assert!(far.rms_shape_db < 1e-6);
        }
    }

    #[test]
    fn a_bound_counts_only_where_the_material_lies_above_it() {
        let mut points = curve(&[(5.0, -10.0), (10.0, -10.0), (15.0, -10.0)]);
        points.push(at(20.0, -20.0, Censor::Left));
        let below = flat(&points[..3], -10.0).unwrap();
        assert!(below.rms_db < 1e-9 && below.common_angles == 3);
        let above = flat(&points, -10.0).unwrap();
        // Three exact ones, and one 10 dB above its bound.
        assert!((above.rms_db - 5.0).abs() < 1e-9, "{above:?}");
        assert_eq!((above.common_angles, above.above_bound), (4, 1));
        let held = flat(&points, -25.0).unwrap();
        assert!((held.rms_db - 15.0 * 0.75f64.sqrt()).abs() < 1e-9, "{held:?}");
        assert_eq!((held.common_angles, held.above_bound), (4, 0));
    }

    #[test]
    fn who_contradicts_a_bound_is_not_nearer_for_it_and_a_shape_is_never_farther() {
        let mut points = curve(&[(5.0, -10.0), (10.0, -10.0), (15.0, -10.0)]);
        points.extend((20..40).map(|deg| at(f64::from(deg), -12.0, Censor::Left)));
        // Both are 4 dB off where something was seen; the brighter one also where nothing was.
        let [agrees, contradicts] = [-14.0, -6.0].map(|level| flat(&points, level).unwrap());
        assert!(agrees.rms_db < contradicts.rms_db, "{agrees:?} {contradicts:?}");
        for level_db in [-30.0, -14.0, -11.0, -6.0, 20.0] {
            let found = flat(&points, level_db).unwrap();
            assert!(found.rms_shape_db <= found.rms_db + 1e-9, "{found:?}");
            assert_eq!(found.common_angles, 23);
        }
        assert!(flat(&points[1..], -10.0).is_none(), "two echoes are too few, whatever else");
    }

    #[test]
    fn angles_beyond_a_materials_range_do_not_count_and_few_are_no_comparison() {
        let points = curve(&[(5.0, -10.0), (10.0, -10.0), (15.0, -10.0), (80.0, 30.0)]);
        let found = flat(&points, -10.0).unwrap();
        assert!(found.rms_db < 1e-9 && found.angles_beyond == 1);
        assert!(flat(&points[1..], -10.0).is_none());
    }

    #[test]
    fn repeats_tell_what_chance_makes_of_it() {
        assert_eq!(Probe::new(&curve(&[(5.0, 0.0), (9.0, 0.0)])).unwrap().noise_db(), None);
        // 1 and 3 at each angle: mean 2, deviation 0.707 of it, that of the mean 0.5.
        let pair = |deg: f64| [(deg, 0.0), (deg, db_from_ratio(3.0))];
        let points: Vec<_> = [5.0, 9.0, 14.0].into_iter().flat_map(pair).collect();
        let noise = Probe::new(&curve(&points)).unwrap().noise_db().unwrap();
        assert!((noise - 0.5 * 10.0 / std::f64::consts::LN_10).abs() < 1e-9, "{noise}");
    }

    #[test]
    fn a_table_of_two_directions_is_nearest_to_the_law_that_made_it() {
        let law = |slug: &str| builtin::get(slug).unwrap().unwrap();
        let own = law("concrete");
        let scattering = own.scattering().unwrap();
        let directions = [(10.0, 5.0), (10.0, 20.0), (10.0, 30.0), (20.0, 15.0), (20.0, 30.0)];
        let points: Vec<Observation> = directions
            .into_iter()
            .map(|(i_deg, o_deg): (f64, f64)| {
                let theta_r_rad = o_deg.to_radians();
                let delta_phi_rad = std::f64::consts::PI;
                let point = Observation::backscatter(i_deg.to_radians(), None, None);
                let point = Observation { theta_r_rad, delta_phi_rad, ..point };
                let sigma0 = Some(3.0 * point.aspect().sigma0(&scattering));
                Observation { sigma0, censor: Censor::None, ..point }
            })
            .collect();
        let probe = Probe::new(&points).unwrap();
        assert_eq!(probe.angles(), 5);
        let shape = |other: &Material| {
            probe
                .distance(&other.scattering().unwrap(), other.theta_rad)
                .map_or(1e9, |d| d.rms_shape_db)
        };
        assert!(shape(&own) < 1e-9, "{}", shape(&own));
        let others =
            builtin::names().filter(|name| *name != "concrete" && shape(&law(name)) < 1e-9);
        assert_eq!(others.count(), 0);
    }

    #[test]
    fn nothing_detected_is_near_nothing() {
        let silence: Vec<_> = [5.0, 9.0, 14.0].map(|deg| at(deg, -20.0, Censor::Left)).to_vec();
        assert!(Probe::new(&silence).is_none());
    }
}
