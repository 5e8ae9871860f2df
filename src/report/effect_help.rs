//! The effects that a diagnosis looks for, as a person looks them up.

use serde::Serialize;

use crate::diagnose::curve::{Term, terms};
use crate::effects::{Effect, EffectParameter, Level, library};

/// An effect: what it is and how it shows.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EffectHelp {
    /// Its name.
    pub name: &'static str,
    /// What it is looked for in: `cloud`, `curve`.
    pub applies_to: &'static [&'static str],
    /// Where it acts; `None` of what has no name.
    pub level: Option<Level>,
    /// What it is.
    pub is: &'static str,
    /// How it shows in the data.
    pub shows: &'static str,
    /// Its numbers.
    pub parameters: &'static [EffectParameter],
}

impl EffectHelp {
    /// What no effect explains.
    pub const UNKNOWN: EffectHelp = EffectHelp {
        name: "unknown",
        applies_to: &["cloud", "curve"],
        level: None,
        is: "What no effect in this list does to the data, beside the law and the effects that were found: in a \
             cloud a smooth term over all covariates and the target plane, in a curve one over an angle, or \
             neighbouring angles that err to the same side. It names nothing.",
        shows: "The verdict is `unexplained`; `unexplained` in report.json says with which covariates it goes \
                and how large it is. Of a cloud the picture unknown-map shows where, and residuals.csv has it \
                chirp by chirp as unknown_db. It is never stored and never rendered.",
        parameters: &[],
    };

    /// The effects of clouds, then those of curves, then what none of them explains.
    pub fn all() -> Vec<EffectHelp> {
        let mut all = Vec::from_iter(library().map(EffectHelp::of_cloud));
        all.extend(terms().map(EffectHelp::of_curve));
        all.push(EffectHelp::UNKNOWN);
        all
    }

    fn of_cloud(effect: &dyn Effect) -> EffectHelp {
        EffectHelp {
            name: effect.name(),
            applies_to: &["cloud"],
            level: Some(effect.level()),
            is: effect.description(),
            shows: effect.signature(),
            parameters: effect.parameters(),
        }
    }

    fn of_curve(term: &dyn Term) -> EffectHelp {
        EffectHelp {
            name: term.name(),
            applies_to: &["curve"],
            level: Some(term.level()),
            is: term.description(),
            shows: term.signature(),
            parameters: term.parameters(),
        }
    }
}
