//! The materials that come with the program, as reviewable text in `materials/`.

use super::file::{FileError, parse};
use super::revision::Material;

/// One built-in material's files.
struct Entry {
    slug: &'static str,
    toml: &'static str,
    csv: &'static [(&'static str, &'static str)],
}

impl Entry {
    /// The bytes of one of its curves.
    fn csv(&self, file: &str) -> Result<Vec<u8>, String> {
        let found = self.csv.iter().find(|(name, _)| *name == file);
        found.map(|(_, text)| text.as_bytes().to_vec()).ok_or("it is not embedded".to_owned())
    }
}

macro_rules! entries {
    ($($slug:literal $([$($csv:literal),*])?),* $(,)?) => {
        [$(Entry {
            slug: $slug,
            toml: include_str!(concat!("../../materials/", $slug, "/material.toml")),
            csv: &[$($(($csv, include_str!(concat!("../../materials/", $slug, "/", $csv)))),*)?],
        }),*]
    };
}

static ENTRIES: [Entry; 39] = entries![
    "acrylate-resist",
    "alumina",
    "alumina-film",
    "aluminium",
    "barium-fluoride",
    "borosilicate-glass",
    "brick",
    "calcium-fluoride",
    "ceiling-board",
    "concrete",
    "cotton"["backscatter.csv"],
    "garment",
    "glass",
    "hdpe",
    "human-skin",
    "human-skin-300-ghz",
    "ice",
    "kapton",
    "macor",
    "mannequin-paint",
    "marble",
    "nylon",
    "painted-metal",
    "paraffin",
    "pet",
    "plasterboard",
    "plywood",
    "pmma",
    "polypropylene",
    "polystyrene",
    "ptfe",
    "pvdf",
    "pyrex",
    "spectralon",
    "steel",
    "styrofoam",
    "water-19c",
    "water-25c",
    "wood",
];

/// Every built-in material, sorted by name.
///
/// # Errors
/// None in a program that was built from a sound tree.
pub fn all() -> Result<Vec<Material>, FileError> {
    names().filter_map(get).collect()
}

/// Names of the built-in materials, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|entry| entry.slug)
}

/// A built-in material by name; `None` when there is none of that name.
///
/// # Errors
/// None in a released program: every built-in file is read in the tests.
///
/// ```
/// let paint = matdb::material::builtin::get("mannequin-paint").unwrap().unwrap();
/// assert_eq!(paint.class, "paint");
/// ```
pub fn get(name: &str) -> Option<Result<Material, FileError>> {
    let entry = ENTRIES.iter().find(|entry| entry.slug == name)?;
    Some(parse(&format!("{name}/material.toml"), entry.toml, |file| entry.csv(file)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_material_reads_and_has_its_own_name() {
        for name in names() {
            let material = get(name).unwrap().unwrap();
            assert_eq!(material.slug.as_str(), name);
        }
        assert!(names().is_sorted());
    }

    #[test]
    fn an_unknown_name_is_not_an_error() {
        assert!(get("unobtainium").is_none());
    }
}
