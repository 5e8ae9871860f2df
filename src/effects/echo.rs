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
    /// Share of the power, 0 to 1, that comes back in one phase and does not speckle. Of waves whose phases relative to each
    /// other are unknown, one sees √ΣCᵢ²/P.
    pub coherent_share: f64,
    /// Factor on the looks of what speckles, 1 unless a receiver picks the strongest of several range cells.
    pub more_looks: f64,
}

impl MeanEcho {
    /// An echo from one range, all of which speckles.
    pub fn at_once(power_w: f64, range_m: f64) -> MeanEcho {
        MeanEcho { power_w, range_m, spread_m: 0.0, coherent_share: 0.0, more_looks: 1.0 }
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
        let spread_m = (within_m2 + between_m2).sqrt();
        let [own, others] = [(1.0 - share) * self.coherent_share, share * other.coherent_share];
        let more_looks = self.more_looks + share * (other.more_looks - self.more_looks);
        MeanEcho { power_w, range_m, spread_m, coherent_share: own.hypot(others), more_looks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Receiver;
    use crate::radar::random::{Key, Purpose};

    /// Two waves of any phase relative to each other, over speckle: one look.
    #[test]
    fn waves_of_unknown_phases_scatter_as_draws_do() {
        const COUNT: usize = 100_000;
        let wave = |power_w, coherent_share| MeanEcho {
            coherent_share,
            ..MeanEcho::at_once(power_w, 8.0)
        };
        let (a, b) = (wave(2.0, 0.75), wave(1.0, 0.5));
        let mut draws = Key { seed: 7, chirp: 0, sub_ray: 0, purpose: Purpose::Speckle }.draws();
        let mut one = || {
            let turn = std::f64::consts::TAU * draws.uniform();
            let second = num_complex::Complex::from_polar(f64::sqrt(0.5), turn);
            (draws.complex_gaussian() + f64::sqrt(1.5) + second).norm_sqr()
        };
        let powers: Vec<f64> = (0..COUNT).map(|_| one()).collect();
        let mean = powers.iter().sum::<f64>() / COUNT as f64;
        let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / COUNT as f64;
        let both = a.with(b);
        assert!((mean / both.power_w - 1.0).abs() < 0.02, "{mean}");
        let receiver = Receiver { looks: 1.0, ..Receiver::LINEAR };
        let looks = receiver.looks_of(both.coherent_share, 1.0);
        assert!((looks * variance / (mean * mean) - 1.0).abs() < 0.03, "{looks} {variance}");
    }
}
