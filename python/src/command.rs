//! The command line, which the wheel brings along.

use std::ffi::OsString;

use clap::Parser;
use pyo3::prelude::*;

/// Runs a command with these words, the program's name first. Returns its exit status.
#[pyfunction]
pub(crate) fn _run(py: Python<'_>, words: Vec<OsString>) -> i32 {
    py.detach(|| {
        let cli = match matdb::cli::Cli::try_parse_from(words) {
            Ok(cli) => cli,
            Err(error) => {
                // A closed terminal is no reason for another status.
                let _ = error.print();
                return error.exit_code();
            }
        };
        match matdb::cli::run(&cli) {
            Ok(()) => 0,
            Err(error) => {
                matdb::cli::say(&format!("error: {}", matdb::cli::message(&error)));
                1
            }
        }
    })
}
