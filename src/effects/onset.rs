//! How an output approaches its ceiling: h(u) = (1 − (1 + uᵖ/q)^(−q))^(1/p), in units of the ceiling.
//!
//! q = 1 is the amplifier of Rapp (Proc. 2nd Eur. Conf. Satell. Commun. (1991) 179, for powers), u·(1 + uᵖ)^(−1/p). Larger q
//! come to the ceiling faster, at last exponentially: p = 0.98 with q = 3.6 is within 0.01 dB of an amplitude that saturates as
//! a hyperbolic tangent does.

use std::sync::OnceLock;

/// The onset of saturation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Onset {
    /// Exponent p: the larger, the sharper.
    pub knee: f64,
    /// Exponent q.
    pub approach: f64,
}

impl Onset {
    /// ln h of ln u, and its slope.
    pub fn held(self, ln_power: f64) -> [f64; 2] {
        let Onset { knee, approach } = self;
        let excess = (knee * ln_power).exp() / approach;
        let ln_left = -approach * excess.ln_1p();
        let held = -ln_left.exp_m1();
        // Far below the ceiling nothing is held.
        if held < f64::EPSILON {
            return [ln_power, 1.0];
        }
        let slope = ln_left.exp() / held * approach * excess / (1.0 + excess);
        [held.ln() / knee, slope]
    }

    /// The power u whose output is h; infinite at the ceiling.
    pub fn entered(self, output: f64) -> f64 {
        let Onset { knee, approach } = self;
        let ln_left = (-output.powf(knee)).max(-1.0).ln_1p();
        (approach * (-ln_left / approach).exp_m1()).powf(1.0 / knee)
    }
}

/// An onset at equally spaced powers, with cubics between them that err by less than 1e-6. Computed on first use.
#[derive(Clone, Debug)]
pub(super) struct OnsetTable {
    onset: Onset,
    /// ln h and its slope by ln u.
    nodes: OnceLock<Vec<[f64; 2]>>,
}

/// First and last ln u of the table, and its step.
const FIRST: f64 = -14.0;
const LAST: f64 = 12.0;
const STEP: f64 = 0.05;

impl OnsetTable {
    pub fn new(onset: Onset) -> OnsetTable {
        OnsetTable { onset, nodes: OnceLock::new() }
    }

    /// ln h of ln u, and its slope.
    pub fn held(&self, ln_power: f64) -> [f64; 2] {
        if !(FIRST..LAST).contains(&ln_power) {
            return self.onset.held(ln_power);
        }
        let nodes = self.nodes.get_or_init(|| {
            let count = ((LAST - FIRST) / STEP).round() as usize;
            (0..=count).map(|node| self.onset.held(FIRST + STEP * node as f64)).collect()
        });
        cubic(nodes, STEP, (ln_power - FIRST) / STEP)
    }
}

/// Value and slope between equally spaced nodes with values and slopes, at a place counted in nodes within them.
pub(super) fn cubic(nodes: &[[f64; 2]], step: f64, place: f64) -> [f64; 2] {
    let cell = (place as usize).min(nodes.len() - 2);
    let t = place - cell as f64;
    let [[a, slope_a], [b, slope_b]] = [nodes[cell], nodes[cell + 1]];
    let [slope_a, slope_b, rise] = [slope_a * step, slope_b * step, b - a];
    let [square, cube] = [3.0 * rise - 2.0 * slope_a - slope_b, slope_a + slope_b - 2.0 * rise];
    let value = a + t * (slope_a + t * (square + t * cube));
    [value, (slope_a + t * (2.0 * square + 3.0 * t * cube)) / step]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::db;

    #[test]
    fn it_includes_the_amplifier_of_rapp() {
        for knee in [0.7, 1.0, 2.5, 4.0] {
            let onset = Onset { knee, approach: 1.0 };
            for step in -40..=20 {
                let power = 10f64.powf(f64::from(step) / 10.0);
                let [ln_held, slope] = onset.held(power.ln());
                let rapp = power * (1.0 + power.powf(knee)).powf(-1.0 / knee);
                assert!((ln_held - rapp.ln()).abs() < 1e-9, "{knee} {power}");
                assert!((slope - 1.0 / (1.0 + power.powf(knee))).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_table_is_the_onset() {
        for (knee, approach) in [(0.7, 1.0), (4.0, 1.0), (4.0, 20.0), (1.0, 3.0)] {
            let onset = Onset { knee, approach };
            let table = OnsetTable::new(onset);
            for step in -1600..=1400 {
                let ln_power = f64::from(step) / 99.0;
                let [[ln_held, slope], [of_table, slope_of_table]] =
                    [onset.held(ln_power), table.held(ln_power)];
                assert!((ln_held - of_table).abs() < 1e-6, "{onset:?} {ln_power}");
                assert!((slope - slope_of_table).abs() < 1e-4, "{onset:?} {ln_power}");
            }
        }
    }

    #[test]
    fn a_hyperbolic_tangent_is_one_of_them() {
        let onset = Onset { knee: 0.98368952, approach: 3.55826384 };
        for step in -300..=200 {
            let power = 10f64.powf(f64::from(step) / 100.0);
            let ln_ceiling = 0.00096363;
            let [ln_held, _] = onset.held(power.ln() - ln_ceiling);
            let off_db = db((ln_ceiling + ln_held).exp() / power.sqrt().tanh().powi(2));
            assert!(off_db.abs() < 0.01, "{power}: {off_db} dB");
        }
    }

    #[test]
    fn a_hyperbolic_tangent_is_nearly_a_knee_of_rapp() {
        let onset = Onset { knee: 1.306, approach: 1.0 };
        for step in -300..=200 {
            let power = 10f64.powf(f64::from(step) / 100.0);
            let off_db = db(onset.held(power.ln())[0].exp() / power.sqrt().tanh().powi(2));
            assert!(off_db.abs() < 0.2, "{power}: {off_db} dB");
        }
    }

    #[test]
    fn it_can_be_inverted() {
        for (knee, approach) in [(1.0, 1.0), (0.7, 20.0), (4.0, 3.0)] {
            let onset = Onset { knee, approach };
            for ln_power in [-6.0, -1.0, 0.0, 0.5] {
                let [ln_held, slope] = onset.held(ln_power);
                let back = onset.entered(ln_held.exp()).ln();
                assert!((back - ln_power).abs() < 1e-6, "{onset:?} {ln_power}: {back}");
                let rise = onset.held(ln_power + 1e-6)[0] - ln_held;
                assert!((rise / 1e-6 - slope).abs() < 1e-5, "{onset:?} {ln_power}");
            }
        }
    }
}
