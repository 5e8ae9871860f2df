//! A hierarchy with eight boxes per node and eight facets per block, laid out for vector instructions.
//!
//! Facets are culled conservatively in f32, with a bound of the rounding; f64 decides the few survivors (`facet.rs`).
//! The triangle test of `obvhs` is not used, because it loses rays on shared edges.

#![allow(unsafe_code)]

use super::boxes::{Boxes, PADDING, Sphere};
use super::facet::{Line, plane_hit};
use super::hit::Hit;
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use crate::lanes::{Wide, least, most, widest};

/// Boxes per node, and facets per block.
const LANES: usize = 8;

pub(super) type Lanes = [f32; LANES];

/// Bit that distinguishes the number of a block from that of a node.
pub(super) const BLOCK: u32 = 1 << 31;

/// Branches on the stack's array; more spill into a list. The array is small in tests, so that they cover this.
const STACK: usize = if cfg!(test) { 2 * LANES } else { 64 };

/// The hierarchy. Coordinates count from the centre of its sphere.
pub(super) struct Eightfold {
    pub nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    pub sphere: Sphere,
}

/// Eight boxes: their bounds by axis, and the content of each, a node or (with the bit [`BLOCK`]) its first block.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Node {
    pub low: [Lanes; 3],
    pub high: [Lanes; 3],
    pub content: [u32; LANES],
}

/// Up to eight facets: the coordinates of their corners by corner and axis, and their numbers.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Block {
    pub corners: [[Lanes; 3]; 3],
    pub facets: [u32; LANES],
    /// A bit per lane that holds a facet.
    pub live: u32,
    /// Whether the next block belongs to the same box.
    pub continues: bool,
}

impl Node {
    /// Boxes that no ray enters.
    const EMPTY: Node = Node {
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::NEG_INFINITY; LANES]; 3],
        content: [0; LANES],
    };
}

impl Eightfold {
    /// Converts a binary tree.
    pub fn new(mesh: &Mesh, boxes: &Boxes) -> Eightfold {
        let mut eightfold =
            Eightfold { nodes: Vec::new(), blocks: Vec::new(), sphere: boxes.sphere };
        if boxes.facets.is_empty() {
            return eightfold;
        }
        let counts = count_facets(boxes);
        eightfold.nodes.push(Node::EMPTY);
        let mut open = vec![(0, 0)];
        while let Some((branch, number)) = open.pop() {
            for (lane, branch) in open_branches(boxes, &counts, branch).into_iter().enumerate() {
                let content = if is_whole(boxes, &counts, branch) {
                    eightfold.push_facets(mesh, &facets_under(boxes, branch))
                } else {
                    eightfold.nodes.push(Node::EMPTY);
                    let number = eightfold.nodes.len() - 1;
                    open.push((branch, number));
                    number as u32
                };
                let (around, node) = (boxes.tree.nodes[branch].aabb, &mut eightfold.nodes[number]);
                for axis in 0..3 {
                    node.low[axis][lane] = around.min[axis];
                    node.high[axis][lane] = around.max[axis];
                }
                node.content[lane] = content;
            }
        }
        eightfold
    }

    /// Appends blocks with the facets of one box, of which there must be at least one. Returns the number of the
    /// first block with the bit [`BLOCK`].
    fn push_facets(&mut self, mesh: &Mesh, facets: &[u32]) -> u32 {
        let first = self.blocks.len() as u32;
        for facets in facets.chunks(LANES) {
            let mut block = Block {
                corners: [[[0.0; LANES]; 3]; 3],
                facets: [0; LANES],
                live: 0,
                continues: true,
            };
            for (lane, &facet) in facets.iter().enumerate() {
                block.facets[lane] = facet;
                block.live |= 1 << lane;
                for (corner, at) in mesh.corners(facet as usize).into_iter().enumerate() {
                    let at = (at - self.sphere.centre).as_vec3().to_array();
                    (0..3).for_each(|axis| block.corners[corner][axis][lane] = at[axis]);
                }
            }
            self.blocks.push(block);
        }
        if let Some(last) = self.blocks.last_mut() {
            last.continues = false;
        }
        BLOCK | first
    }

    /// Finds the closest hit of each ray; among equally near facets, the one with the smallest number.
    pub fn closest(&self, mesh: &Mesh, rays: &[Ray<Global>], hits: &mut [Option<Hit>]) {
        widest(Walks { eightfold: self, mesh, rays, hits });
    }
}

