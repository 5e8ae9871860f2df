//! `matdb add`.

mod foreign;

use std::cell::RefCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::console::Console;
use crate::adopt::admission;
use crate::adopt::input;
use crate::catalogue::Diff;
use crate::effects::Level;
use crate::error::Error;
use crate::files::{FilesError, read_small};
use crate::material::{Activity, Input, Material, builtin, file};
use crate::scene::read_regular;
use crate::setup::Database;
use crate::setup::{resolve_effects, unknown_material};
use crate::store::Added;

/// Put materials into the database, built-in ones by name or your own from files
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb add mannequin-paint ptfe       two built-in materials
  matdb add --all                      every built-in material
  matdb add --from my-paint/           the folder's material.toml, or that of each subfolder
  matdb add --from my-paint/material.toml
  matdb add --template > my-paint/material.toml    a complete entry to change
  matdb add --from water.yml --name water --class liquid    a page of refractiveindex.info
  matdb add --from paint.brdf --name my-paint --class paint       a universal BRDF file
  matdb add --from scan.csv --name my-paint --class paint \\
    --kind measured --source 'Our bench, 2026' --licence CC-BY-4.0 \\
    --instrument 'Our radar' --frequency 300 --threshold -77      a bare curve

A bare curve has the columns theta_deg and sigma0_db; where nothing was detected sigma0_db is empty,
censor is left and threshold_db the limit in dB. docs/materials.md has the other columns.")]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true))]
pub(super) struct Args {
    /// Names of built-in materials
    #[arg(group = "what")]
    names: Vec<String>,
    /// Every built-in material
    #[arg(long, group = "what")]
    all: bool,
    /// A material.toml, or a folder with one or with subfolders that have one; or a curve (.csv), a
    /// universal BRDF (.brdf, .json) or a page of refractiveindex.info's database (.yml)
    #[arg(long, value_name = "FILE|DIR", group = "what")]
    from: Vec<PathBuf>,
    /// Print a complete material.toml with comments, to be changed
    #[arg(long, group = "what", conflicts_with_all = ["names", "all", "from"])]
    template: bool,
    #[command(flatten)]
    foreign: foreign::Beside,
}

/// A complete material.toml; docs/materials.md shows the same.
const TEMPLATE: &str = include_str!("add/template.toml");

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    if args.template {
        return console.result(TEMPLATE, &json!({ "material_toml": TEMPLATE }));
    }
    let made = wanted(args, db, console)?;
    let notes = made.iter().flat_map(|(material, _)| admission::doubts(material));
    notes.for_each(|doubt| console.notice(&doubt));
    for (material, _) in &made {
        let slug = &material.slug;
        let is_other = |own: Material| own.content_hash() != material.content_hash();
        if builtin::get(slug.as_str()).and_then(Result::ok).is_some_and(is_other) {
            console.notice(&format!(
                "{slug}: a built-in material has this name, and `matdb add {slug}` would make it the next revision"
            ));
        }
    }
    let mut store = db.write()?;
    let (mut lines, mut records) = (String::new(), Vec::new());
    for ((material, _), added) in std::iter::zip(&made, store.add_made(&made)?) {
        let slug = &material.slug;
        let (what, revision) = match added {
            Added::New => ("added", 1),
            Added::Revision(number) => ("revised", number),
            Added::Unchanged(number) => ("unchanged", number),
            Added::Repaired(number) => ("repaired", number),
        };
        lines += &format!("{what} {slug}, revision {revision}, in {}\n", db.path().display());
        let differs = match added {
            // It is stored: what cannot be told now is not.
            Added::Revision(number) => store.get(slug, Some(number - 1)).ok().flatten(),
            Added::New | Added::Unchanged(_) | Added::Repaired(_) => None,
        };
        if let Some(before) = &differs
            && let (Some(said), None) =
                (before.material.status.sentence(), material.status.sentence())
        {
            console.notice(&format!("{slug}: it was {said}; this revision makes it active again"));
        }
        let differs = differs.map(|before| Diff::new(&before.material, material).line());
        if let Some(line) = &differs {
            lines += &format!("  what differs: {line}\n");
        }
        records.push(
            json!({ "slug": slug, "result": what, "revision": revision, "differs": differs }),
        );
    }
    console.result(&lines, &records)
}

