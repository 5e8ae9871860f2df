//! Laws in any pair of directions as sums of closed forms, evaluated for many pairs at once in vector instructions.
//!
//! With the half vector h, a diffuse lobe is level·(n·h)^α, and facets give equation (13). A beam sees the law of their slopes
//! convolved with its own (`slopes.rs`): in the plane of i and o it adds δ² to m², across that plane δ²/cos²ψ.

use std::f64::consts::PI;

use super::backscatter::seen_cosines;
use super::lobe::Lobe;
use super::scattering::{NARROW_M, Scattering, Seen};
use super::slopes::{self, Distribution, SLOPE_NODES};
use crate::frames::{Direction, Surface};
use crate::lanes::{Wide, exp, ln, widest};

/// A look at a surface that is lit from another direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Divergence of the beam, rad; 0 for none.
    pub beam_rad: f64,
    /// Direction to the source.
    pub i: Direction<Surface>,
    /// Direction to the receiver.
    pub o: Direction<Surface>,
}

/// A law and its lobes.
pub(crate) struct Bistatic<'a> {
    law: &'a dyn Scattering,
    lobes: Option<Vec<Lobe>>,
}

impl<'a> Bistatic<'a> {
    pub(crate) fn new(law: &'a dyn Scattering) -> Bistatic<'a> {
        Bistatic { law, lobes: law.lobes() }
    }

    /// What each pair sees.
    pub(crate) fn seen(&self, pairs: &[Pair]) -> Vec<Seen> {
        let Some(lobes) = &self.lobes else {
            return pairs.iter().map(|pair| self.alone(pair)).collect();
        };
        let mut seen = sums(lobes.iter(), pairs);
        // In backscatter GGX's law has a closed form through a beam as well (`slopes.rs`).
        for (seen, pair) in seen.iter_mut().zip(pairs) {
            if pair.i == pair.o {
                *seen = self.alone(pair);
            }
        }
        seen
    }

    /// What each pair sees apart from narrow lobes, without a beam.
    pub(crate) fn apart_from_narrow_lobes(&self, pairs: &[Pair]) -> Vec<Seen> {
        match &self.lobes {
            Some(lobes) => sums(lobes.iter().filter(|lobe| !is_narrow(lobe)), pairs),
            None => {
                let pairs = pairs.iter();
                pairs.map(|pair| self.law.apart_from_narrow_lobes(pair.i, pair.o)).collect()
            }
        }
    }

    /// What one pair sees, by the law itself.
    fn alone(&self, &Pair { beam_rad, i, o }: &Pair) -> Seen {
        self.law.seen_by(beam_rad, i, o)
    }
}

/// What is seen of each of some things by the numbers of their laws: `of_law` gives that of the things in its list, which
/// all have one law.
pub(crate) fn of_each_law(
    laws: impl Iterator<Item = usize>,
    of_law: impl Fn(usize, &[usize]) -> Vec<Seen>,
) -> Vec<Seen> {
    let laws: Vec<usize> = laws.collect();
    let mut places: Vec<usize> = (0..laws.len()).collect();
    places.sort_by_key(|&place| laws[place]);
    let mut all = vec![Seen::default(); laws.len()];
    for here in places.chunk_by(|&a, &b| laws[a] == laws[b]) {
        for (&place, seen) in here.iter().zip(of_law(laws[here[0]], here)) {
            all[place] = seen;
        }
    }
    all
}

fn is_narrow(lobe: &Lobe) -> bool {
    matches!(lobe, Lobe::Facets { m, .. } if *m <= NARROW_M)
}

fn sums<'a>(lobes: impl Iterator<Item = &'a Lobe> + Clone, pairs: &[Pair]) -> Vec<Seen> {
    let mut seen = Vec::with_capacity(pairs.len());
    widest(Sums { lobes, pairs, seen: &mut seen });
    seen
}

/// The sums of lobes for many pairs.
struct Sums<'a, L> {
    lobes: L,
    pairs: &'a [Pair],
    seen: &'a mut Vec<Seen>,
}