/// Number of facets under each branch.
fn count_facets(boxes: &Boxes) -> Vec<u32> {
    let nodes = &boxes.tree.nodes;
    let mut counts = vec![0; nodes.len()];
    let mut open = vec![0];
    while let Some(&branch) = open.last() {
        let node = &nodes[branch];
        let first = node.first_index as usize;
        if node.is_leaf() {
            counts[branch] = node.prim_count;
        } else if counts[first] == 0 {
            open.extend([first, first + 1]);
            continue;
        } else {
            counts[branch] = counts[first] + counts[first + 1];
        }
        open.pop();
    }
    counts
}

/// Whether a branch is not opened further: it is a leaf, or its facets fit into one block.
fn is_whole(boxes: &Boxes, counts: &[u32], branch: usize) -> bool {
    counts[branch] <= LANES as u32 || boxes.tree.nodes[branch].is_leaf()
}

/// Opens a branch into up to eight branches below it, always the largest next.
fn open_branches(boxes: &Boxes, counts: &[u32], branch: usize) -> Vec<usize> {
    let nodes = &boxes.tree.nodes;
    let mut branches = vec![branch];
    while branches.len() < LANES {
        let open = (0..branches.len()).filter(|&place| !is_whole(boxes, counts, branches[place]));
        let area = |&place: &usize| nodes[branches[place]].aabb.half_area();
        let Some(place) = open.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let first = nodes[branches[place]].first_index as usize;
        branches[place] = first;
        branches.push(first + 1);
    }
    branches
}

/// All facets under a branch.
fn facets_under(boxes: &Boxes, branch: usize) -> Vec<u32> {
    let (mut facets, mut open) = (Vec::new(), vec![branch]);
    while let Some(branch) = open.pop() {
        let node = &boxes.tree.nodes[branch];
        let first = node.first_index as usize;
        if node.is_leaf() {
            facets.extend_from_slice(&boxes.facets[first..first + node.prim_count as usize]);
        } else {
            open.extend([first, first + 1]);
        }
    }
    facets
}

/// Rays to be traced, and their hits.
struct Walks<'a> {
    eightfold: &'a Eightfold,
    mesh: &'a Mesh,
    rays: &'a [Ray<Global>],
    hits: &'a mut [Option<Hit>],
}

impl Wide for Walks<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        self.eightfold.closest_one_by_one(self.mesh, self.rays, &mut Stack::new(), self.hits);
    }
}

impl Eightfold {
    /// As [`closest`](Self::closest), within a computation that is run at the widest. `stack` must be empty, and is empty
    /// afterwards.
    #[inline(always)]
    pub fn closest_one_by_one(
        &self,
        mesh: &Mesh,
        rays: &[Ray<Global>],
        stack: &mut Stack,
        hits: &mut [Option<Hit>],
    ) {
        for (ray, hit) in rays.iter().zip(hits) {
            let facet = self.nearest(mesh, ray, stack);
            *hit = facet.and_then(|facet| plane_hit(mesh, facet, ray));
        }
    }

    /// Finds the nearest facet of a ray. `stack` must be empty, and is empty afterwards.
    #[inline(always)]
    fn nearest(&self, mesh: &Mesh, ray: &Ray<Global>, stack: &mut Stack) -> Option<u32> {
        let Eightfold { nodes, blocks, sphere } = self;
        let start_m = sphere.entry_m(ray)?;
        let (aim, line) = (Aim::new(sphere, ray, start_m), Line::new(ray));
        let (mut nearest, mut limit): (Option<(f64, u32)>, f32) = (None, f32::INFINITY);
        stack.push(0.0, 0);
        'branches: while let Some((near, mut content)) = stack.pop() {
            if near > limit {
                continue;
            }
            while content & BLOCK == 0 {
                let node = &nodes[content as usize];
                let (hits, near) = aim.boxes(node, limit);
                if let Some(lane) = hits.single() {
                    content = node.content[lane];
                    continue;
                }
                stack.make_room();
                let base = stack.len;
                for lane in hits {
                    stack.insert_sorted(base, near[lane], node.content[lane]);
                }
                continue 'branches;
            }
            for block in &blocks[(content ^ BLOCK) as usize..] {
                for lane in aim.facets(block) {
                    let facet = block.facets[lane];
                    if let Some(range_m) = line.range_to_facet_m(mesh, facet as usize)
                        && nearest.is_none_or(|nearest| (range_m, facet) < nearest)
                    {
                        nearest = Some((range_m, facet));
                        // A box is skipped only if it is farther by more than the rounding of f32.
                        limit = (range_m - start_m + 2.0 * PADDING * sphere.radius_m) as f32;
                    }
                }
                if !block.continues {
                    break;
                }
            }
        }
        nearest.map(|(_, facet)| facet)
    }
}

