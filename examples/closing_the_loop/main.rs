//! How often a diagnosis is right, as a page:
//!
//!     cargo build --release
//!     cargo run --release --example closing_the_loop -- --cases DIR --matdb target/release/matdb \
//!         -o docs/closing-the-loop.md
//!
//! `DIR` is a folder of sealed cases as the example `twins` writes it. The program is run on every case
//! as a user would, and the labels are opened when all reports are there. Several `--cases` make a
//! section each, with `--title` and `--made-by` in the same order. `--jobs N` runs N cases at a time,
//! each on one thread. `--keep FOLDER` keeps the reports; cases that have one there are not run again.

pub mod label;
pub mod numbers;
pub mod page;
pub mod reason;
pub mod report;
pub mod run;
pub mod score;
pub mod section;
pub mod target;

use std::path::PathBuf;

use clap::Parser;

use page::Set;
use report::Run;
use run::Runner;
use score::Case;

/// Whatever ends the program.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Run the diagnosis on sealed cases and write a page about how often it is right
#[derive(Parser)]
struct Args {
    /// Folder with cases/ and labels/; may be given again
    #[arg(long, required = true)]
    cases: Vec<PathBuf>,
    /// Title of a folder's section, in the order of the folders
    #[arg(long)]
    title: Vec<String>,
    /// The command that made a folder's cases, in the order of the folders
    #[arg(long)]
    made_by: Vec<String>,
    /// On which cases the settings were tuned, printed as it is
    #[arg(long)]
    tuned_on: Option<String>,
    /// The program
    #[arg(long, default_value = "target/release/matdb")]
    matdb: PathBuf,
    /// Page to write
    #[arg(short, long)]
    output: PathBuf,
    /// Cases at a time
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Folder to keep the reports in
    #[arg(long)]
    keep: Option<PathBuf>,
}

#[allow(dead_code)] // The test that includes this file calls the parts.
fn main() -> Result<(), Failure> {
    let args = Args::parse();
    if args.title.len().max(args.made_by.len()) > args.cases.len() {
        return Err(
            "there are more titles or commands than folders; give a --cases for each".into()
        );
    }
    checked(&args)?;
    let scratch = tempfile::tempdir()?;
    let keep = args.keep.as_deref().unwrap_or(scratch.path());
    let runner = Runner::new(&args.matdb, args.jobs.into(), keep)?;
    let runs = args.cases.iter().map(|folder| runner.run(folder));
    let runs = runs.collect::<Result<Vec<_>, Failure>>()?;
    let sets = args.cases.iter().zip(runs).enumerate().map(|(number, (folder, runs))| {
        let title = args.title.get(number).cloned();
        Ok(Set {
            title: title.unwrap_or_else(|| format!("Set {}", number + 1)),
            made_by: args.made_by.get(number).cloned(),
            ..joined(runs, label::labels(folder)?)
        })
    });
    let sets = sets.collect::<Result<Vec<_>, Failure>>()?;
    std::fs::write(&args.output, page::page(&sets, args.tuned_on.as_deref()))?;
    Ok(())
}

/// What would otherwise be found out when hours of runs are over.
fn checked(args: &Args) -> Result<(), Failure> {
    let folders = args.cases.iter().flat_map(|folder| ["cases", "labels"].map(|f| folder.join(f)));
    let page = args.output.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folders.chain(page.map(Into::into)).find(|folder| !folder.is_dir()) {
        Some(absent) => Err(format!("{}: there is no such folder", absent.display()).into()),
        None => Ok(()),
    }
}

/// Every run with its truth.
pub fn joined(
    runs: Vec<(String, Run)>,
    mut labels: std::collections::BTreeMap<String, label::Label>,
) -> Set {
    let all = runs.len();
    let case = |(name, run): (String, Run)| Some(Case { label: labels.remove(&name)?, run });
    let cases: Vec<Case> = runs.into_iter().filter_map(case).collect();
    let unmatched = [all - cases.len(), labels.len()];
    Set { title: String::new(), made_by: None, cases, unmatched }
}
