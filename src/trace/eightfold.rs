//! Boxes eight to a node and facets eight to a block, side by side for vector instructions.
//!
//! A ray is told from the facets that it surely passes beside in f32, with a bound of the rounding; f64 decides the
//! few that are left. The library's own triangle tests lose rays on shared edges; ours is in `facet.rs`.

use std::array::from_fn;

use super::Hit;
use super::boxes::{Boxes, PADDING, Sphere};
use super::facet::{Line, met};
use super::wide::{Wide, widest};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// Boxes of a node, facets of a block.
const LANES: usize = 8;

type Lanes = [f32; LANES];

/// Marks the number of a block among those of nodes.
const BLOCK: u32 = 1 << 31;

/// Branches that are kept beside each other; more are put aside.
const STACK: usize = 128;

/// The hierarchy, from the centre of its sphere.
pub(super) struct Eightfold {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    sphere: Sphere,
}

/// Boxes by axis, and what is in each: a node, or the first block of facets.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Node {
    low: [Lanes; 3],
    high: [Lanes; 3],
    within: [u32; LANES],
}

/// Facets by corner and axis.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Block {
    corners: [[Lanes; 3]; 3],
    facets: [u32; LANES],
    /// How many there are.
    count: u32,
    /// Whether the next block has more of the same box.
    goes_on: bool,
}

impl Node {
    /// Boxes that no ray meets.
    const EMPTY: Node = Node {
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::NEG_INFINITY; LANES]; 3],
        within: [0; LANES],
    };
}

impl Eightfold {
    /// From boxes with two branches each.
    pub fn new(mesh: &Mesh, boxes: &Boxes) -> Eightfold {
        let mut eightfold =
            Eightfold { nodes: Vec::new(), blocks: Vec::new(), sphere: boxes.sphere };
        if boxes.facets.is_empty() {
            return eightfold;
        }
        let counts = counts(boxes);
        eightfold.nodes.push(Node::EMPTY);
        let mut open = vec![(0, 0)];
        while let Some((branch, number)) = open.pop() {
            for (lane, branch) in branches(boxes, &counts, branch).into_iter().enumerate() {
                let within = match counts[branch] as usize {
                    0..=LANES => eightfold.push_facets(mesh, &facets(boxes, branch)),
                    _ if boxes.tree.nodes[branch].is_leaf() => {
                        eightfold.push_facets(mesh, &facets(boxes, branch))
                    }
                    _ => {
                        eightfold.nodes.push(Node::EMPTY);
                        let number = eightfold.nodes.len() - 1;
                        open.push((branch, number));
                        number as u32
                    }
                };
                let (around, node) = (boxes.tree.nodes[branch].aabb, &mut eightfold.nodes[number]);
                for axis in 0..3 {
                    node.low[axis][lane] = around.min[axis];
                    node.high[axis][lane] = around.max[axis];
                }
                node.within[lane] = within;
            }
        }
        eightfold
    }

    /// Facets in one box, at least one; the mark and number of their first block.
    fn push_facets(&mut self, mesh: &Mesh, facets: &[u32]) -> u32 {
        let first = self.blocks.len() as u32;
        for facets in facets.chunks(LANES) {
            let mut block = Block {
                corners: [[[0.0; LANES]; 3]; 3],
                facets: [0; LANES],
                count: facets.len() as u32,
                goes_on: true,
            };
            for (lane, &facet) in facets.iter().enumerate() {
                block.facets[lane] = facet;
                for (corner, at) in mesh.corners(facet as usize).into_iter().enumerate() {
                    let at = (at - self.sphere.centre).as_vec3().to_array();
                    (0..3).for_each(|axis| block.corners[corner][axis][lane] = at[axis]);
                }
            }
            self.blocks.push(block);
        }
        if let Some(last) = self.blocks.last_mut() {
            last.goes_on = false;
        }
        BLOCK | first
    }

    /// The closest hit of one ray; of equally near facets the one with the smallest number.
    pub fn closest(&self, mesh: &Mesh, ray: &Ray<Global>) -> Option<Hit> {
        let start_m = self.sphere.entry_m(ray)?;
        let facet = widest(Walk { eightfold: self, mesh, ray, start_m })?;
        let [hit] = met(mesh, [facet], [ray]);
        hit
    }
}

