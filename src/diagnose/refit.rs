//! Scattering models and effects, fitted together by maximum likelihood.
//!
//! The score of each chirp is a difference quotient of ln p. The curvature is Σ L·(y/μ)·g·gᵀ, with g the
//! slope of ln μ, for unknowns that change means, and the sum of the products of the scores for unknowns that only
//! change the distribution about the mean.

use nalgebra::{DMatrix, DVector};

use super::folds::Folds;
use super::likelihood::Term;
use super::problem::{EFFECT_STEP, Problem, Slope};
use super::space::Space;
use crate::fit::minimise::{Local, Minimise, Stop};
use crate::fit::shapes;
use crate::lanes::{Wide, widest};

/// A full search.
pub(super) const SEARCH: Minimise = Minimise { iterations: 20, tolerance: 0.1, patience: PATIENCE };
/// A shorter search, which shows whether an effect is worth a full one.
pub(super) const SCOUT: Minimise = Minimise { iterations: 12, tolerance: 0.1, patience: PATIENCE };
/// After this number of steps in a row without an improvement the next is a thousandth of a full one, or less.
const PATIENCE: usize = 8;
/// Steps of a difference quotient where facets move under the rays, from the first search to the last. ln p then
/// has jumps. A quotient sees those within its width, and a search moves about as far at a time.
pub(super) const WIDE_TO_NARROW: [f64; 3] = [1.0, 0.25, 0.06];
/// Distances along the axes of the curvature that are tried across such jumps, in standard deviations but no more
/// than an effect's steps.
const ALONG_AXES: [f64; 4] = [0.3, 1.0, 3.0, 10.0];
/// Largest change of ln mean over a difference quotient of a smooth surface, and of the range, m, where it is not within a few
/// standard deviations.
const SMOOTH: f64 = 0.5;
const SMOOTH_M: f64 = 0.003;
/// How often a step that does not improve is halved.
const HALVINGS: usize = 5;

/// The end of a search.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub at: DVector<f64>,
    /// ln likelihood, less what the scale of the laws takes ([`Space::prior`]).
    pub ln_likelihood: f64,
    pub converged: bool,
    /// No step from here improved, short ones neither: a further search would only repeat them.
    pub is_stuck: bool,
}

