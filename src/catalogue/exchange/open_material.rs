//! ASAM OpenMATERIAL 3D: a material (`.xomp`) with look-up tables in files of their own (`_brdf.xompt`,
//! `_emp.xompt`), JSON (specification 1.0.0; schemas of the tag v1.0.0 and of commit d8f359a, MPL-2.0).
//!
//! Wavelengths are in m, angles in rad, f in 1/sr. The standard leaves open what an exit azimuth of 0
//! means; here it is the azimuth of the source, so that backscatter is θ_r = θ_i, azimuth 0. A model is
//! tabulated in all directions; of a rendered curve only backscatter is known, and the rest is not
//! made up. Permeability is 1, which is assumed.
//!
//! Lost: which points are censored (they are left out), uncertainties, parameters of fits other than
//! as text in `customProperties`, lobes narrower than the grid.

use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, TAU};

use serde_json::{Value, json};

use super::error::ExchangeError;
use super::export_files::Export;
use super::subject::{Subject, one_line};
use crate::brdf::{Brdf, Scattering};
use crate::frames::Direction;
use crate::material::SourceKind;
use crate::units::{SPEED_OF_LIGHT_M_PER_S, db_from_ratio};

const VERSION: &str = "1.0.0";
const FORMAT: &str = "ASAM OpenMATERIAL 3D";
/// Wavelengths that the tables may have, m.
const WAVELENGTHS_M: [f64; 2] = [1e-9, 17.16e-3];
/// The schema ends its angles at six decimals of π/2 and 2π.
const LARGEST_ZENITH_RAD: f64 = FRAC_PI_2 - 1e-6;
const LARGEST_AZIMUTH_RAD: f64 = TAU - 1e-6;
/// Zenith angles of the table, degrees.
const ZENITH_STEP_DEG: f64 = 5.0;
/// Azimuths of the table, from 0 to 180°, degrees.
const AZIMUTH_STEP_DEG: f64 = 15.0;

/// Below this f, σ⁰ is under −80 dB: nothing comes back, 1/sr.
const FAINTEST_PER_SR: f64 = 1e-9;

/// Writes the material and its tables.
pub(super) fn write(subject: &Subject, name: &str) -> Result<Export, ExchangeError> {
    let stem = name.strip_suffix(".xomp").unwrap_or(name);
    let [brdf_name, emp_name] = ["brdf", "emp"].map(|table| format!("{stem}_{table}.xompt"));
    let table = Table::new(subject)?;
    let permittivities = permittivities(subject);
    let mut properties = json!({ "brdfUris": [brdf_name], "customProperties": custom(subject) });
    if permittivities.is_ok() {
        properties["electromagneticPropertiesUri"] = json!(emp_name);
    }
    if let Some(roughness) = roughness(subject) {
        properties["surfaceRoughness"] = roughness;
    }
    let material = json!({
        "$schema": schema("material"),
        "metadata": metadata(subject, "material", None),
        "materialProperties": properties,
    });
    let brdf = json!({
        "$schema": schema("material_brdf"),
        "metadata": metadata(subject, "brdf", Some(&table.what)),
        "brdf": { "wavelengths": [table.wavelength_m], "lookupTable": table.rows },
    });
    let mut files = vec![(name.to_owned(), encoded(&material)?), (brdf_name, encoded(&brdf)?)];
    let mut lost = table.lost;
    match permittivities {
        Err(why) => lost += &format!("; {why}, so that there is no table of it"),
        Ok(permittivities) => {
            let emp = json!({
                "$schema": schema("material_emp"),
                "metadata": metadata(subject, "emp", Some("Permittivity; a permeability of 1 is assumed.")),
                "electromagneticProperties": permittivities,
            });
            files.push((emp_name, encoded(&emp)?));
        }
    }
    Ok(Export { files, lost })
}

fn schema(name: &str) -> String {
    format!(
        "https://raw.githubusercontent.com/asam-ev/OpenMATERIAL-3D/refs/tags/v1.0.0/schemas/{name}_schema.json"
    )
}

fn encoded(json: &Value) -> Result<Vec<u8>, ExchangeError> {
    let text = serde_json::to_string(json);
    let text = text.map_err(|error| ExchangeError::encoding(FORMAT, error))?;
    Ok((text + "\n").into_bytes())
}

