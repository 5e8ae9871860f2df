//! Which effects a diagnosis tries, and why it leaves the others out.

use serde::Serialize;

use crate::diagnose::curve::{Term, terms};
use crate::effects::{Effect, Setting, find, library};

/// Why an effect is not tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// Scene, radar or a material declares it.
    Declared,
    /// It depends on time, and the scan has no times.
    NoTimes,
    /// It moves the target, and the scene declares no error of ranges: the pose is trusted unless ranges speak
    /// against it, and at edges powers alone would move any target.
    NoRanges,
    /// It changes what comes straight back, and the cloud is that of an antenna apart from the radar's.
    OtherAntenna,
    /// It changes the law of speckle or noise, and the scene has a range receiver with laws of its own.
    RangeReceiver,
    /// It moves the target, and the scene has second-order paths, which are followed where the scene has the target.
    Bounce,
    /// It follows rays to the first surface, and regions of the scene let them pass on.
    Sheets,
    /// The user named other effects.
    NotAsked,
}

impl Reason {
    /// The reason in a clause.
    pub fn words(self) -> &'static str {
        match self {
            Reason::Declared => "declared already, so at work in the model",
            Reason::NoTimes => "the scan has no times",
            Reason::NoRanges => "the scene states no `range_sd_m` under [radar.noise]",
            Reason::OtherAntenna => {
                "they change what comes straight back to the radar, and the cloud is that of another antenna"
            }
            Reason::RangeReceiver => "a range receiver has its own speckle and noise",
            Reason::Bounce => {
                "they move the target, and [bounce] follows paths on it where the scene has it"
            }
            Reason::Sheets => {
                "they follow rays to the first surface, and regions of the scene let them pass on"
            }
            Reason::NotAsked => "others were asked for",
        }
    }
}

/// An effect that is not tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UntriedEffect {
    /// Its name.
    pub name: &'static str,
    /// Why.
    pub reason: Reason,
}

/// An effect that is not tried, as a page shows it.
#[derive(Serialize)]
pub(super) struct Omission {
    name: &'static str,
    because: &'static str,
}

/// Effects that are not tried, for a page.
pub(super) fn left_out(not_tried: &[UntriedEffect]) -> Vec<Omission> {
    not_tried.iter().map(|one| Omission { name: one.name, because: one.reason.words() }).collect()
}

/// What a scan measures besides powers.
#[derive(Clone, Copy, Debug)]
pub struct Measurands {
    /// The time of every chirp.
    pub times: bool,
    /// Ranges with a known error.
    pub ranges: bool,
    /// Whether all of that is at an antenna apart from the radar's.
    pub at_other_antenna: bool,
    /// Whether a range receiver measures all of that.
    pub by_range_receiver: bool,
    /// Whether the scene has second-order paths.
    pub with_bounce: bool,
    /// Whether regions of the scene let a part of the wave through.
    pub with_sheets: bool,
}

/// The library of effects, sorted for one scan.
pub struct Choice {
    /// Effects to try.
    pub tried: Vec<&'static dyn Effect>,
    /// The others.
    pub not_tried: Vec<UntriedEffect>,
}

impl Choice {
    /// Sorts the effects that were asked for, of the library or a program's own; `declared` names those at work in the scene
    /// already.
    pub fn new(asked: &[&'static dyn Effect], declared: &[&str], measured: Measurands) -> Choice {
        let mut choice = Choice { tried: Vec::new(), not_tried: Vec::new() };
        let own = asked.iter().filter(|effect| find(effect.name()).is_none());
        for effect in library().iter().chain(own) {
            let name = effect.name();
            let is_asked = asked.iter().any(|other| other.name() == name);
            if let Some(reason) = reason_against(*effect, is_asked, declared, measured) {
                choice.not_tried.push(UntriedEffect { name, reason });
            }
        }
        // The order of the tried effects is the one in which they were asked for.
        for effect in asked {
            if choice.not_tried.iter().all(|one| one.name != effect.name()) {
                choice.tried.push(*effect);
            }
        }
        choice
    }

    /// The effects that are left out for a reason.
    pub fn left_out(&self, reason: Reason) -> Vec<&'static str> {
        self.not_tried.iter().filter(|one| one.reason == reason).map(|one| one.name).collect()
    }