impl Problem<'_> {
    /// The most likely point from a start. The unknowns numbered in `held` stay.
    pub fn fit(
        &self,
        space: &Space,
        start: &DVector<f64>,
        held: &[usize],
        search: &Minimise,
    ) -> Fit {
        let [lower, upper] = bounds(space, start, held);
        let bounds = [&lower, &upper];
        if !space.moving().into_iter().any(|index| lower[index] < upper[index]) {
            return self.fit_by(EFFECT_STEP, space, start, bounds, search);
        }
        let [wide, middle, narrow] = WIDE_TO_NARROW;
        let mut fit = self.fit_by(wide, space, start, bounds, search);
        for step in [middle, narrow] {
            fit = self.fit_by(step, space, &fit.at, bounds, search);
        }
        fit
    }

    /// A search with one step of the effects' parameters.
    fn fit_by(
        &self,
        step: f64,
        space: &Space,
        start: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        search: &Minimise,
    ) -> Fit {
        let found = search.run_with(
            start,
            bounds,
            |at| -self.ln_likelihood(space, at),
            |at| self.local(step, space, at, bounds),
        );
        let (ln_likelihood, converged) = (-found.local.value, found.converged());
        let is_stuck = found.stop == Stop::Stuck;
        Fit { at: found.at, ln_likelihood, converged, is_stuck }
    }

    /// −ln likelihood near a point, with this step of the effects' parameters. Unknowns whose bounds are equal have
    /// no slopes.
    fn local(
        &self,
        step: f64,
        space: &Space,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
    ) -> Local {
        let terms = self.terms(space, at);
        let slopes = self.slopes_over(step, space, at, bounds, &terms);
        local(&terms, &slopes, |_| true).merge(self.local_beside(space, at, bounds))
    }

    /// Points from which the laws are searched beside their stored values: for each law, up to `count` that fit best
    /// among shapes all over their ranges, with the other unknowns where `at` has them.
    pub fn law_starts(&self, space: &Space, at: &DVector<f64>, count: usize) -> Vec<DVector<f64>> {
        let mut all = Vec::new();
        for (first, coordinates) in space.laws_with_places() {
            let joined = |part: &DVector<f64>| {
                let mut whole = at.clone();
                whole.rows_mut(first, part.len()).copy_from(part);
                whole
            };
            let others_held = space.bounds().map(|bounds| {
                let mut held = at.clone();
                held.rows_mut(first, coordinates.len())
                    .copy_from(&bounds.rows(first, coordinates.len()));
                held
            });
            let [lower, upper] = &others_held;
            let found = shapes::starts(coordinates, count, |part| {
                let whole = self.local(EFFECT_STEP, space, &joined(part), [lower, upper]);
                let (place, len) = ((first, first), (part.len(), part.len()));
                Local {
                    value: whole.value,
                    gradient: whole.gradient.rows(first, part.len()).into_owned(),
                    curvature: whole.curvature.view(place, len).into_owned(),
                }
            });
            all.extend(found.iter().map(joined));
        }
        all
    }

    /// The most likely points of fits without each fold in turn, by a full step from the most likely
    /// point of all shots. The folds' points differ from it by about its standard deviation, over which
    /// ln likelihood is a parabola. The unknowns numbered in `held` stay. The points come one after the other, so that rays
    /// traced for one are still there when it is used.
    pub fn fit_without(
        &self,
        space: &Space,
        at: &DVector<f64>,
        held: &[usize],
        folds: &Folds,
    ) -> impl Iterator<Item = DVector<f64>> {
        let [lower, upper] = bounds(space, at, held);
        let terms = self.terms(space, at);
        let slopes = self.slopes(space, at, [&lower, &upper], &terms);
        (0..folds.folds).map(move |fold| {
            let local = local(&terms, &slopes, |shot| !folds.holds_out(fold, shot));
            let local = local.merge(self.local_beside(space, at, [&lower, &upper]));
            let mut there = SEARCH.newton(at, [&lower, &upper], &local);
            // A step past the maximum is shortened.
            let here = ln_likelihood_without(&terms, folds, fold) + self.beside(space, at);
            for _ in 0..HALVINGS {
                let terms = self.terms(space, &there);
                let beside = self.beside(space, &there);
                if ln_likelihood_without(&terms, folds, fold) + beside >= here {
                    return there;
                }
                there = 0.5 * (there + at);
            }
            at.clone()
        })
    }

    /// The most likely point on the principal axes of the curvature, if it is more likely than the
    /// middle. A target that its ranges leave free to turn in itself is held by its edges alone. ln p changes at
    /// an edge one chirp after the other, and its slopes hardly show it.
    pub fn along_axes(&self, space: &Space, at: &DVector<f64>) -> Option<DVector<f64>> {
        let [lower, upper] = space.bounds();
        let terms = self.terms(space, at);
        let slopes = self.slopes(space, at, [&lower, &upper], &terms);
        let axes = self.smooth_curvature(space, &terms, &slopes).symmetric_eigen();
        let mut best = (self.ln_likelihood(space, at), None);
        for (axis, bend) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
            let reach = bend.max(f64::MIN_POSITIVE).sqrt().recip().min(1.0);
            for length in ALONG_AXES.iter().flat_map(|by| [by * reach, -by * reach]) {
                let there = (at + axis * length).zip_zip_map(&lower, &upper, f64::clamp);
                let ln_p = self.ln_likelihood(space, &there);
                if ln_p > best.0 {
                    best = (ln_p, Some(there));
                }
            }
        }
        best.1
    }

    /// Curvature of −ln likelihood without the shots that an edge passes over.
    pub fn smooth_curvature(
        &self,
        space: &Space,
        terms: &[Term],
        slopes: &[Vec<Slope>],
    ) -> DMatrix<f64> {
        let smooth_m = SMOOTH_M.max(3.0 * self.declared.range_sd_m);
        let smooth = local(terms, slopes, |shot| {
            let mut of_effects = slopes.iter().skip(space.base_len());
            of_effects.all(|slopes| {
                let Slope { ln_mean, range_m, .. } = slopes[shot];
                ln_mean.abs() * EFFECT_STEP < SMOOTH && range_m.abs() * EFFECT_STEP < smooth_m
            })
        });
        smooth.curvature
    }
}

