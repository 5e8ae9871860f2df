//! Flags that say where a curve comes from.

use clap::ValueEnum;

use crate::adopt::CurveOrigin;
use crate::material::SourceKind;
use crate::units::watts_from_dbm;

/// How a curve came to be, as flags say it.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Kind {
    Measured,
    Synthetic,
}

impl From<Kind> for SourceKind {
    fn from(kind: Kind) -> SourceKind {
        match kind {
            Kind::Measured => SourceKind::Measured,
            Kind::Synthetic => SourceKind::Synthetic,
        }
    }
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
    #[arg(long, value_name = "GHZ", requires = "save")]
    frequency: Option<f64>,
    /// Least power that counts as a detection with a new instrument
    #[arg(long, value_name = "DBM", requires = "save", allow_negative_numbers = true)]
    threshold: Option<f64>,
}

impl Circumstances {
    /// All that is stated of a curve.
    pub fn origin(&self, kind: Option<Kind>, title: Option<&String>) -> CurveOrigin {
        CurveOrigin {
            kind: kind.map(SourceKind::from),
            title: title.cloned(),
            licence: self.licence.clone(),
            instrument: self.instrument.clone(),
            frequency_hz: self.frequency.map(|ghz| ghz * 1e9),
            threshold_w: self.threshold.map(watts_from_dbm),
        }
    }
}
