//! Starts of a search: for each set of shapes that a law can have, the levels and the looks that fit best.
//!
//! Given the shapes of its lobes a law is a sum of known curves times amplitudes, so that the search over these costs no
//! evaluation of the law (variable projection: Golub & Pereyra 1973, DOI 10.1137/0710036). The shapes have many local optima. They
//! are tried at places that cover their ranges evenly, on a sample of the rows. From the best places short searches of all
//! numbers follow, and searches on all rows start where these end best. The places come in two halves, each of which covers the ranges by
//! itself: two searches that ought to end alike.

use nalgebra::DVector;
use rayon::prelude::*;

use super::coordinates::{Coordinates, LOOKS};
use super::gamma_law::GammaLaw;
use super::likelihood::{Curvature, Likelihood, Tables};
use super::minimise::{Minimise, Stop};
use super::parts::{Parts, with_shapes};
use super::shapes::{apart, sample};
use super::table::Table;
use crate::brdf::Scattering;
use crate::material::Observation;

/// Places in each half for each number of shapes; the last holds for more of them as well.
const PLACES: [usize; 4] = [1, 64, 512, 2048];
/// Search of the amplitudes at one place; it only has to rank the places.
const LEVELS: Minimise = Minimise { iterations: 8, tolerance: 0.1, patience: 3 };
/// ln of an amplitude's least share of its largest value, 10⁻¹².
const LEAST_LN: f64 = -28.0;
/// How far below its own best each other amplitude is, where one starts as the whole law, in ln.
const BELOW: f64 = 5.0;
/// Looks that are tried at each place lie this factor apart.
const LOOKS_APART: f64 = 2.5;
/// How often amplitudes and looks are searched in turn.
const TURNS: usize = 2;
/// Places from which a short search follows, in all and for each start that is wanted. Of two optima the one with the
/// narrower valley may have its first place behind twenty of the other.
const FOLLOWED: usize = 32;
const FOLLOWED_EACH: usize = 8;
/// That search: it only has to rank their optima.
const SHORT: Minimise = Minimise { iterations: 15, tolerance: 0.1, patience: 6 };
/// Halvings of the range in which the number of an amplitude is sought.
const HALVINGS: usize = 60;

/// A law and the sample of a curve, prepared for many shapes.
pub(super) struct Projection<'a> {
    coordinates: &'a Coordinates,
    likelihood: Likelihood<'a>,
    parts: Parts,
    laws: Vec<(f64, GammaLaw)>,
}

/// The law with its shapes at one place.
struct Law {
    /// Amplitudes and redundant numbers are at their lower ends.
    at: DVector<f64>,
    /// σ⁰ there at the angles.
    least: Vec<f64>,
    /// By how much each amplitude at its upper end raises it.
    rises: Vec<Vec<f64>>,
}

/// The best amplitudes and looks at one place.
struct Best {
    cost: f64,
    /// ln of each amplitude over its largest value.
    amplitudes_ln: DVector<f64>,
    looks: f64,
}

impl<'a> Projection<'a> {
    /// Prepares a sample of the rows; `noise_w` is the mean thermal power in each.
    pub fn new(coordinates: &'a Coordinates, rows: &[Observation], noise_w: f64) -> Self {
        let likelihood = Likelihood::coarse(coordinates, &sample(rows), noise_w);
        let looks = looks(coordinates).into_iter();
        let laws = looks.map(|looks| (looks, GammaLaw::new(looks))).collect();
        // A permittivity is an amplitude nearly enough to start from, also where two directions tell more of it.
        let parts = Parts::of(coordinates, &[]);
        Projection { coordinates, likelihood, parts, laws }
    }

    /// Up to `count` starts from one half of the places, 0 or 1, the best first; `factor` times as many places as usual
    /// are tried.
    pub fn starts(&self, half: usize, factor: usize, count: usize) -> Vec<DVector<f64>> {
        let shapes = &self.parts.shapes;
        let places = PLACES[shapes.len().min(PLACES.len() - 1)];
        let places = if shapes.is_empty() { 1 } else { factor * places };
        let tried: Vec<(f64, DVector<f64>, Best)> = (0..places)
            .into_par_iter()
            .map(|place| {
                let law = self.law(2 * place + half);
                let best = self.best(&law);
                (best.cost, law.at, best)
            })
            .collect();
        self.followed(tried, count)
    }

    /// Short searches from the best of the places that were tried.
    fn followed(&self, tried: Vec<(f64, DVector<f64>, Best)>, count: usize) -> Vec<DVector<f64>> {
        let usual: Vec<[f64; 2]> = self.coordinates.list.iter().map(|c| c.usual_ends()).collect();
        let shapes = &self.parts.shapes;
        let costs = tried.iter().map(|(cost, at, _)| (*cost, at.clone())).collect();
        let places = apart(costs, shapes, &usual, FOLLOWED.max(FOLLOWED_EACH * count));
        let ends = places.into_par_iter().filter_map(|place| {
            let (_, at, best) = tried.iter().find(|(_, at, _)| *at == place)?;
            let start = self.start(at, best);
            let [lower, upper] = self.coordinates.bounds(&start);
            let end = SHORT
                .run(&start, [&lower, &upper], |at| self.likelihood.local(Curvature::FromAfar, at));
            (end.stop != Stop::NotFinite).then_some((end.local.value, end.at))
        });
        apart(ends.collect(), shapes, &usual, count)
    }

