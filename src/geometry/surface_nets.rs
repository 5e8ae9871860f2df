//! Surface nets: the zero set of a signed distance as a closed triangle mesh.
//!
//! Space is cut into cubic cells. Every cell the surface passes through gets one vertex, every
//! lattice edge that crosses the surface gets a quad between its four cells (Gibson, "Constrained
//! elastic surface nets", 1998). The net is then evened out and each vertex put onto the surface.

use glam::DVec3;
use rayon::prelude::*;

use super::Mesh;

/// Corners per side of the largest block that is skipped as a whole when the surface is far away.
const BLOCK: usize = 4;
/// How far from its start a vertex may be put onto the surface, in cells.
const REACH_CELLS: f64 = 0.5;
/// How often the vertices are evened out before they are put onto the surface.
const EVENING_ROUNDS: usize = 6;
/// Newton steps towards the surface; a smooth distance needs two or three.
const NEWTON_STEPS: usize = 8;
/// Distance at which a vertex counts as on the surface, m.
const ON_SURFACE_M: f64 = 1e-10;
/// Marks a cell that the surface does not pass through.
const NO_VERTEX: u32 = u32::MAX;

/// A signed distance to a surface.
pub trait Field: Clone + Send + Sync {
    /// Distance of a point, m: negative inside, and never larger in magnitude than the true one.
    fn distance_m(&self, point_m: DVec3) -> f64;

    /// A field with the same values in a ball, which may be quicker to evaluate.
    #[must_use]
    fn within(&self, _centre_m: DVec3, _radius_m: f64) -> Self {
        self.clone()
    }
}

impl<F: Fn(DVec3) -> f64 + Clone + Send + Sync> Field for F {
    fn distance_m(&self, point_m: DVec3) -> f64 {
        self(point_m)
    }
}

/// Meshes the surface on which a field is zero inside a box, normals towards positive distances.
///
/// Empty space is skipped on the field's word. The surface must lie inside the bounds (it is left
/// open where it leaves them), and anything thinner than two cells may be lost or pinched. Facets
/// have sides of about `cell_m`. The result is the same for any number of threads.
///
/// ```
/// use glam::DVec3;
/// let ball = matdb::geometry::surface_nets(
///     |p: DVec3| p.length() - 1.0, DVec3::splat(-1.5), DVec3::splat(1.5), 0.1,
/// );
/// assert!(ball.vertices.iter().all(|v| (v.length() - 1.0).abs() < 1e-9));
/// ```
pub fn surface_nets(
    field: impl Field,
    bounds_min_m: DVec3,
    bounds_max_m: DVec3,
    cell_m: f64,
) -> Mesh {
    let lattice = Lattice::covering(bounds_min_m, bounds_max_m, cell_m);
    let distances_m = lattice.sample(&field);
    let crossed = lattice.crossed(&distances_m);
    let quads = lattice.quads(&distances_m, &crossed);
    let mut vertices = lattice.vertices(&distances_m, &crossed);
    for _ in 0..EVENING_ROUNDS {
        even_out(&mut vertices, &quads);
    }
    let reach_m = REACH_CELLS * cell_m;
    let vertices = by_blocks(&vertices, BLOCK as f64 * cell_m, |centre_m, radius_m| {
        let field = field.within(centre_m, radius_m + reach_m);
        move |start_m| onto_surface(&field.within(start_m, reach_m), start_m, 1e-5 * cell_m)
    });
    let facets = quads.iter().flat_map(|quad| halves(quad, &vertices)).collect();
    Mesh { vertices, facets, labels: Vec::new() }
}

