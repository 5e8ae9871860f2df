// Sums the echoes of the rays of a chirp; one invocation per 32 rays. It is appended to closest.wgsl, which finds
// their hits.
//
// A ray of the spot stands on the wavefront of the beam, beside the axis and with a slope against it. Both are small,
// and so is their rounding: a slope errs by n more than that of the axis, and the point where the ray starts near the
// mesh by n more, and by 6 n per radius of the spot's reach there. After the shear along the ray, a corner errs by
// 22 n, and by 23 n per radius of reach. This stays below 24 n times `size`, which is 1 plus twice the reach.
//
// cos θ errs by 6 n, and the range, in radii, by 18 n over cos θ. The CPU computes the rays for which this matters.
//
// A power below the range of f32 becomes `LEAST`, so that there is an echo wherever f64 has one.
//
// Of a lobe of facets, the part that the beam's own width has in it is coherent.

/// Least cos θ, and least cos θ times a range below 1, for which f32 gives the power within 0.02 dB.
const GRAZING: f32 = 2e-3;

/// A power far below any threshold, yet large enough for an f32 to be multiplied by a range.
const LEAST: f32 = 1e-34;

/// exp(-x) times any factor is certainly not 0 in f64 up to FAINT, and certainly 0 from GONE on.
const FAINT: f32 = 650.0;
const GONE: f32 = 750.0;

/// Rays per invocation, one bit each.
const SHARE: u32 = 32u;

/// Square of the least width of a lobe that f32 can evaluate.
const LEAST_WIDTH2: f32 = 1e-6;

/// As in slopes.rs and backscatter.rs.
const MOST_OF_SERIES: f32 = 0.03;
const STEP_LN: f32 = 0.8;
const MOST_T: f32 = 14.0;
const STEPS: u32 = 32u;
const UNSEEN: f32 = 1e-4;

/// Number of terms of a scattering model without terms.
const NO_TERMS: u32 = 0xffffffffu;

/// In place of a smooth piece of the mesh: that of rays that meet nothing or do not all lie on one, and of no ray.
const NO_PIECE: u32 = 0xffffffffu;
const ANY_PIECE: u32 = 0xfffffffeu;

const GGX: u32 = 1u;
const SHADOWED: u32 = 6u;
const INCLUDES_BEAM: u32 = 8u;
const FACETS: u32 = 16u;

/// A chirp that starts where its axis comes near the mesh.
struct Spot {
    origin: vec3f,
    /// Distance from the radar to `origin` along the axis, in radii.
    start: f32,
    direction: vec3f,
    size: f32,
    /// The vectors, in radii, by which the coordinates of a sample are multiplied; their sum leads from the axis to
    /// the sample's place in the section of the beam where the samples lie.
    right: vec3f,
    /// Number of the scattering model of region 0.
    law: u32,
    up: vec3f,
    /// The answer if it is known in advance, otherwise 0.
    known: u32,
    /// Distance of a ray from the axis at `origin` over that in the section.
    spread: f32,
    /// Curvature of the wavefront, per radius.
    curvature: f32,
    /// The antenna's solid angle falls as 1 / (offset + ((R - middle) per_depth)^2).
    offset: f32,
    middle: f32,
    per_depth: f32,
    /// The beam's divergence squared is beam2 / (1 + ((R - focus) per_rayleigh)^2).
    beam2: f32,
    focus: f32,
    per_rayleigh: f32,
}

/// level · cosᵃ θ · P(tan² θ) · G1(θ)ˢ, where the beam widens P, and cosᵃ θ of a diffuse term.
struct Term {
    level: f32,
    cosines: f32,
    /// Roughness m; of a diffuse term the part of `cosines` that the beam widens.
    m: f32,
    /// The distribution P in bit 0, s in bits 1 and 2, whether m includes the beam in bit 3, and whether the term is of
    /// facets in bit 4.
    form: u32,
}

