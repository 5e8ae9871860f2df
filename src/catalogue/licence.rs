//! The licence of a catalogue as a whole.

use super::about::About;
use super::error::CatalogueError;
use crate::material::form::{alternative_licences, is_licence, licence_names};
use crate::store::Store;

/// Licences that a sentence names one by one.
const MOST_NAMED: usize = 5;

/// The licence of the catalogue as a whole: the declared one, or else that of all its materials; none where there
/// are none.
pub(super) fn licence_of_all(
    store: &Store,
    about: &About,
) -> Result<Option<String>, CatalogueError> {
    if about.licence.is_some() {
        return Ok(about.licence.clone());
    }
    match store.licences()?.as_slice() {
        [] => Ok(None),
        [only] if is_licence(only) => Ok(Some(only.clone())),
        several => Err(no_licence(several)),
    }
}

/// Those of the materials' licences that the declared one does not name.
pub(super) fn undeclared(licences: &[String], about: &About) -> Vec<String> {
    let Some(declared) = &about.licence else { return Vec::new() };
    let declared: Vec<&str> = licence_names(declared).collect();
    licences.iter().filter(|licence| !is_declared(licence, &declared)).cloned().collect()
}

/// Whether a licence is among the declared ones: one of its alternatives, or every name in it.
fn is_declared(licence: &str, declared: &[&str]) -> bool {
    match alternative_licences(licence) {
        Some(alternatives) => alternatives.iter().any(|name| declared.contains(name)),
        None => licence_names(licence).all(|name| declared.contains(&name)),
    }
}

/// Some licences for a sentence.
pub fn named_licences(licences: &[String]) -> String {
    /// Longest licence that is shown, characters.
    const MOST_LETTERS: usize = 40;
    let named = licences.iter().take(MOST_NAMED);
    let named: Vec<String> = named.map(|l| l.chars().take(MOST_LETTERS).collect()).collect();
    match licences.len().saturating_sub(MOST_NAMED) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

/// The error for licences that give none for the catalogue as a whole, with one that could be declared.
fn no_licence(licences: &[String]) -> CatalogueError {
    let found = named_licences(licences);
    let parts = licences.iter().map(|licence| match licence.split_once(' ') {
        Some(_) => format!("({licence})"),
        None => licence.clone(),
    });
    let all_of_them = parts.collect::<Vec<_>>().join(" AND ");
    let is_example = licences.len() <= MOST_NAMED && is_licence(&all_of_them);
    let example = if is_example { all_of_them } else { "CC-BY-4.0".to_owned() };
    CatalogueError::NoLicence { found, example }
}
