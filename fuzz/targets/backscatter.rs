//! A backscatter curve: read, written and read again it has as many rows.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::measure::Curve;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(curve) = Curve::read(bytes) {
        let again = Curve::read(&curve.write()).unwrap();
        assert_eq!(again.observations.len(), curve.observations.len());
    }
});
