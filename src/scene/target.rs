//! The target: all meshes of a scene in the global frame, as one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;

use super::error::SceneError;
use super::file::{BoxEntry, MeshEntry, SceneFile};
use super::read::read;
use super::regions::{MeshSpan, assign};
use super::{mannequin, solids};
use crate::formats::MeshFormat;
use crate::formats::text::nearest;
use crate::frames::{Global, Model, Point, Pose};
use crate::geometry::Mesh;
use crate::geometry::mesh::MeshError;

/// Everything a ray can hit, with a region for every facet.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// All meshes in the global frame, one after the other.
    pub mesh: Mesh,
    /// Where each of them came from.
    pub meshes: Vec<MeshReport>,
    /// The regions, in the order of the scene file.
    pub regions: Vec<Region>,
    /// Region of every facet.
    pub region_of_facet: Vec<u16>,
}

/// A named set of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Name.
    pub name: String,
    /// Material, as the scene file gives it.
    pub material: String,
    /// Direction of its grain in the global frame, of any length.
    pub grain: DVec3,
    /// Share of its diffuse return across the polarisation that was sent, 0 to 1/2.
    pub depolarised_share: f64,
    /// Thickness of the sheet of its material that it is, m.
    pub thickness_m: Option<f64>,
    /// Whether it is a sheet of the layers that its material's law has.
    pub transmits: bool,
    /// Facets it holds after later regions took theirs.
    pub facets: usize,
}

/// Where a mesh came from.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeshReport {
    /// Name in the scene.
    pub name: String,
    /// File or built-in, as the scene file gives it.
    pub file: String,
    /// BLAKE3 of the mesh file's bytes; none for a built-in mesh.
    pub file_blake3: Option<String>,
    /// BLAKE3 of vertices and facets as placed, so that equal hashes mean equal geometry.
    pub placed_blake3: String,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of facets.
    pub facets: usize,
    /// Number of facets without an area, which no ray hits.
    pub degenerate_facets: usize,
    /// Number of its first facet within the whole target.
    pub first_facet: usize,
}

/// No coordinate may be farther out than this, m; beyond, f32 would blur a radar's target.
const FARTHEST_M: f64 = 1e5;

/// A surface that is moved farther along its normals would cross itself.
const MOST_OFFSET_M: f64 = 1.0;

/// Built-in meshes. Cuboid, plate and sphere are of unit size: give them a `size_m`. The sphere's cap is of unit
/// diameter and the trihedral has legs of 1 m: give them a `scale`.
pub const BUILTIN_MESHES: [&str; 6] =
    ["mannequin", "cuboid", "plate", "sphere", "sphere-cap", "trihedral"];

/// Meshes that are in no file, in m, by the names after `given:`.
pub type GivenMeshes = BTreeMap<String, Mesh>;

/// What the file of a mesh begins with that is in no file.
const GIVEN: &str = "given:";

impl MeshEntry {
    /// The whole mesh of a file, where the file has it.
    pub fn of_file(name: &str, file: &str) -> MeshEntry {
        MeshEntry {
            name: name.to_owned(),
            file: file.to_owned(),
            scale: 1.0,
            size_m: None,
            rotation_deg: [0.0; 3],
            translation_m: [0.0; 3],
            offset_m: None,
            within_box: None,
        }
    }

    /// Whether it is read from a file, and is not built in or given.
    pub fn is_in_a_file(&self) -> bool {
        !self.file.starts_with("builtin:") && !self.file.starts_with(GIVEN)
    }
}

