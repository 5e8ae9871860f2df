//! A spot of finite size: the power of a chirp is the mean over rays through a Gaussian footprint, its
//! range their mean by power. Rays that miss the target bring nothing.
//!
//! The rays stand on a spiral whose radii grow by the same factor from each to the next, so that some lie in a spot of any
//! diameter. They are traced once, and a diameter only weighs them.

use std::sync::{Arc, LazyLock};

use rayon::prelude::*;

use crate::brdf::{Brdf, Look, Scattering, Term};
use crate::effects::cache::Cache;
use crate::effects::echo::MeanEcho;
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level, Setting, Survey};
use crate::effects::intersection::{Facet, HitSurface, surface_at};
use crate::effects::range_cell::RangeCell;
use crate::effects::shot::{Shot, Stage};
use crate::effects::spread::sunflower;
use crate::frames::{Direction, Global, Ray, Surface};
use crate::radar::GaussianBeam;
use crate::trace::{Hit, closest};

pub(crate) struct FiniteSpot;

/// The spot of the radar's own beam, which a scene with several rays in a spot has. It has no number to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamSpot {
    /// Its diameter at half the intensity in the middle of the field, m. Each shot is averaged over the beam where it is.
    pub diameter_m: f64,
    /// How a range receiver reads it; none without one.
    pub cell: Option<RangeCell>,
}

/// The diameter of spots at half the intensity.
#[derive(Clone, Copy)]
enum Diameter {
    /// The same for all, m.
    Of(f64),
    /// That of the beam where its axis meets the target.
    OfBeam,
}

impl Diameter {
    /// A number that no other diameter has.
    fn key(self) -> u64 {
        match self {
            Diameter::Of(diameter_m) => diameter_m.to_bits(),
            Diameter::OfBeam => 0,
        }
    }
}

/// Rays that stand for spots of all diameters. On a ball a highlight may be a tenth of a spot.
const RAYS: usize = 160;
/// Radii of the first and of the last ray, m.
const RADII_M: [f64; 2] = [2.5e-4, 0.18];
/// The narrowest spot that differs from a ray, m: the first ray of the spiral is well within it.
const LEAST_M: f64 = 1e-3;
/// The widest spot, m. The last ray is three standard deviations of its two-way weight from its middle.
const MOST_M: f64 = 0.2;
/// How far off its axis a spot detects a target, in diameters: to where the intensity is 19 dB down.
const OUTER: f64 = 1.25;
/// Least weight of a ray that counts, as a share of the largest.
const LEAST_WEIGHT: f64 = 1e-4;
/// Largest factor, and one over it the smallest, by which other effects may change the power of a shot.
/// Beyond it they have moved the shot to another surface, and the spot keeps the power of the old one.
const MOST_GAIN: f64 = 100.0;

// A ray's number is a byte.
const _: () = assert!(RAYS <= 256);

/// Terms of laws whose sums are kept, for the few diameters that a search compares.
const MOST_TERMS: usize = 48;

/// Where one ray of a spot hits the target.
#[derive(Clone, Copy)]
struct SpotRay {
    range_m: f64,
    to_radar: Direction<Surface>,
    /// Power, W, where f is 1/sr and all of the spot is like here.
    watts_per_f: f64,
    region: u16,
    /// Its number on the spiral.
    number: u8,
    /// How far the beam that sees it widens its lobes, rad.
    beam_rad: f64,
    /// Divergence of that beam, rad.
    divergence_rad: f64,
}

impl SpotRay {
    fn new(
        stage: &Stage,
        beam: &GaussianBeam,
        surface: HitSurface,
        hit: &Hit,
        number: u8,
    ) -> SpotRay {
        let HitSurface { region, to_radar, .. } = surface;
        let Hit { range_m, cos_theta, .. } = *hit;
        let watts_per_f = stage.link.power_w(beam, range_m, cos_theta, 1.0);
        // The rays stand on the wavefront, whose curvature is the rest of the divergence.
        let divergence_rad = beam.section(range_m).divergence_rad();
        let beam_rad = stage.widening_rad(region, divergence_rad);
        SpotRay { range_m, to_radar, watts_per_f, region, number, beam_rad, divergence_rad }
    }
}

/// The divergence of a beam, rad, and the direction back along it.
type Asked = (f64, Direction<Surface>);

