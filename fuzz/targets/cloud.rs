//! A measured cloud in any of its formats: a cloud of finite points, or an error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::PointFormat;
use matdb::measure::CloudReading;

fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else { return };
    let format = match first % 5 {
        0 => PointFormat::Ply,
        1 => PointFormat::Csv,
        2 => PointFormat::Xyz,
        3 => PointFormat::Pcd,
        _ => PointFormat::Las,
    };
    if let Ok(cloud) = CloudReading::default().read(format, rest) {
        assert!(cloud.points().iter().all(|p| p.point.xyz.is_finite() && p.power_w.is_finite()));
    }
});
