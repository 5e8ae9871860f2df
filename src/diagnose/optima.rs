//! Optima that are nearly as likely as the best one.
//!
//! A standard deviation knows the data about one optimum. A broad lobe with a steep rest may predict the same powers as a narrow
//! lobe with a flat one, and a film with one fringe more the same ripple; the numbers then are as uncertain as those differ. Each
//! optimum counts by its likelihood.

use nalgebra::DVector;

use super::problem::{Problem, Sample};
use super::refit::{Fit, SEARCH};
use super::space::Space;

/// Shots on which shapes of laws all over their ranges are tried, and how many of them each law is searched from.
const FEW: usize = 800;
const STARTS: usize = 2;
/// ln of the odds against an optimum from which on it does not count.
const UNLIKELY: f64 = 7.0;

/// Where the laws are searched besides a point: from the best shapes of each law on some of the shots.
pub(super) fn elsewhere(problem: &Problem, space: &Space, at: &DVector<f64>) -> Vec<DVector<f64>> {
    let few = Sample::new(problem, FEW);
    few.problem(problem).law_starts(space, at, STARTS)
}

/// Standard deviation of every unknown over the optima about that of a fit.
pub(super) fn spread(problem: &Problem, sample: &Sample, space: &Space, fit: &Fit) -> Vec<f64> {
    let sampled = &sample.problem(problem);
    let held = space.costly(&fit.at);
    let search = |start: &DVector<f64>| sampled.fit(space, start, &held, &SEARCH);
    let own = search(&fit.at);
    let mut starts = elsewhere(sampled, space, &fit.at);
    starts.extend(other_effect_starts(sampled, space, &fit.at));
    let others = starts.iter().map(search).collect::<Vec<Fit>>();
    weighed(&own, &others, sample.weight)
}

/// The likeliest starts of each effect, with everything else at a point.
fn other_effect_starts(problem: &Problem, space: &Space, at: &DVector<f64>) -> Vec<DVector<f64>> {
    let (few, mut all) = (Sample::new(problem, FEW), Vec::new());
    let problem = few.problem(problem);
    let mut first = space.base_len();
    for effect in &space.effects {
        let next = first + effect.parameters().len();
        if !effect.moves() {
            let values = problem.starts(*effect);
            let mut starts: Vec<(f64, DVector<f64>)> = values
                .iter()
                .map(|values| {
                    let mut there = at.clone();
                    for (place, (value, known)) in
                        values.iter().zip(effect.parameters()).enumerate()
                    {
                        there[first + place] = value.clamp(known.min, known.max) / known.step;
                    }
                    (problem.ln_likelihood(space, &there), there)
                })
                .collect();
            starts.sort_by(|a, b| b.0.total_cmp(&a.0));
            all.extend(starts.into_iter().take(STARTS).map(|(_, start)| start));
        }
        first = next;
    }
    all
}

/// The spread of others about one, each weighed by its likelihood; `weight` is by how much ln likelihoods count.
fn weighed(own: &Fit, others: &[Fit], weight: f64) -> Vec<f64> {
    let mut sums = DVector::zeros(own.at.len());
    let mut total = 1.0;
    for other in others {
        let odds = weight * (other.ln_likelihood - own.ln_likelihood);
        if odds > -UNLIKELY {
            // A better one on a sample is no better on all shots, or the search had found it.
            let share = odds.min(0.0).exp();
            sums += share * (&other.at - &own.at).map(|off| off * off);
            total += share;
        }
    }
    sums.iter().map(|sum| (sum / total).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(at: f64, ln_likelihood: f64) -> Fit {
        let at = DVector::from_element(1, at);
        Fit { at, ln_likelihood, converged: true, is_stuck: false }
    }

    #[test]
    fn optima_count_by_their_likelihood() {
        let own = fit(1.0, -10.0);
        let [sd] = weighed(&own, &[], 1.0)[..] else { panic!() };
        assert_eq!(sd, 0.0);
        // Two equal optima at 1 and 3: half of the probability is 2 away.
        let [sd] = weighed(&own, &[fit(3.0, -10.0)], 1.0)[..] else { panic!() };
        assert!((sd - 2f64.sqrt()).abs() < 1e-12, "{sd}");
        let [sd] = weighed(&own, &[fit(3.0, -12.0)], 1.0)[..] else { panic!() };
        let share = (-2f64).exp() / (1.0 + (-2f64).exp());
        assert!((sd - 2.0 * share.sqrt()).abs() < 1e-12, "{sd}");
        // On a tenth of the shots odds are the tenth root.
        let [sd] = weighed(&own, &[fit(3.0, -10.2)], 10.0)[..] else { panic!() };
        assert!((sd - 2.0 * share.sqrt()).abs() < 1e-12, "{sd}");
        assert_eq!(weighed(&own, &[fit(3.0, -30.0)], 1.0), [0.0]);
    }
}
