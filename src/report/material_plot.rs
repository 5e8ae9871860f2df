//! How a material scatters, as plots of σ⁰ over the angle of incidence, and what the parameters of a model do.

use std::path::Path;

use crate::brdf::{
    BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing, ThroughBeam,
};
use crate::error::Error;
use crate::fit::stored_band;
use crate::formats::figure::{FigureError, Ink, Plot, Series, Style};
use crate::material::{Censor, Fit, Material, Observation, Reach};
use crate::units::db_from_ratio;

/// Below this level, dB, nothing is said to come back.
pub(super) const FAINTEST_DB: f64 = -80.0;

/// What an angle may lose in its conversion to degrees and back, rad.
const ROUNDING_RAD: f64 = 1e-9;

/// What the file of a figure holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Vectors.
    Svg,
    /// Pixels.
    Png,
}

impl FigureFormat {
    /// The format that the ending of a path stands for.
    ///
    /// # Errors
    /// An ending other than .svg and .png.
    pub fn of(path: &Path) -> Result<FigureFormat, Error> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Ok(FigureFormat::Svg),
            Some("png") => Ok(FigureFormat::Png),
            _ => Err(Error::usage(
                format!("`{}` does not end in .svg or .png", path.display()),
                "name the file so",
            )),
        }
    }

    /// The bytes of a plot.
    ///
    /// # Errors
    /// A picture that is too large.
    pub fn encode(self, plot: &Plot) -> Result<Vec<u8>, FigureError> {
        match self {
            FigureFormat::Svg => Ok(plot.svg()?.into_bytes()),
            FigureFormat::Png => plot.png(),
        }
    }
}

/// A plot over the angle of incidence, degrees, of σ⁰, dB.
pub fn incidence_plot<'a>(title: &'a str, subtitle: &'a str, series: Vec<Series>) -> Plot<'a> {
    Plot {
        title, subtitle, x_label: "incidence, °", y_label: "σ⁰, dB", series, ..Plot::default()
    }
}

/// The curves of a material, and all its fits; without fits the model that is rendered.
///
/// # Errors
/// A material that renders nothing.
pub fn material_plot(material: &Material) -> Result<Vec<Series>, Error> {
    let mut points = Vec::new();
    for (number, curve) in material.curves.iter().enumerate() {
        // Several curves are told apart by colours of their own, beyond those of the fits.
        let is_alone = material.curves.len() == 1;
        let ink = if is_alone { Ink::Detections } else { Ink::Own(material.fits.len() + number) };
        points.extend(curve_points(&curve.name, &curve.observations, ink));
    }
    let mut series = fit_layers(&material.fits, points);
    if material.fits.is_empty() {
        series.push(model_curve("rendered", &material.scattering()?, Ink::Own(0)));
    }
    Ok(series.into_iter().flat_map(|series| split_at_reach(material, series)).collect())
}

/// The model that a material renders, for several values of one parameter: `PARAMETER=V1,V2,…`.
///
/// # Errors
/// A text that is not a sweep; a parameter that the model lacks; a value that it cannot have.
pub fn sweep_plot(material: &Material, sweep: &str) -> Result<Vec<Series>, Error> {
    let base = material.scattering()?;
    let Some((path, values)) = sweep.split_once('=') else {
        let way_out = "write it as specular.m=0.01,0.05,0.1";
        return Err(Error::usage(format!("`{sweep}` names no values"), way_out));
    };
    let mut series = Vec::new();
    for (number, text) in values.split(',').map(str::trim).enumerate() {
        let Ok(value) = text.parse() else {
            return Err(Error::usage(
                format!("`{text}` is not a number"),
                "separate numbers by commas",
            ));
        };
        let mut model = base.clone();
        if !model.set_parameter(path, value) {
            let paths: Vec<String> = base.parameters().into_iter().map(|p| p.path).collect();
            return Err(Error::usage(
                format!("`{}` has no parameter `{path}`", material.slug),
                format!("there are: {}", paths.join(", ")),
            ));
        }
        if let Err(error) = model.validate() {
            return Err(Error::usage(error.to_string(), "leave it out of the sweep"));
        }
        let curve = model_curve(&format!("{path} = {text}"), &model, Ink::Own(number));
        series.extend(split_at_reach(material, curve));
    }
    Ok(series)
}

/// Figures 16 to 19 of the paper as PNG and SVG, by name: one parameter varied, the others fixed. The paper prints
/// the values of m only; the others are ours.
///
/// # Errors
/// A picture that is too large.
pub fn appendix_figures() -> Result<Vec<(String, Vec<u8>)>, Error> {
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
        let mut series = Vec::new();
        for (number, value) in values.into_iter().enumerate() {
            let mut model = base.clone();
            model.set_parameter(&format!("{part}.{name}"), value);
            series.push(model_curve(&format!("{name} = {value}"), &model, Ink::Own(number)));
        }
        let title = format!("Influence of {name}");
        let x_range = Some((0.0, 90.0));
        let plot = incidence_plot(&title, "", series);
        let plot = Plot { x_range, y_range: Some((-70.0, 30.0)), ..plot };
        files.push((format!("figure-{number}.png"), plot.png()?));
        files.push((format!("figure-{number}.svg"), plot.svg()?.into_bytes()));
    }
    Ok(files)
}

