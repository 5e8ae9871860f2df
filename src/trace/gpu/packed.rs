//! The memory layout of a hierarchy and of rays on the device, as `closest.wgsl` reads it. Numbers are f32; lengths
//! are in radii of the sphere around the mesh, and count from its centre.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use crate::radar::{GaussianBeam, Section, SolidAngle};
use crate::trace::boxes::Boxes;

/// The rays of a chirp, one per sample of the spot.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// The axis of the beam.
    pub axis: Ray<Global>,
    /// The two vectors, m, by which the coordinates of a sample are multiplied: their sum leads from the axis to
    /// the sample's place in the section.
    pub across_m: [DVec3; 2],
    /// The section of the beam in which the samples lie.
    pub section: Section,
    /// The antenna's solid angle along the beam.
    pub solid_angle: SolidAngle,
    /// The beam, whose divergence widens lobes.
    pub beam: GaussianBeam,
    /// Whether the rays stand on the curved wavefront, which is then a part of the divergence.
    pub on_wavefront: bool,
    /// Number of the scattering model of region 0; those of the other regions follow.
    pub law: u32,
}

/// Answers of the device other than the number of a leaf entry: the ray hits nothing, or f32 cannot decide.
pub(super) const NOTHING: u32 = u32::MAX;
const UNSURE: u32 = u32::MAX - 1;

/// Marks a ray that the device must trace, since its answer is not known in advance.
const UNKNOWN: u32 = 0;

/// A box and its content.
pub(super) type Node = [u32; 8];

/// The corners of a leaf entry's facet, and behind each a component of its unit normal.
pub(super) type Corners = [[f32; 4]; 3];

/// A ray that starts near the mesh.
pub(super) type Aim = [u32; 8];

/// The rays of a chirp, which start where its axis comes near the mesh.
pub(super) type Spot = [u32; 24];

/// Largest distance of a ray's origin, in radii, up to which f64 computes its entry to 2⁻³⁰. The CPU traces others.
const FARTHEST: f64 = (1u64 << 20) as f64;

/// Distance by which a ray starts before the sphere, in radii, so that every hit has a positive depth.
const RUN_UP: f64 = 0.01;

/// Largest diameter of mesh and spot together, in radii. The CPU traces wider spots, for which the bounds would be
/// too coarse.
const LARGEST: f64 = 3.0;

/// All boxes, the root first.
pub(super) fn nodes(boxes: &Boxes) -> Vec<Node> {
    let per_m = 1.0 / boxes.sphere.radius_m;
    let word = |metres: f32| ((f64::from(metres) * per_m) as f32).to_bits();
    let nodes = boxes.tree.nodes.par_iter().map(|node| {
        let [[x, y, z], [u, v, w]] =
            [node.aabb.min, node.aabb.max].map(|corner| corner.to_array().map(word));
        [x, y, z, node.prim_count, u, v, w, node.first_index]
    });
    nodes.collect()
}

/// The corners of all leaf entries.
pub(super) fn corners(boxes: &Boxes, mesh: &Mesh) -> Vec<Corners> {
    let per_m = 1.0 / boxes.sphere.radius_m;
    let corners = boxes.facets.par_iter().map(|&facet| {
        let normal = mesh.area_normal(facet as usize).normalize_or_zero().as_vec3();
        let place = |corner: DVec3| ((corner - boxes.sphere.centre) * per_m).as_vec3();
        let [a, b, c] = mesh.corners(facet as usize).map(place);
        [a.extend(normal.x), b.extend(normal.y), c.extend(normal.z)].map(|v| v.to_array())
    });
    corners.collect()
}

/// Packs rays, or their answers where these are known in advance.
pub(super) fn aims(boxes: &Boxes, rays: &[Ray<Global>]) -> Vec<Aim> {
    rays.par_iter().with_min_len(1024).map(|ray| aim(boxes, ray)).collect()
}

/// Packs a ray with a known answer.
fn known_aim(answer: u32) -> Aim {
    [0, 0, 0, answer, 0, 0, 0, 0]
}

fn aim(boxes: &Boxes, ray: &Ray<Global>) -> Aim {
    let Some(entry_m) = boxes.sphere.entry_m(ray) else { return known_aim(NOTHING) };
    let (from_centre, direction) = (ray.origin.xyz - boxes.sphere.centre, ray.direction.xyz());
    if from_centre.length() > FARTHEST * boxes.sphere.radius_m {
        return known_aim(UNSURE);
    }
    let start_m = (entry_m - RUN_UP * boxes.sphere.radius_m).max(0.0);
    let origin = (from_centre + start_m * direction) / boxes.sphere.radius_m;
    // The largest component becomes exactly 1 or −1.
    let slopes = direction / direction.abs().max_element();
    let ([x, y, z], [u, v, w]) = (words(origin.as_vec3()), words(slopes.as_vec3()));
    [x, y, z, UNKNOWN, u, v, w, 1f32.to_bits()]
}

