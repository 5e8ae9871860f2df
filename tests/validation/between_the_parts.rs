//! One antenna has one beam: what lies between spot, aperture, wavefront, lobes, edges and sheets, by the compiled program.

use super::page::Section;
use super::{echoes_of_sheets, passive, rough, smooth};

pub fn section() -> Section {
    let mut tables = smooth::tables();
    tables.extend(rough::tables());
    tables.extend(passive::tables());
    tables.extend(echoes_of_sheets::tables());
    Section {
        title: "Between the parts",
        tables,
        not_covered: vec![
            "Speckle of one beam: correlation between neighbouring chirps.",
            "Between the parts: edges and corners of mirrors by full wave; their integral is scalar.",
        ],
    }
}
