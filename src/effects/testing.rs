//! Small scans for the tests of the effects, and what every effect must keep.

use glam::DVec3;

use super::intersection::shot_along;
use super::twist::way_m;
use super::{
    Effect, EffectParameter, MeanEcho, Model, Prediction, Receiver, Shot, Stage, find, library,
    middle,
};
use crate::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use crate::frames::{Point, Ray};
use crate::geometry::Mesh;
use crate::radar::{Chirps, Link, Radar};
use crate::scene::solids;
use crate::trace::{Bvh, ScanGeometry};
pub(super) use crate::units::db_from_ratio as db;

/// A specular lobe.
pub(super) fn lobe() -> CookTorrance {
    CookTorrance {
        f_lambda: 0.2,
        m: 0.2,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    }
}

/// A painted surface.
pub(super) fn paint(lobe: CookTorrance) -> Brdf {
    Brdf::Mixture(Mixture {
        k: 0.3,
        diffuse: Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.02, alpha: 4.0 })),
        specular: Box::new(Brdf::CookTorrance(lobe)),
    })
}

/// A target 8 m in front of a radar whose axis points along −z, and the shots that hit it.
pub(super) struct Bench {
    bvh: Bvh<'static>,
    radar: Radar,
    chirps: Chirps,
    regions: Vec<u16>,
    law: Brdf,
    pub shots: Vec<Shot>,
}

const GRAIN: [DVec3; 1] = [DVec3::Y];
const SIDE: u32 = 15;
const HALF_M: f64 = 0.25;

impl Bench {
    /// A flat plate across the line of sight.
    pub(super) fn plate() -> Bench {
        Bench::of(solids::plate(0.6, 0.6))
    }

    /// A ball of 0.3 m.
    pub(super) fn sphere() -> Bench {
        Bench::of(solids::icosphere(0.3, 4))
    }

    /// Any mesh.
    pub(super) fn of(mesh: Mesh) -> Bench {
        let mesh: &'static Mesh = Box::leak(Box::new(mesh));
        let regions = vec![0; mesh.facets.len()];
        // Its rays start 8 m in front of the origin, which is the middle of the field of view.
        let radar = Radar { primary_focus_m: [0.0, 0.0, 8.0], ..Radar::default() };
        let (bvh, shots) = (Bvh::new(mesh), Vec::new());
        let chirps = Chirps::default();
        let mut bench = Bench { bvh, radar, chirps, regions, law: paint(lobe()), shots };
        let shots = (0..SIDE * SIDE).filter_map(|chirp| shot(&bench.stage(), chirp)).collect();
        bench.shots = shots;
        bench
    }

    pub(super) fn stage(&self) -> Stage<'_> {
        Stage {
            geometry: ScanGeometry::new(&self.radar, &self.chirps, &self.bvh, &self.regions),
            link: Link::new(&self.radar),
            grain_of_region: &GRAIN,
            seen_lobe_rad: &[],
            on_wavefront: false,
            antenna: None,
            middle: middle(&self.shots),
        }
    }

    pub(super) fn predict(&self, effects: Vec<(&dyn Effect, Vec<f64>)>) -> Prediction {
        let receiver = Receiver { looks: 4.0, noise_w: 1e-13, ..Receiver::LINEAR };
        Model { laws: vec![self.law.clone()], receiver, effects, level: 1.0 }
            .predict(&self.stage(), &self.shots)
    }

    /// A shot where an effect places it.
    pub(super) fn moved(&self, effect: &dyn Effect, values: &[f64], shot: &Shot) -> Option<Shot> {
        let effects = vec![(effect, values.to_vec())];
        let receiver = Receiver::LINEAR;
        Model { laws: Vec::new(), receiver, effects, level: 1.0 }.placed(&self.stage(), *shot)
    }

    /// What arrives without any effect.
    pub(super) fn bare(&self) -> Vec<MeanEcho> {
        self.predict(Vec::new()).arrived.into_iter().flatten().collect()
    }

    /// What arrives with one.
    pub(super) fn with(&self, effect: &dyn Effect, values: &[f64]) -> Vec<MeanEcho> {
        self.predict(vec![(effect, values.to_vec())]).arrived.into_iter().flatten().collect()
    }
}

fn shot(stage: &Stage, chirp: u32) -> Option<Shot> {
    let at = |step: u32| HALF_M * (2.0 * f64::from(step) / f64::from(SIDE - 1) - 1.0);
    let (xt_m, yt_m) = (at(chirp % SIDE), at(chirp / SIDE));
    let origin = Point::new(0.0, 0.0, 8.0);
    let ray = Ray { origin, direction: origin.towards(Point::new(xt_m, yt_m, 0.0))? };
    let chirps = Chirps {
        rays: vec![ray],
        number: vec![chirp],
        time_s: vec![2e-4 * f64::from(chirp)],
        ..Chirps::default()
    };
    let missed = Shot::missed(&chirps, 0, f64::from(chirp) / f64::from(SIDE * SIDE - 1));
    shot_along(stage, &Shot { xt_m, yt_m, edge_m: 0.05, ..missed }, ray)
}

