//! Residuals over the covariates that they could depend on.

use super::models::{names, shown};
use crate::diagnose::{Report, Row};
use crate::formats::figure::{FigureError, Plot, Series, Style};
use crate::report::picture::{Picture, guide};
use crate::units::{db_from_ratio, dbm_from_watts};

/// Bins of as many detections each.
const BINS: usize = 16;
/// Panels: the angle, and the covariates on which the residual of the base model depends most.
const PANELS: usize = 4;

/// A covariate: its name, and its value for a shot.
struct Covariate {
    name: &'static str,
    label: &'static str,
    of: fn(&Row) -> f64,
}

const COVARIATES: [Covariate; 9] = [
    Covariate { name: "Angle", label: "incidence θ, °", of: |row| row.theta_rad.to_degrees() },
    Covariate {
        name: "Azimuth",
        label: "azimuth of the radar about the normal, °",
        of: |row| row.azimuth_rad.to_degrees(),
    },
    Covariate { name: "Range", label: "range, m", of: |row| row.range_m },
    Covariate { name: "Place, x", label: "x in the target plane, m", of: |row| row.xt_m },
    Covariate { name: "Place, y", label: "y in the target plane, m", of: |row| row.yt_m },
    Covariate {
        name: "Off the centre",
        label: "distance from the centre of the field of view, m",
        of: |row| row.xt_m.hypot(row.yt_m),
    },
    Covariate { name: "Edge", label: "distance from the nearest edge, m", of: |row| row.edge_m },
    Covariate { name: "Time", label: "time, s", of: |row| row.time_s },
    Covariate {
        name: "Power",
        label: "power predicted by the base model, dBm",
        of: |row| dbm_from_watts(row.before_w),
    },
];

/// One bin: mean of the covariate, mean of the residual and its standard error, dB.
struct Bin {
    at: f64,
    mean_db: f64,
    se_db: f64,
}

/// A covariate with the residuals before and after in bins of it.
struct Trend {
    covariate: &'static Covariate,
    before: Vec<Bin>,
    after: Vec<Bin>,
}

pub(super) fn picture(report: &Report) -> Result<Picture, FigureError> {
    let trends = trends(&report.rows);
    let mut reach_db: f64 = 0.5;
    for bin in trends.iter().flat_map(|trend| trend.before.iter().chain(&trend.after)) {
        reach_db = reach_db.max(bin.mean_db.abs() + bin.se_db);
    }
    reach_db *= 1.08;
    let mut panels = Vec::new();
    for trend in &trends {
        panels.push(plot(report, trend, reach_db).drawing()?);
    }
    Ok(Picture {
        file: "residual-trends",
        title: "Residual against the covariates",
        caption: "Mean of observed − predicted power and its standard error in bins of equally many \
                  detections: over the angle, and over what the base model's \
                  residual depends on most. A model that is right stays at 0. The bars take looks for \
                  independent; where spots overlap they are too short."
            .to_owned(),
        panels,
        columns: 2,
    })
}

/// The trends that are drawn: the one over the angle first, then the strongest before.
fn trends(rows: &[Row]) -> Vec<Trend> {
    let mut trends = Vec::new();
    for covariate in &COVARIATES {
        let before = bins(rows, covariate.of, |row| row.before_w);
        let after = bins(rows, covariate.of, |row| row.after_w);
        if before.len() > 2 {
            trends.push(Trend { covariate, before, after });
        }
    }
    let first = usize::from(trends.iter().any(|trend| trend.covariate.name == "Angle"));
    if let Some(others) = trends.get_mut(first..) {
        others.sort_by(|a, b| strength(&b.before).total_cmp(&strength(&a.before)));
    }
    trends.truncate(PANELS);
    trends
}

