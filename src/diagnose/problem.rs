//! The data of a diagnosis and their likelihood under a model, with its slopes by every unknown.

use nalgebra::DVector;
use rayon::prelude::*;

use super::alarms::Alarms;
use super::level::MOST_OFF_DB;
use super::likelihood::{Likelihood, Term};
use super::observation::{DB, Observation, ReceiverLimits};
use super::shared::SharedSpeckle;
use super::space::Space;
use super::views::Views;
use crate::effects::{
    Ceiling, Effect, Model, Prediction, PredictionCache, Receiver, Shot, Stage, Twist,
};
use crate::fit::minimise::Local;

/// Shift, m, and turn, deg, of the target in a difference quotient, per step of an effect's parameter.
const TWIST_STEP: Twist = [2e-3, 2e-3, 2e-3, 0.5, 0.5, 0.5];
/// Step of a difference quotient by an effect's parameter, in steps of the parameter.
pub(super) const EFFECT_STEP: f64 = 0.25;
/// Chirps of a sample; more take time and add little.
pub(super) const ENOUGH: usize = 2500;

/// The data of a diagnosis.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    /// The scans: one, or several of one target.
    pub views: &'a Views<'a>,
    /// The shots, scan after scan.
    pub shots: &'a [Shot],
    pub observations: &'a [Observation],
    pub declared: ReceiverLimits,
    pub receiver: Receiver,
    /// What the chirps of each scan report that see no target.
    pub alarms: &'a [Alarms],
    /// How much of its speckle each shot has to itself.
    pub shared: &'a SharedSpeckle,
    /// Rays already traced for these shots, by their scan.
    pub traced: &'a [PredictionCache],
}

/// Caches for the shots of some scans.
pub(super) fn caches(scans: usize) -> Vec<PredictionCache> {
    (0..scans).map(|_| PredictionCache::default()).collect()
}

impl<'a> Problem<'a> {
    /// The stage of a shot.
    pub fn stage(&self, shot: &Shot) -> &'a Stage<'a> {
        self.views.stage(shot)
    }

    /// Where the searches for an effect start.
    pub fn starts(&self, effect: &dyn Effect) -> Vec<Vec<f64>> {
        effect.starts(&self.views.stages[0], self.shots)
    }

