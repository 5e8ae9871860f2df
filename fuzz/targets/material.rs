#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::material::file::parse;

const CURVE: &str = include_str!("../../materials/cotton/backscatter.csv");

fuzz_target!(|text: &str| {
    if let Ok(material) = parse("material.toml", text, |_| Ok(CURVE.as_bytes().to_vec())) {
        material.scattering().expect("what was accepted can be rendered");
    }
});
