//! The steps of a diagnosis.

use super::alarms::{FalseAlarms, beyond_chance};
use super::answer::{self, Column};
use super::choose::{Choice, choose_effects};
use super::contradiction::contradictions;
use super::controls::controls;
use super::error::DiagnoseError;
use super::evidence::Candidate;
use super::folds::Folds;
use super::in_scans::{InScans, for_scans};
use super::matching::{MOST_STRAYS, expected_beside_edge};
use super::optima;
use super::problem::{ENOUGH, Problem, Sample, caches};
use super::remains::{Remainder, find_unexplained};
use super::report::{Controls, Report, SCHEMA, Verdict};
use super::residual;
use super::score::Errors;
use super::scorer::{Scorer, State, with_wide_speckle};
use super::settings::Diagnosis;
use super::shared::ALONE;
use super::space::Space;
use super::subject::Subject;
use super::trial::Search;
use super::views::Views;
use crate::effects::{Effect, family};

/// Multiple of the noise floor beyond which the target is another one: structure that no effect explains leaves less
/// than two.
const MOST_FLOORS: f64 = 3.0;
/// Share of chirps far off the refitted model from which no effect explains them.
const MOST_WILD: f64 = 0.25;

impl Diagnosis {
    /// Diagnoses a scan, trying these effects.
    ///
    /// # Errors
    /// When the data are too few for an answer, or a declaration has no meaning.
    pub fn run(&self, subject: &Subject, effects: &[&dyn Effect]) -> Result<Report, DiagnoseError> {
        self.run_with(subject, effects, &|_| ())
    }

    /// As [`Diagnosis::run`]; `notify` receives a few words about each step.
    ///
    /// # Errors
    /// When the data are too few for an answer, or a declaration has no meaning.
    pub fn run_with(
        &self,
        subject: &Subject,
        effects: &[&dyn Effect],
        notify: &(dyn Fn(&str) + Sync),
    ) -> Result<Report, DiagnoseError> {
        let Subject { stages, laws, receiver, declared, .. } = *subject;
        let Subject { shots, observations, alarms, .. } = *subject;
        let (block_m, folds, seed) = (self.block_m, self.folds, self.seed);
        let views = &Views::new(stages)?;
        let placed = &*views.all_in_first(shots);
        let independent = &Folds::new(placed, block_m, folds, seed);
        subject.check(independent)?;
        let traced = &*caches(stages.len());
        let shared = &ALONE;
        let alone =
            Problem { views, shots, observations, alarms, declared, receiver, shared, traced };
        let scorer = Scorer { problem: alone, folds: independent, settings: self };

        notify("refitting the scattering models");
        let declared_effects = &declared_in_scans(subject.at_work, views);
        let at_work: Vec<(&dyn Effect, Vec<f64>)> = match subject.at_work {
            [one] => one.to_vec(),
            _ => declared_effects.iter().map(|(one, v)| (one as &dyn Effect, v.clone())).collect(),
        };
        let space = Space::new(shots, receiver.looks, laws, &at_work)?;
        let base = scorer.base(&Sample::new(&alone, ENOUGH), space);
        refuse_another_target(&scorer, &base)?;
        let shared = &scorer.shared_speckle(&base);
        let problem = Problem { shared, ..alone };
        let folds = &Folds::of_shared(placed, block_m, folds, seed);
        let folds = if shared.is_any() { folds } else { independent };
        let (scorer, sample) =
            (Scorer { problem, folds, settings: self }, &Sample::new(&problem, ENOUGH));
        let base = if shared.is_any() { scorer.again(&base) } else { base };
        let search = Search { scorer, sample, notify };

        let in_scans = for_scans(effects, views);
        let members: Vec<&dyn Effect> = if stages.len() == 1 {
            effects.iter().flat_map(|effect| family(*effect)).collect()
        } else {
            in_scans.iter().map(|one| one as &dyn Effect).collect()
        };
        let choice = choose_effects(&search, base, &members)?;
        let base = &choice.base;
        let strays = StrayCounts::of(&scorer, subject, &choice.model.state)?;
        refuse_a_poor_fit(&scorer.errors(&choice.model.state.held_out))?;

        let controls = if self.controls {
            notify("controls");
            controls(&search, base, &members, numbers_of_controls(&choice.ranking))
        } else {
            Controls::default()
        };

        notify("testing the remainder");
        Ok(report(subject, &search, &choice, strays, controls))
    }
}

