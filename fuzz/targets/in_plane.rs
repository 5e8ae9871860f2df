//! Values in the plane of incidence, as CSV and as .bsdf: angles and levels that a fit can use, or an error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::ColumnNames;
use matdb::material::file::in_plane::read_bsdf;
use matdb::material::file::points;

fuzz_target!(|bytes: &[u8]| {
    let table = points(bytes, &ColumnNames::default()).unwrap_or_default();
    for (_, row) in table.rows {
        assert!(row.theta_i_rad.cos() > 0.0 && row.theta_r_rad.cos() > 0.0);
        assert!(row.level_sigma0().is_some_and(|sigma0| sigma0.is_finite() && sigma0 > 0.0));
    }
    for value in read_bsdf(bytes).into_iter().flat_map(|(values, _)| values) {
        assert!(value.theta_i_rad.cos() > 0.0 && value.theta_s_rad.cos() > 0.0);
        assert!(value.f_per_sr.is_finite() && value.f_per_sr > 0.0);
    }
});
