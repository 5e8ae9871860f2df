//! A measured curve as points in the order of its scans, and the noise of its levels.
//!
//! The noise is the first of these that is known: the value that the caller declares, the scatter of repeats, the
//! values that the file states, the scatter of a point about the line through its two neighbours. The last one takes every
//! bend of the curve between them for noise and is an upper bound on coarse scans. Noise is that of one row: a point that
//! is the mean of n rows has 1/√n of it.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::Serialize;

use crate::frames::{Direction, Surface};
use crate::material::Observation;
use crate::measure::Curve;
use crate::units::{db_from_ratio, ratio_from_db};

/// What a curve is measured over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Source and receiver in one direction; levels are σ⁰ in dB.
    Backscatter,
    /// In the plane of incidence; levels are f in dB over 1/sr.
    InPlane,
}

/// One level of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Towards the source.
    pub i: Direction<Surface>,
    /// Towards the receiver.
    pub o: Direction<Surface>,
    /// Angle of incidence, rad.
    pub theta_i_rad: f64,
    /// Angle of the receiver, rad, positive on the mirror's side.
    pub theta_s_rad: f64,
    /// 10·lg f, f in 1/sr; where censored f is below that. In dB, in which the fit minimises the residual.
    pub f_db: f64,
    /// Nothing was detected.
    pub censored: bool,
    /// Level of the file less 10·lg f, dB.
    pub offset_db: f64,
    /// Noise of this level over that of the curve.
    pub spread: f64,
    /// Which scan of the curve it belongs to: the number of its angle of incidence, or 0.
    pub scan: usize,
}

/// Where the noise comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// Declared by the caller.
    Declared,
    /// Scatter of repeats of one pair of angles.
    Repeats,
    /// Stated in the file.
    File,
    /// Scatter of neighbouring angles about each other.
    Neighbours,
}

/// Noise of the levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Standard deviation of a level, dB; infinite where it is unknown. Where levels have noise of their own, the one
    /// that would determine a constant as well.
    pub sd_db: f64,
    /// Degrees of freedom that it was found with; infinite where it was stated.
    pub freedom: f64,
    /// How it is known.
    pub source: NoiseSource,
}

/// A curve to be diagnosed.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// What it is measured over.
    pub kind: Kind,
    /// Its points, scan by scan, each by rising angle.
    pub points: Vec<Point>,
    /// The noise.
    pub noise: Noise,
    /// Levels of each point in the order of the file, dB, where angles were repeated; else empty. A point that is a limit
    /// has none.
    pub repeats: Vec<Vec<f64>>,
}

/// Two repeats of a curve that are of different levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contradiction {
    /// Their numbers, from 1, in the order of the file.
    pub repeats: [usize; 2],
    /// The second less the first at the end of the angles where a line through the differences is farther from zero, dB.
    pub apart_db: f64,
    /// Standard deviation of the differences about that line, dB.
    pub scatter_db: f64,
}

/// Angle from which on σ⁰ does not give f, rad.
const GRAZING_RAD: f64 = 1.569;
/// Points that two repeats must share to be compared.
const LEAST_SHARED: usize = 8;
/// Least noise of a file, dB: files round.
const LEAST_NOISE_DB: f64 = 0.01;
/// Quantile of the deviations that gives the noise: twice as precise as the median, and insensitive to a few bends.
const BELOW: f64 = 0.8;
/// That quantile of the absolute value of a standard normal number.
const SIZE: f64 = 1.2816;

/// Rows of one place, and what is stated of the noise of each, dB.
type Group = Vec<(Point, Option<f64>)>;

