//! A female display mannequin.
//!
//! The figure is 1.75 m tall, stands upright along y with its plumb line at x = z = 0 and looks
//! along +z; it is cut off at mid-thigh like a three-quarter display form. Its left is at +x. Its
//! bust measures 0.86 m, its waist 0.63 m, its hips 0.89 m around.
//!
//! The mesh is embedded as a file; `examples/mannequin` made it, from formulas.

use std::sync::LazyLock;

use crate::formats::MeshFormat;
use crate::geometry::Mesh;

/// Binary PLY: vertices in m as 64-bit numbers, and for each face the number of its part.
static PLY: &[u8] = include_bytes!("../../assets/mannequin.ply");

/// Names of the parts by their numbers in the file.
const PARTS: [&str; 6] = ["torso", "head", "right-leg", "left-leg", "right-arm", "left-arm"];

/// Read once, however many stand in a scene.
static MANNEQUIN: LazyLock<Mesh> = LazyLock::new(read);

/// The mannequin as a closed mesh: about 28 000 facets of 1 cm, in metres.
///
/// The label `part` says `head`, `torso`, `left-arm`, `right-arm`, `left-leg` or `right-leg`, the
/// sides being the figure's own.
///
/// ```
/// let mannequin = matdb::scene::mannequin::mannequin();
/// assert_eq!(mannequin.labels[0].property, "part");
/// ```
pub fn mannequin() -> Mesh {
    MANNEQUIN.clone()
}

fn read() -> Mesh {
    // The file is part of the program, and the tests below read it.
    let mut mesh = MeshFormat::Ply.read(PLY).expect("the embedded mannequin is a PLY file");
    for name in mesh.labels.iter_mut().flat_map(|labels| &mut labels.names) {
        let part = name.parse().ok().and_then(|number: usize| PARTS.get(number));
        *name = part.expect("every part of the embedded mannequin has a name").to_string();
    }
    mesh
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::checks::{component_count, euler_characteristic, is_closed, volume_m3};

    fn part_of(facet: usize) -> &'static str {
        let parts = &MANNEQUIN.labels[0];
        &parts.names[parts.name_of_facet[facet] as usize]
    }

    /// Extent of the vertices along an axis, m.
    fn extent_m(axis: usize) -> [f64; 2] {
        let along = || MANNEQUIN.vertices.iter().map(|v| v[axis]);
        [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Length around a part's cut at a height, m: the convex hull's, as a tape measure finds it.
    fn girth_m(part: &str, y_m: f64) -> f64 {
        let mut points = Vec::new();
        for facet in (0..MANNEQUIN.facets.len()).filter(|&f| part_of(f) == part) {
            let [a, b, c] = MANNEQUIN.corners(facet);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if (from.y < y_m) != (to.y < y_m) {
                    points.push(from.lerp(to, (y_m - from.y) / (to.y - from.y)));
                }
            }
        }
        // Cauchy: a convex curve's length is π times its mean width.
        const DIRECTIONS: u32 = 360;
        let width_m = |i: u32| {
            let (sin, cos) =
                (f64::from(i) * std::f64::consts::PI / f64::from(DIRECTIONS)).sin_cos();
            let along = || points.iter().map(|p| p.x * cos + p.z * sin);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
        };
        (0..DIRECTIONS).map(width_m).sum::<f64>() * std::f64::consts::PI / f64::from(DIRECTIONS)
    }

    #[test]
    fn it_is_one_closed_surface_without_handles() {
        assert_eq!(MANNEQUIN.validate(), Ok(()));
        assert!(is_closed(&MANNEQUIN));
        assert_eq!(component_count(&MANNEQUIN), 1);
        assert_eq!(euler_characteristic(&MANNEQUIN), 2);
    }

    #[test]
    fn facets_are_many_small_and_well_shaped() {
        let count = MANNEQUIN.facets.len();
        assert!((27_000..=29_500).contains(&count), "{count}");
        let mut edges_m = 0.0;
        for facet in 0..count {
            let [a, b, c] = MANNEQUIN.corners(facet);
            let sides_m = [a.distance(b), b.distance(c), c.distance(a)];
            edges_m += sides_m.iter().sum::<f64>();
            // 1 for an equilateral facet, 0 for a sliver.
            let shape = 12f64.sqrt() * MANNEQUIN.area_normal(facet).length()
                / sides_m.iter().map(|s| s * s).sum::<f64>();
            assert!(shape > 0.4, "facet {facet}: {shape}");
        }
        assert!(edges_m / (3 * count) as f64 <= 0.011);
    }

    #[test]
    fn it_has_the_size_of_a_woman() {
        let [x, y, z] = [0, 1, 2].map(extent_m);
        assert!(x[0] > -0.26 && x[1] < 0.26 && z[0] > -0.14 && z[1] < 0.14, "{x:?} {z:?}");
        assert!((y[0] - 0.50).abs() < 2e-3 && (y[1] - 1.75).abs() < 2e-3, "{y:?}");
        let volume_m3 = volume_m3(&MANNEQUIN);
        assert!((0.035..0.055).contains(&volume_m3), "{volume_m3}");
    }

    #[test]
    fn a_tape_measure_finds_bust_waist_and_hips() {
        for (part, y_m, expected_m) in
            [("torso", 1.260, 0.86), ("torso", 1.105, 0.63), ("torso", 0.925, 0.89)]
        {
            let girth_m = girth_m(part, y_m);
            assert!((girth_m - expected_m).abs() < 0.02, "{part} at {y_m} m: {girth_m} m");
        }
    }

    #[test]
    fn left_and_right_mirror_each_other() {
        let [left_m, right_m] = [extent_m(0)[1], -extent_m(0)[0]];
        assert!((left_m - right_m).abs() < 1e-3, "{left_m} {right_m}");
        let count =
            |part: &str| (0..MANNEQUIN.facets.len()).filter(|&f| part_of(f) == part).count();
        for limb in ["arm", "leg"] {
            let [left, right] = ["left", "right"].map(|side| count(&format!("{side}-{limb}")));
            assert!(left > 1000 && left.abs_diff(right) * 100 < left, "{limb}: {left} {right}");
        }
    }

    #[test]
    fn every_part_is_named_and_in_its_place() {
        let names = &MANNEQUIN.labels[0].names;
        assert_eq!(names.len(), 6);
        for (part, towards) in [
            ("head", DVec3::Y),
            ("left-arm", DVec3::X),
            ("right-arm", DVec3::NEG_X),
            ("left-leg", DVec3::new(1.0, -6.0, 0.0)),
            ("right-leg", DVec3::new(-1.0, -6.0, 0.0)),
        ] {
            let reach = |f: &usize| MANNEQUIN.centroid(*f).dot(towards);
            let extreme = (0..MANNEQUIN.facets.len()).max_by(|a, b| reach(a).total_cmp(&reach(b)));
            assert_eq!(part_of(extreme.unwrap()), part);
        }
        assert!(names.iter().any(|name| name == "torso"));
    }
}
