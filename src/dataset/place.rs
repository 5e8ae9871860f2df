//! Puts a mesh on the surface of another, facing outwards, without cutting it.

use std::path::Path;

use glam::{DMat3, DVec3};

use super::spec::Placing;
use crate::error::Error;
use crate::geometry::Mesh;
use crate::radar::random::Draws;
use crate::scene::file::{MeshEntry, SceneFile};
use crate::scene::{GivenMeshes, placed_mesh};

/// Places that are tried.
const MOST_TRIES: usize = 200;
/// How far the mesh may stand off the surface at its middle, m: beyond that the surface is no place for it.
const MOST_LIFT_M: f64 = 0.04;
/// How far from the surface's tangent plane what belongs to the same place may lie, m.
const REACH_M: f64 = 0.2;
/// How far below the tangent plane what goes over both is that of its back, m.
const BACK_M: f64 = 0.05;
/// Room between the mesh and what goes over it, m.
const CLEARANCE_M: f64 = 5e-4;

/// Where a mesh was put.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Put {
    /// Turns about the fixed axes x, then y, then z, degrees.
    pub rotation_deg: [f64; 3],
    /// Shift after the turns, m.
    pub translation_m: [f64; 3],
}

/// The part of a mesh that faces the radar.
struct Surface {
    mesh: Mesh,
    /// Facets, their centres, their normals towards the radar, and the sums of their areas so far, m².
    facets: Vec<(usize, DVec3, DVec3, f64)>,
}

/// A point of a surface and the frame of what is put there.
struct Site {
    point: DVec3,
    /// Columns: across, upwards along the surface, and outwards.
    axes: DMat3,
}

/// Puts a mesh where the draws say, and changes its entry in the scene.
///
/// # Errors
/// A mesh that is not there, and a surface on which there is no place for it.
pub(super) fn put(
    placing: &Placing,
    file: &mut SceneFile,
    path: &Path,
    meshes: &GivenMeshes,
    draws: &mut Draws,
) -> Result<Put, Error> {
    let radar = file.radar.frames().origin().xyz;
    let surface =
        Surface::new(placed_mesh(entry(file, &placing.on)?, path, meshes)?, radar, placing);
    let mut own = entry(file, &placing.mesh)?.clone();
    (own.rotation_deg, own.translation_m) = ([0.0; 3], [0.0; 3]);
    let object = placed_mesh(&own, path, meshes)?;
    let over: Vec<Mesh> = placing
        .under
        .iter()
        .map(|name| Ok(placed_mesh(entry(file, name)?, path, meshes)?))
        .collect::<Result<_, Error>>()?;
    let outline = Outline::of(&object);
    for _ in 0..MOST_TRIES {
        let Some(site) = surface.site(placing, &outline, draws) else { break };
        let ground_m = heights_m(&surface.mesh, &site, &outline).fold(0.0, f64::max);
        if ground_m > MOST_LIFT_M {
            continue;
        }
        let base_m = ground_m + placing.gap_m;
        let top_m = base_m + outline.max.z - outline.min.z;
        let is_covered = over.iter().all(|mesh| {
            let front = heights_m(mesh, &site, &outline).filter(|height_m| *height_m > -BACK_M);
            front.reduce(f64::min).is_some_and(|least_m| least_m > top_m + CLEARANCE_M)
        });
        if !is_covered {
            continue;
        }
        let translation = site.point + site.axes.z_axis * (base_m - outline.min.z);
        let put =
            Put { rotation_deg: euler_deg(&site.axes), translation_m: translation.to_array() };
        let entry = file.mesh.iter_mut().find(|entry| entry.name == placing.mesh);
        if let Some(entry) = entry {
            (entry.rotation_deg, entry.translation_m) = (put.rotation_deg, put.translation_m);
        }
        return Ok(put);
    }
    let Placing { mesh, on, under, .. } = placing;
    let (under, way_out) = match under[..] {
        [] => (String::new(), "give a larger box, a larger most_tilt_deg, or a smaller mesh"),
        _ => (
            format!(" under {}", under.join(", ")),
            "give what goes over it an offset_m above the mesh's thickness, a larger box, a larger most_tilt_deg, or a smaller mesh",
        ),
    };
    Err(Error::usage(
        format!("[[place]]: of {MOST_TRIES} places on `{on}` none is one for `{mesh}`{under}"),
        way_out,
    ))
}

