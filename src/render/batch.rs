//! Renders many scans of one target by one instrument, with other poses, materials and seeds.
//!
//! With [`Tracer::Gpu`] the mesh and its hierarchy stay on the device. It traces the rays
//! of whole chirps, evaluates equation (11) for each and sums over the spot, equation (7), for many scans at
//! a time. The CPU computes in f64 the rays that the device leaves open: rays near an edge, and rays on scattering
//! models that are not a sum of [`Term`](crate::brdf::Term)s. Where a spot reaches beyond the smooth piece that returns a wave, whose
//! amplitudes add up, it computes the whole spot. With any other tracer, or a loss of the air, it computes all rays. Poses, spots and the receiver are
//! always computed on the CPU, in f64.
//!
//! Speckle is that of the law, and of the same field as in a scan of its own.
//!
//! A mean power of the device is within 0.02 dB of the renderer's. Its range is within 1.1·10⁻⁶ of the range plus the
//! target's radius over cos θ. Powers below the smallest f32, about −350 dBm with the paper's radar, are only known
//! to be below it.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::coherent::{RayPath, SpotRays, smooth_pieces};
use super::detect::Detector;
use super::error::RenderError;
use super::path::{Arrival, Path};
use super::setup::Setup;
use super::spot::{self, Spot};
use super::surface::Surface;
use crate::brdf::{Look, Term};
use crate::frames::{Direction, Global, Pose, Ray};
use crate::radar::{Detection, Footprint, Link};
use crate::trace::{
    Cone, EchoTracer, GpuError, Hit, LocalFrame, Piece, RAYS_PER_SHARE, ScanGeometry, Share,
    TraceError, Tracer,
};

/// Rays per turn: enough to occupy a device, and few enough to hold their hits.
const RAYS_PER_TURN: usize = 1 << 20;

/// Coherent share of an echo below which it does not matter, by 0.02 dB in a draw of speckle, how its rays interfere.
const LEAST_WAVE: f64 = 1e-5;

/// The settings that all scans of a batch share. A batch has single paths to the radar's own antenna, without effects.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// The instrument, the chirps of each scan and the target. [`Tracer::Gpu`] also computes the echoes.
    pub geometry: ScanGeometry<'a>,
    /// Rays per chirp, one or more.
    pub rays_per_chirp: usize,
}

/// One scan of a batch.
#[derive(Clone, Copy)]
pub struct Take<'a> {
    /// Pose of the mesh.
    pub target: Pose<Global, Global>,
    /// The surface of each region. Its grain is in the frame of the mesh and moves with it.
    pub surfaces: &'a [Surface<'a>],
    /// Seed of what is fixed to the target: its speckle.
    pub seed: u64,
    /// Seed of what each scan draws anew, its noise; `seed` when `None`.
    pub noise_seed: Option<u64>,
}

/// The echoes of the scans of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Takes {
    /// The range and power that the receiver measures of every chirp of every scan, also below the threshold; `None`
    /// without an echo.
    pub echoes: Vec<Vec<Option<Detection>>>,
    /// Number of rays of all scans.
    pub rays: usize,
    /// Number of rays that the CPU computed.
    pub rays_on_processor: usize,
}

impl Batch<'_> {
    /// Renders all scans, in their order.
    ///
    /// # Errors
    /// When the radar has a receiver that works on beat signals, a surface lets the wave pass on, the tracer does not accept the rays, or the graphics
    /// processor holds another mesh, fails, or has too little memory for the materials of the scans.
    pub fn run(&self, takes: &[Take]) -> Result<Takes, RenderError> {
        if self.geometry.radar.receiver.is_some() {
            return Err(RenderError::Signals);
        }
        if takes.iter().any(|take| take.surfaces.iter().any(|surface| surface.sheet.is_some())) {
            return Err(RenderError::Sheets);
        }
        let work = Work::new(self, takes)?;
        let chirps = self.geometry.chirps.rays.len();
        let (all, turn) = (chirps * takes.len(), (RAYS_PER_TURN / work.rays).max(1));
        let mut means = Vec::with_capacity(all);
        let mut rays_on_processor = 0;
        while means.len() < all {
            let first = means.len();
            // In the frame of the mesh every scan has its own origin, and the pinhole accepts only one.
            let end = match self.geometry.tracer {
                Tracer::Automatic | Tracer::Pinhole => (first / chirps + 1) * chirps,
                Tracer::Bvh | Tracer::Brute | Tracer::Gpu(_) => all,
            };
            let (some, open) = work.means(first..end.min(first + turn))?;
            means.extend(some);
            rays_on_processor += open;
        }
        let echoes = takes.iter().enumerate().map(|(number, take)| {
            self.detect(take, &means[number * chirps..(number + 1) * chirps])
        });
        let echoes = echoes.collect::<Result<_, RenderError>>()?;
        Ok(Takes { echoes, rays: all * work.rays, rays_on_processor })
    }

    /// The range and power that the receiver measures, from the means of a scan.
    fn detect(
        &self,
        take: &Take,
        means: &[Option<Arrival>],
    ) -> Result<Vec<Option<Detection>>, RenderError> {
        let Take { seed, noise_seed, .. } = *take;
        let setup = Setup { seed, noise_seed, ..Setup::new(self.geometry, take.surfaces) };
        let detector = Detector::of_pose(&setup, take.target)?;
        let means = means.par_iter().enumerate();
        let measured = means
            .map(|(chirp, mean)| mean.as_ref().map(|mean| detector.measure_whole(chirp, mean)));
        Ok(measured.collect())
    }
}

