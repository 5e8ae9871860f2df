// Finds the nearest facet of every ray, in f32 with bounds of its rounding; one invocation per ray.
//
// Lengths are in radii of the sphere around the mesh, and count from its centre. Every coordinate
// and depth is at most 2.1 times the ray's `size`, which is 1 or slightly more. Depth is the path along the axis on
// which a ray's direction is 1 or -1.
//
// Let n = 2^-24. The vector from the ray's origin to a corner errs by 4.2 n: n and 1.1 n from the inputs, and 2.1 n
// from the difference. After the shear along the ray, whose slopes err by n, it errs by at most 17 n, for which 24 n
// is used. An edge form is the difference of two products of such coordinates. If m is the largest of them and d = 24 n,
// it errs by less than 4 (m + 2 d) (d + n m). All bounds are proportional to `size`, and hold whether or not products
// are fused with sums.

const ROUNDING: f32 = 5.9604645e-8;
const BESIDE_ERROR: f32 = 24.0 * ROUNDING;
const DEPTH_ERROR: f32 = 16.0 * ROUNDING;

/// A depth beyond all others.
const FAR: f32 = 1e30;

/// Least component of a direction; smaller ones are replaced by it. Across the mesh this moves the ray by 2^-28, far
/// less than the margin of the boxes, 1e-5.
const LEAST_SLOPE: f32 = 9.313226e-10;

/// Answers other than the number of a leaf entry: a miss, and a ray that f32 cannot decide.
const NOTHING: u32 = 0xffffffffu;
const UNSURE: u32 = 0xfffffffeu;

/// Size of the stack of boxes. The CPU traces a ray that needs more.
const WAITING: u32 = 64u;

struct Node {
    low: vec3f,
    /// Number of leaf entries from `first` on; 0 for an inner node, whose children are `first` and `first` + 1.
    count: u32,
    high: vec3f,
    first: u32,
}

struct Ray {
    origin: vec3f,
    /// The answer if it is known in advance, otherwise 0.
    known: u32,
    direction: vec3f,
    size: f32,
}

@group(0) @binding(0) var<storage, read> nodes: array<Node>;
/// Three corners per leaf entry; their fourth components are the unit normal.
@group(0) @binding(1) var<storage, read> corners: array<vec4f>;
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> answers: array<u32>;

/// The facets of a ray so far. Of those that it certainly hits, `entry` has the least upper bound of the depth, with the
/// bounds `low` and `high`. `others_low` is the least lower bound of all others.
struct Met {
    entry: u32,
    low: f32,
    high: f32,
    others_low: f32,
}

@compute @workgroup_size(64)
fn closest(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&rays) {
        let ray = rays[id.x];
        if ray.known == 0u {
            answers[id.x] = answer(ray);
        } else {
            answers[id.x] = ray.known;
        }
    }
}

fn answer(ray: Ray) -> u32 {
    let least = vec3f(LEAST_SLOPE);
    let per = 1.0 / select(ray.direction, least, abs(ray.direction) < least);
    var met = Met(NOTHING, FAR, FAR, FAR);
    var waiting: array<u32, WAITING>;
    var count = 0u;
    var at = 0u;
    loop {
        let node = nodes[at];
        var next = NOTHING;
        if node.count > 0u {
            for (var entry = node.first; entry < node.first + node.count; entry++) {
                meet(ray, entry, &met);
            }
        } else {
            let one = entered(ray, per, node.first, met.high);
            let other = entered(ray, per, node.first + 1u, met.high);
            if max(one, other) < FAR {
                if count == WAITING {
                    return UNSURE;
                }
                waiting[count] = select(node.first, node.first + 1u, one <= other);
                count++;
            }
            if min(one, other) < FAR {
                next = select(node.first + 1u, node.first, one <= other);
            }
        }
        if next == NOTHING {
            if count == 0u {
                break;
            }
            count--;
            next = waiting[count];
        }
        at = next;
    }
    if met.others_low < FAR && met.others_low <= met.high {
        return UNSURE;
    }
    return met.entry;
}

/// Depth at which the ray enters a box; FAR if it misses the box or enters beyond `end`.
fn entered(ray: Ray, per: vec3f, at: u32, end: f32) -> f32 {
    let node = nodes[at];
    let one = (node.low - ray.origin) * per;
    let other = (node.high - ray.origin) * per;
    let near = min(one, other);
    let far = max(one, other);
    let first = max(max(near.x, near.y), max(near.z, 0.0));
    let last = min(min(far.x, far.y), min(far.z, end));
    return select(FAR, first, first <= last);
}

/// The components of v in cyclic order, with the axis last on which the direction is 1 or -1.
fn turned(v: vec3f, direction: vec3f) -> vec3f {
    let size = abs(direction);
    if size.z == 1.0 {
        return v;
    }
    return select(v.zxy, v.yzx, size.x == 1.0);
}

fn meet(ray: Ray, entry: u32, met: ptr<function, Met>) {
    let direction = turned(ray.direction, ray.direction);
    let slope = direction.xy * direction.z;
    let a = turned(corners[3u * entry].xyz - ray.origin, ray.direction);
    let b = turned(corners[3u * entry + 1u].xyz - ray.origin, ray.direction);
    let c = turned(corners[3u * entry + 2u].xyz - ray.origin, ray.direction);
    let p = a.xy - slope * a.z;
    let q = b.xy - slope * b.z;
    let r = c.xy - slope * c.z;
    let edges = vec3f(q.x * r.y - q.y * r.x, r.x * p.y - r.y * p.x, p.x * q.y - p.y * q.x);
    let farthest = max(max(abs(p), abs(q)), abs(r));
    let most = max(farthest.x, farthest.y);
    let beside = BESIDE_ERROR * ray.size;
    let doubt = 4.0 * (most + 2.0 * beside) * (beside + ROUNDING * most);
    let least = min(min(edges.x, edges.y), edges.z);
    let greatest = max(max(edges.x, edges.y), edges.z);
    if least < -doubt && greatest > doubt {
        return;
    }
    let depth = bounds(vec3f(a.z, b.z, c.z) * direction.z, edges, doubt, DEPTH_ERROR * ray.size);
    if depth.y < 0.0 {
        return;
    }
    let is_inside = least > doubt || greatest < -doubt;
    if is_inside && depth.x > 0.0 && depth.y < (*met).high {
        *met = Met(entry, depth.x, depth.y, min((*met).others_low, (*met).low));
    } else {
        (*met).others_low = min((*met).others_low, depth.x);
    }
}

/// Bounds of the depth of a hit. The weight of a corner is the share of its edge form in their sum, and errs by at most
/// 4.1 times the doubt over the sum. For a facet seen edge-on the bounds are the depths of its corners.
fn bounds(corners: vec3f, edges: vec3f, doubt: f32, depth_error: f32) -> vec2f {
    var low = min(min(corners.x, corners.y), corners.z);
    var high = max(max(corners.x, corners.y), corners.z);
    let sum = edges.x + edges.y + edges.z;
    if abs(sum) > 10.0 * doubt {
        let further = edges.y * (corners.y - corners.x) + edges.z * (corners.z - corners.x);
        let depth = corners.x + further / sum;
        let error = (high - low) * (9.0 * doubt / abs(sum) + 24.0 * ROUNDING);
        low = max(low, depth - error);
        high = min(high, depth + error);
    }
    return vec2f(low - depth_error, high + depth_error);
}
