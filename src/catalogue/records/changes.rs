//! The materials that each publication added, changed and withdrew: `changes.json`, and `CHANGES.md` for people.
//! A publication compares itself with the one that it replaces.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::catalogue::api::{self, Entry, Index, SCHEMA_VERSION};
use crate::catalogue::error::CatalogueError;
use crate::catalogue::folder::Folder;
use crate::catalogue::layout::INDEX;
use crate::material::{Slug, Status};

const CHANGES: &str = "changes.json";

#[derive(Serialize, Deserialize)]
struct Changes {
    schema_version: u32,
    /// The newest first.
    publications: Vec<Publication>,
}

#[derive(Serialize, Deserialize)]
struct Publication {
    version: Option<String>,
    date: Option<String>,
    added: Vec<Change>,
    changed: Vec<Change>,
    /// Materials that must not be used any more, or are no longer in the catalogue.
    withdrawn: Vec<Change>,
}

#[derive(Serialize, Deserialize)]
struct Change {
    slug: Slug,
    /// As it is now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    now: Option<State>,
    /// As it was before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    before: Option<State>,
    /// Whether it may still be used.
    #[serde(default, skip_serializing_if = "Status::is_active")]
    status: Status,
}

#[derive(PartialEq, Serialize, Deserialize)]
struct State {
    revision: u32,
    content_hash: String,
}

/// The field that every later program writes, too, so that this program recognises a file that is too new.
#[derive(Deserialize)]
struct Version {
    schema_version: u32,
}

/// Continues the log of the earlier publication in the folder; an equal publication adds nothing to it. Returns whether
/// other data had the same version there.
pub(super) fn write(folder: &mut Folder, index: &Index) -> Result<bool, CatalogueError> {
    let mut is_reused = false;
    let (before, mut publications) = match folder.before() {
        Some(earlier) => {
            let before: Index = read(earlier, INDEX)?;
            let changes: Changes = read(earlier, CHANGES)?;
            is_reused = index.version.is_some() && index.version == before.version;
            (before.materials, changes.publications)
        }
        None => (Vec::new(), Vec::new()),
    };
    let new = publication(index, &before);
    let is_first = publications.is_empty();
    let is_other = !(new.added.is_empty() && new.changed.is_empty() && new.withdrawn.is_empty());
    if is_first || is_other {
        publications.insert(0, new);
    }
    let changes = Changes { schema_version: SCHEMA_VERSION, publications };
    api::json(folder, CHANGES, &changes)?;
    folder.write("CHANGES.md", text(&changes).as_bytes())?;
    Ok(is_reused && is_other)
}

fn read<T: DeserializeOwned>(folder: &Path, name: &str) -> Result<T, CatalogueError> {
    let file = folder.join(name);
    let earlier = |problem: String| CatalogueError::Earlier { file: file.clone(), problem };
    let bytes = fs::read(&file).map_err(|reason| earlier(reason.to_string()))?;
    let version: Version =
        serde_json::from_slice(&bytes).map_err(|error| earlier(error.to_string()))?;
    if version.schema_version > SCHEMA_VERSION {
        return Err(earlier("a newer matdb has written it".to_owned()));
    }
    serde_json::from_slice(&bytes).map_err(|error| earlier(error.to_string()))
}

impl State {
    fn of(entry: &Entry) -> State {
        State { revision: entry.revision, content_hash: entry.content_hash.clone() }
    }
}

fn is_withdrawn(entry: &Entry) -> bool {
    matches!(entry.status, Status::Withdrawn { .. })
}

/// What a publication adds, changes and withdraws.
fn publication(index: &Index, before: &[Entry]) -> Publication {
    let (mut added, mut changed, mut withdrawn) = (Vec::new(), Vec::new(), Vec::new());
    let mut gone: BTreeMap<&Slug, &Entry> = before.iter().map(|was| (&was.slug, was)).collect();
    for entry in &index.materials {
        let (was, now) = (gone.remove(&entry.slug), State::of(entry));
        let before = was.map(State::of);
        let list = match was {
            None => &mut added,
            Some(_) if before.as_ref() == Some(&now) => continue,
            Some(was) if is_withdrawn(entry) && !is_withdrawn(was) => &mut withdrawn,
            Some(_) => &mut changed,
        };
        let (slug, status) = (entry.slug.clone(), entry.status.clone());
        list.push(Change { slug, now: Some(now), before, status });
    }
    withdrawn.extend(gone.into_values().map(|was| Change {
        slug: was.slug.clone(),
        now: None,
        before: Some(State::of(was)),
        status: Status::Active,
    }));
    let (version, date) = (index.version.clone(), index.date.clone());
    Publication { version, date, added, changed, withdrawn }
}

fn text(changes: &Changes) -> String {
    let mut text =
        "# Changes\n\nFrom one publication of this catalogue to the next, the newest first.\n"
            .to_owned();
    for publication in &changes.publications {
        let version = publication.version.as_deref().map(harmless).unwrap_or_default();
        let date = publication.date.as_deref().and_then(|date| date.get(..10)).unwrap_or("empty");
        let words: Vec<&str> =
            [version.as_str(), date].into_iter().filter(|w| !w.is_empty()).collect();
        text += &format!("\n## {}\n", words.join(", "));
        let lists = [
            ("Added", &publication.added),
            ("Changed", &publication.changed),
            ("Withdrawn", &publication.withdrawn),
        ];
        for (title, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            text += &format!("\n{title}:\n\n");
            list.iter().for_each(|change| text += &line(change));
        }
    }
    text
}

fn line(change: &Change) -> String {
    let revision = match (&change.before, &change.now) {
        (Some(before), Some(now)) => format!("revision {} to {}", before.revision, now.revision),
        (Some(state), None) | (None, Some(state)) => format!("revision {}", state.revision),
        (None, None) => String::new(),
    };
    let status = change.status.sentence().map_or(String::new(), |said| format!(", {said}"));
    format!("- {}, {revision}{}\n", change.slug, harmless(&status))
}

/// The text as Markdown of one line: without what could end it, and with all that would be more than text escaped.
fn harmless(text: &str) -> String {
    let mut harmless = String::with_capacity(text.len());
    for c in text.chars().filter(|c| !c.is_control()) {
        if "\\`*_[]<>#&|~".contains(c) {
            harmless.push('\\');
        }
        harmless.push(c);
    }
    harmless
}
