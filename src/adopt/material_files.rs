//! Materials of files, and built-in ones by name, into the database.

use std::cell::RefCell;
use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::admission;
use super::provenance::input;
use crate::catalogue::Diff;
use crate::catalogue::exchange::{Details, Foreign};
use crate::effects::Level;
use crate::error::Error;
use crate::files::{FilesError, WayOut, read_small};
use crate::material::{Activity, Input, Material, Slug, builtin, file};
use crate::scene::read_regular;
use crate::setup::{Database, resolve_effects, unknown_material};
use crate::store::{Addition, Store};

/// Name of a material's file in its folder.
const FILE: &str = "material.toml";

/// Materials that were read and admitted, and wait to be stored.
#[derive(Clone, Debug, Default)]
pub struct NewMaterials {
    /// Each with the files that it was made of.
    pub made: Vec<(Material, Activity)>,
    /// Sentences on what is not known of them, and on what may be a slip.
    pub notices: Vec<String>,
}

/// A material that was stored.
#[derive(Clone, Debug)]
pub struct AddedMaterial {
    /// Its name.
    pub slug: Slug,
    /// What storing it did.
    pub added: Addition,
    /// How it differs from the revision before, where it is a new one.
    pub differs: Option<String>,
    /// A sentence on a material that was withdrawn or superseded before and is active again.
    pub notice: Option<String>,
}

impl NewMaterials {
    /// Reads built-in materials by name and those of files: of a material.toml, of a folder that has one or whose
    /// subfolders have, or of a file in a foreign format, for which `given` states what it lacks. `database` helps with
    /// names that are not known.
    ///
    /// # Errors
    /// The first one that cannot be read or is not [admitted](admission::check); one that is there twice.
    pub fn read(
        names: &[String],
        files: &[PathBuf],
        given: &Details,
        database: &Database,
    ) -> Result<NewMaterials, Error> {
        let mut new = NewMaterials::default();
        for name in names {
            new.made.push((read_builtin(name, database)?, activity(Vec::new())));
        }
        for path in files {
            for file in material_files(path)? {
                let (material, inputs) = match foreign_format(&file) {
                    Some(format) => {
                        let (material, notices, input) = read_foreign(format, &file, given)?;
                        new.notices.extend(notices);
                        let unknown = material.unknown.iter();
                        new.notices.extend(unknown.map(|what| format!("not known: {what}")));
                        (material, vec![input])
                    }
                    None => read_material(&file)?,
                };
                new.made.push((material, activity(inputs)));
            }
        }
        let mut seen = HashSet::new();
        if let Some((material, _)) =
            new.made.iter().find(|(material, _)| !seen.insert(&material.slug))
        {
            return Err(Error::Usage {
                problem: format!("`{}` is named or found twice", material.slug),
                way_out: "name it once, or give one of the files another slug".to_owned(),
            });
        }
        for (material, _) in &new.made {
            new.notices.extend(admission::doubts(material));
        }
        new.notices.extend(new.made.iter().filter_map(|(material, _)| hides_builtin(material)));
        Ok(new)
    }

    /// Stores all of them, or none.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn store(&self, database: &Database) -> Result<Vec<AddedMaterial>, Error> {
        let mut store = database.write()?;
        let added = store.add_made(&self.made)?;
        let materials = self.made.iter().map(|(material, _)| material);
        Ok(std::iter::zip(materials, added)
            .map(|(material, added)| AddedMaterial::new(material, added, &store))
            .collect())
    }
}

