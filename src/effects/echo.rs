//! The mean echo of a chirp.

/// The mean echo of one shot over speckle and noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanEcho {
    /// Mean power, W.
    pub power_w: f64,
    /// Mean range, weighted by power, m.
    pub range_m: f64,
    /// Standard deviation of the ranges of all paths, weighted by power, m. Speckle weights these ranges
    /// differently in each chirp, so that the measured range may differ from the mean by this much.
    pub spread_m: f64,
}

impl MeanEcho {
    /// An echo from one range.
    pub fn at_once(power_w: f64, range_m: f64) -> MeanEcho {
        MeanEcho { power_w, range_m, spread_m: 0.0 }
    }

    /// The sum of both echoes; unchanged if neither has power.
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
