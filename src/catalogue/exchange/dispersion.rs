//! Dispersion formulas of refractiveindex.info: the refractive index against the wavelength.

use super::page::{Block, number};
use crate::formats::FormatError;

/// A dispersion formula of refractiveindex.info with its coefficients C1, C2 …
pub(super) struct Formula {
    number: u32,
    coefficients: Vec<f64>,
    range_um: [f64; 2],
}

/// The numbers of a block under the first of these keys that it has.
fn numbers(block: &Block, keys: &[&str]) -> Result<Vec<f64>, FormatError> {
    let Some((line, text)) = keys.iter().find_map(|key| block.values.get(key)) else {
        let (place, key) = (format!("line {}", block.line), keys.first().unwrap_or(&""));
        let problem = format!("`{}` has no `{key}`", block.kind);
        return Err(FormatError::at(place, problem, format!("add `{key}: …`")));
    };
    text.split_whitespace().map(|word| number(word, *line)).collect()
}

pub(super) fn formula(block: &Block, kind: &str) -> Result<Formula, FormatError> {
    let place = format!("line {}", block.line);
    let number_of = kind.strip_prefix("formula ").and_then(|number| number.trim().parse().ok());
    let Some(number_of @ 1..=9) = number_of else {
        let problem = format!("data of the type {kind:?} are not known");
        let way_out = "known are tabulated nk, tabulated n, tabulated k and formula 1 to 9";
        return Err(FormatError::at(place, problem, way_out));
    };
    let coefficients = numbers(block, &["coefficients"])?;
    let range_um = numbers(block, &["wavelength_range", "range"])?;
    let range_um = <[f64; 2]>::try_from(range_um).map_err(|_| {
        FormatError::at(place.clone(), "wavelength_range has not two numbers", "give both ends")
    })?;
    if coefficients.is_empty() {
        return Err(FormatError::at(place, "there are no coefficients", "give at least one"));
    }
    Ok(Formula { number: number_of, coefficients, range_um })
}

impl Formula {
    /// n at a wavelength in µm; none outside the formula's range or where it has no value.
    ///
    /// The nine formulas are those of refractiveindex.info's list of dispersion formulas: Sellmeier,
    /// Sellmeier-2, polynomial, its own general one, Cauchy, gases, Herzberger, retro, exotic.
    pub fn at(&self, wavelength_um: f64) -> Option<f64> {
        let [low, high] = self.range_um;
        if !(low..=high).contains(&wavelength_um) {
            return None;
        }
        let (l, l2) = (wavelength_um, wavelength_um * wavelength_um);
        let c = |number: usize| self.coefficient(number);
        let n = match self.number {
            1 => (1.0 + c(1) + self.sum_pairs(2, |a, b| a * l2 / (l2 - b * b))).sqrt(),
            2 => (1.0 + c(1) + self.sum_pairs(2, |a, b| a * l2 / (l2 - b))).sqrt(),
            3 => (c(1) + self.sum_pairs(2, |a, b| a * l.powf(b))).sqrt(),
            4 => {
                let general = c(1) + self.resonance(2, l) + self.resonance(6, l);
                (general + self.sum_pairs(10, |a, b| a * l.powf(b))).sqrt()
            }
            5 => c(1) + self.sum_pairs(2, |a, b| a * l.powf(b)),
            6 => 1.0 + c(1) + self.sum_pairs(2, |a, b| a / (b - 1.0 / l2)),
            7 => {
                let pole = 1.0 / (l2 - 0.028);
                c(1) + c(2) * pole
                    + c(3) * pole * pole
                    + c(4) * l2
                    + c(5) * l2.powi(2)
                    + c(6) * l2.powi(3)
            }
            8 => {
                let clausius = c(1) + c(2) * l2 / (l2 - c(3)) + c(4) * l2;
                ((1.0 + 2.0 * clausius) / (1.0 - clausius)).sqrt()
            }
            _ => {
                let off = l - c(5);
                let pole = if c(2) == 0.0 { 0.0 } else { c(2) / (l2 - c(3)) };
                let band = if c(4) == 0.0 { 0.0 } else { c(4) * off / (off * off + c(6)) };
                (c(1) + pole + band).sqrt()
            }
        };
        (n.is_finite() && n >= 0.0).then_some(n)
    }

    /// A coefficient, counted from 1; 0 where there is none.
    fn coefficient(&self, number: usize) -> f64 {
        self.coefficients.get(number - 1).copied().unwrap_or(0.0)
    }

    /// Σ of `term` over the pairs (C_first, C_first+1), (C_first+2, C_first+3) …
    fn sum_pairs(&self, first: usize, term: impl Fn(f64, f64) -> f64) -> f64 {
        let rest = self.coefficients.get(first - 1..).unwrap_or_default();
        rest.as_chunks().0.iter().map(|[a, b]| term(*a, *b)).sum()
    }

    /// The term C_first·λ^C_first+1 / (λ² − C_first+2^C_first+3) at a wavelength in µm.
    fn resonance(&self, first: usize, l: f64) -> f64 {
        let c = |offset: usize| self.coefficient(first + offset);
        let numerator = c(0) * l.powf(c(1));
        // An absent term has no pole either.
        if numerator == 0.0 { 0.0 } else { numerator / (l * l - c(2).powf(c(3))) }
    }
}