/// The ray of a shot and those of its spot, as far as they hit the target as the scene has it.
type Spot = (SpotRay, Vec<SpotRay>);

/// The spots of all shots.
struct Spots {
    all: Vec<Option<Spot>>,
    /// Diameter of the beam at each, m.
    of_beam_m: Vec<f64>,
    /// Their answers to terms of level 1, for a diameter in bits: a law's levels change more often than its shape.
    sums: Cache<(u16, Term, u64), Vec<Sums>, MOST_TERMS>,
}

/// Spots with the laws of their regions.
struct ShadedSpots {
    spots: Arc<Spots>,
    laws: Vec<Brdf>,
    /// Answers to laws that are no sums of terms, by region and diameter.
    sums: Cache<(u16, u64), Vec<Sums>>,
}

/// What a spot sends back from one region by one term of its law.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Power of the ray along the axis and of all rays of the spot, W.
    centre_w: f64,
    power_w: f64,
    /// Moments of what adds to the range, W·m and W·m².
    first: f64,
    second: f64,
    /// Power of all rays that is one wave, W.
    coherent_w: f64,
}

impl Sums {
    /// Of a region's rays by their weights, for f, 1/sr, of many beams at once, and the coherent share of one.
    fn of(
        (centre, spot): &Spot,
        weights: &[f64; RAYS],
        region: u16,
        f_per_sr: impl Fn(&[Asked]) -> Vec<f64>,
        coherent_share: impl Fn(f64, Direction<Surface>) -> f64,
    ) -> Sums {
        let mut rays = Vec::with_capacity(RAYS + 1);
        let mut asked = Vec::with_capacity(RAYS + 1);
        let of_spot = spot.iter().map(|ray| (weights[usize::from(ray.number)], ray));
        for (weight, ray) in [(1.0, centre)].into_iter().chain(of_spot) {
            if weight != 0.0 && ray.region == region {
                rays.push((weight, ray));
                asked.push((ray.beam_rad, ray.to_radar));
            }
        }
        let f_per_sr = f_per_sr(&asked);
        let mut powers = rays
            .iter()
            .zip(f_per_sr)
            .map(|((weight, ray), f)| (weight * (ray.watts_per_f * f), ray));
        let mut sums = Sums::default();
        if centre.region == region {
            sums.centre_w = powers.next().map_or(0.0, |(power_w, _)| power_w);
        }
        for (power_w, ray) in powers {
            let longer_m = ray.range_m - centre.range_m;
            sums.power_w += power_w;
            sums.first += power_w * longer_m;
            sums.second += power_w * longer_m * longer_m;
            if power_w > 0.0 {
                sums.coherent_w += power_w * coherent_share(ray.divergence_rad, ray.to_radar);
            }
        }
        sums
    }

    /// With `more` at a level added.
    fn and(self, level: f64, more: &Sums) -> Sums {
        Sums {
            centre_w: self.centre_w + level * more.centre_w,
            power_w: self.power_w + level * more.power_w,
            first: self.first + level * more.first,
            second: self.second + level * more.second,
            coherent_w: self.coherent_w + level * more.coherent_w,
        }
    }

    /// The mean over a whole spot by the base law; `None` where nothing comes back.
    fn averaged(&self) -> Option<SpotMean> {
        let Sums { centre_w, power_w, first, second, coherent_w } = *self;
        if centre_w <= 0.0 || power_w <= 0.0 {
            return None;
        }
        let (mean_w, longer_m) = (power_w, first / power_w);
        let spread_m = (second / power_w - longer_m * longer_m).max(0.0).sqrt();
        let coherent_share = coherent_w / power_w;
        Some(SpotMean { centre_w, mean_w, longer_m, spread_m, coherent_share })
    }
}