/// A value for every point, found block by block of space: `in_ball` is given the centre (m) and
/// the radius (m) of a ball around each block's points, and returns what finds their values.
pub fn by_blocks<T: Copy + Default + Send, F: Fn(DVec3) -> T>(
    points_m: &[DVec3],
    side_m: f64,
    in_ball: impl Fn(DVec3, f64) -> F + Sync,
) -> Vec<T> {
    let places = points_m.iter().map(|point_m| (point_m / side_m).floor());
    let mut sorted: Vec<([i64; 3], u32)> =
        places.map(|place| place.to_array().map(|x| x as i64)).zip(0..).collect();
    sorted.par_sort_unstable();
    let blocks: Vec<&[([i64; 3], u32)]> = sorted.chunk_by(|a, b| a.0 == b.0).collect();
    let values = |points: &&[([i64; 3], u32)]| {
        let centre_m = (DVec3::from(points[0].0.map(|x| x as f64)) + 0.5) * side_m;
        let value = in_ball(centre_m, 0.5 * 3f64.sqrt() * side_m);
        points.iter().map(|&(_, point)| value(points_m[point as usize])).collect::<Vec<T>>()
    };
    let values: Vec<Vec<T>> = blocks.par_iter().map(values).collect();
    let mut in_order = vec![T::default(); points_m.len()];
    for (&(_, point), value) in sorted.iter().zip(values.into_iter().flatten()) {
        in_order[point as usize] = value;
    }
    in_order
}

/// The corners of a grid of cubic cells; a cell is numbered by its corner nearest the origin.
struct Lattice {
    origin_m: DVec3,
    cell_m: f64,
    /// Corners along x, y and z.
    size: [usize; 3],
}

/// A cell that the surface passes through: its place along x, y and z, and its number.
type SurfaceCell = ([usize; 3], usize);

impl Lattice {
    /// Centred on the bounds, so that a symmetric body gets a symmetric net.
    fn covering(min_m: DVec3, max_m: DVec3, cell_m: f64) -> Lattice {
        let cells = ((max_m - min_m) / cell_m).ceil();
        let origin_m = 0.5 * (min_m + max_m - cells * cell_m);
        Lattice { origin_m, cell_m, size: cells.to_array().map(|n| n as usize + 1) }
    }

    /// Index distance between neighbours along x, y and z.
    fn strides(&self) -> [usize; 3] {
        [1, self.size[0], self.size[0] * self.size[1]]
    }

    fn position_m(&self, [x, y, z]: [usize; 3]) -> DVec3 {
        self.origin_m + self.cell_m * DVec3::new(x as f64, y as f64, z as f64)
    }

    /// Distance at every corner, m; far from the surface only its sign is right.
    fn sample(&self, field: &impl Field) -> Vec<f64> {
        let [nx, ny, nz] = self.size;
        let mut distances_m = vec![0.0; nx * ny * nz];
        distances_m.par_chunks_mut(nx * ny * BLOCK).enumerate().for_each(|(slab, values)| {
            for y in (0..ny).step_by(BLOCK) {
                for x in (0..nx).step_by(BLOCK) {
                    self.sample_block(field, [x, y, 0], BLOCK, slab * BLOCK, values);
                }
            }
        });
        distances_m
    }

