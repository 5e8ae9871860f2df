//! The mannequin's generator: a female display mannequin made of formulas instead of a scan.
//!
//! The figure is a smooth union of lofts, each a stack of elliptical cross-sections, so that the
//! torso's measures can be read off the tables: bust 0.86 m, waist 0.63 m, hips 0.89 m around.

use glam::DVec3;
use matdb::geometry::surface_nets::{Field, by_blocks};
use matdb::geometry::{FacetLabels, Mesh, surface_nets};

/// Side of the polygoniser's cells, m; chosen for about 28 000 facets.
const CELL_M: f64 = 0.0111;
/// A box with room around the figure, m.
const BOUNDS_M: [DVec3; 2] = [DVec3::new(-0.32, 0.42, -0.22), DVec3::new(0.32, 1.80, 0.22)];
/// Half-width of the zone about x = 0 where left and right parts run into each other, m.
const MIDLINE_M: f64 = 0.015;
/// Keeps the blended distance below the true one, so that empty space may be skipped on its word.
const CAUTION: f64 = 0.8;
/// The most that a shape's own distance changes over a metre, with room to spare: a shape is left
/// out of a ball on its word.
const STEEPEST: f64 = 1.5;

/// Makes the mesh of [`matdb::scene::mannequin::mannequin`], bit for bit, on any number of threads.
pub fn mannequin() -> Mesh {
    let body = Body::new();
    let mut mesh = surface_nets(body.everywhere(), BOUNDS_M[0], BOUNDS_M[1], CELL_M);
    let centroids_m: Vec<_> = (0..mesh.facets.len()).map(|facet| mesh.centroid(facet)).collect();
    let parts = by_blocks(&centroids_m, 4.0 * CELL_M, |centre_m, radius_m| {
        let nearest = body.nearest_within(centre_m, radius_m);
        move |point_m| nearest.part_at(point_m)
    });
    mesh.labels.push(FacetLabels::from_names("part", parts));
    mesh
}

/// A cross-section of a loft, m: y, centre x, centre z, half-width, depth to the front, depth to
/// the back.
type Section = [f64; 6];

/// How a shape takes part in the figure.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Head,
    Torso,
    Arm,
    Leg,
    /// Taken away instead of added.
    Hollow,
}

