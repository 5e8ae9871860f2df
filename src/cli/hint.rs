//! Errors with the flags of their ways out: the library speaks of settings, the program of flags.

use super::console::readable;
use crate::catalogue::CatalogueError;
use crate::catalogue::exchange::{Detail, ExchangeError};
use crate::diagnose::curve::CurveDiagnoseError;
use crate::error::Error;
use crate::files::{FilesError, WayOut};
use crate::store::StoreError;

/// An error as the program shows it: one sentence, with the flags that lead out of it.
pub fn message(error: &Error) -> String {
    let text = match error {
        Error::Exchange(ExchangeError::Missing { file, missing }) => {
            format!("{file} does not say all that an entry needs; add {}", flags(missing))
        }
        Error::Change { changes, error } => format!("--set {changes}: {}", message(error)),
        Error::Missing { what, missing } => format!("{what} needs more; add {}", flags(missing)),
        Error::Detail { detail, problem, way_out } => {
            format!("--{} {problem}; {way_out}", detail.noun())
        }
        Error::Exchange(ExchangeError::FarFrequency { nearest_hz, .. }) => {
            format!("{error} (--frequency {:.5})", nearest_hz / 1e9)
        }
        Error::Files(FilesError { way_out: WayOut::OtherFolder, .. }) => format!("{error} (-o)"),
        Error::NoCurve { .. } => format!("{error} (--curve FILE)"),
        Error::NoDatabase { .. } => format!("{error} (--db, $MATDB)"),
        Error::NotConverged { .. } => format!("{error} (--fix, --starts, --model)"),
        Error::CurveDiagnosis { error: CurveDiagnoseError::Noiseless, .. } => {
            format!("{error} (--noise-db)")
        }
        Error::Catalogue(CatalogueError::NoLicence { .. }) => format!("{error} (--about FILE)"),
        Error::Store(StoreError::BeyondRepair { .. }) => {
            format!("{error} (`matdb list`, `matdb export`)")
        }
        Error::Store(StoreError::Corrupt { .. })
        | Error::Catalogue(
            CatalogueError::Damaged { .. } | CatalogueError::Store(StoreError::Corrupt { .. }),
        ) => format!("{error} (`matdb check`, `matdb check --repair`)"),
        error => error.to_string(),
    };
    readable(&text)
}

/// The flags of details, each with an example.
fn flags(details: &[Detail]) -> String {
    let mut flags = Vec::new();
    for detail in details {
        let (noun, example) = (detail.noun(), detail.example());
        let quote = if example.contains(' ') { "\"" } else { "" };
        flags.push(format!("--{noun} {quote}{example}{quote}"));
    }
    flags.join(", ")
}

/// The error with another way out, where it says one in words.
pub(super) fn or_else(error: Error, way_out: &str) -> Error {
    match error {
        Error::Usage { problem, way_out: first } => {
            Error::Usage { problem, way_out: format!("{first}, or {way_out}") }
        }
        error => error,
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::path::{Path, PathBuf};

    use super::*;

    fn files(way_out: WayOut) -> Error {
        let reason = io::Error::other("full");
        Error::Files(FilesError {
            way_out,
            ..FilesError::unwritable("write", Path::new("out"), reason)
        })
    }

    #[test]
    fn a_message_ends_with_the_flags_that_lead_out_of_it() {
        let file = || "water.yml".to_owned();
        let damaged =
            || StoreError::Corrupt { file: "a.sqlite".into(), problem: "torn".to_owned() };
        let far = ExchangeError::FarFrequency {
            file: file(),
            wanted_hz: 30e9,
            nearest_hz: 149.896_229e9,
        };
        let missing =
            ExchangeError::Missing { file: file(), missing: vec![Detail::Class, Detail::Source] };
        let no_licence =
            CatalogueError::NoLicence { found: "two".to_owned(), example: "CC0-1.0".to_owned() };
        let no_publication = CatalogueError::Damaged {
            database: PathBuf::from("a.sqlite"),
            problem: "torn".to_owned(),
        };
        let noiseless =
            Error::CurveDiagnosis { curve: file(), error: CurveDiagnoseError::Noiseless };
        let check = "a repair mends what can be (`matdb check`, `matdb check --repair`)";
        for (error, end) in [
            (files(WayOut::OtherFolder), "choose another folder (-o)"),
            (files(WayOut::Words("leave it out")), "; leave it out"),
            (Error::NoDatabase { path: PathBuf::from("a.sqlite") }, "makes one (--db, $MATDB)"),
            (Error::NoCurve { material: "ptfe".to_owned() }, "the file of a curve (--curve FILE)"),
            (
                Error::NotConverged { curve: file(), stop: "lost" },
                "another model (--fix, --starts, --model)",
            ),
            (noiseless, " (--noise-db)"),
            (Error::Exchange(far), "name another page (--frequency 149.89623)"),
            (
                Error::Exchange(missing),
                "; add --class paint, --source \"who measured it, where, when\"",
            ),
            (
                Error::Missing { what: "a curve", missing: vec![Detail::Threshold] },
                "; add --threshold -77",
            ),
            (Error::Catalogue(no_licence), "licence = \"CC0-1.0\" (--about FILE)"),
            (Error::Catalogue(no_publication), check),
            (
                Error::Store(damaged()),
                "brings back the rest (`matdb check`, `matdb check --repair`)",
            ),
            (
                Error::Catalogue(CatalogueError::Store(damaged())),
                "brings back the rest (`matdb check`, `matdb check --repair`)",
            ),
        ] {
            let text = message(&error);
            assert!(text.ends_with(end), "{text}");
        }
        let detail =
            Error::Detail { detail: Detail::Frequency, problem: "cannot be", way_out: "mend it" };
        assert_eq!(message(&detail), "--frequency cannot be; mend it");
    }
}