    /// Fills a block of a slab of layers that begins with layer `z_first`, half a side at a time
    /// where the surface is near.
    fn sample_block(
        &self,
        field: &impl Field,
        first @ [x, y, z]: [usize; 3],
        side: usize,
        z_first: usize,
        slab: &mut [f64],
    ) {
        let half_side_m = 0.5 * (side - 1) as f64 * self.cell_m;
        let centre_m = self.position_m([x, y, z_first + z]) + half_side_m;
        let at_centre_m = field.distance_m(centre_m);
        // One cell more than the block: no lattice edge that leaves it crosses the surface either.
        let is_far = at_centre_m.abs() > 3f64.sqrt() * (half_side_m + self.cell_m);
        let [nx, ny, _] = self.size;
        let end = [nx, ny, slab.len() / (nx * ny)];
        let spans = |step| [0, 1, 2].map(|i| (first[i]..end[i].min(first[i] + side)).step_by(step));
        if is_far || side == 1 {
            let [xs, ys, zs] = spans(1);
            for (z, y) in zs.flat_map(|z| ys.clone().map(move |y| (z, y))) {
                xs.clone().for_each(|x| slab[x + nx * (y + ny * z)] = at_centre_m);
            }
            return;
        }
        let near = field.within(centre_m, 3f64.sqrt() * half_side_m);
        let [xs, ys, zs] = spans(side / 2);
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    self.sample_block(&near, [x, y, z], side / 2, z_first, slab);
                }
            }
        }
    }

    /// The cells that the surface passes through, by their numbers.
    fn crossed(&self, distances_m: &[f64]) -> Vec<SurfaceCell> {
        let ([nx, ny, nz], [_, sy, sz]) = (self.size, self.strides());
        let is_inside = |corner: usize| distances_m[corner] < 0.0;
        let in_layer = |z: usize| {
            let mut crossed = Vec::new();
            for y in 0..ny - 1 {
                let row = y * sy + z * sz;
                // Corners inside among the four of a cell that have its x.
                let inside = |x: usize| {
                    [0, sy, sz, sy + sz].iter().filter(|&&to| is_inside(row + x + to)).count()
                };
                let mut before = inside(0);
                for x in 0..nx - 1 {
                    let after = inside(x + 1);
                    if before + after != 0 && before + after != 8 {
                        crossed.push(([x, y, z], row + x));
                    }
                    before = after;
                }
            }
            crossed
        };
        (0..nz - 1).into_par_iter().flat_map_iter(in_layer).collect()
    }

    /// One vertex per crossed cell, the mean of its edges' crossings.
    fn vertices(&self, distances_m: &[f64], crossed: &[SurfaceCell]) -> Vec<DVec3> {
        let [sx, sy, sz] = self.strides();
        let offsets = [0, 1, 2, 3, 4, 5, 6, 7usize]
            .map(|corner| (corner & 1) * sx + (corner >> 1 & 1) * sy + (corner >> 2) * sz);
        let vertices = crossed.par_iter().map(|&(cell, index)| {
            let corners_m = offsets.map(|offset| distances_m[index + offset]);
            self.position_m(cell) + self.cell_m * mean_crossing(&corners_m)
        });
        vertices.collect()
    }

    /// A quad around every crossed lattice edge, right-handed about the outward direction.
    fn quads(&self, distances_m: &[f64], crossed: &[SurfaceCell]) -> Vec<[u32; 4]> {
        let strides = self.strides();
        let mut vertex_of_cell = vec![NO_VERTEX; distances_m.len()];
        for (vertex, &(_, index)) in (0..).zip(crossed) {
            vertex_of_cell[index] = vertex;
        }
        let mut quads = Vec::with_capacity(crossed.len());
        for &(corner, index) in crossed {
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let is_inside = distances_m[index] < 0.0;
                let crosses = is_inside != (distances_m[index + strides[axis]] < 0.0);
                if crosses && corner[u] > 0 && corner[v] > 0 {
                    let (u, v) = (strides[u], strides[v]);
                    let [a, b, c, d] = [0, u, u + v, v].map(|back| vertex_of_cell[index - back]);
                    quads.push(if is_inside { [a, b, c, d] } else { [d, c, b, a] });
                }
            }
        }
        quads
    }
}

/// Mean of the points where the edges of a unit cell cross zero; bit `i` of a corner's number is
/// its coordinate along axis `i`.
fn mean_crossing(corners_m: &[f64; 8]) -> DVec3 {
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for axis in 0..3 {
        for low in (0..8usize).filter(|corner| corner >> axis & 1 == 0) {
            let (from_m, to_m) = (corners_m[low], corners_m[low | 1 << axis]);
            if (from_m < 0.0) != (to_m < 0.0) {
                let mut point = DVec3::from_array([0, 1, 2].map(|i| (low >> i & 1) as f64));
                point[axis] = from_m / (from_m - to_m);
                sum += point;
                count += 1.0;
            }
        }
    }
    sum / count
}

/// Moves every vertex towards the mean of the vertices it shares a quad's side with, but only
/// along the surface: across it the body would shrink.
fn even_out(vertices: &mut [DVec3], quads: &[[u32; 4]]) {
    let mut around = vec![(DVec3::ZERO, DVec3::ZERO, 0.0); vertices.len()];
    for quad in quads {
        let corners = quad.map(|v| vertices[v as usize]);
        let area_normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        for (i, &vertex) in quad.iter().enumerate() {
            let (normal, pull, count) = &mut around[vertex as usize];
            *normal += area_normal;
            *pull += 0.5 * (corners[(i + 1) % 4] + corners[(i + 3) % 4]) - corners[i];
            *count += 1.0;
        }
    }
    for (vertex, (normal, pull, count)) in vertices.iter_mut().zip(around) {
        *vertex += (pull / count).reject_from_normalized(normal.normalize_or_zero());
    }
}

