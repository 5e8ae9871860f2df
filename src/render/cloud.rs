//! Detections as a point cloud.

use super::Echo;
use crate::formats::ply::{Column, Scalar, Table};

/// The cloud's table: position in the global frame (double), then what the radar and the renderer
/// know of each point.
///
/// `regions` and `materials` are written into the header, so that the numbers keep their names.
pub fn cloud_table(
    echoes: &[&Echo],
    material_of_region: &[u16],
    regions: &[&str],
    materials: &[&str],
) -> Table {
    let column = |name: &str, scalar: Scalar, value: &dyn Fn(&Echo) -> f64| Column {
        name: name.to_owned(),
        scalar,
        values: echoes.iter().map(|echo| value(echo)).collect(),
    };
    let material = |e: &Echo| f64::from(material_of_region[usize::from(e.region)]);
    let columns = vec![
        column("x", Scalar::Double, &|e| e.hit.point.xyz.x),
        column("y", Scalar::Double, &|e| e.hit.point.xyz.y),
        column("z", Scalar::Double, &|e| e.hit.point.xyz.z),
        column("xt_m", Scalar::Float, &|e| e.xt_m),
        column("yt_m", Scalar::Float, &|e| e.yt_m),
        column("range_m", Scalar::Float, &|e| e.hit.range_m),
        column("power_dbm", Scalar::Float, &|e| e.power_dbm),
        column("incidence_deg", Scalar::Float, &|e| e.hit.theta_rad().to_degrees()),
        column("incidence_sd_deg", Scalar::Float, &|e| e.theta_sd_rad.to_degrees()),
        column("chirp", Scalar::Int, &|e| e.chirp.into()),
        column("facet", Scalar::Int, &|e| e.hit.facet.into()),
        column("region", Scalar::Int, &|e| e.region.into()),
        column("material", Scalar::Int, &material),
    ];
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