/// Two walls that face each other at a right angle, open towards the radar.
pub(super) fn dihedral() -> Mesh {
    let vertices = vec![
        DVec3::new(0.0, -0.4, -0.2),
        DVec3::new(0.0, 0.4, -0.2),
        DVec3::new(-0.4, 0.4, 0.2),
        DVec3::new(-0.4, -0.4, 0.2),
        DVec3::new(0.4, 0.4, 0.2),
        DVec3::new(0.4, -0.4, 0.2),
    ];
    let facets = vec![[0, 1, 2], [0, 2, 3], [0, 4, 1], [0, 5, 4]];
    Mesh { vertices, facets, labels: Vec::new() }
}

fn absent(effect: &dyn Effect) -> Vec<f64> {
    effect.parameters().iter().map(|parameter| parameter.absent).collect()
}

fn benches() -> [Bench; 3] {
    [Bench::plate(), Bench::sphere(), Bench::of(dihedral())]
}

#[test]
fn at_absent_values_no_effect_changes_anything() {
    for bench in benches() {
        let bare = bench.predict(Vec::new());
        for effect in library() {
            let with = bench.predict(vec![(effect, absent(effect))]);
            assert_eq!(with, bare, "{}", effect.name());
        }
        let all = library().map(|effect| (effect, absent(effect))).to_vec();
        assert_eq!(bench.predict(all), bare);
    }
}

/// The loss of a bundle of paths is, to first order, that of their mean range.
#[test]
fn air_takes_its_loss_of_every_echo_by_its_range() {
    const LOSS_DB_PER_M: f64 = 1e-4;
    // A layer on the target makes its echo seem some millimetres of 8 m longer; the air does not see that.
    const SHARE: f64 = 2e-3;
    for bench in benches() {
        let air_loss_db_per_m = LOSS_DB_PER_M;
        let radar = Radar { air_loss_db_per_m, ..bench.radar.clone() };
        let through = Bench { radar, regions: bench.regions.clone(), ..bench };
        let bench = Bench {
            radar: Radar { air_loss_db_per_m: 0.0, ..through.radar.clone() },
            bvh: Bvh::new(through.bvh.mesh()),
            chirps: through.chirps.clone(),
            regions: through.regions.clone(),
            law: through.law.clone(),
            shots: through.shots.clone(),
        };
        for effect in library() {
            let values = effect.starts(&bench.stage(), &bench.shots).swap_remove(0);
            let (bare, lossy) = (bench.with(effect, &values), through.with(effect, &values));
            assert!(bare.len() == lossy.len() && !bare.is_empty(), "{}", effect.name());
            for (bare, lossy) in std::iter::zip(bare, lossy).filter(|(bare, _)| bare.power_w > 0.0)
            {
                let (expected_db, found_db) =
                    (-LOSS_DB_PER_M * 2.0 * bare.range_m, db(lossy.power_w / bare.power_w));
                assert!(
                    (found_db / expected_db - 1.0).abs() < SHARE,
                    "{}: {found_db}",
                    effect.name()
                );
            }
        }
    }
}

fn is_sound(prediction: &Prediction) -> bool {
    let arrived = prediction.arrived.iter().flatten().all(|arrived| {
        let MeanEcho { power_w, range_m, .. } = *arrived;
        power_w.is_finite() && power_w >= 0.0 && range_m.is_finite() && range_m > 0.0
    });
    let Receiver { looks, noise_w, tilt_sd_rad, ceiling, .. } = prediction.receiver;
    let receiver = [looks, noise_w, tilt_sd_rad].iter().all(|v| v.is_finite())
        && ceiling.saturation_w > 0.0
        && ceiling.knee > 0.0;
    arrived && receiver && prediction.tilts.iter().flatten().all(|(factor, _)| factor.is_finite())
}

#[test]
fn every_value_within_the_ranges_gives_finite_numbers() {
    for bench in benches() {
        for effect in library() {
            let starts = effect.starts(&bench.stage(), &bench.shots);
            let start = starts.first().cloned().unwrap_or_else(|| absent(effect));
            for (at, parameter) in effect.parameters().iter().enumerate() {
                for value in [parameter.min, parameter.max, (parameter.min + parameter.max) / 2.0] {
                    let mut values = start.clone();
                    values[at] = value;
                    let found = bench.predict(vec![(effect, values.clone())]);
                    assert!(is_sound(&found), "{} at {values:?}", effect.name());
                }
            }
            let ends: [fn(&EffectParameter) -> f64; 2] =
                [|parameter| parameter.min, |parameter| parameter.max];
            for end in ends {
                let values = effect.parameters().iter().map(end).collect();
                assert!(is_sound(&bench.predict(vec![(effect, values)])), "{}", effect.name());
            }
        }
    }
}

