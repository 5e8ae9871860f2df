//! `matdb diagnose --curve`: the same question for a measured curve.

mod picture;
pub(super) mod words;

use std::fmt::Write;
use std::path::Path;

use super::cannot_tell::CannotTell;
use super::earlier::{self, Earlier};
use super::tried::{NotTried, of_curve};
use super::{Args, Record, html, json};
use crate::brdf::Brdf;
use crate::cli::console::Console;
use crate::cli::effects::each_once;
use crate::diagnose::curve::{
    CurveDiagnoseError, CurveDiagnosis, CurveReport, CurveRow, Points, Term, base_law, term, terms,
};
use crate::error::Error;
use crate::files::read_small;
use crate::files::write_all;
use crate::fit::{model, model_names};
use crate::formats::text::nearest;
use crate::measure::{Curve, in_plane};
use picture::picture;
use words::text;

/// Diagnoses the curve of a file.
pub(super) fn run(path: &Path, args: &Args, console: &Console) -> Result<(), Error> {
    earlier::check(&args.output, &[path], &[])?;
    let points = read(path, args.noise_db)?;
    let law = law(args.model.as_deref())?;
    let terms = chosen(&args.effects)?;
    let name = path.display().to_string();
    let diagnosis = CurveDiagnosis { seed: args.seed, ..CurveDiagnosis::default() };
    match diagnosis.run(&points, &law, &terms) {
        Ok(report) => {
            let not_tried = of_curve(&terms);
            let model = args.model.as_deref();
            let (report, name, not_tried) = (&report, name.as_str(), not_tried.as_slice());
            let told = Told { report, name, model, seed: args.seed, not_tried };
            publish(told, &args.output, console)
        }
        Err(error) => refuse(error, name, &args.output, console),
    }
}

fn read(path: &Path, noise_db: Option<f64>) -> Result<Points, Error> {
    let bytes = read_small(path)?;
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
    each_once(names).map(|name| term(name).ok_or_else(|| unknown("effect", name, &known))).collect()
}

fn unknown(what: &str, name: &str, known: &[&str]) -> Error {
    let way_out = match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("choose {}", known.join(", ")),
    };
    Error::Usage { problem: format!("a curve has no {what} `{name}`"), way_out }
}

/// A diagnosis and what it was asked.
#[derive(Clone, Copy)]
pub(super) struct Told<'a> {
    pub report: &'a CurveReport,
    /// The curve's file.
    pub name: &'a str,
    /// The law, where one was named.
    pub model: Option<&'a str>,
    pub seed: u64,
    pub not_tried: &'a [NotTried],
}

fn publish(told: Told, folder: &Path, console: &Console) -> Result<(), Error> {
    let Told { report, name, not_tried, .. } = told;
    let picture = picture(report)?;
    let [svg, png] = picture.files()?;
    let record = Record { report, not_tried };
    let files = [
        ("report.html".to_owned(), html::curve::report(told, &picture)?),
        ("report.json".to_owned(), json(&record)?),
        ("residuals.csv".to_owned(), csv(&report.rows)),
        svg,
        png,
    ];
    let earlier = Earlier::in_folder(folder, &[Path::new(name)]);
    write_all(folder, &files)?;
    earlier.remove_all_but(&files, console);
    console.result(&text(told, folder), &record)
}

/// Writes that nothing can be said, and why; the error is the way out.
fn refuse(
    error: CurveDiagnoseError,
    curve: String,
    folder: &Path,
    console: &Console,
) -> Result<(), Error> {
    let answer = CannotTell::new(error.to_string(), would_help(&error).to_owned());
    let page = html::cannot_tell(&answer, &format!("the curve {curve}"));
    let files = [("report.html", page), ("report.json", json(&answer)?)];
    let earlier = Earlier::in_folder(folder, &[Path::new(&curve)]);
    write_all(folder, &files)?;
    earlier.remove_all_but(&files, console);
    if console.json {
        console.result("", &answer)?;
    }
    Err(Error::CurveDiagnosis { curve, error })
}

fn would_help(error: &CurveDiagnoseError) -> &'static str {
    match error {
        CurveDiagnoseError::TooFew { .. } | CurveDiagnoseError::TooShort { .. } => {
            "More angles, or the same ones at more angles of incidence: runs of neighbouring angles are \
             held out together, and several of them are needed."
        }
        CurveDiagnoseError::Noise { .. } | CurveDiagnoseError::Noiseless => {
            "The scatter of a level, in dB: by --noise-db, from repeats, or told from neighbouring angles, of \
             which every incidence has three or more."
        }
        CurveDiagnoseError::Fit(_) => "Another law to begin from, by --model.",
    }
}

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