/// Reads everything before anything is stored, so that one bad file changes nothing.
fn wanted(
    args: &Args,
    db: &Database,
    console: &Console,
) -> Result<Vec<(Material, Activity)>, Error> {
    let mut materials = Vec::new();
    let all = builtin::names().map(str::to_owned).filter(|_| args.all);
    for name in args.names.iter().cloned().chain(all) {
        match builtin::get(&name) {
            Some(material) => materials.push((material?, made(Vec::new()))),
            None if name.contains('@') => {
                return Err(Error::Usage {
                    problem: format!("`{name}` names a revision"),
                    way_out: "a built-in material is added by its bare name".to_owned(),
                });
            }
            None => {
                let store = db.read()?;
                return Err(unknown_material(store.as_ref(), &name, "")?);
            }
        }
    }
    args.foreign.check(&args.from)?;
    for path in &args.from {
        for file in material_files(path)? {
            materials.push(match foreign::format(&file) {
                Some(format) => {
                    let (material, input) = foreign::read(format, &file, &args.foreign)?;
                    let unknown = material.unknown.iter();
                    unknown.for_each(|what| console.notice(&format!("not known: {what}")));
                    (material, made(vec![input]))
                }
                None => read(&file)?,
            });
        }
    }
    let mut seen = HashSet::new();
    match materials.iter().find(|(material, _)| !seen.insert(&material.slug)) {
        None => Ok(materials),
        Some((Material { slug, .. }, _)) => Err(Error::Usage {
            problem: format!("`{slug}` is named or found twice"),
            way_out: "name it once, or give one of the files another slug".to_owned(),
        }),
    }
}

/// The material files that a path means.
fn material_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    const NAME: &str = "material.toml";
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    if path.join(NAME).exists() {
        return Ok(vec![path.join(NAME)]);
    }
    let entries = std::fs::read_dir(path).map_err(|reason| FilesError::unreadable(path, reason))?;
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|e| e.path().join(NAME)).filter(|f| f.exists()).collect();
    files.sort();
    if files.is_empty() {
        return Err(Error::Usage {
            problem: format!("{} holds no {NAME}, nor does any folder in it", path.display()),
            way_out: "give the folder of a material, such as materials/ptfe".to_owned(),
        });
    }
    Ok(files)
}

fn made(inputs: Vec<Input>) -> Activity {
    Activity { command: "add".to_owned(), inputs, origin: None }
}

fn read(path: &Path) -> Result<(Material, Activity), Error> {
    let bytes = read_small(path).map_err(unreadable)?;
    let inputs = RefCell::new(vec![input(path, &bytes)]);
    let text = String::from_utf8(bytes).map_err(|error| Error::Usage {
        problem: format!(
            "{}: byte {}: not UTF-8",
            path.display(),
            error.utf8_error().valid_up_to()
        ),
        way_out: "save the file as UTF-8".to_owned(),
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let read_csv = |name: &str| {
        let bytes = read_regular(&folder.join(name)).map_err(|e| e.to_string())?;
        inputs.borrow_mut().push(input(Path::new(name), &bytes));
        Ok(bytes)
    };
    let material = file::parse(&path.display().to_string(), &text, read_csv)?;
    resolve_effects(&material.effects, Level::Material, format!("{}: [[effect]]", path.display()))?;
    admission::check(&material, path)?;
    Ok((material, made(inputs.into_inner())))
}

/// The error for a material's file, with the way out for one that is too large.
fn unreadable(error: FilesError) -> FilesError {
    match error.reason.kind() {
        std::io::ErrorKind::FileTooLarge => FilesError {
            way_out: "put points into a CSV file that a [[curve]] names, and shorten texts",
            ..error
        },
        _ => error,
    }
}
