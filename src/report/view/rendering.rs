//! `view.html` of a rendering.

use super::around::{instrument, plane_image};
use super::page::{Curve, Numbers, Points, Surface, Values, ViewPage};
use crate::error::Error;
use crate::formats::figure::Scale;
use crate::formats::ply::{Column, Table};
use crate::geometry::Raster;
use crate::render::COLOURS;
use crate::scene::Scene;

/// What a false alarm has in place of a region and a material.
const FALSE_ALARM: &str = "false alarm";

/// The bytes of `view.html`: a page of a cloud as a rendering of this scene has it, of its target, its radar and its image.
/// `materials` are the names of the numbers in the column `material`.
///
/// # Errors
/// A raster without power.
pub fn rendering_page(
    scene: &Scene,
    cloud: &Table,
    image: &Raster,
    materials: &[&str],
) -> Result<Vec<u8>, Error> {
    let regions: Vec<&str> = scene.target.regions.iter().map(|one| one.name.as_str()).collect();
    let colours = (Scale::Sequential, None);
    let image = plane_image(image, "power_dbm", colours, "Received power".to_owned())?;
    let page = ViewPage {
        title: &scene.file.name,
        kind: "Rendered cloud",
        notes: Surface::left_out(&scene.target.mesh).into_iter().collect(),
        points: points(cloud, &[("region", &regions), ("material", materials)]),
        mesh: Surface::of(&scene.target.mesh),
        radar: instrument(scene.radar(), &scene.chirps),
        image: Some(image),
        shapes: Vec::new(),
        curve: Curve { x: "incidence_deg", y: "power_dbm" },
        balls: None,
    };
    page.bytes()
}

/// The points of a table. `named`: columns whose numbers are those of names.
fn points(cloud: &Table, named: &[(&str, &[&str])]) -> Points {
    let axes = ["x", "y", "z"].map(|axis| cloud.column(axis).unwrap_or_default());
    let mut columns: Vec<&Column> =
        cloud.columns.iter().filter(|column| is_shown(&column.name)).collect();
    // The first column gives the colours.
    columns.sort_by_key(|column| column.name != "power_dbm");
    let columns = columns.into_iter().map(|column| {
        let names = named.iter().find(|(name, _)| *name == column.name);
        let values = column.values.iter().copied();
        if column.name == "rank" {
            return Values::ranks(values.map(|rank| Some(rank as u32)));
        }
        names.map_or_else(
            || Values::numbers(&column.name, values.clone()),
            |(name, names)| {
                let numbers = values.clone().map(|value| (value >= 0.0).then_some(value as usize));
                Values::named(name, names, FALSE_ALARM, numbers)
            },
        )
    });
    Points {
        count: cloud.rows(),
        position_m: Numbers::floats((0..cloud.rows()).flat_map(|row| axes.map(|axis| axis[row]))),
        columns: columns.collect(),
    }
}

/// Whether a column of this name is a value of a point, and neither its place nor its colour.
fn is_shown(name: &str) -> bool {
    !["x", "y", "z"].contains(&name) && !COLOURS.contains(&name)
}