/// How many facets are under each branch.
fn counts(boxes: &Boxes) -> Vec<u32> {
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

/// Up to eight branches that a branch is made of: the largest are opened first.
fn branches(boxes: &Boxes, counts: &[u32], branch: usize) -> Vec<usize> {
    let nodes = &boxes.tree.nodes;
    let mut branches = vec![branch];
    while branches.len() < LANES {
        let is_whole = |branch: usize| counts[branch] <= LANES as u32 || nodes[branch].is_leaf();
        let open = (0..branches.len()).filter(|&place| !is_whole(branches[place]));
        let area = |&place: &usize| nodes[branches[place]].aabb.half_area();
        let Some(place) = open.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let first = nodes[branches[place]].first_index as usize;
        branches[place] = first;
        branches.push(first + 1);
    }
    branches
}

/// All facets under a branch.
fn facets(boxes: &Boxes, branch: usize) -> Vec<u32> {
    let (mut facets, mut open) = (Vec::new(), vec![branch]);
    while let Some(branch) = open.pop() {
        let node = &boxes.tree.nodes[branch];
        let first = node.first_index as usize;
        match node.is_leaf() {
            true => {
                facets.extend_from_slice(&boxes.facets[first..first + node.prim_count as usize]);
            }
            false => open.extend([first, first + 1]),
        }
    }
    facets
}

/// A ray on its way through the boxes.
struct Walk<'a> {
    eightfold: &'a Eightfold,
    mesh: &'a Mesh,
    ray: &'a Ray<Global>,
    /// Where it reaches the sphere, m.
    start_m: f64,
}

impl Wide for Walk<'_> {
    /// The nearest facet.
    type Answer = Option<u32>;

    #[inline(always)]
    fn run(self) -> Option<u32> {
        let Walk { eightfold: &Eightfold { ref nodes, ref blocks, sphere }, mesh, ray, start_m } =
            self;
        let (aim, line) = (Aim::new(&sphere, ray, start_m), Line::new(ray));
        let (mut nearest, mut limit): (Option<(f64, u32)>, f32) = (None, f32::INFINITY);
        let mut stack = Stack::new();
        stack.push(0.0, 0);
        while let Some((near, within)) = stack.pop() {
            if near > limit {
                continue;
            }
            if within & BLOCK == 0 {
                let (mut hits, near) = aim.boxes(&nodes[within as usize], limit);
                stack.make_room();
                let base = stack.len;
                while hits != 0 {
                    let lane = hits.trailing_zeros() as usize % LANES;
                    hits &= hits - 1;
                    stack.sort_in(base, near[lane], nodes[within as usize].within[lane]);
                }
                continue;
            }
            for block in &blocks[(within ^ BLOCK) as usize..] {
                let mut hits = aim.facets(block);
                while hits != 0 {
                    let facet = block.facets[hits.trailing_zeros() as usize % LANES];
                    hits &= hits - 1;
                    if let Some(range_m) = line.crossing_m(mesh, facet as usize)
                        && nearest.is_none_or(|nearest| (range_m, facet) < nearest)
                    {
                        nearest = Some((range_m, facet));
                        // Later boxes are skipped only when they are farther by more than f32 can blur.
                        limit = (range_m - start_m + 2.0 * PADDING * sphere.radius_m) as f32;
                    }
                }
                if !block.goes_on {
                    break;
                }
            }
        }
        nearest.map(|(_, facet)| facet)
    }
}

/// A ray in f32, from where it reaches the sphere.
struct Aim {
    origin: [f32; 3],
    /// One over the direction.
    per: [f32; 3],
    /// The axis that the ray runs along most, and the other two.
    axes: [usize; 3],
    /// How far it runs along these two while it runs along the first.
    shear: [f32; 2],
    /// A corner's place beside the ray is good to this, m.
    doubt_m: f32,
}

impl Aim {
    #[inline(always)]
    fn new(sphere: &Sphere, ray: &Ray<Global>, start_m: f64) -> Aim {
        let direction = ray.direction.xyz();
        let origin = ray.origin.xyz + start_m * direction - sphere.centre;
        let along = direction.abs().max_position();
        let axes = [along, (along + 1) % 3, (along + 2) % 3];
        let shear = [1, 2].map(|axis| (direction[axes[axis]] / direction[along]) as f32);
        // Origin and corners lie within one radius of the centre. Their rounding and that of what is
        // computed of them come to 16 roundoffs of it: 4 of their difference along each axis, 8 of
        // what the shear takes off, 4 of taking it off.
        let doubt_m =
            (16.0 * f64::from(f32::EPSILON / 2.0) * sphere.radius_m * (1.0 + PADDING)) as f32;
        Aim {
            origin: origin.as_vec3().to_array(),
            per: direction.as_vec3().to_array().map(f32::recip),
            axes,
            shear,
            doubt_m: 2.0 * doubt_m,
        }
    }