/// Region and smooth piece of each facet.
@group(0) @binding(4) var<storage, read> places: array<vec2u>;
@group(0) @binding(5) var<storage, read> spots: array<Spot>;
@group(0) @binding(6) var<storage, read> samples: array<vec2f>;
/// First term and number of terms of each scattering model.
@group(0) @binding(7) var<storage, read> laws: array<vec2u>;
@group(0) @binding(8) var<storage, read> terms: array<Term>;

/// A ray of a spot, and the length of the wave's path to its start, in radii.
struct Beside {
    ray: Ray,
    way: f32,
}

/// The echo of a ray: f cosᵃ θ times the antenna's solid angle over its level, the coherent part of that, and R in
/// radii. `power` is negative if f32 cannot compute it.
struct Back {
    power: f32,
    in_phase: f32,
    range: f32,
    piece: u32,
}

/// The part of a law that a term has, and the coherent part of it. `whole` is negative if f32 cannot decide whether the value
/// is 0 in f64.
struct Told {
    whole: f32,
    in_phase: f32,
}

const NOT_TOLD: Told = Told(-1.0, 0.0);
const NO_ECHO: Back = Back(0.0, 0.0, 0.0, NO_PIECE);
const OPEN: Back = Back(-1.0, 0.0, 0.0, NO_PIECE);

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
    var in_phase = 0.0;
    var piece = ANY_PIECE;
    for (var bit = 0u; bit < min(SHARE, count - first); bit++) {
        let back = came_back(spot, samples[first + bit]);
        if back.power < 0.0 {
            open |= 1u << bit;
        } else {
            power += back.power;
            moment += back.power * back.range;
            in_phase += back.in_phase;
            piece = select(NO_PIECE, back.piece, piece == ANY_PIECE || piece == back.piece);
        }
    }
    answers[5u * id.x] = open;
    answers[5u * id.x + 1u] = bitcast<u32>(power);
    answers[5u * id.x + 2u] = bitcast<u32>(moment);
    answers[5u * id.x + 3u] = bitcast<u32>(in_phase);
    answers[5u * id.x + 4u] = piece;
}

fn came_back(spot: Spot, sample: vec2f) -> Back {
    var entry = spot.known;
    let way = beside(spot, sample);
    if entry == 0u {
        entry = answer(way.ray);
    }
    if entry == NOTHING {
        return NO_ECHO;
    }
    if entry == UNSURE {
        return OPEN;
    }
    return scattered(spot, way, entry);
}

fn beside(spot: Spot, sample: vec2f) -> Beside {
    let laid_out = sample.x * spot.right + sample.y * spot.up;
    let beside = spot.spread * laid_out;
    let slope = spot.curvature * laid_out;
    let aside = length(spot.direction) * slope;
    let size = abs(spot.direction);
    let is_along = vec3<bool>(
        size.z != 1.0 && size.x == 1.0,
        size.z != 1.0 && size.x != 1.0,
        size.z == 1.0,
    );
    let along = dot(aside, select(vec3f(0.0), spot.direction, is_along));
    let stretch = 1.0 + along;
    // One component stays exactly 1 or -1.
    let direction = spot.direction + (aside - along * spot.direction) / stretch;
    let way = spot.start + 0.5 * dot(slope, beside);
    return Beside(Ray(spot.origin + beside, 0u, direction, spot.size), way);
}