/// A loft as drawn: role, blend width (m), heights of the lower and upper cap (m), sections.
///
/// Sections with x > 0 stand for a pair, one on each side.
type Drawing = (Role, f64, [f64; 2], &'static [Section]);

#[rustfmt::skip]
const DRAWINGS: &[Drawing] = &[
    // Trunk, from the seat to the root of the neck.
    (Role::Torso, 0.0, [0.085, 0.040], &[
        [0.870, 0.0,  0.000, 0.140, 0.078, 0.088],
        [0.930, 0.0,  0.000, 0.160, 0.089, 0.106],
        [0.995, 0.0,  0.001, 0.151, 0.096, 0.094],
        [1.050, 0.0,  0.001, 0.131, 0.095, 0.076],
        [1.105, 0.0,  0.002, 0.118, 0.087, 0.073],
        [1.165, 0.0,  0.000, 0.123, 0.089, 0.083],
        [1.240, 0.0, -0.004, 0.132, 0.097, 0.095],
        [1.310, 0.0, -0.012, 0.124, 0.093, 0.096],
        [1.370, 0.0, -0.021, 0.122, 0.071, 0.082],
        [1.410, 0.0, -0.028, 0.104, 0.056, 0.064],
        [1.445, 0.0, -0.030, 0.066, 0.047, 0.050],
        [1.480, 0.0, -0.022, 0.048, 0.044, 0.046],
    ]),
    // Breasts.
    (Role::Torso, 0.070, [0.056, 0.110], &[[1.254, 0.074, 0.045, 0.068, 0.083, 0.062]]),
    // Buttocks.
    (Role::Torso, 0.060, [0.085, 0.120], &[[0.888, 0.070, -0.055, 0.078, 0.060, 0.074]]),
    // Thighs.
    (Role::Leg, 0.050, [0.040, 0.180], &[
        [0.540, 0.099,  0.002, 0.062, 0.068, 0.066],
        [0.640, 0.098,  0.002, 0.068, 0.078, 0.074],
        [0.740, 0.096, -0.001, 0.072, 0.086, 0.082],
        [0.800, 0.094, -0.004, 0.072, 0.086, 0.086],
    ]),
    // Shoulders.
    (Role::Torso, 0.080, [0.050, 0.036], &[[1.374, 0.118, -0.024, 0.064, 0.052, 0.052]]),
    // Arms and hands, from the knuckles to the shoulder.
    (Role::Arm, 0.030, [0.045, 0.050], &[
        [0.720, 0.215,  0.047, 0.018, 0.028, 0.027],
        [0.760, 0.217,  0.046, 0.019, 0.034, 0.032],
        [0.800, 0.220,  0.043, 0.020, 0.039, 0.036],
        [0.845, 0.221,  0.035, 0.021, 0.030, 0.030],
        [0.880, 0.220,  0.030, 0.023, 0.028, 0.028],
        [0.940, 0.219,  0.022, 0.027, 0.032, 0.032],
        [1.030, 0.215,  0.008, 0.034, 0.039, 0.038],
        [1.100, 0.211,  0.000, 0.033, 0.037, 0.037],
        [1.200, 0.206, -0.010, 0.035, 0.041, 0.041],
        [1.290, 0.192, -0.020, 0.035, 0.045, 0.045],
        [1.355, 0.167, -0.025, 0.037, 0.044, 0.046],
    ]),
    // Thumbs.
    (Role::Arm, 0.030, [0.024, 0.040], &[
        [0.770, 0.212, 0.078, 0.014, 0.015, 0.014],
        [0.820, 0.216, 0.060, 0.015, 0.016, 0.016],
    ]),
    // Neck.
    (Role::Head, 0.040, [0.040, 0.040], &[
        [1.470, 0.0, -0.024, 0.042, 0.040, 0.042],
        [1.510, 0.0, -0.015, 0.044, 0.043, 0.050],
        [1.580, 0.0, -0.004, 0.044, 0.046, 0.060],
    ]),
    // Skull, jaw, nose.
    (Role::Head, 0.030, [0.105, 0.090], &[[1.660, 0.0, -0.006, 0.074, 0.084, 0.096]]),
    (Role::Head, 0.046, [0.026, 0.060], &[
        [1.560, 0.0, 0.042, 0.036, 0.032, 0.050],
        [1.590, 0.0, 0.034, 0.052, 0.044, 0.060],
        [1.630, 0.0, 0.022, 0.062, 0.058, 0.070],
    ]),
    (Role::Head, 0.020, [0.012, 0.036], &[
        [1.620, 0.0, 0.074, 0.014, 0.024, 0.020],
        [1.655, 0.0, 0.068, 0.010, 0.014, 0.020],
    ]),
    // Eye sockets, navel.
    (Role::Hollow, 0.024, [0.014, 0.010], &[[1.660, 0.039, 0.088, 0.017, 0.014, 0.014]]),
    (Role::Hollow, 0.022, [0.018, 0.018], &[[1.045, 0.0, 0.106, 0.012, 0.013, 0.013]]),
];

/// All shapes of the figure, ready to be evaluated.
struct Body {
    shapes: Vec<Shape>,
}

struct Shape {
    role: Role,
    blend_m: f64,
    is_pair: bool,
    loft: Loft,
}

impl Body {
    fn new() -> Body {
        let shapes = DRAWINGS.iter().map(|&(role, blend_m, caps_m, sections)| {
            let is_pair = sections[0][1] > 0.0;
            Shape { role, blend_m, is_pair, loft: Loft::new(caps_m, sections) }
        });
        Body { shapes: shapes.collect() }
    }

    /// The body with all its shapes.
    fn everywhere(&self) -> Near<'_> {
        Near { shapes: &self.shapes, chosen: (1 << self.shapes.len()) - 1 }
    }

    /// The shapes of which one comes nearest to any point of a ball.
    fn nearest_within(&self, centre_m: DVec3, radius_m: f64) -> Near<'_> {
        let slack_m = STEEPEST * radius_m;
        let solids =
            || self.everywhere().numbered().filter(|(_, shape)| shape.role != Role::Hollow);
        let all_m: Vec<_> = solids().map(|(n, s)| (n, s.distance_m(centre_m))).collect();
        let nearest_m =
            all_m.iter().map(|&(_, distance_m)| distance_m).fold(f64::INFINITY, f64::min);
        let near =
            all_m.iter().filter(|(_, distance_m)| distance_m - slack_m <= nearest_m + slack_m);
        Near { shapes: &self.shapes, chosen: near.map(|(number, _)| 1 << number).sum() }
    }
}

