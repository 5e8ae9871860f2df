//! Echoes by way of a second surface: radar → first hit → second hit → radar.
//!
//! The power that leaves the first hit in a direction falls on the second one and is scattered to the radar,
//! unless something hides it: P₂ = coupling·∫ Φ·f₁(i, ω)·cos θ_ω · f₂·cos θ_o·Ω·A dω, over fixed
//! directions, spread by the cosine and by a wide and a narrow lobe, each weighed by their joint density (the
//! balance heuristic: Veach & Guibas, SIGGRAPH 1995), and exactly in the direction of the mirror where f₁ has a lobe
//! too narrow for them. A is how well the antenna sees the second hit at a distance d from the axis of its beam: the
//! most of the beam's own pattern, of exp(−d/reach) and of side lobes. Without a reach it is that of `[bounce]`. The
//! range is half the whole way, and what is reported is the mean by power. Paths are traced once, and shaded once for
//! all values of coupling and reach.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::brdf::{
    Bistatic, Brdf, Distribution, NarrowLobe, Pair, Scattering, Seen, of_each_law,
};
use crate::effects::echo::MeanEcho;
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level, Setting, Survey};
use crate::effects::intersection::{local_frame, shot_along};
use crate::effects::range_cell::RangeCell;
use crate::effects::shot::{Shot, Stage};
use crate::effects::spread::sunflower;
use crate::frames::{Direction, Point, Ray, Surface};
use crate::trace::LocalFrame;
use crate::units::ratio_from_db;

pub(crate) struct MultiBounce;

/// The second-order paths that a scene with `[bounce]` has. They have no number to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SecondBounce {
    /// Power by way of a surface outside the spot, over one inside, as a ratio.
    pub outside_spot: f64,
    /// Whether both ways round a pair of surfaces add as waves, which doubles what is not coherent.
    pub in_phase: bool,
    /// How a range receiver reads them: a path adds to the peak of the first surface as far as it is as long. None
    /// without one.
    pub cell: Option<RangeCell>,
}

impl SecondBounce {
    /// What is assumed without `[bounce]`.
    const ASSUMED: SecondBounce =
        SecondBounce { outside_spot: OUTSIDE_SPOT, in_phase: false, cell: None };
}

/// A coupling that counts as none, dB.
const NONE_DB: f64 = -60.0;
/// Directions of each kind.
const DIRECTIONS: usize = 24;
/// Roughnesses of the lobes that directions are spread over, whatever the law's: rays can then be traced
/// once for all laws.
const LOBES: [f64; 2] = [0.25, 0.08];
/// Power by way of a surface outside the spot, over one inside: the side lobes that `[bounce]` assumes, too.
const OUTSIDE_SPOT: f64 = 0.01;
/// The cosine and the lobes.
const KINDS: usize = 1 + LOBES.len();
/// Shots whose paths are shaded together.
const SHOTS_PER_TASK: usize = 16;
/// A ray starts this far from its surface, m, so that the surface does not block it.
const CLEARANCE_M: f64 = 1e-6;

/// Onward directions at a surface, with the density of each, 1/sr.
fn onward(i: Direction<Surface>) -> impl Iterator<Item = (Direction<Surface>, f64)> {
    let by_cosine = sunflower(DIRECTIONS)
        .map(|(share, azimuth_rad)| Direction::from_angles(share.sqrt().asin(), azimuth_rad));
    let by_lobes = LOBES.into_iter().flat_map(move |m| by_lobe(i, m));
    by_cosine.chain(by_lobes).filter(|o| o.cos_theta() > 1e-6).map(move |o| {
        let lobes: f64 = LOBES.iter().map(|m| lobe_density(i, o, *m)).sum();
        (o, (o.cos_theta() / PI + lobes) / KINDS as f64)
    })
}

