//! What a model is worth: its score on patches of the scan that took no part in its fit, and the structure
//! that it leaves unexplained.

use nalgebra::DVector;

use super::covariates::covariates;
use super::field::{Field, Model, Structure, scaled, terms};
use super::folds::Folds;
use super::optima;
use super::order;
use super::problem::{Problem, Sample};
use super::refit::{Fit, SCOUT, SEARCH};
use super::residual::{self, ResidualStructure, scatter_db};
use super::score::{Errors, Score, errors, scores};
use super::settings::Diagnosis;
use super::shared::SharedSpeckle;
use super::size::Size;
use super::space::Space;
use super::waves;
use crate::effects::{Prediction, Receiver};

/// Share of the largest effect's size below which structure may be an error of that effect's form.
pub(super) const SHARE_OF_FORM: f64 = 0.25;
/// Standard errors by which a field's held-out gain must exceed zero.
const FIELD_ERRORS: f64 = 3.0;
/// Probability by chance below which the correlation of neighbours counts.
const CHANCE: f64 = 1e-3;
/// Difference in ln likelihood within which two fits have found the same optimum.
const SAME_OPTIMUM: f64 = 0.5;
/// Most looks in the first fit of the base, which starts far from the data, and in the test whether the data are
/// of the right target.
const WIDE_LOOKS: f64 = 4.0;

/// Judges models on held-out patches.
#[derive(Clone, Copy)]
pub(super) struct Scorer<'p> {
    pub problem: Problem<'p>,
    pub folds: &'p Folds,
    pub settings: &'p Diagnosis,
}

/// A model, fitted to all shots, with its held-out scores.
#[derive(Clone)]
pub(super) struct State<'a> {
    pub space: Space<'a>,
    pub fit: Fit,
    /// Scores by fits without each fold.
    pub held_out: HeldOut,
}

/// What a model says of data that took no part in its fit.
#[derive(Clone, Default)]
pub(super) struct HeldOut {
    /// Score of every shot by a fit without its fold.
    pub shots: Vec<Score>,
    /// ln p of the chirps that see no target. They take part in every fit, of one number that any four fifths of them
    /// tell as well.
    pub alarms: f64,
}

