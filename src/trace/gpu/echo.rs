//! Computes echoes on a graphics processor: it traces the rays of whole chirps and adds up their single paths to
//! the radar by equation (11), in f32 (`echo.wgsl`).
//!
//! A chirp is passed as its axis and the two vectors that span its spot; the device generates the rays. It leaves rays
//! open that it cannot compute: those with [`Answer::Unsure`](super::Answer), those at grazing incidence, and those
//! on a scattering model without [`Term`]s. The power of all others is within 0.02 dB.

use glam::DVec2;

use super::device::Table;
use super::error::GpuError;
use super::mesh::{GpuMesh, RAYS_AT_ONCE, pipeline};
use super::packed::{self, Cone};
use crate::brdf::{Distribution, Facets, Term};

/// Rays per invocation, and so per [`Share`].
pub const RAYS_PER_SHARE: usize = 32;

/// Largest power of the cosine that f32 can evaluate.
const MOST_COSINES: f64 = 1100.0;

/// Marks a term of facets, as in the shader.
const FACETS: u32 = 16;

/// Number of terms that marks a scattering model without terms, as in the shader.
const NO_TERMS: u32 = u32::MAX;

/// In place of the number of a smooth piece, as in the shader: rays that do not all lie on one, and no ray at all.
const NO_PIECE: u32 = u32::MAX;
const ANY_PIECE: u32 = u32::MAX - 1;

/// The sums over up to [`RAYS_PER_SHARE`] rays of a chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Rays left to the CPU, one bit each, the lowest for the first ray.
    pub open: u32,
    /// Sum of f·cosᵃθ·Ω(R)/level over the other rays, 1/sr, by the chirp's [`SolidAngle`](crate::radar::SolidAngle).
    pub per_sr: f64,
    /// Sum of R·f·cosᵃθ·Ω(R)/level over the other rays, m/sr.
    pub m_per_sr: f64,
    /// The part of `per_sr` that is coherent, 1/sr.
    pub coherent_per_sr: f64,
    /// Where the other rays lie.
    pub piece: Piece,
}

/// Which smooth piece of a mesh some rays lie on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// There are no rays.
    Any,
    /// All lie on one, by its number.
    One(u32),
    /// They lie on several, or some miss the mesh.
    Several,
}

impl Piece {
    /// Where these rays and others lie.
    pub fn and(self, other: Piece) -> Piece {
        match (self, other) {
            (Piece::Any, piece) | (piece, Piece::Any) => piece,
            (own, other) if own == other => own,
            _ => Piece::Several,
        }
    }

    fn of_word(word: u32) -> Piece {
        match word {
            ANY_PIECE => Piece::Any,
            NO_PIECE => Piece::Several,
            number => Piece::One(number),
        }
    }
}

impl Share {
    /// Rays that all miss the target.
    pub const DARK: Share =
        Share { open: 0, per_sr: 0.0, m_per_sr: 0.0, coherent_per_sr: 0.0, piece: Piece::Several };
    /// A share of which the CPU must compute all rays.
    pub const OPEN: Share = Share { open: u32::MAX, piece: Piece::Any, ..Share::DARK };
}

/// A mesh in the memory of a graphics processor, with its scattering models and the samples of a spot.
pub struct EchoTracer<'a> {
    held: &'a GpuMesh<'a>,
    /// `None` for a mesh without area.
    table: Option<Table>,
    samples: usize,
    /// Distance of the farthest sample from the centre.
    reach: f64,
}

impl GpuMesh<'_> {
    /// Prepares the mesh for echoes: the region and the smooth piece of every facet, where pieces matter, the scattering model
    /// of every region of every scan as terms, a power of cos θ by which all terms are multiplied, and the samples of a spot, one or more.
    pub(crate) fn echo_tracer(
        &self,
        region_of_facet: &[u16],
        piece_of_facet: &[u32],
        laws: &[Option<Vec<Term>>],
        cosines: f64,
        samples: &[DVec2],
    ) -> Result<EchoTracer<'_>, GpuError> {
        let table = || {
            let facets = &self.bvh.boxes().facets;
            let place = |facet: usize| {
                [region_of_facet[facet].into(), piece_of_facet.get(facet).copied().unwrap_or(0)]
            };
            let places: Vec<[u32; 2]> = facets.iter().map(|&facet| place(facet as usize)).collect();
            let samples: Vec<[f32; 2]> =
                samples.iter().map(|sample| sample.as_vec2().to_array()).collect();
            let (laws, terms) = pack_laws(laws, cosines);
            self.gpu.device.table(&places, &samples, &laws, &terms)
        };
        Ok(EchoTracer {
            held: self,
            table: self.tree.as_ref().map(|_| table()).transpose()?,
            samples: samples.len(),
            reach: samples.iter().map(|sample| sample.length()).fold(0.0, f64::max),
        })
    }
}