impl Target {
    /// Loads, places and joins the meshes of a scene, and assigns its regions.
    pub(crate) fn load(
        file: &SceneFile,
        path: &Path,
        given: &GivenMeshes,
    ) -> Result<Target, SceneError> {
        if file.mesh.is_empty() {
            return Err(value(path, "the scene", "has no mesh", "add a [[mesh]] table"));
        }
        let mut mesh = Mesh::default();
        let mut meshes: Vec<MeshReport> = Vec::new();
        for entry in &file.mesh {
            if meshes.iter().any(|earlier| earlier.name == entry.name) {
                let place = format!("mesh `{}`", entry.name);
                return Err(value(path, &place, "is defined twice", "rename one"));
            }
            let (loaded, file_blake3) = load_mesh(entry, path, given)?;
            let placed = put(loaded, entry, path)?;
            let at = |error| SceneError::Mesh { file: PathBuf::from(&entry.file), error };
            meshes.push(report(&placed, entry, file_blake3, mesh.facets.len()).map_err(at)?);
            match meshes.len() {
                // A scene mostly has one mesh, and that may be large: it is not copied.
                1 => mesh = placed,
                _ => mesh.append(&placed).map_err(at)?,
            }
        }
        let spans: Vec<MeshSpan> = meshes.iter().map(MeshReport::span).collect();
        let region_of_facet = assign(&mesh, &spans, &file.region)
            .map_err(|error| SceneError::Region { file: path.to_owned(), error })?;
        let regions = count_regions(file, &region_of_facet);
        check_grains(file, path)?;
        check_depolarised_shares(file, path)?;
        check_sheets(file, path)?;
        Ok(Target { mesh, meshes, regions, region_of_facet })
    }
}

impl Target {
    /// Whether a region lets a part of the wave through.
    pub fn transmits(&self) -> bool {
        self.regions.iter().any(|region| region.transmits || region.thickness_m.is_some())
    }
}

impl MeshReport {
    fn span(&self) -> MeshSpan {
        let first = self.first_facet;
        MeshSpan { name: self.name.clone(), first, end: first + self.facets }
    }
}

fn check_grains(file: &SceneFile, path: &Path) -> Result<(), SceneError> {
    let mut regions = file.region.iter();
    match regions.find(|region| {
        region.grain.is_some_and(|grain| !DVec3::from_array(grain).length().is_normal())
    }) {
        None => Ok(()),
        Some(region) => {
            let place = format!("region `{}`", region.name);
            let problem =
                format!("has grain = {:?}, which points nowhere", region.grain.unwrap_or_default());
            Err(value(path, &place, &problem, "give a direction, such as [0, 1, 0]"))
        }
    }
}

fn check_depolarised_shares(file: &SceneFile, path: &Path) -> Result<(), SceneError> {
    for region in &file.region {
        if !(0.0..=0.5).contains(&region.depolarised_share) {
            let place = format!("region `{}`", region.name);
            let problem = format!("has depolarised_share = {}", region.depolarised_share);
            let way_out = "give 0 to 0.5, which is an echo without any polarisation left";
            return Err(value(path, &place, &problem, way_out));
        }
    }
    Ok(())
}

/// A sheet has a thickness, by its own or by its material's law.
fn check_sheets(file: &SceneFile, path: &Path) -> Result<(), SceneError> {
    const MOST_M: f64 = 0.1;
    for region in &file.region {
        let refuse = |problem: &str, way_out: &str| {
            value(path, &format!("region `{}`", region.name), problem, way_out)
        };
        let Some(thickness_m) = region.thickness_m else { continue };
        if !(thickness_m > 0.0 && thickness_m <= MOST_M) {
            let problem = format!(
                "has thickness_m = {thickness_m}, which is not above 0 and at most {MOST_M}"
            );
            return Err(refuse(&problem, "give it in metres; 0.0005 is a shirt"));
        }
        if region.transmits {
            let problem = "has both thickness_m and transmits";
            let way_out = "keep thickness_m for a sheet of one material, transmits for a law with layers of its own";
            return Err(refuse(problem, way_out));
        }
    }
    Ok(())
}

fn count_regions(file: &SceneFile, region_of_facet: &[u16]) -> Vec<Region> {
    let mut facets = vec![0; file.region.len()];
    for &region in region_of_facet {
        facets[usize::from(region)] += 1;
    }
    std::iter::zip(&file.region, facets)
        .map(|(entry, facets)| Region {
            name: entry.name.clone(),
            material: entry.material.clone(),
            grain: entry.grain.map_or(DVec3::Y, DVec3::from_array),
            depolarised_share: entry.depolarised_share,
            thickness_m: entry.thickness_m,
            transmits: entry.transmits,
            facets,
        })
        .collect()
}

