//! Counting: labels against reports.

use std::collections::BTreeMap;

use matdb::diagnose::Diagnosis;

use super::label::{Expected, Label, Strength};
use super::numbers::{Share, Sorted};
use super::report::{Number, Run};

/// Effects that are one and the same in such data, and why.
const INSEPARABLE: [([&str; 2], &str); 1] = [(
    ["noise-floor", "subsurface"],
    "volume scattering of σ_v/(4π cos² θ) returns the same power at every angle, as noise does; only 1/R² tells them apart, \
     which changes by some tenths of a dB over the depth of a target",
)];

/// A case with its truth and its diagnosis.
pub struct Case {
    pub label: Label,
    pub run: Run,
}

impl Case {
    /// Names that are not the truth's.
    pub fn wrong(&self) -> usize {
        self.run.found().iter().filter(|found| !self.label.has(&found.name)).count()
    }

    /// The same, but for a first name that stands in the right one's place.
    pub fn extra(&self) -> usize {
        let replaced = self.run.found().first().is_some_and(|found| !self.label.has(&found.name));
        self.wrong() - usize::from(replaced && self.label.expected != Expected::Complete)
    }

    pub fn named_first(&self) -> bool {
        self.label.single().is_some_and(|name| self.run.first() == name)
    }

    pub fn first_or_class(&self) -> bool {
        self.label.single().is_some_and(|name| self.run.first_or_class(name))
    }

    /// Why no data of this kind could tell the first name from the right one, if that is so: they are a pair of
    /// [`INSEPARABLE`], one is in the other's class, and their likelihoods are as good as the same.
    pub fn alike(&self) -> Option<&'static str> {
        let right = self.label.single().filter(|_| self.first_or_class())?;
        let first = self.run.first();
        let are = |[a, b]: [&str; 2]| (a, b) == (right, first) || (a, b) == (first, right);
        let (_, why) = INSEPARABLE.into_iter().find(|(pair, _)| are(*pair))?;
        let gain = |name: &str| self.run.tried(1, name)?.gain;
        let apart = (gain(right)? - gain(first)?).abs();
        (apart <= Diagnosis::default().least_gain).then_some(why)
    }

    /// What a target counts.
    pub fn named_as_well_as_can_be(&self) -> bool {
        self.named_first() || self.alike().is_some()
    }

    /// How many of the effects that were put in are named.
    pub fn found(&self) -> usize {
        self.label.names().iter().filter(|name| self.run.has(name)).count()
    }

    pub fn all_found(&self) -> bool {
        self.found() == self.label.effects.len()
    }

    pub fn all_found_or_in_class(&self) -> bool {
        self.label.names().iter().all(|name| self.run.has_in_class(name))
    }

    pub fn exact(&self) -> bool {
        self.all_found() && self.wrong() == 0
    }

    /// What a complete model must not get.
    pub fn alarm(&self) -> bool {
        !self.run.found().is_empty() || self.run.verdict() != "no-missing-effect"
    }

    /// Whether the case is not what was hoped for.
    pub fn missed(&self) -> bool {
        match self.label.expected {
            Expected::Complete => self.alarm(),
            Expected::Unknown => self.run.verdict() != "unexplained",
            Expected::Named if self.label.is_pair() => !self.all_found(),
            Expected::Named => !self.named_as_well_as_can_be(),
        }
    }

    /// Whether the error after is larger than before.
    pub fn is_worse(&self) -> bool {
        self.run.error().is_some_and(|error| error.after.rmse_db > error.before.rmse_db)
    }

    /// Error after over noise floor.
    pub fn after_to_floor(&self) -> Option<f64> {
        self.run.error().map(|error| error.after.rmse_db / error.noise_floor_db)
    }
}

/// Cases that satisfy something.
pub fn those(cases: &[Case], which: impl Fn(&Label) -> bool) -> Vec<&Case> {
    cases.iter().filter(|case| which(&case.label)).collect()
}

/// Cases with one effect, of one strength.
pub fn singles(cases: &[Case], strength: Strength) -> Vec<&Case> {
    those(cases, |label| label.single().is_some() && label.strength == Some(strength))
}

pub fn pairs(cases: &[Case]) -> Vec<&Case> {
    those(cases, Label::is_pair)
}

pub fn expecting(cases: &[Case], expected: Expected) -> Vec<&Case> {
    those(cases, |label| label.expected == expected)
}

/// How many of these are so.
pub fn share(cases: &[&Case], is: impl Fn(&Case) -> bool) -> Share {
    Share::of(cases.iter().map(|case| is(case)))
}