impl Points {
    /// The points of a curve: of backscatter, where all its rows are, else in the plane of incidence. Repeats of an angle
    /// become points of their mean level, in backscatter where half of the rows are repeats. `sd_db` is what the file
    /// states of the deviation of each level, for none or for all rows. Rows at grazing angles are left out.
    ///
    /// # Errors
    /// The number of a row, from 1, that is out of the plane of incidence.
    pub fn of_curve(
        curve: &Curve,
        sd_db: &[Option<f64>],
        noise_db: Option<f64>,
    ) -> Result<Points, usize> {
        let rows = curve.observations.iter().enumerate();
        let rows = rows.map(|(index, row)| (row, sd_db.get(index).copied().flatten()));
        if curve.observations.iter().all(Observation::is_retro) {
            return Ok(Points::backscatter(rows.filter(|(row, _)| !is_grazing(row)), noise_db));
        }
        let rows = rows.enumerate().filter(|(_, (row, _))| !is_grazing(row));
        let points = rows.filter_map(|(index, (row, sd_db))| {
            let level = row.level_sigma0()?;
            Some(point_in_plane(row, level).map(|point| (point, sd_db)).ok_or(index + 1))
        });
        Ok(Points::in_plane(points.collect::<Result<Group, usize>>()?, noise_db))
    }

    fn backscatter<'a>(
        rows: impl Iterator<Item = (&'a Observation, Option<f64>)>,
        noise_db: Option<f64>,
    ) -> Points {
        let mut points: Group = rows
            .filter_map(|(row, sd_db)| {
                let theta_rad = row.theta_i_rad;
                let i = Direction::from_angles(theta_rad, PI);
                let offset_db = db_from_ratio(4.0 * PI * i.cos_theta().powi(2));
                let point = Point {
                    i,
                    o: i,
                    theta_i_rad: theta_rad,
                    theta_s_rad: -theta_rad,
                    f_db: db_from_ratio(row.level_sigma0()?) - offset_db,
                    censored: row.is_censored(),
                    offset_db,
                    spread: 1.0,
                    scan: 0,
                };
                Some((point, sd_db))
            })
            .collect();
        points.sort_by(|a, b| a.0.theta_i_rad.total_cmp(&b.0.theta_i_rad));
        let groups = points.chunk_by(|a, b| place(a.0.theta_i_rad) == place(b.0.theta_i_rad));
        let repeated: usize = groups.clone().map(<[_]>::len).filter(|&rows| rows > 1).sum();
        // Angles of single chirps coincide by chance.
        let are_repeats = 2 * repeated >= points.len();
        let has_limits = points.iter().any(|(point, _)| point.censored);
        let groups: Vec<Group> = if are_repeats && !has_limits {
            groups.map(<[_]>::to_vec).collect()
        } else {
            points.iter().map(|row| vec![*row]).collect()
        };
        Points::of_groups(Kind::Backscatter, &groups, noise_db)
    }

    /// The points in the plane of incidence, scan by scan.
    fn in_plane(rows: Group, noise_db: Option<f64>) -> Points {
        let mut places: BTreeMap<[i64; 2], Group> = BTreeMap::new();
        for row in rows {
            let key = [row.0.theta_i_rad, row.0.theta_s_rad].map(place);
            places.entry(key).or_default().push(row);
        }
        let mut scan = None;
        for (key, group) in &mut places {
            let number = match scan {
                Some((incidence, number)) if incidence == key[0] => number,
                Some((_, number)) => number + 1,
                None => 0,
            };
            scan = Some((key[0], number));
            group.iter_mut().for_each(|(point, _)| point.scan = number);
        }
        let groups: Vec<Group> = places.into_values().collect();
        Points::of_groups(Kind::InPlane, &groups, noise_db)
    }

    /// The points of these groups of rows, each the mean of its levels.
    fn of_groups(kind: Kind, groups: &[Group], noise_db: Option<f64>) -> Points {
        let mut points: Vec<Point> = groups.iter().filter_map(|group| mean_point(group)).collect();
        let levels: Vec<Vec<f64>> = groups.iter().map(|group| levels(group)).collect();
        let noise = noise(&mut points, groups, &levels, noise_db);
        let has_repeats = levels.iter().any(|levels| levels.len() > 1);
        Points { kind, points, noise, repeats: if has_repeats { levels } else { Vec::new() } }
    }

