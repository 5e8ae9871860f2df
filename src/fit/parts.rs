//! Which numbers of a law scale parts of it, and which are the shapes of these parts.
//!
//! Given its shapes a law is σ⁰(θ) = c(θ) + Σ a_j·b_j(θ). Each amplitude a_j rises with one number: a level itself, S² of a
//! directive lobe, or the permittivity of a mirror, which reflects the same share at each tilt of its facets in
//! backscatter. Two numbers that change a law alike, as ε′ and ε″ do there, are one amplitude, and the second is redundant.

use nalgebra::DVector;

use super::coordinates::{Coordinates, LOOKS};
use super::shapes::evenly;
use crate::material::{Aspect, Observation};

/// Incidences at which laws are compared in backscatter, rad.
const ANGLES_RAD: [f64; 8] = [0.0, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.3];
/// Shares of a number's range at which it is tested.
const SHARES: [f64; 3] = [0.1, 0.5, 0.9];
/// Relative error of a difference that still counts as none, and of σ⁰ itself by rounding.
const ALIKE: f64 = 1e-6;
const ROUNDING: f64 = 1e-12;

/// Angles of source and receiver in the plane of incidence at which they are compared as well where curves have two
/// directions, rad; the receiver's is positive on the mirror's side.
const PAIRS_RAD: [[f64; 2]; 8] = [
    [0.3, 0.3],
    [0.6, 0.6],
    [1.0, 1.0],
    [1.3, 1.3],
    [0.3, 1.0],
    [1.0, 0.1],
    [0.6, -0.1],
    [1.0, -0.5],
];

/// σ⁰ at the aspects of the comparison.
type Levels = Vec<f64>;

/// The aspects at which a law is compared that is fitted to these rows.
fn compared(rows: &[Observation]) -> Vec<Aspect> {
    let retro = ANGLES_RAD.map(Aspect::retro).into_iter();
    let has_pairs = rows.iter().any(|row| !row.is_retro());
    let pairs = PAIRS_RAD.into_iter().filter(|_| has_pairs);
    retro
        .chain(pairs.map(|[theta_i_rad, theta_s_rad]| Aspect::in_plane(theta_i_rad, theta_s_rad)))
        .collect()
}

/// The numbers of a law by what they do; all but the looks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Parts {
    /// Numbers that scale a part of the law.
    pub amplitudes: Vec<usize>,
    /// Numbers that change the law only as an amplitude does, each with that one.
    pub redundant: Vec<[usize; 2]>,
    /// All others.
    pub shapes: Vec<usize>,
}

/// How two numbers act together.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Together {
    /// Each by itself.
    Apart,
    /// Both alike.
    Alike,
    /// One changes what the other does.
    Mixed,
}

impl Parts {
    /// The parts of a law that is fitted to these rows.
    pub fn of(coordinates: &Coordinates, rows: &[Observation]) -> Parts {
        let law = Law { coordinates, aspects: compared(rows) };
        let numbers: Vec<usize> =
            (0..coordinates.len()).filter(|&i| coordinates.list[i].name != LOOKS).collect();
        let start = coordinates.start();
        let (amplitudes, shapes): (Vec<usize>, Vec<usize>) =
            numbers.into_iter().partition(|&index| law.is_amplitude(&start, index));
        // Away from the start, where different lobes may be equal.
        let base = with_shapes(coordinates, &shapes, 0);
        let mut parts = Parts { shapes, ..Parts::default() };
        for index in amplitudes {
            if !law.is_amplitude(&base, index) {
                parts.shapes.push(index);
                continue;
            }
            let of_others = parts.amplitudes.iter();
            let relations: Vec<(usize, Together)> =
                of_others.map(|&other| (other, law.together(&base, [other, index]))).collect();
            if let Some(&(other, _)) = relations.iter().find(|(_, how)| *how == Together::Alike) {
                parts.redundant.push([index, other]);
            } else if relations.iter().any(|(_, how)| *how == Together::Mixed) {
                parts.shapes.push(index);
            } else {
                parts.amplitudes.push(index);
            }
        }
        parts
    }
}

/// The start of a search with its shapes at place `number` of all that cover their ranges.
pub(super) fn with_shapes(
    coordinates: &Coordinates,
    shapes: &[usize],
    number: usize,
) -> DVector<f64> {
    let mut at = coordinates.start();
    for (&index, share) in shapes.iter().zip(evenly(number, shapes.len())) {
        let [low, high] = coordinates.list[index].usual_ends();
        at[index] = low + share * (high - low);
    }
    at
}

/// A law and the aspects at which it is compared.
struct Law<'a> {
    coordinates: &'a Coordinates,
    aspects: Vec<Aspect>,
}