fn metadata(subject: &Subject, part: &str, what: Option<&str>) -> Value {
    let material = subject.material;
    let mut authors: Vec<&str> =
        material.sources.iter().flat_map(|s| &s.citation.authors).map(String::as_str).collect();
    authors.dedup();
    if authors.is_empty() {
        authors.push("not stated; see the sources");
    }
    let is_part = what.is_some();
    let mut metadata = json!({
        "name": if is_part { format!("{}, {part}", material.name) } else { material.name.clone() },
        "description": one_line(&[what.unwrap_or_default(), &material.description].join(" ")).trim(),
        "uuid": uuid(&[material.slug.as_str(), &material.name, part]),
        "materialVersion": format!("{}.0.0", subject.revision.unwrap_or(0)),
        "openMaterial3dVersion": VERSION,
        "copyrights": ["The holder is not stated; see license and sources"],
        "license": material.licence,
        "authors": authors,
    });
    if is_part {
        let sources = subject.sources();
        metadata["sources"] = json!(format!("{}, {}", subject.kind(), sources.join(", ")));
    }
    if part == "brdf" {
        metadata["typicalSensorTechnology"] = json!("radar");
    }
    metadata
}

/// An identifier made of names alone (UUID version 8), so that it stays through all revisions.
fn uuid(names: &[&str]) -> String {
    let hash = blake3::hash(names.join("\n").as_bytes()).to_hex();
    let part = |from: usize, to: usize| hash.get(from..to).unwrap_or_default().to_owned();
    format!("{}-{}-8{}-a{}-{}", part(0, 8), part(8, 12), part(13, 16), part(17, 20), part(20, 32))
}

fn custom(subject: &Subject) -> Value {
    let material = subject.material;
    let fit = material.fits.iter().find(|fit| fit.name == material.render);
    let model = fit.map(|fit| json!(fit.model).to_string());
    // Version 1.0.0 takes nothing but texts here.
    json!({
        "matdb_about": subject.about().join("\n"),
        "matdb_kind": subject.kind(),
        "matdb_content_hash": material.content_hash(),
        "matdb_model": model.unwrap_or_default(),
    })
}

fn roughness(subject: &Subject) -> Option<Value> {
    let roughness = subject.material.roughness.as_ref()?;
    let source = subject.material.sources.iter().find(|source| source.key == roughness.source);
    Some(json!({
        "surfaceHeightRms": roughness.rms_height_m,
        "surfaceCorrelationLength": roughness.correlation_length_m?,
        "sources": source.map(super::subject::cited).unwrap_or_default(),
    }))
}

/// Rows of wavelength, temperature, humidity, permeability and permittivity, sorted; else why there are none.
fn permittivities(subject: &Subject) -> Result<Vec<Value>, &'static str> {
    let mut entries: Vec<_> = subject
        .permittivities()?
        .into_iter()
        .map(|entry| (SPEED_OF_LIGHT_M_PER_S / entry.frequency_hz, entry))
        .filter(|(wavelength_m, _)| is_wavelength(*wavelength_m))
        .collect();
    if entries.is_empty() {
        return Err("no permittivity of the surface is at a wavelength that the format has");
    }
    entries.sort_by(|(a, x), (b, y)| {
        let [x_k, y_k] = [x, y].map(|entry| entry.temperature_k.unwrap_or(0.0));
        a.total_cmp(b).then(x_k.total_cmp(&y_k))
    });
    let rows = entries.iter().map(|(wavelength_m, entry)| {
        json!([wavelength_m, entry.temperature_k, null, 1.0, 0.0, entry.real, entry.imaginary])
    });
    Ok(rows.collect())
}

fn is_wavelength(wavelength_m: f64) -> bool {
    (WAVELENGTHS_M[0]..=WAVELENGTHS_M[1]).contains(&wavelength_m)
}

/// Rows of wavelength, incident zenith, exit zenith, exit azimuth, f.
struct Table {
    wavelength_m: f64,
    rows: Vec<[f64; 5]>,
    what: String,
    lost: String,
}

impl Table {
    fn new(subject: &Subject) -> Result<Table, ExchangeError> {
        let slug = &subject.material.slug;
        let model = subject.model().map_err(|error| {
            ExchangeError::unfit(slug, FORMAT, error, "fit a model to it and render that")
        })?;
        let table = match model {
            Brdf::Tabulated(_) => Table::of_curve(subject),
            model => Table::of_model(subject, &model),
        };
        if !is_wavelength(table.wavelength_m) {
            let problem = format!("a wavelength of {} m is beyond its tables", table.wavelength_m);
            let way_out = "they hold 1 nm to 17.16 mm, 17.5 GHz and above";
            return Err(ExchangeError::unfit(slug, FORMAT, problem, way_out));
        }
        Ok(table)
    }