/// A ray in f32 that starts where it enters the sphere.
struct Aim {
    origin: [f32; 3],
    /// Reciprocal of the direction.
    per: [f32; 3],
    /// The axis with the largest component of the direction, and the other two.
    axes: [usize; 3],
    /// Direction along the second and third axis over direction along the first.
    shear: [f32; 2],
    /// Twice the bound of the rounding of a corner's distance from the ray, m.
    margin_m: f32,
}

impl Aim {
    #[inline(always)]
    fn new(sphere: &Sphere, ray: &Ray<Global>, start_m: f64) -> Aim {
        let direction = ray.direction.xyz();
        let origin = ray.origin.xyz + start_m * direction - sphere.centre;
        let along = direction.abs().max_position();
        let axes = [along, (along + 1) % 3, (along + 2) % 3];
        let shear = [1, 2].map(|axis| (direction[axes[axis]] / direction[along]) as f32);
        // Origin and corners lie within one radius of the centre. All rounding together is at most 16 unit
        // roundoffs of the radius: 4 for their difference along each axis, 8 for the product with the shear,
        // 4 for its subtraction.
        let doubt = 16.0 * f64::from(f32::EPSILON / 2.0);
        // The factor 2 covers the products and sums of an edge, at most 8 roundoffs, and the rounding of f64 for
        // rays that start within 10⁸ radii.
        let margin_m = (2.0 * doubt * sphere.radius_m * (1.0 + PADDING)) as f32;
        Aim {
            origin: origin.as_vec3().to_array(),
            per: direction.as_vec3().to_array().map(f32::recip),
            axes,
            shear,
            margin_m,
        }
    }

    /// The face of every box of a node across an axis at which the ray enters the box.
    #[inline(always)]
    fn entry_face<'a>(&self, node: &'a Node, axis: usize) -> &'a Lanes {
        if self.per[axis] < 0.0 { &node.high[axis] } else { &node.low[axis] }
    }

    /// The face of every box of a node across an axis at which the ray leaves the box.
    #[inline(always)]
    fn exit_face<'a>(&self, node: &'a Node, axis: usize) -> &'a Lanes {
        if self.per[axis] < 0.0 { &node.low[axis] } else { &node.high[axis] }
    }

    /// Marks the boxes that the ray enters before `limit`, m, and returns the distance of each entry, m.
    #[inline(always)]
    fn boxes(&self, node: &Node, limit: f32) -> (Marks, Lanes) {
        let first: [&Lanes; 3] = std::array::from_fn(|axis| self.entry_face(node, axis));
        let last: [&Lanes; 3] = std::array::from_fn(|axis| self.exit_face(node, axis));
        let ([x, y, z], [per_x, per_y, per_z]) = (self.origin, self.per);
        let (mut near, mut within) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let met = |sides: [&Lanes; 3]| {
                let [at_x, at_y, at_z] = sides.map(|side| side[lane]);
                [(at_x - x) * per_x, (at_y - y) * per_y, (at_z - z) * per_z]
            };
            // A ray in the plane of a face gives NaN for it, which `most` and `least` take as inside.
            let [a, b, c] = met(first);
            near[lane] = most(c, most(b, most(a, 0.0)));
            let [a, b, c] = met(last);
            within[lane] = least(c, least(b, least(a, limit))) - near[lane];
        }
        (Marks::of_signs(&within), near)
    }

    /// Marks the facets that the ray may hit: all but those that it certainly misses.
    #[inline(always)]
    fn facets(&self, block: &Block) -> Marks {
        let [along, across, up] = self.axes;
        let of = |corner: usize| [along, across, up].map(|axis| &block.corners[corner][axis]);
        let corners = [of(0), of(1), of(2)];
        let origin = self.axes.map(|axis| self.origin[axis]);
        let mut within = [0.0; LANES];
        for lane in 0..LANES {
            let beside = |corner: usize| {
                let depth = corners[corner][0][lane] - origin[0];
                let x = corners[corner][1][lane] - origin[1] - self.shear[0] * depth;
                let y = corners[corner][2][lane] - origin[2] - self.shear[1] * depth;
                [x, y]
            };
            within[lane] = around_ray([beside(0), beside(1), beside(2)], self.margin_m);
        }
        Marks::of_signs(&within).and(block.live)
    }
}

