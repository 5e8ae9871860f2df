//! One antenna has one beam: what lies between spot, aperture, wavefront, lobes, edges and sheets, by the compiled program.

use super::page::Section;
use super::{echoes_of_sheets, passive, rough, smooth, speckle};

pub fn section() -> Section {
    let mut tables = smooth::tables();
    tables.extend(rough::tables());
    tables.extend(passive::tables());
    tables.extend(echoes_of_sheets::tables());
    tables.extend(speckle::tables());
    Section {
        title: "Between the parts",
        tables,
        not_covered: vec![
            "Speckle that several antennas share, or that a target keeps as it turns.",
            "Speckle of several echoes in one range spectrum, behind sheets, and over two surfaces.",
            "Between the parts: a waist that grows off-centre, and lobes that the beam widens for an antenna elsewhere.",
            "Between the parts: edges and corners of mirrors by full wave; their integral is scalar.",
        ],
    }
}
