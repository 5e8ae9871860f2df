#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::MeshFormat;

fuzz_target!(|bytes: &[u8]| {
    let _ = MeshFormat::Obj.read(bytes);
});