/// Packs the rays of chirps, whose samples lie within `reach` of the centre, or their answers where these are known in
/// advance.
pub(super) fn spots(boxes: &Boxes, cones: &[Cone], reach: f64) -> Vec<Spot> {
    cones.par_iter().with_min_len(1024).map(|cone| spot(boxes, cone, reach)).collect()
}

/// Packs the rays of a chirp with a known answer.
fn known_spot(answer: u32) -> Spot {
    let mut spot = [0; 24];
    spot[15] = answer;
    spot
}

fn spot(boxes: &Boxes, cone: &Cone, reach: f64) -> Spot {
    let Cone { axis, across_m, section, solid_angle, beam, on_wavefront, law } = cone;
    let (from_centre, direction) = (axis.origin.xyz - boxes.sphere.centre, axis.direction.xyz());
    let per_m = 1.0 / boxes.sphere.radius_m;
    // A ray that is r from the axis in the section is r·(1 + (R − range)/R_c) from it at the range R.
    let spread = |range_m: f64| 1.0 + section.curvature_per_m * (range_m - section.range_m);
    let middle_m = -from_centre.dot(direction);
    let ends_m = [middle_m - boxes.sphere.radius_m, middle_m + boxes.sphere.radius_m];
    let widest_m = across_m.iter().map(|aside| aside.length()).fold(0.0, f64::max);
    let widest = ends_m.map(|end_m| spread(end_m).abs()).into_iter().fold(1.0, f64::max);
    let margin_m = reach * widest_m * widest;
    let Some(entry_m) = boxes.sphere.entry_within_m(axis, margin_m) else {
        return known_spot(NOTHING);
    };
    let size = 1.0 + 2.0 * margin_m * per_m;
    if from_centre.length() > FARTHEST * boxes.sphere.radius_m || size > LARGEST {
        return known_spot(UNSURE);
    }
    let start_m = (entry_m - RUN_UP * boxes.sphere.radius_m).max(0.0);
    let word = |value: f64| (value as f32).to_bits();
    let [x, y, z] = words(((from_centre + start_m * direction) * per_m).as_vec3());
    // Its largest component becomes 1 or -1, exactly.
    let [u, v, w] = words((direction / direction.abs().max_element()).as_vec3());
    let [[a, b, c], [d, e, f]] = across_m.map(|aside_m| words((aside_m * per_m).as_vec3()));
    let SolidAngle { offset, middle_m, depth_m, .. } = *solid_angle;
    let curvature = section.curvature_per_m / per_m;
    let per_rayleigh = if *on_wavefront { 1.0 / (beam.rayleigh_m() * per_m) } else { 0.0 };
    let [start, size, spread, curvature, offset, middle, per_depth, beam2, focus, per_rayleigh] = [
        start_m * per_m,
        size,
        spread(start_m),
        curvature,
        offset,
        middle_m * per_m,
        1.0 / (depth_m * per_m),
        beam.divergence_rad().powi(2),
        beam.focus_m * per_m,
        per_rayleigh,
    ]
    .map(word);
    [
        x,
        y,
        z,
        start,
        u,
        v,
        w,
        size,
        a,
        b,
        c,
        *law,
        d,
        e,
        f,
        UNKNOWN,
        spread,
        curvature,
        offset,
        middle,
        per_depth,
        beam2,
        focus,
        per_rayleigh,
    ]
}