impl ShadedSpots {
    /// The level, 1/sr, of each term of the laws and how spots of a diameter answer to it. A law that is no sum of
    /// terms is one of level 1.
    fn answers(&self, diameter: Diameter) -> Vec<(f64, Arc<Vec<Sums>>)> {
        let key = diameter.key();
        let mut answers = Vec::new();
        for (region, law) in (0..).zip(&self.laws) {
            let Some(terms) = law.backscatter() else {
                let sums = self.sums.get_or_make((region, key), || {
                    self.spots.sums(
                        diameter,
                        region,
                        |asked| {
                            let seen =
                                asked.iter().map(|&(beam_rad, v)| law.seen_by(beam_rad, v, v));
                            seen.map(|seen| seen.f_per_sr).collect()
                        },
                        |beam_rad, v| law.seen_by(beam_rad, v, v).coherent_share,
                    )
                });
                answers.push((1.0, sums));
                continue;
            };
            for term in terms {
                let shape = Term { level_per_sr: 1.0, ..term };
                let sums = self.spots.sums.get_or_make((region, shape, key), || {
                    self.spots.sums(
                        diameter,
                        region,
                        |asked| {
                            let looks = asked
                                .iter()
                                .map(|&(beam_rad, v)| Look { beam_rad, cos_theta: v.cos_theta() });
                            shape.per_sr_of_each(&looks.collect::<Vec<_>>())
                        },
                        |beam_rad, _| shape.coherent_share(beam_rad),
                    )
                });
                answers.push((term.level_per_sr, sums));
            }
        }
        answers
    }
}

impl Spots {
    /// The sums of every spot over the rays of a region, for f, 1/sr, of many beams at once, and the coherent share of one.
    fn sums(
        &self,
        diameter: Diameter,
        region: u16,
        f_per_sr: impl Fn(&[Asked]) -> Vec<f64> + Sync,
        coherent_share: impl Fn(f64, Direction<Surface>) -> f64 + Sync,
    ) -> Vec<Sums> {
        let common = match diameter {
            Diameter::Of(diameter_m) => Some(weights(diameter_m)),
            Diameter::OfBeam => None,
        };
        let spots = self.all.par_iter().zip(&self.of_beam_m);
        let sums = spots.map(|(spot, of_beam_m)| {
            let Some(spot) = spot else { return Sums::default() };
            let weights = common.unwrap_or_else(|| weights(*of_beam_m));
            Sums::of(spot, &weights, region, &f_per_sr, &coherent_share)
        });
        sums.collect()
    }
}

/// The spots of all shots.
fn spots(stage: &Stage, shots: &[Shot]) -> Spots {
    let axes: Vec<Ray<Global>> = shots.iter().map(|shot| shot.ray).collect();
    let centres = closest(stage.geometry.bvh, &axes);
    let beams: Vec<GaussianBeam> = shots.iter().map(|shot| stage.beam(shot)).collect();
    let rays: Vec<[Ray<Global>; RAYS]> = (&axes, &beams, &centres)
        .into_par_iter()
        .map(|(axis, beam, centre)| spot_rays(beam, axis, centre.as_ref()))
        .collect();
    let hits = closest(stage.geometry.bvh, rays.as_flattened());
    // Where facets are few, spots hit most of them many times.
    let facets = stage.geometry.bvh.mesh().facets.len();
    let facets = if facets < shots.len() * RAYS { 0..facets } else { 0..0 };
    let facets: Vec<Facet> =
        facets.into_par_iter().with_min_len(1024).map(|facet| Facet::of(stage, facet)).collect();
    let all = (&axes, &beams, &centres, &rays)
        .into_par_iter()
        .zip(hits.par_chunks(RAYS))
        .map(|((axis, beam, centre, rays), hits)| {
            let centre = spot_ray(stage, &facets, beam, axis, centre, 0)?;
            let beam_rad = stage.widening_rad(centre.region, beam.divergence_rad());
            let centre = SpotRay { beam_rad, ..centre };
            let mut spot = Vec::with_capacity(RAYS);
            for ((ray, hit), number) in rays.iter().zip(hits).zip(0..) {
                spot.extend(spot_ray(stage, &facets, beam, ray, hit, number));
            }
            spot.shrink_to_fit();
            Some((centre, spot))
        })
        .collect();
    let of_beam = beams.iter().zip(&centres).map(|(beam, centre)| {
        let range_m = centre.as_ref().map_or(beam.focus_m, |hit| hit.range_m);
        beam.section(range_m).fwhm_m()
    });
    Spots { all, of_beam_m: of_beam.collect(), sums: Cache::default() }
}

/// Shades the traced rays of a list of shots with some laws.
fn shaded(survey: &Survey, laws: &[Brdf]) -> Survey {
    let Some(spots) = survey.downcast_ref::<Arc<Spots>>() else { return Box::new(()) };
    let (spots, laws) = (spots.clone(), laws.to_vec());
    Box::new(ShadedSpots { spots, laws, sums: Cache::default() })
}

