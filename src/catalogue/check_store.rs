//! Checking a database: its pages, the content of every revision, and every fit.

use serde::Serialize;

use super::problem::{Problem, problem};
use crate::fit::again::{lacks_report, problems};
use crate::material::{Fit, Slug};
use crate::store::{RowCheck, Store, StoreError, StoredRevision, Summary};

/// How much was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CheckCount {
    /// Materials.
    pub materials: usize,
    /// Their revisions, whose hashes were recomputed.
    pub revisions: usize,
    /// Curves of these.
    #[serde(skip)]
    pub curves: usize,
    /// Fits that were made again.
    pub fits: usize,
}

/// Which fits are made again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refit {
    /// None.
    None,
    /// Those of current revisions.
    Current,
    /// Those of all revisions.
    All,
}

/// Checks a database: its pages and indexes are sound, its tables, indexes, views and triggers are those that matdb
/// makes, every revision has the content of its hash, everything else that is stored follows from the content, and
/// fits follow from their curves.
pub struct StoreCheck<'a> {
    /// What the database is called in a problem.
    pub name: &'a str,
    /// Which fits are made again.
    pub refit: Refit,
    /// Gets every problem.
    pub report: &'a mut dyn FnMut(Problem),
    /// Called after every revision.
    pub advance: &'a mut dyn FnMut(),
}

impl StoreCheck<'_> {
    /// Checks every material of a database.
    pub fn run(self, store: &Store) -> CheckCount {
        self.run_with(store, |_, _, _| ())
    }

    /// Checks every material of a database; `each` gets every current revision with its line in the list.
    pub(super) fn run_with(
        mut self,
        store: &Store,
        mut each: impl FnMut(&Summary, &StoredRevision, &mut dyn FnMut(Problem)),
    ) -> CheckCount {
        let mut count = CheckCount::default();
        let checked = store.in_one_moment(|store| {
            let mut row_check = self.check_file(store)?;
            for name in store.names()? {
                count.materials += 1;
                let done = match name.parse() {
                    Ok(slug) => {
                        self.check_material(store, &mut row_check, &slug, &mut count, &mut each)
                    }
                    Err(error) => {
                        (self.report)(problem(
                            &name,
                            format!("is not a name of a material: {error}"),
                        ));
                        Ok(())
                    }
                };
                match done {
                    Ok(()) => {}
                    // This is the check that the error advises.
                    Err(StoreError::Corrupt { problem: what, .. }) => {
                        (self.report)(problem(&name, what));
                    }
                    Err(error) => (self.report)(problem(&name, error)),
                }
            }
            Ok(())
        });
        if let Err(error) = checked.and_then(|checked| checked) {
            (self.report)(problem("materials", error));
        }
        count
    }

    /// Checks pages, indexes, the schema and the table of units. Returns the check for the rows of revisions.
    fn check_file(&mut self, store: &Store) -> Result<RowCheck, StoreError> {
        // A table that is missing is reported first: it is the reason of other problems.
        for problems in [store.changed_schema(), store.added_objects(), store.damage()] {
            match problems {
                Ok(problems) => {
                    problems.into_iter().for_each(|what| (self.report)(problem(self.name, what)));
                }
                Err(StoreError::Corrupt { problem: what, .. }) => {
                    (self.report)(problem(self.name, what))
                }
                Err(error) => return Err(error),
            }
        }
        let row_check = RowCheck::new()?;
        if !row_check.has_own_units(store)? {
            (self.report)(problem(self.name, OTHER_UNITS));
        }
        Ok(row_check)
    }

    fn check_material(
        &mut self,
        store: &Store,
        row_check: &mut RowCheck,
        slug: &Slug,
        count: &mut CheckCount,
        each: &mut impl FnMut(&Summary, &StoredRevision, &mut dyn FnMut(Problem)),
    ) -> Result<(), StoreError> {
        let numbers = match store.revision_numbers(slug) {
            Err(StoreError::Corrupt { problem: what, .. }) => {
                (self.report)(problem(slug.as_str(), what));
                return Ok(());
            }
            numbers => numbers?,
        };
        let summary = match store.summary(slug) {
            // A list that is damaged is found with the file.
            Err(StoreError::Corrupt { .. }) => None,
            summary => summary?,
        };
        let current = numbers.last().copied();
        for revision in numbers {
            let place = format!("{slug}@{revision}");
            // Reading recomputes the hash.
            match store.get(slug, Some(revision)) {
                Ok(Some(stored)) => {
                    count.revisions += 1;
                    count.curves += stored.material.curves.len();
                    if let Err(error) = stored.material.validate() {
                        (self.report)(problem(place, error));
                    } else {
                        derived(row_check, store, &stored)?.into_iter().for_each(&mut *self.report);
                        let is_current = Some(revision) == current;
                        if self.refit == Refit::All || self.refit == Refit::Current && is_current {
                            count.fits += check_fits(&stored, self.report);
                        }
                        if let Some(summary) = summary.as_ref().filter(|_| is_current) {
                            each(summary, &stored, self.report);
                        }
                    }
                }
                Ok(None) => (self.report)(problem(place, "is not there")),
                Err(StoreError::Corrupt { problem: what, .. }) => {
                    (self.report)(problem(place, what));
                }
                Err(error) => return Err(error),
            }
            (self.advance)();
        }
        Ok(())
    }
}

/// What is wrong with a database whose table of units was changed.
const OTHER_UNITS: &str = "its units of columns are not those that matdb writes";

/// Rows of a stored revision that do not follow from its content, such as statistics of curves and numbers of fits.
fn derived(
    row_check: &mut RowCheck,
    store: &Store,
    stored: &StoredRevision,
) -> Result<Vec<Problem>, StoreError> {
    let place = format!("{}@{}", stored.material.slug, stored.revision);
    let differences = row_check.differences(store, stored)?.into_iter();
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

/// Makes the fits of a revision again; returns their number.
fn check_fits(stored: &StoredRevision, report: &mut dyn FnMut(Problem)) -> usize {
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
fn without_report(fit: &Fit) -> String {
    format!("was found by `{}`, but the report of that is not there", fit.estimator)
}
