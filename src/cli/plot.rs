//! `matdb plot`.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::console::Console;
use crate::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use crate::error::Error;
use crate::files::{folder_of, write_all};
use crate::fit::stored_band;
use crate::formats::figure::{Plot, Series, Style};
use crate::material::{Censor, Fit, Material, Observation, Reach};
use crate::setup::Database;
use crate::setup::{MaterialRevision, find_material};
use crate::units::db_from_ratio;

/// Below this a level says only that nothing comes back.
const FAINTEST_DB: f64 = -80.0;

/// Draw how a material scatters, and what its parameters do
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb plot mannequin-paint -o paint.svg
  matdb plot mannequin-paint --sweep specular.m=0.01,0.05,0.1 -o sweep.png
  matdb plot --appendix -o figures          figures 16 to 19 of the paper, as PNG and SVG")]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    #[arg(group = "what")]
    material: Option<String>,
    /// Figures 16 to 19 of the paper: what f_lambda, m, r_s and alpha do
    #[arg(long, group = "what")]
    appendix: bool,
    /// Draw the fit for several values of one parameter
    #[arg(long, value_name = "PARAMETER=V1,V2,…", requires = "material")]
    sweep: Option<String>,
    /// A .svg or .png file; a folder with --appendix
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let written = match &args.material {
        None => appendix(&args.output)?,
        Some(name) => {
            let store = db.read()?;
            let MaterialRevision { material, .. } = find_material(store.as_ref(), name, "")?;
            let series = match &args.sweep {
                None => curves(&material)?,
                Some(sweep) => swept(&material, sweep)?,
            };
            let kind = material.render_kind().map_or("of unknown origin", |kind| kind.as_str());
            let kind = material.rendered_words().unwrap_or_else(|| kind.to_owned());
            one_file(&args.output, &plot(&material.name, &kind, series))?
        }
    };
    let text = format!("wrote {}\n", written.join(", "));
    console.result(&text, &json!({ "files": written }))
}

pub(super) fn plot<'a>(title: &'a str, subtitle: &'a str, series: Vec<Series>) -> Plot<'a> {
    let (x_label, y_label) = ("incidence, °", "σ⁰, dB");
    let x_range = Some((0.0, 90.0));
    Plot { title, subtitle, x_label, y_label, x_range, y_range: None, equal: false, series }
}

/// What a figure's file holds.
#[derive(Clone, Copy)]
pub(super) enum Ending {
    Svg,
    Png,
}

/// What the ending of a figure's file asks for.
pub(super) fn ending(path: &Path) -> Result<Ending, Error> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("svg") => Ok(Ending::Svg),
        Some("png") => Ok(Ending::Png),
        _ => {
            let problem = format!("`{}` does not end in .svg or .png", path.display());
            Err(Error::Usage { problem, way_out: "name the file so".to_owned() })
        }
    }
}

/// Writes a plot to a file whose ending says how.
pub(super) fn one_file(path: &Path, plot: &Plot) -> Result<Vec<String>, Error> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bytes = match ending(path)? {
        Ending::Svg => plot.svg()?.into_bytes(),
        Ending::Png => plot.png()?,
    };
    write_all(folder_of(path), &[(&name, bytes)])?;
    Ok(vec![path.display().to_string()])
}

/// Measured or stated points, and every fit.
fn curves(material: &Material) -> Result<Vec<Series>, Error> {
    let points = material.curves.iter().flat_map(|c| points(&c.name, &c.observations)).collect();
    let mut series = layers(&material.fits, points);
    if material.fits.is_empty() {
        series.push(model_curve("rendered", &material.scattering()?));
    }
    Ok(series.into_iter().flat_map(|series| claimed(material, series)).collect())
}

/// A curve as far as the material answers for it, and the rest of it in dashes.
fn claimed(material: &Material, series: Series) -> Vec<Series> {
    if series.style != Style::Curve {
        return vec![series];
    }
    // Without fits it is the rendered curve that is drawn, between its points.
    let reach = match material.fits.is_empty() {
        true => material.reach(),
        false => Reach::new(material.theta_rad, None),
    };
    let angles = || series.points.iter().map(|(theta_deg, _)| theta_deg.to_radians());
    let is_within: Vec<bool> =
        angles().map(|theta_rad| reach.outside_rad(theta_rad) < ROUNDING_RAD).collect();
    let part = |style: Style, wanted: &dyn Fn(usize) -> bool| {
        let kept = |(place, &(theta_deg, level_db)): (usize, &(f64, f64))| {
            (theta_deg, if wanted(place) { level_db } else { f64::NAN })
        };
        let points = series.points.iter().enumerate().map(kept).collect();
        Series { name: series.name.clone(), style, points }
    };
    let is_beyond = |place: usize| is_within.get(place).is_some_and(|within| !within);
    // The ends belong to both, or a gap would show.
    let touches_beyond = |place: usize| {
        is_beyond(place) || is_beyond(place + 1) || place > 0 && is_beyond(place - 1)
    };
    vec![part(Style::Beyond, &touches_beyond), part(Style::Curve, &|place| !is_beyond(place))]
}

/// What an angle may lose on its way through degrees, rad.
const ROUNDING_RAD: f64 = 1e-9;

/// Bands below points below fits, so that each can be seen.
pub(super) fn layers(fits: &[Fit], points: Vec<Series>) -> Vec<Series> {
    let curves = fits.iter().map(|fit| model_curve(&fit.name, &fit.model));
    fits.iter().filter_map(band).chain(points).chain(curves).collect()
}

