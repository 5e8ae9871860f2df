//! Rays of one spot, which nearly coincide: the hierarchy is walked once for all of them, and each facet in their way is
//! tested against sixteen rays at a time.
//!
//! All of it is conservative in f32, with a bound of the rounding; f64 decides as for a single ray (`facet.rs`), so that the
//! hits are the same bits.

use super::boxes::{PADDING, Sphere};
use super::eightfold::{BLOCK, Block, Eightfold, Lanes as Eight, Marks, Node, Stack, around_ray};
use super::facet::{Line, plane_hit};
use super::hit::Hit;
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use crate::lanes::{Wide, least, most, widest};

/// Rays that are tested at once.
const LANES: usize = 16;

type Lanes = [f32; LANES];

/// Rays of one bundle: fewer are faster one by one, and more do not share more.
const FEWEST: usize = 4;
const MOST: usize = 128;

/// Largest ratio of a ray's components across the bundle to that along it: the rays point to one side of the mesh.
const STEEPEST: f64 = 2.0;

/// Sixteen rays of a bundle: where each crosses the base plane, and by how much it moves per depth.
#[derive(Clone, Copy)]
struct Sixteen {
    at: [Lanes; 2],
    shear: [Lanes; 2],
}

/// Rays as they cross the base plane, which lies across one axis. Coordinates count from the centre of the sphere.
struct Bundle<'a> {
    rays: &'a [Ray<Global>],
    lines: Vec<Line<'a>>,
    sixteens: Vec<Sixteen>,
    /// The axis along the rays, and the other two.
    axes: [usize; 3],
    /// Place of the base plane on the axis, m, and the sense in which the rays run along it.
    base_m: f32,
    sense: f32,
    /// Bounds of where the rays cross the base plane, m, and of their shears.
    at: [[f32; 2]; 2],
    shear: [[f32; 2]; 2],
    /// Twice the bound of the rounding of a corner's distance from a ray, m.
    margin_m: f32,
}

/// The nearest facets of the rays of a bundle so far.
struct Nearest {
    /// Range, m, and number of that of each ray.
    facets: Vec<Option<(f64, u32)>>,
    /// Depth behind the base plane beyond which no facet is nearer to any ray, m.
    limit: f32,
}

/// Finds the closest hit of each ray of some spots, one spot after the other.
pub(super) fn closest(
    eightfold: &Eightfold,
    mesh: &Mesh,
    rays: &[Ray<Global>],
    rays_per_spot: usize,
    hits: &mut [Option<Hit>],
) {
    widest(Walks { eightfold, mesh, rays, rays_per_spot: rays_per_spot.max(1), hits });
}

/// Spots to be traced, and the hits of their rays.
struct Walks<'a> {
    eightfold: &'a Eightfold,
    mesh: &'a Mesh,
    rays: &'a [Ray<Global>],
    rays_per_spot: usize,
    hits: &'a mut [Option<Hit>],
}

impl Wide for Walks<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        let Walks { eightfold, mesh, rays, rays_per_spot, hits } = self;
        // Bundles of a spot are of one size.
        let size = rays_per_spot.div_ceil(rays_per_spot.div_ceil(MOST));
        let mut stack = Stack::new();
        let spots = rays.chunks(rays_per_spot).zip(hits.chunks_mut(rays_per_spot));
        let bundles = spots.flat_map(|(rays, hits)| rays.chunks(size).zip(hits.chunks_mut(size)));
        for (rays, hits) in bundles {
            match Bundle::new(&eightfold.sphere, rays) {
                Some(bundle) => {
                    let nearest = bundle.nearest(eightfold, mesh, &mut stack);
                    for ((hit, facet), ray) in hits.iter_mut().zip(nearest.facets).zip(rays) {
                        *hit = facet.and_then(|(_, facet)| plane_hit(mesh, facet, ray));
                    }
                }
                None => eightfold.closest_one_by_one(mesh, rays, &mut stack, hits),
            }
        }
    }
}

