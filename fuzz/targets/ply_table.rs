#![no_main]

use libfuzzer_sys::fuzz_target;
use matdb::formats::ply::{read_table, write_table};

// What is read can be written, and the copy says the same.
fuzz_target!(|bytes: &[u8]| {
    let Ok(table) = read_table(bytes) else { return };
    let copy = write_table(&table).and_then(|bytes| read_table(&bytes)).expect("a table to copy");
    assert_eq!(copy.rows(), table.rows());
    assert_eq!(copy.columns.len(), table.columns.len());
});
