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
        self.words()[0]
    }

    /// An example of it without its unit, which is that of the program's flags.
    pub fn example(self) -> &'static str {
        self.words()[1]
    }

    /// Noun, example and unit.
    fn words(self) -> [&'static str; 3] {
        match self {
            Detail::Name => ["name", "my-paint", ""],
            Detail::Class => ["class", "paint", ""],
            Detail::Licence => ["licence", "CC-BY-4.0", ""],
            Detail::Source => ["source", "who measured it, where, when", ""],
            Detail::Kind => ["kind", "measured", ""],
            Detail::Instrument => ["instrument", "name of the radar", ""],
            Detail::Frequency => ["frequency", "300", " GHz"],
            Detail::Threshold => ["threshold", "-77", " dBm"],
        }
    }

    /// Details with their examples, as a sentence lists them.
    pub fn list(details: &[Detail]) -> String {
        details.iter().map(Detail::to_string).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Detail {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [noun, example, unit] = self.words();
        write!(f, "{noun} ({example}{unit})")
    }
}
