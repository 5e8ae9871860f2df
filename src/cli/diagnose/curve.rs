//! `matdb diagnose --curve`: the same question for a measured curve.

use std::fmt::Write;
use std::path::Path;

use super::earlier::Earlier;
use super::plots::Picture;
use super::words::{fixed, listed, plus_minus, value};
use super::{Args, html, json};
use crate::brdf::Brdf;
use crate::cli::console::Console;
use crate::cli::effects::level;
use crate::cli::inputs::read_small;
use crate::cli::output::write_all;
use crate::diagnose::curve::{
    CurveDiagnoseError, CurveDiagnosis, CurveFound, CurveReport, CurveRow, CurveUnknown, Kind,
    NoiseSource, Points, Term, base_law, term, terms,
};
use crate::diagnose::{SCHEMA, Verdict};
use crate::error::Error;
use crate::fit::{model, model_names};
use crate::formats::figure::{FigureError, Plot, Series, Style};
use crate::formats::text::nearest;
use crate::measure::{Curve, in_plane};

/// Diagnoses the curve of a file.
pub(super) fn run(path: &Path, args: &Args, console: &Console) -> Result<(), Error> {
    let points = read(path, args.noise_db)?;
    let law = law(args.model.as_deref())?;
    let terms = chosen(&args.effects)?;
    let name = path.display().to_string();
    let diagnosis = CurveDiagnosis { seed: args.seed, ..CurveDiagnosis::default() };
    match diagnosis.run(&points, &law, &terms) {
        Ok(report) => publish(&report, &name, &args.output, console),
        Err(error) => refuse(error, name, &args.output, console),
    }
}

fn read(path: &Path, noise_db: Option<f64>) -> Result<Points, Error> {
    let bytes = read_small(path).map_err(|reason| Error::Io {
        verb: "read",
        path: path.to_owned(),
        reason,
        way_out: "check the path",
    })?;
    let refused = |error| Error::CurveFile { file: path.to_owned(), error };
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bsdf")) {
        return Ok(Points::in_plane(&in_plane::read_bsdf(&bytes).map_err(refused)?, noise_db));
    }
    if in_plane::is_table(&bytes) {
        return Ok(Points::in_plane(&in_plane::read_table(&bytes).map_err(refused)?, noise_db));
    }
    Ok(Points::backscatter(&Curve::read(&bytes).map_err(refused)?, noise_db))
}

fn law(name: Option<&str>) -> Result<Brdf, Error> {
    let Some(name) = name else { return Ok(base_law()) };
    model(name).ok_or_else(|| {
        let names: Vec<&str> = model_names().collect();
        unknown("model", name, &names)
    })
}

fn chosen(names: &[String]) -> Result<Vec<&'static dyn Term>, Error> {
    if names.is_empty() {
        return Ok(terms().to_vec());
    }
    let known: Vec<&str> = terms().iter().map(|term| term.name()).collect();
    names.iter().map(|name| term(name).ok_or_else(|| unknown("effect", name, &known))).collect()
}

fn unknown(what: &str, name: &str, known: &[&str]) -> Error {
    let way_out = match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("choose {}", known.join(", ")),
    };
    Error::Usage { problem: format!("a curve has no {what} `{name}`"), way_out }
}

fn publish(
    report: &CurveReport,
    name: &str,
    folder: &Path,
    console: &Console,
) -> Result<(), Error> {
    let picture = picture(report)?;
    let [svg, png] = picture.files()?;
    let files = [
        ("report.html".to_owned(), html::curve::report(report, name, &picture)?),
        ("report.json".to_owned(), json(report)?),
        ("residuals.csv".to_owned(), csv(&report.rows)),
        svg,
        png,
    ];
    let earlier = Earlier::in_folder(folder, &[Path::new(name)]);
    write_all(folder, &files)?;
    earlier.remove_all_but(&files, console);
    console.result(&text(report, folder), report)
}

