//! The materials of a database that a person looks through.

use std::collections::BTreeSet;

use crate::error::Error;
use crate::material::{Material, Slug};
use crate::setup::builtin_not_added;
use crate::store::{Filter, Store, Summary};

/// How many more materials are counted than are shown.
const MOST_COUNTED: u32 = 10_000;

/// The first materials that match a filter, and what there is besides them.
#[derive(Clone, Debug)]
pub struct MaterialList {
    /// The materials, sorted by name.
    pub rows: Vec<MaterialRow>,
    /// Number of further ones in the database.
    pub more: usize,
    /// Whether there may be even more than these: not all were counted.
    pub more_at_least: bool,
    /// Built-in ones that match and are not in the database.
    pub built_in: Vec<Slug>,
    /// A class or a tag that was asked for and that no material has; looked for where nothing was found.
    pub unknown_words: Vec<UnknownWord>,
}

/// A line of the list.
#[derive(Clone, Debug)]
pub struct MaterialRow {
    /// The material.
    pub summary: Summary,
    /// How what scenes render of it came to be.
    pub kind: String,
}

/// A class or a tag that no material has.
#[derive(Clone, Debug)]
pub struct UnknownWord {
    /// The word that was asked for.
    pub asked: String,
    /// What it would be: `class` or `tag`.
    pub what: &'static str,
    /// Those that there are.
    pub known: BTreeSet<String>,
}

impl MaterialList {
    /// The first `most` materials of a database that match a filter; the built-in ones alone without a database.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn new(filter: &Filter, most: u32, store: Option<&Store>) -> Result<MaterialList, Error> {
        let not_added = builtin_not_added(store)?;
        let wanted = not_added.iter().filter(|material| filter.lets_through(material));
        let mut list = MaterialList {
            rows: Vec::new(),
            more: 0,
            more_at_least: false,
            built_in: wanted.map(|material| material.slug.clone()).collect(),
            unknown_words: Vec::new(),
        };
        let Some(store) = store else { return Ok(list) };
        let page = store.page(filter, most)?;
        let slugs: Vec<Slug> = page.iter().map(|summary| summary.slug.clone()).collect();
        let mut words = store.rendered_words(&slugs)?;
        for mut summary in page {
            let words = words.remove(&summary.slug);
            summary.is_damaged |= words == Some(None);
            let kind = words.flatten().unwrap_or_else(|| summary.render_kind.as_str().to_owned());
            list.rows.push(MaterialRow { summary, kind });
        }
        if list.rows.is_empty() {
            list.unknown_words = unknown_words(filter, store, &not_added)?;
        }
        // A page that is not full is the last.
        if list.rows.len() as u64 == u64::from(most) {
            let most_counted = MOST_COUNTED.saturating_add(most);
            let all = store.count(filter, most_counted)?;
            list.more = all.saturating_sub(list.rows.len());
            list.more_at_least = all as u64 == u64::from(most_counted);
        }
        Ok(list)
    }
}

/// The class and the tag of a filter, where no material has them.
fn unknown_words(
    filter: &Filter,
    store: &Store,
    built_in: &[Material],
) -> Result<Vec<UnknownWord>, Error> {
    /// More tags than these are no help.
    const MOST_TAGS: usize = 100;
    let mut unknown = Vec::new();
    if let Some(class) = &filter.class {
        let built_in = built_in.iter().map(|material| material.class.clone());
        let known: BTreeSet<String> = store.classes()?.into_iter().chain(built_in).collect();
        if !known.contains(class) {
            unknown.push(UnknownWord { asked: class.clone(), what: "class", known });
        }
    }
    if let Some(tag) = &filter.tag {
        let built_in = built_in.iter().flat_map(|material| material.tags.clone());
        let alone = Filter { tag: Some(tag.clone()), ..Filter::default() };
        if store.count(&alone, 1)? == 0 && !built_in.clone().any(|known| known == *tag) {
            let known = store.tags(MOST_TAGS)?.into_iter().chain(built_in).collect();
            unknown.push(UnknownWord { asked: tag.clone(), what: "tag", known });
        }
    }
    Ok(unknown)
}