/// Averages the echoes of some shots over spots of a diameter, as a range receiver reads them where there is one.
fn average(
    diameter: Diameter,
    cell: Option<RangeCell>,
    shaded: &Survey,
    arrived: &mut [Option<MeanEcho>],
) {
    let Some(shaded) = shaded.downcast_ref::<ShadedSpots>() else { return };
    let answers = shaded.answers(diameter);
    arrived.par_iter_mut().enumerate().for_each(|(shot, one)| {
        let sums = answers.iter().filter_map(|(level, of)| Some((*level, of.get(shot)?)));
        let sums = sums.fold(Sums::default(), |sums, (level, of)| sums.and(level, of));
        if let (Some(one), Some(averaged)) = (one, sums.averaged()) {
            let gain = one.power_w / averaged.centre_w;
            one.power_w = averaged.mean_w * gain.clamp(1.0 / MOST_GAIN, MOST_GAIN);
            one.range_m += averaged.longer_m;
            one.spread_m = one.spread_m.hypot(averaged.spread_m);
            one.coherent_share = averaged.coherent_share;
            if let Some(cell) = cell {
                *one = read_peak(&cell, *one);
            }
        }
    });
}

/// An echo as a range receiver reads it: of what speckles, the strongest peak. A wave has one range.
fn read_peak(cell: &RangeCell, echo: MeanEcho) -> MeanEcho {
    let [part, more_looks] = cell.peak(echo.spread_m);
    let share = echo.coherent_share + (1.0 - echo.coherent_share) * part;
    let coherent_share = echo.coherent_share / share;
    MeanEcho { power_w: share * echo.power_w, coherent_share, more_looks, ..echo }
}

/// One ray of the spot of a beam, where it hits; `facets` may be empty.
fn spot_ray(
    stage: &Stage,
    facets: &[Facet],
    beam: &GaussianBeam,
    ray: &Ray<Global>,
    hit: &Option<Hit>,
    number: u8,
) -> Option<SpotRay> {
    let hit = hit.as_ref()?;
    let surface = match facets.get(hit.facet as usize) {
        Some(facet) => facet.surface(ray),
        None => surface_at(stage, ray, hit),
    };
    Some(SpotRay::new(stage, beam, surface, hit, number))
}

/// The rays of a spot, on the wavefront of the radar's own beam; where the axis hits nothing, all run along it.
fn spot_rays(beam: &GaussianBeam, axis: &Ray<Global>, centre: Option<&Hit>) -> [Ray<Global>; RAYS] {
    let Some(centre) = centre else { return [*axis; RAYS] };
    let section = beam.section(centre.range_m);
    let (u, v) = axis.direction.xyz().any_orthonormal_pair();
    PLACES.map(|[along_m, across_m]| section.ray(axis, along_m * u + across_m * v).unwrap_or(*axis))
}

/// Where the rays of a spot pass, from its middle, m: at golden angles from each other.
static PLACES: LazyLock<[[f64; 2]; RAYS]> = LazyLock::new(|| {
    let mut angles_rad = sunflower(RAYS).map(|(_, angle_rad)| angle_rad);
    std::array::from_fn(|number| {
        let angle_rad = angles_rad.next().unwrap_or_default();
        [angle_rad.cos(), angle_rad.sin()].map(|side| radius_m(number) * side)
    })
});

/// Distance of a ray from the middle of its spot, m.
fn radius_m(number: usize) -> f64 {
    let [first_m, last_m] = RADII_M;
    first_m * (last_m / first_m).powf(number as f64 / (RAYS - 1) as f64)
}

