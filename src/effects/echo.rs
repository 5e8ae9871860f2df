//! The mean echo of a chirp.

/// The echo of one shot in the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanEcho {
    /// Mean power, W.
    pub power_w: f64,
    /// Range, the mean by power, m.
    pub range_m: f64,
    /// Standard deviation, weighted by power, of the ranges of all that arrives, m. Speckle weighs these ranges
    /// differently in each chirp, so the measured range may lie this far from the mean.
    pub spread_m: f64,
}

impl MeanEcho {
    /// An echo from one range.
    pub fn at_once(power_w: f64, range_m: f64) -> MeanEcho {
        MeanEcho { power_w, range_m, spread_m: 0.0 }
    }

    /// Both echoes together; unchanged where neither has any power.
    pub fn with(self, other: MeanEcho) -> MeanEcho {
        let power_w = self.power_w + other.power_w;
        if power_w <= 0.0 {
            return self;
        }
        let share = other.power_w / power_w;
        let apart_m = other.range_m - self.range_m;
        let within_m2 = (1.0 - share) * self.spread_m.powi(2) + share * other.spread_m.powi(2);
        let between_m2 = share * (1.0 - share) * apart_m * apart_m;
        let range_m = self.range_m + share * apart_m;
        MeanEcho { power_w, range_m, spread_m: (within_m2 + between_m2).sqrt() }
    }
}
