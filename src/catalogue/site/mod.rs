//! The site: an index, a page per material, and a page that compares. It works from a folder and from
//! any web server, and loads nothing from anywhere else.
//!
//! Everything that a database says is text to a page: [`Templates`] escapes it and takes control characters
//! out, [`script`] keeps it inside its quotes and [`link`] decides what may be clicked.

mod bins;
mod cite;
mod compare;
mod composition;
mod curve;
mod entry;
mod fit;
mod levels;
mod link;
mod material;
mod picture;
mod quantity;
mod residuals;
mod script;
mod snippet;
mod spectra;
mod sphere;
mod table;
mod words;

use serde_json::json;

use super::about::About;
use super::error::CatalogueError;
use super::folder::Folder;
use crate::formats::html::Templates;
use crate::formats::words::shortened;
use crate::store::{RevisionSummary, StoredRevision};

use cite::Citation;
use entry::Entry;

/// Materials in one file of the search index and on one page of the plain list.
const PORTION: usize = 500;

/// The pages' templates.
const TEMPLATES: [(&str, &str); 6] = [
    ("base.html", include_str!("templates/base.html")),
    ("parts.html", include_str!("templates/parts.html")),
    ("index.html", include_str!("templates/index.html")),
    ("list.html", include_str!("templates/list.html")),
    ("material.html", include_str!("templates/material.html")),
    ("compare.html", include_str!("templates/compare.html")),
];

/// What every page needs besides its own.
const ASSETS: [(&str, &str); 6] = [
    ("assets/style.css", include_str!("assets/style.css")),
    ("assets/index.js", include_str!("assets/index.js")),
    ("assets/compare.js", include_str!("assets/compare.js")),
    ("assets/plot.js", include_str!("assets/plot.js")),
    ("assets/material.js", include_str!("assets/material.js")),
    ("assets/icon.svg", include_str!("assets/icon.svg")),
];

/// A site that grows by a material at a time and holds only a portion of the index in memory.
pub(super) struct Site<'a> {
    about: &'a About,
    templates: Templates,
    waiting: Vec<Entry>,
    portions: usize,
    materials: usize,
}

impl<'a> Site<'a> {
    /// A site without materials.
    pub(super) fn new(about: &'a About) -> Result<Site<'a>, CatalogueError> {
        let templates = Templates::new(&TEMPLATES)?;
        Ok(Site { about, templates, waiting: Vec::new(), portions: 0, materials: 0 })
    }

    /// Writes the page of a material with what belongs to it, and notes it for the index. `place`: where the page in three
    /// dimensions shows it.
    pub(super) fn add(
        &mut self,
        folder: &mut Folder,
        stored: &StoredRevision,
        history: &[RevisionSummary],
        place: Option<&str>,
    ) -> Result<(), CatalogueError> {
        let slug = stored.material.slug.as_str();
        let citation = Citation::new(self.about, stored);
        let page = material::page(self.about, stored, history, &citation, place);
        let html = self.templates.page("material.html", &page)?;
        folder.write(&format!("material/{slug}.html"), html.as_bytes())?;
        folder.write(&format!("material/{slug}.csv"), &table::csv(&stored.material)?)?;
        let data = script::call("matdbMaterial", &compare::data(&stored.material));
        folder.write(&format!("data/{slug}.js"), data.as_bytes())?;
        self.waiting.push(Entry::new(&stored.material));
        self.materials += 1;
        if self.waiting.len() == PORTION {
            self.write_portion(folder)?;
        }
        Ok(())
    }

    /// Writes what belongs to all materials together.
    pub(super) fn finish(mut self, folder: &mut Folder) -> Result<(), CatalogueError> {
        if !self.waiting.is_empty() || self.portions == 0 {
            self.write_portion(folder)?;
        }
        for (path, text) in ASSETS {
            folder.write(path, text.as_bytes())?;
        }
        let record = script::inert(&cite::catalogue_record(self.about));
        let context = json!({
            "about": self.about, "root": "", "portions": self.portions, "record": record,
            "materials": self.materials, "angles_deg": levels::SMALL_DEG, "title": shortened(&self.about.title, 80),
            "cite": cite::catalogue(self.about), "home": link::to_catalogue(self.about),
        });
        for page in ["index.html", "compare.html"] {
            folder.write(page, self.templates.page(page, &context)?.as_bytes())?;
        }
        Ok(())
    }

    fn write_portion(&mut self, folder: &mut Folder) -> Result<(), CatalogueError> {
        self.portions += 1;
        let number = self.portions;
        let entries = std::mem::take(&mut self.waiting);
        let text = script::call("matdbIndex", &json!({ "portion": number, "entries": entries }));
        folder.write(&format!("index/{number}.js"), text.as_bytes())?;
        let context = json!({
            "about": self.about, "root": "../", "entries": entries, "number": number,
            "before": number - 1, "title": shortened(&self.about.title, 80),
            "after": (entries.len() == PORTION).then_some(number + 1),
        });
        let html = self.templates.page("list.html", &context)?;
        folder.write(&format!("list/{number}.html"), html.as_bytes())
    }
}
