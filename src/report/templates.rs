//! The pages of a report. Each stands alone: no other file, nothing from outside; only the viewer
//! has a script.

use serde::Serialize;

use crate::error::Error;
use crate::formats::html::Templates;

const PAGES: [(&str, &str); 8] = [
    ("base.html", include_str!("templates/base.html")),
    ("style.css", include_str!("templates/style.css")),
    ("parts.html", include_str!("templates/parts.html")),
    ("cloud.html", include_str!("templates/cloud.html")),
    ("curve.html", include_str!("templates/curve.html")),
    ("cannot_tell.html", include_str!("templates/cannot_tell.html")),
    ("view.html", include_str!("templates/view.html")),
    ("balls.html", include_str!("templates/balls.html")),
];

/// The bytes of a page of this context.
pub(super) fn page(name: &str, context: &impl Serialize) -> Result<Vec<u8>, Error> {
    Ok(text(name, context)?.into_bytes())
}

/// A page of this context.
pub(super) fn text(name: &str, context: &impl Serialize) -> Result<String, Error> {
    Ok(Templates::new(&PAGES)?.page(name, context)?)
}