/// A batch prepared for rendering. Chirps are numbered through all scans.
struct Work<'a> {
    batch: &'a Batch<'a>,
    takes: &'a [Take<'a>],
    /// The inverse pose of each scan.
    mesh_from_world: Vec<Pose<Global, Global>>,
    link: Link,
    /// Rays of a chirp, and where they pass in its spot.
    rays: usize,
    samples: Vec<DVec2>,
    lit_shares: Vec<f64>,
    /// The smooth piece of each facet; empty where it does not matter.
    pieces: Vec<u32>,
    /// Number of regions, and so of scattering models per scan.
    regions: usize,
    echo_tracer: Option<EchoTracer<'a>>,
}

/// What the rays of a chirp return that are computed one by one.
#[derive(Clone, Copy)]
struct Sums {
    power_w: f64,
    moment_w_m: f64,
    coherent_w: f64,
    piece: Piece,
}

/// The sums over no rays.
const NO_RAYS: Sums = Sums { power_w: 0.0, moment_w_m: 0.0, coherent_w: 0.0, piece: Piece::Any };

impl Sums {
    fn add(&mut self, path: Option<&Path>) {
        let Some(path) = path else {
            self.piece = Piece::Several;
            return;
        };
        self.power_w += path.power_w;
        self.moment_w_m += path.power_w * path.range_m;
        self.coherent_w += path.power_w * path.coherent_share;
        self.piece = self.piece.and(Piece::One(path.pieces[0]));
    }

    /// Whether its rays return a wave that does not fill the spot.
    fn is_cut(&self) -> bool {
        self.piece == Piece::Several && self.coherent_w > LEAST_WAVE * self.power_w
    }

    /// The echo of a chirp of so many rays; `None` without one.
    fn arrival(&self, rays: f64) -> Option<Arrival> {
        let range_m = self.moment_w_m / self.power_w;
        let mean = Detection { range_m, power_w: self.power_w / rays };
        (self.power_w > 0.0).then(|| Arrival::of_one_piece(mean, self.coherent_w / rays))
    }
}

