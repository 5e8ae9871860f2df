//! Values in the plane of incidence, as CSV and as .bsdf: angles and levels that a fit can use, or an
//! error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::ColumnNames;
use matdb::material::file::in_plane::{read_bsdf, read_table};

fuzz_target!(|bytes: &[u8]| {
    let table = read_table(bytes, &ColumnNames::default()).map(|(table, _)| table);
    for value in [table, read_bsdf(bytes)].into_iter().flatten().flatten() {
        assert!(value.theta_i_rad.cos() > 0.0 && value.theta_s_rad.cos() > 0.0);
        assert!(value.f_per_sr.is_finite() && value.f_per_sr > 0.0);
    }
});