impl AddedMaterial {
    fn new(material: &Material, added: Addition, store: &Store) -> AddedMaterial {
        let slug = material.slug.clone();
        let Addition::Revision(number) = added else {
            return AddedMaterial { slug, added, differs: None, notice: None };
        };
        // It is stored by now: a revision before that cannot be read is not an error.
        let before = store.revision_before(&slug, number).ok().flatten();
        let before = before.and_then(|before| store.get(&slug, Some(before)).ok().flatten());
        let is_active = material.status.sentence().is_none();
        let said = before.as_ref().and_then(|before| before.material.status.sentence());
        let notice = match said {
            _ if !is_active => None,
            Some(said) => {
                Some(format!("{slug}: it was {said}; this revision makes it active again"))
            }
            None if before.as_ref().is_none_or(|before| before.revision + 1 != number) => {
                Some(format!(
                    "{slug}: the revision before this one is lost or damaged; if that had withdrawn it, withdraw it again"
                ))
            }
            None => None,
        };
        let differs = before.map(|before| Diff::new(&before.material, material).line());
        AddedMaterial { slug, added, differs, notice }
    }
}

/// The foreign format that the ending of a file stands for.
pub fn foreign_format(path: &Path) -> Option<Foreign> {
    Foreign::from_extension(path.extension()?.to_str()?)
}

/// That a material has the name of a built-in one, which is another.
fn hides_builtin(material: &Material) -> Option<String> {
    let slug = &material.slug;
    let own = builtin::get(slug.as_str())?.ok()?;
    (own.content_hash() != material.content_hash()).then(|| {
        format!(
            "{slug}: a built-in material has this name, and `matdb add {slug}` would make it the next revision"
        )
    })
}

fn read_builtin(name: &str, database: &Database) -> Result<Material, Error> {
    match builtin::get(name) {
        Some(material) => Ok(material?),
        None if name.contains('@') => Err(Error::Usage {
            problem: format!("`{name}` names a revision"),
            way_out: "a built-in material is added by its bare name".to_owned(),
        }),
        None => Err(unknown_material(database.read()?.as_ref(), name, "")?),
    }
}

/// The material files that a path stands for.
fn material_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    if path.join(FILE).exists() {
        return Ok(vec![path.join(FILE)]);
    }
    let entries = std::fs::read_dir(path).map_err(|reason| FilesError::unreadable(path, reason))?;
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|e| e.path().join(FILE)).filter(|f| f.exists()).collect();
    files.sort();
    if files.is_empty() {
        return Err(Error::Usage {
            problem: format!("{} holds no {FILE}, nor does any folder in it", path.display()),
            way_out: "give the folder of a material, such as materials/ptfe".to_owned(),
        });
    }
    Ok(files)
}

/// Reads a material.toml and the tables that it names.
fn read_material(path: &Path) -> Result<(Material, Vec<Input>), Error> {
    let bytes = read_small(path).map_err(suggest_tables)?;
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
    let material = file::parse(&path.display().to_string(), &text, |name: &str| {
        let bytes = read_regular(&folder.join(name)).map_err(|e| e.to_string())?;
        inputs.borrow_mut().push(input(Path::new(name), &bytes));
        Ok(bytes)
    })?;
    resolve_effects(&material.effects, Level::Material, format!("{}: [[effect]]", path.display()))?;
    admission::check(&material, path)?;
    Ok((material, inputs.into_inner()))
}

/// Reads a file in a foreign format, with notices on it.
fn read_foreign(
    format: Foreign,
    path: &Path,
    given: &Details,
) -> Result<(Material, Vec<String>, Input), Error> {
    let bytes = read_small(path).map_err(suggest_tables)?;
    let (material, notices) = format.read(&path.display().to_string(), &bytes, given)?;
    admission::check(&material, path)?;
    Ok((material, notices, input(path, &bytes)))
}

/// The error for a material's file, with the way out for one that is too large.
fn suggest_tables(error: FilesError) -> FilesError {
    if error.reason.kind() != ErrorKind::FileTooLarge {
        return error;
    }
    let words = "put points into a CSV file that a [[curve]] names, and shorten texts";
    FilesError { way_out: WayOut::Words(words), ..error }
}

fn activity(inputs: Vec<Input>) -> Activity {
    Activity { command: "add".to_owned(), inputs, origin: None }
}
