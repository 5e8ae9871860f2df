//! Checks of numbers against their ranges.

use super::error::{MaterialError, value};

/// Largest number of a material: levels of 3000 dB. Beyond, units and decibels overflow.
pub(super) const MOST: f64 = 1e300;

/// Whether a number is finite and within ±[`MOST`].
pub(super) fn is_number(x: f64) -> bool {
    x.abs() <= MOST
}

/// Whether a number is positive and no more than [`MOST`].
pub(super) fn is_level(x: f64) -> bool {
    x > 0.0 && x <= MOST
}

/// Checks the numbers of one place against their ranges.
#[derive(Clone, Copy)]
pub(super) struct NumberCheck<'a> {
    place: &'a str,
}

impl<'a> NumberCheck<'a> {
    /// Of the numbers of a place.
    pub fn new(place: &'a str) -> NumberCheck<'a> {
        NumberCheck { place }
    }

    /// Refuses numbers that are not above 0.
    pub fn positive(
        self,
        what: &str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), MaterialError> {
        self.all(what, "is not positive", numbers, |x| x > 0.0)
    }

    /// Refuses numbers below 0.
    pub fn not_negative(
        self,
        what: &str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), MaterialError> {
        self.all(what, "is negative or no number", numbers, |x| x >= 0.0)
    }

    /// Refuses numbers below the least.
    pub fn at_least(
        self,
        what: &str,
        least: f64,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), MaterialError> {
        self.all(what, &format!("is below {least}"), numbers, |x| x >= least)
    }

    /// Refuses infinite numbers, NaN and those beyond ±[`MOST`], as do all others.
    pub fn finite(
        self,
        what: &str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), MaterialError> {
        self.all(what, "is not finite", numbers, |_| true)
    }

    /// Refuses angles, rad, outside 0 to π/2.
    pub fn quarter_turn(
        self,
        what: &str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), MaterialError> {
        let quarter = 0.0..=std::f64::consts::FRAC_PI_2;
        self.all(what, "is not within 0–90°", numbers, |x| quarter.contains(&x))
    }

    fn all(
        self,
        what: &str,
        problem: &str,
        numbers: impl IntoIterator<Item = f64>,
        good: impl Fn(f64) -> bool,
    ) -> Result<(), MaterialError> {
        let Some(bad) = numbers.into_iter().find(|&x| !is_number(x) || !good(x)) else {
            return Ok(());
        };
        let is_beyond = bad.is_finite() && !is_number(bad);
        let problem = if is_beyond { "is beyond 1e300" } else { problem };
        Err(value(self.place, &format!("{what} {problem}"), "mend it or leave it out"))
    }
}
