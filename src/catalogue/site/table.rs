//! The points of a material's curves as a table for other programs.

use std::io;

use crate::catalogue::error::CatalogueError;
use crate::files::FilesError;
use crate::material::{Illumination, Material, SourceKind};
use crate::radar::Footprint;
use crate::units::{db_from_ratio, dbm_from_watts};

use super::entry::kind_of;

const COLUMNS: [&str; 18] = [
    "curve",
    "kind",
    "theta_deg",
    "sigma0_db",
    "censor",
    "threshold_db",
    "theta_r_deg",
    "delta_phi_deg",
    "theta_sd_deg",
    "power_dbm",
    "range_m",
    "chirp",
    "xt_m",
    "yt_m",
    "footprint",
    "beam_rad",
    "relative",
    "only_detected",
];

/// Every point in a row; a cell without a value is empty.
pub(super) fn csv(material: &Material) -> Result<Vec<u8>, CatalogueError> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let failed = |reason: csv::Error| unwritable(material, io::Error::other(reason));
    out.write_record(COLUMNS).map_err(failed)?;
    for curve in &material.curves {
        let kind = kind_of(material, &curve.source).map_or("unknown", SourceKind::as_str);
        let Illumination { footprint, beam_rad, relative, only_detected } = curve.illumination;
        let footprint = footprint.map(Footprint::as_str).unwrap_or_default();
        for o in &curve.observations {
            let record = [
                curve.name.clone(),
                kind.to_owned(),
                degrees(o.theta_i_rad),
                cell(o.sigma0.map(db_from_ratio), 4),
                o.censor.as_str().to_owned(),
                cell(o.threshold_sigma0.map(db_from_ratio), 4),
                degrees(o.theta_r_rad),
                degrees(o.delta_phi_rad),
                cell(o.theta_sd_rad.map(f64::to_degrees), 6),
                cell(o.power_w.map(dbm_from_watts), 4),
                cell(o.range_m, 6),
                o.chirp.map_or(String::new(), |chirp| chirp.to_string()),
                cell(o.target_m.map(|[xt_m, _]| xt_m + 0.0), 6),
                cell(o.target_m.map(|[_, yt_m]| yt_m + 0.0), 6),
                footprint.to_owned(),
                cell(beam_rad, 6),
                flag(relative),
                flag(only_detected),
            ];
            out.write_record(record).map_err(failed)?;
        }
    }
    out.into_inner().map_err(|error| unwritable(material, error.into_error()))
}

fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or(String::new(), |value| format!("{value:.decimals$}"))
}

fn flag(on: bool) -> String {
    if on { "1".to_owned() } else { String::new() }
}

/// An angle in degrees, never −0.
fn degrees(rad: f64) -> String {
    cell(Some(rad.to_degrees() + 0.0), 6)
}

fn unwritable(material: &Material, reason: io::Error) -> CatalogueError {
    let path = format!("material/{}.csv", material.slug);
    FilesError::unwritable("write", path.as_ref(), reason).into()
}
