//! A measured curve as points in the order of its scans, and the noise of its levels.
//!
//! The noise is the first of these that is known: the value that the caller declares, the scatter of repeats, the
//! value that the file states, the scatter of a point about the line through its two neighbours. The last one takes every
//! bend of the curve between them for noise and is an upper bound on coarse scans.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::Serialize;

use crate::frames::{Direction, Surface};
use crate::material::file::in_plane::InPlane;
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
    /// Standard deviation of a level, dB; infinite where it is unknown.
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
    /// Levels of each point in the order of the file, dB, where angles were repeated; else empty.
    pub repeats: Vec<Vec<f64>>,
}

/// Two repeats of a curve that are of different levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contradiction {
    /// Their numbers, from 1, in the order of the file.
    pub repeats: [usize; 2],
    /// Mean of the second less the first, dB.
    pub apart_db: f64,
    /// Standard deviation of that difference over the angles, dB.
    pub scatter_db: f64,
}

/// Least noise of a file, dB: files round.
const LEAST_NOISE_DB: f64 = 0.01;
/// Quantile of the deviations that gives the noise: twice as precise as the median, and insensitive to a few bends.
const BELOW: f64 = 0.8;
/// That quantile of the absolute value of a standard normal number.
const SIZE: f64 = 1.2816;

impl Points {
    /// The points of a backscatter curve. Where angles are repeated, twice or more on average, and all were detected, they
    /// become points of their mean level. Rows at grazing incidence, where σ⁰ does not determine f, are left out.
    /// `sd_db` is what the file states of the deviation of each level.
    pub fn backscatter(curve: &Curve, sd_db: &[Option<f64>], noise_db: Option<f64>) -> Points {
        const GRAZING_RAD: f64 = 1.569;
        let of_levels = curve.observations.iter().zip(sd_db);
        let of_levels = of_levels.filter(|(row, _)| !row.is_censored());
        let sd_db: Vec<Option<f64>> = of_levels.map(|(_, sd_db)| *sd_db).collect();
        let mut points: Vec<Point> = curve
            .observations
            .iter()
            .filter(|row| row.theta_i_rad < GRAZING_RAD)
            .filter_map(|row| {
                let theta_rad = row.theta_i_rad;
                let i = Direction::from_angles(theta_rad, PI);
                let offset_db = db_from_ratio(4.0 * PI * i.cos_theta().powi(2));
                Some(Point {
                    i,
                    o: i,
                    theta_i_rad: theta_rad,
                    theta_s_rad: -theta_rad,
                    f_db: db_from_ratio(row.level_sigma0()?) - offset_db,
                    censored: row.is_censored(),
                    offset_db,
                    scan: 0,
                })
            })
            .collect();
        points.sort_by(|a, b| a.theta_i_rad.total_cmp(&b.theta_i_rad));
        let groups = points.chunk_by(|a, b| place(a.theta_i_rad) == place(b.theta_i_rad));
        let groups: Vec<Vec<Point>> = groups.map(<[Point]>::to_vec).collect();
        // Angles of single chirps coincide by chance.
        let are_repeats = points.len() >= 2 * groups.len();
        if !are_repeats || points.iter().any(|point| point.censored) {
            return Points::new(Kind::Backscatter, points, noise_db, stated(&sd_db));
        }
        Points::of_groups(Kind::Backscatter, groups, noise_db, stated(&sd_db))
    }

    /// The points of values in the plane of incidence; repeats become their mean level.
    pub fn in_plane(values: &[InPlane], noise_db: Option<f64>) -> Points {
        let sd_db: Vec<Option<f64>> = values.iter().map(|value| value.sd_db).collect();
        let mut places: BTreeMap<[i64; 2], Vec<Point>> = BTreeMap::new();
        for value in values {
            let key = [value.theta_i_rad, value.theta_s_rad].map(place);
            places.entry(key).or_default().push(point_in_plane(value));
        }
        let mut scan = None;
        for (key, group) in &mut places {
            let number = match scan {
                Some((incidence, number)) if incidence == key[0] => number,
                Some((_, number)) => number + 1,
                None => 0,
            };
            scan = Some((key[0], number));
            group.iter_mut().for_each(|point| point.scan = number);
        }
        Points::of_groups(Kind::InPlane, places.into_values().collect(), noise_db, stated(&sd_db))
    }

    /// The points of these groups of repeats, each the mean of its levels.
    fn of_groups(
        kind: Kind,
        groups: Vec<Vec<Point>>,
        noise_db: Option<f64>,
        stated: Option<Noise>,
    ) -> Points {
        let levels: Vec<Vec<f64>> =
            groups.iter().map(|group| group.iter().map(|point| point.f_db).collect()).collect();
        let points = groups.iter().filter_map(|group| mean_point(group)).collect();
        let has_repeats = levels.iter().any(|levels| levels.len() > 1);
        let of_file = repeats(&levels).or(stated);
        let repeats = if has_repeats { levels } else { Vec::new() };
        Points { repeats, ..Points::new(kind, points, noise_db, of_file) }
    }

