#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::material::file::observations;

fuzz_target!(|bytes: &[u8]| {
    let _ = observations(bytes);
});