/// Some of a body's shapes: enough of them for a part of space.
#[derive(Clone, Copy)]
struct Near<'a> {
    shapes: &'a [Shape],
    /// Bit `i` stands for shape `i`.
    chosen: u32,
}

impl<'a> Near<'a> {
    /// The shapes with their numbers, in the order in which they are joined.
    fn numbered(self) -> impl Iterator<Item = (usize, &'a Shape)> {
        let mut left = self.chosen;
        std::iter::from_fn(move || {
            let number = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            self.shapes.get(number).map(|shape| (number, shape))
        })
    }

    /// Name of the part whose own shapes come nearest.
    fn part_at(&self, point_m: DVec3) -> &'static str {
        let nearest = self
            .numbered()
            .map(|(_, shape)| (shape.distance_m(point_m), shape.role))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match (nearest.map(|(_, role)| role), point_m.x > 0.0) {
            (Some(Role::Head), _) => "head",
            (Some(Role::Arm), true) => "left-arm",
            (Some(Role::Arm), false) => "right-arm",
            (Some(Role::Leg), true) => "left-leg",
            (Some(Role::Leg), false) => "right-leg",
            _ => "torso",
        }
    }
}

impl Field for Near<'_> {
    fn distance_m(&self, point_m: DVec3) -> f64 {
        let mut distance_m = f64::INFINITY;
        for (_, shape) in self.numbered() {
            let other_m = shape.distance_m(point_m);
            distance_m = match shape.role {
                Role::Hollow => -smooth_min(-distance_m, other_m, shape.blend_m),
                _ => smooth_min(distance_m, other_m, shape.blend_m),
            };
        }
        CAUTION * distance_m
    }

    /// Without the shapes that leave no trace in the ball: those beyond the blend with what came
    /// before them, and those before one that hides them all.
    fn within(&self, centre_m: DVec3, radius_m: f64) -> Self {
        let slack_m = STEEPEST * radius_m;
        let mut chosen = 0;
        // Bounds of the distance to the shapes so far.
        let (mut low_m, mut high_m) = (f64::INFINITY, f64::INFINITY);
        for (number, &Shape { role, blend_m, .. }) in self.numbered() {
            let other_m = self.shapes[number].distance_m(centre_m);
            let (other_low_m, other_high_m) = (other_m - slack_m, other_m + slack_m);
            // The most by which a blend falls below both.
            let fillet_m = blend_m / 6.0;
            if role == Role::Hollow {
                if other_low_m < blend_m - low_m {
                    chosen |= 1 << number;
                    low_m = low_m.max(-other_high_m);
                    high_m = high_m.max(-other_low_m) + fillet_m;
                }
            } else if other_low_m < high_m + blend_m {
                if low_m >= other_high_m + blend_m {
                    chosen = 0;
                }
                chosen |= 1 << number;
                low_m = low_m.min(other_low_m) - fillet_m;
                high_m = high_m.min(other_high_m);
            }
        }
        Near { chosen, ..*self }
    }
}

impl Shape {
    fn distance_m(&self, mut point_m: DVec3) -> f64 {
        if self.is_pair {
            // A mirror without a crease: left and right meet in a smooth trough.
            point_m.x = (point_m.x * point_m.x + MIDLINE_M * MIDLINE_M).sqrt();
        }
        self.loft.distance_m(point_m)
    }
}

/// The smaller of two distances, rounded where they differ by less than `blend_m`.
///
/// Twice continuously differentiable, so that reflections run smoothly over the seam.
fn smooth_min(a_m: f64, b_m: f64, blend_m: f64) -> f64 {
    let overlap_m = blend_m - (a_m - b_m).abs();
    let fillet_m = if overlap_m > 0.0 {
        overlap_m * (overlap_m * overlap_m) / (6.0 * blend_m * blend_m)
    } else {
        0.0
    };
    a_m.min(b_m) - fillet_m
}

/// Elliptical sections stacked along y, closed by half an ellipsoid at each end.
struct Loft {
    /// Heights of the lower and the upper cap, m.
    caps_m: [f64; 2],
    knots: Vec<Knot>,
}

/// A section with the slopes of its measures along y.
struct Knot {
    y_m: f64,
    measures_m: [f64; 5],
    slopes: [f64; 5],
    /// Mean slopes up to the next section.
    chords: [f64; 5],
}

