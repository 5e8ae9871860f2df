//! Foreign formats, one file each: what of a material they can hold, and what is lost.
//!
//! | format | out | in |
//! |---|---|---|
//! | the curve as CSV | `plain_csv.rs` | `plain_csv.rs` |
//! | the curve as Parquet | `parquet.rs` | |
//! | EMPIR universal BRDF | `universal_brdf.rs` | `universal_brdf.rs` |
//! | ASAM OpenMATERIAL 3D | `open_material.rs` | |
//! | Mitsuba 3 BSDF | `mitsuba.rs` | |
//! | Sionna RT radio material | `sionna.rs` | |
//! | refractiveindex.info page | | `optical_constants.rs` |
//!
//! An exported file depends on the material and its revision alone: the same material gives the same bytes. An
//! imported file becomes a [`Material`] that states its source.

mod dispersion;
mod error;
mod export_files;
mod detail;
mod details;
mod mitsuba;
mod open_material;
mod optical_constants;
mod page;
#[cfg(feature = "parquet")]
mod parquet;
mod plain_csv;
mod sionna;
mod subject;
mod universal_brdf;
mod universal_brdf_in;

use crate::material::Material;

pub use detail::Detail;
pub use details::Details;
pub use error::ExchangeError;
pub use export_files::Export;
pub use subject::Subject;

/// A format that a material can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    #[allow(missing_docs)]
    Csv,
    #[allow(missing_docs)]
    Parquet,
    #[allow(missing_docs)]
    UniversalBrdf,
    #[allow(missing_docs)]
    OpenMaterial,
    #[allow(missing_docs)]
    Mitsuba,
    #[allow(missing_docs)]
    Sionna,
}

/// Writes a material in a format; `name` is that of the file, with its ending.
///
/// # Errors
/// When the material lacks what the format needs, or the program was built without the format.
pub fn export(subject: &Subject, format: Format, name: &str) -> Result<Export, ExchangeError> {
    match format {
        Format::Csv => Ok(plain_csv::write(subject, name)),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::write(subject, name),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => Err(ExchangeError::NotBuilt),
        Format::UniversalBrdf => universal_brdf::write(subject, name),
        Format::OpenMaterial => open_material::write(subject, name),
        Format::Mitsuba => mitsuba::write(subject, name),
        Format::Sionna => sionna::write(subject, name),
    }
}

/// A foreign format, by the ending of the file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// `.yml`, `.yaml`: a page of refractiveindex.info's database.
    OpticalConstants,
    /// `.csv`, `.bsdf`: a curve.
    Csv,
    /// `.brdf`, `.json`: universal BRDF.
    UniversalBrdf,
}

impl Foreign {
    /// The format that an ending stands for, in upper or lower case and without the dot.
    pub fn from_extension(extension: &str) -> Option<Foreign> {
        match extension.to_ascii_lowercase().as_str() {
            "yml" | "yaml" => Some(Foreign::OpticalConstants),
            "csv" | "bsdf" => Some(Foreign::Csv),
            "brdf" | "json" => Some(Foreign::UniversalBrdf),
            _ => None,
        }
    }

    /// Makes a material of a file's bytes and of what a person states in addition, and says what a person should know of
    /// the file. `file` names it in errors and sources.
    ///
    /// # Errors
    /// When the bytes do not follow the format, or neither they nor `given` state what an entry needs.
    pub fn read(
        self,
        file: &str,
        bytes: &[u8],
        given: &Details,
    ) -> Result<(Material, Vec<String>), ExchangeError> {
        let (mut material, notices) = match self {
            Foreign::OpticalConstants => (optical_constants::read(file, bytes, given)?, Vec::new()),
            Foreign::Csv => plain_csv::read(file, bytes, given)?,
            Foreign::UniversalBrdf => (universal_brdf_in::read(file, bytes, given)?, Vec::new()),
        };
        given.complete(&mut material);
        match material.validate() {
            Ok(()) => Ok((material, notices)),
            Err(error) => Err(ExchangeError::Material { file: file.to_owned(), error }),
        }
    }
}