/// Reflections of i on facets of roughness m by Beckmann's law.
fn by_lobe(i: Direction<Surface>, m: f64) -> impl Iterator<Item = Direction<Surface>> {
    sunflower(DIRECTIONS).filter_map(move |(share, azimuth_rad)| {
        let tan = m * (-(1.0 - share).ln()).sqrt();
        let h = Direction::<Surface>::from_angles(tan.atan(), azimuth_rad).xyz();
        Direction::new(2.0 * i.xyz().dot(h) * h - i.xyz())
    })
}

/// Density at o of reflections of i on facets by Beckmann's law, 1/sr.
fn lobe_density(i: Direction<Surface>, o: Direction<Surface>, m: f64) -> f64 {
    let Some(h) = Direction::<Surface>::new(i.xyz() + o.xyz()) else { return 0.0 };
    let per_sr = Distribution::Beckmann.d_per_sr(h.cos_theta(), m) * h.cos_theta();
    per_sr / (4.0 * i.xyz().dot(h.xyz()).max(1e-9))
}

/// A path by way of a second surface, apart from the laws of the two surfaces.
#[derive(Clone, Copy)]
struct Detour {
    /// Regions of the two surfaces.
    regions: [u16; 2],
    /// Into and out of each of them.
    first: [Direction<Surface>; 2],
    second: [Direction<Surface>; 2],
    /// Whether it leaves the first surface exactly as from a mirror.
    is_mirrored: bool,
    /// Power received, W, where the second f is 1/sr and the first one, too, and the antenna sees the second surface as
    /// well as the first; of a mirrored path where the first surface sends on all that it receives.
    watts: f64,
    /// How well the beam with its side lobes sees the second surface, as a share of the power on its axis.
    pattern: f64,
    /// Distance of the second surface from the axis of the beam, m.
    beside_m: f64,
    /// Divergence of the beam at the second surface, rad.
    beam_rad: f64,
    /// Half the whole way, m.
    range_m: f64,
}

impl Detour {
    /// The look at the first surface, and at the second one by way of a lobe of the roughness m.
    fn looks(&self, m: f64) -> [Pair; 2] {
        [(0.0, self.first), (self.beam_rad.hypot(m), self.second)]
            .map(|(beam_rad, [i, o])| Pair { beam_rad, i, o })
    }

    /// Power received, W, and the part of it that is one wave, by what is seen of both surfaces.
    fn drawn_w(&self, [first, second]: [Seen; 2], in_phase: bool) -> [f64; 2] {
        let sent_w = self.watts * first.f_per_sr;
        received_per_sr([first, second], 1.0, in_phase).map(|f| sent_w * f)
    }

    /// The same by way of the narrow lobes of the first surface.
    fn mirrored_w(&self, laws: &[Brdf], in_phase: bool) -> [f64; 2] {
        let [first, second] = self.regions.map(|region| laws.get(usize::from(region)));
        let (Some(first), Some(second)) = (first, second) else { return [0.0; 2] };
        let mut powers_w = [0.0; 2];
        for NarrowLobe { share, m } in first.narrow_lobes(self.first[0]) {
            let [_, Pair { beam_rad, i, o }] = self.looks(m);
            let narrowed = (self.beam_rad / beam_rad).powi(2);
            let seen = [Seen::mirror(0.0), second.seen_by(beam_rad, i, o)];
            let received = received_per_sr(seen, narrowed, in_phase);
            for (power_w, f_per_sr) in powers_w.iter_mut().zip(received) {
                *power_w += self.watts * share * f_per_sr;
            }
        }
        powers_w
    }
}

/// f of the second surface, 1/sr, with what the same way round the other way adds; and the part of it that is one wave, of which
/// a lobe of the first surface leaves the share `narrowed`.
fn received_per_sr([first, last]: [Seen; 2], narrowed: f64, in_phase: bool) -> [f64; 2] {
    let coherent_share = first.coherent_share * last.coherent_share * narrowed;
    // The coherent part is one wave already.
    let enhancement = if in_phase { 2.0 - coherent_share } else { 1.0 };
    [last.f_per_sr * enhancement, last.f_per_sr * coherent_share]
}

