// What comes back to the antenna of the rays of a chirp; one invocation for up to 32 of them. Stands behind
// closest.wgsl, which finds what they meet.
//
// A ray of the spot leaves the antenna along the axis's direction and an aside of it. Asides are small, and so is what
// they err by: a slope errs by n more than the axis's, and the place where the ray comes near the mesh by n more and
// by 6 n for each radius that the spot reaches there. Sheared along the ray, a corner then errs by 22 n and
// 23 n for each radius, which stays below 24 n times `size`, 1 and twice that reach.
//
// cos θ errs by 6 n and the range, in radii, by 18 n over cos θ. Where that could tell, the ray is the processor's.
//
// A power that an f32 cannot hold is `LEAST`, so that there is an echo where an f64 has one, however faint.

/// cos θ, and cos θ times a range below 1, from which on f32 tells the power to 0.02 dB.
const GRAZING: f32 = 2e-3;

/// Far below any receiver, and far enough above the least f32 to be multiplied with a range.
const LEAST: f32 = 1e-34;

/// exp(-x) is 0 in f64 from the second on, and not yet at the first, whatever it is multiplied with.
const FAINT: f32 = 650.0;
const GONE: f32 = 750.0;

/// Rays of one invocation, a bit for each.
const SHARE: u32 = 32u;

/// Roughness of what is no facet's, which divides by nothing.
const LEAST_M: f32 = 1e-3;

/// A law that has no terms to add up.
const NO_TERMS: u32 = 0xffffffffu;

const GGX: u32 = 1u;

/// A chirp where its axis comes near the mesh.
struct Spot {
    origin: vec3f,
    /// How often `direction` fits between the antenna and there.
    run: f32,
    direction: vec3f,
    size: f32,
    /// What the coordinates of a sample add to the direction.
    right: vec3f,
    /// The law of region 0.
    law: u32,
    up: vec3f,
    /// An answer that is known already, or 0.
    known: u32,
}

/// level · cosᵃ θ · P(tan² θ / m²) · G1(θ)ˢ.
struct Term {
    level: f32,
    cosines: f32,
    /// m, 0 for a diffuse term.
    m: f32,
    /// The law P and, from bit 1 on, s.
    form: u32,
}

@group(0) @binding(4) var<storage, read> regions: array<u32>;
@group(0) @binding(5) var<storage, read> spots: array<Spot>;
@group(0) @binding(6) var<storage, read> samples: array<vec2f>;
/// First term and number of terms.
@group(0) @binding(7) var<storage, read> laws: array<vec2u>;
@group(0) @binding(8) var<storage, read> terms: array<Term>;

/// A ray of a spot, and the stretch of its direction over the axis's.
struct Beside {
    ray: Ray,
    stretch: f32,
}

/// What a ray brings back: f cosᵃ θ / R² in radii, and R; below 0 where f32 cannot tell.
struct Back {
    power: f32,
    range: f32,
}

@compute @workgroup_size(64)
fn echo(@builtin(global_invocation_id) id: vec3u) {
    let count = arrayLength(&samples);
    let shares = (count + SHARE - 1u) / SHARE;
    let number = id.x / shares;
    if number >= arrayLength(&spots) {
        return;
    }
    let spot = spots[number];
    let first = SHARE * (id.x % shares);
    var open = 0u;
    var power = 0.0;
    var moment = 0.0;
    for (var bit = 0u; bit < min(SHARE, count - first); bit++) {
        let back = came_back(spot, samples[first + bit]);
        if back.power < 0.0 {
            open |= 1u << bit;
        } else {
            power += back.power;
            moment += back.power * back.range;
        }
    }
    answers[3u * id.x] = open;
    answers[3u * id.x + 1u] = bitcast<u32>(power);
    answers[3u * id.x + 2u] = bitcast<u32>(moment);
}

fn came_back(spot: Spot, sample: vec2f) -> Back {
    var entry = spot.known;
    let way = beside(spot, sample);
    if entry == 0u {
        entry = answer(way.ray);
    }
    if entry == NOTHING {
        return Back(0.0, 0.0);
    }
    if entry == UNSURE {
        return Back(-1.0, 0.0);
    }
    return scattered(spot, way, entry);
}

fn beside(spot: Spot, sample: vec2f) -> Beside {
    let aside = sample.x * spot.right + sample.y * spot.up;
    let size = abs(spot.direction);
    let is_along = vec3<bool>(
        size.z != 1.0 && size.x == 1.0,
        size.z != 1.0 && size.x != 1.0,
        size.z == 1.0,
    );
    let along = dot(aside, select(vec3f(0.0), spot.direction, is_along));
    let stretch = 1.0 + along;
    // One component stays 1 or -1, exactly.
    let direction = spot.direction + (aside - along * spot.direction) / stretch;
    return Beside(Ray(spot.origin + spot.run * aside, 0u, direction, spot.size), stretch);
}

fn scattered(spot: Spot, way: Beside, entry: u32) -> Back {
    let ray = way.ray;
    let corner = corners[3u * entry];
    let normal = vec3f(corner.w, corners[3u * entry + 1u].w, corners[3u * entry + 2u].w);
    let unit = length(ray.direction);
    let towards = dot(ray.direction, normal);
    let cosine = min(abs(towards) / unit, 1.0);
    let depth = dot(corner.xyz - ray.origin, normal) / towards;
    let range = unit * (spot.run * way.stretch + depth);
    let law = laws[spot.law + regions[entry]];
    if cosine < GRAZING || cosine * range < GRAZING || law.y == NO_TERMS {
        return Back(-1.0, 0.0);
    }
    // The difference of 1 and cos² θ would have lost its digits.
    let across = cross(ray.direction, normal) / unit;
    let tangent = sqrt(dot(across, across)) / cosine;
    var sum = 0.0;
    var is_told = true;
    for (var term = law.x; term < law.x + law.y; term++) {
        let one = told(terms[term], cosine, tangent);
        is_told = is_told && one >= 0.0;
        sum += max(one, 0.0);
    }
    if sum == 0.0 {
        return Back(select(-1.0, 0.0, is_told), 0.0);
    }
    return Back(max(sum / (range * range), LEAST), range);
}

/// Below 0 where f32 cannot tell whether an f64 holds it.
fn told(term: Term, cosine: f32, tangent: f32) -> f32 {
    let slope = tangent / max(term.m, LEAST_M);
    let is_diffuse = term.m == 0.0;
    let is_ggx = (term.form & 1u) == GGX;
    let lost = select(select(slope * slope, 0.0, is_ggx), -term.cosines * log(cosine), is_diffuse);
    if term.level == 0.0 || lost > GONE {
        return 0.0;
    }
    if lost > FAINT {
        return -1.0;
    }
    let level = term.level * pow(cosine, term.cosines);
    if is_diffuse {
        return max(level, LEAST);
    }
    let wide = 1.0 / (1.0 + slope * slope);
    let law = select(exp(-slope * slope), wide * wide, is_ggx);
    let seen = select(seen_beckmann(term.m * tangent), seen_ggx(term.m * tangent), is_ggx);
    let shadowed = term.form >> 1u;
    let together = select(1.0, seen, shadowed >= 1u) * select(1.0, seen, shadowed >= 2u);
    return max(level * law * together, LEAST);
}

/// Smith's G1 of m tan θ.
fn seen_beckmann(slope: f32) -> f32 {
    if slope <= 0.625 {
        return 1.0;
    }
    let a = 1.0 / slope;
    return (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a);
}

fn seen_ggx(slope: f32) -> f32 {
    return 2.0 / (1.0 + sqrt(1.0 + slope * slope));
}
