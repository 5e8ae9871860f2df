//! Round tick marks for the axes of a figure.

/// One tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where it stands, in the axis's own unit.
    pub value: f64,
    /// What is written beside it.
    pub label: String,
}

/// Ticks at round values (1, 2 or 5 times a power of ten) from `low` to `high`, in the axis's
/// unit, about `wanted` of them and never more than one above that.
///
/// Empty when the interval is, or when its numbers are too close for `f64` to tell apart.
///
/// ```
/// let labels: Vec<String> =
///     matdb::formats::figure::ticks::ticks(-0.25, 0.25, 5).into_iter().map(|t| t.label).collect();
/// assert_eq!(labels, ["−0.2", "−0.1", "0.0", "0.1", "0.2"]);
/// ```
pub fn ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    const SLACK: f64 = 1e-9; // of a step, so that an end that is round up to rounding is kept
    const COUNTABLE: f64 = 1e15;
    let step = round_up((high - low) / wanted.max(1) as f64);
    let (first, last) = ((low / step - SLACK).ceil(), (high / step + SLACK).floor());
    if !(step.is_normal() && first.abs().max(last.abs()) < COUNTABLE && first <= last) {
        return Vec::new();
    }
    (first as i64..=last as i64)
        .map(|number| number as f64 * step)
        .map(|value| Tick { value, label: label(value, step) })
        .collect()
}

/// The next 1, 2 or 5 times a power of ten.
fn round_up(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= step * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A tick's value with as many digits as its step needs and a true minus sign.
fn label(value: f64, step: f64) -> String {
    let decimals = (-step.log10() - 1e-9).ceil();
    let text = if value == 0.0 && decimals.abs() > 6.0 {
        "0".into()
    } else if (-6.0..=6.0).contains(&decimals) {
        format!("{value:.*}", decimals.max(0.0) as usize)
    } else {
        let digits = (value.abs().log10().floor() + decimals).clamp(0.0, 15.0);
        format!("{value:.*e}", digits as usize)
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, wanted: usize) -> Vec<String> {
        ticks(low, high, wanted).into_iter().map(|t| t.label).collect()
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(labels(-77.3, -40.0, 4), ["−70", "−60", "−50", "−40"]);
        assert_eq!(labels(0.0, 1.0, 2), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(0.9, 1.35, 5), ["0.9", "1.0", "1.1", "1.2", "1.3"]);
        assert_eq!(labels(0.0, 3e-9, 3), ["0", "1e−9", "2e−9", "3e−9"]);
        assert_eq!(labels(0.0, 2e7, 2), ["0", "1e7", "2e7"]);
    }

    #[test]
    fn an_interval_without_room_has_no_ticks() {
        let nothing = [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)];
        for (low, high) in nothing {
            assert!(ticks(low, high, 5).is_empty(), "{low} to {high}");
        }
        assert!(ticks(1e20, 1e20 + 1e5, 5).is_empty());
    }
}
