//! A measured cloud in any of its formats: a cloud of finite points, or an error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::measure::{CloudFormat, CloudReading};

fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else { return };
    let format = match first % 3 {
        0 => CloudFormat::Ply,
        1 => CloudFormat::Csv,
        _ => CloudFormat::Xyz,
    };
    if let Ok(cloud) = CloudReading::default().read(format, rest) {
        assert!(cloud.points().iter().all(|p| p.point.xyz.is_finite() && p.power_w.is_finite()));
    }
});