impl Law<'_> {
    fn levels(&self, at: &DVector<f64>) -> Levels {
        let law = self.coordinates.model(at);
        self.aspects.iter().map(|aspect| aspect.sigma0(&law)).collect()
    }

    /// A number at a share of its range.
    fn place(&self, index: usize, share: f64) -> f64 {
        let [low, high] = self.coordinates.list[index].rising_ends();
        low + share * (high - low)
    }

    /// Whether a number changes σ⁰ by the same multiple of one curve wherever it is.
    fn is_amplitude(&self, at: &DVector<f64>, index: usize) -> bool {
        let mut there = at.clone();
        let [low, middle, high] = SHARES.map(|share| {
            there[index] = self.place(index, share);
            self.levels(&there)
        });
        are_alike([&low, &middle], [&middle, &high])
    }

    /// How two amplitudes act together, from the law with neither, one and both of them raised.
    fn together(&self, at: &DVector<f64>, numbers: [usize; 2]) -> Together {
        let raised = |shares: [f64; 2]| {
            let mut there = at.clone();
            for (index, share) in numbers.into_iter().zip(shares) {
                there[index] = self.place(index, share);
            }
            self.levels(&there)
        };
        let [low, _, high] = SHARES;
        let neither = raised([low, low]);
        let (first, second, both) =
            (raised([high, low]), raised([low, high]), raised([high, high]));
        if are_alike([&neither, &first], [&neither, &second]) {
            return Together::Alike;
        }
        for i in 0..neither.len() {
            let mixed = both[i] - first[i] - second[i] + neither[i];
            if mixed.abs() > ALIKE * both[i].max(first[i]).max(second[i]) {
                return Together::Mixed;
            }
        }
        Together::Apart
    }
}

/// Whether two differences of curves are multiples of each other.
fn are_alike([a, b]: [&Levels; 2], [c, d]: [&Levels; 2]) -> bool {
    let first: Levels = b.iter().zip(a).map(|(b, a)| b - a).collect();
    let second: Levels = d.iter().zip(c).map(|(d, c)| d - c).collect();
    let largest = (0..first.len()).max_by(|&i, &j| second[i].abs().total_cmp(&second[j].abs()));
    let Some(largest) = largest.filter(|&largest| second[largest] != 0.0) else { return false };
    let ratio = first[largest] / second[largest];
    (0..first.len()).all(|i| {
        let rounding =
            ROUNDING * (a[i].abs() + b[i].abs() + ratio.abs() * (c[i].abs() + d[i].abs()));
        let expected = ratio * second[i];
        (first[i] - expected).abs() <= ALIKE * expected.abs() + rounding
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::coordinates::frequencies;
    use crate::fit::models::{model, model_names};
    use crate::fit::twin::mixture;

    /// Names of amplitudes, redundant numbers and shapes, each in one text.
    fn names(law: &crate::brdf::Brdf, rows: &[Observation]) -> [String; 3] {
        let coordinates = Coordinates::new(law, &frequencies(law), &[], None).unwrap();
        let Parts { amplitudes, redundant, shapes } = Parts::of(&coordinates, rows);
        let name = |index: usize| coordinates.list[index].name.clone();
        let joined = |all: Vec<usize>| all.into_iter().map(name).collect::<Vec<_>>().join(" ");
        [
            joined(amplitudes),
            joined(redundant.into_iter().map(|[i, _]| i).collect()),
            joined(shapes),
        ]
    }

    #[test]
    fn amplitudes_are_told_from_shapes() {
        let expected = [
            ("lambert", ["albedo", "", ""]),
            ("mixture", ["R S", "", "diffuse.alpha specular.m"]),
            ("fresnel", ["eps_real", "eps_imag", "lobe_rad"]),
            ("kirchhoff-go", ["eps_real", "eps_imag", "rms_slope"]),
            ("directive", ["s", "", "alpha_r alpha_i lambda"]),
        ];
        for (name, numbers) in expected {
            assert_eq!(names(&model(name).unwrap(), &[]), numbers, "{name}");
        }
        for name in model_names() {
            assert!(!names(&model(name).unwrap(), &[])[0].is_empty(), "{name}");
        }
        assert_eq!(names(&mixture(0.07, 6.0, 0.05, 0.002), &[])[0], "R S");
        // Seen from elsewhere the reflectance of a facet depends on how it is met.
        let mirror = Observation {
            delta_phi_rad: std::f64::consts::PI,
            ..Observation::backscatter(0.5, Some(1.0), None)
        };
        for (name, shapes) in
            [("fresnel", "eps_real eps_imag lobe_rad"), ("mixture", "diffuse.alpha specular.m")]
        {
            let [_, redundant, found] = names(&model(name).unwrap(), &[mirror]);
            assert_eq!((redundant.as_str(), found.as_str()), ("", shapes), "{name}");
        }
    }

    #[test]
    fn of_two_numbers_whose_product_counts_one_is_a_shape() {
        let law = mixture(0.05, 6.0, 0.05, 0.002);
        let fixed = [("specular.f_lambda".to_owned(), 0.056)];
        let coordinates = Coordinates::new(&law, &fixed, &[], Some(1.0)).unwrap();
        let parts = Parts::of(&coordinates, &[]);
        assert_eq!((parts.amplitudes.len(), parts.shapes.len()), (1, 3), "{parts:?}");
    }
}