    /// What the models of the scans predict, scan after scan. They have one receiver. `predict` is for the shots of one scan.
    fn predict_by<'m>(
        &self,
        model: impl Fn(u16) -> Model<'m>,
        predict: impl Fn(&Model, &Stage, &[Shot], &PredictionCache) -> Vec<Prediction>,
    ) -> Vec<Prediction> {
        let mut all: Vec<Prediction> = Vec::new();
        for shots in self.shots.chunk_by(|a, b| a.scan == b.scan) {
            let scan = shots[0].scan;
            let traced = &self.traced[usize::from(scan)];
            let part = predict(&model(scan), self.stage(&shots[0]), shots, traced);
            if all.is_empty() {
                all = part;
                continue;
            }
            for (all, part) in all.iter_mut().zip(part) {
                all.arrived.extend(part.arrived);
                all.tilts.extend(part.tilts);
            }
        }
        all
    }

    /// Effective number of independent shots.
    pub fn independent_shots(&self) -> f64 {
        self.shared.count(self.shots.len())
    }

    /// The prediction of a point.
    pub fn predict(&self, space: &Space, at: &DVector<f64>) -> Prediction {
        let model = |scan| space.model(self.receiver, at, scan);
        let predict = |model: &Model, stage: &Stage, shots: &[Shot], traced: &PredictionCache| {
            vec![model.predict_with(stage, shots, traced)]
        };
        let predicted = self.predict_by(model, predict).pop();
        // Without shots.
        predicted.unwrap_or_else(|| model(0).predict(&self.views.stages[0], self.shots))
    }

    /// The part of every chirp in the likelihood of a point.
    pub fn terms(&self, space: &Space, at: &DVector<f64>) -> Vec<Term> {
        self.terms_of(&self.predict(space, at))
    }

    /// ln likelihood of a point, less what the scale of the laws takes ([`Space::prior`]).
    pub fn ln_likelihood(&self, space: &Space, at: &DVector<f64>) -> f64 {
        ln_likelihood(&self.terms(space, at)) + self.beside(space, at)
    }

    /// What is added to ln p of the shots: of the chirps that see no target, less what the scale of the laws takes.
    pub fn beside(&self, space: &Space, at: &DVector<f64>) -> f64 {
        self.ln_p_of_alarms(space, at) - space.prior(at).value
    }

    /// ln likelihood of the chirps that see no target.
    pub fn ln_p_of_alarms(&self, space: &Space, at: &DVector<f64>) -> f64 {
        let receiver = space.received(self.receiver, at);
        self.alarms.iter().map(|alarms| alarms.ln_p(&receiver, self.declared)).sum()
    }

    /// −[`Problem::beside`] near a point. Only effects on the receiver change false alarms, by their own unknowns.
    pub fn local_beside(
        &self,
        space: &Space,
        at: &DVector<f64>,
        [lower, upper]: [&DVector<f64>; 2],
    ) -> Local {
        let mut local = space.prior(at);
        let here = self.ln_p_of_alarms(space, at);
        local.value -= here;
        let moving = space.moving();
        for index in (space.base_len()..at.len()).filter(|index| !moving.contains(index)) {
            let ends = [EFFECT_STEP, -EFFECT_STEP].map(|by| {
                let mut there = at.clone();
                there[index] = (at[index] + by).clamp(lower[index], upper[index]);
                (there[index], self.ln_p_of_alarms(space, &there))
            });
            let [(more, ln_more), (less, ln_less)] = ends;
            if more > less && (ln_more != here || ln_less != here) {
                local.gradient[index] -= (ln_more - ln_less) / (more - less);
                let bend = (2.0 * here - ln_more - ln_less) / (0.5 * (more - less)).powi(2);
                local.curvature[(index, index)] += bend.max(0.0);
            }
        }
        local
    }

    /// The space with the level of every radar that is not calibrated.
    pub fn with_levels<'s>(&self, mut space: Space<'s>) -> Space<'s> {
        let (instruments, mut levels) = (self.views.instruments(), Vec::new());
        let mut level_of_scan: Vec<Option<usize>> = Vec::new();
        for (scan, &first) in instruments.iter().enumerate() {
            let level = if first < scan {
                level_of_scan[first]
            } else if self.views.stages[scan].geometry.radar.calibrated {
                None
            } else {
                levels.push(self.ln_level(&space, |other| instruments[other] == first));
                Some(levels.len() - 1)
            };
            level_of_scan.push(level);
        }
        (space.ln_levels, space.level_of_scan) = (levels, level_of_scan);
        space
    }

    /// ln of the level at which most detections of some scans are as strong as the stored laws have them.
    fn ln_level(&self, space: &Space, is_of_it: impl Fn(usize) -> bool) -> f64 {
        let prediction = self.predict(space, &space.start());
        let mut off: Vec<f64> = (0..self.shots.len())
            .filter(|&shot| is_of_it(usize::from(self.shots[shot].scan)))
            .filter_map(|shot| Some((self.observations[shot].power_w?, prediction.mean_w(shot))))
            .filter(|(_, mean_w)| *mean_w > 0.0)
            .map(|(power_w, mean_w)| (power_w / mean_w).ln())
            .collect();
        let middle = off.len() / 2;
        if off.is_empty() {
            return 0.0;
        }
        let (_, median, _) = off.select_nth_unstable_by(middle, f64::total_cmp);
        median.clamp(-MOST_OFF_DB / DB, MOST_OFF_DB / DB)
    }

    fn terms_of(&self, prediction: &Prediction) -> Vec<Term> {
        Likelihood::new(prediction, self.declared, self.shared).terms(self.observations)
    }

    /// Slopes of every shot by every unknown: forward differences for scattering models, which are
    /// smooth, and central ones over wide steps for effects, which facets make rough.
    pub fn slopes(
        &self,
        space: &Space,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        here: &[Term],
    ) -> Vec<Vec<Slope>> {
        self.slopes_over(EFFECT_STEP, space, at, bounds, here)
    }

    /// [`Problem::slopes`] with another step of the effects' parameters.
    pub fn slopes_over(
        &self,
        effect_step: f64,
        space: &Space,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        here: &[Term],
    ) -> Vec<Vec<Slope>> {
        // Level and scale of the laws do nearly the same, and the difference between their slopes is what a search follows.
        // That of ln p by a step to one side errs by more; by way of the mean it does not, where laws change nothing else.
        let receiver = space.received(self.receiver, at);
        let is_plain = receiver.tilt_sd_rad == 0.0 && receiver.ceiling == Ceiling::NONE;
        let is_free = |index: usize| bounds[0][index] < bounds[1][index];
        // Unknowns that move the target share the slopes by small shifts and turns of it.
        let moving: Vec<usize> = space.moving();
        let twists = if moving.iter().any(|&index| is_free(index)) {
            space.twists(at, self.views, self.shots)
        } else {
            Vec::new()
        };
        let by_axis = self.slopes_by_twist(effect_step, space, at, &twists);
        (0..at.len())
            .into_par_iter()
            .map(|index| {
                if !is_free(index) {
                    return vec![Slope::default(); self.shots.len()];
                }
                if let Some(number) = moving.iter().position(|moving| *moving == index) {
                    return along_twists(&by_axis, &twists, number);
                }
                let is_law = index < space.base_len();
                let difference = space.difference(at, bounds, index, effect_step, !is_plain);
                let [more, less] = difference.ends.map(|there| {
                    if there == *at { here.to_vec() } else { self.terms(space, &there) }
                });
                let mut slopes = quotients(&more, &less, difference.width);
                if is_law && is_plain {
                    for (slope, term) in slopes.iter_mut().zip(here) {
                        slope.ln_p = term.slope * slope.ln_mean
                            + term.looks_slope * slope.ln_looks
                            + slope.ln_range;
                    }
                }
                slopes
            })
            .collect()
    }

    /// Slopes of every shot by a shift of the target along each axis, per m, and by a turn about it, per deg; none where no
    /// shot moves in this way.
    fn slopes_by_twist(
        &self,
        effect_step: f64,
        space: &Space,
        at: &DVector<f64>,
        twists: &[Vec<Twist>],
    ) -> [Vec<Slope>; 6] {
        let moves = |axis: &usize| twists.iter().flatten().any(|twist| twist[*axis] != 0.0);
        let axes: Vec<usize> = (0..6).filter(moves).collect();
        if axes.is_empty() {
            return Default::default();
        }
        let mut ends: Vec<Twist> = Vec::new();
        for &axis in &axes {
            for sign in [1.0, -1.0] {
                let mut twist = Twist::default();
                twist[axis] = sign * effect_step * TWIST_STEP[axis];
                ends.push(twist);
            }
        }
        let predictions = self.predict_by(
            |scan| space.model(self.receiver, at, scan),
            |model, stage, shots, traced| model.predict_twisted(stage, shots, &ends, traced),
        );
        let mut slopes: [Vec<Slope>; 6] = Default::default();
        let of_axes: Vec<Vec<Slope>> = predictions
            .par_chunks_exact(2)
            .zip(&axes)
            .map(|(ends, &axis)| {
                let [more, less] = [0, 1].map(|end| self.terms_of(&ends[end]));
                quotients(&more, &less, 2.0 * effect_step * TWIST_STEP[axis])
            })
            .collect();
        for (axis, of_axis) in axes.into_iter().zip(of_axes) {
            slopes[axis] = of_axis;
        }
        slopes
    }

    /// Slopes of ln mean before the receiver by every unknown that changes it. Unlike [`Term::ln_mean`]
    /// they do not depend on the observations.
    pub fn mean_slopes(&self, space: &Space, at: &DVector<f64>) -> Vec<Vec<f64>> {
        let [lower, upper] = space.bounds();
        let mut all = Vec::new();
        // The scale of the laws stands for the level of one radar, too.
        let is_free = space.level_of_scan.iter().all(Option::is_some);
        let others = space.level_index(0).filter(|level| *level > 0 && is_free);
        for index in (0..at.len()).filter(|index| Some(*index) != others) {
            let difference = space.difference(at, [&lower, &upper], index, EFFECT_STEP, false);
            let [more, less] = difference.ends.map(|end| self.ln_means(space, &end));
            let width = difference.width.max(f64::MIN_POSITIVE);
            let slopes: Vec<f64> = more.iter().zip(less).map(|(a, b)| (a - b) / width).collect();
            if slopes.iter().any(|slope| *slope != 0.0) {
                all.push(slopes);
            }
        }
        all
    }

    /// ln of the mean power of every shot before the receiver.
    fn ln_means(&self, space: &Space, at: &DVector<f64>) -> Vec<f64> {
        let prediction = self.predict(space, at);
        (0..self.shots.len())
            .map(|shot| prediction.mean_w(shot).max(f64::MIN_POSITIVE).ln())
            .collect()
    }
}