    /// A bit for every box that the ray reaches before `limit`, and where it enters it.
    #[inline(always)]
    fn boxes(&self, node: &Node, limit: f32) -> (u32, Lanes) {
        let (mut near, mut far) = ([0.0; LANES], [limit; LANES]);
        for axis in 0..3 {
            let (origin, per) = (self.origin[axis], self.per[axis]);
            let (first, last) = match per < 0.0 {
                true => (&node.high[axis], &node.low[axis]),
                false => (&node.low[axis], &node.high[axis]),
            };
            for lane in 0..LANES {
                // Along a face that it runs in, a ray is at no number; it then is within.
                let (enters, leaves) = ((first[lane] - origin) * per, (last[lane] - origin) * per);
                near[lane] = if enters > near[lane] { enters } else { near[lane] };
                far[lane] = if leaves < far[lane] { leaves } else { far[lane] };
            }
        }
        (bits(|lane| near[lane] <= far[lane]), near)
    }

    /// A bit for every facet that the ray does not surely pass beside.
    #[inline(always)]
    fn facets(&self, block: &Block) -> u32 {
        let [along, across, up] = self.axes;
        let place = |corner: &[Lanes; 3]| {
            let depth: Lanes = from_fn(|lane| corner[along][lane] - self.origin[along]);
            let beside = |axis: usize, shear: f32| -> Lanes {
                from_fn(|lane| corner[axis][lane] - self.origin[axis] - shear * depth[lane])
            };
            [beside(across, self.shear[0]), beside(up, self.shear[1])]
        };
        let [a, b, c] = [0, 1, 2].map(|corner| place(&block.corners[corner]));
        let reach = |at: &[Lanes; 2]| -> Lanes {
            from_fn(|lane| self.doubt_m * (at[0][lane].abs() + at[1][lane].abs() + self.doubt_m))
        };
        let [reach_a, reach_b, reach_c] = [reach(&a), reach(&b), reach(&c)];
        // The volume of an edge: of either sign when it is nearer to zero than the doubt.
        let sides = |from: &[Lanes; 2], to: &[Lanes; 2], reaches: [&Lanes; 2]| {
            let edge: Lanes =
                from_fn(|lane| from[0][lane] * to[1][lane] - from[1][lane] * to[0][lane]);
            let doubt: Lanes =
                from_fn(|lane| reaches[0][lane] + reaches[1][lane] + f32::MIN_POSITIVE);
            let [left, right]: [Lanes; 2] = [
                from_fn(|lane| edge[lane] + doubt[lane]),
                from_fn(|lane| doubt[lane] - edge[lane]),
            ];
            [left, right]
        };
        let ab = sides(&a, &b, [&reach_a, &reach_b]);
        let bc = sides(&b, &c, [&reach_b, &reach_c]);
        let ca = sides(&c, &a, [&reach_c, &reach_a]);
        let inside = bits(|lane| {
            let all = |side: usize| {
                (ab[side][lane] >= 0.0) & (bc[side][lane] >= 0.0) & (ca[side][lane] >= 0.0)
            };
            all(0) | all(1)
        });
        inside & ((1 << block.count) - 1)
    }
}

/// A bit for every lane of which something is true.
#[inline(always)]
fn bits(is_true: impl Fn(usize) -> bool) -> u32 {
    let marked: [u32; LANES] = from_fn(|lane| u32::from(is_true(lane)) << lane);
    marked.iter().fold(0, |bits, bit| bits | bit)
}

/// Branches that a ray has yet to look into, the nearest of a node on top.
struct Stack {
    /// Distances as the bits of an f32 that is not negative, which are ordered as it is; below them what is within.
    top: [u64; STACK],
    len: usize,
    /// What did not fit.
    aside: Vec<u64>,
}

impl Stack {
    #[inline(always)]
    fn new() -> Stack {
        Stack { top: [0; STACK], len: 0, aside: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, near: f32, within: u32) {
        self.sort_in(self.len, near, within);
    }

    /// Makes room for a node's branches.
    #[inline(always)]
    fn make_room(&mut self) {
        if self.len + LANES > STACK {
            self.aside.extend_from_slice(&self.top[..self.len]);
            self.len = 0;
        }
    }

    /// Pushes a branch; those from `base` on stay sorted.
    #[inline(always)]
    fn sort_in(&mut self, base: usize, near: f32, within: u32) {
        let branch = u64::from(near.to_bits()) << 32 | u64::from(within);
        let mut at = self.len.min(STACK - 1);
        while at > base && self.top[at - 1] < branch {
            self.top[at] = self.top[at - 1];
            at -= 1;
        }
        self.top[at] = branch;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(f32, u32)> {
        let branch = match self.len {
            0 => self.aside.pop()?,
            _ => {
                self.len -= 1;
                self.top[self.len]
            }
        };
        Some((f32::from_bits((branch >> 32) as u32), branch as u32))
    }
}
