//! Errors of reading and writing foreign formats.

use thiserror::Error;

use super::detail::Detail;
use crate::formats::FormatError;
use crate::material::{MaterialError, Slug};

/// Why a material could not be written in a format or read from one.
#[derive(Debug, Error)]
pub enum ExchangeError {
    /// A file does not follow its format.
    #[error("{file}: {error}")]
    Format {
        /// The file.
        file: String,
        /// What is wrong.
        error: FormatError,
    },
    /// No frequency of the file is near the wanted one.
    #[error(
        "{file}: DATA: the tabulated frequency nearest to {} GHz is {:.5} GHz, {:.5} GHz away, and nothing is \
         extrapolated; ask for the frequency {:.5} GHz, or name another page",
        wanted_hz / 1e9,
        nearest_hz / 1e9,
        (nearest_hz - wanted_hz).abs() / 1e9,
        nearest_hz / 1e9
    )]
    FarFrequency {
        /// The file.
        file: String,
        /// The wanted frequency, Hz.
        wanted_hz: f64,
        /// The nearest one in the file, Hz.
        nearest_hz: f64,
    },
    /// The file was read, but makes an impossible material.
    #[error("{file}: {error}")]
    Material {
        /// The file.
        file: String,
        /// What is wrong.
        error: MaterialError,
    },
    /// Neither the file nor the user states what an entry needs.
    #[error("{file} does not say all that an entry needs; state its {}", Detail::list(missing))]
    Missing {
        /// The file.
        file: String,
        /// What is missing.
        missing: Vec<Detail>,
    },
    /// The material lacks what the format needs.
    #[error("`{slug}` cannot be written as {format}: {problem}; {way_out}")]
    Unfit {
        /// The material.
        slug: String,
        /// The format.
        format: &'static str,
        /// What is missing.
        problem: String,
        /// What to do.
        way_out: String,
    },
    /// The program was built without Parquet.
    #[error(
        "this matdb was built without Parquet; build it with `--features parquet`, or write CSV"
    )]
    NotBuilt,
    /// A record cannot be encoded.
    #[error("cannot write {format}: {problem}; please report this")]
    Encoding {
        /// The format.
        format: &'static str,
        /// What the writer says.
        problem: String,
    },
}

impl ExchangeError {
    /// A file that does not follow its format.
    pub(super) fn in_file(file: &str, error: FormatError) -> ExchangeError {
        ExchangeError::Format { file: file.to_owned(), error }
    }

    /// A material that lacks what a format needs.
    pub(super) fn unfit(
        slug: &Slug,
        format: &'static str,
        problem: impl ToString,
        way_out: &str,
    ) -> ExchangeError {
        ExchangeError::Unfit {
            slug: slug.to_string(),
            format,
            problem: problem.to_string(),
            way_out: way_out.to_owned(),
        }
    }

    /// A record that the writer of a format refused.
    pub(super) fn encoding(format: &'static str, problem: impl ToString) -> ExchangeError {
        ExchangeError::Encoding { format, problem: problem.to_string() }
    }
}