/// A mesh in its own frame, and the hash of its file.
fn load_mesh(
    entry: &MeshEntry,
    scene: &Path,
    given: &GivenMeshes,
) -> Result<(Mesh, Option<String>), SceneError> {
    if let Some(name) = entry.file.strip_prefix(GIVEN) {
        return given.get(name).map(|mesh| (mesh.clone(), None)).ok_or_else(|| {
            value(
                scene,
                &format!("mesh `{}`", entry.name),
                &format!("the mesh `{}` is one that a program gives, and none did", entry.file),
                "save it as a .ply, and name that file",
            )
        });
    }
    if let Some(name) = entry.file.strip_prefix("builtin:") {
        return builtin(name).map(|mesh| (mesh, None)).ok_or_else(|| {
            let known = BUILTIN_MESHES.join(", ");
            let way_out = match nearest(name, BUILTIN_MESHES) {
                Some(near) => format!("did you mean `builtin:{near}`?"),
                None => format!("the built-in meshes are {known}"),
            };
            value(
                scene,
                &format!("mesh `{}`", entry.name),
                &format!("no built-in mesh `{name}`"),
                &way_out,
            )
        });
    }
    let file = scene.parent().unwrap_or(Path::new("")).join(&entry.file);
    let extension = file.extension().unwrap_or_default().to_string_lossy();
    let Some(format) = MeshFormat::from_extension(&extension) else {
        let problem = format!("`{}` does not end in .ply, .obj or .stl", entry.file);
        let way_out = "convert the mesh to one of these";
        return Err(value(scene, &format!("mesh `{}`", entry.name), &problem, way_out));
    };
    let bytes = read(&file, "; meshes are looked for beside the scene file")?;
    let (mesh, hash) = rayon::join(|| format.read(&bytes), || blake3::hash(&bytes));
    let mesh = mesh.map_err(|error| SceneError::Format { file, error })?;
    Ok((mesh, Some(hash.to_hex().to_string())))
}

/// The mesh of an entry as its file has it; as for a scene at `path`.
///
/// # Errors
/// A mesh that cannot be read.
pub fn file_mesh(entry: &MeshEntry, path: &Path, given: &GivenMeshes) -> Result<Mesh, SceneError> {
    Ok(load_mesh(entry, path, given)?.0)
}

/// The mesh of an entry as a scene at `path` has it in the global frame.
///
/// # Errors
/// A mesh that cannot be read or placed.
pub fn placed_mesh(
    entry: &MeshEntry,
    path: &Path,
    given: &GivenMeshes,
) -> Result<Mesh, SceneError> {
    put(file_mesh(entry, path, given)?, entry, path)
}

/// Places a mesh and cuts it.
fn put(mesh: Mesh, entry: &MeshEntry, scene: &Path) -> Result<Mesh, SceneError> {
    cut(place(mesh, entry, scene)?, entry, scene)
}

fn builtin(name: &str) -> Option<Mesh> {
    // Coarse cells: a flat side needs no more than its corners.
    match name {
        "mannequin" => Some(mannequin::mannequin()),
        "cuboid" => Some(solids::cuboid(DVec3::ONE, 1.0)),
        "plate" => Some(solids::plate(1.0, 1.0)),
        "sphere" => Some(solids::icosphere(0.5, 5)),
        "sphere-cap" => Some(solids::sphere_cap(0.5, 0.25, 2.5e-3)),
        "trihedral" => Some(solids::trihedral(1.0)),
        _ => None,
    }
}

/// Scales, stretches, turns and shifts a mesh into the global frame.
fn place(mut mesh: Mesh, entry: &MeshEntry, scene: &Path) -> Result<Mesh, SceneError> {
    let refuse = |key: &str, problem: &str, way_out: &str| {
        value(scene, &format!("mesh `{}`: {key}", entry.name), problem, way_out)
    };
    if !(entry.scale > 0.0 && entry.scale.is_finite()) {
        return Err(refuse("scale", "must be a positive number", "use 0.001 for millimetres"));
    }
    let stretch = match entry.size_m.map(DVec3::from) {
        None => DVec3::ONE,
        Some(size) if size.is_finite() && size.cmpge(DVec3::ZERO).all() => {
            let extent = extent(&mesh) * entry.scale;
            DVec3::select(extent.cmpgt(DVec3::ZERO), size / extent, DVec3::ONE)
        }
        Some(_) => return Err(refuse("size_m", "must be three lengths", "give them in metres")),
    };
    let turn = DVec3::from(entry.rotation_deg.map(f64::to_radians));
    let shift = DVec3::from(entry.translation_m);
    if !turn.is_finite() || !shift.is_finite() {
        let key = "rotation_deg and translation_m";
        return Err(refuse(key, "must be finite", "mend the numbers"));
    }
    let global_from_model: Pose<Global, Model> = Pose::from_euler_xyz(turn, shift);
    mesh.vertices.par_iter_mut().for_each(|vertex| {
        *vertex = (global_from_model * Point::from(*vertex * entry.scale * stretch)).xyz;
    });
    let vertices = mesh.vertices.par_iter();
    match vertices.position_first(|v| !(v.is_finite() && v.abs().max_element() < FARTHEST_M)) {
        None => Ok(mesh),
        Some(vertex) => {
            let problem = format!("vertex {vertex} ends up more than {FARTHEST_M} m away");
            Err(refuse("placement", &problem, "check scale, size_m and translation_m"))
        }
    }
}

