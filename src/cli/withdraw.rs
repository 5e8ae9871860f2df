//! `matdb withdraw`.

use serde_json::json;

use super::console::Console;
use crate::adopt::Withdrawal;
use crate::error::Error;
use crate::setup::Database;

/// Say that a material must not be used any more, and why
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb withdraw my-paint --reason 'The trihedral was dented: levels are 3 dB low.'
  matdb withdraw my-paint --superseded-by my-paint-2 --reason 'Measured again.'

The material and its revisions stay. `matdb list --status withdrawn` lists such materials, and a published \
page says the reason first. An entry that is added again with `status = { is = \"active\" }` may be used again.")]
pub(super) struct Args {
    /// Name of the material
    name: String,
    /// Why, in a sentence
    #[arg(long, value_name = "TEXT")]
    reason: String,
    /// The material that replaces it
    #[arg(long, value_name = "NAME")]
    superseded_by: Option<String>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    if args.reason.trim().is_empty() {
        return Err(Error::usage("--reason is empty", "say in a sentence why"));
    }
    if args.superseded_by.as_ref() == Some(&args.name) {
        let problem = "--superseded-by names the material that is withdrawn";
        return Err(Error::usage(problem, "name another one, or leave it out"));
    }
    let withdrawal = Withdrawal {
        name: args.name.clone(),
        reason: args.reason.clone(),
        superseded_by: args.superseded_by.clone(),
    };
    let (material, revision) = withdrawal.store(db)?;
    let (slug, status) = (&material.slug, material.status.as_str());
    let text = format!("{slug} is {status}, revision {revision}, in {}\n", db.path().display());
    console.result(&text, &json!({ "slug": slug, "status": material.status, "revision": revision }))
}