    /// Whether the noise is known, and not taken from the curve's own bends.
    pub fn has_known_noise(&self) -> bool {
        self.noise.source != NoiseSource::Neighbours
    }

    /// The points for which `used` is true.
    pub(super) fn only(&self, used: &[bool]) -> Points {
        let mut chosen = self.clone();
        let mut index = 0..;
        chosen.points.retain(|_| index.next().is_some_and(|index| used[index]));
        let mut index = 0..;
        chosen.repeats.retain(|_| index.next().is_some_and(|index| used[index]));
        chosen
    }

    /// Number of the repeats that hold so many points or more.
    pub(super) fn most_repeats(&self, least: usize) -> usize {
        let mut counts: Vec<usize> = self.repeats.iter().map(Vec::len).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.get(least.saturating_sub(1)).copied().unwrap_or(0)
    }

    /// One of the repeats, from 0, by itself. One level scatters more than the mean of several.
    pub(super) fn repeat(&self, number: usize) -> Points {
        let pairs = self.points.iter().zip(&self.repeats);
        let points = pairs.filter_map(|(point, levels)| {
            let spread = point.spread * (levels.len() as f64).sqrt();
            levels.get(number).map(|&f_db| Point { f_db, spread, ..*point })
        });
        Points { points: points.collect(), repeats: Vec::new(), ..*self }
    }

    /// Two repeats whose difference a line over the angles follows far from zero, if there are any.
    pub(super) fn contradiction(&self) -> Option<Contradiction> {
        let most = self.most_repeats(LEAST_SHARED);
        let pairs = (0..most).flat_map(|a| (a + 1..most).map(move |b| [a, b]));
        let contradictions = pairs.filter_map(|[a, b]| {
            let both = self.points.iter().zip(&self.repeats);
            let both = both.filter_map(|(point, levels)| {
                Some((self.angle_rad(point), levels.get(b)? - levels.get(a)?))
            });
            let (apart_db, scatter_db) = far_apart_db(&both.collect::<Vec<(f64, f64)>>())?;
            Some(Contradiction { repeats: [a + 1, b + 1], apart_db, scatter_db })
        });
        contradictions.max_by(|a, b| a.apart_db.abs().total_cmp(&b.apart_db.abs()))
    }

    /// Measured less predicted levels, dB, over the spread of each: all of them have the noise of the curve.
    pub(super) fn residuals_db(&self, levels_db: &[f64]) -> Vec<f64> {
        let pairs = self.points.iter().zip(levels_db);
        pairs.map(|(point, db)| (point.f_db - db) / point.spread).collect()
    }

    /// The same of the detections alone.
    pub(super) fn detected_residuals_db(&self, levels_db: &[f64]) -> Vec<f64> {
        let pairs = self.points.iter().zip(self.residuals_db(levels_db));
        pairs.filter(|(point, _)| !point.censored).map(|(_, residual_db)| residual_db).collect()
    }

    /// The angle that a scan runs over, rad.
    pub fn angle_rad(&self, point: &Point) -> f64 {
        match self.kind {
            Kind::Backscatter => point.theta_i_rad,
            Kind::InPlane => point.theta_s_rad,
        }
    }

    /// Neighbouring points of one scan.
    pub fn neighbours(&self) -> impl Iterator<Item = [&Point; 2]> {
        self.points.windows(2).filter_map(|pair| match pair {
            [a, b] if a.scan == b.scan => Some([a, b]),
            _ => None,
        })
    }
}

/// Whether a row is left out, since σ⁰ does not give f where one of its angles is so large.
pub fn is_grazing(row: &Observation) -> bool {
    row.theta_i_rad.max(row.theta_r_rad) >= GRAZING_RAD
}

/// An angle as a key that rounding does not change.
fn place(angle_rad: f64) -> i64 {
    (angle_rad.to_degrees() * 1e4).round() as i64
}

