//! A measured curve as points in the order of its scans, and the noise of its levels.
//!
//! The noise is the first of these that is known: the value that the caller declares, the scatter of repeats, the
//! value that the file states, the scatter of a point about the line through its two neighbours. The last one takes every
//! bend of the curve between them for noise and is an upper bound on coarse scans.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::Serialize;

use crate::frames::{Direction, Surface};
use crate::measure::Curve;
use crate::measure::in_plane::InPlane;
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

/// Least noise of a file, dB: files round.
const LEAST_NOISE_DB: f64 = 0.01;
/// Quantile of the deviations that gives the noise: twice as precise as the median, and insensitive to a few bends.
const BELOW: f64 = 0.8;
/// That quantile of the absolute value of a standard normal number.
const SIZE: f64 = 1.2816;

impl Points {
    /// The points of a backscatter curve. Rows at grazing incidence, where σ⁰ does not determine f, are left out.
    pub fn backscatter(curve: &Curve, noise_db: Option<f64>) -> Points {
        const GRAZING_RAD: f64 = 1.569;
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
        Points::new(Kind::Backscatter, points, noise_db, None)
    }

    /// The points of values in the plane of incidence; repeats become their mean level.
    pub fn in_plane(values: &[InPlane], noise_db: Option<f64>) -> Points {
        let mut places: BTreeMap<[i64; 2], Vec<&InPlane>> = BTreeMap::new();
        for value in values {
            let place = [value.theta_i_rad, value.theta_s_rad]
                .map(|angle_rad| (angle_rad.to_degrees() * 1e4).round() as i64);
            places.entry(place).or_default().push(value);
        }
        let (mut points, mut levels) = (Vec::<Point>::new(), Vec::new());
        let mut scan = None;
        for (place, values) in &places {
            if let Some(point) = mean_point(values) {
                let number = match scan {
                    Some((incidence, number)) if incidence == place[0] => number,
                    Some((_, number)) => number + 1,
                    None => 0,
                };
                scan = Some((place[0], number));
                points.push(Point { scan: number, ..point });
                levels.push(values.iter().map(|one| db_from_ratio(one.f_per_sr)).collect());
            }
        }
        let of_file = repeats(&places).or_else(|| stated(values));
        let levels = if values.len() > places.len() { levels } else { Vec::new() };
        Points { repeats: levels, ..Points::new(Kind::InPlane, points, noise_db, of_file) }
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

/// Repeats of one pair of angles as a point of their mean level.
fn mean_point(values: &[&InPlane]) -> Option<Point> {
    let first = values.first()?;
    let side = if first.theta_s_rad < 0.0 { PI } else { 0.0 };
    let levels = values.iter().map(|value| db_from_ratio(value.f_per_sr));
    Some(Point {
        i: Direction::from_angles(first.theta_i_rad, PI),
        o: Direction::from_angles(first.theta_s_rad.abs(), side),
        theta_i_rad: first.theta_i_rad,
        theta_s_rad: first.theta_s_rad,
        f_db: levels.sum::<f64>() / values.len() as f64,
        censored: false,
        offset_db: 0.0,
        scan: 0,
    })
}

/// Noise of a mean of repeats, from their scatter.
fn repeats(places: &BTreeMap<[i64; 2], Vec<&InPlane>>) -> Option<Noise> {
    let (mut squares, mut spare, mut inverse) = (0.0, 0.0, 0.0);
    for values in places.values() {
        let levels: Vec<f64> = values.iter().map(|value| db_from_ratio(value.f_per_sr)).collect();
        let count = levels.len() as f64;
        let mean = levels.iter().sum::<f64>() / count;
        squares += levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>();
        spare += count - 1.0;
        inverse += 1.0 / count;
    }
    /// Degrees of freedom that a scatter needs.
    const LEAST_SPARE: f64 = 5.0;
    (spare >= LEAST_SPARE).then(|| Noise {
        sd_db: (squares / spare * inverse / places.len() as f64).sqrt(),
        freedom: spare,
        source: NoiseSource::Repeats,
    })
}

/// Noise that the file states.
fn stated(values: &[InPlane]) -> Option<Noise> {
    let known: Option<Vec<f64>> = values.iter().map(|value| value.sd_db).collect();
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
