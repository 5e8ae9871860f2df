//! The pages' templates. Whatever is put into one is escaped.

use serde::Serialize;

use crate::catalogue::error::CatalogueError;
use crate::formats::html::{PageError, Templates as Engine};

const PAGES: [(&str, &str); 6] = [
    ("base.html", include_str!("templates/base.html")),
    ("parts.html", include_str!("templates/parts.html")),
    ("index.html", include_str!("templates/index.html")),
    ("list.html", include_str!("templates/list.html")),
    ("material.html", include_str!("templates/material.html")),
    ("compare.html", include_str!("templates/compare.html")),
];

/// The templates of the site.
pub(super) struct Templates(Engine);

impl Templates {
    /// Reads the templates that come with the program.
    pub(super) fn new() -> Result<Templates, CatalogueError> {
        Ok(Templates(Engine::new(&PAGES).map_err(failed)?))
    }

    /// A page of this context.
    pub(super) fn page(
        &self,
        name: &str,
        context: &impl Serialize,
    ) -> Result<String, CatalogueError> {
        self.0.page(name, context).map_err(failed)
    }
}

fn failed(PageError { name, reason }: PageError) -> CatalogueError {
    CatalogueError::Page { name, reason }
}