impl EchoTracer<'_> {
    /// Number of shares per chirp.
    pub fn shares(&self) -> usize {
        self.samples.div_ceil(RAYS_PER_SHARE)
    }

    /// Traces the rays of all chirps: the shares of each, chirp after chirp.
    pub fn echoes(&self, cones: &[Cone]) -> Result<Vec<Share>, GpuError> {
        let GpuMesh { gpu, bvh, tree } = self.held;
        let shares = self.shares();
        let (Some(tree), Some(table)) = (tree, &self.table) else {
            return Ok(vec![Share::DARK; shares * cones.len()]);
        };
        let boxes = bvh.boxes();
        let most = RAYS_AT_ONCE / self.samples as u64;
        let at_once = gpu.device.spots_at_once(most, shares as u64);
        let launch = |cones: &[Cone]| {
            let spots = packed::spots(boxes, cones, self.reach);
            gpu.device.launch_echoes(tree, table, &spots, shares as u64)
        };
        let mut all = Vec::with_capacity(shares * cones.len());
        pipeline(cones, at_once, launch, |_, flight| {
            let words = gpu.device.land(flight)?;
            all.extend(words.chunks_exact(5).map(|words| share(words, boxes.sphere.radius_m)));
            Ok(())
        })?;
        Ok(all)
    }
}

/// Unpacks the five words of a share. All rays are left open if a sum is not finite.
fn share(words: &[u32], radius_m: f64) -> Share {
    let sums = [words[1], words[2], words[3]].map(|word| f64::from(f32::from_bits(word)));
    if sums.iter().any(|sum| !sum.is_finite()) {
        return Share::OPEN;
    }
    let [per_sr, moment, coherent_per_sr] = sums;
    let m_per_sr = moment * radius_m;
    Share { open: words[0], per_sr, m_per_sr, coherent_per_sr, piece: Piece::of_word(words[4]) }
}

/// Packs scattering models: first term and number of terms of each, and all terms. Neither list is empty.
fn pack_laws(laws: &[Option<Vec<Term>>], cosines: f64) -> (Vec<[u32; 2]>, Vec<[u32; 4]>) {
    let mut terms = Vec::new();
    let mut of_laws = Vec::with_capacity(laws.len().max(1));
    for law in laws {
        let own: Option<Vec<[u32; 4]>> =
            law.as_ref().and_then(|law| law.iter().map(|term| pack_term(term, cosines)).collect());
        let count = own.as_ref().map_or(NO_TERMS, |own| own.len() as u32);
        of_laws.push([terms.len() as u32, count]);
        terms.extend(own.into_iter().flatten());
    }
    if of_laws.is_empty() {
        of_laws.push([0, NO_TERMS]);
    }
    if terms.is_empty() {
        terms.push([0; 4]);
    }
    (of_laws, terms)
}

