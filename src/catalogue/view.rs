//! The page of all materials in three dimensions. The catalogue does not render: a floor above draws the page.

use std::collections::BTreeMap;

use super::about::About;
use super::error::CatalogueError;
use crate::material::Slug;
use crate::store::Store;

/// `view.html` of a catalogue.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogueView {
    /// The bytes of the page, which asks for no other file.
    pub page: Vec<u8>,
    /// For every material that it shows, what stands behind `#` in the address so that the page shows this one.
    pub places: BTreeMap<Slug, String>,
}

/// Draws the page of the materials of a database. The same database and [`About`] give the same bytes on one machine, and the
/// same places on every one.
pub type DrawView = fn(&Store, &About) -> Result<CatalogueView, CatalogueError>;
