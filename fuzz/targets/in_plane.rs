//! Values in the plane of incidence, as CSV and as .bsdf: angles and levels that a fit can use, or an
//! error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::ColumnNames;
use matdb::material::file::in_plane::{InPlane, read_bsdf};
use matdb::material::file::points;

fuzz_target!(|bytes: &[u8]| {
    let table = points(bytes, &ColumnNames::default()).ok().filter(|table| table.is_in_plane);
    let rows = table.iter().flat_map(|table| &table.rows).filter(|(_, row)| !row.is_censored());
    let values = rows.map(|(_, row)| InPlane::of(row).expect("it lies in the plane of incidence"));
    for value in values.chain(read_bsdf(bytes).into_iter().flat_map(|(values, _)| values)) {
        assert!(value.theta_i_rad.cos() > 0.0 && value.theta_s_rad.cos() > 0.0);
        assert!(value.f_per_sr.is_finite() && value.f_per_sr > 0.0);
    }
});