fn entry<'a>(file: &'a SceneFile, name: &str) -> Result<&'a MeshEntry, Error> {
    file.mesh.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let known: Vec<&str> = file.mesh.iter().map(|entry| entry.name.as_str()).collect();
        Error::usage(
            format!("[[place]]: the scene has no mesh `{name}`"),
            format!("there are: {}", known.join(", ")),
        )
    })
}

impl Surface {
    fn new(mesh: Mesh, radar: DVec3, placing: &Placing) -> Surface {
        let least_cosine = placing.most_tilt_deg.to_radians().cos();
        let (mut facets, mut sum_m2) = (Vec::new(), 0.0);
        for facet in 0..mesh.facets.len() {
            let corners = mesh.facets[facet].map(|vertex| mesh.vertices[vertex as usize]);
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let (area_m2, to_radar) = (0.5 * normal.length(), (radar - centre).normalize_or_zero());
            let cosine = normal.normalize_or_zero().dot(to_radar);
            let is_inside = placing.within_box.is_none_or(|within| {
                let (min, max) = (DVec3::from(within.min_m), DVec3::from(within.max_m));
                centre.cmpge(min).all() && centre.cmple(max).all()
            });
            if cosine >= least_cosine && is_inside {
                sum_m2 += area_m2;
                facets.push((facet, centre, normal.normalize_or_zero(), sum_m2));
            }
        }
        Surface { mesh, facets }
    }

    /// A point of it, each with the same probability, and the frame there; none on a surface without any.
    fn site(&self, placing: &Placing, outline: &Outline, draws: &mut Draws) -> Option<Site> {
        let all_m2 = self.facets.last()?.3;
        let drawn_m2 = draws.uniform() * all_m2;
        let place = self.facets.partition_point(|(.., sum_m2)| *sum_m2 <= drawn_m2);
        let (facet, _, own_normal, _) = self.facets[place.min(self.facets.len() - 1)];
        let [a, b, c] = self.mesh.facets[facet].map(|vertex| self.mesh.vertices[vertex as usize]);
        let (root, share) = (draws.uniform().sqrt(), draws.uniform());
        let point = a + root * ((1.0 - share) * (b - a) + share * (c - a));
        // The mean over about what the mesh will cover: one facet may lie askew.
        let radius_m = 0.25 * (outline.max - outline.min).truncate().element_sum();
        let near = self.facets.iter().filter(|(_, centre, ..)| centre.distance(point) <= radius_m);
        let normal: DVec3 = near.map(|(_, _, normal, _)| *normal).sum();
        let outwards = normal.try_normalize().unwrap_or(own_normal);
        let up = DVec3::Y.reject_from_normalized(outwards);
        let up = up.try_normalize().unwrap_or_else(|| outwards.any_orthonormal_vector());
        let [from, to] = placing.turn_deg;
        let (sin, cos) = (from + (to - from) * draws.uniform()).to_radians().sin_cos();
        let along = cos * up + sin * outwards.cross(up);
        Some(Site { point, axes: DMat3::from_cols(along.cross(outwards), along, outwards) })
    }
}

/// The box of a mesh along its own axes, m.
struct Outline {
    min: DVec3,
    max: DVec3,
}

impl Outline {
    fn of(mesh: &Mesh) -> Outline {
        let none = Outline { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        mesh.vertices.iter().fold(none, |Outline { min, max }, vertex| Outline {
            min: min.min(*vertex),
            max: max.max(*vertex),
        })
    }

    /// Heights of the corners of that part of a facet that lies over or under it, m.
    fn heights_m(&self, facet: [DVec3; 3]) -> Vec<f64> {
        let mut corners = facet.to_vec();
        for (axis, end, sign) in [
            (0, self.min.x, 1.0),
            (0, -self.max.x, -1.0),
            (1, self.min.y, 1.0),
            (1, -self.max.y, -1.0),
        ] {
            corners = cut(&corners, axis, end, sign);
        }
        corners.into_iter().map(|corner| corner.z).collect()
    }
}

/// The part of a polygon on which `sign` times a coordinate is at least `end` (Sutherland & Hodgman 1974, DOI
/// 10.1145/360767.360802).
fn cut(corners: &[DVec3], axis: usize, end: f64, sign: f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (place, &corner) in corners.iter().enumerate() {
        let next = corners[(place + 1) % corners.len()];
        let [here, there] = [corner, next].map(|corner| sign * corner[axis] - end);
        if here >= 0.0 {
            kept.push(corner);
        }
        if (here < 0.0) != (there < 0.0) {
            kept.push(corner.lerp(next, here / (here - there)));
        }
    }
    kept
}

/// Heights over the tangent plane of a site, m, of the parts of a mesh that lie over or under what is put there. What lies
/// far from the plane is of another part of the mesh.
fn heights_m<'a>(
    mesh: &'a Mesh,
    site: &'a Site,
    outline: &'a Outline,
) -> impl Iterator<Item = f64> + 'a {
    let to_site = site.axes.transpose();
    let heights = mesh.facets.iter().flat_map(move |facet| {
        let corners = facet.map(|at| to_site * (mesh.vertices[at as usize] - site.point));
        outline.heights_m(corners)
    });
    heights.filter(|height_m| height_m.abs() <= REACH_M)
}