/// Share of each ray in a spot of a diameter, m: the two-way weight u² = exp(−8 ln 2·r²/D²) of a ring whose width is in
/// proportion to its radius.
fn weights(diameter_m: f64) -> [f64; RAYS] {
    // u² has this standard deviation along each direction.
    let sd_m = diameter_m / (16.0 * std::f64::consts::LN_2).sqrt();
    let mut weights: [f64; RAYS] = std::array::from_fn(|number| {
        let off_sd = radius_m(number) / sd_m;
        off_sd * off_sd * (-0.5 * off_sd * off_sd).exp()
    });
    let largest = weights.iter().copied().fold(0.0, f64::max);
    weights.iter_mut().filter(|weight| **weight < LEAST_WEIGHT * largest).for_each(|w| *w = 0.0);
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// The mean over a spot by the base law, on the target as the scene has it: other effects act on top of
/// it.
struct SpotMean {
    /// Power of the ray along the axis and the mean over the spot, W.
    centre_w: f64,
    mean_w: f64,
    /// What adds to the range, and its spread, m.
    longer_m: f64,
    spread_m: f64,
    /// Share of the mean that is one wave.
    coherent_share: f64,
}

/// Spots may be oval: both axes of one whose axes are as 1 to 1.4 are within a sixth of their mean. Two of these errors
/// cover that.
const FORM_ERROR: f64 = 0.1;

const ABOUT: About = About {
    name: "finite-spot",
    level: Level::Instrument,
    description: "The beam has a width, here its diameter at half the intensity on the target, and averages \
         over what lies in it: curvature, edges, borders between materials.",
    signature: "Echoes are too weak beside edges, and the lobe is broader where the surface is curved; flat \
         places far from edges are right. A rougher surface or an error of the angle broadens the lobe \
         on flat places too.",
    parameters: &[EffectParameter::new("diameter_m", "m", [0.0, MOST_M], 0.0, 0.008)],
    conflicts: &[
        Conflict {
            with: Setting::SeveralRays,
            problem: "averages over the spot, and so do several rays",
            way_out: "set spot.rays = 1, or remove the effect",
        },
        Conflict::OF_SHEETS,
        Conflict::OF_BACKSCATTER,
    ],
    has_one_form: false,
};

impl Effect for FiniteSpot {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let nominal_m = stage.geometry.radar.spot_fwhm_m();
        [0.1, 0.3, 0.75, 1.5].map(|share| vec![(share * nominal_m).clamp(1e-3, MOST_M)]).to_vec()
    }

    fn reach_off_axis_m(&self, values: &[f64]) -> f64 {
        OUTER * values.first().copied().unwrap_or_default()
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        FORM_ERROR * values[parameter]
    }

    fn survey_key(&self, values: &[f64]) -> Option<Vec<f64>> {
        values.first().filter(|diameter_m| **diameter_m >= LEAST_M).map(|_| Vec::new())
    }

    fn survey(&self, _: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        Box::new(Arc::new(spots(stage, shots)))
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        shaded(survey, laws)
    }

    fn arrive(&self, values: &[f64], shaded: &Survey, arrived: &mut [Option<MeanEcho>]) {
        if let Some(&diameter_m) = values.first() {
            average(Diameter::Of(diameter_m), None, shaded, arrived);
        }
    }
}

const ABOUT_BEAM: About = About { parameters: &[], conflicts: &[], ..ABOUT };

