//! The data of `view.html`, as its script reads them.

use glam::DVec3;
use serde::Serialize;

use crate::error::Error;
use crate::formats::base64::base64;
use crate::geometry::Mesh;
use crate::report::templates;

/// A cloud in three dimensions, with what stands around it.
#[derive(Serialize)]
pub(in crate::report) struct ViewPage<'a> {
    pub title: &'a str,
    pub made_by: &'static str,
    pub kind: Kind,
    pub points: Points,
    pub mesh: Option<Surface>,
    pub radar: Option<Instrument>,
    pub image: Option<PowerImage>,
    pub shapes: Vec<Outlines>,
    pub curve: Option<Curve>,
}

/// What a cloud is.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::report) enum Kind {
    Render,
    Diagnosis,
}

/// The points of a cloud.
#[derive(Serialize)]
pub(in crate::report) struct Points {
    pub count: usize,
    /// In the global frame, three numbers a point.
    pub position_m: Numbers,
    pub columns: Vec<Values>,
}

/// One value of every point.
#[derive(Serialize)]
pub(in crate::report) struct Values {
    name: String,
    label: String,
    unit: &'static str,
    values: Numbers,
    /// Where the values are numbers of names: the names.
    #[serde(skip_serializing_if = "Option::is_none")]
    names: Option<Vec<String>>,
}

/// The target.
#[derive(Serialize)]
pub(in crate::report) struct Surface {
    vertices_m: Numbers,
    triangles: Numbers,
}

/// Where the radar stands and looks.
#[derive(Serialize)]
pub(in crate::report) struct Instrument {
    pub origin_m: [f64; 3],
    pub target_m: [f64; 3],
    /// Where the beam meets the target plane, from chirp to chirp.
    pub path_m: Numbers,
    /// Outline of the spot there.
    pub spot_m: Numbers,
}

/// The power image, and where it lies.
#[derive(Serialize)]
pub(in crate::report) struct PowerImage {
    /// Bytes of a PNG file, a pixel each.
    pub png: String,
    pub rows: usize,
    pub columns: usize,
    /// Centre of the first pixel, m.
    pub from_m: [f64; 2],
    pub step_m: [f64; 2],
    pub x_column: &'static str,
    pub y_column: &'static str,
}

/// Where an effect that was found acts.
#[derive(Serialize)]
pub(in crate::report) struct Outlines {
    pub label: String,
    pub lines_m: Numbers,
}

/// Two columns that are drawn as a curve.
#[derive(Serialize)]
pub(in crate::report) struct Curve {
    pub x: &'static str,
    pub y: &'static str,
}

/// Numbers as text: little-endian bytes in base64.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::report) enum Numbers {
    F32(String),
    U16(String),
    U32(String),
}

impl Numbers {
    pub fn floats(values: impl Iterator<Item = f64>) -> Numbers {
        Numbers::F32(base64(
            &values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>(),
        ))
    }

    pub fn places(places: impl Iterator<Item = DVec3>) -> Numbers {
        Numbers::floats(places.flat_map(|place| place.to_array()))
    }
}

impl Values {
    /// Numbers; the end of a column's name is its unit.
    pub fn numbers(name: &str, values: impl Iterator<Item = f64>) -> Values {
        const UNITS: [(&str, &str); 6] = [
            ("_dbm", "dBm"),
            ("_db", "dB"),
            ("_deg", "°"),
            ("_rad", "rad"),
            ("_m", "m"),
            ("_s", "s"),
        ];
        let (stem, unit) = UNITS
            .iter()
            .find_map(|(end, unit)| Some((name.strip_suffix(end)?, *unit)))
            .unwrap_or((name, ""));
        let (label, values) = (stem.replace('_', " "), Numbers::floats(values));
        Values { name: name.to_owned(), label, unit, values, names: None }
    }

    /// Numbers of names. What has none gets a name of its own, `other`.
    pub fn named(
        name: &str,
        names: &[&str],
        other: &str,
        numbers: impl Iterator<Item = Option<usize>>,
    ) -> Values {
        let last = names.len().min(usize::from(u16::MAX));
        let numbers = numbers.map(|number| number.map_or(last, |known| known.min(last)) as u16);
        let bytes: Vec<u8> = numbers.flat_map(u16::to_le_bytes).collect();
        let names = names.iter().chain([&other]).map(|name| (*name).to_owned()).collect();
        let values = Numbers::U16(base64(&bytes));
        Values {
            name: name.to_owned(),
            label: name.to_owned(),
            unit: "",
            values,
            names: Some(names),
        }
    }
}

impl Surface {
    /// A mesh; none of one that would make the page slow to load.
    pub fn of(mesh: &Mesh) -> Option<Surface> {
        const MOST_FACETS: usize = 300_000;
        if mesh.facets.is_empty() || mesh.facets.len() > MOST_FACETS {
            return None;
        }
        let corners = mesh.facets.iter().flatten().flat_map(|corner| corner.to_le_bytes());
        let triangles = Numbers::U32(base64(&corners.collect::<Vec<u8>>()));
        Some(Surface { vertices_m: Numbers::places(mesh.vertices.iter().copied()), triangles })
    }
}

impl ViewPage<'_> {
    /// The page as bytes.
    ///
    /// # Errors
    /// A number that JSON does not have.
    pub fn bytes(&self) -> Result<Vec<u8>, Error> {
        #[derive(Serialize)]
        struct Context<'a> {
            title: &'a str,
            data: String,
        }
        let data = serde_json::to_string(self)?;
        templates::page("view.html", &Context { title: self.title, data })
    }
}