fn plot<'a>(report: &Report, trend: &'a Trend, reach_db: f64) -> Plot<'a> {
    let [from, to] =
        [trend.before.first(), trend.before.last()].map(|bin| bin.map_or(0.0, |bin| bin.at));
    let room = 0.04 * (to - from);
    let mut series = vec![guide("", [from - room, to + room], |_| 0.0)];
    let models = [&trend.before, &trend.after];
    for (bins, (name, ink)) in shown(report, models).into_iter().zip(names(report)) {
        let (mut points, mut bars) = (Vec::new(), Vec::new());
        for bin in bins {
            points.push((bin.at, bin.mean_db));
            bars.push((bin.at, bin.mean_db - bin.se_db));
            bars.push((bin.at, bin.mean_db + bin.se_db));
        }
        let name = name.to_owned();
        series.push(Series { name: name.clone(), style: Style::ErrorBars, ink, points: bars });
        series.push(Series { name, style: Style::Points, ink, points });
    }
    Plot {
        title: trend.covariate.name,
        x_label: trend.covariate.label,
        y_label: "observed − predicted, dB",
        x_range: (from < to).then_some((from - room, to + room)),
        y_range: Some((-reach_db, reach_db)),
        series,
        ..Plot::default()
    }
}

/// How much a residual depends on a covariate: the mean of (mean/se)² over the bins.
fn strength(bins: &[Bin]) -> f64 {
    let squares = bins.iter().map(|bin| (bin.mean_db / bin.se_db.max(1e-9)).powi(2));
    squares.sum::<f64>() / bins.len().max(1) as f64
}

/// Detections in bins of equally many; what has the same covariate stays together.
fn bins(rows: &[Row], of: fn(&Row) -> f64, predicted_w: fn(&Row) -> f64) -> Vec<Bin> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for row in rows {
        let ratio = row.observed_w.map(|observed_w| observed_w / predicted_w(row));
        points.extend(ratio.map(|ratio| (of(row), db_from_ratio(ratio))));
    }
    points.retain(|(at, residual_db)| at.is_finite() && residual_db.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = points.len().div_ceil(BINS).max(1);
    let mut bins = Vec::new();
    let mut rest = points.as_slice();
    while let Some(&(last, _)) = rest.get(size - 1).or(rest.last()) {
        let [before, end] =
            [rest.partition_point(|p| p.0 < last), rest.partition_point(|p| p.0 <= last)];
        // Many equal values are a bin of their own, if what comes before them is enough for one.
        let early = before >= size / 4 && size.saturating_sub(before) < end.saturating_sub(size);
        let end = if early { before } else { end };
        let (bin, others) = rest.split_at(end);
        // A remainder of a few would have a bar over the whole page.
        if others.len() < size / 2 {
            bins.extend(bin_of(rest));
            break;
        }
        bins.extend(bin_of(bin));
        rest = others;
    }
    bins
}

fn bin_of(points: &[(f64, f64)]) -> Option<Bin> {
    let count = points.len() as f64;
    let at = points.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_db = points.iter().map(|p| p.1).sum::<f64>() / count;
    let squares: f64 = points.iter().map(|p| (p.1 - mean_db).powi(2)).sum();
    (points.len() > 1).then(|| Bin { at, mean_db, se_db: (squares / (count - 1.0) / count).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::cloud::testing::row;
    use crate::units::watts_from_dbm;

    #[test]
    fn bins_have_the_mean_and_standard_error_of_their_shots() {
        let look = |i: u32| Row {
            time_s: f64::from(i / 100),
            observed_w: Some(watts_from_dbm(
                -60.0 + 0.1 * f64::from(i / 100) + if i.is_multiple_of(2) { 1.0 } else { -1.0 },
            )),
            ..row()
        };
        let mut rows: Vec<Row> = (0..1600).map(look).collect();
        rows.push(Row { observed_w: None, ..look(0) });
        let bins = bins(&rows, |row| row.time_s, |row| row.before_w);
        assert_eq!(bins.len(), 16);
        for (second, bin) in (0..16).zip(&bins) {
            assert_eq!(bin.at, f64::from(second));
            assert!((bin.mean_db - 0.1 * f64::from(second)).abs() < 1e-9);
            assert!((bin.se_db - (1.0 / 99f64).sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn equal_values_share_a_bin() {
        let look = |i: u32| Row { edge_m: if i < 50 { 0.01 } else { 0.048 }, ..row() };
        let rows: Vec<Row> = (0..1000).map(look).collect();
        assert_eq!(bins(&rows, |row| row.edge_m, |row| row.before_w).len(), 2);
    }
}
