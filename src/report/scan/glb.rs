//! `cloud.glb`: a cloud and its target for programs that show scenes in three dimensions.

use glam::DVec3;
use serde_json::json;

use crate::error::Error;
use crate::formats::figure::{Ink, colours_of};
use crate::formats::glb::{self, Cloud, Model, Paint, Surface};
use crate::formats::ply::Table;
use crate::scene::Scene;

/// How much a region hides that lets a part of the wave through.
const OPACITY_OF_SHEETS: f32 = 0.35;

/// The bytes of `cloud.glb`: a cloud as a rendering of this scene has it, with colours by power, and the regions of its
/// target in the colours of their materials. The frame is the scene's. A point without a power is left out.
///
/// # Errors
/// More than 4 GiB, which the format cannot hold.
pub fn rendering_glb(scene: &Scene, cloud: &Table) -> Result<Vec<u8>, Error> {
    let target = &scene.target;
    let mut paints: Vec<Paint> = Vec::new();
    let mut surfaces = Vec::new();
    for (number, region) in (0u16..).zip(&target.regions) {
        let opacity = if region.transmits { OPACITY_OF_SHEETS } else { 1.0 };
        let name = region.material.as_str();
        let known = paints.iter().position(|one| one.name == name && one.opacity == opacity);
        let paint = known.unwrap_or(paints.len());
        if known.is_none() {
            paints.push(Paint { name, colour: Ink::Own(paint).colour(), opacity });
        }
        let facets = std::iter::zip(&target.mesh.facets, &target.region_of_facet);
        let facets = facets.filter(|(_, own)| **own == number).map(|(facet, _)| *facet).collect();
        let vertices_m = &target.mesh.vertices;
        surfaces.push(Surface { name: &region.name, paint, vertices_m, facets });
    }
    let extras = json!({
        "unit": "m",
        "frame": "the global frame of the scene, y up",
    });
    let name = scene.file.name.as_str();
    Ok(glb::write(&Model { name, cloud: points(cloud), paints, surfaces, extras })?)
}

fn points(cloud: &Table) -> Cloud {
    let [x, y, z, powers_dbm, ranges_m] =
        ["x", "y", "z", "power_dbm", "range_m"].map(|name| cloud.column(name).unwrap_or_default());
    let is_whole = |row: &usize| {
        [x, y, z, powers_dbm, ranges_m].iter().all(|column| (column[*row] as f32).is_finite())
    };
    let rows: Vec<usize> = (0..cloud.rows()).filter(is_whole).collect();
    let [powers_dbm, ranges_m] = [powers_dbm, ranges_m]
        .map(|column| rows.iter().map(|row| column[*row] as f32).collect::<Vec<f32>>());
    let [least, most] = [f32::min, f32::max].map(|outer| powers_dbm.iter().copied().reduce(outer));
    let extras = json!({
        "_POWER_DBM": "received power, dBm",
        "_RANGE_M": "range, m",
        "COLOR_0": "received power, from the least in blue to the greatest in yellow",
        "least_dbm": least,
        "greatest_dbm": most,
    });
    Cloud {
        places_m: rows.iter().map(|row| DVec3::new(x[*row], y[*row], z[*row])).collect(),
        colours: colours_of(&powers_dbm),
        values: vec![("power_dbm", powers_dbm), ("range_m", ranges_m)],
        extras,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ply::{Column, Scalar};

    #[test]
    fn points_without_a_power_are_left_out() {
        let column = |name: &str, values: [f64; 3]| Column {
            name: name.to_owned(),
            scalar: Scalar::Double,
            values: values.to_vec(),
        };
        let columns = vec![
            column("x", [0.0, 1.0, 2.0]),
            column("y", [1.1; 3]),
            column("z", [0.0; 3]),
            column("range_m", [8.0; 3]),
            column("power_dbm", [-60.0, f64::NEG_INFINITY, -20.0]),
        ];
        let cloud = points(&Table { comments: vec![], columns });
        assert_eq!(cloud.places_m.iter().map(|place| place.x).collect::<Vec<_>>(), [0.0, 2.0]);
        assert_eq!(cloud.colours, [[68, 1, 84], [253, 231, 37]]);
        assert_eq!([&cloud.extras["least_dbm"], &cloud.extras["greatest_dbm"]], [-60.0, -20.0]);
        assert_eq!(points(&Table::default()).places_m, []);
    }
}
