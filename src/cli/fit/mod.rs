//! `matdb fit`.

pub(super) mod words;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use super::cloud::ColumnArgs;
use super::console::Console;
use super::curves::{Circumstances, OWN, kind_of};
use super::plot::write_plot;
use crate::adopt::{FitMethod, FitOutcome, FitRequest, FitStorage, FitSubject, StoredFit};
use crate::error::Error;
use crate::fit::{FitResult, model_names};
use crate::material::{Fit, SourceKind};
use crate::radar::Radar;
use crate::report::{FigureFormat, FitPlot};
use crate::setup::{Database, unmet_conditions, unmet_sentence};
use crate::units::watts_from_dbm;

const EXAMPLES_AND_METHODS: &str = "Examples:
  matdb fit curve.csv                 the paper's five parameters, censored likelihood
  matdb fit curve.csv --model mixture-ggx -o fit.svg
  matdb fit plane.csv --model mixture-ggx   source and receiver in two directions
  matdb fit curve.csv --method tls-tail --alpha 3
  matdb fit cotton --fix diffuse.alpha=4 --save
  matdb fit my-paint --save           a fit of its longest curve, into my-paint
  matdb fit spring.csv --save my-paint --curve spring --kind measured \\
    --source 'Our bench, 2026' --licence CC-BY-4.0 \\
    --instrument 'Our radar' --frequency 300 --threshold -77

The last one stores curve and fit in the material my-paint, which must exist; \
`matdb add --from spring.csv …` makes a new one.

Methods: censored (speckle and missing chirps by their laws), tls (orthogonal distance in dB), tls-tail \
(the same with alpha given), mse (least squares in two pieces).

";

fn after_help() -> String {
    let models = model_names().collect::<Vec<_>>().join(", ");
    format!("{EXAMPLES_AND_METHODS}Models: a material's name, or {models}.")
}

/// Fit a scattering model to a curve, and say what the curve cannot tell
#[derive(Debug, clap::Args)]
#[command(after_help = after_help())]
pub(super) struct Args {
    /// A curve's CSV file, or NAME or NAME@REVISION of a material with a curve
    #[arg(value_name = "MATERIAL|CURVE.csv")]
    what: String,
    /// Curve of the material [default: the longest], or the name to store a file's curve under [default: that of the file]
    #[arg(long, value_name = "NAME")]
    curve: Option<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    /// What to fit, and where to start [default: what the material renders, else mixture]
    #[arg(long, value_name = "MODEL|MATERIAL")]
    model: Option<String>,
    /// How to fit
    #[arg(long, value_enum, default_value = "censored")]
    method: MethodName,
    /// Hold diffuse.alpha at this; tls-tail needs it
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    alpha: Option<f64>,
    /// Hold a parameter; may be repeated
    #[arg(long = "fix", value_name = "PATH=VALUE")]
    fixed: Vec<String>,
    /// Looks of the speckle, 0.1 to 10000 [default: found by the fit]
    #[arg(long, value_name = "L", allow_negative_numbers = true)]
    looks: Option<f64>,
    /// Thermal noise in each chirp, dBm [default: none]
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    noise_dbm: Option<f64>,
    /// Standard deviation of the angle for tls, degrees [default: that of the curve]
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    theta_sd_deg: Option<f64>,
    /// Standard deviation of the level for tls, dB [default: that of speckle of one look]
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    level_sd_db: Option<f64>,
    /// Angle between the specular and the diffuse piece of mse, degrees
    #[arg(long, value_name = "X", default_value_t = 6.0, allow_negative_numbers = true)]
    split_deg: f64,
    /// Points that the search starts from: the model's own, and the best of all shapes of its lobes
    #[arg(long, value_name = "N", default_value_t = 4, allow_negative_numbers = true)]
    starts: usize,
    /// Seed of the starts and of the residuals of missing chirps
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Store the fit, and a file's curve with it, in the material NAME, which must exist
    #[arg(long, value_name = "NAME", num_args = 0..=1)]
    save: Option<Option<String>>,
    /// Name of the stored fit [default: MODEL-METHOD]
    #[arg(long, value_name = "NAME", requires = "save")]
    fit_name: Option<String>,
    /// Let scenes render what they rendered before
    #[arg(long, requires = "save")]
    keep_render: bool,
    /// Origin of a file's curve
    #[arg(long, value_parser = kind_of(OWN), requires = "save")]
    kind: Option<SourceKind>,
    /// Who measured or made a file's curve, when and how
    #[arg(long, value_name = "TITLE", requires = "save")]
    source: Option<String>,
    /// Draw points and fit, with its 95 % band in backscatter: a .svg or .png file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    circumstances: Circumstances,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Mse,
    Tls,
    TlsTail,
    Censored,
}

