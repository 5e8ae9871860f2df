//! The `matdb` program: parses the command line and hands over to [`matdb::cli`].

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match matdb::cli::run(&matdb::cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            matdb::cli::say(&format!("error: {}", matdb::cli::message(&error)));
            ExitCode::FAILURE
        }
    }
}