/// Writes that nothing can be said, and why; the error is the way out.
fn refuse(
    error: CurveDiagnoseError,
    curve: String,
    folder: &Path,
    console: &Console,
) -> Result<(), Error> {
    let answer = serde_json::json!({
        "schema": SCHEMA,
        "verdict": "cannot-tell",
        "reason": error.to_string(),
        "would_help": WOULD_HELP,
        "effects": [],
    });
    let page = html::curve::cannot_tell(&curve, &error.to_string(), WOULD_HELP);
    let files = [("report.html", page), ("report.json", json(&answer)?)];
    let earlier = Earlier::in_folder(folder, &[Path::new(&curve)]);
    write_all(folder, &files)?;
    earlier.remove_all_but(&files, console);
    if console.json {
        console.result("", &answer)?;
    }
    Err(Error::CurveDiagnosis { curve, error })
}

const WOULD_HELP: &str = "More angles, or the same ones at more angles of incidence: runs of \
                          neighbouring angles are held out together, and several of them are needed.";

/// Every level as a line.
fn csv(rows: &[CurveRow]) -> Vec<u8> {
    let mut text =
        "theta_i_deg,theta_s_deg,observed_db,censored,before_db,after_db,fold,block\n".to_owned();
    for row in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:.4},{:.4},{:.4},{},{:.4},{:.4},{},{}",
            row.theta_i_deg,
            row.theta_s_deg,
            row.observed_db,
            u8::from(row.censored),
            row.before_db,
            row.after_db,
            row.fold,
            row.block
        );
    }
    text.into_bytes()
}

/// Most scans that are drawn, and those in a row.
const MOST_SCANS: usize = 12;
const IN_A_ROW: usize = 4;