/// Backscatter points, those that are only thresholds apart.
pub(super) fn points(name: &str, observations: &[Observation]) -> Vec<Series> {
    let at = |theta_rad: f64, sigma0: f64| (theta_rad.to_degrees(), db_from_ratio(sigma0));
    let (mut seen, mut below, mut above) = (Vec::new(), Vec::new(), Vec::new());
    for o in observations.iter().filter(|o| o.is_retro()) {
        match (o.sigma0, o.threshold_sigma0, o.censor) {
            (Some(sigma0), ..) => seen.push(at(o.theta_i_rad, sigma0)),
            (None, Some(threshold), Censor::Right) => above.push(at(o.theta_i_rad, threshold)),
            (None, Some(threshold), _) => below.push(at(o.theta_i_rad, threshold)),
            (None, None, _) => {}
        }
    }
    let mut series = vec![Series { name: name.to_owned(), style: Style::Points, points: seen }];
    for (points, style, side) in [(below, Style::Below, "below"), (above, Style::Points, "above")] {
        if !points.is_empty() {
            series.push(Series {
                name: format!("{name}, {side} the threshold here"),
                style,
                points,
            });
        }
    }
    series
}

/// The 95 % band of a fit that has a report.
fn band(fit: &Fit) -> Option<Series> {
    let angles_deg = || (0..900).map(|step: u32| f64::from(step) / 10.0);
    let band_db = |theta_deg: f64| {
        let band = stored_band(fit, theta_deg.to_radians())?;
        let ends_db = [band.low, band.high].map(db_from_ratio);
        // Where nothing comes back there is no band either.
        (ends_db[1] >= FAINTEST_DB).then_some((theta_deg, ends_db.map(|e| e.max(FAINTEST_DB))))
    };
    let ends: Vec<(f64, [f64; 2])> = angles_deg().filter_map(band_db).collect();
    let low = ends.iter().map(|(theta_deg, ends_db)| (*theta_deg, ends_db[0]));
    let high = ends.iter().rev().map(|(theta_deg, ends_db)| (*theta_deg, ends_db[1]));
    let outline: Vec<(f64, f64)> = low.chain(high).collect();
    let band = Series { name: fit.name.clone(), style: Style::Band, points: outline };
    Some(band).filter(|band| !band.points.is_empty())
}

/// The rendered fit for several values of one parameter.
fn swept(material: &Material, sweep: &str) -> Result<Vec<Series>, Error> {
    let usage = |problem: String, way_out: String| Err(Error::Usage { problem, way_out });
    let model = material.scattering()?;
    let paths: Vec<String> = model.parameters().into_iter().map(|p| p.path).collect();
    let Some((path, values)) = sweep.split_once('=') else {
        let way_out = "write it as --sweep specular.m=0.01,0.05,0.1".to_owned();
        return usage(format!("`{sweep}` names no values"), way_out);
    };
    let mut series = Vec::new();
    for text in values.split(',') {
        let mut model = model.clone();
        let Ok(value) = text.trim().parse() else {
            return usage(
                format!("`{text}` is no number"),
                "separate numbers by commas".to_owned(),
            );
        };
        if !model.set_parameter(path, value) {
            let way_out = format!("there are: {}", paths.join(", "));
            return usage(format!("`{}` has no parameter `{path}`", material.slug), way_out);
        }
        if let Err(error) = model.validate() {
            return usage(error.to_string(), "leave it out of the sweep".to_owned());
        }
        series.push(model_curve(&format!("{path} = {}", text.trim()), &model));
    }
    Ok(series.into_iter().flat_map(|series| claimed(material, series)).collect())
}

/// σ⁰ in dB every tenth of a degree; the lobe of a smooth surface needs no less.
fn model_curve(name: &str, model: &dyn Scattering) -> Series {
    let point = |step: u32| {
        let theta_deg = f64::from(step) / 10.0;
        let level_db = db_from_ratio(model.sigma0(theta_deg.to_radians()));
        (theta_deg, if level_db >= FAINTEST_DB { level_db } else { f64::NAN })
    };
    Series { name: name.to_owned(), style: Style::Curve, points: (0..900).map(point).collect() }
}

/// Figures 16 to 19: one parameter varied, the others as here. The paper prints the values of m
/// only; the others are ours.
fn appendix(folder: &Path) -> Result<Vec<String>, Error> {
    let base = Brdf::Mixture(Mixture {
        k: 0.1,
        diffuse: Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.016, alpha: 3.0 })),
        specular: Box::new(Brdf::CookTorrance(CookTorrance {
            f_lambda: 0.1,
            m: 0.05,
            m_across: None,
            distribution: Distribution::Beckmann,
            shadowing: Shadowing::Separable,
        })),
    });
    let mut files = Vec::new();
    for (number, part, name, values) in [
        (16, "specular", "f_lambda", [0.001, 0.01, 0.1]),
        (17, "specular", "m", [0.01, 0.05, 0.1]),
        (18, "diffuse", "r_s", [0.001, 0.01, 0.1]),
        (19, "diffuse", "alpha", [1.0, 3.0, 10.0]),
    ] {
        let series = values
            .map(|value| {
                let mut model = base.clone();
                model.set_parameter(&format!("{part}.{name}"), value);
                model_curve(&format!("{name} = {value}"), &model)
            })
            .to_vec();
        let title = format!("Influence of {name}");
        let plot = Plot { y_range: Some((-70.0, 30.0)), ..plot(&title, "", series) };
        files.push((format!("figure-{number}.png"), plot.png()?));
        files.push((format!("figure-{number}.svg"), plot.svg()?.into_bytes()));
    }
    write_all(folder, &files)?;
    Ok(files.iter().map(|(name, _)| folder.join(name).display().to_string()).collect())
}