/// Least and largest value of every unknown; those numbered in `held` stay where they are.
fn bounds(space: &Space, at: &DVector<f64>, held: &[usize]) -> [DVector<f64>; 2] {
    space.bounds().map(|mut ends| {
        held.iter().for_each(|&index| ends[index] = at[index]);
        ends
    })
}

/// ln likelihood of the shots outside a fold.
fn ln_likelihood_without(terms: &[Term], folds: &Folds, fold: usize) -> f64 {
    let used = terms.iter().enumerate().filter(|(shot, _)| !folds.holds_out(fold, *shot));
    used.map(|(_, term)| term.ln_p).sum()
}

/// −ln likelihood near a point, from the shots that count.
fn local(terms: &[Term], slopes: &[Vec<Slope>], counts: impl Fn(usize) -> bool) -> Local {
    widest(Sum { terms, slopes, counts })
}

/// The sum of what shots say of ln likelihood near a point.
struct Sum<'a, C> {
    terms: &'a [Term],
    slopes: &'a [Vec<Slope>],
    /// Whether a shot counts.
    counts: C,
}

impl<C: Fn(usize) -> bool> Wide for Sum<'_, C> {
    type Answer = Local;

    #[inline(always)]
    fn run(self) -> Local {
        let Sum { terms, slopes, counts } = self;
        let unknowns = slopes.len();
        let moves_mean: Vec<bool> = slopes
            .iter()
            .map(|s| s.iter().any(|s| s.ln_mean.abs() > 1e-9 || s.range_m.abs() > 1e-12))
            .collect();
        let mut sum = Local::zero(unknowns);
        let mut rows = [vec![0.0; unknowns], vec![0.0; unknowns], vec![0.0; unknowns]];
        for (shot, term) in terms.iter().enumerate() {
            if !counts(shot) {
                continue;
            }
            sum.value -= term.ln_p;
            let [means, ranges, laws] = &mut rows;
            for (index, slopes) in slopes.iter().enumerate() {
                let slope = slopes[shot];
                sum.gradient[index] -= slope.ln_p;
                if moves_mean[index] {
                    (means[index], ranges[index]) = (slope.ln_mean, slope.range_m);
                } else {
                    laws[index] = slope.ln_p;
                }
            }
            for (row, weight) in rows.iter().zip([term.bend, term.range_bend, term.weight.recip()])
            {
                sum.add(0.0, weight, row);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Diagnosis;
    use crate::diagnose::tests::searched;
    use crate::effects::{family, find};

    /// Outputs at a ceiling vary so little that ln p is no parabola over the usual step of a parameter.
    #[test]
    fn a_ceiling_is_found_where_it_is_likeliest() {
        let settings = Diagnosis { seed: 4, ..Diagnosis::default() };
        let [saturation_dbm, knee] = [-52.0, 1.5];
        let truth = vec![saturation_dbm, 1.0, knee, 1.0, 1.0];
        let compression = find("compression").unwrap();
        searched((compression, truth), &settings, &|search, space| {
            let (problem, member) = (&search.scorer.problem, family(compression)[0]);
            let with = space.with(member);
            let start = Space::joined(&space.start(), member, &[saturation_dbm + 0.5, knee]);
            let fit = problem.fit(&with, &start, &[], &SEARCH);
            let found = &with.effect_values(&fit.at)[0];
            assert!(fit.converged && (found[0] - saturation_dbm).abs() < 0.3, "{fit:?}");
            // No point beside it is likelier by more than the search promises.
            for index in 0..fit.at.len() {
                for step in [0.003, -0.003, 0.03, -0.03] {
                    let mut beside = fit.at.clone();
                    beside[index] += step;
                    let gain = problem.ln_likelihood(&with, &beside) - fit.ln_likelihood;
                    assert!(gain < SEARCH.tolerance, "{index} {step}: {gain}");
                }
            }
        });
    }
}
