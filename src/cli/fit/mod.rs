//! `matdb fit`.

pub(super) mod words;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use super::console::Console;
use super::curves::{Circumstances, OWN, kind_of};
use super::plot::write_plot;
use crate::adopt::{FitStorage, FitSubject, StoredFit, admission};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::fit::coordinates::frequencies;
use crate::fit::{Fit, FitResult, Method, model, model_names};
use crate::formats::text::nearest;
use crate::material::SourceKind;
use crate::radar::speckle::standard_deviation_db;
use crate::report::{FigureFormat, curve_points, fit_layers, incidence_plot};
use crate::setup::{Database, find_material};
use crate::store::Store;
use crate::units::watts_from_dbm;

const EXAMPLES_AND_METHODS: &str = "Examples:
  matdb fit curve.csv                 the paper's five parameters, censored likelihood
  matdb fit curve.csv --model mixture-ggx -o fit.svg
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
    /// What to fit, and where to start [default: what the material renders, else mixture]
    #[arg(long, value_name = "MODEL|MATERIAL")]
    model: Option<String>,
    /// How to fit
    #[arg(long, value_enum, default_value = "censored")]
    method: MethodName,
    /// Hold diffuse.alpha at this; tls-tail needs it
    #[arg(long, value_name = "X")]
    alpha: Option<f64>,
    /// Hold a parameter; may be repeated
    #[arg(long = "fix", value_name = "PATH=VALUE")]
    fixed: Vec<String>,
    /// Looks of the speckle, 0.1 to 10000 [default: found by the fit]
    #[arg(long, value_name = "L")]
    looks: Option<f64>,
    /// Thermal noise in each chirp, dBm [default: none]
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    noise_dbm: Option<f64>,
    /// Deviation of the angle for tls, degrees [default: that of the curve]
    #[arg(long, value_name = "X")]
    theta_sd_deg: Option<f64>,
    /// Deviation of the level for tls, dB [default: that of speckle of one look]
    #[arg(long, value_name = "X")]
    level_sd_db: Option<f64>,
    /// Angle between the specular and the diffuse piece of mse, degrees
    #[arg(long, value_name = "X", default_value_t = 6.0)]
    split_deg: f64,
    /// Points that the search starts from
    #[arg(long, value_name = "N", default_value_t = 4)]
    starts: usize,
    /// Seed of the starts and of the residuals of missing chirps
    #[arg(long, value_name = "N", default_value_t = 0)]
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
    #[command(flatten)]
    circumstances: Circumstances,
    /// Draw points, fit and 95 % band: a .svg or .png file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
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

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let subject = FitSubject::open(&args.what, args.curve.as_deref(), store.as_ref())?;
    let start = start(args, &subject, store.as_ref())?;
    let fit = settings(args, &subject, &start)?;
    // A fit takes a while: what prevents its storing or drawing is reported before.
    args.output.as_deref().map(FigureFormat::of).transpose()?;
    let fit_name = fit_name(args, &start);
    let storage = args.save.as_ref().map(|material| storage(args, material, fit_name.clone()));
    if let Some(storage) = &storage {
        let material = storage.check(&subject, store.as_ref());
        let material = material.map_err(|error| how_to_add(error, &subject))?;
        if subject.file.is_some() {
            admission::doubts(&material).iter().for_each(|doubt| console.notice(doubt));
        }
    }
    drop(store);
    let mut found = fit
        .run(&start, &subject.curve)
        .map_err(|error| Error::Fit { curve: subject.label.clone(), error })?;
    let is_possible = found.model.validate().is_ok();
    if found.converged && is_possible {
        found.held_out = found.hold_out(&subject.curve);
    }
    let storage = storage.filter(|_| found.converged && is_possible);
    let saved = storage.map(|storage| storage.save(&subject, &found, db));
    let stored = found.stored(&fit_name, &subject.curve_name, "");
    let files = match (&args.output, found.converged) {
        (Some(path), true) => draw(path, &subject, &stored)?,
        _ => Vec::new(),
    };
    let done = saved.as_ref().and_then(|saved| saved.as_ref().ok());
    let text = words::result(&subject, &stored, done, &files);
    let sentences = found.verdict.iter().map(ToString::to_string).collect();
    console.result(&text, &Record { result: &found, sentences, saved: done, files })?;
    saved.transpose()?;
    if !found.converged {
        return Err(Error::NotConverged { curve: subject.label, stop: found.stop.as_str() });
    }
    if !is_possible && args.save.is_some() {
        return Err(Error::usage(
            format!("{}: nothing is stored, since the fit is out of range", subject.label),
            "the verdict says what to let go of",
        ));
    }
    Ok(())
}

/// The error with the commands that make the material of a file's curve, where it is that there is no such material.
fn how_to_add(error: Error, subject: &FitSubject) -> Error {
    match error {
        Error::UnknownMaterial { asked_by, name, way_out } if subject.file.is_some() => {
            let meant = way_out.starts_with("did you mean");
            let meant = if meant { format!("{way_out} Else ") } else { String::new() };
            let way_out = format!(
                "{meant}`matdb add --from {} --name {name} --class CLASS …` makes one of the curve, and then \
                 `matdb fit {name} --save` stores the fit",
                subject.wanted
            );
            Error::UnknownMaterial { asked_by, name, way_out }
        }
        error => error,
    }
}