/// The path of a ray from the first surface to a second one that the radar sees. The density is that of the
/// directions, 1/sr; `None` for the direction of the mirror.
fn detour(
    stage: &Stage,
    shot: &Shot,
    frame: &LocalFrame,
    o: Direction<Surface>,
    density_per_sr: Option<f64>,
    outside_spot: f64,
) -> Option<Detour> {
    let onward = frame.world(o.xyz());
    let start = shot.hit.point.xyz + CLEARANCE_M * shot.normal;
    let ray = Ray { origin: Point::from(start), direction: Direction::new(onward)? };
    let second = shot_along(stage, shot, ray)?;
    let radar = shot.ray.origin;
    let to_radar = second.hit.point.towards(radar)?;
    let beam = stage.beam(shot);
    let pattern = beam.pattern(&shot.ray, 1, second.hit.point);
    // In the main lobe the antenna sees along the normal of its wavefront.
    let back = if pattern > outside_spot {
        -beam.direction_at(&shot.ray, second.hit.point)
    } else {
        to_radar
    };
    let cos_exit = second.normal.dot(back.xyz());
    let back_m = second.hit.point.distance_m(radar);
    let sight = Ray { origin: radar, direction: -to_radar };
    let hidden = stage.geometry.bvh.closest(&sight).is_some_and(|hit| hit.range_m < back_m - 1e-5);
    if cos_exit <= 0.0 || hidden {
        return None;
    }
    let there = local_frame(stage, &second);
    let way_m = shot.hit.point.distance_m(second.hit.point) + back_m;
    let sent_sr = density_per_sr
        .map_or(1.0, |density_per_sr| o.cos_theta() / density_per_sr / (KINDS * DIRECTIONS) as f64);
    let path_m = shot.hit.range_m + way_m;
    let sent_w = stage.link.flux_w(shot.hit.cos_theta) * sent_sr * stage.link.air_share(path_m);
    let along_beam_m = (second.hit.point.xyz - radar.xyz).dot(shot.ray.direction.xyz());
    let solid_angle_sr = stage.link.solid_angle_sr(&beam, along_beam_m);
    Some(Detour {
        regions: [shot.region, second.region],
        first: [frame.local(-shot.ray.direction.xyz()), o],
        second: [there.local(-onward), there.local(back.xyz())],
        is_mirrored: density_per_sr.is_none(),
        watts: sent_w * cos_exit * solid_angle_sr,
        pattern: pattern.max(outside_spot),
        beside_m: (second.hit.point.xyz - radar.xyz).reject_from(shot.ray.direction.xyz()).length(),
        beam_rad: beam.divergence_rad(),
        range_m: path_m / 2.0,
    })
}

/// All paths of a chirp by way of second surfaces, on the target as the scene has it.
fn detours(stage: &Stage, shot: &Shot, outside_spot: f64) -> Vec<Detour> {
    let Some(shot) = &shot_along(stage, shot, shot.ray) else { return Vec::new() };
    let frame = local_frame(stage, shot);
    let i = frame.local(-shot.ray.direction.xyz());
    let drawn = onward(i).map(|(o, density_per_sr)| (o, Some(density_per_sr)));
    let all = drawn.chain([(i.mirrored(), None)]);
    all.filter_map(|(o, per_sr)| detour(stage, shot, &frame, o, per_sr, outside_spot)).collect()
}

/// What a path by way of a second surface returns by the laws of the two.
struct Bounce {
    /// Power, W, where the antenna sees the second surface as well as the first, and half the whole way, m.
    echo: MeanEcho,
    pattern: f64,
    beside_m: f64,
}

impl Bounce {
    fn new(detour: &Detour, [power_w, coherent_w]: [f64; 2]) -> Bounce {
        let Detour { pattern, beside_m, range_m, .. } = *detour;
        let coherent_share = if power_w > 0.0 { coherent_w / power_w } else { 0.0 };
        let echo = MeanEcho { coherent_share, ..MeanEcho::at_once(power_w, range_m) };
        Bounce { echo, pattern, beside_m }
    }

