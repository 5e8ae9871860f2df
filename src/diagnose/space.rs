//! The unknowns of a model: the coordinates of every scattering model that is fitted, after them ln of the level of every
//! radar that is not calibrated, and after these the parameters of the effects in units of their steps.

use nalgebra::DVector;
use rayon::prelude::*;

use super::level::{MOST_OFF_DB, off_the_stored, prior};
use super::observation::DB;
use super::views::Views;
use crate::brdf::Brdf;
use crate::effects::{Effect, Model, Receiver, Shot, Twist, rank};
use crate::fit::FitError;
use crate::fit::coordinates::{Coordinates, frequencies};
use crate::fit::minimise::Local;

/// Chirps that must meet a region for its scattering model to be fitted.
pub(crate) const LEAST_SHOTS: usize = 100;
/// Step of a difference quotient by a coordinate of a scattering model.
const LAW_STEP: f64 = 5e-4;

/// The unknowns of a model.
#[derive(Clone)]
pub(super) struct Space<'a> {
    laws: Vec<Brdf>,
    /// Regions whose scattering models are fitted, and the coordinates of these.
    free: Vec<(usize, Coordinates)>,
    /// ln of the level of each radar over the one that its settings state, where a search starts; none of a radar that
    /// was calibrated.
    pub ln_levels: Vec<f64>,
    /// The level of each scan by its place among those; one for each scan.
    pub level_of_scan: Vec<Option<usize>>,
    /// Effects at declared values.
    declared: &'a [(&'a dyn Effect, Vec<f64>)],
    pub effects: Vec<&'a dyn Effect>,
}

/// A parameter of a scattering model at a point of the space.
pub(super) struct LawValue {
    pub region: usize,
    pub name: String,
    pub value: f64,
    /// Change of the value by its unknown.
    pub slope: f64,
}

/// Two points that differ in one unknown.
pub(super) struct Difference {
    pub ends: [DVector<f64>; 2],
    /// Difference of the unknown.
    pub width: f64,
}

