//! What the colours of plots and bars stand for. No other file says so.

use super::drawing::Rgb;

/// What a colour stands for. A colour with a meaning stands for nothing else in any picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// What was detected, and the limits of what was not.
    Detections,
    /// The model before anything was added to it.
    Before,
    /// The model with what was added to it.
    After,
    /// One of the colours without a meaning of their own, by its number: a law, a fit or one of several curves.
    Own(usize),
}

// Okabe and Ito, 2008, and three of Tol, 2021: they stay apart for colour-blind readers.
const DETECTIONS: Rgb = [0, 114, 178];
const BEFORE: Rgb = [213, 94, 0];
const AFTER: Rgb = [0, 158, 115];
const OWN: [Rgb; 6] =
    [[51, 34, 136], [204, 121, 167], [230, 159, 0], [86, 180, 233], [136, 34, 85], [117, 112, 36]];

impl Ink {
    /// Its colour.
    pub fn colour(self) -> Rgb {
        match self {
            Ink::Detections => DETECTIONS,
            Ink::Before => BEFORE,
            Ink::After => AFTER,
            Ink::Own(number) => OWN[number % OWN.len()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_meanings_share_a_colour() {
        let mut inks = vec![Ink::Detections, Ink::Before, Ink::After];
        inks.extend((0..OWN.len()).map(Ink::Own));
        for (place, ink) in inks.iter().enumerate() {
            for other in &inks[..place] {
                let [a, b] = [ink, other].map(|ink| ink.colour());
                let parts = std::iter::zip(a, b).map(|(a, b)| i32::from(a.abs_diff(b)));
                let apart: i32 = parts.sum();
                assert!(apart > 80, "{ink:?} and {other:?}");
            }
        }
        assert_eq!(Ink::Own(OWN.len()).colour(), Ink::Own(0).colour());
    }
}
