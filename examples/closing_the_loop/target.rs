//! What was aimed at, beside what was reached.

use super::label::{Expected, Strength};
use super::numbers::{Share, Sorted, fixed_or_dash};
use super::score::{Case, expecting, mean, pairs, share, singles, those};

/// Cases with nothing missing from which the share of false alarms is judged.
const LEAST_COMPLETE: usize = 60;

/// A target and what became of it.
pub struct Target {
    pub what: &'static str,
    pub aim: &'static str,
    /// As text.
    pub reached: String,
    /// None where there is no case to tell, or there are too few.
    pub met: Option<bool>,
    is_too_few: bool,
}

impl Target {
    fn at_least(what: &'static str, aim: &'static str, share: Share, least: f64) -> Target {
        let met = share.ratio().map(|ratio| ratio >= least);
        let surely = share.lower_95().map(|lower| format!("; above {:.0} %", 100.0 * lower));
        let reached = format!("{}{}", share.cell(), surely.unwrap_or_default());
        Target { what, aim, reached, met, is_too_few: false }
    }

    fn at_most(
        what: &'static str,
        aim: &'static str,
        value: Option<f64>,
        most: f64,
        text: String,
    ) -> Target {
        let met = value.map(|value| value <= most);
        Target { what, aim, reached: text, met, is_too_few: false }
    }

    /// Leaves open what too few cases tell.
    fn by_at_least(self, cases: usize, least: usize) -> Target {
        if (1..least).contains(&cases) {
            Target { met: None, is_too_few: true, ..self }
        } else {
            self
        }
    }

    /// For a cell of a table.
    pub fn cell(&self) -> String {
        match self.met {
            Some(true) => format!("{}: met", self.reached),
            Some(false) => format!("**{}: missed**", self.reached),
            None if self.is_too_few => format!("{}: too few to tell", self.reached),
            None => "no such case".into(),
        }
    }
}

/// All targets, of one set of cases.
pub fn targets(cases: &[Case]) -> Vec<Target> {
    let first = |strength| share(&singles(cases, strength), Case::named_as_well_as_can_be);
    let named = those(cases, |label| label.expected == Expected::Named);
    let one = those(cases, |label| label.single().is_some());
    let extra = mean(&one, Case::extra);
    let alarms = share(&expecting(cases, Expected::Complete), Case::alarm);
    let after = Sorted::new(named.iter().filter_map(|case| case.after_to_floor()));
    let unknown = expecting(cases, Expected::Unknown);
    let unexplained = share(&unknown, |case| case.run.verdict() == "unexplained");
    let both = share(&pairs(cases), Case::all_found);
    let [middle, most] = [after.median(), after.quantile(0.9)];
    let worse = named.iter().filter(|case| case.is_worse()).count();
    vec![
        Target::at_least(
            "strong effect: right name first",
            "≥ 97 %",
            first(Strength::Strong),
            0.97,
        ),
        Target::at_least(
            "moderate effect: right name first",
            "≥ 92 %",
            first(Strength::Moderate),
            0.92,
        ),
        Target::at_least("weak effect: right name first", "≥ 80 %", first(Strength::Weak), 0.80),
        Target::at_most(
            "spurious extra names per case with one effect",
            "≤ 0.10",
            extra,
            0.1,
            fixed_or_dash(extra, 2),
        ),
        Target::at_most(
            "nothing missing: false alarms, by at least 60 cases",
            "≤ 3 %",
            alarms.ratio(),
            0.03,
            match alarms.upper_95() {
                Some(upper) => format!("{}; below {:.0} %", alarms.cell(), 100.0 * upper),
                None => alarms.cell(),
            },
        )
        .by_at_least(alarms.of, LEAST_COMPLETE),
        Target::at_least("two effects: both named", "≥ 80 %", both, 0.80),
        Target::at_least("unknown effect: called unexplained", "≥ 90 %", unexplained, 0.90),
        Target::at_most(
            "known effects: error after over noise floor, median",
            "≤ 1.03",
            middle,
            1.03,
            fixed_or_dash(middle, 3),
        ),
        Target::at_most(
            "known effects: error after over noise floor, 90th percentile",
            "≤ 1.10",
            most,
            1.10,
            fixed_or_dash(most, 3),
        ),
        Target::at_most(
            "known effects: cases whose error is worse than before",
            "0",
            (!named.is_empty()).then_some(worse as f64),
            0.0,
            format!("{worse} of {}", named.len()),
        ),
    ]
}