/// Turns about the fixed axes x, then y, then z that make a frame, degrees.
fn euler_deg(axes: &DMat3) -> [f64; 3] {
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
    let turns = [y.z.atan2(z.z), (-x.z).clamp(-1.0, 1.0).asin(), x.y.atan2(x.x)];
    turns.map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::streams::{Kind, stream};
    use crate::frames::{Global, Model, Pose};
    use crate::trace::winding_number;

    const SCENE: &str = r#"
        [[mesh]]
        name = "ball"
        file = "builtin:sphere"
        size_m = [0.6, 0.5, 0.4]
        translation_m = [0, 1.1, 0]
        [[mesh]]
        name = "plate"
        file = "builtin:cuboid"
        size_m = [0.1, 0.06, 0.01]
        [[mesh]]
        name = "cloth"
        file = "builtin:sphere"
        size_m = [0.6, 0.5, 0.4]
        translation_m = [0, 1.1, 0]
        offset_m = 0.03
    "#;

    fn placing(under: &[&str]) -> Placing {
        Placing {
            mesh: "plate".to_owned(),
            on: "ball".to_owned(),
            under: under.iter().map(|name| (*name).to_owned()).collect(),
            within_box: None,
            gap_m: 0.002,
            turn_deg: [-180.0, 180.0],
            most_tilt_deg: 45.0,
        }
    }

    /// Puts the plate, and gives the scene.
    fn placed(seed: u64, placing: &Placing) -> Result<SceneFile, Error> {
        let mut file = SceneFile::parse(SCENE).unwrap();
        let mut draws = stream(seed, 0, Kind::Place, 0);
        put(placing, &mut file, Path::new("scene.toml"), &GivenMeshes::new(), &mut draws)?;
        Ok(file)
    }

    fn mesh(file: &SceneFile, name: &str) -> Mesh {
        let entry = entry(file, name).unwrap();
        placed_mesh(entry, Path::new("scene.toml"), &GivenMeshes::new()).unwrap()
    }

    fn is_inside(mesh: &Mesh, point: DVec3) -> bool {
        winding_number(mesh, point.into()).abs() > 0.5
    }

    #[test]
    fn what_is_put_on_a_surface_cuts_neither_it_nor_what_goes_over_both() {
        for seed in 0..20 {
            let file = placed(seed, &placing(&["cloth"])).unwrap();
            let [ball, plate, cloth] = ["ball", "plate", "cloth"].map(|name| mesh(&file, name));
            for vertex in &plate.vertices {
                assert!(
                    !is_inside(&ball, *vertex) && is_inside(&cloth, *vertex),
                    "{seed}: {vertex}"
                );
            }
            let is_whole = !ball.vertices.iter().any(|vertex| is_inside(&plate, *vertex));
            assert!(is_whole, "{seed}");
        }
    }

    #[test]
    fn the_turns_make_the_frame() {
        for seed in 0..20 {
            let mut draws = stream(seed, 1, Kind::Place, 0);
            let turn = DVec3::from_array([0; 3].map(|_| 3.0 * (draws.uniform() - 0.5)));
            let pose: Pose<Global, Model> = Pose::from_euler_xyz(turn, DVec3::ZERO);
            let again = DVec3::from_array(euler_deg(&pose.rotation()).map(f64::to_radians));
            let again: Pose<Global, Model> = Pose::from_euler_xyz(again, DVec3::ZERO);
            assert!(again.rotation().abs_diff_eq(pose.rotation(), 1e-12), "{turn}");
        }
    }

    #[test]
    fn what_is_too_thick_for_its_cover_finds_no_place() {
        let mut thick = placing(&["cloth"]);
        thick.gap_m = 0.025;
        let problem = placed(1, &thick).unwrap_err().to_string();
        assert!(
            problem.contains("`plate` under cloth") && problem.contains("offset_m"),
            "{problem}"
        );
    }
}
