//! Effects against those that did nearly as well when they were chosen: what was added later may have told
//! them apart.

use super::Evidence;
use super::screen::Screen;
use super::select::{Added, Candidate, SAME, Selection, State, numbers};
use super::support::{Largest, Left};
use super::trial::Trial;
use crate::effects::Effect;

impl Selection<'_> {
    /// Holds each of several effects against its rivals.
    pub(super) fn exchange<'a>(&self, state: &mut State<'a>, added: &mut Vec<Added<'a>>) {
        if added.len() < 2 {
            return;
        }
        for _ in 0..added.len() {
            // Its turn makes it the last, as a new one is.
            let mut one = added.remove(0);
            (state.space, state.fitted.at) = state.space.rotated(&state.fitted.at);
            let rivals = std::mem::take(&mut one.rivals);
            let is_new = |rival: &&dyn Effect| !state.space.has(rival.name());
            let rivals: Vec<&dyn Effect> = rivals.into_iter().filter(is_new).collect();
            if !rivals.is_empty() {
                let without = self.without(state, added.len());
                let largest = Largest::of(added);
                for rival in rivals {
                    self.contest(&without, state, &mut one, rival, largest);
                }
            }
            added.push(one);
        }
    }

    /// Holds the last effect of a model against another, which takes its place if it is the better one and
    /// supported by itself.
    fn contest<'a>(
        &self,
        without: &State<'a>,
        state: &mut State<'a>,
        last: &mut Added<'a>,
        rival: &'a dyn Effect,
        largest: Largest,
    ) {
        last.class.retain(|name| *name != rival.name());
        let Some(mut trial) = self.tried(without, rival) else { return };
        let Some((held_out, _)) = self.support(without, &mut trial, largest, &Left::default())
        else {
            return;
        };
        let Trial { space, fitted, candidate, .. } = trial;
        let (fitted, held_out) = self.settled(without, &space, &fitted, held_out);
        let [held_out_gain, held_out_se] = self.difference(&held_out, &without.held_out);
        let Candidate { gain, size_db, numbers: count, .. } = candidate;
        let [better, se] = self.difference(&held_out, &state.held_out);
        let is_tied = better.abs() <= se.max(SAME);
        let [own, other] = [numbers(&state.space, &state.fitted.at), numbers(&space, &fitted.at)];
        let is_better = if is_tied && own != other { other < own } else { better > 0.0 };
        let mut loser = rival.name();
        if is_better {
            let screen = Screen::new(self.problem, &without.space, &without.fitted.at);
            let placebo_gain = self.placebo_gain(without, &screen, count);
            if gain <= placebo_gain {
                return;
            }
            loser = state.space.effects.last().map_or(loser, |effect| effect.name());
            last.evidence = Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db };
            *state = State { space, fitted, held_out };
        }
        if is_tied {
            last.class.push(loser);
        } else if is_better {
            last.class.clear();
        }
    }
}