    fn new(
        kind: Kind,
        points: Vec<Point>,
        noise_db: Option<f64>,
        of_file: Option<Noise>,
    ) -> Points {
        let noise = match noise_db {
            Some(sd_db) => Noise { sd_db, freedom: f64::INFINITY, source: NoiseSource::Declared },
            None => {
                let known = of_file.unwrap_or_else(|| Noise {
                    sd_db: neighbours(&points).unwrap_or(f64::INFINITY),
                    freedom: points.len() as f64,
                    source: NoiseSource::Neighbours,
                });
                Noise { sd_db: known.sd_db.max(LEAST_NOISE_DB), ..known }
            }
        };
        Points { kind, points, noise, repeats: Vec::new() }
    }

    /// Whether the noise is known, and not taken from the curve's own bends.
    pub fn has_known_noise(&self) -> bool {
        self.noise.source != NoiseSource::Neighbours
    }

    /// One of the repeats, from 0, by itself. One level scatters more than the mean of several.
    pub(super) fn repeat(&self, number: usize) -> Points {
        let (mut points, mut counts) = (Vec::new(), 0.0);
        for (point, levels) in self.points.iter().zip(&self.repeats) {
            if let Some(&f_db) = levels.get(number) {
                points.push(Point { f_db, ..*point });
                counts += levels.len() as f64;
            }
        }
        let more = (counts / points.len().max(1) as f64).sqrt();
        let noise = Noise { sd_db: more * self.noise.sd_db, ..self.noise };
        Points { kind: self.kind, points, noise, repeats: Vec::new() }
    }

    /// Two repeats that are of different levels throughout, if there are any.
    pub(super) fn contradiction(&self) -> Option<Contradiction> {
        /// Points that two repeats must share to be compared.
        const LEAST_SHARED: usize = 8;
        /// Standard errors of the mean difference, and its size, dB, from which on it is no chance.
        const ERRORS: f64 = 5.0;
        const LEAST_DB: f64 = 1.0;
        let most = self.repeats.iter().map(Vec::len).max().unwrap_or(0);
        let pairs = (0..most).flat_map(|a| (a + 1..most).map(move |b| [a, b]));
        let contradictions = pairs.filter_map(|[a, b]| {
            let both =
                self.repeats.iter().filter_map(|levels| Some(levels.get(b)? - levels.get(a)?));
            let off: Vec<f64> = both.collect();
            let count = off.len() as f64;
            let mean_db = off.iter().sum::<f64>() / count;
            let squares: f64 = off.iter().map(|db| (db - mean_db).powi(2)).sum();
            let scatter_db = (squares / (count - 1.0)).sqrt();
            let is_chance = mean_db.abs() < LEAST_DB.max(ERRORS * scatter_db / count.sqrt());
            (off.len() >= LEAST_SHARED && !is_chance).then_some(Contradiction {
                repeats: [a + 1, b + 1],
                apart_db: mean_db,
                scatter_db,
            })
        });
        contradictions.max_by(|a, b| a.apart_db.abs().total_cmp(&b.apart_db.abs()))
    }

    /// Measured less predicted levels, dB.
    pub(super) fn residuals_db(&self, levels_db: &[f64]) -> Vec<f64> {
        self.points.iter().zip(levels_db).map(|(point, db)| point.f_db - db).collect()
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

/// An angle as a key that rounding does not change.
fn place(angle_rad: f64) -> i64 {
    (angle_rad.to_degrees() * 1e4).round() as i64
}

/// A value in the plane of incidence as a point.
fn point_in_plane(value: &InPlane) -> Point {
    let side = if value.theta_s_rad < 0.0 { PI } else { 0.0 };
    Point {
        i: Direction::from_angles(value.theta_i_rad, PI),
        o: Direction::from_angles(value.theta_s_rad.abs(), side),
        theta_i_rad: value.theta_i_rad,
        theta_s_rad: value.theta_s_rad,
        f_db: db_from_ratio(value.f_per_sr),
        censored: false,
        offset_db: 0.0,
        scan: 0,
    }
}

/// Repeats of a point as one of their mean level.
fn mean_point(group: &[Point]) -> Option<Point> {
    let first = group.first()?;
    let sum: f64 = group.iter().map(|point| point.f_db).sum();
    Some(Point { f_db: sum / group.len() as f64, ..*first })
}

/// Noise of a mean of repeats, from the scatter of the levels of each point.
fn repeats(levels: &[Vec<f64>]) -> Option<Noise> {
    let (mut squares, mut spare, mut inverse) = (0.0, 0.0, 0.0);
    for levels in levels {
        let count = levels.len() as f64;
        let mean = levels.iter().sum::<f64>() / count;
        squares += levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>();
        spare += count - 1.0;
        inverse += 1.0 / count;
    }
    /// Degrees of freedom that a scatter needs.
    const LEAST_SPARE: f64 = 5.0;
    (spare >= LEAST_SPARE).then(|| Noise {
        sd_db: (squares / spare * inverse / levels.len() as f64).sqrt(),
        freedom: spare,
        source: NoiseSource::Repeats,
    })
}

/// Noise that the file states.
fn stated(sd_db: &[Option<f64>]) -> Option<Noise> {
    let known: Option<Vec<f64>> = sd_db.iter().copied().collect();
    let known = known.filter(|known| !known.is_empty())?;
    let square = known.iter().map(|sd| sd * sd).sum::<f64>() / known.len() as f64;
    Some(Noise { sd_db: square.sqrt(), freedom: f64::INFINITY, source: NoiseSource::File })
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