impl<'a> Work<'a> {
    fn new(batch: &'a Batch, takes: &'a [Take]) -> Result<Work<'a>, RenderError> {
        let ScanGeometry { bvh, region_of_facet, .. } = batch.geometry;
        let rays = batch.rays_per_chirp.max(1);
        let mut work = Work {
            batch,
            takes,
            mesh_from_world: takes.iter().map(|take| take.target.inverse()).collect(),
            link: Link::new(batch.geometry.radar),
            rays,
            samples: spot::samples(rays),
            lit_shares: spot::lit_shares(rays),
            pieces: Vec::new(),
            regions: region_of_facet.iter().max().map_or(0, |&last| usize::from(last) + 1),
            echo_tracer: None,
        };
        let beam_rad = work.link.beam.towards(0.0, 0.0).divergence_rad();
        let mut surfaces = takes.iter().flat_map(|take| take.surfaces);
        if rays > 1 && surfaces.any(|surface| surface.has_wave(beam_rad)) {
            work.pieces = smooth_pieces(bvh.mesh(), region_of_facet);
        }
        // The device does not know the air: it then finds the hits, and the CPU computes the echoes.
        if let Tracer::Gpu(held) = batch.geometry.tracer
            && work.link.air_loss_db_per_m == 0.0
        {
            if !std::ptr::eq(held.bvh(), batch.geometry.bvh) {
                return Err(gpu_error(GpuError::OtherMesh));
            }
            let axes = batch.geometry.chirps.rays.iter();
            let beam_rad = axes.map(|axis| work.link.beam.along(axis).divergence_rad());
            let widest_rad = beam_rad.fold(0.0, f64::max);
            let law = |take: usize, region: usize| match takes[take].surfaces.get(region) {
                Some(surface) => device_terms(surface, widest_rad),
                None => Some(Vec::new()),
            };
            let laws: Vec<_> = (0..takes.len())
                .flat_map(|take| (0..work.regions).map(move |region| (take, region)))
                .map(|(take, region)| law(take, region))
                .collect();
            let cosines = match work.link.footprint {
                Footprint::Paper => 2.0,
                Footprint::Projected => 1.0,
            };
            let samples = &work.samples;
            let tracer = held.echo_tracer(region_of_facet, &work.pieces, &laws, cosines, samples);
            work.echo_tracer = Some(tracer.map_err(gpu_error)?);
        }
        Ok(work)
    }

    /// The echoes of some chirps (`None` without one), and the number of rays that the CPU computed.
    fn means(&self, some: Range<usize>) -> Result<(Vec<Option<Arrival>>, usize), RenderError> {
        let spots = self.spots(some.clone())?;
        let Some(tracer) = &self.echo_tracer else {
            let whole: Vec<usize> = (0..spots.len()).collect();
            let echoes = self.whole_echoes(some.start, &spots, &whole)?;
            return Ok((echoes, self.rays * spots.len()));
        };
        let per_chirp = self.rays.div_ceil(RAYS_PER_SHARE);
        let cones = some.clone().into_par_iter().zip(&spots);
        let cones: Vec<Cone> = cones.map(|(chirp, spot)| self.cone(chirp, spot)).collect();
        let shares = tracer.echoes(&cones).map_err(gpu_error)?;
        let open = self.open_rays(some.start, &spots, &shares);
        let of_chirps = spots.iter().zip(shares.chunks(per_chirp));
        let mut sums: Vec<Sums> =
            of_chirps.map(|(spot, shares)| self.sums_of_device(spot, shares)).collect();
        for ((place, _), path) in open.iter().zip(self.paths(some.start, &spots, &open)?) {
            sums[*place].add(path.as_ref());
        }
        let rays = self.rays as f64;
        let mut means: Vec<_> = sums.iter().map(|sums| sums.arrival(rays)).collect();
        let cut: Vec<usize> = (0..sums.len()).filter(|&place| sums[place].is_cut()).collect();
        let apart = open.iter().filter(|(place, _)| cut.binary_search(place).is_err()).count();
        let whole = self.whole_echoes(some.start, &spots, &cut)?;
        cut.iter().zip(whole).for_each(|(&place, echo)| means[place] = echo);
        Ok((means, apart + self.rays * cut.len()))
    }

    /// What the device computed of a chirp.
    fn sums_of_device(&self, spot: &Spot, shares: &[Share]) -> Sums {
        let w_per_f = self.link.flux_w(1.0) * self.link.solid_angle(&spot.beam).level_sr;
        let mut sums = NO_RAYS;
        for share in shares {
            sums.power_w += w_per_f * share.per_sr;
            sums.moment_w_m += w_per_f * share.m_per_sr;
            sums.coherent_w += w_per_f * share.coherent_per_sr;
            sums.piece = sums.piece.and(share.piece);
        }
        sums
    }

    /// The echoes of some chirps, by their numbers after `first`, of which the CPU computes all rays.
    fn whole_echoes(
        &self,
        first: usize,
        spots: &[Spot],
        some: &[usize],
    ) -> Result<Vec<Option<Arrival>>, RenderError> {
        let of_chirp = |&place: &usize| {
            let mesh_from_world = self.mesh_from_world(first + place);
            let spot = &spots[place];
            self.samples
                .iter()
                .map(move |&sample| Some((place, *mesh_from_world * spot.ray(sample)?)))
        };
        let rays: Vec<Option<(usize, Ray<Global>)>> =
            some.par_iter().flat_map_iter(of_chirp).collect();
        let sent: Vec<(usize, Ray<Global>)> = rays.iter().flatten().copied().collect();
        let mut found = self.paths(first, spots, &sent)?.into_iter();
        let paths: Vec<Option<Path>> =
            rays.iter().map(|ray| ray.and_then(|_| found.next().flatten())).collect();
        Ok(paths.par_chunks(self.rays).map(|paths| self.whole_echo(paths)).collect())
    }

    /// The echo of a chirp from the paths of all its rays, as the renderer adds them up.
    fn whole_echo(&self, rays: &[Option<Path>]) -> Option<Arrival> {
        let share = 1.0 / self.rays as f64;
        let (mut paths, mut direct) = (Vec::new(), Vec::new());
        for (ray, path) in rays.iter().enumerate() {
            let Some(path) = path else { continue };
            direct.push(RayPath { ray, place: paths.len() });
            paths.push(Path { power_w: share * path.power_w, ..*path });
        }
        if self.rays > 1 {
            let spot = SpotRays { places: &self.samples, lit_shares: &self.lit_shares };
            spot.cut_waves(&direct, &mut paths);
        }
        let power_w: f64 = paths.iter().map(|path| path.power_w).sum();
        (power_w > 0.0).then(|| Arrival::of(&paths, self.batch.geometry.radar.wavelength_m()))
    }

    /// The rays that the device left open, in the frame of the mesh, each with the number of its chirp after `first`.
    fn open_rays(
        &self,
        first: usize,
        spots: &[Spot],
        shares: &[Share],
    ) -> Vec<(usize, Ray<Global>)> {
        let per_chirp = self.rays.div_ceil(RAYS_PER_SHARE);
        let chirps = spots.par_iter().zip(shares.par_chunks(per_chirp)).enumerate();
        let open = chirps.flat_map_iter(|(place, (spot, shares))| {
            let is_open = move |ray: &usize| {
                shares[ray / RAYS_PER_SHARE].open >> (ray % RAYS_PER_SHARE) & 1 == 1
            };
            let mesh_from_world = self.mesh_from_world(first + place);
            (0..self.rays).filter(is_open).filter_map(move |ray| {
                Some((place, *mesh_from_world * spot.ray(self.samples[ray])?))
            })
        });
        open.collect()
    }

    /// The paths of some rays, in the frame of the mesh, each with the number of its chirp after `first`; `None` for a
    /// ray that misses the target.
    fn paths(
        &self,
        first: usize,
        spots: &[Spot],
        rays: &[(usize, Ray<Global>)],
    ) -> Result<Vec<Option<Path>>, RenderError> {
        let only: Vec<Ray<Global>> = rays.iter().map(|(_, ray)| *ray).collect();
        let hits = self.batch.geometry.closest(&only)?;
        let paths = rays.par_iter().zip(hits).map(|((place, ray), hit)| {
            self.path(self.take(first + place), &spots[*place], ray, hit?)
        });
        Ok(paths.collect())
    }

    /// The path of a ray by equation (11); `None` in a region without a surface. Its power is that of the whole spot.
    fn path(&self, take: usize, spot: &Spot, ray: &Ray<Global>, hit: Hit) -> Option<Path> {
        let geometry = &self.batch.geometry;
        let (mesh, region) = (geometry.bvh.mesh(), geometry.region_of_facet[hit.facet as usize]);
        let surface = self.takes[take].surfaces.get(usize::from(region))?;
        let to_radar = -ray.direction.xyz();
        let to_radar = LocalFrame::at_hit(mesh, &hit, to_radar, surface.grain).local(to_radar);
        let beam_rad = spot.divergence_rad(self.rays, hit.range_m);
        let seen = surface.seen_by(beam_rad, to_radar, to_radar);
        let power_w = self.link.power_w(&spot.beam, hit.range_m, hit.cos_theta, seen.f_per_sr);
        let piece = self.pieces.get(hit.facet as usize).copied().unwrap_or(0);
        Some(Path::single(hit, power_w, seen, piece))
    }

    /// The spots of some chirps, in the global frame.
    fn spots(&self, some: Range<usize>) -> Result<Vec<Spot>, RenderError> {
        let geometry = &self.batch.geometry;
        let chirps = geometry.chirps;
        let number = |chirp: usize| chirp % chirps.rays.len();
        let ranges_m = match self.rays {
            1 => vec![None; some.len()],
            _ => {
                let axis = |chirp| *self.mesh_from_world(chirp) * chirps.rays[number(chirp)];
                let axes: Vec<Ray<Global>> = some.clone().into_par_iter().map(axis).collect();
                let range_m = |hit: Option<Hit>| hit.map(|hit| hit.range_m);
                geometry.closest(&axes)?.into_iter().map(range_m).collect()
            }
        };
        let spot = |(chirp, range_m): (usize, Option<f64>)| {
            let number = number(chirp);
            Spot::met(&self.link.beam, &chirps.rays[number], range_m, number)
        };
        Ok(some.into_par_iter().zip(ranges_m).map(spot).collect())
    }

    /// A chirp in the frame of the mesh, for the device.
    fn cone(&self, chirp: usize, spot: &Spot) -> Cone {
        let mesh_from_world = self.mesh_from_world(chirp);
        Cone {
            axis: *mesh_from_world * spot.axis,
            across_m: spot.across_m.map(|aside_m| mesh_from_world.rotation() * aside_m),
            section: spot.section,
            solid_angle: self.link.solid_angle(&spot.beam),
            beam: spot.beam,
            on_wavefront: self.rays > 1,
            law: (self.take(chirp) * self.regions) as u32,
        }
    }

    /// The scan that a chirp belongs to.
    fn take(&self, chirp: usize) -> usize {
        chirp / self.batch.geometry.chirps.rays.len()
    }

    fn mesh_from_world(&self, chirp: usize) -> &Pose<Global, Global> {
        &self.mesh_from_world[self.take(chirp)]
    }
}

