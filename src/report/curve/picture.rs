//! The curve with the models before and after, and their residuals.

use crate::diagnose::curve::{CurveReport, CurveRow, Kind};
use crate::formats::figure::{FigureError, Ink, Plot, Series, Style};
use crate::formats::words::digits;
use crate::report::picture::Picture;

/// Most scans that are drawn, and those in a row.
const MOST_SCANS: usize = 12;
const IN_A_ROW: usize = 4;

/// Every scan with the models before and after, and their residuals below it.
pub(super) fn picture(report: &CurveReport) -> Result<Picture, FigureError> {
    let scans: Vec<&[CurveRow]> =
        report.rows.chunk_by(|a, b| a.scan == b.scan).take(MOST_SCANS).collect();
    let columns = scans.len().clamp(1, IN_A_ROW);
    let errors = report.rows.iter().filter(|row| !row.censored);
    let reach_db = errors.map(|row| (row.observed_db - row.before_db).abs()).fold(0.5, f64::max);
    let mut panels = Vec::new();
    for row in scans.chunks(columns) {
        for scan in row {
            panels.push(levels(report, scan, &title(report, scan)).drawing()?);
        }
        // An empty place of a last row would pull residuals up beside their levels.
        panels.extend((row.len()..columns).map(|_| Default::default()));
        for scan in row {
            panels.push(residuals(report, scan, 1.1 * reach_db).drawing()?);
        }
        panels.extend((row.len()..columns).map(|_| Default::default()));
    }
    Ok(Picture {
        file: "curve",
        title: "The curve before and after",
        caption: "Measured levels, and those of the base law (before) and of the law with what was \
                  added (after); below, measured − predicted. Every level is predicted by a fit that it \
                  took no part in, so that the curves can jump where a run of angles ends. Triangles \
                  point down to what was not detected."
            .to_owned(),
        panels,
        columns,
    })
}

fn angle_deg(report: &CurveReport, row: &CurveRow) -> f64 {
    match report.curve.kind {
        Kind::Backscatter => row.theta_i_deg,
        Kind::InPlane => row.theta_s_deg,
    }
}

/// A model's level in a row, dB.
type LevelDb = fn(&CurveRow) -> f64;

/// Names, inks and levels of the models that a picture shows.
fn models(report: &CurveReport) -> Vec<(&'static str, Ink, LevelDb)> {
    if report.effects.is_empty() {
        vec![("base law", Ink::Before, |row| row.before_db)]
    } else {
        vec![
            ("before", Ink::Before, |row| row.before_db),
            ("after", Ink::After, |row| row.after_db),
        ]
    }
}

fn labels(report: &CurveReport) -> [&'static str; 2] {
    match report.curve.kind {
        Kind::Backscatter => ["incidence θ, °", "σ⁰, dB"],
        Kind::InPlane => ["receiver θ_s, °", "f, dB(1/sr)"],
    }
}

fn title(report: &CurveReport, scan: &[CurveRow]) -> String {
    match (report.curve.kind, scan.first()) {
        (Kind::InPlane, Some(row)) => format!("Incidence {}°", digits(row.theta_i_deg)),
        _ => "Curve".to_owned(),
    }
}

fn levels<'a>(report: &CurveReport, scan: &[CurveRow], title: &'a str) -> Plot<'a> {
    let (mut seen, mut below) = (Vec::new(), Vec::new());
    for row in scan {
        let points = if row.censored { &mut below } else { &mut seen };
        points.push((angle_deg(report, row), row.observed_db));
    }
    let ink = Ink::Detections;
    let mut series =
        vec![Series { name: "measured".to_owned(), style: Style::Points, ink, points: seen }];
    if !below.is_empty() {
        let name = "not detected".to_owned();
        series.push(Series { name, style: Style::Below, ink, points: below });
    }
    for (name, ink, level) in models(report) {
        let points = scan.iter().map(|row| (angle_deg(report, row), level(row))).collect();
        series.push(Series { name: name.to_owned(), style: Style::Curve, ink, points });
    }
    let [x_label, y_label] = labels(report);
    Plot { title, x_label, y_label, series, ..Plot::default() }
}

fn residuals<'a>(report: &CurveReport, scan: &[CurveRow], reach_db: f64) -> Plot<'a> {
    let ends = [scan.first(), scan.last()].map(|row| row.map_or(0.0, |row| angle_deg(report, row)));
    let guide = Series {
        name: String::new(),
        style: Style::Guide,
        ink: Ink::Detections,
        points: ends.map(|x| (x, 0.0)).to_vec(),
    };
    let mut series = vec![guide];
    for (name, ink, level) in models(report) {
        let mut points = Vec::new();
        for row in scan.iter().filter(|row| !row.censored) {
            points.push((angle_deg(report, row), row.observed_db - level(row)));
        }
        series.push(Series { name: name.to_owned(), style: Style::Curve, ink, points });
    }
    let [x_label, _] = labels(report);
    Plot {
        x_label,
        y_label: "measured − predicted, dB",
        y_range: Some((-reach_db, reach_db)),
        series,
        ..Plot::default()
    }
}