/// Moves a placed mesh outwards along its normals, and cuts away what lies outside of a box.
fn cut(mut mesh: Mesh, entry: &MeshEntry, scene: &Path) -> Result<Mesh, SceneError> {
    let refuse = |key: &str, problem: &str, way_out: &str| {
        value(scene, &format!("mesh `{}`: {key}", entry.name), problem, way_out)
    };
    if let Some(offset_m) = entry.offset_m {
        if offset_m.is_nan() || offset_m.abs() > MOST_OFFSET_M {
            let problem = format!("{offset_m} m is not within {MOST_OFFSET_M} m");
            return Err(refuse("offset_m", &problem, "cloth lies some millimetres above a body"));
        }
        let normals = mesh.vertex_normals();
        let moved = mesh.vertices.par_iter_mut().zip(normals);
        moved.for_each(|(vertex, normal)| *vertex += offset_m * normal);
    }
    let Some(BoxEntry { min_m, max_m }) = entry.within_box else { return Ok(mesh) };
    let (min, max) = (DVec3::from(min_m), DVec3::from(max_m));
    if !min.cmple(max).all() {
        let problem = "min_m is not below max_m";
        return Err(refuse("box", problem, "swap the coordinates"));
    }
    let is_within = |facet: usize| {
        let centroid = mesh.centroid(facet);
        centroid.cmpge(min).all() && centroid.cmple(max).all()
    };
    let kept: Vec<usize> = (0..mesh.facets.len()).filter(|&facet| is_within(facet)).collect();
    if kept.is_empty() {
        return Err(refuse("box", "the box holds no facet of the mesh", "move or widen it"));
    }
    Ok(mesh.only(&kept))
}

fn extent(mesh: &Mesh) -> DVec3 {
    let min = mesh.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let max = mesh.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    max - min
}

fn report(
    mesh: &Mesh,
    entry: &MeshEntry,
    file_blake3: Option<String>,
    first_facet: usize,
) -> Result<MeshReport, MeshError> {
    mesh.validate()?;
    let degenerate = (0..mesh.facets.len()).into_par_iter().filter(|&f| mesh.is_degenerate(f));
    let (degenerate_facets, placed_blake3) = rayon::join(|| degenerate.count(), || hash(mesh));
    if degenerate_facets == mesh.facets.len() {
        return Err(MeshError::NoArea { facets: degenerate_facets });
    }
    Ok(MeshReport {
        name: entry.name.clone(),
        file: entry.file.clone(),
        file_blake3,
        placed_blake3,
        vertices: mesh.vertices.len(),
        facets: mesh.facets.len(),
        degenerate_facets,
        first_facet,
    })
}

fn hash(mesh: &Mesh) -> String {
    /// Vertices or facets that are handed over at once.
    const TOGETHER: usize = 1024;
    let mut hasher = blake3::Hasher::new();
    for vertices in mesh.vertices.chunks(TOGETHER) {
        let bytes = vertices.iter().map(|vertex| vertex.to_array().map(f64::to_le_bytes));
        hasher.update(bytes.collect::<Vec<_>>().as_flattened().as_flattened());
    }
    for facets in mesh.facets.chunks(TOGETHER) {
        let bytes = facets.iter().map(|facet| facet.map(u32::to_le_bytes));
        hasher.update(bytes.collect::<Vec<_>>().as_flattened().as_flattened());
    }
    hasher.finalize().to_hex().to_string()
}

fn value(scene: &Path, place: &str, problem: &str, way_out: &str) -> SceneError {
    SceneError::Value {
        file: scene.to_owned(),
        place: place.to_owned(),
        problem: problem.to_owned(),
        way_out: way_out.to_owned(),
    }
}