/// The law of a surface as a device takes it, which widens every lobe by the beam; `None` where that is not how the
/// surface is seen, or the law is no sum of terms.
fn device_terms(surface: &Surface, widest_rad: f64) -> Option<Vec<Term>> {
    /// Change of a diffuse term, as a share of it, that is within the precision of a device.
    const SMALL: f64 = 1e-3;
    let mut terms = surface.scattering.backscatter()?;
    if surface.seen_lobe_rad.is_none() && !have_waves_of(surface, &terms, widest_rad) {
        return None;
    }
    for term in terms.iter_mut().filter(|_| surface.seen_lobe_rad.is_some()) {
        match &mut term.facets {
            Some(facets) if facets.m >= widest_rad => facets.includes_beam = true,
            None if 0.5 * term.cosines * widest_rad * widest_rad < SMALL => {}
            _ => return None,
        }
    }
    Some(terms)
}

/// Whether the coherent share of a surface is that of its terms. A mirror with a lobe of its own is coherent as a whole.
fn have_waves_of(surface: &Surface, terms: &[Term], beam_rad: f64) -> bool {
    const NEAR: f64 = 1e-3;
    [0.0, 0.05, 0.3].into_iter().all(|theta_rad: f64| {
        let (mut whole, mut coherent) = (0.0, 0.0);
        for term in terms {
            let per_sr = term.per_sr(Look { beam_rad, cos_theta: theta_rad.cos() });
            let share = |m: f64| beam_rad * beam_rad / (m * m + beam_rad * beam_rad);
            whole += per_sr;
            coherent += per_sr * term.facets.map_or(0.0, |facets| share(facets.m));
        }
        let from = Direction::from_angles(theta_rad, 0.0);
        let expected = surface.seen_by(beam_rad, from, from).coherent_share;
        (coherent - expected * whole).abs() <= NEAR * whole
    })
}

