//! One material's curve as CSV, the columns that a `material.toml` refers to: `theta_deg`, `sigma0_db`,
//! `censor`, `threshold_db`, `theta_r_deg`, `delta_phi_deg`, and where they are stated `theta_sd_deg`, `power_dbm`,
//! `range_m`, `chirp`, `xt_m`, `yt_m`, `footprint` and `beam_rad`.
//! Lines that start with `#` describe the curve and its source; the reader skips those at the head.
//!
//! Lost: everything but the curve.

use std::path::Path;

use super::detail::Detail;
use super::details::{Details, file_name, missing};
use super::error::ExchangeError;
use super::export_files::Export;
use super::subject::{Points, Subject};
use crate::fit::Fit;
use crate::formats::FormatError;
use crate::formats::words::round_significant;
use crate::material::{
    Citation, Curve, Illumination, Instrument, Material, Observation, Slug, Source, SourceKind,
    Status, file,
};
use crate::units::{db_from_ratio, dbm_from_watts, ratio_from_db, shown};

/// Key of the instrument that a curve was measured with.
pub(super) const RADAR: &str = "radar";

/// Writes the curve, or what the model says at every degree.
pub(super) fn write(subject: &Subject, name: &str) -> Export {
    let points = subject.points();
    let mut about = subject.about();
    about.push(format!("{}, at {} GHz", describe(&points), points.frequency_hz / 1e9));
    // A name may hold any character, a comment no end of a line.
    let about = about.iter().map(|line| line.replace(char::is_control, " "));
    let mut text: String = about.map(|line| format!("# {line}\n")).collect();
    let lit = points.curve.map(|curve| curve.illumination).unwrap_or_default();
    let [names, lit] = lit.columns();
    let observations = match points.curve {
        Some(curve) => curve.stated().collect(),
        None => points.observations.to_vec(),
    };
    let stated: Vec<&Detailed> = DETAILS
        .iter()
        .filter(|detail| observations.iter().any(|point| (detail.of)(point).is_some()))
        .collect();
    text += "theta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg";
    stated.iter().for_each(|detail| text += &format!(",{}", detail.column));
    text += &format!("{names}\n");
    for point in &observations {
        let details = stated.iter().map(|detail| (detail.of)(point).map(fifteen_digits));
        let details: String =
            details.map(|cell| format!(",{}", cell.unwrap_or_default())).collect();
        text += &format!(
            "{},{},{},{},{},{}{details}{lit}\n",
            fifteen_digits(point.theta_i_rad.to_degrees()),
            level_db(point.sigma0),
            point.censor.as_str(),
            level_db(point.threshold_sigma0),
            fifteen_digits(point.theta_r_rad.to_degrees()),
            fifteen_digits(point.delta_phi_rad.to_degrees()),
        );
    }
    let lost = format!(
        "the file holds {}; nothing else of the material has a column there",
        describe(&points)
    );
    Export { files: vec![(name.to_owned(), text.into_bytes())], lost }
}

/// What a point may state besides its angles and its level.
struct Detailed {
    column: &'static str,
    /// In the unit of the column.
    of: fn(&Observation) -> Option<f64>,
}

const DETAILS: [Detailed; 6] = [
    Detailed { column: "theta_sd_deg", of: |point| point.theta_sd_rad.map(f64::to_degrees) },
    Detailed { column: "power_dbm", of: |point| point.power_w.map(dbm_from_watts) },
    Detailed { column: "range_m", of: |point| point.range_m },
    Detailed { column: "chirp", of: |point| point.chirp.map(f64::from) },
    Detailed { column: "xt_m", of: |point| point.target_m.map(|[x, _]| x) },
    Detailed { column: "yt_m", of: |point| point.target_m.map(|[_, y]| y) },
];

/// A level in dB, with the decimals that somebody wrote where these read back as the same ratio; nothing where there is none.
fn level_db(level: Option<f64>) -> String {
    let Some(ratio) = level else { return String::new() };
    let level_db = db_from_ratio(ratio);
    let written_db = (1e9 * level_db).round() / 1e9;
    if ratio_from_db(written_db) == ratio {
        shown(written_db + 0.0)
    } else {
        fifteen_digits(level_db)
    }
}

/// Fifteen digits, as many as decimals that somebody wrote keep on their way through radians and ratios.
fn fifteen_digits(value: f64) -> String {
    shown(round_significant(value, 15) + 0.0)
}

/// Which numbers these are, in a clause.
pub(super) fn describe(points: &Points) -> String {
    match points.curve {
        Some(curve) if points.others.is_empty() => format!("the curve `{}`", curve.name),
        Some(curve) => format!("the curve `{}` and not {}", curve.name, points.others.join(", ")),
        None => "the model's backscatter at every degree where it is above -80 dB, since there is no curve"
            .to_owned(),
    }
}