impl<'a> Space<'a> {
    /// A space without effects, for a radar of the level that its settings state. Regions that fewer than [`LEAST_SHOTS`] chirps meet keep their scattering models.
    pub fn new(
        shots: &[Shot],
        looks: f64,
        laws: &[Brdf],
        declared: &'a [(&'a dyn Effect, Vec<f64>)],
    ) -> Result<Space<'a>, FitError> {
        let mut free = Vec::new();
        for (region, law) in laws.iter().enumerate() {
            let here = shots.iter().filter(|shot| usize::from(shot.region) == region);
            if here.count() >= LEAST_SHOTS {
                let coordinates = Coordinates::new(law, &frequencies(law), &[], Some(looks))?;
                free.push((region, coordinates.lowering_levels()));
            }
        }
        let (ln_levels, level_of_scan) = (Vec::new(), Vec::new());
        let laws = laws.to_vec();
        Ok(Space { laws, free, ln_levels, level_of_scan, declared, effects: Vec::new() })
    }

    /// The space with one more effect.
    pub fn with(&self, effect: &'a dyn Effect) -> Space<'a> {
        let mut space = self.clone();
        space.effects.push(effect);
        space
    }

    /// The space without one of its effects, and a point without the parameters of that effect.
    pub fn without(&self, at: &DVector<f64>, index: usize) -> (Space<'a>, DVector<f64>) {
        let mut space = self.clone();
        let before: usize =
            self.effects.iter().take(index).map(|effect| effect.parameters().len()).sum();
        let removed = space.effects.remove(index).parameters().len();
        let first = self.base_len() + before;
        (space, at.clone().remove_rows(first, removed))
    }

    /// The space with its first effect as the last, and a point reordered in the same way.
    pub fn rotated(&self, at: &DVector<f64>) -> (Space<'a>, DVector<f64>) {
        let values = self.effect_values(at).into_iter().next();
        let Some((&first, values)) = self.effects.first().zip(values) else {
            return (self.clone(), at.clone());
        };
        let (space, at) = self.without(at, 0);
        (space.with(first), Space::joined(&at, first, &values))
    }

    /// Whether the space has an effect of this name on any of these scans; on any for an empty list.
    pub fn has(&self, name: &str, scans: &[u16]) -> bool {
        let is_it = |effect: &&dyn Effect| {
            let own = effect.scans();
            let share = own.is_empty() || scans.is_empty() || own.iter().any(|s| scans.contains(s));
            effect.name() == name && share
        };
        self.effects.iter().any(is_it)
    }

    /// Unknowns of the effects for which rays must be traced anew. They are few, and another effect
    /// hardly changes them.
    pub fn costly(&self, at: &DVector<f64>) -> Vec<usize> {
        let mut first = self.base_len();
        let mut costly = Vec::new();
        for (effect, values) in self.effects.iter().zip(self.effect_values(at)) {
            let next = first + values.len();
            if effect.moves() || effect.survey_key(&values).is_some_and(|on| !on.is_empty()) {
                costly.extend(first..next);
            }
            first = next;
        }
        costly
    }

    /// Unknowns of the effects that move the target.
    pub fn moving(&self) -> Vec<usize> {
        self.moving_of(usize::MAX)
    }

    /// Those of effects with no more than so many parameters.
    pub fn moving_of(&self, most: usize) -> Vec<usize> {
        let mut first = self.base_len();
        let mut moving = Vec::new();
        for effect in &self.effects {
            let next = first + effect.parameters().len();
            if effect.moves() && effect.parameters().len() <= most {
                moving.extend(first..next);
            }
            first = next;
        }
        moving
    }

    /// Widest step of a parameter of an effect over which a difference quotient is its slope.
    fn widest_difference(&self, index: usize) -> f64 {
        let mut first = self.base_len();
        let of_it = self.effects.iter().find(|effect| {
            first += effect.parameters().len();
            index < first
        });
        of_it.map_or(f64::INFINITY, |effect| effect.widest_difference())
    }

    /// How the target moves at every shot per unit of each of the unknowns of [`Space::moving`]. Of two effects that move
    /// the target the second is taken not to turn it.
    pub fn twists(&self, at: &DVector<f64>, views: &Views, shots: &[Shot]) -> Vec<Vec<Twist>> {
        let values = self.effect_values(at);
        let twists_of = |shot: &Shot| {
            let mut all = Vec::new();
            for (effect, values) in self.effects.iter().zip(&values) {
                let twists = effect.twists(values, views.stage(shot), shot);
                let known = effect.parameters().iter().zip(twists);
                all.extend(known.map(|(known, twist)| twist.map(|by| by * known.step)));
            }
            all
        };
        shots.par_iter().map(twists_of).collect()
    }

    /// Number of unknowns of the scattering models and of the levels, which come first.
    pub fn base_len(&self) -> usize {
        self.laws_len() + self.ln_levels.len()
    }

    /// Number of those that belong to the scattering models.
    fn laws_len(&self) -> usize {
        self.free.iter().map(|(_, coordinates)| coordinates.len()).sum()
    }

    /// The unknown that is ln of the level of a scan; none for a calibrated radar.
    pub fn level_index(&self, scan: usize) -> Option<usize> {
        let level = self.level_of_scan.get(scan).copied().flatten()?;
        Some(self.laws_len() + level)
    }

    /// Each fitted law's coordinates, with the place of the first among all unknowns.
    pub fn laws_with_places(&self) -> impl Iterator<Item = (usize, &Coordinates)> {
        self.free.iter().scan(0, |next, (_, coordinates)| {
            let first = *next;
            *next += coordinates.len();
            Some((first, coordinates))
        })
    }

    /// What is added to −ln p, since data do not tell the level from the scale of the laws; nothing for calibrated
    /// radars.
    pub fn prior(&self, at: &DVector<f64>) -> Local {
        if self.ln_levels.is_empty() {
            Local::zero(at.len())
        } else {
            prior(self.laws_with_places(), at)
        }
    }

    /// Start of the unknowns of the scattering models and of the level.
    pub fn start(&self) -> DVector<f64> {
        let mut start = Vec::new();
        for (_, coordinates) in &self.free {
            start.extend(coordinates.start().iter());
        }
        start.extend(&self.ln_levels);
        DVector::from_vec(start)
    }

    /// A point with the scattering models and the level back at their start.
    pub fn restarted(&self, at: &DVector<f64>) -> DVector<f64> {
        let others = at.iter().skip(self.base_len());
        DVector::from_vec(self.start().iter().chain(others).copied().collect())
    }

    /// Two points about another that differ in one unknown. Scattering models are smooth, so that one of the
    /// two may be the point itself; the parameters of effects are moved to both sides.
    pub fn difference(
        &self,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        index: usize,
        effect_step: f64,
        laws_on_both_sides: bool,
    ) -> Difference {
        let is_law = index < self.base_len();
        let step = if is_law { LAW_STEP } else { effect_step.min(self.widest_difference(index)) };
        let more = moved(at, bounds, index, step);
        let is_one_sided = is_law && !laws_on_both_sides && more[index] > at[index];
        let less = if is_one_sided { at.clone() } else { moved(at, bounds, index, -step) };
        let width = more[index] - less[index];
        Difference { ends: [more, less], width }
    }

    /// A point with the parameters of one more effect.
    pub fn joined(at: &DVector<f64>, effect: &dyn Effect, values: &[f64]) -> DVector<f64> {
        let parameters = effect.parameters().iter().zip(values);
        let more = parameters.map(|(known, value)| value.clamp(known.min, known.max) / known.step);
        DVector::from_iterator(at.len() + effect.parameters().len(), at.iter().copied().chain(more))
    }

    /// Every fitted parameter of the scattering models.
    pub fn base_values(&self, at: &DVector<f64>) -> Vec<LawValue> {
        let mut unknowns = at.iter();
        let mut values = Vec::new();
        for (region, coordinates) in &self.free {
            for (known, &u) in coordinates.list.iter().zip(unknowns.by_ref()) {
                let (value, slope) = (known.value(u), known.slope(u));
                values.push(LawValue { region: *region, name: known.name.clone(), value, slope });
            }
        }
        values
    }

    /// Parameter values of every effect.
    pub fn effect_values(&self, at: &DVector<f64>) -> Vec<Vec<f64>> {
        let mut rest = at.iter().skip(self.base_len());
        let mut all = Vec::new();
        for effect in &self.effects {
            let parameters =
                effect.parameters().iter().zip(rest.by_ref().take(effect.parameters().len()));
            all.push(
                parameters.map(|(known, u)| (u * known.step).clamp(known.min, known.max)).collect(),
            );
        }
        all
    }

    /// How many parameters of the last effect are in use. Each one of a pose is, however small; others are where they
    /// differ from their absent value by more than a step.
    pub fn parameters_in_use(&self, at: &DVector<f64>) -> usize {
        let Some((effect, values)) = self.effects.last().zip(self.effect_values(at).pop()) else {
            return 0;
        };
        let parameters = effect.parameters().iter().zip(values);
        parameters
            .filter(|(known, value)| effect.moves() || (value - known.absent).abs() > known.step)
            .count()
    }

    /// How much speaks against a point beside its likelihood, in ln p: the parameters in use of the last effect, and how
    /// far the laws are from those stored.
    pub fn against(&self, at: &DVector<f64>) -> f64 {
        self.parameters_in_use(at) as f64 + self.off_the_stored(at)
    }

    /// How far the laws are from those stored, in ln p.
    pub fn off_the_stored(&self, at: &DVector<f64>) -> f64 {
        off_the_stored(self.laws_with_places(), at)
    }

    /// The model of a scan at a point.
    pub fn model(&self, receiver: Receiver, at: &DVector<f64>, scan: u16) -> Model<'a> {
        let mut laws = self.laws.clone();
        let mut from = 0;
        for (region, coordinates) in &self.free {
            let part = at.rows(from, coordinates.len()).into_owned();
            from += coordinates.len();
            if let Some(law) = laws.get_mut(*region) {
                *law = coordinates.model(&part);
            }
        }
        let found = self.effects.iter().copied().zip(self.effect_values(at));
        let all = self.declared.iter().cloned().chain(found);
        let all = all.filter(|(effect, _)| effect.acts_on(scan));
        let all = all.map(|(effect, values)| match effect.whole(&values) {
            Some((whole, all)) => (whole as &dyn Effect, all),
            None => (effect, values),
        });
        let mut effects: Vec<_> = all.collect();
        effects.sort_by_key(|(effect, _)| rank(effect.name()));
        let level = self.level_index(usize::from(scan)).map_or(1.0, |index| at[index].exp());
        Model { laws, receiver, effects, level }
    }

    /// The receiver at a point, which is that of every scan.
    pub fn received(&self, receiver: Receiver, at: &DVector<f64>) -> Receiver {
        let found = self.effects.iter().copied().zip(self.effect_values(at));
        let declared = self.declared.iter().cloned();
        declared
            .chain(found)
            .filter(|(effect, _)| effect.acts_on(0))
            .fold(receiver, |receiver, (effect, values)| effect.receive(&values, receiver))
    }

    /// Least and largest value of every unknown.
    pub fn bounds(&self) -> [DVector<f64>; 2] {
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for (_, coordinates) in &self.free {
            lower.extend(coordinates.lower().iter());
            upper.extend(coordinates.upper().iter());
        }
        for _ in &self.ln_levels {
            lower.push(-MOST_OFF_DB / DB);
            upper.push(MOST_OFF_DB / DB);
        }
        for known in self.effects.iter().flat_map(|effect| effect.parameters()) {
            lower.push(known.min / known.step);
            upper.push(known.max / known.step);
        }
        [DVector::from_vec(lower), DVector::from_vec(upper)]
    }
}

/// A point with one unknown moved within bounds.
fn moved(
    at: &DVector<f64>,
    [lower, upper]: [&DVector<f64>; 2],
    index: usize,
    by: f64,
) -> DVector<f64> {
    let mut there = at.clone();
    there[index] = (at[index] + by).clamp(lower[index], upper[index]);
    there
}
