//! Files of meshes and clouds that the peers' own libraries wrote: every reader finds what was given to them.
//!
//! `tests/peers/corpus/make.py` writes the files and `oracle.json`, without this library. It reads each file back with
//! another library where there is one.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};

use glam::DVec3;
use matdb::formats::{MeshFormat, PointFormat, PointTable};
use matdb::geometry::Mesh;
use matdb::measure::{CloudError, CloudReading, PowerUnit};
use matdb::units::dbm_from_watts;
use serde::Deserialize;

use crate::support::root;

/// No coordinate of the geometries is greater, m: a change of a corner by a tolerance changes an area by a few times this.
const LARGEST_M: f64 = 2.5;

#[derive(Deserialize)]
struct Oracle {
    geometries: BTreeMap<String, Geometry>,
    /// Columns of one cloud: places, ranges, chirps, and powers in several units.
    cloud: BTreeMap<String, Vec<f64>>,
    files: BTreeMap<String, File>,
}

#[derive(Deserialize)]
struct Geometry {
    vertices: Vec<[f64; 3]>,
    /// Anticlockwise seen from outside.
    polygons: Vec<Vec<usize>>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum File {
    Mesh(MeshFile),
    Cloud(CloudFile),
}

#[derive(Deserialize)]
struct MeshFile {
    #[serde(default)]
    geometry: String,
    #[serde(default)]
    vertices: usize,
    #[serde(default)]
    tolerance_m: f64,
    /// For each property, the name of each polygon.
    #[serde(default)]
    labels: BTreeMap<String, Vec<String>>,
    refused: Option<String>,
}

#[derive(Deserialize)]
struct CloudFile {
    /// For the file's names of columns, those of the oracle.
    #[serde(default)]
    columns: BTreeMap<String, String>,
    #[serde(default)]
    tolerance_m: f64,
    /// Of powers in dB it is a difference, of others a quotient.
    #[serde(default)]
    tolerance_power: f64,
    /// The points that have a place, if others have none.
    rows: Option<Vec<usize>>,
    /// As `--columns` gives it.
    rename: Option<String>,
    #[serde(default)]
    power: String,
    metres_per_unit: Option<f64>,
    /// What was added to all places, m.
    #[serde(default)]
    shifted_m: [f64; 3],
    refused: Option<String>,
}

fn folder() -> PathBuf {
    root().join("tests/peers/corpus")
}

fn oracle() -> Oracle {
    let text = std::fs::read_to_string(folder().join("oracle.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn every_reader_finds_what_the_peers_wrote() {
    let oracle = oracle();
    let failures: Vec<String> = oracle
        .files
        .iter()
        .filter_map(|(name, file)| {
            let path = folder().join("files").join(name);
            let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
            let checked = match file {
                File::Mesh(file) => check_mesh(&oracle, &path, &bytes, file),
                File::Cloud(file) => check_cloud(&oracle, &path, &bytes, file),
            };
            checked.err().map(|said| format!("{name}: {said}"))
        })
        .collect();
    let files = oracle.files.len();
    assert!(failures.is_empty(), "{} of {files} files:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn the_corpus_and_its_oracle_name_the_same_files() {
    let files: BTreeSet<String> = std::fs::read_dir(folder().join("files"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let named: BTreeSet<String> = oracle().files.into_keys().collect();
    assert_eq!(files.difference(&named).collect::<Vec<_>>(), Vec::<&String>::new(), "no entry");
    assert_eq!(named.difference(&files).collect::<Vec<_>>(), Vec::<&String>::new(), "no file");
}

fn extension(path: &Path) -> &str {
    path.extension().unwrap().to_str().unwrap()
}

/// Whether a reader refused in these words.
fn check_refusal<T>(read: Result<T, impl Display>, words: &str) -> Result<(), String> {
    match read {
        Ok(_) => Err(format!("it is read, and should be refused with `{words}`")),
        Err(error) if error.to_string().contains(words) => Ok(()),
        Err(error) => Err(format!("`{error}` lacks `{words}`")),
    }
}

fn check_mesh(oracle: &Oracle, path: &Path, bytes: &[u8], file: &MeshFile) -> Result<(), String> {
    let read = MeshFormat::from_extension(extension(path)).unwrap().read(bytes);
    if let Some(words) = &file.refused {
        return check_refusal(read, words);
    }
    let mesh = read.map_err(|error| error.to_string())?;
    let geometry = &oracle.geometries[&file.geometry];
    if mesh.vertices.len() != file.vertices {
        return Err(format!("{} vertices instead of {}", mesh.vertices.len(), file.vertices));
    }
    let polygon_of_facet = polygons(&mesh, geometry, file.tolerance_m)?;
    for (property, names) in &file.labels {
        let found = mesh.labels.iter().find(|labels| labels.property == *property);
        let labels = found.ok_or_else(|| format!("no labels {property}"))?;
        for (facet, polygon) in polygon_of_facet.iter().enumerate() {
            let name = &labels.names[labels.name_of_facet[facet] as usize];
            if *name != names[*polygon] {
                return Err(format!(
                    "{property} of polygon {polygon} is `{name}`, not `{}`",
                    names[*polygon]
                ));
            }
        }
    }
    Ok(())
}

/// The polygon of each facet. Each polygon must be covered by as many facets as its corners ask for, which run around like it
/// and have its area.
fn polygons(mesh: &Mesh, geometry: &Geometry, tolerance_m: f64) -> Result<Vec<usize>, String> {
    let corners: Vec<DVec3> = geometry.vertices.iter().copied().map(DVec3::from).collect();
    let number = |vertex: DVec3| {
        corners.iter().position(|corner| (*corner - vertex).abs().max_element() <= tolerance_m)
    };
    let number_of_vertex: Vec<Option<usize>> =
        mesh.vertices.iter().map(|vertex| number(*vertex)).collect();
    let mut facets = vec![0; geometry.polygons.len()];
    let mut areas = vec![DVec3::ZERO; geometry.polygons.len()];
    let mut polygon_of_facet = Vec::new();
    for (facet, indices) in mesh.facets.iter().enumerate() {
        let [Some(a), Some(b), Some(c)] = indices.map(|index| number_of_vertex[index as usize])
        else {
            return Err(format!("facet {facet} has the corners {:?}", mesh.corners(facet)));
        };
        let polygon = geometry.polygons.iter().position(|polygon| runs_along(polygon, [a, b, c]));
        let polygon = polygon.ok_or_else(|| format!("no polygon has the facet {a} {b} {c}"))?;
        facets[polygon] += 1;
        areas[polygon] += mesh.area_normal(facet);
        polygon_of_facet.push(polygon);
    }
    for (polygon, indices) in geometry.polygons.iter().enumerate() {
        if facets[polygon] + 2 != indices.len() {
            return Err(format!("polygon {polygon} has {} facets", facets[polygon]));
        }
        let [first, ref others @ ..] = indices[..] else { panic!("polygon {polygon} is empty") };
        let fan = others.array_windows().map(|[second, third]| {
            (corners[*second] - corners[first]).cross(corners[*third] - corners[first])
        });
        let off = (areas[polygon] - fan.sum::<DVec3>()).length();
        if off > 20.0 * LARGEST_M * tolerance_m.max(1e-15) {
            return Err(format!("the area of polygon {polygon} is off by {off:e} m²"));
        }
    }
    Ok(polygon_of_facet)
}

/// Whether three corners come in a polygon in this order, wherever it begins.
fn runs_along(polygon: &[usize], corners: [usize; 3]) -> bool {
    let places = corners.map(|corner| polygon.iter().position(|vertex| *vertex == corner));
    let [Some(a), Some(b), Some(c)] = places else { return false };
    [(a, b, c), (b, c, a), (c, a, b)].into_iter().any(|(a, b, c)| a < b && b < c)
}

fn check_cloud(oracle: &Oracle, path: &Path, bytes: &[u8], file: &CloudFile) -> Result<(), String> {
    let format = PointFormat::from_extension(extension(path)).unwrap();
    let power = match file.power.as_str() {
        "w" => PowerUnit::Watt,
        "db" => PowerUnit::RelativeDb,
        "counts" => PowerUnit::Counts,
        _ => PowerUnit::Dbm,
    };
    let columns = file.rename.as_deref().map(|names| names.parse().unwrap()).unwrap_or_default();
    let metres_per_unit = file.metres_per_unit.unwrap_or(1.0);
    let reading = CloudReading { columns, power, metres_per_unit, ..CloudReading::default() };
    let read = reading.read(format, bytes);
    if !file.columns.is_empty() {
        check_table(oracle, format, bytes, file)?;
    }
    if let Some(words) = &file.refused {
        return check_refusal(read, words);
    }
    let cloud = read.map_err(|error: CloudError| error.to_string())?;
    let has = |ours: &str| file.columns.values().any(|column| column == ours);
    let expected = |ours: &str| rows(&oracle.cloud[ours], file);
    let count = expected("x").len();
    if cloud.points().len() != count {
        return Err(format!("{} points instead of {count}", cloud.points().len()));
    }
    let compare = |what: &str, expected: &[f64], found: Vec<f64>, tolerance: f64| {
        let off = std::iter::zip(expected, &found).map(|(a, b)| (a - b).abs());
        let worst = off.fold(0.0, |worst, off| if off <= worst { worst } else { off });
        let is_near = worst <= tolerance;
        is_near.then_some(()).ok_or_else(|| format!("{what} is off by {worst:e}"))
    };
    let points = cloud.points();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let found = points.iter().map(|point| point.point.xyz[axis] - file.shifted_m[axis]);
        compare(name, &expected(name), found.collect(), file.tolerance_m + rounding_m(file))?;
    }
    if has("range_m") {
        let found = points.iter().map(|point| point.range_m.unwrap_or(f64::NAN));
        compare("range", &expected("range_m"), found.collect(), file.tolerance_m)?;
    }
    if has("chirp") {
        let found = points.iter().map(|point| point.chirp.map_or(f64::NAN, f64::from));
        compare("chirp", &expected("chirp"), found.collect(), 0.0)?;
    }
    // Relative powers are those of the strongest point.
    let powers_w = points.iter().map(|point| point.power_w);
    let powers_dbm = powers_w.clone().map(dbm_from_watts);
    let column = file.columns.values().find(|column| {
        ["power_dbm", "power_w", "power_db", "counts", "red"].contains(&column.as_str())
    });
    let powers = expected(column.ok_or("the oracle has no powers")?);
    let strongest = powers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rounding = 1e-12;
    let tolerance = file.tolerance_power + rounding;
    match power {
        PowerUnit::Dbm => compare("power", &powers, powers_dbm.collect(), tolerance),
        PowerUnit::RelativeDb => {
            let powers: Vec<f64> = powers.iter().map(|power| power - strongest).collect();
            compare("power", &powers, powers_dbm.collect(), 2.0 * tolerance)
        }
        PowerUnit::Watt | PowerUnit::Counts => {
            let unit_w = if power == PowerUnit::Watt { 1.0 } else { 1e-3 / strongest };
            let quotients = std::iter::zip(powers_w, &powers).map(|(a, b)| a / (b * unit_w));
            compare("power", &vec![1.0; count], quotients.collect(), tolerance)
        }
    }
}

/// How much places that were added to are rounded, m.
fn rounding_m(file: &CloudFile) -> f64 {
    file.shifted_m.into_iter().fold(0.0, f64::max) * f64::EPSILON
}

/// The rows of a column that have a place.
fn rows(column: &[f64], file: &CloudFile) -> Vec<f64> {
    match &file.rows {
        Some(rows) => rows.iter().map(|row| column[*row]).collect(),
        None => column.to_vec(),
    }
}

/// The columns as the table of the file has them, in the file's units.
fn check_table(
    oracle: &Oracle,
    format: PointFormat,
    bytes: &[u8],
    file: &CloudFile,
) -> Result<(), String> {
    let mut table = PointTable::read(format, bytes).map_err(|error| error.to_string())?;
    table.pass_over_empty(&["x", "y", "z"]);
    for (theirs, ours) in &file.columns {
        let column = table.column(theirs).map_err(|error| error.to_string())?;
        let found = column.ok_or_else(|| format!("no column {theirs}: {:?}", table.names()))?;
        let expected = rows(&oracle.cloud[ours], file);
        if found.len() != expected.len() {
            return Err(format!("{} values of {theirs}", found.len()));
        }
        let axis = ["x", "y", "z"].iter().position(|axis| axis == ours);
        for (found, expected) in std::iter::zip(found, expected) {
            let (off, tolerance) = match axis {
                Some(axis) => {
                    let metres = found * file.metres_per_unit.unwrap_or(1.0);
                    let off = metres - file.shifted_m[axis] - expected;
                    (off, file.tolerance_m + rounding_m(file))
                }
                None if ours == "chirp" => (found - expected, 0.0),
                None if ours == "range_m" => (found - expected, file.tolerance_m),
                None if ["power_dbm", "power_db"].contains(&ours.as_str()) => {
                    (found - expected, file.tolerance_power)
                }
                None => (found / expected - 1.0, file.tolerance_power),
            };
            if off.is_nan() || off.abs() > tolerance {
                return Err(format!("{theirs} is {found} instead of {expected}"));
            }
        }
    }
    Ok(())
}
