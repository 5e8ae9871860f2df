//! Promise: `docs/fitting.md` says what the code does. One cheap row is computed again, over all seeds.
#![allow(dead_code)] // The study's own modules, of which this takes one row.

#[path = "../examples/fitting/study.rs"]
mod study;
#[path = "../examples/fitting/truth.rs"]
mod truth;

const SEEDS: usize = 200;
const PIECEWISE: usize = 1;

#[test]
fn a_row_of_the_page_is_what_the_code_gives() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/fitting.md"));
    let page = page.unwrap();
    assert!(page.contains(&format!("Bias and coverage (synthetic, {SEEDS} seeds)")));
    let case = truth::Case { looks: 8.0, theta_sd_deg: 0.0 };
    let row = study::outcome(case, PIECEWISE, SEEDS).unwrap().row();
    let command = "cargo run --release --example fitting -- docs/fitting.md";
    assert!(page.contains(&row), "stale page, write it again by `{command}`; now {row}");
}