    /// The law with its shapes at a place.
    fn law(&self, place: usize) -> Law {
        let mut at = with_shapes(self.coordinates, &self.parts.shapes, place);
        for &index in &self.parts.amplitudes {
            at[index] = self.coordinates.list[index].rising_ends()[0];
        }
        for &[index, _] in &self.parts.redundant {
            at[index] = self.coordinates.list[index].ends()[0];
        }
        let least = self.sigma0(&at);
        let rises = self.parts.amplitudes.iter().map(|&index| {
            let mut raised = at.clone();
            raised[index] = self.coordinates.list[index].rising_ends()[1];
            let most = self.sigma0(&raised);
            most.iter().zip(&least).map(|(most, least)| most - least).collect()
        });
        Law { rises: rises.collect(), least, at }
    }

    fn sigma0(&self, at: &DVector<f64>) -> Vec<f64> {
        let table = self.coordinates.table(at, &self.likelihood.aspects);
        table.values().iter().map(|ln_sigma0| ln_sigma0.exp()).collect()
    }

    /// The best amplitudes and looks at a place. Of several amplitudes each in turn is the first that explains the rows; a law
    /// whose levels are held has none.
    fn best(&self, law: &Law) -> Best {
        let alone: Vec<f64> = law.rises.iter().map(|rise| self.alone_ln(rise)).collect();
        let mut best = Best { cost: f64::INFINITY, amplitudes_ln: DVector::zeros(0), looks: 1.0 };
        for first in 0..alone.len().max(1) {
            let start = alone.iter().enumerate().map(|(index, ln)| {
                let ln = if index == first { *ln } else { ln - BELOW };
                ln.max(LEAST_LN)
            });
            let found = self.best_from(law, DVector::from_iterator(alone.len(), start));
            if found.cost < best.cost {
                best = found;
            }
        }
        best
    }

