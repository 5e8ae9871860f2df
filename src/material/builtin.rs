//! The materials that come with the program, as reviewable text in `materials/`.

use super::Material;
use super::file::{FileError, parse};

/// One built-in material's files.
struct Entry {
    slug: &'static str,
    toml: &'static str,
    csv: &'static [(&'static str, &'static str)],
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

static ENTRIES: [Entry; 6] = entries![
    "aluminium",
    "cotton"["backscatter.csv"],
    "glass",
    "human-skin",
    "mannequin-paint",
    "ptfe",
];

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
    let read_csv = |wanted: &str| {
        let found = entry.csv.iter().find(|(name, _)| *name == wanted);
        found.map(|(_, text)| text.as_bytes().to_vec()).ok_or("it is not embedded".to_owned())
    };
    Some(parse(&format!("{name}/material.toml"), entry.toml, read_csv))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::SourceKind;

    #[test]
    fn every_built_in_material_reads_and_has_its_own_name() {
        for name in names() {
            let material = get(name).unwrap().unwrap();
            assert_eq!(material.slug.as_str(), name);
        }
    }

    #[test]
    fn nothing_built_in_claims_to_be_measured_backscatter() {
        // No angle-resolved measurement near 300 GHz was found with a licence.
        for name in names() {
            assert_ne!(get(name).unwrap().unwrap().render_kind(), Some(SourceKind::Measured));
        }
    }

    #[test]
    fn every_reflectivity_is_that_of_the_index_its_source_states() {
        // n and k at 300 GHz as the materials' notes give them, or √ε.
        for (name, n, k) in [
            ("aluminium", 1035.0, 1044.0),
            ("glass", 2.407, 0.0638),
            ("human-skin", 2.135, 0.583),
            ("mannequin-paint", 1.619, 0.0305),
            ("ptfe", 1.439, 0.0),
        ] {
            let reflectance: f64 = ((n - 1.0f64).powi(2) + k * k) / ((n + 1.0f64).powi(2) + k * k);
            let model = get(name).unwrap().unwrap().scattering().unwrap();
            let parameters = model.parameters();
            let f_lambda = parameters.iter().find(|p| p.path == "specular.f_lambda").unwrap().value;
            // The files give three digits.
            assert!(
                (f_lambda / reflectance - 1.0).abs() < 5e-3,
                "{name}: {f_lambda} {reflectance}"
            );
        }
    }

    #[test]
    fn what_databases_have_kept_keeps_its_hash() {
        // As the first released schema stored it: a change here orphans every stored revision.
        let ptfe = get("ptfe").unwrap().unwrap();
        assert_eq!(
            ptfe.content_hash(),
            "7dca8264fb8c93c5227372b0e3877cf2822b5b1f24f6e0fd0859278efbea1a44"
        );
    }

    #[test]
    fn an_unknown_name_is_not_an_error() {
        assert!(get("unobtainium").is_none());
    }
}
