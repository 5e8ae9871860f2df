//! The page of all materials in three dimensions. The catalogue does not render: a floor above draws the page.

use std::collections::BTreeMap;

use super::about::About;
use super::error::CatalogueError;
use crate::material::Slug;
use crate::store::Store;

/// What makes `view.html` of a catalogue.
#[derive(Clone, Copy, Debug)]
pub struct CatalogueView {
    /// Renders the materials of a database, and gives the bytes of the page, which asks for no other file. The same
    /// database and [`About`] give the same bytes on one machine.
    pub draw: fn(&Store, &About) -> Result<Vec<u8>, CatalogueError>,
    /// For every material that the page shows, what stands behind `#` in the address so that it shows this one: the same
    /// on every machine.
    pub places: fn(&Store) -> Result<BTreeMap<Slug, String>, CatalogueError>,
}
