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

/// Hues of OKLab, degrees, of less and of more than a model predicts: blue and red, as on [`Scale::Diverging`]. Pages
/// whose colours follow a light or a dark screen make their own ramps of them.
///
/// [`Scale::Diverging`]: super::Scale::Diverging
pub const LESS_AND_MORE_HUE_DEG: [f64; 2] = [250.0, 28.0];

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
    use super::super::Scale;
    use super::*;

    /// Hue of OKLab (Ottosson, 2020), degrees.
    fn hue_deg(colour: Rgb) -> f64 {
        let [r, g, b] = colour.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
        });
        let l = (0.412222 * r + 0.536333 * g + 0.051446 * b).cbrt();
        let m = (0.211903 * r + 0.680700 * g + 0.107397 * b).cbrt();
        let s = (0.088302 * r + 0.281719 * g + 0.629979 * b).cbrt();
        let across = 1.977998 * l - 2.428592 * m + 0.450594 * s;
        let along = 0.025904 * l + 0.782772 * m - 0.808676 * s;
        along.atan2(across).to_degrees().rem_euclid(360.0)
    }

    #[test]
    fn less_and_more_have_the_hues_of_the_maps() {
        for (share, hue) in [0.15, 0.85].into_iter().zip(LESS_AND_MORE_HUE_DEG) {
            let found = hue_deg(Scale::Diverging.colour_at(share));
            assert!((found - hue).abs() < 15.0, "{found}° on the maps, {hue}° on pages");
        }
    }

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