    /// The echo through an antenna of this reach, m.
    fn seen(&self, reach_m: f64) -> MeanEcho {
        let mut seen = self.pattern;
        if reach_m > 0.0 {
            seen = seen.max((-self.beside_m / reach_m).exp());
        }
        MeanEcho { power_w: seen * self.echo.power_w, ..self.echo }
    }
}

/// What the paths of some shots return. The laws are evaluated at once for all directions that were drawn.
fn bounces(
    of_shots: &[Vec<Detour>],
    laws: &[Brdf],
    each: &[Bistatic],
    in_phase: bool,
) -> Vec<Vec<Bounce>> {
    let drawn: Vec<&Detour> = of_shots.iter().flatten().filter(|one| !one.is_mirrored).collect();
    let [first, second] = [0, 1].map(|surface| {
        let regions = drawn.iter().map(|one| usize::from(one.regions[surface]));
        of_each_law(regions, |law, here| {
            let looks: Vec<Pair> = here.iter().map(|&at| drawn[at].looks(0.0)[surface]).collect();
            match (each.get(law), surface) {
                (None, _) => Vec::new(),
                (Some(law), 0) => law.apart_from_narrow_lobes(&looks),
                (Some(law), _) => law.seen(&looks),
            }
        })
    });
    let mut of_drawn = first.into_iter().zip(second);
    let of_shots = of_shots.iter().map(|detours| {
        let bounces = detours.iter().map(|detour| {
            let powers_w = if detour.is_mirrored {
                detour.mirrored_w(laws, in_phase)
            } else {
                let seen = of_drawn.next().unwrap_or_default();
                detour.drawn_w(seen.into(), in_phase)
            };
            Bounce::new(detour, powers_w)
        });
        bounces.collect()
    });
    of_shots.collect()
}

const ABOUT: About = About {
    name: "multi-bounce",
    level: Level::Scene,
    description: "Part of the wave goes on from the first surface to a second one and returns from there. At \
         0 dB its power is what the two scattering models and the antenna's pattern give: its beam, and side lobes \
         of -20 dB; coupling_db is added to it. An antenna that sees farther beside its beam has the pattern exp(−d/reach_m) at the \
         distance d from its axis, where that is more.",
    signature: "Places that face another surface, as in corners and under arms, are too bright and too far \
         away. A foreign patch is bright without a longer range, and a wrong pose is off in range \
         without being bright; convex targets never show this.",
    parameters: &[
        EffectParameter::new("coupling_db", "dB", [NONE_DB, 30.0], NONE_DB, 1.0),
        EffectParameter::new("reach_m", "m", [0.0, 0.5], 0.0, 0.01),
    ],
    conflicts: &[
        Conflict {
            with: Setting::Bounce,
            problem: "brings echoes by way of a second surface, and so does [bounce]",
            way_out: "remove one of the two",
        },
        Conflict::OF_SHEETS,
        Conflict::OF_BACKSCATTER,
    ],
    has_one_form: false,
};

impl Effect for MultiBounce {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for reach_m in [0.0, 0.02, 0.06, 0.2] {
            starts.extend([-10.0, 0.0, 10.0].map(|coupling_db| vec![coupling_db, reach_m]));
        }
        starts
    }

    /// Side lobes of one level; and an antenna that sees less the farther from its axis.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0], &[0, 1]]
    }

    fn survey_key(&self, values: &[f64]) -> Option<Vec<f64>> {
        values.first().filter(|coupling_db| **coupling_db > NONE_DB).map(|_| Vec::new())
    }

    fn survey(&self, _: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        SecondBounce::ASSUMED.survey(&[], stage, shots)
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        SecondBounce::ASSUMED.shade(survey, laws)
    }

    fn arrive(&self, values: &[f64], shaded: &Survey, arrived: &mut [Option<MeanEcho>]) {
        let &[coupling_db, reach_m] = values else { return };
        add(ratio_from_db(coupling_db), reach_m, None, shaded, arrived);
    }
}