    /// The points of the curve and no other directions.
    fn of_curve(subject: &Subject) -> Table {
        let points = subject.points();
        let wavelength_m = points.wavelength_m();
        let mut rows = Vec::with_capacity(points.observations.len());
        for o in points.observations.iter() {
            let Some(sigma0) = o.sigma0 else { continue };
            let azimuth_rad = o.delta_phi_rad.rem_euclid(TAU).min(LARGEST_AZIMUTH_RAD);
            let [i_rad, r_rad] =
                [o.theta_i_rad, o.theta_r_rad].map(|rad| rad.min(LARGEST_ZENITH_RAD));
            rows.push([
                wavelength_m,
                i_rad,
                r_rad,
                azimuth_rad,
                sigma0 / o.aspect().sigma0_per_f(),
            ]);
        }
        rows.sort_by(|a, b| {
            let columns = a.iter().zip(b).map(|(x, y)| x.total_cmp(y));
            columns.fold(Ordering::Equal, Ordering::then)
        });
        let censored = points.observations.len() - rows.len();
        let is_measured = points.source.is_some_and(|s| s.kind == SourceKind::Measured);
        let what = format!(
            "{} points of a curve; exit azimuth 0 is towards the source. No other direction is known.",
            if is_measured { "The measured" } else { "The" },
        );
        let lost = format!(
            "the table has only the {} detected points of the curve, since no other direction is known; \
             {censored} censored ones are left out",
            rows.len()
        );
        Table { wavelength_m, rows, what, lost }
    }

    /// The model in all directions within the claimed angles.
    fn of_model(subject: &Subject, model: &Brdf) -> Table {
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / subject.frequency_hz();
        let [low, high] = subject.material.theta_rad;
        let claimed_rad = low - 1e-9..=high + 1e-9;
        let zeniths = steps_rad(85.0, ZENITH_STEP_DEG).filter(|angle| claimed_rad.contains(angle));
        let zeniths: Vec<f64> = zeniths.collect();
        let mut rows = Vec::new();
        for &i_rad in &zeniths {
            let i = Direction::from_angles(i_rad, 0.0);
            for &r_rad in &zeniths {
                for azimuth_rad in steps_rad(180.0, AZIMUTH_STEP_DEG) {
                    let o = Direction::from_angles(r_rad, azimuth_rad);
                    rows.push([wavelength_m, i_rad, r_rad, azimuth_rad, model.f_per_sr(i, o)]);
                }
            }
        }
        let worst_db = worst_between_db(model, &zeniths);
        Table {
            wavelength_m,
            rows,
            what: "A model in all directions; exit azimuth 0 is towards the source.".to_owned(),
            lost: format!(
                "the model is tabulated every {ZENITH_STEP_DEG}° and, between 0 and 180°, every \
                 {AZIMUTH_STEP_DEG}° of azimuth; interpolated halfway between rows, its backscatter \
                 where above -80 dB is up to {worst_db:.1} dB off"
            ),
        }
    }
}

/// Angles from 0 to an end in equal steps, rad.
fn steps_rad(end_deg: f64, step_deg: f64) -> impl Iterator<Item = f64> {
    let count = (end_deg / step_deg).round() as u32;
    (0..=count).map(move |step| (f64::from(step) * step_deg).to_radians())
}

/// The largest error of backscatter that is interpolated linearly in f halfway between zenith angles, dB.
fn worst_between_db(model: &Brdf, zeniths: &[f64]) -> f64 {
    let mut worst_db = 0.0f64;
    for (a, b) in zeniths.iter().zip(zeniths.iter().skip(1)) {
        let between_per_sr = (model.retro_per_sr(*a) + model.retro_per_sr(*b)) / 2.0;
        let true_per_sr = model.retro_per_sr((a + b) / 2.0);
        let error_db = db_from_ratio(between_per_sr / true_per_sr).abs();
        if true_per_sr >= FAINTEST_PER_SR && error_db.is_finite() {
            worst_db = worst_db.max(error_db);
        }
    }
    worst_db
}
