//! One material's curve as Apache Parquet, in SI units: the columns of the table `observation` that say
//! what was measured. Units stand in the metadata under `ucum`, what it is and from whom under `about`.
//!
//! Lost: everything but the curve.

use super::error::ExchangeError;
use super::export_files::Export;
use super::plain_csv::describe;
use super::subject::Subject;
use crate::catalogue::tables::parquet_of;
use crate::store::{Cell, Column, ColumnKind, Table};

/// Writes the curve, or what the model says at every degree.
pub(super) fn write(subject: &Subject, name: &str) -> Result<Export, ExchangeError> {
    let points = subject.points();
    let columns = vec![
        real("theta_i_rad"),
        real("theta_r_rad"),
        real("delta_phi_rad"),
        real("sigma0"),
        Column { name: "censor".to_owned(), kind: ColumnKind::Text, required: true },
        real("threshold_sigma0"),
        real("theta_sd_rad"),
        real("power_w"),
        real("range_m"),
        real("xt_m"),
        real("yt_m"),
        Column { name: "footprint".to_owned(), kind: ColumnKind::Text, required: false },
        real("beam_rad"),
        whole("relative"),
        whole("only_detected"),
    ];
    let table =
        Table { name: "observation".to_owned(), columns, key: Vec::new(), references: Vec::new() };
    let cell = |value: Option<f64>| value.map_or(Cell::Null, Cell::Real);
    let lit = points.curve.map(|curve| curve.illumination).unwrap_or_default();
    let footprint = lit.footprint.map_or(Cell::Null, |form| Cell::Text(form.as_str()));
    let rows = points.observations.iter().map(|point| {
        vec![
            Cell::Real(point.theta_i_rad),
            Cell::Real(point.theta_r_rad),
            Cell::Real(point.delta_phi_rad),
            cell(point.sigma0),
            Cell::Text(point.censor.as_str()),
            cell(point.threshold_sigma0),
            cell(point.theta_sd_rad),
            cell(point.power_w),
            cell(point.range_m),
            cell(point.target_m.map(|[xt_m, _]| xt_m)),
            cell(point.target_m.map(|[_, yt_m]| yt_m)),
            footprint,
            cell(lit.beam_rad),
            Cell::Integer(i64::from(lit.relative)),
            Cell::Integer(i64::from(lit.only_detected)),
        ]
    });
    let about = format!("{}\n{} GHz", subject.about().join("\n"), points.frequency_hz / 1e9);
    let bytes = parquet_of(&table, &about, rows)
        .map_err(|problem| ExchangeError::encoding("Parquet", problem))?;
    let lost = format!(
        "the file holds {}; nothing else of the material has a column there",
        describe(&points)
    );
    Ok(Export { files: vec![(name.to_owned(), bytes)], lost })
}

fn whole(name: &str) -> Column {
    Column { name: name.to_owned(), kind: ColumnKind::Integer, required: true }
}

fn real(name: &str) -> Column {
    Column { name: name.to_owned(), kind: ColumnKind::Real, required: false }
}
