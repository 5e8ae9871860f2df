//! `residuals.csv`: a line for every chirp that meets the target, or for every level of a curve.

use std::fmt::Write;

use crate::diagnose::Row;
use crate::diagnose::curve::CurveRow;
use crate::units::dbm_from_watts;

const COLUMNS: [&str; 17] = [
    "chirp",
    "observed_dbm",
    "before_dbm",
    "after_dbm",
    "z_before",
    "z_after",
    "fold",
    "theta_deg",
    "azimuth_deg",
    "range_m",
    "range_residual_m",
    "xt_m",
    "yt_m",
    "edge_m",
    "time_s",
    "region",
    "unknown_db",
];

/// The chirps of a cloud as the bytes of a file; a cell is empty where nothing was detected.
pub(super) fn of_cloud(rows: &[Row]) -> Vec<u8> {
    let has_several = rows.iter().any(|row| row.scan > 0);
    let mut text = if has_several { "cloud," } else { "" }.to_owned() + &COLUMNS.join(",") + "\n";
    for row in rows {
        if has_several {
            text += &format!("{},", row.scan + 1);
        }
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{:.4},{:.4},{:.4},{:.4},{},{:.4},{:.4},{:.5},{},{:.5},{:.5},{:.5},{:.6},{},{:.4}",
            row.chirp,
            cell(row.observed_w.map(dbm_from_watts), 4),
            dbm_from_watts(row.before_w),
            dbm_from_watts(row.after_w),
            row.z_before,
            row.z_after,
            row.fold,
            row.theta_rad.to_degrees(),
            row.azimuth_rad.to_degrees(),
            row.range_m,
            cell(row.range_residual_m, 6),
            row.xt_m,
            row.yt_m,
            row.edge_m,
            row.time_s,
            row.region,
            row.unknown_db,
        );
    }
    text.into_bytes()
}

/// The levels of a curve as the bytes of a file.
pub(super) fn of_curve(rows: &[CurveRow]) -> Vec<u8> {
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

fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or(String::new(), |value| format!("{value:.decimals$}"))
}
