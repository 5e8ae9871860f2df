//! `matdb diagnose --curve FILE`.

use std::path::Path;

use super::args::Args;
use super::refusal::write_refusal;
use crate::adopt::{Earlier, check_folder};
use crate::cli::console::Console;
use crate::diagnose::curve::{CurveDiagnoseError, CurveReport, Term};
use crate::error::Error;
use crate::files::{read_small, write_all};
use crate::report::{
    CannotTell, CurveAnswer, CurveRequest, curve_law, curve_terms, terms_not_asked,
};

/// Diagnoses the curve of a file and writes the answer.
pub(super) fn run(path: &Path, args: &Args, console: &Console) -> Result<(), Error> {
    check_folder(&args.output, &[path], &[])?;
    let bytes = read_small(path)?;
    let law = args.model.as_deref().map(curve_law).transpose()?;
    let effects = curve_terms(&args.effects)?;
    let request = CurveRequest {
        path,
        columns: &args.columns.names(),
        law: law.as_ref(),
        noise_db: args.noise_db,
        effects: &effects,
        seed: args.seed,
    };
    let activity = console.activity("diagnosing");
    let diagnosed = request.diagnose(&bytes);
    activity.end();
    match diagnosed {
        Ok((report, notices)) => {
            notices.iter().for_each(|notice| console.notice(notice));
            publish(&report, path, &effects, args, console)
        }
        Err(Error::CurveDiagnosis { error, .. }) => refuse(error, path, &args.output, console),
        Err(other) => Err(other),
    }
}

fn publish(
    report: &CurveReport,
    path: &Path,
    effects: &[&'static dyn Term],
    args: &Args,
    console: &Console,
) -> Result<(), Error> {
    let answer = CurveAnswer {
        report,
        name: &path.display().to_string(),
        model: args.model.as_deref(),
        seed: args.seed,
        not_tried: &terms_not_asked(effects),
    };
    let files = answer.files()?;
    let earlier = Earlier::in_folder(&args.output, &[path]);
    write_all(&args.output, &files)?;
    for notice in earlier.remove_all_but(&files) {
        console.notice(&notice);
    }
    console.result(&answer.text(&args.output), &answer.record())
}

/// Writes why nothing can be said; the error is the way out.
fn refuse(
    error: CurveDiagnoseError,
    path: &Path,
    folder: &Path,
    console: &Console,
) -> Result<(), Error> {
    let curve = path.display().to_string();
    let answer = CannotTell::of_curve(&error);
    write_refusal(&answer, &format!("the curve {curve}"), folder, &[path], console)?;
    Err(Error::CurveDiagnosis { curve, error })
}
