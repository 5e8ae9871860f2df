//! Detections of chirps that miss the target, but not by far: echoes that a wide spot sees past an edge, or false alarms.
//!
//! False alarms are spread evenly along the rays. Echoes past an edge lie as near to the target as the spot is wide. So the
//! shells about the target count as its neighbourhood up to the one beyond which there are no more detections than
//! false alarms elsewhere in the gate would make.

use glam::DVec3;
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF};

use super::alarms::Alarms;
use crate::effects::Shot;
use crate::frames::{Global, Ray};
use crate::measure::nearest::Nearest;

/// Outer radii of the shells about the target, m; the last is the largest distance of a detection from its target.
pub(super) const SHELLS_M: [f64; 5] = [0.02, 0.04, 0.06, 0.08, GATE_M];
/// Largest distance of a detection from where its chirp meets the target, m.
pub(super) const GATE_M: f64 = 0.1;
/// Probability below which so many detections in the outer shells are no chance.
const NO_CHANCE: f64 = 1e-3;

/// A detection of a chirp that misses the target, on its chirp's ray and near the target.
pub(super) struct Beside {
    pub shot: Shot,
    pub range_m: f64,
    pub power_w: f64,
    /// Distance from the nearest place where a chirp meets the target, m.
    pub off_m: f64,
    /// Whether noise may have made it.
    pub may_be_alarm: bool,
}

/// Lengths of rays within each of the shells and all inside it, on average, m.
pub(super) fn lengths_near_m(
    missing: &[&Ray<Global>],
    shots: &[Shot],
    target: Option<&Nearest>,
) -> [f64; SHELLS_M.len()] {
    /// Places that are tried on each ray.
    const PLACES: usize = 32;
    let Some(target) = target else { return [0.0; SHELLS_M.len()] };
    let ranges_m = shots.iter().map(|shot| shot.hit.range_m);
    let from_m = ranges_m.clone().fold(f64::INFINITY, f64::min) - GATE_M;
    let step_m = (ranges_m.fold(0.0, f64::max) + GATE_M - from_m) / PLACES as f64;
    let offs_m = missing.par_iter().flat_map_iter(|ray| {
        let at_m = |step: usize| from_m + (step as f64 + 0.5) * step_m;
        let place =
            move |step: usize| -> DVec3 { ray.origin.xyz + at_m(step) * ray.direction.xyz() };
        (0..PLACES).map(move |step| target.find(place(step)).1)
    });
    let offs_m: Vec<f64> = offs_m.filter(|off_m| *off_m <= GATE_M).collect();
    SHELLS_M.map(|radius_m| {
        let within = offs_m.iter().filter(|off_m| **off_m <= radius_m).count();
        step_m * within as f64 / missing.len().max(1) as f64
    })
}

/// The innermost shell beyond which the detections near a target are as many as the false alarms elsewhere in the gate
/// make; the outermost where the length of the gate is unknown.
pub(super) fn reach(
    beside: &[Beside],
    lengths_m: [f64; SHELLS_M.len()],
    elsewhere: &Alarms,
) -> usize {
    let outermost = SHELLS_M.len() - 1;
    let all_m = lengths_m[outermost];
    let Some(away_m) = elsewhere.gate_m().map(|gate_m| gate_m - all_m).filter(|m| *m > 0.0) else {
        return outermost;
    };
    let is_chance = |shell: &usize| {
        let outer = || beside.iter().filter(|one| one.off_m > SHELLS_M[*shell]);
        let (count, others) = (outer().count() as u64, elsewhere.of_misses.len() as u64);
        let length_m = all_m - lengths_m[*shell];
        outer().all(|one| one.may_be_alarm)
            && !beyond(count, others, length_m / (length_m + away_m))
    };
    (0..outermost).find(is_chance).unwrap_or(outermost)
}

/// Whether `count` detections are more than chance has where `others` lie elsewhere and each is among them with this probability.
fn beyond(count: u64, others: u64, probability: f64) -> bool {
    let law = Binomial::new(probability, count + others);
    count > 0 && law.is_ok_and(|law| law.sf(count - 1) < NO_CHANCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{Chirps, Radar};

    /// As many detections in each of the shells, and this many false alarms elsewhere in a gate of a metre, of which each shell
    /// takes two hundredths.
    fn reached(of_shells: [usize; SHELLS_M.len()], others: usize, may_be_alarm: bool) -> usize {
        let chirps = Chirps::draw(&Radar::default(), |_| Err("no file".to_owned())).unwrap();
        let shot = Shot::missed(&chirps, 0, 0.0);
        let beside = of_shells.iter().zip(SHELLS_M).flat_map(|(count, radius_m)| {
            let one = move |_| Beside {
                shot,
                range_m: 8.0,
                power_w: 1e-9,
                off_m: radius_m - 0.01,
                may_be_alarm,
            };
            (0..*count).map(one)
        });
        let elsewhere = Alarms {
            of_misses: vec![(shot, 8.0); others],
            cells: Some(100.0),
            cell_m: 0.01,
            ..Alarms::default()
        };
        reach(&beside.collect::<Vec<_>>(), [0.02, 0.04, 0.06, 0.08, 0.1], &elsewhere)
    }

    #[test]
    fn detections_near_a_target_are_false_alarms_beyond_where_they_are_more_than_those() {
        assert_eq!(reached([0; 5], 0, true), 0);
        // As many as elsewhere, and some more of a spot that reaches 4 cm.
        assert_eq!(reached([2; 5], 90, true), 0);
        assert_eq!(reached([30, 20, 2, 2, 2], 90, true), 1);
        assert_eq!(reached([30; 5], 90, true), 4);
        // Noise is not so strong.
        assert_eq!(reached([30, 1, 1, 0, 0], 90, false), 2);
        // Two or three at once are chance.
        assert_eq!(reached([0, 1, 1, 0, 0], 0, true), 0);
        assert_eq!(reached([40, 2, 1, 0, 0], 2, true), 0);
    }
}
