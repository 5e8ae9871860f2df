//! Details of a material or a curve that a person can state.

use std::fmt;

/// A detail of a material or a curve that an entry needs and a person can state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Short name of the material.
    Name,
    /// Kind of material.
    Class,
    /// SPDX expression of the licence of the data.
    Licence,
    /// Who measured or made it, when and how.
    Source,
    /// How the numbers came to be.
    Kind,
    /// Name of the instrument.
    Instrument,
    /// Centre frequency.
    Frequency,
    /// Least power that counts as a detection.
    Threshold,
}

impl Detail {
    /// The word for it.
    pub fn noun(self) -> &'static str {
        match self {
            Detail::Name => "name",
            Detail::Class => "class",
            Detail::Licence => "licence",
            Detail::Source => "source",
            Detail::Kind => "kind",
            Detail::Instrument => "instrument",
            Detail::Frequency => "frequency",
            Detail::Threshold => "threshold",
        }
    }

    /// An example of it, and its unit.
    pub fn example(self) -> (&'static str, &'static str) {
        match self {
            Detail::Name => ("my-paint", ""),
            Detail::Class => ("paint", ""),
            Detail::Licence => ("CC-BY-4.0", ""),
            Detail::Source => ("who measured it, where, when", ""),
            Detail::Kind => ("measured", ""),
            Detail::Instrument => ("name of the radar", ""),
            Detail::Frequency => ("300", " GHz"),
            Detail::Threshold => ("-77", " dBm"),
        }
    }

    /// Details with their examples, as a sentence lists them.
    pub fn list(details: &[Detail]) -> String {
        details.iter().map(Detail::to_string).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Detail {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (example, unit) = self.example();
        write!(f, "{} ({example}{unit})", self.noun())
    }
}