/// Mean of a count over cases; none of nothing.
pub fn mean(cases: &[&Case], count: impl Fn(&Case) -> usize) -> Option<f64> {
    let sum: usize = cases.iter().map(|case| count(case)).sum();
    (!cases.is_empty()).then(|| sum as f64 / cases.len() as f64)
}

/// How often each effect was called what, first name by truth.
pub fn confusion(cases: &[&Case]) -> BTreeMap<(String, String), usize> {
    let mut counts = BTreeMap::new();
    for case in cases {
        let truth = case.label.single().unwrap_or_default().to_owned();
        *counts.entry((truth, case.run.first().to_owned())).or_default() += 1;
    }
    counts
}

/// How a number is compared with its truth.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Deviation in per cent of the truth.
    Ratio,
    /// The number is a level, and its deviation in dB.
    Level,
}

/// Numbers that mean the same in labels and reports.
pub const PARAMETERS: [(&str, &str, Scale); 12] = [
    ("angle-error", "sd_deg", Scale::Ratio),
    ("anisotropy", "ratio", Scale::Ratio),
    ("compression", "saturation_dbm", Scale::Level),
    ("correlated-shadowing", "share", Scale::Ratio),
    ("covering-layer", "loss_db", Scale::Ratio),
    ("finite-spot", "diameter_m", Scale::Ratio),
    ("foreign-patch", "radius_m", Scale::Ratio),
    ("fov-gain", "edge_db", Scale::Ratio),
    ("multi-bounce", "coupling_db", Scale::Level),
    ("noise-floor", "level_dbm", Scale::Level),
    ("speckle", "looks", Scale::Ratio),
    ("thin-film", "thickness_m", Scale::Ratio),
];

/// How far a number is off, over cases.
pub struct Deviations {
    pub effect: &'static str,
    pub parameter: &'static str,
    pub scale: Scale,
    /// In the scale's unit, without sign.
    pub off: Sorted,
    /// In standard deviations as stated, where one was.
    pub in_sd: Sorted,
}

/// Every parameter, over the cases whose right effect was named.
pub fn deviations(cases: &[Case]) -> Vec<Deviations> {
    let of = |&(effect, parameter, scale): &(&'static str, &'static str, Scale)| {
        let found = cases.iter().filter_map(|case| deviation(case, effect, parameter, scale));
        let (off, in_sd): (Vec<f64>, Vec<Option<f64>>) = found.unzip();
        let (off, in_sd) = (Sorted::new(off), Sorted::new(in_sd.into_iter().flatten()));
        Deviations { effect, parameter, scale, off, in_sd }
    };
    PARAMETERS.iter().map(of).filter(|one| one.off.count() > 0).collect()
}

/// Distance at which reports give the gain over the field, m.
const EDGE_M: f64 = 0.5;

/// In the scale's unit, and in standard deviations.
fn deviation(
    case: &Case,
    effect: &str,
    parameter: &str,
    scale: Scale,
) -> Option<(f64, Option<f64>)> {
    let put_in = case.label.effects.iter().find(|put_in| put_in.name == effect)?;
    let found = case.run.found().iter().find(|found| found.name == effect)?;
    let (value, sd) = as_labels_mean_it(parameter, found.parameters.get(parameter)?, &case.label)?;
    let truth = put_in.parameters.get(parameter)?.as_f64()?;
    let elsewhere = |edge_m: f64| (edge_m - EDGE_M).abs() > 1e-6;
    if put_in.parameters.get("edge_m").and_then(|m| m.as_f64()).is_some_and(elsewhere) {
        return None;
    }
    // A grain along one direction is its inverse across.
    let truth = if parameter == "ratio" { truth.max(1.0 / truth) } else { truth };
    let off = (value - truth).abs();
    let scaled = match scale {
        Scale::Ratio => 100.0 * off / truth.abs(),
        Scale::Level => off,
    };
    Some((scaled, sd.filter(|sd| *sd > 0.0).map(|sd| off / sd)))
}

/// Value and standard deviation.
fn as_labels_mean_it(
    parameter: &str,
    number: &Number,
    label: &Label,
) -> Option<(f64, Option<f64>)> {
    let (value, sd) = (number.value?, number.sd);
    Some(match (parameter, label.declared_dbm) {
        ("ratio", _) if value < 1.0 => (1.0 / value, sd.map(|sd| sd / value.powi(2))),
        // Labels give all noise, reports what is added to the declared.
        ("level_dbm", Some(declared_dbm)) => {
            let [added, declared] = [value, declared_dbm].map(|dbm| 10f64.powf(0.1 * dbm));
            let all = added + declared;
            (10.0 * all.log10(), sd.map(|sd| sd * added / all))
        }
        _ => (value, sd),
    })
}