/// A row in the plane of incidence, of this level of σ⁰, as a point; `None` out of that plane.
fn point_in_plane(row: &Observation, sigma0: f64) -> Option<Point> {
    let aspect = row.aspect();
    let theta_s_rad = aspect.theta_s_rad()?;
    let side = if theta_s_rad < 0.0 { PI } else { 0.0 };
    Some(Point {
        i: Direction::from_angles(row.theta_i_rad, PI),
        o: Direction::from_angles(theta_s_rad.abs(), side),
        theta_i_rad: row.theta_i_rad,
        theta_s_rad,
        f_db: db_from_ratio(sigma0 / aspect.sigma0_per_f()),
        censored: row.is_censored(),
        offset_db: 0.0,
        spread: 1.0,
        scan: 0,
    })
}

/// Repeats of a point as one of their mean level. Where one of them is a limit, so is the mean.
fn mean_point(group: &[(Point, Option<f64>)]) -> Option<Point> {
    let (first, _) = group.first()?;
    let sum: f64 = group.iter().map(|(point, _)| point.f_db).sum();
    let censored = group.iter().any(|(point, _)| point.censored);
    Some(Point { f_db: sum / group.len() as f64, censored, ..*first })
}

/// The levels of repeats, dB; none where one of them is a limit.
fn levels(group: &[(Point, Option<f64>)]) -> Vec<f64> {
    let levels = group.iter().map(|(point, _)| (!point.censored).then_some(point.f_db));
    levels.collect::<Option<Vec<f64>>>().unwrap_or_default()
}

/// The noise of points, whose spreads it sets.
fn noise(
    points: &mut [Point],
    groups: &[Group],
    levels: &[Vec<f64>],
    declared_db: Option<f64>,
) -> Noise {
    let of_means = |sd_db: f64| groups.iter().map(|g| sd_db / (g.len() as f64).sqrt()).collect();
    let (sds_db, freedom, source): (Vec<f64>, f64, NoiseSource) = if let Some(sd_db) = declared_db {
        (of_means(sd_db), f64::INFINITY, NoiseSource::Declared)
    } else if let Some((sd_db, freedom)) = of_repeats(levels) {
        (of_means(sd_db.max(LEAST_NOISE_DB)), freedom, NoiseSource::Repeats)
    } else if let Some(sds_db) = stated(groups) {
        (sds_db, f64::INFINITY, NoiseSource::File)
    } else {
        let sd_db = neighbours(points).map_or(f64::INFINITY, |db| db.max(LEAST_NOISE_DB));
        (vec![sd_db; points.len()], points.len() as f64, NoiseSource::Neighbours)
    };
    let first_db = sds_db.first().copied().unwrap_or(f64::INFINITY);
    if sds_db.iter().all(|sd_db| *sd_db == first_db) {
        return Noise { sd_db: first_db, freedom, source };
    }
    let inverse = sds_db.iter().map(|sd_db| sd_db.powi(-2)).sum::<f64>() / sds_db.len() as f64;
    let sd_db = inverse.powf(-0.5);
    for (point, own_db) in points.iter_mut().zip(&sds_db) {
        point.spread = own_db / sd_db;
    }
    Noise { sd_db, freedom, source }
}

/// Noise of one level, dB, from the scatter of repeats, and its degrees of freedom.
fn of_repeats(levels: &[Vec<f64>]) -> Option<(f64, f64)> {
    let (mut squares, mut spare) = (0.0, 0.0);
    for levels in levels.iter().filter(|levels| !levels.is_empty()) {
        let count = levels.len() as f64;
        let mean = levels.iter().sum::<f64>() / count;
        squares += levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>();
        spare += count - 1.0;
    }
    /// Degrees of freedom that a scatter needs.
    const LEAST_SPARE: f64 = 5.0;
    (spare >= LEAST_SPARE).then(|| ((squares / spare).sqrt(), spare))
}

