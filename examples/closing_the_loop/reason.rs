//! Why a case was missed, as far as its report tells: rules, applied in the order in which they stand.

use matdb::diagnose::Diagnosis;

use super::label::{Expected, Label};
use super::report::{Candidate, Run};

/// Gains this near to each other are of fingerprints that are alike.
const ALIKE: f64 = 0.8;

/// The reason in a few words.
pub fn reason(label: &Label, run: &Run) -> String {
    let report = match &run.report {
        Ok(report) => report,
        Err(message) => return format!("the command failed: {message}"),
    };
    if report.verdict == "cannot-tell" {
        let reason = report.reason.as_deref().unwrap_or("without a reason");
        return format!("could not tell: {reason}");
    }
    match label.expected {
        Expected::Complete if run.found().is_empty() => "a test of what remains called".into(),
        Expected::Complete => "an effect passed all tests by chance".into(),
        Expected::Unknown if run.found().is_empty() => "no test of what remains called".into(),
        Expected::Unknown => "with what was named, no test of what remains called".into(),
        Expected::Named => {
            let absent = label.names().into_iter().filter(|name| label.is_pair() && !run.has(name));
            let absent: Vec<&str> = if label.is_pair() { absent.collect() } else { label.names() };
            let why = |name: &str| {
                if label.is_pair() {
                    format!("{name}: {}", of_effect(name, label, run))
                } else {
                    of_effect(name, label, run)
                }
            };
            absent.into_iter().map(why).collect::<Vec<_>>().join("; ")
        }
    }
}

/// Why an effect that was put in is not the one that was named.
fn of_effect(right: &str, label: &Label, run: &Run) -> String {
    if run.first_or_class(right) {
        return "right effect in the class of the first".into();
    }
    if run.has(right) {
        return "right effect named, but not first".into();
    }
    if run.has_in_class(right) {
        return "right effect in the class of a later one".into();
    }
    // Effects stand in the order of the rounds that they were added in. What counts is the round in
    // which a wrong one was, or the last.
    let wrong = run.found().iter().position(|found| !label.has(&found.name));
    let round = wrong.unwrap_or(run.found().len()) + 1;
    let Some(tried) = run.tried(round, right).or(run.tried(1, right)) else {
        return "right effect was not tried".into();
    };
    if let Some(why) = stopped(tried) {
        return why.into();
    }
    let named = wrong.and_then(|wrong| run.found().get(wrong));
    match named.and_then(|named| run.tried(round, &named.name)) {
        Some(named) if gain(tried) >= ALIKE * gain(named) => {
            "named an effect whose fingerprint is alike".into()
        }
        Some(_) => "named an effect that explains clearly more".into(),
        None if run.found().is_empty() => {
            "stopped by what is asked for beside gain and size".into()
        }
        None => "passed alone, and not beside what was named".into(),
    }
}

/// The hurdle of the first round that an effect did not pass.
fn stopped(tried: &Candidate) -> Option<&'static str> {
    let Diagnosis { least_gain, least_size_db, standard_errors, .. } = Diagnosis::default();
    if gain(tried) < least_gain {
        return Some("below the gain that is asked for");
    }
    if tried.sampled {
        return Some("right effect not among the refitted");
    }
    if tried.size_db < least_size_db {
        return Some("below the size that is asked for");
    }
    if tried.placebo_gain.is_some_and(|placebo| gain(tried) <= placebo) {
        return Some("no better than a placebo");
    }
    match tried.held_out {
        None => Some("its size or gain too small beside what was named, or for its many starts"),
        Some([gain, se]) if gain <= standard_errors * se => {
            Some("held-out gain within its standard errors")
        }
        Some(_) => None,
    }
}

fn gain(candidate: &Candidate) -> f64 {
    candidate.gain.unwrap_or_default()
}