impl Effect for BeamSpot {
    fn about(&self) -> &About {
        &ABOUT_BEAM
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn reach_off_axis_m(&self, _values: &[f64]) -> f64 {
        OUTER * self.diameter_m
    }

    fn survey_key(&self, _values: &[f64]) -> Option<Vec<f64>> {
        Some(Vec::new())
    }

    fn survey(&self, _: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        Box::new(Arc::new(spots(stage, shots)))
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        shaded(survey, laws)
    }

    fn arrive(&self, _: &[f64], shaded: &Survey, arrived: &mut [Option<MeanEcho>]) {
        average(Diameter::OfBeam, self.cell, shaded, arrived);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Lambert};
    use crate::effects::intersection::shot_along;
    use crate::effects::testing::{Bench, db, lobe, paint};
    use crate::effects::{Model, Receiver};
    use crate::scene::solids;

    #[test]
    fn a_plane_stays_as_it_is() {
        let bench = Bench::of(solids::plate(2.0, 2.0));
        for (bare, with) in bench.bare().iter().zip(bench.with(&FiniteSpot, &[0.016])) {
            // Over the spot the angle still changes by 2 mrad, on a lobe of 0.2.
            assert!(db(with.power_w / bare.power_w).abs() < 0.01);
            assert!((with.range_m - bare.range_m).abs() < 1e-4);
        }
    }

    /// A spot on a plane sees one wave as its axis does: of a lobe as narrow as the beam δ, half of what is specular.
    #[test]
    fn a_plane_returns_the_wave_of_its_law() {
        let bench = Bench::of(solids::plate(2.0, 2.0));
        let divergence_rad = bench.stage().middle_divergence_rad();
        let laws = vec![Brdf::CookTorrance(CookTorrance { m: divergence_rad, ..lobe() })];
        let receiver = Receiver { looks: 4.0, noise_w: 0.0, ..Receiver::LINEAR };
        let echoes = |effects| {
            let model = Model { laws: laws.clone(), receiver, effects, level: 1.0 };
            model.predict(&bench.stage(), &bench.shots).arrived
        };
        let alone = echoes(Vec::new());
        let averaged = echoes(vec![(&FiniteSpot as &dyn Effect, vec![0.016])]);
        // Off the middle of the field the beam is wider, and diverges less.
        let is_near = |index: &usize| {
            let shot = &bench.shots[*index];
            shot.xt_m.hypot(shot.yt_m) < 0.03
        };
        let near: Vec<usize> = (0..bench.shots.len()).filter(is_near).collect();
        assert!(!near.is_empty());
        for echo in near.into_iter().flat_map(|index| [alone[index], averaged[index]]) {
            let share = echo.unwrap().coherent_share;
            assert!((share - 0.5).abs() < 0.02, "{share}");
        }
    }

    #[test]
    fn a_spot_of_almost_no_width_is_a_ray() {
        let bench = Bench::sphere();
        for diameter_m in [1e-9, 1e-5, 0.9e-3] {
            assert_eq!(bench.with(&FiniteSpot, &[diameter_m]), bench.bare(), "{diameter_m}");
        }
        let sum: f64 = weights(LEAST_M).iter().sum();
        assert!((sum - 1.0).abs() < 1e-12);
        // But near edges of facets, which a millimetre may pass over.
        let narrow = bench.with(&FiniteSpot, &[LEAST_M]);
        let off_db = narrow.iter().zip(bench.bare()).map(|(a, b)| db(a.power_w / b.power_w).abs());
        let mut off_db: Vec<f64> = off_db.collect();
        off_db.sort_by(f64::total_cmp);
        assert!(off_db[off_db.len() / 2] < 0.02, "{off_db:?}");
    }

    /// The diameter of the beam at 8 m, where it has its waist, is that of the radar.
    #[test]
    fn the_spot_of_the_beam_is_one_of_its_diameter() {
        let bench = Bench::sphere();
        let diameter_m = bench.stage().geometry.radar.spot_fwhm_m();
        let own = bench.with(&BeamSpot { diameter_m, cell: None }, &[]);
        let given = bench.with(&FiniteSpot, &[diameter_m]);
        for (shot, (own, given)) in bench.shots.iter().zip(own.iter().zip(given)) {
            // Off the middle of the field the beam is wider.
            let near = if shot.xt_m.hypot(shot.yt_m) < 0.05 { 0.05 } else { 1.0 };
            assert!(db(own.power_w / given.power_w).abs() < near, "{own:?} {given:?}");
        }
    }

    #[test]
    fn what_is_kept_of_spots_is_what_their_laws_say() {
        let ray = |region: u16, theta_rad: f64| SpotRay {
            range_m: 8.0 + 0.01 * theta_rad,
            to_radar: Direction::from_angles(theta_rad, 0.3),
            watts_per_f: 1e-9,
            region,
            number: (100.0 * theta_rad) as u8,
            beam_rad: 0.3 * theta_rad,
            divergence_rad: 0.3 * theta_rad,
        };
        let over_a_border = (ray(0, 0.1), vec![ray(0, 0.2), ray(1, 0.3), ray(1, 0.05)]);
        let all = vec![Some(over_a_border), None, Some((ray(1, 0.2), vec![ray(1, 0.25)]))];
        let of_beam_m = vec![0.02; all.len()];
        let spots = Arc::new(Spots { all: all.clone(), of_beam_m, sums: Cache::default() });
        let law = |f_lambda: f64, m: f64| paint(CookTorrance { f_lambda, m, ..lobe() });
        let tabled = Brdf::Lambert(Lambert { albedo: 0.5 });
        let first = [law(0.2, 0.2), law(0.1, 0.3)];
        let other_level = [law(0.4, 0.2), law(0.1, 0.3)];
        let other_shape = [law(0.2, 0.25), tabled];
        for laws in [&first, &other_level, &other_shape, &first] {
            let survey: Survey = Box::new(spots.clone());
            let shaded = FiniteSpot.shade(&survey, laws);
            let shaded = shaded.downcast_ref::<ShadedSpots>().unwrap();
            let answers = shaded.answers(Diameter::Of(0.02));
            for (shot, spot) in all.iter().enumerate() {
                let add =
                    |sums: Sums, (level, of): &(f64, Arc<Vec<Sums>>)| sums.and(*level, &of[shot]);
                let kept = answers.iter().fold(Sums::default(), add);
                let Some(spot) = spot else {
                    assert!(kept.power_w == 0.0);
                    continue;
                };
                let fresh = (0..).zip(laws).fold(Sums::default(), |sums, (region, law)| {
                    let seen = |&(beam_rad, v): &Asked| law.seen_by(beam_rad, v, v).f_per_sr;
                    let f = |asked: &[Asked]| asked.iter().map(seen).collect();
                    let share = |beam_rad, v| law.seen_by(beam_rad, v, v).coherent_share;
                    sums.and(1.0, &Sums::of(spot, &weights(0.02), region, f, share))
                });
                for (kept, fresh) in [
                    (kept.centre_w, fresh.centre_w),
                    (kept.power_w, fresh.power_w),
                    (kept.first, fresh.first),
                    (kept.second, fresh.second),
                    (kept.coherent_w, fresh.coherent_w),
                ] {
                    assert!((kept - fresh).abs() <= 1e-12 * fresh.abs(), "{kept} {fresh}");
                }
            }
        }
    }

    /// The mean over a fine grid of rays through a spot, W.
    fn finely_w(bench: &Bench, shot: &Shot, diameter_m: f64) -> f64 {
        const HALF: i32 = 40;
        let (stage, law) = (bench.stage(), paint(lobe()));
        let model =
            Model { laws: vec![law], receiver: Receiver::LINEAR, effects: Vec::new(), level: 1.0 };
        let section = stage.beam(shot).section(shot.hit.range_m);
        let (u, v) = shot.ray.direction.xyz().any_orthonormal_pair();
        let sd_m = diameter_m / (16.0 * std::f64::consts::LN_2).sqrt();
        let [mut power_w, mut weights] = [0.0; 2];
        for (i, j) in (-HALF..=HALF).flat_map(|i| (-HALF..=HALF).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|k| 4.0 * f64::from(k) / f64::from(HALF));
            let weight = (-0.5 * (x * x + y * y)).exp();
            let ray = section.ray(&shot.ray, sd_m * (x * u + y * v)).unwrap();
            let beside = shot_along(&stage, shot, ray);
            weights += weight;
            power_w += beside.map_or(0.0, |shot| weight * model.arrived(&stage, &shot).power_w);
        }
        power_w / weights
    }