fn storage(args: &Args, material: &Option<String>, fit_name: String) -> FitStorage {
    FitStorage {
        material: material.clone(),
        fit_name,
        keep_render: args.keep_render,
        origin: args.circumstances.origin(args.kind, args.source.as_ref()),
    }
}

fn fit_name(args: &Args, start: &Brdf) -> String {
    let method = args.method.to_possible_value().map_or(String::new(), |m| m.get_name().to_owned());
    let model = args.model.clone().unwrap_or_else(|| model_word(start));
    args.fit_name.clone().unwrap_or_else(|| format!("{model}-{method}"))
}

/// The word that files use for a model.
fn model_word(model: &Brdf) -> String {
    let value = serde_json::to_value(model).unwrap_or_default();
    value["model"].as_str().unwrap_or("model").to_owned()
}

/// The model where the search begins.
fn start(args: &Args, subject: &FitSubject, store: Option<&Store>) -> Result<Brdf, Error> {
    let Some(name) = &args.model else {
        let default = subject.rendered_model().or_else(|| model("mixture"));
        return default.ok_or_else(|| no_model("mixture"));
    };
    if let Some(model) = model(name) {
        return Ok(model);
    }
    match find_material(store, name, "--model: ") {
        Ok(found) => Ok(found.material.scattering()?),
        Err(Error::UnknownMaterial { .. }) => Err(no_model(name)),
        Err(error) => Err(error),
    }
}

fn no_model(name: &str) -> Error {
    let way_out = match nearest(name, model_names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => {
            format!("name a material or one of {}", model_names().collect::<Vec<_>>().join(", "))
        }
    };
    Error::usage(format!("there is no model and no material `{name}`"), way_out)
}

fn settings(args: &Args, subject: &FitSubject, start: &Brdf) -> Result<Fit, Error> {
    if args.noise_dbm.is_some() && subject.curve.lacks_power() {
        return Err(Error::usage(
            format!("{} has no powers that noise could be compared with", subject.label),
            "leave --noise-dbm out or give the curve a column power_dbm",
        ));
    }
    let fixed = fixed(args, start)?;
    let tls = Method::Tls {
        theta_sd_rad: args.theta_sd_deg.map_or(subject.theta_sd_rad(), f64::to_radians),
        level_sd_db: args.level_sd_db.unwrap_or(standard_deviation_db(1.0)),
    };
    let method = match args.method {
        MethodName::Censored => Method::Censored,
        MethodName::Mse => Method::Mse { split_rad: args.split_deg.to_radians() },
        MethodName::Tls | MethodName::TlsTail => tls,
    };
    let (looks, noise_w) = (args.looks, args.noise_dbm.map(watts_from_dbm));
    let (starts, seed) = (args.starts, args.seed);
    Ok(Fit { method, fixed, bounds: Vec::new(), looks, noise_w, starts, seed })
}

/// The held parameters, each checked to be one of the model's.
fn fixed(args: &Args, start: &Brdf) -> Result<Vec<(String, f64)>, Error> {
    let paths: Vec<String> = start.parameters().into_iter().map(|p| p.path).collect();
    let alpha = paths.iter().find(|path| *path == "diffuse.alpha" || *path == "alpha");
    let mut fixed = Vec::new();
    match (args.alpha, alpha) {
        (Some(value), Some(path)) => fixed.push((path.clone(), value)),
        (Some(_), None) => {
            return Err(Error::usage("this model has no alpha", "leave --alpha out"));
        }
        (None, _) if args.method == MethodName::TlsTail => {
            let way_out = "give it with --alpha, or use --method tls to find it";
            return Err(Error::usage("tls-tail takes the tail's exponent as given", way_out));
        }
        (None, _) => {}
    }
    for text in &args.fixed {
        let parts = text.split_once('=').map(|(path, value)| (path, value.trim().parse()));
        let Some((path, Ok(value))) = parts else {
            let way_out = "write it as --fix diffuse.alpha=3";
            return Err(Error::usage(format!("`{text}` is not a parameter with a value"), way_out));
        };
        if !paths.iter().any(|known| known == path) {
            let way_out = format!("there are: {}", paths.join(", "));
            return Err(Error::usage(format!("the model has no parameter `{path}`"), way_out));
        }
        if is_held(path, &fixed) {
            return Err(Error::usage(format!("`{path}` is held twice"), "hold it once"));
        }
        fixed.push((path.to_owned(), value));
    }
    let own = frequencies(start);
    fixed.extend(own.into_iter().filter(|(path, _)| !is_held(path, &fixed)).collect::<Vec<_>>());
    Ok(fixed)
}

fn is_held(path: &str, fixed: &[(String, f64)]) -> bool {
    fixed.iter().any(|(known, _)| known == path)
}

fn draw(
    path: &Path,
    subject: &FitSubject,
    fit: &crate::material::Fit,
) -> Result<Vec<String>, Error> {
    let points = curve_points(&subject.curve_name, &subject.curve.observations);
    let series = fit_layers(std::slice::from_ref(fit), points);
    let subtitle = format!("{}, with its 95 % band", fit.name);
    write_plot(path, &incidence_plot(&subject.label, &subtitle, series))
}