fn words(vector: Vec3) -> [u32; 3] {
    vector.to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::frames::Point;
    use crate::scene::solids;
    use crate::trace::Bvh;

    /// A ball of 0.25 m at (40, 40, 40) m.
    fn ball() -> Mesh {
        let mut ball = solids::icosphere(0.25, 2);
        ball.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::splat(40.0));
        ball
    }

    fn aimed(from: DVec3, to: DVec3) -> Aim {
        let (ball, origin) = (ball(), Point::from(from));
        let ray = Ray { origin, direction: origin.towards(to.into()).unwrap() };
        aim(Bvh::new(&ball).boxes(), &ray)
    }

    fn vector(words: &[u32]) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| f64::from(f32::from_bits(words[i]))))
    }

    #[test]
    fn a_mesh_fills_the_unit_sphere() {
        let ball = ball();
        let bvh = Bvh::new(&ball);
        let corners = corners(bvh.boxes(), &ball);
        assert_eq!(corners.len(), ball.facets.len());
        for &[x, y, z, _] in corners.as_flattened() {
            assert!((x.hypot(y).hypot(z) - 1.0).abs() < 1e-6);
        }
        let nodes = nodes(bvh.boxes());
        assert_eq!(nodes.iter().map(|node| node[3] as usize).sum::<usize>(), corners.len());
        assert!((vector(&nodes[0][4..7]) - DVec3::ONE).abs().max_element() < 0.2);
    }

    #[test]
    fn corners_carry_the_normal() {
        let ball = ball();
        let bvh = Bvh::new(&ball);
        for (corners, &facet) in corners(bvh.boxes(), &ball).iter().zip(&bvh.boxes().facets) {
            let normal = DVec3::from(corners.map(|corner| f64::from(corner[3])));
            let expected = ball.area_normal(facet as usize).normalize();
            assert!(normal.distance(expected) < 1e-7);
        }
    }

    #[test]
    fn a_spot_starts_before_the_mesh_and_reaches_beside_it() {
        let (ball, at) = (ball(), DVec3::splat(40.0));
        let bvh = Bvh::new(&ball);
        let cone = |beside_m: f64, width: f64| {
            let origin = Point::from(at + DVec3::new(beside_m, 10.0, 0.0));
            let axis =
                Ray { origin, direction: crate::frames::Direction::new(DVec3::NEG_Y).unwrap() };
            // Laid out 10 m away, by a wave that spreads from the radar.
            let section = Section {
                wavelength_m: 1e-3,
                range_m: 10.0,
                radius_m: 10.0 * width,
                curvature_per_m: 0.1,
            };
            let solid_angle =
                SolidAngle { level_sr: 1.0, offset: 1.0, middle_m: 10.0, depth_m: 0.5 };
            let across_m = [DVec3::X, DVec3::Z].map(|unit| 10.0 * width * unit);
            let beam = GaussianBeam { wavelength_m: 1e-3, waist_m: 0.01, focus_m: 9.0 };
            let on_wavefront = true;
            let cone = Cone { axis, across_m, section, solid_angle, beam, on_wavefront, law: 7 };
            spot(bvh.boxes(), &cone, 2.0)
        };
        let near = cone(0.0, 0.001);
        let reach_m = 2.0 * 0.001 * 10.25;
        let start = 1.0 + reach_m / 0.25 + RUN_UP;
        assert!((vector(&near[..3]) - start * DVec3::Y).length() < 1e-4);
        assert!((f64::from(f32::from_bits(near[3])) - (40.0 - start)).abs() < 1e-3);
        assert!((f64::from(f32::from_bits(near[7])) - (1.0 + 2.0 * reach_m / 0.25)).abs() < 1e-5);
        assert_eq!((vector(&near[4..7]), near[11], near[15]), (DVec3::NEG_Y, 7, UNKNOWN));
        let rest = [16, 17, 18, 19, 20, 21, 22, 23]
            .map(|word: usize| f64::from(f32::from_bits(near[word])));
        // δ₀ = 1 mm/(2π·10 mm), z_R = π·(10 mm)²/1 mm = 0.314 m.
        let first = [0.1 * (10.0 - 0.25 * start), 0.025, 1.0, 40.0, 0.5];
        let expected = first.into_iter().chain([2.533e-4, 36.0, 0.7958]);
        assert!(rest.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{rest:?}");
        // Its axis passes the ball, its rim does not.
        assert_eq!(cone(0.26, 0.001)[15], UNKNOWN);
        assert_eq!(cone(0.28, 0.001)[15], NOTHING);
        assert_eq!(cone(0.0, 0.02)[15], UNSURE);
    }

    #[test]
    fn a_ray_starts_shortly_before_the_sphere() {
        let at = DVec3::splat(40.0);
        let aim = aimed(at + DVec3::new(0.1, 1000.0, 0.0), at + DVec3::new(0.1, 0.0, 0.0));
        let half_chord = (1.0f64 - 0.16).sqrt();
        assert!((vector(&aim[..3]) - DVec3::new(0.4, half_chord + RUN_UP, 0.0)).length() < 1e-4);
        assert_eq!((aim[3], vector(&aim[4..7])), (UNKNOWN, DVec3::NEG_Y));
        let inside = aimed(at + 0.1 * DVec3::X, at + DVec3::new(0.2, 0.1, -0.05));
        assert!((vector(&inside[..3]) - 0.4 * DVec3::X).length() < 1e-6);
        assert!((vector(&inside[4..7]) - DVec3::new(1.0, 1.0, -0.5)).length() < 1e-6);
    }

    #[test]
    fn what_is_known_is_not_asked() {
        let at = DVec3::splat(40.0);
        assert_eq!(aimed(at + 2.0 * DVec3::X, at + 2.0 * DVec3::Y)[3], NOTHING);
        assert_eq!(aimed(at + 2.0 * DVec3::X, at + 3.0 * DVec3::X)[3], NOTHING);
        assert_eq!(aimed(at + 1e6 * DVec3::X, at)[3], UNSURE);
    }
}