impl<'a> Bundle<'a> {
    /// `None` for a few rays, or where they do not run along one axis, or cross the base plane too far away for f32.
    #[inline(always)]
    fn new(sphere: &Sphere, rays: &'a [Ray<Global>]) -> Option<Bundle<'a>> {
        let first = rays.first().filter(|_| rays.len() >= FEWEST)?;
        let direction = first.direction.xyz();
        let along = direction.abs().max_position();
        let axes = [along, (along + 1) % 3, (along + 2) % 3];
        let sense = direction[along].signum();
        let start_m = sphere.entry_within_m(first, sphere.radius_m)?;
        let base_m = (first.origin.xyz + start_m * direction - sphere.centre)[along] as f32;
        let mut sixteens = Vec::with_capacity(rays.len().div_ceil(LANES));
        for rays in rays.chunks(LANES) {
            let mut sixteen = Sixteen { at: [[0.0; LANES]; 2], shear: [[0.0; LANES]; 2] };
            for lane in 0..LANES {
                // The lanes beyond the last ray repeat it.
                let ray = rays[lane.min(rays.len() - 1)];
                let direction = ray.direction.xyz();
                let origin = ray.origin.xyz - sphere.centre;
                let per = 1.0 / direction[along];
                let way_m = (f64::from(base_m) - origin[along]) * per;
                for side in 0..2 {
                    let shear = direction[axes[side + 1]] * per;
                    let at_m = origin[axes[side + 1]] + way_m * direction[axes[side + 1]];
                    let is_fit = direction[along] * sense > 0.0
                        && shear.abs() <= STEEPEST
                        && at_m.abs() <= 4.0 * sphere.radius_m;
                    if !is_fit {
                        return None;
                    }
                    sixteen.at[side][lane] = at_m as f32;
                    sixteen.shear[side][lane] = shear as f32;
                }
            }
            sixteens.push(sixteen);
        }
        // All lengths are within four radii of the centre, and a depth times a shear within six. All rounding together is at
        // most 48 unit roundoffs of the radius; the factor 2 covers the products and sums of an edge, and the rounding of f64 for
        // rays that start within 10⁸ radii.
        let doubt = 64.0 * f64::from(f32::EPSILON / 2.0);
        let margin_m = (2.0 * doubt * sphere.radius_m * (1.0 + PADDING)) as f32;
        let at = [0, 1].map(|side| bounds(sixteens.iter().map(|rays| &rays.at[side]), margin_m));
        let shear = [0, 1].map(|side| bounds(sixteens.iter().map(|rays| &rays.shear[side]), 0.0));
        let lines = rays.iter().map(Line::new).collect();
        let sense = sense as f32;
        Some(Bundle { rays, lines, sixteens, axes, base_m, sense, at, shear, margin_m })
    }

    /// Finds the nearest facet of each ray. `stack` must be empty, and is empty afterwards.
    #[inline(always)]
    fn nearest(&self, eightfold: &Eightfold, mesh: &Mesh, stack: &mut Stack) -> Nearest {
        let Eightfold { nodes, blocks, .. } = eightfold;
        let mut nearest = Nearest { facets: vec![None; self.rays.len()], limit: f32::INFINITY };
        if nodes.is_empty() {
            return nearest;
        }
        stack.push(0.0, 0);
        while let Some((near, content)) = stack.pop() {
            if near > nearest.limit {
                continue;
            }
            if content & BLOCK == 0 {
                let node = &nodes[content as usize];
                let (boxes, near) = self.boxes(node, nearest.limit);
                stack.make_room();
                let base = stack.len();
                for lane in boxes {
                    stack.insert_sorted(base, near[lane], node.content[lane]);
                }
                continue;
            }
            for block in &blocks[(content ^ BLOCK) as usize..] {
                for lane in self.facets(block) {
                    self.meet(mesh, block, lane, &mut nearest.facets);
                }
                if !block.continues {
                    break;
                }
            }
            nearest.limit = self.limit(eightfold, &nearest.facets);
        }
        nearest
    }

    /// Bounds of where the rays are at a depth, m, on one of the axes across.
    #[inline(always)]
    fn tube(&self, side: usize, depth: f32) -> [f32; 2] {
        let [a, b] = self.shear[side].map(|shear| shear * depth);
        [self.at[side][0] + least(a, b), self.at[side][1] + most(a, b)]
    }

    /// Marks the boxes that a ray may enter before `limit`, and returns the least depth of each, m.
    #[inline(always)]
    fn boxes(&self, node: &Node, limit: f32) -> (Marks, Eight) {
        let [along, across, up] = self.axes;
        let (mut near, mut within) = ([0.0; 8], [0.0; 8]);
        for lane in 0..8 {
            let depths =
                [node.low[along][lane] - self.base_m, node.high[along][lane] - self.base_m];
            let beside = |side: usize, axis: usize| {
                let [a, b] = depths.map(|depth| self.tube(side, depth));
                let (low, high) = (least(a[0], b[0]), most(a[1], b[1]));
                least(node.high[axis][lane] - low, high - node.low[axis][lane])
            };
            near[lane] = most(least(depths[0] * self.sense, depths[1] * self.sense), 0.0);
            let sides = least(least(beside(0, across), beside(1, up)), limit - near[lane]);
            // The sides of an empty box are NaN, in whose place `least` takes its second argument.
            within[lane] = least(sides, node.high[along][lane] - node.low[along][lane]);
        }
        (Marks::of_signs(&within), near)
    }

    /// Marks the facets of a block that do not lie on one side of all rays.
    #[inline(always)]
    fn facets(&self, block: &Block) -> Marks {
        let [along, across, up] = self.axes;
        let mut within = [0.0; 8];
        for lane in 0..8 {
            let mut sides = [f32::NEG_INFINITY; 4];
            for corner in &block.corners {
                let depth = corner[along][lane] - self.base_m;
                for (side, axis) in [across, up].into_iter().enumerate() {
                    let [low, high] = self.tube(side, depth);
                    let at = corner[axis][lane];
                    sides[2 * side] = most(at - low, sides[2 * side]);
                    sides[2 * side + 1] = most(high - at, sides[2 * side + 1]);
                }
            }
            within[lane] = least(least(sides[0], sides[1]), least(sides[2], sides[3]));
        }
        Marks::of_signs(&within).and(block.live)
    }

    /// Tests one facet against all rays, of which these are the nearest so far.
    #[inline(always)]
    fn meet(&self, mesh: &Mesh, block: &Block, lane: usize, nearest: &mut [Option<(f64, u32)>]) {
        let facet = block.facets[lane];
        let corners = block.corners.map(|corner| {
            let [along, across, up] = self.axes.map(|axis| corner[axis][lane]);
            [along - self.base_m, across, up]
        });
        for (number, sixteen) in self.sixteens.iter().enumerate() {
            let mut marks = self.may_meet(&corners, sixteen);
            while marks != 0 {
                let ray = number * LANES + marks.trailing_zeros() as usize;
                marks &= marks - 1;
                let Some(line) = self.lines.get(ray) else { break };
                if let Some(range_m) = line.range_to_facet_m(mesh, facet as usize)
                    && nearest[ray].is_none_or(|nearest| (range_m, facet) < nearest)
                {
                    nearest[ray] = Some((range_m, facet));
                }
            }
        }
    }

    /// A bit for each of sixteen rays that may hit a facet: all but those that certainly miss it.
    #[inline(always)]
    fn may_meet(&self, corners: &[[f32; 3]; 3], sixteen: &Sixteen) -> u32 {
        let mut marks = 0;
        for lane in 0..LANES {
            let beside = corners.map(|[depth, across, up]| {
                [
                    across - sixteen.at[0][lane] - sixteen.shear[0][lane] * depth,
                    up - sixteen.at[1][lane] - sixteen.shear[1][lane] * depth,
                ]
            });
            marks |= u32::from(around_ray(beside, self.margin_m) >= 0.0) << lane;
        }
        marks
    }

    /// The depth behind the base plane of the farthest hit so far, with the rounding of f32, m; infinite while a ray has none.
    #[inline(always)]
    fn limit(&self, eightfold: &Eightfold, nearest: &[Option<(f64, u32)>]) -> f32 {
        let along = self.axes[0];
        let centre_m = eightfold.sphere.centre[along];
        let mut farthest_m = f64::NEG_INFINITY;
        for (ray, facet) in self.rays.iter().zip(nearest) {
            let Some((range_m, _)) = facet else { return f32::INFINITY };
            let at_m = ray.origin.xyz[along] + range_m * ray.direction.xyz()[along] - centre_m;
            farthest_m = farthest_m.max((at_m - f64::from(self.base_m)) * f64::from(self.sense));
        }
        // Boxes that begin before the base plane count from there.
        (farthest_m + 4.0 * PADDING * eightfold.sphere.radius_m).max(0.0) as f32
    }
}

/// Bounds of numbers, farther apart by a margin on either side.
#[inline(always)]
fn bounds<'a>(numbers: impl Iterator<Item = &'a Lanes>, margin: f32) -> [f32; 2] {
    let [mut low, mut high] = [f32::INFINITY, f32::NEG_INFINITY];
    for &number in numbers.flatten() {
        (low, high) = (least(number, low), most(number, high));
    }
    [low - margin, high + margin]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::frames::{Direction, Point};
    use crate::lanes::at_most;
    use crate::scene::{mannequin, solids};
    use crate::trace::Bvh;
    use crate::trace::boxes::Boxes;
    use crate::trace::testing::{ray, soup};

    /// Rays through a spot around a place, from around an origin.
    fn spot(from: DVec3, to: DVec3, radius: f64, count: usize) -> Vec<Ray<Global>> {
        let aside = |k: usize, turn: f64| {
            let (sin, cos) = (turn * k as f64).sin_cos();
            radius * (k as f64 / count as f64).sqrt() * DVec3::new(cos, sin, cos * sin)
        };
        (0..count).map(|k| ray(from + 0.1 * aside(k, 1.7), to + aside(k, 2.4))).collect()
    }

    proptest! {
        /// Facets of any shape, spots of any width, origins within and without.
        #[test]
        fn together_rays_meet_what_each_meets_alone(
            mesh in soup(),
            from in prop::array::uniform3(-1.0f64..1.0),
            to in prop::array::uniform3(-1.0f64..1.0),
            (far, radius) in (prop::sample::select(vec![0.3, 2.0, 30.0, 1e4]), -4.0f64..1.0),
            count in 1usize..300,
            facet in 0usize..60,
            (decade, moved_m) in (-3i32..4, prop::sample::select(vec![0.0, 5.0, 1e5])),
        ) {
            let mut mesh = mesh;
            let scale = 10f64.powi(decade);
            for vertex in &mut mesh.vertices {
                *vertex = scale * *vertex + DVec3::new(moved_m, 0.0, -moved_m);
            }
            let bvh = Bvh::new(&mesh);
            // Towards a corner of a facet, where several facets are equally far.
            let corner = mesh.corners(facet % mesh.facets.len())[0];
            let centre = DVec3::new(moved_m, 0.0, -moved_m);
            let from = centre + far * scale * DVec3::from(from);
            for to in [centre + scale * DVec3::from(to), corner] {
                let rays = spot(from, to, scale * 10f64.powf(radius), count);
                prop_assert_eq!(bvh.closest_of_spots(&rays, count), bvh.closest_of_each(&rays));
            }
        }
    }

    #[test]
    fn spots_of_a_scan_meet_what_their_rays_meet_at_every_width_of_instructions() {
        let body = mannequin::mannequin();
        let (bvh, count) = (Bvh::new(&body), 64);
        let origin = DVec3::new(0.1, 1.2, 8.0);
        let rays: Vec<Ray<Global>> = (0..400)
            .flat_map(|k: u32| {
                let [x, y] = [k % 20, k / 20].map(|i| 0.1 * (f64::from(i) + 0.3) - 1.0);
                spot(origin, DVec3::new(x, y + 1.1, 0.0), 0.02, count)
            })
            .collect();
        let alone = bvh.closest_of_each(&rays);
        let all: Vec<u32> = (0..body.facets.len() as u32).collect();
        let sphere = Boxes::new(&body, &all).sphere;
        for (spot, hits) in rays.chunks(count).zip(alone.chunks(count)) {
            let is_met = hits.iter().any(Option::is_some);
            assert!(!is_met || Bundle::new(&sphere, spot).is_some());
        }
        let met = alone.iter().flatten().count();
        assert!((2_000..20_000).contains(&met), "{met}");
        for bits in [128, 256, 512] {
            assert_eq!(at_most(bits, || bvh.closest_of_spots(&rays, count)), alone, "{bits}");
        }
        // Chunks that are no spots, and the rest of one.
        assert_eq!(bvh.closest_of_spots(&rays[7..], 100), alone[7..]);
    }

    #[test]
    fn rays_that_do_not_run_together_are_traced_one_by_one() {
        let ball = solids::icosphere(0.5, 2);
        let bvh = Bvh::new(&ball);
        let apart: Vec<Ray<Global>> = (0..64)
            .map(|k| {
                let direction = Direction::from_angles(0.05 * f64::from(k), 0.4 * f64::from(k));
                let direction: Direction<crate::frames::Surface> = direction;
                ray(DVec3::new(0.1, 0.0, 0.2), DVec3::new(0.1, 0.0, 0.2) + direction.xyz())
            })
            .collect();
        let all: Vec<u32> = (0..ball.facets.len() as u32).collect();
        assert!(Bundle::new(&Boxes::new(&ball, &all).sphere, &apart).is_none());
        let alone = bvh.closest_of_each(&apart);
        assert!(alone.iter().all(Option::is_some));
        assert_eq!(bvh.closest_of_spots(&apart, 64), alone);
        let lost: Vec<Ray<Global>> =
            apart.iter().map(|ray| Ray { origin: Point::new(9.0, 9.0, 9.0), ..*ray }).collect();
        assert_eq!(bvh.closest_of_spots(&lost, 64), bvh.closest_of_each(&lost));
    }
}
