//! f of a law at pairs of directions, part by part: a search steps one number at a time, and only the part that has this
//! number is computed anew.

use std::rc::Rc;

use crate::brdf::{Brdf, Scattering};
use crate::frames::{Direction, Surface};

/// A law at pairs of directions.
pub(crate) struct ByParts {
    parts: Vec<Part>,
}

/// A part of a sum or a mixture, or the whole of another law.
struct Part {
    weight: f64,
    law: Brdf,
    f_per_sr: Rc<Vec<f64>>,
}

impl ByParts {
    /// A law at these pairs of directions, towards source and receiver.
    pub fn new(law: &Brdf, directions: &[[Direction<Surface>; 2]]) -> ByParts {
        ByParts { parts: Vec::new() }.moved_to(law, directions)
    }

    /// Another law at the same directions, which shares the parts that are the same.
    pub fn moved_to(&self, law: &Brdf, directions: &[[Direction<Surface>; 2]]) -> ByParts {
        let part = |(place, (weight, law)): (usize, (f64, &Brdf))| {
            let known = self.parts.get(place).filter(|known| known.law == *law);
            let f_per_sr = known.map_or_else(
                || Rc::new(directions.iter().map(|&[i, o]| law.f_per_sr(i, o)).collect()),
                |known| Rc::clone(&known.f_per_sr),
            );
            Part { weight, law: law.clone(), f_per_sr }
        };
        ByParts { parts: parts_of(law).into_iter().enumerate().map(part).collect() }
    }

    /// f at each of the directions, 1/sr.
    pub fn f_per_sr(&self) -> Vec<f64> {
        let count = self.parts.first().map_or(0, |part| part.f_per_sr.len());
        let mut sum = vec![0.0; count];
        for part in &self.parts {
            for (sum, f_per_sr) in sum.iter_mut().zip(part.f_per_sr.iter()) {
                *sum += part.weight * f_per_sr;
            }
        }
        sum
    }
}

/// The parts of a law with their weights.
fn parts_of(law: &Brdf) -> Vec<(f64, &Brdf)> {
    match law {
        Brdf::Sum(sum) => sum.weighted().collect(),
        Brdf::Mixture(mixture) => mixture.weighted().collect(),
        whole => vec![(1.0, whole)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{model, model_names};

    #[test]
    fn a_law_by_its_parts_is_the_law() {
        let towards = |deg: f64| Direction::from_angles(deg.to_radians(), 0.3);
        let directions: Vec<[Direction<Surface>; 2]> =
            (0..9).map(|k| [towards(10.0 * f64::from(k)), towards(80.0)]).collect();
        for name in model_names() {
            let mut law = model(name).unwrap();
            let mut known = ByParts::new(&law, &directions);
            for parameter in law.clone().parameters() {
                assert!(law.set_parameter(&parameter.path, 0.999 * parameter.value));
                let moved = known.moved_to(&law, &directions);
                let pairs = std::iter::zip(&moved.parts, &known.parts);
                let anew = pairs.filter(|(a, b)| !Rc::ptr_eq(&a.f_per_sr, &b.f_per_sr)).count();
                assert!(anew <= 1, "{name} {}: {anew} parts are computed", parameter.path);
                known = moved;
                let whole: Vec<f64> = directions.iter().map(|&[i, o]| law.f_per_sr(i, o)).collect();
                assert_eq!(known.f_per_sr(), whole, "{name} {}", parameter.path);
            }
        }
    }
}
