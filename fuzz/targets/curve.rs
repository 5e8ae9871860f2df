#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::material::file::points;

fuzz_target!(|bytes: &[u8]| {
    let _ = points(bytes);
});