impl<'a, L: Iterator<Item = &'a Lobe> + Clone> Wide for Sums<'_, L> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        for pairs in self.pairs.chunks(PAIRS) {
            let angles = Angles::of(pairs);
            let [mut all, mut specular, mut coherent] = [[0.0; PAIRS]; 3];
            for lobe in self.lobes.clone() {
                match *lobe {
                    Lobe::Cosines { level_per_sr, alpha } => {
                        add(&mut all, &angles.of_cosines(level_per_sr, alpha));
                    }
                    Lobe::Facets { weight, f_lambda, m, distribution } => {
                        let part = angles.of_facets(weight, f_lambda, m, distribution);
                        add(&mut all, &part);
                        add(&mut specular, &part);
                        for lane in 0..PAIRS {
                            coherent[lane] += part[lane] * coherent_share(angles.beam_rad[lane], m);
                        }
                    }
                }
            }
            let parts = all.iter().zip(specular.iter().zip(&coherent)).take(pairs.len());
            self.seen.extend(parts.map(|(&f_per_sr, (specular, coherent))| {
                let [specular_share, coherent_share] = [specular, coherent]
                    .map(|part| if f_per_sr > 0.0 { part / f_per_sr } else { 0.0 });
                Seen { f_per_sr, specular_share, coherent_share }
            }));
        }
    }
}

#[inline(always)]
fn add(sums: &mut [f64; PAIRS], parts: &[f64; PAIRS]) {
    for (sum, part) in sums.iter_mut().zip(parts) {
        *sum += part;
    }
}

/// Share of a lobe that comes back in one phase, δ²/(m² + δ²); all of it without any width.
#[inline(always)]
fn coherent_share(beam_rad: f64, m: f64) -> f64 {
    let beam2 = beam_rad * beam_rad;
    let width2 = m * m + beam2;
    if width2 > 0.0 { beam2 / width2 } else { 1.0 }
}

/// Pairs that are computed side by side.
const PAIRS: usize = 32;

type Numbers = [f64; PAIRS];

/// What lobes depend on, of each pair; what is missing of a chunk is seen from below the horizon.
struct Angles {
    beam_rad: Numbers,
    cos_i: Numbers,
    cos_o: Numbers,
    /// n·h, o·h.
    n_h: Numbers,
    o_h: Numbers,
    /// Slope of the facets squared, and its part in the plane of i and o.
    slope2: Numbers,
    along2: Numbers,
    /// What the beam adds across that plane, δ²/cos²ψ.
    across_beam2: Numbers,
}

impl Angles {
    #[inline(always)]
    fn of(pairs: &[Pair]) -> Angles {
        let mut beam_rad = [0.0; PAIRS];
        let [mut i, mut o] = [[[0.0; PAIRS]; 3]; 2];
        for (lane, pair) in pairs.iter().enumerate() {
            beam_rad[lane] = pair.beam_rad;
            for axis in 0..3 {
                i[axis][lane] = pair.i.xyz()[axis];
                o[axis][lane] = pair.o.xyz()[axis];
            }
        }
        let [cos_i, cos_o] = [i[2], o[2]];
        let [mut n_h, mut o_h, mut slope2, mut along2, mut across_beam2] = [[0.0; PAIRS]; 5];
        for lane in 0..PAIRS {
            let [sum_x, sum_y, sum_z] = [0, 1, 2].map(|axis| i[axis][lane] + o[axis][lane]);
            let across2 = sum_x * sum_x + sum_y * sum_y;
            let per_length = 1.0 / (across2 + sum_z * sum_z).sqrt();
            n_h[lane] = sum_z * per_length;
            let dot = [0, 1, 2].map(|axis| o[axis][lane] * (i[axis][lane] + o[axis][lane]));
            o_h[lane] = (dot[0] + dot[1] + dot[2]) * per_length;
            slope2[lane] = across2 / (sum_z * sum_z);
            // The plane of i and o, seen from above.
            let [x, y] = [0, 1].map(|axis| o[axis][lane] - i[axis][lane]);
            let apart2 = x * x + y * y;
            let along = sum_x * x + sum_y * y;
            let in_plane = along * along / (apart2 * sum_z * sum_z);
            along2[lane] = if apart2 > 0.0 { in_plane } else { slope2[lane] };
            let [a, b, c] = [0, 1, 2].map(|axis| i[axis][lane] * o[axis][lane]);
            let cos2_psi = 0.5 * (1.0 + (a + b + c));
            let cos2_psi = if cos2_psi > f64::EPSILON { cos2_psi } else { f64::EPSILON };
            let beam2 = beam_rad[lane] * beam_rad[lane];
            across_beam2[lane] = if apart2 > 0.0 { beam2 / cos2_psi } else { beam2 };
        }
        Angles { beam_rad, cos_i, cos_o, n_h, o_h, slope2, along2, across_beam2 }
    }