/// Below zero where a ray certainly passes a facet by, from the offsets of its corners from the ray, m, of which `margin_m` is
/// twice the bound of the rounding.
#[inline(always)]
pub(super) fn around_ray([a, b, c]: [[f32; 2]; 3], margin_m: f32) -> f32 {
    // An edge function within its bound of zero may have either sign. The bound, m², includes the product of two roundings,
    // and underflow.
    let doubt = |[x, y]: [f32; 2]| margin_m * (x.abs() + y.abs() + margin_m) + f32::MIN_POSITIVE;
    let edge = |from: [f32; 2], to: [f32; 2]| {
        let (edge, doubt) = (from[0] * to[1] - from[1] * to[0], doubt(from) + doubt(to));
        [doubt + edge, doubt - edge]
    };
    let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
    let left = least(least(ab[0], bc[0]), ca[0]);
    let right = least(least(ab[1], bc[1]), ca[1]);
    most(left, right)
}

/// A set of lanes, one bit per lane.
#[derive(Clone, Copy)]
pub(super) struct Marks(u32);

impl Marks {
    /// Those of the lanes that have a bit here.
    #[inline(always)]
    pub fn and(self, lanes: u32) -> Marks {
        Marks(self.0 & lanes)
    }

    /// The lane, if the set has exactly one.
    #[inline(always)]
    fn single(self) -> Option<usize> {
        self.0.is_power_of_two().then(|| self.0.trailing_zeros() as usize % LANES)
    }

    /// The lanes whose sign bit is not set.
    #[inline(always)]
    pub fn of_signs(numbers: &Lanes) -> Marks {
        #[cfg(target_arch = "x86_64")]
        return Marks::of_signs_by_sse(numbers);
        #[cfg(not(target_arch = "x86_64"))]
        Marks::of_signs_one_by_one(numbers)
    }

    /// As [`Marks::of_signs_one_by_one`], which the compiler does not turn into the single instruction.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn of_signs_by_sse(&[a, b, c, d, e, f, g, h]: &Lanes) -> Marks {
        use std::arch::x86_64::{_mm_movemask_ps, _mm_setr_ps};
        // SAFETY: SSE, all that these need, is part of x86-64.
        let [low, high] = unsafe {
            [_mm_movemask_ps(_mm_setr_ps(a, b, c, d)), _mm_movemask_ps(_mm_setr_ps(e, f, g, h))]
        };
        Marks((low | high << 4) as u32 ^ 0xff)
    }

    #[cfg(any(test, not(target_arch = "x86_64")))]
    #[inline(always)]
    fn of_signs_one_by_one(numbers: &Lanes) -> Marks {
        let mut marks = 0;
        for (lane, number) in numbers.iter().enumerate() {
            marks |= u32::from(number.is_sign_positive()) << lane;
        }
        Marks(marks)
    }
}

impl Iterator for Marks {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lane = (self.0 != 0).then(|| self.0.trailing_zeros() as usize % LANES)?;
        self.0 &= self.0 - 1;
        Some(lane)
    }
}

/// Branches that a ray has yet to visit, the nearest of each node on top.
pub(super) struct Stack {
    /// In the high half the distance as the bits of an f32, which for positive numbers sort as the numbers do; in
    /// the low half the content.
    top: [u64; STACK],
    len: usize,
    /// Entries that did not fit into `top`.
    spilled: Vec<u64>,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Stack {
        Stack { top: [0; STACK], len: 0, spilled: Vec::new() }
    }