fn scattered(spot: Spot, way: Beside, entry: u32) -> Back {
    let ray = way.ray;
    let corner = corners[3u * entry];
    let normal = vec3f(corner.w, corners[3u * entry + 1u].w, corners[3u * entry + 2u].w);
    let unit = length(ray.direction);
    let towards = dot(ray.direction, normal);
    let cosine = min(abs(towards) / unit, 1.0);
    let depth = dot(corner.xyz - ray.origin, normal) / towards;
    let range = way.way + unit * depth;
    let place = places[entry];
    let law = laws[spot.law + place.x];
    if cosine < GRAZING || cosine * range < GRAZING || law.y == NO_TERMS {
        return OPEN;
    }
    // 1 - cos² θ would suffer from cancellation.
    let across = cross(ray.direction, normal) / unit;
    let tangent = sqrt(dot(across, across)) / cosine;
    let zeta = (range - spot.focus) * spot.per_rayleigh;
    let beam2 = spot.beam2 / (1.0 + zeta * zeta);
    var sum = Told(0.0, 0.0);
    var is_told = true;
    for (var term = law.x; term < law.x + law.y; term++) {
        let one = told(terms[term], cosine, tangent, beam2);
        is_told = is_told && one.whole >= 0.0;
        sum.whole += max(one.whole, 0.0);
        sum.in_phase += one.in_phase;
    }
    if sum.whole == 0.0 {
        return Back(select(-1.0, 0.0, is_told), 0.0, 0.0, place.y);
    }
    let depths = (range - spot.middle) * spot.per_depth;
    let falloff = spot.offset + depths * depths;
    return Back(max(sum.whole / falloff, LEAST), sum.in_phase / falloff, range, place.y);
}

fn told(term: Term, cosine: f32, tangent: f32, beam2: f32) -> Told {
    if term.level == 0.0 {
        return Told(0.0, 0.0);
    }
    let is_diffuse = (term.form & FACETS) == 0u;
    let is_ggx = (term.form & GGX) == GGX;
    let slope2 = tangent * tangent;
    let lobe = 0.5 * term.m * beam2;
    let widened = select(lobe, 0.0, lobe < UNSEEN);
    let cosines = term.cosines - select(0.0, term.m * widened / (1.0 + widened), is_diffuse);
    let includes_beam = (term.form & INCLUDES_BEAM) != 0u;
    let m2 = max(term.m * term.m - select(0.0, beam2, includes_beam), 0.0);
    if !is_diffuse && m2 + beam2 < LEAST_WIDTH2 {
        return NOT_TOLD;
    }
    let lost = select(
        select(slope2 / (m2 + beam2), 0.0, is_ggx),
        -cosines * log(cosine),
        is_diffuse,
    );
    if lost > GONE {
        return Told(0.0, 0.0);
    }
    if lost > FAINT {
        return NOT_TOLD;
    }
    let level = term.level * pow(cosine, cosines);
    if is_diffuse {
        return Told(max(level / (1.0 + widened), LEAST), 0.0);
    }
    var law = exp(-lost) / (m2 + beam2);
    if is_ggx {
        law = density_ggx(slope2, m2, beam2);
    }
    let seen = select(seen_beckmann(term.m * tangent), seen_ggx(term.m * tangent), is_ggx);
    let shadowed = (term.form & SHADOWED) >> 1u;
    let together = select(1.0, seen, shadowed >= 1u) * select(1.0, seen, shadowed >= 2u);
    let whole = max(level * law * together, LEAST);
    return Told(whole, whole * beam2 / (term.m * term.m + beam2));
}

/// π times GGX's density of slopes as the beam widens it: `Distribution::density` of slopes.rs.
fn density_ggx(slope2: f32, m2: f32, beam2: f32) -> f32 {
    let sum2 = m2 + slope2;
    let small = beam2 / sum2;
    if small <= MOST_OF_SERIES {
        let steep = slope2 / sum2;
        let first = 2.0 - 6.0 * steep;
        let second = 6.0 + steep * (60.0 * steep - 48.0);
        let third = 24.0 + steep * (steep * (1080.0 - 840.0 * steep) - 360.0);
        return m2 / (sum2 * sum2) * (1.0 - small * (first - small * (second - small * third)));
    }
    var sum = 0.0;
    for (var step = 0u; step < STEPS; step++) {
        let t = MOST_T * exp(-STEP_LN * f32(step));
        let width2 = m2 / t + beam2;
        let exponent = slope2 / width2;
        let term = STEP_LN * t * exp(-t) * exp(-exponent) / width2;
        sum += term;
        if exponent < 0.5 && term < 1e-4 * sum {
            break;
        }
    }
    return sum;
}

/// Smith's shadowing function G1 of m tan θ.
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