    #[test]
    fn a_spot_on_a_ball_is_that_of_a_fine_grid() {
        let bench = Bench::sphere();
        for diameter_m in [0.02, 0.05, 0.1] {
            let spots = bench.with(&FiniteSpot, &[diameter_m]);
            let off_db: Vec<f64> = std::iter::zip(&bench.shots, spots)
                .step_by(3)
                .map(|(shot, spot)| db(spot.power_w / finely_w(&bench, shot, diameter_m)))
                .collect();
            let rms = (off_db.iter().map(|x| x * x).sum::<f64>() / off_db.len() as f64).sqrt();
            let most = off_db.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            // Before the focus the wave converges, and a highlight is narrower than it would be in parallel rays.
            assert!(rms < 0.2 && most < 0.55, "{diameter_m} m: {rms:.3} dB, at most {most:.3}");
        }
    }

    #[test]
    fn half_a_spot_beside_the_edge_is_half_the_power() {
        let bench = Bench::of(solids::plate(0.5, 2.0));
        let edge = bench.shots.iter().position(|shot| shot.xt_m > 0.2499);
        let edge = edge.expect("the last column of shots is on the edge");
        let ratio = bench.with(&FiniteSpot, &[0.016])[edge].power_w / bench.bare()[edge].power_w;
        // A few rays lie on the edge itself.
        assert!((ratio - 0.5).abs() < 0.1, "{ratio}");
    }
}
