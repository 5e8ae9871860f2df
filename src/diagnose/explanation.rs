//! A model with the effects that were added to it, and the removal of effects that it no longer needs.

use super::evidence::{Evidence, Largest};
use super::field::Structure;
use super::scorer::{Scorer, State};
use super::support::{Claim, SHARE_OF_LARGEST};
use crate::effects::Effect;

/// A model with the effects that were added to it.
pub(super) struct Explanation<'a> {
    pub state: State<'a>,
    /// In the order of the model's effects.
    pub added: Vec<Addition<'a>>,
}

/// An effect that was added.
pub(super) struct Addition<'a> {
    /// Names of effects that predict the data as well.
    pub class: Vec<&'static str>,
    pub evidence: Evidence,
    /// What chance gives the best of the starts of its search, in ln p.
    pub by_starts: f64,
    /// Effects that did nearly as well.
    pub rivals: Vec<&'a dyn Effect>,
}

/// The model without one of its effects.
struct Removal<'a> {
    index: usize,
    without: State<'a>,
    /// Loss of ln likelihood.
    loss: f64,
    is_needed: bool,
}

impl<'a> Explanation<'a> {
    /// The largest of the effects whose form may be another one than theirs.
    pub fn largest(&self) -> Largest {
        let effects = self.added.iter().zip(&self.state.space.effects);
        let of_some_form = effects.filter(|(_, effect)| !effect.about().has_one_form);
        Largest::of(of_some_form.map(|(one, _)| &one.evidence))
    }

    /// Removes effects that later ones made superfluous.
    pub fn remove_superfluous(&mut self, scorer: &Scorer) {
        while self.added.len() > 1 {
            let mut removals: Vec<Removal> =
                (0..self.added.len()).map(|index| self.removal(scorer, index)).collect();
            removals.sort_by(|a, b| a.loss.total_cmp(&b.loss));
            let Some(least) = removals.into_iter().find(|one| !one.is_needed) else { return };
            self.state = least.without;
            self.added.remove(least.index);
        }
    }

    fn removal(&self, scorer: &Scorer, index: usize) -> Removal<'a> {
        let State { space, fit, held_out } = &self.state;
        let without = scorer.without(&self.state, index);
        let loss = fit.ln_likelihood - without.fit.ln_likelihood;
        let least = scorer.settings.least_gain_of(space.effects[index].parameters().len(), 1);
        let of_alarms = scorer.gain_of_alarms(&without, space, &fit.at);
        let claim = Claim {
            gain: loss,
            least,
            may_be_form: false,
            held_out: scorer.difference(held_out, &without.held_out),
            size: scorer.size(&without, space, &fit.at),
            share_of_size: SHARE_OF_LARGEST,
            largest: self.largest().beside(of_alarms, least),
        };
        let is_needed = claim.is_supported(scorer.settings, scorer.problem.independent_shots());
        Removal { index, without, loss, is_needed }
    }

    /// Removes effects that are smaller than the structure that the model leaves, which is returned.
    pub fn remove_smaller_than_structure(&mut self, scorer: &Scorer) -> Structure {
        let mut structure = scorer.structure(&self.state);
        // Once: the residual of an effect that is removed would count against the next.
        let fine_db = scorer.fine_structure_db(&self.state);
        while let Some(least) = self.smallest() {
            let size_db = self.added[least].evidence.size_db;
            let is_coarse = scorer.is_structured(&structure, 0.0) && size_db < structure.size_db;
            let is_fine = size_db < fine_db;
            if !is_coarse && !is_fine {
                break;
            }
            let without = scorer.without(&self.state, least);
            let left = scorer.structure(&without);
            // An effect that predicts more than any field of the means is not an error of their form.
            let [gain, _] = scorer.difference(&self.state.held_out, &without.held_out);
            if !is_fine && gain > left.gain[0] {
                break;
            }
            (self.state, structure) = (without, left);
            self.added.remove(least);
        }
        structure
    }

    /// The effect of the smallest size. Motions do not count: ranges and edges place a target, whatever its powers share.
    fn smallest(&self) -> Option<usize> {
        let sizes = self.added.iter().map(|one| one.evidence.size_db).enumerate();
        let sizes = sizes.filter(|(index, _)| !self.state.space.effects[*index].moves());
        sizes.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }
}
