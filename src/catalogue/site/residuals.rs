//! The residuals of a fit.

use super::curve::{class_of, ink, marks};
use super::entry::kind_of;
use super::picture::Picture;
use crate::brdf::{Scattering, ThroughBeam};
use crate::formats::figure::{Ink, Series, Style};
use crate::material::{Fit, Material, Observation};
use crate::measure::statistics::quantiles;
use crate::units::db_from_ratio;

/// More points than this hide each other, and are drawn as the bands that hold them.
const MANY: usize = 400;
/// Fewest points of a step of the angle that has a band.
const FEWEST: usize = 12;
/// Steps of the angle, °: the first that has points enough in the mean.
const STEPS_DEG: [f64; 3] = [1.0, 2.0, 5.0];
/// Shares of the points below the ends of the bands, and below their middle.
const SHARES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];
/// Stands for the end of a band of which no more is known than that it lies below a limit, dB.
const FAR_BELOW_DB: f64 = -1e3;

/// Backscatter of the fitted curve less the fit, dB, and what the picture says of itself; none where there is no
/// backscatter or no curve was fitted.
pub(super) fn picture(
    material: &Material,
    number: usize,
    fit: &Fit,
) -> Option<(String, &'static str)> {
    let name = fit.curve.as_ref()?;
    let curve = material.curves.iter().find(|curve| curve.name == *name)?;
    let law = ThroughBeam { law: &fit.model, beam_rad: material.beam_rad(fit) };
    let ratios: Vec<Observation> =
        curve.observations.iter().filter(|o| o.is_retro()).map(|o| over(o, &law)).collect();
    let place = material.curves.iter().position(|other| other.name == *name)?;
    let class = format!("{} {}", ink(place), class_of(kind_of(material, &curve.source)));
    let (drawn, caption) = match ratios.len() {
        0 => return None,
        1..=MANY => (points(&ratios), POINTS_CAPTION),
        _ => (bands(&ratios), BANDS_CAPTION),
    };
    let zero = Series {
        name: String::new(),
        style: Style::Guide,
        ink: Ink::Detections,
        points: vec![(0.0, 0.0), (90.0, 0.0)],
    };
    let mut series = vec![("zero".to_owned(), zero)];
    series.extend(drawn.into_iter().map(|one| (class.clone(), one)));
    let picture = Picture {
        id: format!("residuals-{number}"),
        title: format!("What the fit {} leaves of the curve {name}", fit.name),
        description: caption.to_owned(),
        y_label: "point − fit, dB",
        y_range: reach(&series),
        series,
    };
    Some((picture.svg(material)?, caption))
}

const POINTS_CAPTION: &str = "What the fit leaves: points of the curve less the fit. Triangles are limits less the \
                              fit: the truth lies where they point. A sound fit scatters evenly about 0.";
const BANDS_CAPTION: &str = "What the fit leaves: points of the curve less the fit. The line is their median, and the \
                             bands hold 50 % and 90 % of them. Points that were not detected count as below their \
                             limit; where a band ends in a limit, it goes on downwards. A sound fit leaves the median \
                             at 0.";

/// Around everything whose level is known, and 0.
fn reach(series: &[(String, Series)]) -> Option<(f64, f64)> {
    let levels = series.iter().flat_map(|(_, one)| &one.points).map(|point| point.1);
    let known = levels.filter(|level| level.is_finite() && *level > FAR_BELOW_DB);
    Some((known.clone().reduce(f64::min)?, known.reduce(f64::max)?))
}

/// A point over what a law says of it: σ⁰ and its limit as ratios.
fn over(o: &Observation, law: &ThroughBeam) -> Observation {
    let level = law.sigma0(o.theta_i_rad);
    Observation {
        sigma0: o.sigma0.map(|sigma0| sigma0 / level),
        threshold_sigma0: o.threshold_sigma0.map(|sigma0| sigma0 / level),
        ..*o
    }
}

/// Detections and limits one by one.
fn points(ratios: &[Observation]) -> Vec<Series> {
    let kinds = marks(ratios).into_iter();
    kinds.map(|(style, points)| series("residual", style, points)).collect()
}

fn series(name: &str, style: Style, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), style, ink: Ink::Detections, points }
}

