//! Detections as a point cloud.

use super::echo::{Echo, Truth};
use crate::formats::ply::{Column, Scalar, Table};
use crate::units::{db_from_ratio, dbm_from_watts};

/// Columns of [`cloud_table`] that no measurement has, or that follow from its others.
pub const BESIDE_THE_MEASURED: [&str; 16] = [
    "xt_m",
    "yt_m",
    "incidence_deg",
    "incidence_sd_deg",
    "azimuth_deg",
    "edge_m",
    "specular_share",
    "surfaces",
    "facet",
    "region",
    "material",
    "phase_rad",
    "rank",
    "sheets",
    "passed_db",
    "true_range_m",
];

/// Columns of the colours of points: what other programs show, and no measurement.
pub const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// The table of a point cloud: position in the global frame (double), then the measured values and the true cause of
/// each point. The cause of a false alarm is NaN, or −1 for whole numbers.
///
/// The names of `regions` and `materials` are written into the header. With `several`, for a radar that reports or a target
/// that gives several echoes per chirp, there are four columns more: the echo's rank, and the sheets in front of what caused it, what they let through, and
/// its true range.
pub fn cloud_table(
    echoes: &[&Echo],
    material_of_region: &[u16],
    regions: &[&str],
    materials: &[&str],
    several: bool,
) -> Table {
    let column = |name: &str, scalar: Scalar, value: &dyn Fn(&Echo) -> f64| Column {
        name: name.to_owned(),
        scalar,
        values: echoes.iter().map(|echo| value(echo)).collect(),
    };
    let known = |name: &str, value: &dyn Fn(&Truth) -> f64| {
        column(name, Scalar::Float, &|echo| echo.truth.as_ref().map_or(f64::NAN, value))
    };
    let number = |name: &str, value: &dyn Fn(&Truth) -> i64| {
        column(name, Scalar::Int, &|echo| echo.truth.as_ref().map_or(-1, value) as f64)
    };
    let material = |t: &Truth| material_of_region[usize::from(t.region)].into();
    let mut columns = vec![
        column("x", Scalar::Double, &|e| e.point.xyz.x),
        column("y", Scalar::Double, &|e| e.point.xyz.y),
        column("z", Scalar::Double, &|e| e.point.xyz.z),
        column("xt_m", Scalar::Float, &|e| e.xt_m),
        column("yt_m", Scalar::Float, &|e| e.yt_m),
        column("range_m", Scalar::Float, &|e| e.range_m),
        column("power_dbm", Scalar::Float, &|e| dbm_from_watts(e.power_w)),
        known("incidence_deg", &|t| t.hit.theta_rad().to_degrees()),
        known("incidence_sd_deg", &|t| t.theta_sd_rad.to_degrees()),
        known("azimuth_deg", &|t| t.azimuth_rad.to_degrees()),
        known("edge_m", &|t| t.edge_m),
        known("specular_share", &|t| t.specular_share),
        column("chirp", Scalar::Int, &|e| e.chirp.into()),
        number("surfaces", &|t| t.surfaces.into()),
        number("facet", &|t| t.hit.facet.into()),
        number("region", &|t| t.region.into()),
        number("material", &material),
    ];
    if echoes.iter().any(|echo| echo.phase_rad.is_some()) {
        let phase_rad = |echo: &Echo| echo.phase_rad.unwrap_or(f64::NAN);
        columns.push(column("phase_rad", Scalar::Double, &phase_rad));
    }
    if several {
        columns.push(column("rank", Scalar::Int, &|e| e.rank.into()));
        columns.push(number("sheets", &|t| t.sheets.into()));
        columns.push(known("passed_db", &|t| db_from_ratio(t.passed_share)));
        columns.push(known("true_range_m", &|t| t.hit.range_m));
    }
    let named = |kind: &'static str| {
        move |(number, name): (usize, &&str)| format!("{kind} {number} {name}")
    };
    let comments = ["matdb point cloud: x y z in the global frame, m".to_owned()]
        .into_iter()
        .chain(regions.iter().enumerate().map(named("region")))
        .chain(materials.iter().enumerate().map(named("material")))
        .collect();
    Table { comments, columns }
}
