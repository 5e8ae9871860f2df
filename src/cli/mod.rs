//! The command line: one command per file. Flags die here; the library takes plain values.

mod add;
mod calibrate;
mod check;
mod cite;
mod cloud;
mod compare;
mod completions;
mod console;
mod curves;
#[cfg(feature = "parquet")]
mod dataset;
mod diagnose;
mod diff;
mod effects;
mod export;
mod fit;
mod hint;
mod history;
mod import;
mod list;
mod man;
mod measure;
mod near;
mod new;
mod plot;
mod predict;
mod publish;
mod radar;
mod render;
mod rm;
mod search;
mod show;
mod summary;
mod verify;
mod withdraw;

use std::path::PathBuf;

use clap::{ArgAction, CommandFactory, Parser, Subcommand};

use crate::error::Error;
use crate::setup::Database;
use console::Console;
pub use console::{readable, say};
pub use hint::message;

/// A material database and renderer for 300 GHz imaging radar.
#[derive(Debug, Parser)]
#[command(name = "matdb", version, arg_required_else_help = true, max_term_width = 100)]
#[command(after_help = "Examples:
  matdb render scenes/mannequin.toml -o out     render a scene to images and a point cloud
  matdb add mannequin-paint                     put a built-in material into the database
  matdb list                                    see what the database holds")]
pub struct Cli {
    #[command(flatten)]
    options: Options,
    #[command(subcommand)]
    command: Command,
}

/// What every command understands.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "For every command")]
struct Options {
    /// Database file; created by the first `add` [default: matdb.sqlite]
    #[arg(long, env = "MATDB", global = true, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long, global = true)]
    json: bool,
    /// Print nothing but errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Print more about each step
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    New(Box<new::Args>),
    Render(render::Args),
    Radar(radar::Args),
    Calibrate(calibrate::Args),
    Measure(measure::Args),
    Compare(compare::Args),
    Diagnose(diagnose::Args),
    Effects(effects::Args),
    Add(Box<add::Args>),
    List(list::Args),
    Search(search::Args),
    Near(near::Args),
    Show(show::Args),
    Diff(diff::Args),
    History(history::Args),
    Cite(cite::Args),
    Plot(plot::Args),
    Predict(predict::Args),
    Fit(Box<fit::Args>),
    Check(check::Args),
    Rm(rm::Args),
    Withdraw(withdraw::Args),
    Publish(publish::Args),
    Verify(verify::Args),
    Import(import::Args),
    Export(export::Args),
    #[cfg(feature = "parquet")]
    Dataset(dataset::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// Runs one command.
///
/// # Errors
/// Whatever went wrong, as one sentence that names the place and the way out.
pub fn run(cli: &Cli) -> Result<(), Error> {
    let Options { db, json, quiet, verbose } = &cli.options;
    let console = Console { json: *json, quiet: *quiet, verbose: *verbose > 0 };
    let db = &Database::new(db.as_deref());
    match &cli.command {
        Command::New(args) => new::run(args, &console),
        Command::Render(args) => render::run(args, db, &console),
        Command::Radar(args) => radar::run(args, &console),
        Command::Calibrate(args) => calibrate::run(args, db, &console),
        Command::Measure(args) => measure::run(args, db, &console),
        Command::Compare(args) => compare::run(args, db, &console),
        Command::Diagnose(args) => diagnose::run(args, db, &console),
        Command::Effects(args) => effects::run(args, &console),
        Command::Add(args) => add::run(args, db, &console),
        Command::List(args) => list::run(args, db, &console),
        Command::Search(args) => search::run(args, db, &console),
        Command::Near(args) => near::run(args, db, &console),
        Command::Show(args) => show::run(args, db, &console),
        Command::Diff(args) => diff::run(args, db, &console),
        Command::History(args) => history::run(args, db, &console),
        Command::Cite(args) => cite::run(args, db, &console),
        Command::Plot(args) => plot::run(args, db, &console),
        Command::Predict(args) => predict::run(args, db, &console),
        Command::Fit(args) => fit::run(args, db, &console),
        Command::Check(args) => check::run(args, db, &console),
        Command::Rm(args) => rm::run(args, db, &console),
        Command::Withdraw(args) => withdraw::run(args, db, &console),
        Command::Publish(args) => publish::run(args, db, &console),
        Command::Verify(args) => verify::run(args, &console),
        Command::Import(args) => import::run(args, db, &console),
        Command::Export(args) => export::run(args, db, &console),
        #[cfg(feature = "parquet")]
        Command::Dataset(args) => dataset::run(args, db, &console),
        Command::Completions(args) => completions::run(args, Cli::command(), db),
        Command::Man(args) => man::run(args, Cli::command(), &console),
    }
}

#[cfg(test)]
mod tests {
    use std::any::TypeId;

    use super::*;

    /// Otherwise clap takes `-3` for a flag and proposes to write `-- -3`.
    #[test]
    fn a_negative_number_is_a_value_of_every_flag_that_takes_a_number() {
        let numbers = [
            TypeId::of::<f64>(),
            TypeId::of::<u16>(),
            TypeId::of::<u32>(),
            TypeId::of::<u64>(),
            TypeId::of::<usize>(),
        ];
        let mut seen = 0;
        for command in Cli::command().get_subcommands() {
            for flag in command.get_opts() {
                if numbers.iter().any(|number| flag.get_value_parser().type_id() == *number) {
                    let name = format!("{} --{}", command.get_name(), flag.get_id());
                    assert!(flag.is_allow_negative_numbers_set(), "{name}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 10, "{seen}");
    }

    #[test]
    fn only_what_concerns_a_measured_curve_stands_under_its_heading() {
        let of_stored_curve = Some("For a measured curve that is stored");
        for command in ["fit", "measure"] {
            let cli = Cli::command();
            let command = cli.find_subcommand(command).unwrap();
            let flags =
                command.get_opts().filter(|flag| flag.get_help_heading() == of_stored_curve);
            let names: Vec<&str> = flags.map(|flag| flag.get_id().as_str()).collect();
            assert_eq!(names, ["licence", "instrument", "frequency", "threshold"]);
        }
    }
}
