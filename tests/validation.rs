//! Promise: docs/validation.md says what the crate computes, tests/validation/rows.md says it number for
//! number, and every number lies within its tolerance unless the page says that it does not.
//!
//! `MATDB_WRITE_VALIDATION=1 cargo test --test promises validation::` writes both.

mod between_the_parts;
mod chirp_chain;
mod echoes_of_sheets;
mod fixture;
mod kirchhoff;
mod microfacet;
mod other_paths;
mod page;
mod passive;
mod quadrature;
mod reciprocity_energy;
mod rough;
mod smooth;
mod solids;
mod speckle;
mod stage;
mod sub_rays;
mod transmitter;

use crate::support;
use page::{Row, Section};

const PAGE: &str = "docs/validation.md";

fn sections() -> Vec<Section> {
    vec![
        reciprocity_energy::section(),
        microfacet::section(),
        solids::section(),
        other_paths::section(),
        kirchhoff::section(),
        sub_rays::section(),
        chirp_chain::section(),
        between_the_parts::section(),
    ]
}

#[test]
fn the_page_holds_what_the_crate_computes() {
    let sections = sections();
    let surprises: Vec<String> =
        sections.iter().flat_map(Section::rows).filter_map(Row::surprise).collect();
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
    for (path, made) in [(PAGE, page::markdown(&sections)), (page::ROWS, page::rows(&sections))] {
        compare_or_write(path, &made);
    }
}

/// A file that is as it is made; written where that is asked for.
fn compare_or_write(name: &str, made: &str) {
    let path = support::root().join(name);
    if std::env::var_os("MATDB_WRITE_VALIDATION").is_some() {
        return std::fs::write(path, made).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    for (number, (made, committed)) in std::iter::zip(made.lines(), committed.lines()).enumerate() {
        assert_eq!(made, committed, "line {} of {name} is stale; {}", number + 1, page::COMMAND);
    }
    assert!(made == committed, "{name} has other lines than it should; {}", page::COMMAND);
}