/// Slopes of one shot by one unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slope {
    pub ln_p: f64,
    /// The part of the range in it.
    pub ln_range: f64,
    pub ln_mean: f64,
    pub ln_looks: f64,
    pub range_m: f64,
}

/// Slopes of every shot by one of the unknowns that move the target, from those by shifts and turns.
fn along_twists(by_axis: &[Vec<Slope>; 6], twists: &[Vec<Twist>], number: usize) -> Vec<Slope> {
    let of_shot = |(shot, twists): (usize, &Vec<Twist>)| {
        let axes = by_axis.iter().zip(twists[number]).filter(|(_, by)| *by != 0.0);
        let parts = axes.map(|(slopes, by)| slopes[shot].times(by));
        parts.fold(Slope::default(), Slope::plus)
    };
    twists.iter().enumerate().map(of_shot).collect()
}

impl Slope {
    fn plus(self, other: Slope) -> Slope {
        Slope {
            ln_p: self.ln_p + other.ln_p,
            ln_range: self.ln_range + other.ln_range,
            ln_mean: self.ln_mean + other.ln_mean,
            ln_looks: self.ln_looks + other.ln_looks,
            range_m: self.range_m + other.range_m,
        }
    }

    fn times(self, by: f64) -> Slope {
        Slope {
            ln_p: by * self.ln_p,
            ln_range: by * self.ln_range,
            ln_mean: by * self.ln_mean,
            ln_looks: by * self.ln_looks,
            range_m: by * self.range_m,
        }
    }
}