/// Tests what the final model leaves unexplained, and reports everything.
fn report(
    subject: &Subject,
    search: &Search,
    choice: &Choice,
    strays: StrayCounts,
    controls: Controls,
) -> Report {
    let scorer = &search.scorer;
    let Choice { base, model, ranking, structure, hidden, .. } = choice;
    let State { space, fit, held_out } = &model.state;
    let prediction = &scorer.predict(&model.state);
    let [z_before, z] = [&scorer.predict(base), prediction].map(|prediction| scorer.z(prediction));
    let largest_db = model.largest().size_db;
    let structure = Some(structure).filter(|structure| scorer.is_structured(structure, largest_db));
    let strays_left = [strays.off_target, strays.past_the_spot];
    let remainder =
        Remainder { prediction, z: &z, structure, largest_db, strays: strays_left, hidden };
    let unexplained = find_unexplained(scorer, &remainder);
    // Held-out errors without and with the effects, and with the field.
    let errors = [&base.held_out, held_out].map(|held_out| scorer.errors(held_out));
    let with_unknown = structure.map(|structure| {
        scorer.errors(&scorer.held_out_with(space, &fit.at, &structure.ln_factor))
    });
    let unknown = structure.map(|structure| prediction.as_passed(&structure.ln_factor));
    let columns = [Column { state: base, z: &z_before }, Column { state: &model.state, z: &z }];
    let unknown = &unknown.unwrap_or_default();
    let about_optimum = scorer.problem.sd(space, &fit.at, scorer.folds);
    let over_optima = optima::spread(&scorer.problem, search.sample, space, fit);
    let sd: Vec<f64> = about_optimum.iter().zip(over_optima).map(|(a, b)| a.hypot(b)).collect();
    let contradictions = contradictions(scorer, choice);
    let verdict = if contradictions.is_empty() {
        Verdict::new(!model.added.is_empty(), !unexplained.is_empty())
    } else {
        Verdict::Contradictory
    };
    let views = scorer.problem.views;
    Report {
        schema: SCHEMA,
        verdict,
        effects: answer::effects(model, &sd, (subject, views), &unexplained),
        ranking: ranking.clone(),
        unexplained,
        error: answer::before_after(scorer, errors, with_unknown),
        set_aside: subject.strays.iter().map(Vec::len).sum(),
        beside_edge: strays.beside_edge,
        false_alarms: false_alarms(subject, base),
        independent_chirps: scorer.problem.independent_shots(),
        controls,
        clouds: answer::clouds(scorer, base, &model.state, &sd),
        contradictions,
        base: answer::base(subject, &model.state, &sd),
        laws: space.model(subject.receiver, &fit.at, 0).laws,
        rows: answer::rows(subject, views, prediction, scorer.folds, columns, unknown),
    }
}

/// The declared effects of several scans, each on its own scan.
fn declared_in_scans<'a>(
    at_work: &[&[(&'a dyn Effect, Vec<f64>)]],
    views: &'a Views<'a>,
) -> Vec<(InScans<'a>, Vec<f64>)> {
    let mut all = Vec::new();
    for (scan, effects) in at_work.iter().enumerate() {
        for (effect, values) in *effects {
            all.push((InScans::new(*effect, vec![scan as u16], views), values.clone()));
        }
    }
    all
}

/// Refuses data that the refitted base is far off in many places. Judged with much speckle: that there is some
/// may be found later, by an effect.
fn refuse_another_target(scorer: &Scorer, base: &State) -> Result<(), DiagnoseError> {
    let receiver = with_wide_speckle(scorer.problem.receiver);
    let problem = Problem { receiver, ..scorer.problem };
    let wide = Scorer { problem, ..*scorer };
    let wild = residual::outlying_powers(&wide.z(&wide.predict(base)));
    let shots = scorer.problem.shots.len();
    if wild as f64 > MOST_WILD * shots as f64 {
        return Err(DiagnoseError::Unlike { wild, shots });
    }
    Ok(())
}

/// The false alarms of all clouds, under what the scene declares.
fn false_alarms(subject: &Subject, base: &State) -> FalseAlarms {
    let receiver = base.space.received(subject.receiver, &base.fit.at);
    let each = subject.alarms.iter().map(|alarms| alarms.counted(&receiver, subject.declared));
    each.reduce(FalseAlarms::and).unwrap_or_default()
}

/// How many of the detections that belong to no shot are where.
#[derive(Clone, Copy)]
struct StrayCounts {
    /// Beside an edge of the target, within the reach of the radar's beam.
    beside_edge: usize,
    /// Those of them that the spot of the model does not reach, such as a single ray.
    past_the_spot: usize,
    /// Off the target, but for those that chance has near it.
    off_target: usize,
}

impl StrayCounts {
    /// Of a model, or a refusal if many are off the target.
    fn of(scorer: &Scorer, subject: &Subject, state: &State) -> Result<StrayCounts, DiagnoseError> {
        let mut counts = StrayCounts { beside_edge: 0, past_the_spot: 0, off_target: 0 };
        for (scan, (strays, alarms)) in subject.strays.iter().zip(subject.alarms).enumerate() {
            let model = state.space.model(scorer.problem.receiver, &state.fit.at, scan as u16);
            let (stage, mut off_target, mut past_the_spot) = (&subject.stages[scan], 0, 0);
            for stray in strays {
                let is_missed = usize::from(!stray.is_on_target(&model, stage));
                if stray.is_beside_edge(&model, stage) {
                    counts.beside_edge += 1;
                    past_the_spot += is_missed;
                } else {
                    off_target += is_missed;
                }
            }
            let by_chance = expected_beside_edge(alarms, &model, stage);
            counts.past_the_spot += beyond_chance(past_the_spot, by_chance);
            counts.off_target += beyond_chance(off_target, alarms.near_target());
        }
        let points = subject.strays.iter().map(Vec::len).sum::<usize>() + subject.detected();
        if counts.off_target as f64 > MOST_STRAYS * points as f64 {
            let matched = points - counts.off_target;
            return Err(DiagnoseError::Elsewhere { matched, points });
        }
        Ok(counts)
    }
}

/// Refuses a model that is far from the data with all effects found.
fn refuse_a_poor_fit(errors: &Errors) -> Result<(), DiagnoseError> {
    let Errors { rmse_db, noise_floor_db, .. } = *errors;
    if rmse_db > MOST_FLOORS * noise_floor_db {
        return Err(DiagnoseError::FarOff { rmse_db, noise_floor_db });
    }
    Ok(())
}

/// Parameters of the first effect that was added, or else of the one that gained most.
fn numbers_of_controls(ranking: &[Candidate]) -> usize {
    let first = ranking.iter().find(|candidate| candidate.accepted).or(ranking.first());
    first.map_or(1, |candidate| candidate.numbers)
}