    /// Number of the entries on the array, from which [`insert_sorted`](Self::insert_sorted) may count.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn push(&mut self, near: f32, content: u32) {
        self.insert_sorted(self.len, near, content);
    }

    /// Makes room for the branches of a node.
    #[inline(always)]
    pub fn make_room(&mut self) {
        if self.len + LANES > STACK {
            self.spill();
        }
    }

    #[cold]
    #[inline(never)]
    fn spill(&mut self) {
        self.spilled.extend_from_slice(&self.top[..self.len]);
        self.len = 0;
    }

    /// Pushes a branch so that the entries from `base` on stay sorted, the nearest last.
    #[inline(always)]
    pub fn insert_sorted(&mut self, base: usize, near: f32, content: u32) {
        let branch = u64::from(near.to_bits()) << 32 | u64::from(content);
        let mut at = self.len.min(STACK - 1);
        while at > base && self.top[at - 1] < branch {
            self.top[at] = self.top[at - 1];
            at -= 1;
        }
        self.top[at] = branch;
        self.len += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<(f32, u32)> {
        let branch = match self.len {
            0 => self.spilled.pop()?,
            _ => {
                self.len -= 1;
                self.top[self.len]
            }
        };
        Some((f32::from_bits((branch >> 32) as u32), branch as u32))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::frames::Point;
    use crate::scene::solids;

    fn hit(eightfold: &Eightfold, mesh: &Mesh, ray: Ray<Global>) -> Option<Hit> {
        let mut hits = [None];
        eightfold.closest(mesh, &[ray], &mut hits);
        hits[0]
    }

    proptest! {
        /// Rays at corners and edges, and beside them by less than the rounding of f32, from near and far, at any scale.
        #[test]
        fn what_64_bits_may_hit_is_marked(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0f64..1.0)),
            (u, v) in (0.0f64..1.0, 0.0f64..1.0),
            beside in prop::array::uniform3(-1e-6f64..1e-6),
            from in prop::array::uniform3(-1.0f64..1.0),
            (decade, far) in (-4i32..5, prop::sample::select(vec![0.1, 1.0, 30.0, 1e4])),
            place in 0usize..4,
        ) {
            let scale = 10f64.powi(decade);
            let corners = corners.map(|corner| scale * DVec3::from(corner));
            let mesh = Mesh { vertices: corners.to_vec(), facets: vec![[0, 1, 2]], labels: vec![] };
            prop_assume!(!mesh.is_degenerate(0));
            let [a, b, c] = corners;
            let at = [a, a.lerp(b, u), b.lerp(c, v), a + (1.0 - v) * (u * (b - a)) + v * (c - a)][place];
            let origin: Point<Global> = (far * scale * DVec3::from(from)).into();
            let through = at + scale * DVec3::from(beside);
            let Some(direction) = origin.towards(through.into()) else { return Ok(()) };
            let ray = Ray { origin, direction };
            let boxes = Boxes::new(&mesh, &[0]);
            let eightfold = Eightfold::new(&mesh, &boxes);
            let exact = Line::new(&ray).range_to_facet_m(&mesh, 0);
            prop_assert_eq!(hit(&eightfold, &mesh, ray).map(|hit| hit.range_m), exact);
        }

        #[test]
        fn both_ways_to_gather_signs_agree(
            numbers in prop::array::uniform8(prop::num::f32::ANY),
        ) {
            let [fast, plain] =
                [Marks::of_signs(&numbers), Marks::of_signs_one_by_one(&numbers)].map(|marks| marks.0);
            prop_assert_eq!(fast, plain);
        }
    }

    #[test]
    fn a_ray_along_an_axis_or_in_a_face_of_a_box_meets_what_it_should() {
        let cube = solids::cuboid(DVec3::ONE, 0.25);
        let all: Vec<u32> = (0..cube.facets.len() as u32).collect();
        let eightfold = Eightfold::new(&cube, &Boxes::new(&cube, &all));
        for turn in [DMat3::IDENTITY, DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X)] {
            for x in [-0.5, -0.25, 0.0, 0.125, 0.5] {
                let [from, to] = [DVec3::new(x, 0.25, 2.0), DVec3::new(x, 0.25, -2.0)];
                let origin: Point<Global> = (turn * from).into();
                let direction = origin.towards((turn * to).into()).unwrap();
                let hit = hit(&eightfold, &cube, Ray { origin, direction });
                assert!(hit.is_some_and(|hit| (hit.range_m - 1.5).abs() < 1e-12), "{x}: {hit:?}");
            }
        }
    }

    #[test]
    fn a_box_of_many_facets_goes_on_in_the_next_block() {
        let ball = solids::icosphere(0.5, 1);
        let all: Vec<u32> = (0..ball.facets.len() as u32).collect();
        let sphere = Boxes::new(&ball, &all).sphere;
        let mut heap = Eightfold { nodes: vec![Node::EMPTY], blocks: Vec::new(), sphere };
        let content = heap.push_facets(&ball, &all);
        heap.nodes[0].content[3] = content;
        for axis in 0..3 {
            (heap.nodes[0].low[axis][3], heap.nodes[0].high[axis][3]) = (-1.0, 1.0);
        }
        assert_eq!(heap.blocks.len(), 10);
        for facet in all {
            let origin = Point::new(3.0, 2.0, 5.0);
            let direction = origin.towards(ball.centroid(facet as usize).into()).unwrap();
            let ray = Ray { origin, direction };
            let expected = crate::trace::Bvh::new(&ball).closest(&ray);
            assert_eq!(hit(&heap, &ball, ray), expected);
        }
    }

    #[test]
    fn what_does_not_fit_on_the_stack_is_put_aside() {
        let mut stack = Stack::new();
        for branch in 0..1000 {
            stack.make_room();
            stack.push(branch as f32, branch);
        }
        let popped: Vec<u32> =
            std::iter::from_fn(|| stack.pop()).map(|(_, content)| content).collect();
        assert_eq!(popped, (0..1000).rev().collect::<Vec<_>>());
    }
}