    /// A sentence for every reason other than the user's choice for which effects are left out.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for reason in [
            Reason::Declared,
            Reason::OtherAntenna,
            Reason::RangeReceiver,
            Reason::Bounce,
            Reason::Sheets,
            Reason::NoTimes,
            Reason::NoRanges,
        ] {
            let names = self.left_out(reason).join(", ");
            if !names.is_empty() {
                notices.push(format!("not tried ({}): {names}", reason.words()));
            }
        }
        notices
    }
}

fn reason_against(
    effect: &dyn Effect,
    is_asked: bool,
    declared: &[&str],
    measured: Measurands,
) -> Option<Reason> {
    let about = effect.about();
    if declared.contains(&effect.name()) {
        Some(Reason::Declared)
    } else if !is_asked {
        Some(Reason::NotAsked)
    } else if measured.at_other_antenna && about.is_excluded_by(Setting::OtherAntenna) {
        Some(Reason::OtherAntenna)
    } else if measured.by_range_receiver && about.is_excluded_by(Setting::RangeReceiver) {
        Some(Reason::RangeReceiver)
    } else if measured.with_bounce && about.is_excluded_by(Setting::Bounce) {
        Some(Reason::Bounce)
    } else if measured.with_sheets && about.is_excluded_by(Setting::Sheets) {
        Some(Reason::Sheets)
    } else if !measured.times && effect.depends_on_time() {
        Some(Reason::NoTimes)
    } else if !measured.ranges && effect.moves() {
        Some(Reason::NoRanges)
    } else {
        None
    }
}

/// The effects of a curve that are not asked for.
pub fn terms_not_asked(asked: &[&'static dyn Term]) -> Vec<UntriedEffect> {
    let mut others = Vec::new();
    for term in terms() {
        if asked.iter().all(|other| other.name() != term.name()) {
            others.push(UntriedEffect { name: term.name(), reason: Reason::NotAsked });
        }
    }
    others
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_tried_or_has_a_reason() {
        let asked = ["fov-gain", "drift", "pose", "motion"].map(|name| find(name).unwrap());
        let all = Measurands {
            times: true,
            ranges: true,
            at_other_antenna: false,
            by_range_receiver: false,
            with_bounce: false,
            with_sheets: false,
        };
        let choice = Choice::new(&asked, &["pose"], Measurands { ranges: false, ..all });
        assert_eq!(choice.left_out(Reason::NoRanges), ["motion"]);
        let choice = Choice::new(&asked, &["pose"], Measurands { times: false, ..all });
        assert_eq!(choice.tried[0].name(), "fov-gain");
        assert_eq!(choice.left_out(Reason::Declared), ["pose"]);
        assert_eq!(choice.left_out(Reason::NoTimes), ["motion", "drift"]);
        assert_eq!(choice.tried.len() + choice.not_tried.len(), library().len());
        let choice = Choice::new(&library(), &[], Measurands { at_other_antenna: true, ..all });
        let tried: Vec<&str> = choice.tried.iter().map(|effect| effect.name()).collect();
        assert!(asked.iter().all(|effect| tried.contains(&effect.name())), "{tried:?}");
        assert!(choice.left_out(Reason::OtherAntenna).contains(&"subsurface"));
        let bounced = Measurands { with_bounce: true, ..all };
        let choice = Choice::new(&library(), &["multi-bounce"], bounced);
        assert_eq!(choice.left_out(Reason::Bounce), ["pose", "motion"]);
        let behind = Measurands { with_sheets: true, ..all };
        let choice = Choice::new(&library(), &[], behind);
        let first_surface = ["pose", "motion", "finite-spot", "multi-bounce"];
        assert_eq!(choice.left_out(Reason::Sheets), first_surface);
    }
}
