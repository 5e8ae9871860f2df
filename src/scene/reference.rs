//! A calibration target: a built-in plate, sphere or corner whose return is known in closed form.

use std::path::Path;

use glam::DVec3;

use super::error::SceneError;
use super::load::Scene;

/// A calibration target in the global frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceTarget {
    /// Name of its mesh.
    pub name: String,
    /// What it is and where it stands.
    pub shape: ReferenceShape,
    /// Region of its facets.
    pub region: u16,
}

/// The targets of which the return is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferenceShape {
    /// A flat plate.
    Plate {
        /// Its middle, m.
        middle: DVec3,
        /// Half of its two sides, at right angles, m.
        half_sides: [DVec3; 2],
    },
    /// A sphere.
    Sphere {
        /// Its centre, m.
        centre: DVec3,
        /// Its radius, m.
        radius_m: f64,
    },
    /// A corner of three triangles at right angles.
    Corner {
        /// Where they meet, m.
        apex: DVec3,
        /// From there along the edges in which two of them meet, m.
        legs: [DVec3; 3],
    },
}

impl ReferenceShape {
    /// What a person calls it.
    pub fn name(&self) -> &'static str {
        match self {
            ReferenceShape::Plate { .. } => "plate",
            ReferenceShape::Sphere { .. } => "sphere",
            ReferenceShape::Corner { .. } => "corner",
        }
    }
}

/// Rounding of a placed vertex, relative.
const ROUNDING: f64 = 1e-6;

impl Scene {
    /// The calibration target of the scene, which has nothing else in it; `path` names the scene in errors.
    ///
    /// # Errors
    /// Other meshes, a target that is stretched out of shape, or one of several regions.
    pub fn reference_target(&self, path: &Path) -> Result<ReferenceTarget, SceneError> {
        let refuse = |place: &str, problem: &str, way_out: &str| SceneError::Value {
            file: path.to_owned(),
            place: place.to_owned(),
            problem: problem.to_owned(),
            way_out: way_out.to_owned(),
        };
        let builtin = match &self.file.mesh[..] {
            [mesh] => mesh.file.strip_prefix("builtin:").map(|name| (mesh, name)),
            _ => None,
        };
        let vertices = &self.target.mesh.vertices;
        let (mesh, shape) = match builtin {
            Some((mesh, "plate")) => (mesh, plate(vertices)),
            Some((mesh, "sphere" | "sphere-cap")) => {
                (mesh, sphere(vertices, DVec3::from_array(mesh.translation_m)))
            }
            Some((mesh, "trihedral")) => (mesh, corner(vertices)),
            _ => {
                let way_out = "give it a single [[mesh]] with file = \"builtin:plate\", \"builtin:sphere\", \
                               \"builtin:sphere-cap\" or \"builtin:trihedral\", or take builtin:calibration-plate";
                return Err(refuse("the scene", "is not that of a calibration target", way_out));
            }
        };
        let place = format!("mesh `{}`", mesh.name);
        let Some(shape) = shape else {
            let way_out = "size it with `scale` instead of `size_m`";
            return Err(refuse(&place, "is stretched out of shape", way_out));
        };
        let regions = &self.target.region_of_facet;
        if regions.iter().any(|region| *region != regions[0]) {
            return Err(refuse(&place, "has several regions", "give it one material"));
        }
        Ok(ReferenceTarget { name: mesh.name.clone(), shape, region: regions[0] })
    }
}

/// The plate of these four corners, one after the other; `None` where its sides vanish.
fn plate(vertices: &[DVec3]) -> Option<ReferenceShape> {
    let &[a, b, c, _] = vertices else { return None };
    let half_sides = [0.5 * (b - a), 0.5 * (c - b)];
    let is_flat = half_sides.iter().all(|side| side.length() > 0.0);
    is_flat.then_some(ReferenceShape::Plate { middle: 0.5 * (a + c), half_sides })
}

/// The sphere about a centre on which all vertices lie.
fn sphere(vertices: &[DVec3], centre: DVec3) -> Option<ReferenceShape> {
    let radius_m = vertices.first()?.distance(centre);
    let is_round = vertices.iter().all(|v| (v.distance(centre) / radius_m - 1.0).abs() < ROUNDING);
    is_round.then_some(ReferenceShape::Sphere { centre, radius_m })
}

/// The corner of this apex and these ends of legs.
fn corner(vertices: &[DVec3]) -> Option<ReferenceShape> {
    let &[apex, a, b, c] = vertices else { return None };
    let legs = [a - apex, b - apex, c - apex];
    let leg2 = legs[0].length_squared();
    let is_square = [(0, 1), (1, 2), (2, 0)].into_iter().all(|(one, other)| {
        legs[one].dot(legs[other]).abs() < ROUNDING * leg2
            && (legs[other].length_squared() / leg2 - 1.0).abs() < ROUNDING
    });
    is_square.then_some(ReferenceShape::Corner { apex, legs })
}
