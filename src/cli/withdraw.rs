//! `matdb withdraw`.

use serde_json::json;

use super::console::Console;
use crate::adopt::activity;
use crate::error::Error;
use crate::material::{Material, Slug, Status};
use crate::setup::Database;
use crate::setup::{find_material, unknown_material};
use crate::store::Store;

/// Say that a material must not be used any more, and why; it and its revisions stay
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb withdraw my-paint --reason 'The trihedral was dented: levels are 3 dB low.'
  matdb withdraw my-paint --superseded-by my-paint-2 --reason 'Measured again with a sound trihedral.'

`matdb list --status withdrawn` lists such materials, and a published page says the reason first. An
entry that is added again with `status = { is = \"active\" }` may be used again.")]
pub(super) struct Args {
    /// Name of the material
    name: String,
    /// Why, in a sentence
    #[arg(long, value_name = "TEXT")]
    reason: String,
    /// The better one that has taken its place
    #[arg(long, value_name = "NAME")]
    superseded_by: Option<String>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    // Opening for reading first: a database that is not there must not be made by this.
    let known = db.read()?;
    let stored = match (&known, args.name.parse::<Slug>()) {
        (Some(store), Ok(slug)) => store.get(&slug, None)?,
        _ => None,
    };
    let Some(stored) = stored else {
        find_material(known.as_ref(), &args.name, "")?;
        return Err(Error::Usage {
            problem: format!("`{}` is not in {}", args.name, db.path().display()),
            way_out: "give the bare name of one that `matdb list` shows".to_owned(),
        });
    };
    let reason = args.reason.clone();
    let status = match &args.superseded_by {
        None => Status::Withdrawn { reason },
        Some(by) => Status::Superseded { by: successor(known.as_ref(), &args.name, by)?, reason },
    };
    drop(known);
    let material = Material { status, ..stored.material };
    let mut store = db.write()?;
    store.record(activity("withdraw", &[])?);
    let added = store.add([&material])?;
    let revision = added.first().map_or(stored.revision, |added| added.revision());
    let (slug, status) = (&material.slug, material.status.as_str());
    let text = format!("{slug} is {status}, revision {revision}, in {}\n", db.path().display());
    console.result(&text, &json!({ "slug": slug, "status": material.status, "revision": revision }))
}

/// The name of the better one, which must be there.
fn successor(store: Option<&Store>, name: &str, by: &str) -> Result<Slug, Error> {
    const ASKED_BY: &str = "--superseded-by: ";
    let error = match find_material(store, by, ASKED_BY) {
        Ok(found) if found.material.slug.as_str() == by => return Ok(found.material.slug),
        Ok(_) => unknown_material(store, by, ASKED_BY)?,
        Err(error) => error,
    };
    match error {
        // The nearest name is often that of the one which is withdrawn.
        Error::UnknownMaterial { asked_by, name: wanted, way_out }
            if way_out.contains(&format!("`{name}`")) =>
        {
            let way_out = "add that one first, with `matdb add --from FILE`".to_owned();
            Err(Error::UnknownMaterial { asked_by, name: wanted, way_out })
        }
        error => Err(error),
    }
}
