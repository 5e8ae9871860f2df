//! Medians, shares and their limits.

use std::collections::BTreeSet;

use statrs::distribution::{Beta, ContinuousCDF};

/// So many of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    pub count: usize,
    pub of: usize,
}

impl Share {
    /// Of these, so many are true.
    pub fn of(all: impl IntoIterator<Item = bool>) -> Share {
        let add = |s: Share, yes: bool| Share { count: s.count + usize::from(yes), of: s.of + 1 };
        all.into_iter().fold(Share::default(), add)
    }

    /// Between 0 and 1; none of nothing.
    pub fn ratio(self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }

    /// What the true share is below with 95 % confidence, by Clopper and Pearson.
    pub fn upper_95(self) -> Option<f64> {
        if self.of == 0 || self.count >= self.of {
            return (self.of > 0).then_some(1.0);
        }
        let beta = Beta::new(self.count as f64 + 1.0, (self.of - self.count) as f64).ok()?;
        Some(beta.inverse_cdf(0.95))
    }

    /// What the true share is above with 95 % confidence, likewise.
    pub fn lower_95(self) -> Option<f64> {
        let others = Share { count: self.of - self.count, of: self.of };
        others.upper_95().map(|upper| 1.0 - upper)
    }

    /// For a cell of a table.
    pub fn cell(self) -> String {
        match self.ratio() {
            Some(ratio) => format!("{:.1} % ({} of {})", 100.0 * ratio, self.count, self.of),
            None => "–".into(),
        }
    }
}

/// Numbers in order.
pub struct Sorted(Vec<f64>);

impl Sorted {
    /// What is not finite is left out.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Sorted {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        Sorted(values)
    }

    pub fn count(&self) -> usize {
        self.0.len()
    }

    pub fn median(&self) -> Option<f64> {
        let upper = *self.0.get(self.0.len() / 2)?;
        match self.0.len() % 2 {
            0 => Some(0.5 * (upper + self.0[self.0.len() / 2 - 1])),
            _ => Some(upper),
        }
    }

    /// The least value that this share of the values does not exceed.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let rank = (share * self.0.len() as f64).ceil() as usize;
        self.0.get(rank.max(1) - 1).copied()
    }

    pub fn worst(&self) -> Option<f64> {
        self.0.last().copied()
    }
}

/// A number with this many decimals, or a dash.
pub fn fixed_or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |value| format!("{value:.decimals$}"))
}

/// Whole numbers with runs drawn together: 1–4, 7.
pub fn runs(numbers: &BTreeSet<u64>) -> String {
    let mut runs: Vec<[u64; 2]> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some(last) if last[1] + 1 == number => last[1] = number,
            _ => runs.push([number, number]),
        }
    }
    let text = |&[from, to]: &[u64; 2]| {
        if from == to { from.to_string() } else { format!("{from}–{to}") }
    };
    runs.iter().map(text).collect::<Vec<_>>().join(", ")
}