/// Packs a term; `None` for one that f32 cannot evaluate.
fn pack_term(term: &Term, cosines: f64) -> Option<[u32; 4]> {
    let (m, form) = match term.facets {
        None => (term.cosines, 0),
        Some(Facets { m, distribution, shadowed, includes_beam }) => {
            let law = u32::from(distribution == Distribution::Ggx);
            (m, law | shadowed << 1 | u32::from(includes_beam) << 3 | FACETS)
        }
    };
    let cosines = term.cosines + cosines;
    let values = [term.level_per_sr, cosines, m].map(|value| value as f32);
    let is_in_range = cosines.abs() <= MOST_COSINES && values.iter().all(|value| value.is_finite());
    let [level, cosines, m] = values.map(f32::to_bits);
    is_in_range.then_some([level, cosines, m, form])
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::brdf::{BlinnPhong, Brdf, CookTorrance, Mixture, Scattering, Shadowing};
    use crate::frames::{Direction, Global, Point, Ray};
    use crate::radar::{GaussianBeam, Link, Radar, Section};
    use crate::scene::solids;
    use crate::trace::Bvh;
    use crate::trace::gpu::tests::gpu;

    /// 0.02 dB.
    const TOLERANCE: f64 = 0.0046;

    fn law(distribution: Distribution, shadowing: Shadowing, m: f64) -> Brdf {
        let specular = CookTorrance { f_lambda: 0.4, m, m_across: None, distribution, shadowing };
        let diffuse = Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.1, alpha: 7.0 }));
        let specular = Box::new(Brdf::CookTorrance(specular));
        Brdf::Mixture(Mixture { k: 1e-3, diffuse, specular })
    }

    /// The rays of a spot along an axis, laid out in a width, m, where the beam has a section.
    fn cone(axis: Ray<Global>, width_m: f64, section: Section, law: u32) -> Cone {
        let (right, up) = axis.direction.xyz().any_orthonormal_pair();
        let beam = GaussianBeam { wavelength_m: 1e-3, waist_m: 0.004, focus_m: 3.0 };
        let solid_angle = Link::new(&Radar::default()).solid_angle(&beam);
        let across_m = [width_m * right, width_m * up];
        Cone { axis, across_m, section, solid_angle, beam, on_wavefront: true, law }
    }

    /// A section at a distance whose wave seems to come from the distance −1/`curvature_per_m` behind.
    fn section(range_m: f64, curvature_per_m: f64) -> Section {
        Section { wavelength_m: 1e-3, range_m, radius_m: 0.01, curvature_per_m }
    }

    /// Narrow cones from all around to a ball of 0.3 m, its rim and what is beside it, of waves that converge,
    /// spread or do neither.
    fn cones(count: usize) -> Vec<Cone> {
        let turn = |i: usize, step: f64| (i as f64 * step).fract() - 0.5;
        let one = |i: usize| {
            let from =
                DVec3::new(turn(i, 0.755), turn(i, 0.570), turn(i, 0.382)).normalize_or(DVec3::X);
            let to = 0.7 * DVec3::new(turn(i, 0.618), turn(i, 0.414), turn(i, 0.236));
            let origin = Point::from((0.5 + 9.0 * turn(i, 0.303).abs()) * from);
            let direction = origin.towards(to.into()).unwrap();
            let width_m = 0.003 * (1.0 + 4.0 * turn(i, 0.171).abs());
            let section = section(origin.xyz.length() - 0.3, [-0.7, 0.0, 0.8][i % 3]);
            cone(Ray { origin, direction }, width_m, section, (i % 4) as u32)
        };
        (0..count).map(one).collect()
    }

    /// Relative error of the sum over a share, and how many rays of it were left open.
    fn compared(
        share: &Share,
        bvh: &Bvh,
        cone: &Cone,
        samples: &[DVec2],
        law: &Brdf,
    ) -> (f64, u32) {
        let mut sum = 0.0;
        let mut open = 0;
        for (bit, sample) in samples.iter().enumerate() {
            if share.open >> bit & 1 == 1 {
                open += 1;
                continue;
            }
            let aside_m = sample.x * cone.across_m[0] + sample.y * cone.across_m[1];
            if let Some(hit) = bvh.closest(&cone.section.ray(&cone.axis, aside_m).unwrap()) {
                let to_radar = Direction::from_angles(hit.theta_rad(), 0.0);
                let beam_rad = cone.beam.section(hit.range_m).divergence_rad();
                let f_per_sr = law.seen_by(beam_rad, to_radar, to_radar).f_per_sr;
                let solid_angle = cone.solid_angle.at_sr(hit.range_m) / cone.solid_angle.level_sr;
                sum += f_per_sr * hit.cos_theta.powi(2) * solid_angle;
            }
        }
        (if sum > 0.0 { (share.per_sr / sum - 1.0).abs() } else { share.per_sr }, open)
    }

    #[test]
    fn sums_are_those_of_f64() {
        let Some(gpu) = gpu(u64::MAX) else { return };
        let mut ball = solids::icosphere(0.3, 3);
        ball.append(&solids::icosphere(0.1, 1)).unwrap();
        let bvh = Bvh::new(&ball);
        let held = gpu.hold(&bvh).unwrap();
        let laws = [
            law(Distribution::Beckmann, Shadowing::Separable, 0.3),
            law(Distribution::Beckmann, Shadowing::Correlated, 0.01),
            law(Distribution::Ggx, Shadowing::Separable, 0.1),
            law(Distribution::Ggx, Shadowing::Correlated, 0.6),
        ];
        let terms: Vec<_> = laws.iter().map(Scattering::backscatter).collect();
        let samples: Vec<DVec2> =
            (0..50).map(|i| 0.14 * f64::from(i).sqrt() * DVec2::from_angle(f64::from(i))).collect();
        let lit =
            held.echo_tracer(&vec![0; ball.facets.len()], &[], &terms, 2.0, &samples).unwrap();
        let cones = cones(2000);
        let shares = lit.echoes(&cones).unwrap();
        assert_eq!((lit.shares(), shares.len()), (2, 4000));
        let (mut open, mut lit) = (0, 0);
        for (cone, shares) in cones.iter().zip(shares.chunks(2)) {
            let law = &laws[cone.law as usize];
            for (share, samples) in shares.iter().zip(samples.chunks(RAYS_PER_SHARE)) {
                let (error, left) = compared(share, &bvh, cone, samples, law);
                assert!(error < TOLERANCE, "{error}: {share:?} of {cone:?}");
                open += left;
                lit += u32::from(share.per_sr > 0.0);
            }
        }
        assert!(lit > 1000 && lit < 3900, "{lit}");
        assert!(20 * open < 100_000, "{open} of 100000 left open");
    }

    #[test]
    fn what_cannot_be_told_is_left_open() {
        let Some(gpu) = gpu(u64::MAX) else { return };
        let ball = solids::icosphere(0.3, 2);
        let bvh = Bvh::new(&ball);
        let held = gpu.hold(&bvh).unwrap();
        let distribution = Distribution::Ggx;
        let narrow = Facets { m: 1e-4, distribution, shadowed: 1, includes_beam: false };
        let term = |facets, cosines| Some(vec![Term { level_per_sr: 1.0, cosines, facets }]);
        let laws = [None, term(Some(narrow), 0.0), term(None, 1e4), term(None, 0.0)];
        let regions = vec![0; ball.facets.len()];
        let lit = held.echo_tracer(&regions, &[], &laws, 2.0, &[DVec2::ZERO]).unwrap();
        let origin = Point::new(0.013, 0.021, 5.0);
        let direction = Direction::new(DVec3::NEG_Z).unwrap();
        let of_law = |law| {
            let cone = cone(Ray { origin, direction }, 0.0, section(4.7, 0.0), law);
            // The beam, too, is narrower than f32 can resolve.
            let beam = GaussianBeam { waist_m: 1.0, ..cone.beam };
            let cone = Cone { beam, ..cone };
            lit.echoes(&[cone]).unwrap()[0]
        };
        for law in 0..3 {
            assert_eq!(of_law(law), Share { open: 1, piece: Piece::Any, ..Share::DARK });
        }
        let told = of_law(3);
        assert!(told.open == 0 && (told.m_per_sr / told.per_sr - 4.7).abs() < 0.02, "{told:?}");
        // A ray along a plate is left open, and one beside it misses.
        let plate = solids::plate(1.0, 1.0);
        let bvh = Bvh::new(&plate);
        let held = gpu.hold(&bvh).unwrap();
        let lit = held
            .echo_tracer(&vec![0; plate.facets.len()], &[], &laws, 2.0, &[DVec2::ZERO])
            .unwrap();
        let from = |height_m: f64, x_m: f64| {
            let origin = Point::new(x_m, 0.1, height_m);
            let direction = Direction::new(DVec3::new(-1.0, 0.03, -1e-3)).unwrap();
            let axis = Ray { origin, direction };
            lit.echoes(&[cone(axis, 0.0, section(1.0, 0.0), 3)]).unwrap()[0].open
        };
        assert_eq!((from(1e-3, 1.2), from(0.9, 1.2)), (1, 0));
    }
}
