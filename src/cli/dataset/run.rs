//! `matdb dataset run` and `matdb dataset shard`.

use std::path::PathBuf;
use std::time::Instant;

use super::plan::{duration, planned, words};
use super::source::Source;
use crate::cli::console::{Console, say};
use crate::cli::summary::counted;
use crate::dataset::{Dataset, DatasetProgress, DatasetRun};
use crate::error::Error;
use crate::setup::Database;

/// Make what is missing of a data set
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset run concealed.toml -o ds      plan and make it
  matdb dataset run ds                        go on with it

It can be stopped at any point: the same command goes on with the shards that are missing.")]
pub(super) struct RunArgs {
    /// The specification, or the folder of a plan
    what: PathBuf,
    /// Folder of the data set; that of the plan where one is given
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Make a part of a planned data set
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset shard ds 0/4                             the first of four parts
  matdb dataset shard ds $SLURM_ARRAY_TASK_ID/64         a task of an array, on a folder that all nodes share")]
pub(super) struct ShardArgs {
    /// Folder of the plan
    folder: PathBuf,
    /// Number of the part, from 0, and how many there are
    #[arg(value_name = "K/N", value_parser = part)]
    part: [u32; 2],
}

fn part(text: &str) -> Result<[u32; 2], String> {
    let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
    match numbers {
        Some((Ok(number), Ok(of))) => Ok([number, of]),
        _ => Err("give two whole numbers, such as 3/64".to_owned()),
    }
}

pub(super) fn run(args: &RunArgs, db: &Database, console: &Console) -> Result<(), Error> {
    let dataset = match &args.output {
        Some(output) if args.what != *output => {
            let source = Source { spec: args.what.clone(), output: output.clone() };
            planned(&source, db, console)?
        }
        None if args.what.is_file() => {
            return Err(Error::usage(
                format!(
                    "{} is a specification, and there is no folder for its data set",
                    args.what.display()
                ),
                "give one: -o DIR",
            ));
        }
        _ => Dataset::open(&args.what)?,
    };
    make(&dataset, None, console)
}

pub(super) fn shard(args: &ShardArgs, console: &Console) -> Result<(), Error> {
    make(&Dataset::open(&args.folder)?, Some(args.part), console)
}

fn make(dataset: &Dataset, part: Option<[u32; 2]>, console: &Console) -> Result<(), Error> {
    if !console.quiet {
        say(words(dataset).trim_end());
    }
    let (begun, activity) = (Instant::now(), console.activity("scans"));
    let made = dataset.run(part, &|DatasetProgress { done, of }| {
        if done > 0 {
            let rate = f64::from(done) / begun.elapsed().as_secs_f64();
            let left = duration(f64::from(of - done) / rate);
            activity.now(&format!("{done} of {of}, {rate:.1} a second, {left} to go"));
        }
    });
    activity.end();
    let made = made?;
    console.result(&result(dataset, &made, begun), &made)
}

fn result(dataset: &Dataset, made: &DatasetRun, begun: Instant) -> String {
    let folder = dataset.folder().display();
    let whole = match made.missing {
        0 => format!("{folder} is complete"),
        missing => format!("{} of {folder} missing", counted(missing as usize, "shard")),
    };
    if made.shards == 0 {
        return format!("nothing to make: {whole}\n");
    }
    format!(
        "{} in {} made in {}; {whole}\n",
        counted(made.scans as usize, "scan"),
        counted(made.shards as usize, "shard"),
        duration(begun.elapsed().as_secs_f64())
    )
}