#[test]
fn searches_begin_within_the_ranges_and_where_there_is_an_effect() {
    // At 45° only a rough surface shadows itself.
    let law = paint(CookTorrance { m: 0.8, ..lobe() });
    let bench = Bench { law, ..Bench::of(dihedral()) };
    let bare = bench.predict(Vec::new());
    for effect in library() {
        let starts = effect.starts(&bench.stage(), &bench.shots);
        assert!(!starts.is_empty(), "{}", effect.name());
        let mut felt = false;
        for values in starts {
            assert_eq!(values.len(), effect.parameters().len(), "{}", effect.name());
            for (value, parameter) in values.iter().zip(effect.parameters()) {
                assert!(
                    (parameter.min..=parameter.max).contains(value),
                    "{} {}",
                    effect.name(),
                    parameter.name
                );
            }
            // A search may begin from nothing, where a step must be felt.
            let is_absent =
                values.iter().zip(effect.parameters()).all(|(v, parameter)| *v == parameter.absent);
            let steps = effect
                .parameters()
                .iter()
                .map(|parameter| if is_absent { parameter.step } else { 0.0 });
            let there = values.iter().zip(steps).map(|(value, step)| value + step).collect();
            felt |= bench.predict(vec![(effect, there)]) != bare;
        }
        assert!(felt, "{}", effect.name());
    }
}

#[test]
fn no_beam_widens_a_lobe_that_includes_one() {
    let law = Brdf::CookTorrance(CookTorrance { m: 0.004, ..lobe() });
    let bench = Bench { law, ..Bench::plate() };
    let (own_stage, receiver) = (bench.stage(), Receiver::LINEAR);
    let stage = Stage { seen_lobe_rad: &[Some(f64::INFINITY)], ..own_stage };
    for name in [None, Some("finite-spot")] {
        let effect = name.and_then(find).map(|effect| (effect as &dyn Effect, vec![0.016]));
        let laws = vec![bench.law.clone()];
        let model = Model { laws, receiver, effects: Vec::from_iter(effect), level: 1.0 };
        let echoes = |stage| model.predict(stage, &bench.shots).arrived;
        let (own, with_beam) = (echoes(&own_stage), echoes(&stage));
        // The shot at the middle of the plate meets it at normal incidence.
        let middle = bench.shots.iter().position(|shot| shot.hit.cos_theta > 1.0 - 1e-9).unwrap();
        let ratio = with_beam[middle].unwrap().power_w / own[middle].unwrap().power_w;
        let v = bench.shots[middle].to_radar();
        let beam_rad = own_stage.beam(&bench.shots[middle]).divergence_rad();
        let expected = bench.law.f_per_sr(v, v) / bench.law.seen_by(beam_rad, v, v).f_per_sr;
        assert!(expected > 4.0, "{expected}");
        // Off the axis of a spot the narrow lobe falls more.
        let least = if name.is_none() { expected * (1.0 - 1e-9) } else { 1.0 };
        assert!((least..expected * (1.0 + 1e-9)).contains(&ratio), "{name:?}: {ratio}");
    }
}

#[test]
fn names_and_parameters_are_unique() {
    let names = library().map(|effect| effect.name());
    for (position, effect) in library().into_iter().enumerate() {
        assert_eq!(names.iter().position(|name| *name == effect.name()), Some(position));
        for parameter in effect.parameters() {
            assert!(
                (parameter.min..=parameter.max).contains(&parameter.absent) && parameter.step > 0.0
            );
            assert_eq!(
                effect.parameters().iter().filter(|other| other.name == parameter.name).count(),
                1
            );
        }
    }
}

/// To first order in a step, twists are what the motion does.
#[test]
fn twists_are_the_slopes_of_the_motion() {
    const STEP: f64 = 1e-3;
    let bench = Bench::plate();
    let (stage, shot) = (bench.stage(), Shot { progress: 0.3, ..bench.shots[7] });
    let mut moving = 0;
    for effect in library().into_iter().filter(|effect| effect.moves()) {
        let parameters = effect.parameters();
        let values: Vec<f64> = parameters.iter().map(|parameter| 2.0 * parameter.step).collect();
        let here = effect.motion(&values, &stage, &shot).unwrap() * shot.hit.point;
        let twists = effect.twists(&values, &stage, &shot);
        assert_eq!(twists.len(), parameters.len(), "{}", effect.name());
        for (number, (parameter, twist)) in parameters.iter().zip(&twists).enumerate() {
            let ends = [STEP, -STEP].map(|by| {
                let mut there = values.clone();
                there[number] += by * parameter.step;
                (effect.motion(&there, &stage, &shot).unwrap() * shot.hit.point).xyz
            });
            let slope = (ends[0] - ends[1]) / (2.0 * STEP * parameter.step);
            let off = (slope - way_m(twist, stage.middle, here.xyz)).length();
            assert!(off < 1e-8, "{} {}: {off}", effect.name(), parameter.name);
        }
        moving += 1;
    }
    assert_eq!(moving, 2);
}