    #[inline(always)]
    fn of_cosines(&self, level_per_sr: f64, alpha: f64) -> Numbers {
        let mut part = [0.0; PAIRS];
        for (lane, part) in part.iter_mut().enumerate() {
            let (alpha, share) = seen_cosines(alpha, self.beam_rad[lane]);
            let lobe = level_per_sr * share * exp(alpha * ln(self.n_h[lane]));
            *part = if self.is_above_horizon(lane) { lobe } else { 0.0 };
        }
        part
    }

    #[inline(always)]
    fn of_facets(&self, weight: f64, f_lambda: f64, m: f64, distribution: Distribution) -> Numbers {
        let density = match distribution {
            Distribution::Beckmann => self.beckmann(m),
            Distribution::Ggx => self.ggx(m),
        };
        let mut part = [0.0; PAIRS];
        for lane in 0..PAIRS {
            let [cos_i, cos_o] = [self.cos_i[lane], self.cos_o[lane]];
            let n_h2 = self.n_h[lane] * self.n_h[lane];
            let away = 1.0 - self.o_h[lane].abs();
            let away4 = (away * away) * (away * away);
            let fresnel = f_lambda + (1.0 - f_lambda) * (away4 * away);
            let shadowing = distribution.g1(cos_i, m) * distribution.g1(cos_o, m);
            let facets = density[lane] / (n_h2 * n_h2) * shadowing / (4.0 * cos_i * cos_o);
            part[lane] = if self.is_above_horizon(lane) { weight * fresnel * facets } else { 0.0 };
        }
        part
    }

    #[inline(always)]
    fn is_above_horizon(&self, lane: usize) -> bool {
        (self.cos_i[lane] > 0.0) & (self.cos_o[lane] > 0.0)
    }

    /// The density of Beckmann's slopes.
    #[inline(always)]
    fn beckmann(&self, m: f64) -> Numbers {
        let mut density = [0.0; PAIRS];
        for (lane, density) in density.iter_mut().enumerate() {
            *density = self.gaussian(lane, m * m)[1];
        }
        density
    }

    /// The density of GGX's slopes, by the mixture of `slopes.rs` where there is a beam.
    #[inline(always)]
    fn ggx(&self, m: f64) -> Numbers {
        let mut density = [0.0; PAIRS];
        for (lane, density) in density.iter_mut().enumerate() {
            let over = 1.0 + self.slope2[lane] / (m * m);
            *density = 1.0 / (PI * m * m * (over * over));
        }
        if self.beam_rad == [0.0; PAIRS] {
            return density;
        }
        let [mut sum, mut grows] = [[0.0; PAIRS], [1.0; PAIRS]];
        for &(t, weight) in SLOPE_NODES.iter() {
            for lane in 0..PAIRS {
                let [exponent, of_t] = self.gaussian(lane, m * m / t);
                let term = weight * of_t;
                sum[lane] += grows[lane] * term;
                let is_flat = slopes::is_negligible(exponent, term, sum[lane]);
                grows[lane] = if is_flat { 0.0 } else { grows[lane] };
            }
        }
        for lane in 0..PAIRS {
            density[lane] = if self.beam_rad[lane] > 0.0 { sum[lane] } else { density[lane] };
        }
        density
    }