impl Loft {
    /// Slopes follow the neighbours and vanish at both ends, where the caps go on without a kink.
    fn new(caps_m: [f64; 2], sections: &[Section]) -> Loft {
        let last = sections.len() - 1;
        let knots = sections.iter().enumerate().map(|(i, &[y_m, ref measures_m @ ..])| {
            let (below, above) = (&sections[i.saturating_sub(1)], &sections[last.min(i + 1)]);
            let is_end = i == 0 || i == last;
            let slopes = std::array::from_fn(|m| {
                if is_end { 0.0 } else { (above[m + 1] - below[m + 1]) / (above[0] - below[0]) }
            });
            let chords = std::array::from_fn(|m| (above[m + 1] - measures_m[m]) / (above[0] - y_m));
            Knot { y_m, measures_m: *measures_m, slopes, chords }
        });
        Loft { caps_m, knots: knots.collect() }
    }

    /// Distance to first order, m: exact on the surface, along with its gradient.
    fn distance_m(&self, point_m: DVec3) -> f64 {
        let y_m = point_m.y.clamp(self.knots[0].y_m, self.knots[self.knots.len() - 1].y_m);
        let cap_m = self.caps_m[usize::from(point_m.y > y_m)];
        let ([x_m, z_m, width_m, front_m, back_m], [dx, dz, dwidth, dfront, dback]) =
            self.section(y_m);
        let is_front = point_m.z > z_m;
        let (depth_m, ddepth) = if is_front { (front_m, dfront) } else { (back_m, dback) };
        let axes_m = DVec3::new(width_m, cap_m, depth_m);
        let scaled = (point_m - DVec3::new(x_m, y_m, z_m)) / axes_m;
        let direction = scaled.normalize_or(DVec3::Z);
        let mut gradient = direction / axes_m;
        gradient.y -= gradient.x * (dx + direction.x * dwidth);
        gradient.y -= gradient.z * (dz + direction.z * ddepth);
        (scaled.length() - 1.0) / gradient.length()
    }

    /// Centre x, centre z, half-width, front and back at a height between the ends, m; their slopes.
    fn section(&self, y_m: f64) -> ([f64; 5], [f64; 5]) {
        // There are few: to count them all is quicker than to guess at branches.
        let above = self.knots.iter().filter(|knot| knot.y_m < y_m).count().max(1);
        let (Some(low), Some(high)) = (self.knots.get(above - 1), self.knots.get(above)) else {
            return (self.knots[0].measures_m, [0.0; 5]);
        };
        let height_m = high.y_m - low.y_m;
        let t = (y_m - low.y_m) / height_m;
        let s = 1.0 - t;
        let measure = |m: usize| {
            let start = low.measures_m[m] * (1.0 + 2.0 * t) + low.slopes[m] * t * height_m;
            let end = high.measures_m[m] * (1.0 + 2.0 * s) - high.slopes[m] * s * height_m;
            start * s * s + end * t * t
        };
        let slope = |m: usize| {
            6.0 * s * t * low.chords[m]
                + low.slopes[m] * s * (s - 2.0 * t)
                + high.slopes[m] * t * (t - 2.0 * s)
        };
        (std::array::from_fn(measure), std::array::from_fn(slope))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;

    static MANNEQUIN: LazyLock<Mesh> = LazyLock::new(mannequin);

    fn part_of(facet: usize) -> &'static str {
        let parts = &MANNEQUIN.labels[0];
        &parts.names[parts.name_of_facet[facet] as usize]
    }