/// What scripts read: the result of the fit, and what was done with it.
#[derive(Serialize)]
struct Record<'a> {
    #[serde(flatten)]
    result: &'a FitResult,
    sentences: Vec<String>,
    saved: Option<&'a StoredFit>,
    files: Vec<String>,
}

impl From<MethodName> for FitMethod {
    fn from(name: MethodName) -> FitMethod {
        match name {
            MethodName::Mse => FitMethod::Mse,
            MethodName::Tls => FitMethod::Tls,
            MethodName::TlsTail => FitMethod::TlsTail,
            MethodName::Censored => FitMethod::Censored,
        }
    }
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let checked = request(args)?.check(db.read()?.as_ref())?;
    args.output.as_deref().map(FigureFormat::of).transpose()?;
    checked.notices.iter().for_each(|notice| console.notice(notice));
    let activity = console.activity("fitting");
    let outcome = checked.run(db);
    activity.end();
    let FitOutcome { subject, result, fit, stored, refusal } = outcome?;
    let material = subject.found.as_ref().map(|found| &found.material);
    for condition in unmet_conditions(&fit.fit.model, Radar::default().wavelength_m(), material) {
        console.notice(&unmet_sentence(&condition));
    }
    let files = match &args.output {
        Some(path) if result.converged => draw(path, &subject, &fit.fit, console)?,
        _ => Vec::new(),
    };
    let saved = stored.as_ref();
    let text = words::result(&subject, &fit.fit, saved, &files);
    let sentences = result.verdict.iter().map(ToString::to_string).collect();
    console.result(&text, &Record { result: &result, sentences, saved, files })?;
    refusal.map_or(Ok(()), Err)
}

fn request(args: &Args) -> Result<FitRequest<'_>, Error> {
    let storage = args.save.as_ref().map(|material| FitStorage {
        material: material.clone(),
        keep_render: args.keep_render,
        origin: args.circumstances.origin(args.kind, args.source.as_ref()),
    });
    Ok(FitRequest {
        what: &args.what,
        curve: args.curve.as_deref(),
        columns: args.columns.names(),
        model: args.model.as_deref(),
        own: None,
        method: args.method.into(),
        alpha: args.alpha,
        fixed: args.fixed.iter().map(|text| held(text)).collect::<Result<_, _>>()?,
        looks: args.looks,
        noise_w: args.noise_dbm.map(watts_from_dbm),
        theta_sd_rad: args.theta_sd_deg.map(f64::to_radians),
        level_sd_db: args.level_sd_db,
        split_rad: args.split_deg.to_radians(),
        starts: args.starts,
        seed: args.seed,
        fit_name: args.fit_name.as_deref(),
        storage,
    })
}

/// A held parameter, `PATH=VALUE`.
fn held(text: &str) -> Result<(String, f64), Error> {
    let parts = text.split_once('=').map(|(path, value)| (path, value.trim().parse()));
    let Some((path, Ok(value))) = parts else {
        let way_out = "write it as --fix diffuse.alpha=3";
        return Err(Error::usage(format!("`{text}` is not a parameter with a value"), way_out));
    };
    Ok((path.to_owned(), value))
}

fn draw(
    path: &Path,
    subject: &FitSubject,
    fit: &Fit,
    console: &Console,
) -> Result<Vec<String>, Error> {
    let file = subject.file.as_ref().and_then(|file| file.file_name());
    let title = file.map_or(subject.label.clone(), |file| file.to_string_lossy().into_owned());
    match FitPlot::new(title, &subject.curve_name, &subject.curve.observations, fit) {
        Some(drawn) => write_plot(path, &drawn.plot()),
        None => {
            console.notice("nothing is drawn: no row lies in the plane of incidence");
            Ok(Vec::new())
        }
    }
}