fn gpu_error(error: GpuError) -> RenderError {
    TraceError::from(error).into()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::brdf::{Brdf, CookTorrance, Distribution, Lambert, Scattering, Shadowing};
    use crate::frames::Point;
    use crate::radar::scan::Raster;
    use crate::radar::{Chirps, Noise, Pattern, Radar, Speckle, SpeckleForm};
    use crate::render::observer::Observer;
    use crate::render::{shade, trace};
    use crate::scene::solids;
    use crate::trace::Bvh;
    use crate::units::dbm_from_watts;

    fn brushed() -> Brdf {
        Brdf::CookTorrance(CookTorrance {
            f_lambda: 0.5,
            // Narrower than the beam.
            m: 0.006,
            m_across: Some(0.6),
            distribution: Distribution::Ggx,
            shadowing: Shadowing::Correlated,
        })
    }

    fn radar(speckle: Option<Speckle>) -> Radar {
        Radar {
            scan: Pattern::Raster(Raster { lines: 14, chirps_per_line: 9, ..Default::default() }),
            speckle,
            noise: Some(Noise::default()),
            ..Radar::default()
        }
    }

    /// Checks that a batch of a ball in two poses is what the renderer makes of each.
    fn check_against_the_renderer(law: &dyn Scattering, radar: &Radar, rays_per_chirp: usize) {
        let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
        let ball = solids::icosphere(0.3, 3);
        let (bvh, region_of_facet) = (Bvh::new(&ball), vec![0; ball.facets.len()]);
        let grain = DVec3::new(1.0, 2.0, 0.0);
        let own = [Surface { grain, ..Surface::new(law) }];
        let with_beam =
            own.map(|surface| Surface { seen_lobe_rad: Some(f64::INFINITY), ..surface });
        let pose = |turn_rad| Pose::from_euler_xyz(turn_rad, DVec3::new(0.02, 1.1, 0.4));
        let turns_rad = [DVec3::ZERO, DVec3::new(0.3, -0.8, 0.5)];
        let takes: [Take; 2] = std::array::from_fn(|number| Take {
            target: pose(turns_rad[number]),
            surfaces: [&own, &with_beam][number],
            seed: 3,
            noise_seed: Some(4),
        });
        let batch = Batch {
            geometry: ScanGeometry::new(radar, &chirps, &bvh, &region_of_facet),
            rays_per_chirp,
        };
        let found = batch.run(&takes).unwrap();
        // The rays of a spot have no common origin.
        assert_eq!(bvh.is_built(), rays_per_chirp > 1);
        assert_eq!(found.rays, 2 * rays_per_chirp * chirps.rays.len());
        assert_eq!(found.rays_on_processor, found.rays);
        for (take, found) in takes.iter().zip(&found.echoes) {
            let mut mesh = ball.clone();
            mesh.vertices
                .iter_mut()
                .for_each(|vertex| *vertex = (take.target * Point::from(*vertex)).xyz);
            let grain = take.target.rotation() * grain;
            let surfaces = [Surface { grain, ..take.surfaces[0] }];
            let bvh = Bvh::new(&mesh);
            let geometry = ScanGeometry::new(radar, &chirps, &bvh, &region_of_facet);
            let footprints = trace(&geometry, rays_per_chirp, &|_| {}).unwrap();
            let setup = Setup { seed: 3, noise_seed: Some(4), ..Setup::new(geometry, &surfaces) };
            let scan = shade(&setup, &footprints, Observer::Radar, &|_| {}).unwrap();
            assert_eq!(found.iter().flatten().count(), scan.echoes.len());
            for echo in &scan.echoes {
                let found = found[echo.chirp as usize].unwrap();
                let [found_dbm, echo_dbm] = [found.power_w, echo.power_w].map(dbm_from_watts);
                assert!((found_dbm - echo_dbm).abs() < 1e-9, "{found:?} {echo:?}");
                assert!((found.range_m - echo.range_m).abs() < 1e-9, "{found:?} {echo:?}");
            }
        }
    }

    #[test]
    fn without_a_device_every_scan_is_the_renderer_s() {
        let four_looks = Some(Speckle { looks: 4.0, ..Default::default() });
        let polished = Brdf::CookTorrance(CookTorrance {
            f_lambda: 0.5,
            m: 0.02,
            m_across: None,
            distribution: Distribution::Ggx,
            shadowing: Shadowing::Correlated,
        });
        check_against_the_renderer(&brushed(), &radar(None), 1);
        let through_air = Radar { air_loss_db_per_m: 0.5, ..radar(None) };
        for rays in [1, 40] {
            check_against_the_renderer(&polished, &through_air, rays);
        }
        for rays in [1, 40] {
            check_against_the_renderer(&polished, &radar(four_looks), rays);
            check_against_the_renderer(&Lambert { albedo: 0.5 }, &radar(four_looks), rays);
        }
    }

    #[test]
    fn scatterers_are_refused() {
        let speckle = Speckle { form: Some(SpeckleForm::Scatterers), ..Default::default() };
        let radar = radar(Some(speckle));
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let plate = solids::plate(1.0, 4.0);
        let (bvh, regions) = (Bvh::new(&plate), [0, 0]);
        let law = Lambert { albedo: 0.5 };
        let surfaces = [Surface::new(&law)];
        let take = Take { target: Pose::NONE, surfaces: &surfaces, seed: 0, noise_seed: None };
        let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &regions);
        let error = Batch { geometry, rays_per_chirp: 1 }.run(&[take]).unwrap_err();
        assert!(error.to_string().contains("render the scans one by one"), "{error}");
    }
}
