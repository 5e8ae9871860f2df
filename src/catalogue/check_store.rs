//! Checking a database: its pages, the content of every revision, and every fit.

use serde::Serialize;

use super::layout::DATABASE;
use super::problem::{Problem, problem};
use crate::fit::again::{lacks_report, problems};
use crate::material::Fit;
use crate::store::{Again, RevisionSummary, Store, StoreError, Stored, Summary};

/// How much was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CheckCount {
    /// Materials.
    pub materials: usize,
    /// Their revisions, whose hashes were recomputed.
    pub revisions: usize,
    /// Fits of current revisions that were made again.
    pub fits: usize,
}

/// Checks a database: its pages and indexes are sound, every revision has the content of its hash, everything else
/// that is stored follows from the content, and every fit of a current revision follows from its curve. `report` gets
/// every problem.
pub fn check_store(store: &Store, report: &mut dyn FnMut(Problem)) -> CheckCount {
    check_each(store, Refit::All, report, |_, _, _| ())
}

/// Which fits are made again.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Refit {
    None,
    All,
}

/// Checks every material of a database; `each` gets every current revision with its line in the list.
pub(super) fn check_each(
    store: &Store,
    refit: Refit,
    report: &mut dyn FnMut(Problem),
    mut each: impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> CheckCount {
    let mut checked = CheckCount::default();
    let opened = check_file_itself(store, report).and_then(|()| Ok((store.list()?, Again::new()?)));
    let (summaries, mut again) = match opened {
        Ok(opened) => opened,
        Err(error) => {
            report(problem("materials", error));
            return checked;
        }
    };
    for summary in &summaries {
        checked.materials += 1;
        let done =
            check_material(store, &mut again, summary, refit, report, &mut checked, &mut each);
        if let Err(error) = done {
            report(problem(summary.slug.as_str(), error));
        }
    }
    checked
}

/// Checks pages, indexes and the table of units.
fn check_file_itself(store: &Store, report: &mut dyn FnMut(Problem)) -> Result<(), StoreError> {
    store.damage()?.into_iter().for_each(|what| report(problem(DATABASE, what)));
    if !Again::new()?.has_own_units(store)? {
        report(problem(DATABASE, OTHER_UNITS));
    }
    Ok(())
}

/// What is wrong with a database whose table of units was changed.
pub const OTHER_UNITS: &str = "its units of columns are not those that matdb writes";

/// What of a stored revision does not follow from its content: statistics of curves, numbers beside
/// parameters, and whatever else the program writes twice.
///
/// # Errors
/// When the database cannot be read.
pub fn derived(
    again: &mut Again,
    store: &Store,
    stored: &Stored,
) -> Result<Vec<Problem>, StoreError> {
    let place = format!("{}@{}", stored.material.slug, stored.revision);
    let differences = again.differences(store, stored)?.into_iter();
    let problems = differences.map(|found| match found.curve {
        Some(curve) => {
            problem(format!("{place}, curve {curve}"), "its statistics are not those of its points")
        }
        None => {
            let rows =
                format!("its rows of `{}` are not those that its content gives", found.table);
            problem(place.clone(), rows)
        }
    });
    Ok(problems.collect())
}

fn check_material(
    store: &Store,
    again: &mut Again,
    summary: &Summary,
    refit: Refit,
    report: &mut dyn FnMut(Problem),
    checked: &mut CheckCount,
    each: &mut impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> Result<(), StoreError> {
    for RevisionSummary { revision, .. } in store.history(&summary.slug)? {
        let place = || format!("{}@{revision}", summary.slug);
        // Reading recomputes the hash.
        let stored = match store.get(&summary.slug, Some(revision)) {
            Ok(Some(stored)) => stored,
            Ok(None) => {
                report(problem(place(), "is not there"));
                continue;
            }
            Err(StoreError::Corrupt { problem: what, .. }) => {
                report(problem(place(), what));
                continue;
            }
            Err(error) => return Err(error),
        };
        checked.revisions += 1;
        if let Err(error) = stored.material.validate() {
            report(problem(place(), error));
            continue;
        }
        derived(again, store, &stored)?.into_iter().for_each(&mut *report);
        if revision == summary.revision {
            if refit == Refit::All {
                checked.fits += check_fits(&stored, report);
            }
            each(summary, &stored, report);
        }
    }
    Ok(())
}

/// Makes the fits of a revision again; returns their number.
fn check_fits(stored: &Stored, report: &mut dyn FnMut(Problem)) -> usize {
    let material = &stored.material;
    for fit in material.fits.iter().filter(|fit| lacks_report(fit)) {
        let place = format!("{}@{}, fit `{}`", material.slug, stored.revision, fit.name);
        report(problem(place, without_report(fit)));
    }
    let mut refitted = 0;
    for fit in &material.fits {
        let Some(problems) = problems(material, fit) else { continue };
        refitted += 1;
        for found in problems {
            let place = format!("{}@{}, fit `{}`", material.slug, stored.revision, fit.name);
            report(problem(place, found));
        }
    }
    refitted
}

/// What is wrong with a fit whose report was taken away.
pub fn without_report(fit: &Fit) -> String {
    format!("was found by `{}`, but the report of that is not there", fit.estimator)
}
