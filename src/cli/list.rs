//! `matdb list`.

use super::console::Console;
use super::database::Database;
use super::summary::table;
use crate::error::Error;
use crate::material::builtin;

/// List the materials in the database
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb list
  matdb list --json | jq '.[].slug'")]
pub(super) struct Args {}

pub(super) fn run(db: &Database, console: &Console) -> Result<(), Error> {
    let materials = match db.read()? {
        Some(store) => store.list()?,
        None => Vec::new(),
    };
    let missing: Vec<&str> = builtin::names()
        .filter(|name| !materials.iter().any(|m| m.slug.as_str() == *name))
        .collect();
    let mut text = match materials.len() {
        0 => format!("no material in {} yet\n", db.path().display()),
        _ => table(
            &["material", "rev", "kind", "class", "curves", "points", "fits", "name"],
            materials.iter().map(|m| {
                [
                    m.slug.to_string(),
                    m.revision.to_string(),
                    m.render_kind.as_str().to_owned(),
                    m.class.clone(),
                    m.curves.to_string(),
                    m.observations.to_string(),
                    m.fits.to_string(),
                    m.name.clone(),
                ]
            }),
        ),
    };
    if !missing.is_empty() {
        text += &wrapped("built in, not added:", &missing);
    }
    console.result(&text, &materials)
}

/// Names after a title, on lines that a narrow terminal holds.
fn wrapped(title: &str, names: &[&str]) -> String {
    const WIDTH: usize = 80;
    let mut lines = vec![title.to_owned()];
    for (number, name) in names.iter().enumerate() {
        let comma = if number + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 2 <= WIDTH => {
                *line += &format!(" {name}{comma}")
            }
            _ => lines.push(format!("  {name}{comma}")),
        }
    }
    lines.join("\n") + "\n"
}
