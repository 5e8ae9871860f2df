//! Which effects are tried, and why the others are not.

use serde::Serialize;

use super::AtWork;
use crate::cli::console::Console;
use crate::diagnose::curve::{Term, terms};
use crate::effects::{Effect, library};

/// Why an effect is not tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Reason {
    /// Scene, radar or a material declares it.
    Declared,
    /// It goes with time, which the scan does not tell.
    NoTimes,
    /// It moves the target, and the scene declares no error of ranges: the pose is trusted unless ranges speak
    /// against it, and at edges powers alone would move any target.
    NoRanges,
    /// `--effects` names others.
    NotAsked,
}

impl Reason {
    pub fn words(self) -> &'static str {
        match self {
            Reason::Declared => "declared already, so at work in the model",
            Reason::NoTimes => "the scan has no times",
            Reason::NoRanges => "the scene states no `range_sd_m` under [radar.noise]",
            Reason::NotAsked => "--effects names others",
        }
    }
}

/// An effect that is not tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct NotTried {
    pub name: &'static str,
    pub reason: Reason,
}

/// What a scan tells beside powers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    pub times: bool,
    pub ranges: bool,
}

/// The library, sorted out for one scan.
pub(super) struct Choice {
    pub tried: Vec<&'static dyn Effect>,
    pub not_tried: Vec<NotTried>,
}

impl Choice {
    /// What can be tried of the effects that are asked for.
    pub fn new(asked: &[&'static dyn Effect], at_work: &AtWork, told: Told) -> Choice {
        let reason = |effect: &dyn Effect| {
            let is_named = |other: &dyn Effect| other.name() == effect.name();
            if at_work.iter().any(|(declared, _)| is_named(*declared)) {
                Some(Reason::Declared)
            } else if !asked.iter().any(|other| is_named(*other)) {
                Some(Reason::NotAsked)
            } else if !told.times && effect.depends_on_time() {
                Some(Reason::NoTimes)
            } else if !told.ranges && effect.moves() {
                Some(Reason::NoRanges)
            } else {
                None
            }
        };
        let not_tried = library()
            .into_iter()
            .filter_map(|effect| Some(NotTried { name: effect.name(), reason: reason(effect)? }));
        let tried = asked.iter().copied().filter(|effect| reason(*effect).is_none());
        Choice { tried: tried.collect(), not_tried: not_tried.collect() }
    }

    /// The effects that are left out for a reason.
    pub fn left_out(&self, reason: Reason) -> Vec<&'static str> {
        self.not_tried.iter().filter(|one| one.reason == reason).map(|one| one.name).collect()
    }

    /// Says what is not tried although nobody asked for that.
    pub fn tell(&self, console: &Console) {
        for reason in [Reason::Declared, Reason::NoTimes, Reason::NoRanges] {
            let names = self.left_out(reason).join(", ");
            if !names.is_empty() {
                console.notice(&format!("not tried ({}): {names}", reason.words()));
            }
        }
    }
}

/// The effects of a curve that are not asked for.
pub(super) fn of_curve(asked: &[&'static dyn Term]) -> Vec<NotTried> {
    let is_asked = |term: &dyn Term| asked.iter().any(|other| other.name() == term.name());
    let others = terms().into_iter().filter(|term| !is_asked(*term));
    others.map(|term| NotTried { name: term.name(), reason: Reason::NotAsked }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::find;

    #[test]
    fn every_effect_is_tried_or_has_a_reason() {
        let asked = ["fov-gain", "drift", "pose", "motion"].map(|name| find(name).unwrap());
        let at_work = [(find("pose").unwrap(), Vec::new())];
        let choice = Choice::new(&asked, &at_work, Told { times: true, ranges: false });
        assert_eq!(choice.left_out(Reason::NoRanges), ["motion"]);
        let choice = Choice::new(&asked, &at_work, Told { times: false, ranges: true });
        assert_eq!(choice.tried[0].name(), "fov-gain");
        assert_eq!(choice.left_out(Reason::Declared), ["pose"]);
        assert_eq!(choice.left_out(Reason::NoTimes), ["motion", "drift"]);
        assert_eq!(choice.tried.len() + choice.not_tried.len(), library().len());
    }
}