/// Noise of each point, dB, if all rows state theirs; a limit need not.
fn stated(groups: &[Group]) -> Option<Vec<f64>> {
    let mut sds_db = Vec::with_capacity(groups.len());
    let rows: Vec<f64> = groups.iter().flatten().filter_map(|(_, sd_db)| *sd_db).collect();
    let middle_db = (rows.iter().map(|sd| sd * sd).sum::<f64>() / rows.len() as f64).sqrt();
    for group in groups {
        let squares = group.iter().map(|(point, sd_db)| {
            let limit_db = point.censored.then_some(middle_db);
            sd_db.or(limit_db).map(|sd_db| sd_db.max(LEAST_NOISE_DB).powi(2))
        });
        let squares: f64 = squares.collect::<Option<Vec<f64>>>()?.iter().sum();
        sds_db.push(squares.sqrt() / group.len() as f64);
    }
    (!rows.is_empty()).then_some(sds_db)
}

/// How far a line through differences of two repeats over the angle is from zero at its farther end, dB, and the scatter
/// about it; `None` where chance may make it, or noise.
fn far_apart_db(differences: &[(f64, f64)]) -> Option<(f64, f64)> {
    /// Standard errors of the difference, and its size, dB, from which on it is no chance.
    const ERRORS: f64 = 5.0;
    const LEAST_DB: f64 = 1.0;
    if differences.len() < LEAST_SHARED {
        return None;
    }
    let count = differences.len() as f64;
    let [x, y] = differences.iter().fold([0.0; 2], |[x, y], d| [x + d.0 / count, y + d.1 / count]);
    let spread: f64 = differences.iter().map(|d| (d.0 - x).powi(2)).sum();
    let slope = differences.iter().map(|d| (d.0 - x) * (d.1 - y)).sum::<f64>() / spread;
    let slope = if slope.is_finite() { slope } else { 0.0 };
    let left: f64 = differences.iter().map(|d| (d.1 - y - slope * (d.0 - x)).powi(2)).sum();
    let scatter_db = (left / (count - 2.0)).sqrt();
    let ends = differences.iter().map(|(at, _)| {
        let error_db = scatter_db * (1.0 / count + (at - x).powi(2) / spread.max(1e-30)).sqrt();
        (y + slope * (at - x), error_db)
    });
    let far = ends.filter(|(db, error_db)| db.abs() >= LEAST_DB.max(ERRORS * error_db));
    let farthest = far.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    farthest.map(|(apart_db, _)| (apart_db, scatter_db))
}

/// Scatter about the line through the neighbours, dB; `None` where no scan has three angles.
fn neighbours(points: &[Point]) -> Option<f64> {
    let seen: Vec<&Point> = points.iter().filter(|point| !point.censored).collect();
    let mut sizes: Vec<f64> = seen
        .windows(3)
        .filter_map(|three| match three {
            [a, b, c] if a.scan == c.scan => Some(off_line_db(a, b, c)),
            _ => None,
        })
        .collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get((BELOW * sizes.len() as f64) as usize).map(|size| size / SIZE)
}

/// Deviation of a level from the line through its neighbours, dB, scaled to the noise of one level.
fn off_line_db(before: &Point, point: &Point, after: &Point) -> f64 {
    let span = after.theta_s_rad - before.theta_s_rad;
    let way = point.theta_s_rad - before.theta_s_rad;
    let share = if span == 0.0 { 0.5 } else { way / span };
    let [a_db, b_db, c_db] = [before, point, after].map(|p| p.f_db + p.offset_db);
    let line_db = (1.0 - share) * a_db + share * c_db;
    let width = (1.0 + share * share + (1.0 - share).powi(2)).sqrt();
    (b_db - line_db).abs() / width
}

/// f of a point, 1/sr.
pub(super) fn f_per_sr(point: &Point) -> f64 {
    ratio_from_db(point.f_db)
}