    fn gradient(body: &Body, point_m: DVec3) -> DVec3 {
        const STEP_M: f64 = 1e-6;
        DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            let [ahead, behind] =
                [STEP_M, -STEP_M].map(|s| body.everywhere().distance_m(point_m + s * axis));
            (ahead - behind) / (2.0 * STEP_M)
        }))
    }

    #[test]
    fn vertices_lie_on_the_surface() {
        const ON_SURFACE_M: f64 = 1e-6;
        let body = Body::new();
        let all = body.everywhere();
        assert!(MANNEQUIN.vertices.iter().all(|&v| all.distance_m(v).abs() < 0.5 * ON_SURFACE_M));
    }

    #[test]
    fn facets_face_where_the_surface_faces() {
        let body = Body::new();
        let deviation_deg = |facet| {
            let outward = gradient(&body, MANNEQUIN.centroid(facet));
            outward.angle_between(MANNEQUIN.area_normal(facet)).to_degrees()
        };
        for (part, rms_deg, most_deg) in [
            ("head", 2.5, 30.0),
            ("torso", 1.5, 10.0),
            ("left-arm", 4.0, 30.0),
            ("left-leg", 1.6, 10.0),
        ] {
            let facets = (0..MANNEQUIN.facets.len()).filter(|&f| part_of(f) == part);
            let all_deg: Vec<f64> = facets.map(deviation_deg).collect();
            let sum_of_squares = all_deg.iter().map(|d| d * d).sum::<f64>();
            assert!((sum_of_squares / all_deg.len() as f64).sqrt() < rms_deg, "{part}");
            assert!(all_deg.into_iter().all(|d| d < most_deg), "{part}");
        }
    }

    #[test]
    fn skipping_empty_space_loses_nothing() {
        let body = Body::new();
        // A distance too small for any block to be skipped.
        let all = body.everywhere();
        let thorough = surface_nets(|p| 0.05 * all.distance_m(p), BOUNDS_M[0], BOUNDS_M[1], CELL_M);
        assert_eq!(thorough.vertices.len(), MANNEQUIN.vertices.len());
        let mut pairs = thorough.vertices.iter().zip(&MANNEQUIN.vertices);
        assert!(pairs.all(|(a, b)| a.distance(*b) < 1e-6));
    }

    #[test]
    fn leaving_shapes_out_changes_no_bit() {
        let body = Body::new();
        let all = body.everywhere();
        let whole = surface_nets(|p| all.distance_m(p), BOUNDS_M[0], BOUNDS_M[1], CELL_M);
        let bits = |mesh: &Mesh| -> Vec<[u64; 3]> {
            mesh.vertices.iter().map(|v| v.to_array().map(f64::to_bits)).collect()
        };
        assert_eq!(bits(&whole), bits(&MANNEQUIN));
        assert_eq!(whole.facets, MANNEQUIN.facets);
        let solids = body.nearest_within(DVec3::ZERO, f64::INFINITY);
        assert!((0..whole.facets.len()).all(|f| solids.part_at(whole.centroid(f)) == part_of(f)));
    }

    #[test]
    fn any_number_of_threads_makes_the_same_mesh() {
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(mannequin) == *MANNEQUIN, "{threads} threads");
        }
    }

    #[test]
    fn a_single_section_is_an_ellipsoid() {
        let loft = Loft::new([2.0, 3.0], &[[0.5, 0.0, 0.0, 1.0, 4.0, 5.0]]);
        for point_m in [
            DVec3::new(1.0, 0.5, 0.0),
            DVec3::new(0.0, -1.5, 0.0),
            DVec3::new(0.0, 3.5, 0.0),
            DVec3::new(0.0, 0.5, 4.0),
            DVec3::new(0.0, 0.5, -5.0),
            DVec3::new(0.6, 0.5, 3.2),
        ] {
            assert!(loft.distance_m(point_m).abs() < 1e-12, "{point_m}");
        }
        assert!((loft.distance_m(DVec3::new(3.0, 0.5, 0.0)) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_lofts_gradient_has_unit_length_on_its_surface() {
        let Body { shapes } = Body::new();
        let arm = &shapes.iter().find(|shape| shape.role == Role::Arm).unwrap().loft;
        for knot in &arm.knots[1..arm.knots.len() - 1] {
            let y_m = knot.y_m + 0.01;
            let ([x_m, z_m, width_m, ..], _) = arm.section(y_m);
            let point_m = DVec3::new(x_m + width_m, y_m, z_m);
            let step_m = 1e-6;
            let slope = |axis| {
                (arm.distance_m(point_m + step_m * axis) - arm.distance_m(point_m - step_m * axis))
                    / (2.0 * step_m)
            };
            let length = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).length();
            assert!((length - 1.0).abs() < 1e-6, "{length}");
        }
    }

    #[test]
    fn a_blend_is_lower_than_both_and_local() {
        assert_eq!(smooth_min(0.1, 0.3, 0.05), 0.1);
        assert!((smooth_min(0.1, 0.1, 0.06) - 0.09).abs() < 1e-15);
        assert!(smooth_min(0.1, 0.12, 0.06) < 0.1);
    }
}