impl Scorer<'_> {
    /// ln likelihood, less how far the laws are from those stored, and Schwarz's penalty for every number of the effects (Ann.
    /// Stat. 6 (1978) 461), of as many observations as patches are held out. It compares models that predict equally well.
    pub fn worth(&self, state: &State) -> f64 {
        let State { space, fit, .. } = state;
        let numbers = (fit.at.len() - space.base_len()) as f64;
        let penalty = 0.5 * numbers * (self.folds.blocks.max(1) as f64).ln();
        fit.ln_likelihood - space.off_the_stored(&fit.at) - penalty
    }

    /// A fitted model with its held-out scores.
    pub fn state<'a>(&self, space: Space<'a>, fit: Fit) -> State<'a> {
        let held_out = self.held_out(&space, &fit.at);
        State { space, fit, held_out }
    }

    /// The model without effects. It is searched from the stored laws, and from the best of all shapes of each, on a
    /// sample.
    pub fn base<'a>(&self, sample: &Sample, space: Space<'a>) -> State<'a> {
        let space = self.problem.with_levels(space);
        let receiver = with_wide_speckle(self.problem.receiver);
        let wide = Problem { receiver, ..sample.problem(&self.problem) };
        let near = wide.fit(&space, &space.start(), &[], &SEARCH).at;
        let elsewhere = optima::elsewhere(&wide, &space, &near);
        let found = elsewhere.iter().map(|start| wide.fit(&space, start, &[], &SEARCH).at);
        // The scene's own scattering models may fit better, as to a cloud without speckle that it rendered.
        let starts = found.chain([near, space.start()]);
        // Lobes in each other's place may predict as well.
        let worth = |at: &DVector<f64>| self.problem.ln_likelihood(&space, at) - space.against(at);
        let fits = starts.map(|start| (worth(&start), start));
        let best = fits.max_by(|a, b| a.0.total_cmp(&b.0));
        let start = best.map_or(space.start(), |(_, start)| start);
        let fit = self.problem.fit(&space, &start, &[], &SEARCH);
        self.state(space, fit)
    }

    /// The base refitted from where the laws are beside the effects of a model, if that is likelier: the base then was
    /// not at its optimum, and whatever moves it looks like an effect.
    pub fn better_base<'a>(&self, base: &State<'a>, with: &State<'a>) -> Option<State<'a>> {
        let laws = with.fit.at.rows(0, with.space.base_len()).into_owned();
        let fit = self.problem.fit(&base.space, &laws, &[], &SEARCH);
        let worth = |fit: &Fit| fit.ln_likelihood - base.space.against(&fit.at);
        let is_better = worth(&fit) > worth(&base.fit) + SAME_OPTIMUM;
        is_better.then(|| self.state(base.space.clone(), fit))
    }

    /// A model, refitted from where it is.
    pub fn again<'a>(&self, state: &State<'a>) -> State<'a> {
        let fit = self.problem.fit(&state.space, &state.fit.at, &[], &SEARCH);
        self.state(state.space.clone(), fit)
    }

    /// The model without one of its effects, refitted.
    pub fn without<'a>(&self, state: &State<'a>, index: usize) -> State<'a> {
        let (space, start) = state.space.without(&state.fit.at, index);
        let fit = self.problem.fit(&space, &start, &[], &SEARCH);
        self.state(space, fit)
    }

    /// The model with an effect that is accepted, refitted with everything free that its trial kept fixed.
    pub fn settle<'a>(
        &self,
        before: &State,
        space: Space<'a>,
        mut fit: Fit,
        mut held_out: HeldOut,
    ) -> State<'a> {
        if !before.space.costly(&before.fit.at).is_empty() {
            fit = self.problem.fit(&space, &fit.at, &[], &SCOUT);
            held_out = self.held_out(&space, &fit.at);
        }
        // Scattering models fitted without the effect may be far from those that fit best with it.
        let (start, held) = (space.restarted(&fit.at), space.costly(&fit.at));
        let again = self.problem.fit(&space, &start, &held, &SEARCH);
        // A law far from the stored one may be as likely as a near one, or hardly likelier.
        let nearer = space.against(&fit.at) - space.against(&again.at);
        let gain = again.ln_likelihood - fit.ln_likelihood + nearer;
        let has_arrived = again.converged && !fit.converged;
        if gain > SEARCH.tolerance || gain >= -SEARCH.tolerance && has_arrived {
            fit = if held.is_empty() {
                again
            } else {
                self.problem.fit(&space, &again.at, &[], &SCOUT)
            };
            held_out = self.held_out(&space, &fit.at);
        }
        State { space, fit, held_out }
    }

    /// Score of every shot by a fit without its fold.
    pub fn held_out(&self, space: &Space, at: &DVector<f64>) -> HeldOut {
        self.held_out_of(space, at, &[], &[])
    }

    /// The same where the unknowns numbered in `held` stay.
    pub fn held_out_but(&self, space: &Space, at: &DVector<f64>, held: &[usize]) -> HeldOut {
        self.held_out_of(space, at, held, &[])
    }

    /// Held-out scores with factors on the means, given by their logarithms.
    pub fn held_out_with(&self, space: &Space, at: &DVector<f64>, ln_factor: &[f64]) -> HeldOut {
        self.held_out_of(space, at, &[], ln_factor)
    }

    fn held_out_of(
        &self,
        space: &Space,
        at: &DVector<f64>,
        held: &[usize],
        ln_factor: &[f64],
    ) -> HeldOut {
        let mut all: Vec<(usize, Score)> = Vec::new();
        let fits = self.problem.fit_without(space, at, held, self.folds);
        for (fold, at) in fits.enumerate() {
            let prediction = scaled(self.problem.predict(space, &at), ln_factor);
            let is_held_out = |shot| self.folds.holds_out(fold, shot);
            all.extend(scores(&self.problem, &prediction, is_held_out));
        }
        all.sort_by_key(|(shot, _)| *shot);
        let shots = all.into_iter().map(|(_, score)| score).collect();
        HeldOut { shots, alarms: self.problem.ln_p_of_alarms(space, at) }
    }

    /// Gain in ln p of the chirps that see no target, by a model with more effects.
    pub fn gain_of_alarms(&self, state: &State, space: &Space, at: &DVector<f64>) -> f64 {
        let before = self.problem.ln_p_of_alarms(&state.space, &state.fit.at);
        self.problem.ln_p_of_alarms(space, at) - before
    }

    /// Difference in ln p, and its standard error. A gain of g by one number has that of √2g.
    pub fn difference(&self, a: &HeldOut, b: &HeldOut) -> [f64; 2] {
        let pairs = a.shots.iter().zip(&b.shots);
        let differences: Vec<f64> = pairs.map(|(a, b)| a.ln_p - b.ln_p).collect();
        let [sum, se] = self.folds.sum(&differences);
        let of_alarms = a.alarms - b.alarms;
        [sum + of_alarms, se.hypot((2.0 * of_alarms.abs()).sqrt())]
    }

    /// Errors of held-out scores.
    pub fn errors(&self, held_out: &HeldOut) -> Errors {
        errors(&held_out.shots, self.folds)
    }

    /// Whether held-out errors grow by more than their standard error.
    pub fn is_farther_off(&self, now: &HeldOut, before: &HeldOut) -> bool {
        let [now, before] = [now, before].map(|scores| self.errors(scores));
        now.rmse_db > before.rmse_db + now.rmse_se_db
    }

    /// The prediction of a model.
    pub fn predict(&self, state: &State) -> Prediction {
        self.problem.predict(&state.space, &state.fit.at)
    }

    /// Change of the data by a model with more effects.
    pub fn size(&self, state: &State, space: &Space, at: &DVector<f64>) -> Size {
        let Problem { observations, alarms, declared, .. } = self.problem;
        let [before, after] = [self.predict(state), self.problem.predict(space, at)];
        let size = Size::of(observations, &before, &after);
        let receivers = [&before.receiver, &after.receiver];
        let of_alarms = alarms.iter().map(|alarms| alarms.size_db(receivers, declared));
        let of_alarms_db = of_alarms.fold(0.0, f64::max);
        Size { mean_db: size.mean_db.max(of_alarms_db), ..size }
    }

    /// Randomised quantile residual of every shot.
    pub fn z(&self, prediction: &Prediction) -> Vec<f64> {
        let Problem { declared, observations, .. } = self.problem;
        residual::z(prediction, declared, observations, self.settings.seed)
    }

    /// The residual that neighbours share.
    pub fn shared(&self, prediction: &Prediction, z: &[f64]) -> ResidualStructure {
        let sd_db = scatter_db(prediction);
        let spot_m = self.spot_m();
        let from_m = spot_m.max(self.problem.shared.reach_m);
        let sum_of = |products: &[f64]| {
            if self.problem.shared.is_any() {
                self.folds.sum_over_patches(products)
            } else {
                self.folds.sum(products)
            }
        };
        residual::of_neighbours(z, self.problem.shots, [from_m, spot_m], sd_db, sum_of)
    }

    /// The swing of residuals with the chirp number.
    pub fn swing(&self, prediction: &Prediction, z: &[f64]) -> Option<ResidualStructure> {
        let Problem { shots, shared, .. } = self.problem;
        let sd_db = scatter_db(prediction);
        let (mut from, mut found) = (0, None::<ResidualStructure>);
        for shots in shots.chunk_by(|a, b| a.scan == b.scan) {
            let swing = order::swing(&z[from..from + shots.len()], shots, shared, sd_db);
            from += shots.len();
            found = found
                .into_iter()
                .chain(swing)
                .max_by(|a, b| a.strength_db.total_cmp(&b.strength_db));
        }
        found
    }

    /// The waves of residuals over the target plane.
    pub fn waves(&self, prediction: &Prediction, z: &[f64]) -> Option<ResidualStructure> {
        waves::waves(z, self.problem.shots, self.spot_m(), scatter_db(prediction))
    }

    /// The structure too fine for a field that neighbours in place or in time share beside a model, dB; 0 where chance
    /// explains it.
    pub fn fine_structure_db(&self, state: &State) -> f64 {
        let prediction = self.predict(state);
        let z = self.z(&prediction);
        let neighbours = Some(self.shared(&prediction, &z)).filter(|one| one.p_value < CHANCE);
        let found = neighbours
            .into_iter()
            .chain(self.swing(&prediction, &z))
            .chain(self.waves(&prediction, &z));
        found.map(|one| one.strength_db).fold(0.0, f64::max)
    }

    /// The speckle that shots share beside a model.
    pub fn shared_speckle(&self, state: &State) -> SharedSpeckle {
        let z = self.z(&self.predict(state));
        SharedSpeckle::of(&z, self.problem.observations, self.problem.shots, self.spot_m())
    }

    /// Diameter of the largest spot, m.
    fn spot_m(&self) -> f64 {
        let spots_m = self.problem.views.stages.iter().map(|s| s.geometry.radar.spot_fwhm_m());
        spots_m.fold(0.0, f64::max)
    }

    /// The structure that a field finds beside a model.
    pub fn structure(&self, state: &State) -> Structure {
        let problem = &self.problem;
        let prediction = &self.predict(state);
        let covariates = covariates(problem.shots, prediction, problem.observations);
        let slopes = &problem.mean_slopes(&state.space, &state.fit.at);
        let model = Model { problem, prediction, slopes };
        Field::new(problem.shots, &covariates).structure(model, self.folds)
    }

    /// Whether the structure of a field exceeds chance and a possible error of the form of the largest effect.
    pub fn is_structured(&self, structure: &Structure, largest_db: f64) -> bool {
        let [gain, se] = structure.gain;
        gain > FIELD_ERRORS * se && structure.size_db >= self.least_structure_db(largest_db)
    }

    /// Whether the residual that neighbours share exceeds chance and a possible error of the form of the largest
    /// effect.
    pub fn is_shared(&self, neighbours: &ResidualStructure, largest_db: f64) -> bool {
        neighbours.p_value < CHANCE && neighbours.strength_db >= self.least_structure_db(largest_db)
    }

    /// Structure that counts beside a largest effect of this size, dB.
    pub fn least_structure_db(&self, largest_db: f64) -> f64 {
        self.settings.least_structure_db.max(SHARE_OF_FORM * largest_db)
    }

    /// ln likelihood of a fit with the means corrected by a field.
    pub fn ln_likelihood_with(&self, space: &Space, fit: &Fit, structure: &Structure) -> f64 {
        let prediction = self.problem.predict(space, &fit.at);
        let terms = terms(&self.problem, &prediction, &structure.ln_factor);
        let of_shots: f64 = terms.iter().map(|term| term.ln_p).sum();
        of_shots + self.problem.beside(space, &fit.at)
    }
}

/// The receiver with much speckle, under which no shot of the right target is far off.
pub(super) fn with_wide_speckle(receiver: Receiver) -> Receiver {
    let looks = receiver.looks.min(WIDE_LOOKS);
    Receiver { looks, most_looks: looks, ..receiver }
}