/// Adds what comes by way of second surfaces, times a ratio, through an antenna of a reach, m, and to a range receiver's peak.
fn add(
    coupling: f64,
    reach_m: f64,
    cell: Option<RangeCell>,
    shaded: &Survey,
    arrived: &mut [Option<MeanEcho>],
) {
    let all = shaded.downcast_ref::<Vec<Vec<Bounce>>>().map_or(&[][..], Vec::as_slice);
    all.par_iter().zip(arrived).for_each(|(bounces, one)| {
        let Some(one) = one else { return };
        let part = |echo: MeanEcho| match cell {
            Some(cell) => cell.response(echo.range_m - one.range_m) * echo.power_w,
            None => echo.power_w,
        };
        let seen = bounces.iter().map(|bounce| bounce.seen(reach_m));
        let read = seen.map(|echo| MeanEcho { power_w: part(echo), ..echo });
        if let Some(seen) = read.reduce(MeanEcho::with) {
            *one = one.with(MeanEcho { power_w: coupling * seen.power_w, ..seen });
        }
    });
}

const ABOUT_SECOND: About = About { parameters: &[], conflicts: &[], ..ABOUT };

impl Effect for SecondBounce {
    fn about(&self) -> &About {
        &ABOUT_SECOND
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn survey_key(&self, _values: &[f64]) -> Option<Vec<f64>> {
        Some(Vec::new())
    }

    fn survey(&self, _: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        let all = shots.par_iter().map(|shot| detours(stage, shot, self.outside_spot));
        Box::new(all.collect::<Vec<Vec<Detour>>>())
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        let all = survey.downcast_ref::<Vec<Vec<Detour>>>().map_or(&[][..], Vec::as_slice);
        let each: Vec<Bistatic> = laws.iter().map(|law| Bistatic::new(law)).collect();
        let tasks = all.par_chunks(SHOTS_PER_TASK);
        let bounces = tasks.flat_map_iter(|of_shots| bounces(of_shots, laws, &each, self.in_phase));
        Box::new(bounces.collect::<Vec<Vec<Bounce>>>())
    }

    fn arrive(&self, _: &[f64], shaded: &Survey, arrived: &mut [Option<MeanEcho>]) {
        add(1.0, 0.0, self.cell, shaded, arrived);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;
    use crate::effects::testing::{Bench, dihedral};
    use crate::effects::{Model, Receiver};

    #[test]
    fn it_adds_power_and_way_in_a_corner_and_nothing_on_a_ball() {
        let corner = Bench::of(dihedral());
        let (bare, with) = (corner.bare(), corner.with(&MultiBounce, &[0.0, 0.0]));
        let mut raised = 0;
        for (bare, with) in bare.iter().zip(&with) {
            assert!(with.power_w >= bare.power_w && with.range_m >= bare.range_m - 1e-9);
            raised += usize::from(with.power_w > 1.05 * bare.power_w);
        }
        assert!(raised > bare.len() / 2, "{raised} of {}", bare.len());
        let ball = Bench::sphere();
        assert_eq!(ball.with(&MultiBounce, &[0.0, 0.0]), ball.bare());
        assert_eq!(corner.with(&MultiBounce, &[NONE_DB, 0.3]), bare);
    }

    /// Power by way of a second surface, W.
    fn bounced_w(corner: &Bench, values: &[f64]) -> Vec<f64> {
        let pairs = corner.with(&MultiBounce, values).into_iter().zip(corner.bare());
        pairs.map(|(with, bare)| with.power_w - bare.power_w).collect()
    }

    /// Between them are the beam with its side lobes, and an antenna that sees everything as well as its axis.
    #[test]
    fn an_antenna_of_more_reach_sees_more() {
        let corner = Bench::of(dihedral());
        let reaches_m = [0.0, 1e-6, 0.05, 0.1, 0.5];
        let [none, least, ..] = reaches_m.map(|reach_m| bounced_w(&corner, &[0.0, reach_m]));
        assert_eq!(none, least);
        for pair in reaches_m.windows(2) {
            let [nearer, farther] = [0, 1].map(|k| bounced_w(&corner, &[0.0, pair[k]]));
            for ((nearer_w, farther_w), side_w) in nearer.iter().zip(&farther).zip(&none) {
                assert!(farther_w >= nearer_w, "{pair:?}");
                assert!(*farther_w <= 1.0001 * side_w / OUTSIDE_SPOT, "{pair:?}");
            }
        }
    }

    #[test]
    fn the_pattern_falls_by_a_factor_of_e_over_the_reach() {
        let echo = MeanEcho::at_once(2.0, 8.0);
        let bounce = Bounce { echo, pattern: OUTSIDE_SPOT, beside_m: 0.12 };
        assert!((bounce.seen(0.06).power_w - 2.0 * (-2.0f64).exp()).abs() < 1e-12);
        assert_eq!(bounce.seen(0.02).power_w, 2.0 * OUTSIDE_SPOT);
        let inside = Bounce { pattern: 0.5, ..bounce };
        assert_eq!(inside.seen(0.06).power_w, 1.0);
    }

    #[test]
    fn side_lobes_and_both_ways_in_phase_have_their_factors() {
        let corner = Bench::of(dihedral());
        let bare = corner.bare();
        let added_w = |outside_spot, in_phase| -> f64 {
            let with = corner.with(&SecondBounce { outside_spot, in_phase, cell: None }, &[]);
            with.iter().zip(&bare).map(|(with, bare)| with.power_w - bare.power_w).sum()
        };
        let assumed_w: f64 =
            corner.with(&MultiBounce, &[0.0, 0.0]).iter().map(|one| one.power_w).sum();
        let bare_w: f64 = bare.iter().map(|one| one.power_w).sum();
        assert!((added_w(OUTSIDE_SPOT, false) / (assumed_w - bare_w) - 1.0).abs() < 1e-9);
        // No part of a rough lobe is one wave.
        assert!((added_w(OUTSIDE_SPOT, true) / added_w(OUTSIDE_SPOT, false) - 2.0).abs() < 1e-3);
        // Almost all second surfaces lie outside of the spot.
        let ratio = added_w(0.1 * OUTSIDE_SPOT, false) / added_w(OUTSIDE_SPOT, false);
        assert!((0.09..0.9).contains(&ratio), "{ratio}");
    }

    /// ∫ cos θ dω over the hemisphere is π.
    #[test]
    fn the_directions_integrate_over_the_hemisphere() {
        for theta_rad in [0.0, 0.5, 1.0] {
            let i = Direction::from_angles(theta_rad, 0.3);
            let sum: f64 = onward(i).map(|(o, density)| o.cos_theta() / density).sum();
            let found = sum / (KINDS * DIRECTIONS) as f64 / PI;
            // A third of the directions see the whole, so that a few per cent are left.
            assert!((found - 1.0).abs() < 0.1, "{theta_rad}: {found}");
        }
    }

    /// Each bounce takes one factor of the albedo, and what leaves one wall of a right angle hits the
    /// other by less than half.
    #[test]
    fn the_power_of_a_lambertian_corner_follows_its_albedo() {
        let corner = Bench::of(dihedral());
        let share = |albedo: f64| {
            let laws = vec![Brdf::Lambert(Lambert { albedo })];
            let receiver = Receiver { looks: 4.0, noise_w: 0.0, ..Receiver::LINEAR };
            let total = |effects| -> f64 {
                let model = Model { laws: laws.clone(), receiver, effects, level: 1.0 };
                let found = model.predict(&corner.stage(), &corner.shots);
                found.arrived.iter().flatten().map(|one| one.power_w).sum()
            };
            total(vec![(&MultiBounce as &dyn Effect, vec![0.0, 0.0])]) / total(Vec::new()) - 1.0
        };
        assert!((share(0.8) / share(0.4) - 2.0).abs() < 1e-9);
        assert!(share(0.8) > 0.02 && share(0.8) < 0.4, "{}", share(0.8));
    }
}