/// Bands of fits below points below curves of fits, so that each can be seen.
pub fn fit_layers(fits: &[Fit], points: Vec<Series>) -> Vec<Series> {
    let curves = fits.iter().enumerate().map(|(number, fit)| {
        // As the beam of the points sees it.
        let beam_rad = fit.beam_rad().unwrap_or(0.0);
        let seen = ThroughBeam { law: &fit.model, beam_rad };
        model_curve(&fit.name, &seen, Ink::Own(number))
    });
    let bands = fits.iter().enumerate();
    let bands = bands.filter_map(|(number, fit)| band(fit, Ink::Own(number)));
    bands.chain(points).chain(curves).collect()
}

/// The backscatter points of a curve: detections, and in series of their own the thresholds of what was not
/// detected and of what was above the instrument's range.
pub fn curve_points(name: &str, observations: &[Observation], ink: Ink) -> Vec<Series> {
    let (mut seen, mut below, mut above) = (Vec::new(), Vec::new(), Vec::new());
    for row in observations.iter().filter(|row| row.is_retro()) {
        let (points, sigma0) = match (row.sigma0, row.threshold_sigma0, row.censor) {
            (Some(sigma0), ..) => (&mut seen, sigma0),
            (None, Some(threshold), Censor::Right) => (&mut above, threshold),
            (None, Some(threshold), _) => (&mut below, threshold),
            (None, None, _) => continue,
        };
        points.push((row.theta_i_rad.to_degrees(), db_from_ratio(sigma0)));
    }
    let mut series =
        vec![Series { name: name.to_owned(), style: Style::Points, ink, points: seen }];
    for (points, style, side) in [(below, Style::Below, "below"), (above, Style::Above, "above")] {
        if !points.is_empty() {
            let name = format!("{name}, {side} the threshold here");
            series.push(Series { name, style, ink, points });
        }
    }
    series
}

/// A curve where the material claims its numbers, and the rest of it in dashes.
fn split_at_reach(material: &Material, series: Series) -> Vec<Series> {
    if series.style != Style::Curve {
        return vec![series];
    }
    // Without fits the rendered curve is drawn, which interpolates between its points.
    let reach = if material.fits.is_empty() {
        material.reach()
    } else {
        Reach::new(material.theta_rad, None)
    };
    let is_beyond: Vec<bool> = series
        .points
        .iter()
        .map(|(theta_deg, _)| reach.outside_rad(theta_deg.to_radians()) >= ROUNDING_RAD)
        .collect();
    let (mut within, mut beyond) = (Vec::new(), Vec::new());
    for (place, &(theta_deg, level_db)) in series.points.iter().enumerate() {
        // The ends belong to both, or a gap would show.
        let around = &is_beyond[place.saturating_sub(1)..(place + 2).min(is_beyond.len())];
        within.push((theta_deg, if is_beyond[place] { f64::NAN } else { level_db }));
        beyond.push((theta_deg, if around.contains(&true) { level_db } else { f64::NAN }));
    }
    vec![
        Series { name: series.name.clone(), style: Style::Beyond, points: beyond, ..series },
        Series { points: within, ..series },
    ]
}

/// The 95 % band of a fit that has a report.
fn band(fit: &Fit, ink: Ink) -> Option<Series> {
    let beam_rad = fit.beam_rad().unwrap_or(0.0);
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for step in 0..900u32 {
        let theta_deg = f64::from(step) / 10.0;
        let Some(band) = stored_band(fit, beam_rad, theta_deg.to_radians()) else { continue };
        let [low_db, high_db] = [band.low, band.high].map(db_from_ratio);
        // Where nothing comes back there is no band either.
        if high_db >= FAINTEST_DB {
            low.push((theta_deg, low_db.max(FAINTEST_DB)));
            high.push((theta_deg, high_db.max(FAINTEST_DB)));
        }
    }
    let outline: Vec<(f64, f64)> = low.into_iter().chain(high.into_iter().rev()).collect();
    let is_empty = outline.is_empty();
    (!is_empty).then(|| Series { name: fit.name.clone(), style: Style::Band, ink, points: outline })
}

/// σ⁰ in dB every tenth of a degree: the lobe of a smooth surface needs that many.
fn model_curve(name: &str, model: &dyn Scattering, ink: Ink) -> Series {
    let mut points = Vec::new();
    for step in 0..900u32 {
        let theta_deg = f64::from(step) / 10.0;
        let level_db = db_from_ratio(model.sigma0(theta_deg.to_radians()));
        points.push((theta_deg, if level_db >= FAINTEST_DB { level_db } else { f64::NAN }));
    }
    Series { name: name.to_owned(), style: Style::Curve, ink, points }
}
