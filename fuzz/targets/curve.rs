//! A curve's table with names of ours: points that belong in a curve, or an error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::ColumnNames;
use matdb::measure::Curve;

fuzz_target!(|bytes: &[u8]| {
    if let Ok((curve, _)) = Curve::read_as(bytes, &ColumnNames::default()) {
        assert!(curve.observations.iter().all(|row| row.level_sigma0().is_some()));
    }
});
