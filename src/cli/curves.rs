//! Flags that say where a curve comes from.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::adopt::CurveOrigin;
use crate::material::SourceKind;
use crate::units::watts_from_dbm;

/// Kinds of numbers that the user has made, not read.
pub(super) const OWN: [SourceKind; 2] = [SourceKind::Measured, SourceKind::Synthetic];

/// Reads one of these kinds by its word.
pub(super) fn kind_of<const N: usize>(
    kinds: [SourceKind; N],
) -> impl TypedValueParser<Value = SourceKind> {
    PossibleValuesParser::new(kinds.map(SourceKind::as_str)).try_map(move |word| {
        kinds.into_iter().find(|kind| kind.as_str() == word).ok_or("there is no such kind")
    })
}

/// What a person says of a curve that is to be stored.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "For a measured curve that is stored")]
pub(super) struct Circumstances {
    /// SPDX identifier of the licence of its data
    #[arg(long, value_name = "SPDX", requires = "save")]
    licence: Option<String>,
    /// Name of the instrument, one of the material's or a new one
    #[arg(long, value_name = "TEXT", requires = "save")]
    instrument: Option<String>,
    /// Centre frequency of a new instrument
    #[arg(long, value_name = "GHZ", requires = "save", allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Least power that counts as a detection with a new instrument
    #[arg(long, value_name = "DBM", requires = "save", allow_negative_numbers = true)]
    threshold: Option<f64>,
}

impl Circumstances {
    /// All that is stated of a curve.
    pub fn origin(&self, kind: Option<SourceKind>, title: Option<&String>) -> CurveOrigin {
        CurveOrigin {
            kind,
            title: title.cloned(),
            licence: self.licence.clone(),
            instrument: self.instrument.clone(),
            frequency_hz: self.frequency.map(|ghz| ghz * 1e9),
            threshold_w: self.threshold.map(watts_from_dbm),
        }
    }
}