/// Newton's method along the gradient.
fn onto_surface(field: &impl Field, start_m: DVec3, step_m: f64) -> DVec3 {
    let mut point_m = start_m;
    for _ in 0..NEWTON_STEPS {
        let distance_m = field.distance_m(point_m);
        if distance_m.abs() < ON_SURFACE_M {
            break;
        }
        let gradient = gradient(field, point_m, step_m);
        point_m -= gradient * (distance_m / gradient.length_squared().max(f64::MIN_POSITIVE));
    }
    point_m
}

/// Gradient from four samples at the corners of a tetrahedron.
fn gradient(field: &impl Field, point_m: DVec3, step_m: f64) -> DVec3 {
    const CORNERS: [[f64; 3]; 4] =
        [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let weighted =
        CORNERS.map(DVec3::from_array).map(|c| c * field.distance_m(point_m + step_m * c));
    weighted.into_iter().sum::<DVec3>() / (4.0 * step_m)
}

/// A quad cut along its shorter diagonal.
fn halves(&[a, b, c, d]: &[u32; 4], vertices: &[DVec3]) -> [[u32; 3]; 2] {
    let length_m = |i: u32, j: u32| vertices[i as usize].distance(vertices[j as usize]);
    if length_m(a, c) <= length_m(b, d) { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::checks::{area_m2, euler_characteristic, is_closed, volume_m3};
    use super::*;

    fn meshed(field: impl Fn(DVec3) -> f64 + Clone + Send + Sync, cell_m: f64) -> Mesh {
        surface_nets(field, DVec3::splat(-1.5), DVec3::splat(1.5), cell_m)
    }

    #[test]
    fn a_sphere_is_closed_and_its_vertices_lie_on_it() {
        let ball = meshed(|p| p.length() - 1.0, 0.1);
        assert!(is_closed(&ball));
        assert_eq!(euler_characteristic(&ball), 2);
        assert!(ball.vertices.iter().all(|v| (v.length() - 1.0).abs() < 1e-9));
        assert!((0..ball.facets.len()).all(|f| ball.area_normal(f).dot(ball.centroid(f)) > 0.0));
    }

    #[test]
    fn area_and_volume_converge_with_the_square_of_the_cell() {
        let relative_errors = |cell_m| {
            let ball = meshed(|p| p.length() - 1.0, cell_m);
            [1.0 - area_m2(&ball) / (4.0 * PI), 1.0 - volume_m3(&ball) / (4.0 / 3.0 * PI)]
        };
        let (coarse, fine) = (relative_errors(0.16), relative_errors(0.08));
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            assert!(fine > 0.0 && fine < 4e-3, "{fine}");
            assert!((3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
        }
    }

    #[test]
    fn a_torus_keeps_its_hole() {
        let torus = meshed(|p| (p.truncate().length() - 1.0).hypot(p.z) - 0.3, 0.08);
        assert!(is_closed(&torus));
        assert_eq!(euler_characteristic(&torus), 0);
    }

    #[test]
    fn skipping_empty_space_changes_nothing() {
        let sdf = |p: DVec3| p.length() - 1.0;
        // A distance too small to be believed anywhere: every corner is visited.
        let shy = |p: DVec3| 1e-3 * sdf(p);
        let signs = |values: Vec<f64>| values.into_iter().map(|d| d < 0.0).collect::<Vec<_>>();
        let lattice = Lattice::covering(DVec3::splat(-1.5), DVec3::splat(1.5), 0.07);
        assert_eq!(signs(lattice.sample(&sdf)), signs(lattice.sample(&shy)));
    }

    #[test]
    fn nothing_inside_gives_an_empty_mesh() {
        assert_eq!(meshed(|_| 1.0, 0.5), Mesh::default());
    }
}