/// Makes a material of a curve, and says what a person should know of the file.
pub(super) fn read(
    file: &str,
    bytes: &[u8],
    given: &Details,
) -> Result<(Material, Vec<String>), ExchangeError> {
    let points =
        file::points(bytes, &given.columns).map_err(|error| ExchangeError::in_file(file, error))?;
    let illumination = points.illumination;
    let unused = points.unused_deviations();
    let notices = unused.into_iter().chain(points.passed_over).chain(points.notices).collect();
    let observations: Vec<Observation> = points.rows.into_iter().map(|(_, point)| point).collect();
    if observations.is_empty() {
        let empty =
            FormatError::at("line 1", "no row follows the header", "add the curve's points");
        return Err(ExchangeError::in_file(file, empty));
    }
    let Details { slug, class, licence, source, kind, instrument, frequency_hz, .. } = given;
    // A curve of unstated kind may be measured.
    let is_measured = kind.is_none_or(|kind| kind == SourceKind::Measured);
    // A threshold is that of an instrument.
    let has_instrument = instrument.is_some() || !is_measured && given.threshold_w.is_none();
    let has_threshold = !is_measured
        || given.threshold_w.is_some()
        || observations.iter().all(|row| row.threshold_sigma0.is_some());
    let details = [
        (slug.is_some(), Detail::Name),
        (class.is_some(), Detail::Class),
        (licence.is_some(), Detail::Licence),
        (source.is_some(), Detail::Source),
        (kind.is_some(), Detail::Kind),
        (frequency_hz.is_some(), Detail::Frequency),
        (has_instrument, Detail::Instrument),
        (has_threshold, Detail::Threshold),
    ];
    let (Some(slug), Some(class), Some(licence), Some(title), Some(kind), Some(hz), true) = (
        slug.clone(),
        class.clone(),
        licence.clone(),
        source.clone(),
        *kind,
        *frequency_hz,
        has_threshold && has_instrument,
    ) else {
        return Err(missing(file, &details));
    };
    let instrument = instrument.as_ref().map(|name| Instrument {
        key: RADAR.to_owned(),
        name: name.clone(),
        centre_frequency_hz: hz,
        threshold_w: given.threshold_w,
        ..Instrument::default()
    });
    let single = SingleCurve {
        slug,
        class,
        licence,
        title,
        kind,
        hz,
        instrument,
        illumination,
        observations,
    };
    let mut material = of_curve(file, given, single);
    render_model(file, given, &mut material)?;
    Ok((material, notices))
}

/// Fits the wanted model to a material's only curve; scenes then render it.
fn render_model(file: &str, given: &Details, material: &mut Material) -> Result<(), ExchangeError> {
    let [curve] = material.curves.as_slice() else { return Ok(()) };
    let Some((name, model)) = &given.model else {
        if curve.observations.iter().any(Observation::is_retro) {
            return Ok(());
        }
        let problem =
            "no row is backscatter, which is all that scenes render of a curve".to_owned();
        let way_out = "name a model that is fitted to it and rendered, as --model mixture-ggx does";
        return refused(file, problem, way_out);
    };
    let points = match crate::measure::Curve::of_material(curve) {
        Ok(points) => points,
        Err(error) => return refused(file, error.to_string(), "leave that point out"),
    };
    let settings = Fit { beam_rad: curve.illumination.beam_rad, ..Fit::default() };
    let found = match settings.run(model, &points) {
        Ok(found) if found.converged => found,
        Ok(_) => {
            let problem = format!("the fit of {name} did not converge");
            return refused(file, problem, "name another --model");
        }
        Err(error) => {
            return refused(
                file,
                format!("{name} cannot be fitted: {error}"),
                "name another --model",
            );
        }
    };
    let mut fit =
        found.stored(&format!("{name}-{}", found.method_name()), &curve.name, &curve.source);
    fit.report.iter_mut().for_each(|report| report.held_out = found.hold_out(&points));
    material.render = fit.name.clone();
    material.fits.push(fit);
    Ok(())
}

fn refused(file: &str, problem: String, way_out: &str) -> Result<(), ExchangeError> {
    Err(ExchangeError::in_file(file, FormatError::at("the table", problem, way_out)))
}

/// A curve and all that an entry must state about it.
pub(super) struct SingleCurve {
    pub slug: Slug,
    pub class: String,
    pub licence: String,
    /// Of the source.
    pub title: String,
    pub kind: SourceKind,
    /// Frequency, Hz.
    pub hz: f64,
    pub instrument: Option<Instrument>,
    pub illumination: Illumination,
    pub observations: Vec<Observation>,
}

/// A material that is one curve.
pub(super) fn of_curve(file: &str, given: &Details, single: SingleCurve) -> Material {
    let SingleCurve { slug, class, licence, title, kind, hz, instrument, .. } = single;
    let SingleCurve { illumination, observations, .. } = single;
    let stem = Path::new(file_name(file)).file_stem().unwrap_or_default().to_string_lossy();
    let name = given.curve.clone().unwrap_or(stem.into_owned());
    // Two directions show what the surface returns where its facets are tilted to the middle of them.
    let angles_rad = observations.iter().map(|point| point.aspect().half_angle_rad());
    let (least_rad, greatest_rad) =
        (angles_rad.clone().fold(f64::INFINITY, f64::min), angles_rad.fold(0.0, f64::max));
    Material {
        name: given.name.clone().unwrap_or_else(|| slug.to_string()),
        class,
        description: String::new(),
        licence: licence.clone(),
        tags: Vec::new(),
        frequency_hz: [hz, hz],
        theta_rad: [least_rad, greatest_rad],
        render: name.clone(),
        sources: vec![Source {
            key: name.clone(),
            kind,
            title,
            doi: None,
            url: None,
            licence: Some(licence),
            note: Some(format!("Read from {}.", file_name(file))),
            citation: Citation::default(),
            making: None,
        }],
        curves: vec![Curve {
            name: name.clone(),
            source: name,
            instrument: instrument.as_ref().map(|instrument| instrument.key.clone()),
            session: None,
            illumination,
            observations,
        }],
        instruments: instrument.into_iter().collect(),
        fits: Vec::new(),
        effects: Vec::new(),
        status: Status::Active,
        finish: None,
        unknown: Vec::new(),
        roughness: None,
        layers: Vec::new(),
        permittivities: Vec::new(),
        sessions: Vec::new(),
        findings: Vec::new(),
        slug,
    }
}