/// Every scan with both models, and what they leave below it.
fn picture(report: &CurveReport) -> Result<Picture, FigureError> {
    let scans: Vec<&[CurveRow]> =
        report.rows.chunk_by(|a, b| a.scan == b.scan).take(MOST_SCANS).collect();
    let columns = scans.len().clamp(1, IN_A_ROW);
    let errors = report.rows.iter().filter(|row| !row.censored);
    let reach_db = errors.map(|row| (row.observed_db - row.before_db).abs()).fold(0.5, f64::max);
    let mut panels = Vec::new();
    for row in scans.chunks(columns) {
        for scan in row {
            panels.push(levels(report, scan).drawing()?);
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

/// Names and levels of the models that a picture shows.
fn models(report: &CurveReport) -> Vec<(&'static str, LevelDb)> {
    match report.effects.is_empty() {
        true => vec![("base law", |row| row.before_db)],
        false => vec![("before", |row| row.before_db), ("after", |row| row.after_db)],
    }
}

fn labels(report: &CurveReport) -> [&'static str; 2] {
    match report.curve.kind {
        Kind::Backscatter => ["incidence θ, °", "σ⁰, dB"],
        Kind::InPlane => ["receiver θ_s, °", "f, dB(1/sr)"],
    }
}

fn levels<'a>(report: &CurveReport, scan: &[CurveRow]) -> Plot<'a> {
    let of = |censored: bool, level: fn(&CurveRow) -> f64| {
        let rows = scan.iter().filter(move |row| row.censored == censored);
        rows.map(|row| (angle_deg(report, row), level(row))).collect::<Vec<_>>()
    };
    let mut series = vec![Series {
        name: "measured".to_owned(),
        style: Style::Points,
        points: of(false, |row| row.observed_db),
    }];
    let below = of(true, |row| row.observed_db);
    if !below.is_empty() {
        let name = "not detected".to_owned();
        series.push(Series { name, style: Style::Below, points: below });
    }
    for (name, level) in models(report) {
        let points = scan.iter().map(|row| (angle_deg(report, row), level(row))).collect();
        series.push(Series { name: name.to_owned(), style: Style::Curve, points });
    }
    let [x_label, y_label] = labels(report);
    let title = match (report.curve.kind, scan.first()) {
        (Kind::InPlane, Some(row)) => INCIDENCES.get(row.scan).copied().unwrap_or("One incidence"),
        _ => "Curve",
    };
    Plot {
        title,
        subtitle: "",
        x_label,
        y_label,
        x_range: None,
        y_range: None,
        equal: false,
        series,
    }
}

const INCIDENCES: [&str; MOST_SCANS] = [
    "1st incidence",
    "2nd incidence",
    "3rd incidence",
    "4th incidence",
    "5th incidence",
    "6th incidence",
    "7th incidence",
    "8th incidence",
    "9th incidence",
    "10th incidence",
    "11th incidence",
    "12th incidence",
];

fn residuals<'a>(report: &CurveReport, scan: &[CurveRow], reach_db: f64) -> Plot<'a> {
    let ends = [scan.first(), scan.last()].map(|row| row.map_or(0.0, |row| angle_deg(report, row)));
    let guide = Series {
        name: String::new(),
        style: Style::Guide,
        points: ends.map(|x| (x, 0.0)).to_vec(),
    };
    let mut series = vec![guide];
    for (name, level) in models(report) {
        let seen = scan.iter().filter(|row| !row.censored);
        let left = |row: &CurveRow| (angle_deg(report, row), row.observed_db - level(row));
        let points = seen.map(left).collect();
        series.push(Series { name: name.to_owned(), style: Style::Curve, points });
    }
    let [x_label, _] = labels(report);
    Plot {
        title: "",
        subtitle: "",
        x_label,
        y_label: "measured − predicted, dB",
        x_range: None,
        y_range: Some((-reach_db, reach_db)),
        equal: false,
        series,
    }
}

/// The verdict in a sentence.
pub(super) fn sentence(report: &CurveReport) -> String {
    let names: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
    let names = listed(&names);
    match (report.verdict, report.effects.is_empty()) {
        (Verdict::Explained, _) => {
            format!("the law lacks {names}; with that, what is left is noise")
        }
        (Verdict::Unexplained, false) => format!(
            "the law lacks {names}, which the curve supports, and something unknown remains that no \
             effect that was tried explains"
        ),
        (Verdict::Unexplained, true) => {
            "the law does not explain the curve, and no effect that was tried does: what remains is \
             unknown"
                .to_owned()
        }
        _ => "the law explains the curve, and nothing that is tested for remains".to_owned(),
    }
}

pub(super) fn verdict(report: &CurveReport) -> &'static str {
    match report.verdict {
        Verdict::Explained => "explained",
        Verdict::Unexplained => "unexplained",
        _ => "nothing is missing",
    }
}

/// How the noise is known.
pub(super) fn source(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Declared => "declared",
        NoiseSource::Repeats => "from repeats",
        NoiseSource::File => "stated in the file",
        NoiseSource::Neighbours => "estimated from neighbouring angles",
    }
}

/// What remains, in words.
pub(super) fn remains(unknown: &CurveUnknown) -> String {
    let gain = match (unknown.held_out_gain, unknown.held_out_se, unknown.held_out_rmse_db) {
        (Some(gain), Some(se), Some(rmse_db)) => format!(
            " (a smooth curve over it gains {} in held-out ln p and leaves {rmse_db:.2} dB)",
            plus_minus(gain, se)
        ),
        _ => String::new(),
    };
    format!("unknown: {:.2} dB with {}{gain}", unknown.strength_db, unknown.covariate)
}

/// Numbers of a term.
pub(super) fn numbers(found: &CurveFound) -> String {
    let number =
        |(name, number): (&&str, &crate::diagnose::Value)| format!("{name} = {}", value(number));
    found.parameters.iter().map(number).collect::<Vec<_>>().join(", ")
}

fn text(report: &CurveReport, folder: &Path) -> String {
    let mut text = format!("{}: {}\n", verdict(report), sentence(report));
    for found in &report.effects {
        let others: Vec<&str> =
            found.class.iter().copied().filter(|name| *name != found.name).collect();
        text += &format!(
            "  {} ({}): {}\n    held-out gain in ln p {}, changes the levels by {:.2} dB\n",
            found.name,
            level(found.level),
            numbers(found),
            plus_minus(found.evidence.held_out_gain, found.evidence.held_out_se),
            found.evidence.size_db
        );
        if !others.is_empty() {
            text += &format!("    this curve cannot tell it from {}\n", listed(&others));
        }
    }
    let error = &report.error;
    text += &format!(
        "error on held-out angles: {} → {} dB rms (noise {} dB, {})\n",
        fixed(error.before.rmse_db, 2),
        fixed(error.after.rmse_db, 2),
        fixed(error.noise_floor_db, 2),
        source(error.noise_source)
    );
    match report.unexplained.is_empty() {
        true => text += "what remains: nothing that is tested for\n",
        false => report.unexplained.iter().for_each(|one| text += &format!("  {}\n", remains(one))),
    }
    text + &format!(
        "wrote report.html, report.json, residuals.csv, curve.svg and curve.png to {}\n",
        folder.display()
    )
}
