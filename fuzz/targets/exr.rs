#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::exr;

fuzz_target!(|bytes: &[u8]| {
    let _ = exr::read(bytes);
});
