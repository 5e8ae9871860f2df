//! The template engine: the only file that knows which one it is.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, UndefinedBehavior, escape_formatter};
use serde::Serialize;

use super::words::clean;
use crate::catalogue::error::CatalogueError;

const PAGES: [(&str, &str); 6] = [
    ("base.html", include_str!("templates/base.html")),
    ("parts.html", include_str!("templates/parts.html")),
    ("index.html", include_str!("templates/index.html")),
    ("list.html", include_str!("templates/list.html")),
    ("material.html", include_str!("templates/material.html")),
    ("compare.html", include_str!("templates/compare.html")),
];

/// The pages' templates. Whatever is put into one is escaped.
pub(super) struct Templates(Environment<'static>);

impl Templates {
    /// Reads the templates that come with the program.
    pub(super) fn new() -> Result<Templates, CatalogueError> {
        let mut env = Environment::new();
        env.set_auto_escape_callback(|_| AutoEscape::Html);
        env.set_undefined_behavior(UndefinedBehavior::Strict);
        let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
        env.set_syntax(syntax.map_err(|error| failed("syntax", &error))?);
        env.set_formatter(|out, state, value| match value.as_str() {
            Some(text) if !value.is_safe() => {
                escape_formatter(out, state, &Value::from(clean(text)))
            }
            _ => escape_formatter(out, state, value),
        });
        // Drawings are ours; the text in them is escaped where they are drawn.
        env.add_filter("drawing", |svg: String| Value::from_safe_string(svg));
        env.add_filter("urlword", |text: String| urlword(&text));
        for (name, text) in PAGES {
            env.add_template(name, text).map_err(|error| failed(name, &error))?;
        }
        Ok(Templates(env))
    }

    /// A page of this context.
    pub(super) fn page(
        &self,
        name: &str,
        context: &impl Serialize,
    ) -> Result<String, CatalogueError> {
        let page = self.0.get_template(name).and_then(|page| page.render(Serde(context)));
        page.map_err(|error| failed(name, &error))
    }
}

/// Text as a value in an address.
fn urlword(text: &str) -> String {
    let escaped = |byte: u8| match byte.is_ascii_alphanumeric() {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    text.bytes().map(escaped).collect()
}

fn failed(name: &str, error: &minijinja::Error) -> CatalogueError {
    CatalogueError::Page { name: name.to_owned(), reason: format!("{error:#}") }
}