    /// ln of the amplitude with which one part alone passes through the middle of the detections.
    fn alone_ln(&self, rise: &[f64]) -> f64 {
        let rise_ln = Table::of(rise.iter().map(|rise| rise.max(f64::MIN_POSITIVE).ln()).collect());
        let mut ratios: Vec<f64> = self
            .likelihood
            .detections()
            .map(|(ln_sigma0, place)| ln_sigma0 - rise_ln.at(place))
            .collect();
        ratios.sort_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).map_or(0.0, |middle| middle.clamp(LEAST_LN, 0.0))
    }

    /// Amplitudes and looks in turn, from some amplitudes and one look.
    fn best_from(&self, law: &Law, start: DVector<f64>) -> Best {
        let ends = [start.map(|_| LEAST_LN), start.map(|_| 0.0)];
        let mut found = Best { cost: f64::INFINITY, amplitudes_ln: start, looks: 1.0 };
        let one_look = |(looks, _): &(f64, GammaLaw)| looks.ln().abs();
        let near_one = self.laws.iter().map(one_look).enumerate();
        let mut of_looks = near_one.min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(i, _)| i);
        for _ in 0..TURNS {
            let speckle = &self.laws[of_looks].1;
            found.amplitudes_ln = LEVELS
                .run(&found.amplitudes_ln, [&ends[0], &ends[1]], |amplitudes_ln| {
                    let tables = law.tables(amplitudes_ln, speckle);
                    self.likelihood.local_of(Curvature::FromAfar, &tables)
                })
                .at;
            let ln_sigma0 = law.ln_sigma0(&found.amplitudes_ln);
            let before = of_looks;
            (of_looks, found.cost, found.looks) = self.best_looks(&ln_sigma0, of_looks);
            if of_looks == before {
                break;
            }
        }
        found
    }

    /// The looks of highest ln p for a mean: their number among those tried, −ln p and the looks at the top of the parabola
    /// through the best three.
    fn best_looks(&self, ln_sigma0: &Table, start: usize) -> (usize, f64, f64) {
        let cost = |index: usize| match self.laws.get(index) {
            Some((_, law)) => -self.likelihood.ln_p_of(ln_sigma0, law),
            None => f64::INFINITY,
        };
        let (mut at, mut here) = (start, cost(start));
        let (mut below, mut above) = (cost(at.wrapping_sub(1)), cost(at + 1));
        while above < here || below < here {
            if above < below {
                (at, below, here, above) = (at + 1, here, above, cost(at + 2));
            } else {
                (at, above, here, below) = (at - 1, here, below, cost(at.wrapping_sub(2)));
            }
        }
        let bend = above + below - 2.0 * here;
        let shift = 0.5 * (below - above) / bend;
        if !shift.is_finite() || shift.abs() > 1.0 {
            return (at, here, self.laws[at].0);
        }
        (at, here - 0.5 * bend * shift * shift, self.laws[at].0 * LOOKS_APART.powf(shift))
    }

    /// The point of the search for the best amplitudes and looks at a place.
    fn start(&self, at: &DVector<f64>, best: &Best) -> DVector<f64> {
        let mut start = at.clone();
        for (&index, ln) in self.parts.amplitudes.iter().zip(&best.amplitudes_ln) {
            start[index] = self.number_of(at, index, ln.exp());
        }
        for (u, coordinate) in start.iter_mut().zip(&self.coordinates.list) {
            if coordinate.name == LOOKS {
                *u = coordinate.searched(best.looks.clamp(coordinate.min, coordinate.max));
            }
        }
        start
    }

    /// Where a number of an amplitude's is for this share of the amplitude's largest value.
    fn number_of(&self, at: &DVector<f64>, index: usize, share: f64) -> f64 {
        let ends = self.coordinates.list[index].rising_ends();
        let mut there = at.clone();
        let mut level = |u: f64| {
            there[index] = u;
            self.coordinates.model(&there).sigma0(0.0)
        };
        let [least, most] = ends.map(&mut level);
        let wanted = least + share * (most - least);
        let [mut low, mut high] = ends;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if (level(middle) < wanted) == (least < most) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

impl Law {
    /// σ⁰ for these amplitudes.
    fn sigma0(&self, amplitudes_ln: &DVector<f64>) -> Vec<f64> {
        let mut sum = self.least.clone();
        for (rise, ln) in self.rises.iter().zip(amplitudes_ln) {
            let amplitude = ln.exp();
            sum.iter_mut().zip(rise).for_each(|(sum, rise)| *sum += amplitude * rise);
        }
        sum.iter_mut().for_each(|sigma0| *sigma0 = sigma0.max(LEAST_SIGMA0));
        sum
    }

    fn ln_sigma0(&self, amplitudes_ln: &DVector<f64>) -> Table {
        Table::of(self.sigma0(amplitudes_ln).iter().map(|sigma0| sigma0.ln()).collect())
    }

    /// The law and its derivatives by ln of the amplitudes.
    fn tables(&self, amplitudes_ln: &DVector<f64>, speckle: &GammaLaw) -> Tables {
        let sigma0 = self.sigma0(amplitudes_ln);
        let by_unknown = self.rises.iter().zip(amplitudes_ln).map(|(rise, ln)| {
            let amplitude = ln.exp();
            let shares = rise.iter().zip(&sigma0).map(|(rise, sigma0)| amplitude * rise / sigma0);
            Some(Table::of(shares.collect()))
        });
        Tables {
            by_unknown: by_unknown.collect(),
            ln_sigma0: Table::of(sigma0.iter().map(|sigma0| sigma0.ln()).collect()),
            law: speckle.clone(),
        }
    }
}

/// σ⁰ that stands for 0.
const LEAST_SIGMA0: f64 = 1e-260;

/// The looks that are tried: those given, or some all over their range.
fn looks(coordinates: &Coordinates) -> Vec<f64> {
    let Some(free) = coordinates.list.iter().find(|coordinate| coordinate.name == LOOKS) else {
        return vec![coordinates.looks(&coordinates.start())];
    };
    let steps = ((free.max / free.min).ln() / LOOKS_APART.ln()).floor() as i32;
    // From the upper end: a range without one look in it may be short.
    (0..=steps).map(|step| free.max * LOOKS_APART.powi(step - steps)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::models::{model, model_names};
    use crate::fit::twin::Twin;

    #[test]
    fn a_law_is_the_sum_of_its_parts() {
        let twin = Twin { rows: 60, theta_sd_deg: 0.0, ..Twin::default() };
        let curve = twin.curve(3);
        for name in model_names() {
            let law = model(name).unwrap();
            let held = crate::fit::coordinates::frequencies(&law);
            let coordinates = Coordinates::new(&law, &held, &[], None).unwrap();
            let projection = Projection::new(&coordinates, &curve.observations, 0.0);
            let law = projection.law(5);
            let amplitudes_ln = DVector::from_element(law.rises.len(), -1.5);
            let best = Best { cost: 0.0, looks: 1.0, amplitudes_ln: amplitudes_ln.clone() };
            let start = projection.start(&law.at, &best);
            let whole = coordinates.table(&start, &projection.likelihood.aspects);
            for (found, expected) in
                law.ln_sigma0(&amplitudes_ln).values().iter().zip(whole.values())
            {
                // Levels below any receiver's are left out.
                let gap = (found - expected).abs();
                assert!(gap < 1e-5 || *expected < -100.0, "{name}: {found} {expected}");
            }
        }
    }
}