    /// Exponent and density of Gaussian slopes of m², seen by the beam.
    #[inline(always)]
    fn gaussian(&self, lane: usize, m2: f64) -> [f64; 2] {
        let along = m2 + self.beam_rad[lane] * self.beam_rad[lane];
        let across = m2 + self.across_beam2[lane];
        let across2 = self.slope2[lane] - self.along2[lane];
        let exponent = self.along2[lane] / along + across2 / across;
        [exponent, exp(-exponent) / (PI * (along * across).sqrt())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::models::Brdf;
    use crate::brdf::models::tests::every_model;
    use crate::lanes::at_most;
    use crate::units::db_from_ratio;

    /// Pairs over the whole half space, below the horizon too, without a beam and with several.
    fn pairs() -> Vec<Pair> {
        let angles = [0.0, 1e-7, 0.02, 0.3, 0.9, 1.4, 1.55, 1.7];
        let azimuths = [0.0, 0.4, 1.57, 3.1, std::f64::consts::PI];
        let mut pairs = Vec::new();
        for theta_i in angles {
            for theta_o in angles {
                for azimuth in azimuths {
                    let i = Direction::from_angles(theta_i, 0.7);
                    let o = Direction::from_angles(theta_o + 1e-4, 0.7 + azimuth);
                    let of_beam = |beam_rad| [Pair { beam_rad, i, o }, Pair { beam_rad, i: o, o }];
                    pairs.extend([0.0, 1e-3, 0.0117, 0.3].into_iter().flat_map(of_beam));
                }
            }
        }
        pairs
    }

    /// Levels below any receiver's, where a narrow lobe underflows.
    const NOTHING: f64 = 1e-200;

    fn assert_near(model: &Brdf, pair: &Pair, found: &Seen, expected: &Seen) -> f64 {
        if expected.f_per_sr < NOTHING {
            assert!(found.f_per_sr < 2.0 * NOTHING, "{model:?} {pair:?}: {found:?}");
            return 0.0;
        }
        let apart = [
            found.specular_share - expected.specular_share,
            found.coherent_share - expected.coherent_share,
        ];
        assert!(
            apart.iter().all(|apart| apart.abs() < 1e-5),
            "{model:?} {pair:?}: {found:?} {expected:?}"
        );
        db_from_ratio(found.f_per_sr / expected.f_per_sr).abs()
    }

    /// 1e-4 dB is what a caller is promised.
    #[test]
    fn a_law_of_any_parameters_is_within_a_ten_thousandth_of_a_decibel() {
        let pairs = pairs();
        let (mut worst_db, mut with_lobes) = (0.0f64, 0);
        for mut model in every_model() {
            for share in [0.0, 0.07, 0.5, 0.93, 1.0] {
                for parameter in model.parameters() {
                    let value = parameter.min + share * (parameter.max - parameter.min);
                    model.set_parameter(&parameter.path, value);
                }
                let law = Bistatic::new(&model);
                if law.lobes.is_none() {
                    continue;
                }
                with_lobes += 1;
                let apart = law.apart_from_narrow_lobes(&pairs);
                for ((found, apart), pair) in law.seen(&pairs).iter().zip(apart).zip(&pairs) {
                    let Pair { beam_rad, i, o } = *pair;
                    let error_db = assert_near(&model, pair, found, &model.seen_by(beam_rad, i, o));
                    worst_db = worst_db.max(error_db);
                    if beam_rad == 0.0 {
                        let expected = model.apart_from_narrow_lobes(i, o);
                        worst_db = worst_db.max(assert_near(&model, pair, &apart, &expected));
                    }
                }
            }
        }
        assert!(worst_db < 1e-4 && with_lobes > 30, "{worst_db} dB, {with_lobes}");
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let pairs = pairs();
        for model in every_model() {
            let law = Bistatic::new(&model);
            let bits = |width| {
                let seen = at_most(width, || law.seen(&pairs));
                let parts = seen
                    .iter()
                    .flat_map(|seen| [seen.f_per_sr, seen.specular_share, seen.coherent_share]);
                parts.map(f64::to_bits).collect::<Vec<u64>>()
            };
            let [plain, of_256, of_512] = [128, 256, 512].map(bits);
            assert!(plain == of_256 && plain == of_512, "{model:?}");
        }
    }
}