/// Slopes of all shots from their terms at two points a distance `width` apart; zero where that is zero.
fn quotients(more: &[Term], less: &[Term], width: f64) -> Vec<Slope> {
    let per_width = if width > 0.0 { 1.0 / width } else { 0.0 };
    let pairs = more.iter().zip(less);
    let slopes = pairs.map(|(a, b)| Slope {
        ln_p: a.ln_p - b.ln_p,
        ln_range: a.ln_range - b.ln_range,
        ln_mean: a.ln_mean - b.ln_mean,
        ln_looks: a.ln_looks - b.ln_looks,
        range_m: a.range_m - b.range_m,
    });
    slopes.map(|slope| slope.times(per_width)).collect()
}

/// ln likelihood.
pub(super) fn ln_likelihood(terms: &[Term]) -> f64 {
    terms.iter().map(|term| term.ln_p).sum()
}

/// Equally spaced shots of a scan.
pub(super) struct Sample {
    shots: Vec<Shot>,
    observations: Vec<Observation>,
    alarms: Vec<Alarms>,
    shared: SharedSpeckle,
    traced: Vec<PredictionCache>,
    /// Shots of the scan per shot of the sample.
    pub weight: f64,
}

impl Sample {
    /// A sample of about `count` shots of a problem.
    pub fn new(problem: &Problem, count: usize) -> Sample {
        let every = (problem.shots.len() / count).max(1);
        let shots: Vec<Shot> = problem.shots.iter().step_by(every).copied().collect();
        let observations = problem.observations.iter().step_by(every).copied().collect();
        let weight = problem.shots.len() as f64 / shots.len().max(1) as f64;
        let (shared, traced) = (problem.shared.step_by(every), caches(problem.traced.len()));
        let alarms = problem.alarms.iter().map(|alarms| alarms.beside_sample(every)).collect();
        Sample { shots, observations, alarms, shared, traced, weight }
    }

    /// The problem of the sample alone.
    pub fn problem<'a>(&'a self, whole: &Problem<'a>) -> Problem<'a> {
        let Sample { shots, observations, alarms, shared, traced, .. } = self;
        Problem { shots, observations, alarms, shared, traced, ..*whole }
    }
}