/// Bands that hold nine tenths and half of the points of every step of the angle, and the median.
fn bands(ratios: &[Observation]) -> Vec<Series> {
    let mut sorted = ratios.to_vec();
    sorted.sort_by(|a, b| a.theta_i_rad.total_cmp(&b.theta_i_rad));
    let step_deg = STEPS_DEG
        .into_iter()
        .find(|step_deg| sorted.len() >= 2 * FEWEST * steps(&sorted, *step_deg).count())
        .unwrap_or(STEPS_DEG[2]);
    let mut rows: Vec<Row> = Vec::new();
    for step in steps(&sorted, step_deg).filter(|step| step.len() >= FEWEST) {
        let middle_deg = (step_of(&step[0], step_deg) as f64 + 0.5) * step_deg;
        rows.push((middle_deg, quantiles(step, SHARES).map(|ratio| ratio.map(db_from_ratio))));
    }
    let mut drawn = Vec::new();
    // Steps without points enough are gaps.
    for run in rows.chunk_by(|a, b| b.0 - a.0 < 1.5 * step_deg) {
        for [low, high] in [[0, 4], [1, 3]] {
            drawn.push(series("", Style::Band, outline(run, low, high)));
        }
    }
    for run in rows.chunk_by(|a, b| b.0 - a.0 < 1.5 * step_deg) {
        let median = run.iter().map(|(deg, levels)| (*deg, levels[2].unwrap_or(f64::NAN)));
        drawn.push(series("median residual", Style::Curve, median.collect()));
    }
    drawn
}

/// Middle of a step, °, and its quantiles, dB.
type Row = (f64, [Option<f64>; SHARES.len()]);

/// Points by steps of the angle; they are sorted by it.
fn steps(sorted: &[Observation], step_deg: f64) -> impl Iterator<Item = &[Observation]> {
    sorted.chunk_by(move |a, b| step_of(a, step_deg) == step_of(b, step_deg))
}

/// Along the lower quantile and back along the upper one, as far as that is known.
fn outline(run: &[Row], low: usize, high: usize) -> Vec<(f64, f64)> {
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    for (deg, levels) in run {
        let Some(high_db) = levels[high] else { continue };
        lower.push((*deg, levels[low].unwrap_or(FAR_BELOW_DB)));
        upper.push((*deg, high_db));
    }
    lower.extend(upper.into_iter().rev());
    lower
}

fn step_of(o: &Observation, step_deg: f64) -> u32 {
    // Degrees of a file come back from radians a little off.
    ((o.theta_i_rad.to_degrees() + 1e-9) / step_deg) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(theta_deg: f64, level_db: f64) -> Observation {
        let sigma0 = 10f64.powf(0.1 * level_db);
        Observation::backscatter(theta_deg.to_radians(), Some(sigma0), None)
    }

    #[test]
    fn bands_hold_their_share_and_points_below_a_limit_count_as_below_it() {
        let mut ratios = Vec::new();
        for step in 0..1000 {
            ratios.push(ratio(0.02 * f64::from(step), f64::from(37 * step % 101) * 0.1 - 5.0));
        }
        let drawn = bands(&ratios);
        let styles: Vec<Style> = drawn.iter().map(|one| one.style).collect();
        assert_eq!(styles, [Style::Band, Style::Band, Style::Curve]);
        // Levels of a step are even from −5 to 5 dB.
        let reach = |band: &Series| band.points.iter().map(|p| p.1).fold(0.0, f64::max);
        assert!((reach(&drawn[0]) - 4.5).abs() < 0.6 && (reach(&drawn[1]) - 2.5).abs() < 0.6);
        assert!(drawn[2].points.iter().all(|(_, level_db)| level_db.abs() < 0.6));
        // Most of the points at 30° were not detected: neither the median nor the lower ends are known.
        for number in 0..60 {
            let o = ratio(30.2, 6.0);
            ratios.push(if number < 40 {
                Observation {
                    sigma0: None,
                    threshold_sigma0: Some(1.0),
                    ..Observation::backscatter(o.theta_i_rad, None, Some(1.0))
                }
            } else {
                o
            });
        }
        let drawn = bands(&ratios);
        assert_eq!(drawn.len(), 6, "the gap up to 30° interrupts");
        let last = drawn.last().unwrap();
        assert!(last.points.iter().all(|(_, level_db)| level_db.is_nan()), "{:?}", last.points);
        assert_eq!(drawn[2].points[0].1, FAR_BELOW_DB);
    }
}
