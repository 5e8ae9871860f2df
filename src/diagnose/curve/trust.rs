//! Whether terms that improve a model may be called by their names, and why not.

use std::f64::consts::TAU;

use serde::Serialize;

use super::model::rms_apart_db;
use super::points::Points;
use super::select::{Addition, State};
use super::terms::{Term, ThinFilm};
use crate::brdf::{Brdf, Scattering};

/// Fringes that a film shows over the angles of the curve.
const LEAST_FRINGES: f64 = 1.0;
/// Share of the lobes in a level from which on their fringes show.
const LEAST_SHARE: f64 = 0.25;
/// Levels that a repeat needs to count.
const LEAST_LEVELS: usize = 12;
/// Share of the mean gain of all repeats that each must have.
const SHARE_IN_EACH: f64 = 0.25;
/// A number nearer to a bound than this share of its range is at the bound.
const AT_BOUND: f64 = 1e-3;

/// Why what improves a model gets no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NameDoubt {
    /// The noise of a level is not known.
    NoiseUnknown,
    /// It changes the levels by less than laws and instruments err.
    Small,
    /// A number is at its bound.
    AtBound,
    /// A film shows less than a whole fringe.
    NoFringe,
    /// A repeat does not have it.
    NotInRepeats,
    /// It stands beside a term that makes another law.
    BesideShape,
    /// It stands beside another law than the declared one.
    BesideLaw,
    /// Another law with effects does better.
    OtherBetter,
    /// More than the noise remains with it.
    MoreRemains,
}

/// The doubts of terms that were added: a number at a bound, a film without a whole fringe, a term that changes the levels
/// by less than `least_db`, dB, a term beside one of a shape, a repeat without them.
pub(super) fn doubts(
    points: &Points,
    least_db: f64,
    before: &State,
    after: &State,
    added: &[Addition],
) -> Vec<NameDoubt> {
    let (law, values) = after.model.numbers(&after.fitted.at);
    let pairs: Vec<(&Addition, &Vec<f64>)> = added.iter().zip(&values).collect();
    let film = pairs.iter().find(|(one, _)| one.term.name() == ThinFilm.name());
    let shapes = added.iter().filter(|one| one.term.is_shape()).count();
    let is_small = added.iter().any(|one| one.evidence.size_db < least_db);
    let all = [
        (NameDoubt::NoiseUnknown, !points.has_known_noise()),
        (NameDoubt::Small, is_small || !all_matter(points, after, least_db)),
        (NameDoubt::AtBound, pairs.iter().any(|(one, values)| !is_inside(one.term, values))),
        (
            NameDoubt::NoFringe,
            film.is_some_and(|(_, values)| fringes(points, &law, values) < LEAST_FRINGES),
        ),
        (NameDoubt::NotInRepeats, !holds_in_repeats(points, before, after)),
        (NameDoubt::BesideShape, shapes > 0 && shapes < added.len()),
    ];
    all.into_iter().filter_map(|(doubt, holds)| holds.then_some(doubt)).collect()
}

/// Whether no number of a term is at a bound.
fn is_inside(term: &dyn Term, values: &[f64]) -> bool {
    term.parameters().iter().zip(values).all(|(known, value)| {
        let margin = AT_BOUND * (known.max - known.min);
        (value - known.min > margin || known.min == known.absent)
            && (known.max - value > margin || known.max == known.absent)
    })
}

/// Fringes of a film from the least to the largest path through it among the detected levels that the lobes have a share in.
fn fringes(points: &Points, law: &Brdf, values: &[f64]) -> f64 {
    let seen = points
        .points
        .iter()
        .filter(|point| !point.censored && law.specular_share(point.i, point.o) >= LEAST_SHARE);
    let phases = seen.map(|point| ThinFilm::phase_rad(values, point));
    let (least, most) = phases.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), phase| {
        (least.min(phase), most.max(phase))
    });
    (most - least) / TAU
}

/// Whether every term still changes the levels by so much, dB, beside those that came after it.
fn all_matter(points: &Points, State { model, fitted, .. }: &State, least_db: f64) -> bool {
    let with = model.levels_db(&fitted.at, &points.points);
    (0..model.terms.len()).all(|term| {
        let without = model.levels_db(&model.without(&fitted.at, term), &points.points);
        rms_apart_db(&with, &without) >= least_db
    })
}

/// Whether the terms gain in every repeat of the curve that has enough levels, fitted to it alone.
fn holds_in_repeats(points: &Points, before: &State, after: &State) -> bool {
    let most = points.most_repeats(LEAST_LEVELS);
    let share = (after.fitted.log_p - before.fitted.log_p) / most.max(1) as f64;
    (0..most).all(|number| {
        let repeat = points.repeat(number);
        let all = vec![true; repeat.points.len()];
        let [without, with] =
            [before, after].map(|state| state.model.fit(&repeat, &all, &state.fitted.at).log_p);
        with - without >= SHARE_IN_EACH * share
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::curve::base_law;
    use crate::diagnose::curve::testing::{curve_of, in_plane, noisy};

    #[test]
    fn a_film_of_a_fifth_of_a_wavelength_shows_less_than_a_fringe() {
        let mut law = base_law();
        law.set_parameter("0.albedo", 0.0);
        let points = in_plane(&law, &[10.0, 30.0, 50.0, 70.0], 5.0);
        let points = Points { points, ..curve_of(&noisy(&[10.0], 5.0, 0.0, |_| 0.0), None) };
        assert!(fringes(&points, &law, &[0.9, 0.2]) < 0.2);
        assert!(fringes(&points, &law, &[0.4, 3.2]) > 1.4);
        // No fringe shows where only a diffuse part returns, which here is everywhere but within 15° of the mirror.
        let points = Points { points: in_plane(&law, &[30.0], 5.0), ..points };
        let of_lobe = fringes(&points, &law, &[0.4, 3.2]);
        law.set_parameter("0.albedo", 0.1);
        law.set_parameter("1.m", 0.05);
        law.set_parameter("1.f_lambda", 0.01);
        assert!(fringes(&points, &law, &[0.4, 3.2]) < 0.5 * of_lobe, "{of_lobe}");
    }

    #[test]
    fn a_number_at_a_bound_is_not_trusted_unless_there_it_means_nothing() {
        assert!(is_inside(&ThinFilm, &[0.4, 3.2]));
        assert!(!is_inside(&ThinFilm, &[0.99, 3.2]));
        assert!(!is_inside(&ThinFilm, &[0.4, 22.0]));
        let lobe = crate::diagnose::curve::term("diffuse-lobe").unwrap();
        assert!(is_inside(lobe, &[0.01]) && !is_inside(lobe, &[50.0]));
    }
}
