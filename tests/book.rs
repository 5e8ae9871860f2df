//! Promise: every page of docs/ stands in the table of contents, every relative link and anchor of the
//! documentation resolves, and the pages of the commands and the effects are what the program says.
//!
//! `MATDB_WRITE_EFFECTS=1 cargo test --test promises book::` writes the page of the effects.

#[allow(dead_code)] // Its `main` prints the page.
#[path = "../examples/commands.rs"]
mod commands;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::support::{entries, matdb, root};
use serde_json::Value;

/// Pages outside the book that link into it.
const OTHER_PAGES: [&str; 2] = ["README.md", "CONTRIBUTING.md"];

const CONTENTS: &str = "docs/SUMMARY.md";

const EFFECTS: &str = "docs/effects.md";
const EFFECTS_COMMAND: &str = "MATDB_WRITE_EFFECTS=1 cargo test --test promises book::";

/// A page's lines of prose: those outside fenced blocks, with the words in backquotes taken out.
fn prose(text: &str) -> Vec<String> {
    let mut is_code = false;
    let mut lines = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            lines.push(line.split('`').step_by(2).collect());
        }
    }
    lines
}

/// Targets of the links and pictures of a page.
fn links(text: &str) -> Vec<String> {
    let of_line = |line: &String| -> Vec<String> {
        line.split("](")
            .skip(1)
            .filter_map(|rest| Some(rest.split_once(')')?.0.to_owned()))
            .collect()
    };
    prose(text).iter().flat_map(of_line).collect()
}

/// Anchors of a page's headings, as mdBook and GitHub make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut found: BTreeMap<String, usize> = BTreeMap::new();
    let mut anchors = BTreeSet::new();
    for line in text.lines() {
        is_code ^= line.trim_start().starts_with("```");
        let title = line.trim_start_matches('#');
        if is_code || title == line || !title.starts_with(' ') {
            continue;
        }
        let anchor = anchor(title.trim());
        let seen = found.entry(anchor.clone()).or_default();
        anchors.insert(if *seen == 0 { anchor } else { format!("{anchor}-{seen}") });
        *seen += 1;
    }
    anchors
}

/// Letters and digits in lower case, blanks as hyphens, nothing else.
fn anchor(title: &str) -> String {
    let kept = title.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// A path without `.` and `..`; none when it leaves the repository.
fn plain(path: &Path) -> Option<PathBuf> {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => parts.push(name),
            Component::CurDir => (),
            Component::ParentDir if parts.pop() => (),
            _ => return None,
        }
    }
    Some(parts)
}

/// What is wrong with a link of a page, both seen from the repository's root.
fn complaint(page: &str, link: &str) -> Option<String> {
    let (file, fragment) = link.split_once('#').unwrap_or((link, ""));
    let folder = Path::new(page).parent()?;
    let Some(path) = (if file.is_empty() { Some(page.into()) } else { plain(&folder.join(file)) })
    else {
        return Some(format!("{page}: {link} leaves the repository"));
    };
    if page.starts_with("docs/") && !path.starts_with("docs") {
        return Some(format!(
            "{page}: {link} leaves the book; name the file in backquotes instead"
        ));
    }
    let Ok(bytes) = fs::read(root().join(&path)) else {
        return Some(format!("{page}: {link} is not there"));
    };
    let is_known =
        fragment.is_empty() || anchors(&String::from_utf8_lossy(&bytes)).contains(fragment);
    (!is_known).then(|| format!("{page}: {link} names no heading of {}", path.display()))
}

#[test]
fn every_relative_link_and_anchor_resolves() {
    let pages = entries(&root().join("docs")).into_iter().filter(|name| name.ends_with(".md"));
    let pages = pages.map(|name| format!("docs/{name}"));
    let mut complaints = Vec::new();
    for page in pages.chain(OTHER_PAGES.map(str::to_owned)) {
        let text = fs::read_to_string(root().join(&page)).unwrap();
        let relative = links(&text).into_iter().filter(|link| !link.contains("://"));
        complaints.extend(relative.filter_map(|link| complaint(&page, &link)));
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn every_page_stands_once_in_the_contents() {
    let mut listed = links(&fs::read_to_string(root().join(CONTENTS)).unwrap());
    listed.sort();
    let names = entries(&root().join("docs"));
    let pages: Vec<String> =
        names.into_iter().filter(|name| name.ends_with(".md") && name != "SUMMARY.md").collect();
    assert_eq!(listed, pages);
}

#[test]
fn the_page_of_the_commands_is_what_help_says() {
    let committed = fs::read_to_string(root().join("docs/commands.md")).unwrap();
    assert!(
        committed == commands::page(),
        "docs/commands.md is stale; write it by `{}`",
        commands::COMMAND
    );
}

/// The reference of the effects, from `matdb effects --json`.
fn effects_page(effects: &[Value]) -> String {
    let mut page = format!(
        "# Effects\n\nEvery physical effect: what it is, how its residual looks, and its parameters with unit and range. A \
         parameter that is left\nout has its default. [Scene keys](scenes.md#effects) says where effects are \
         declared.\n\nGenerated from `matdb effects --json` by `{EFFECTS_COMMAND}`.\n"
    );
    for (title, kind) in [("Of a scan", "cloud"), ("Of a curve", "curve")] {
        page += &format!("\n## {title}\n");
        let is_of_kind = |effect: &&Value| effect["applies_to"] == serde_json::json!([kind]);
        page.extend(effects.iter().filter(is_of_kind).map(effect_section));
    }
    page
}

fn effect_section(effect: &Value) -> String {
    let text = |key: &str| effect[key].as_str().unwrap_or_default().to_owned();
    let mut section = format!(
        "\n### {}\n\nLevel: {}. {}\n\n*How it shows:* {}\n\n",
        text("name"),
        text("level"),
        text("is"),
        text("shows")
    );
    let parameters = effect["parameters"].as_array().unwrap();
    for group in parameters.chunk_by(|a, b| cells(a) == cells(b)) {
        let [unit, least, most, default] = cells(&group[0]);
        section += &format!("- {}{unit}: {least} to {most}, default {default}\n", names(group));
    }
    section
}

/// Unit, after a comma, range and default of a parameter; a pure number has no unit.
fn cells(parameter: &Value) -> [String; 4] {
    let number = |key: &str| parameter[key].to_string();
    let unit = match parameter["unit"].as_str().unwrap_or_default() {
        "1" => String::new(),
        unit => format!(", {unit}"),
    };
    [unit, number("min"), number("max"), number("absent")]
}

/// Names of neighbouring parameters that are alike; of many the first and the last.
fn names(group: &[Value]) -> String {
    let names: Vec<String> =
        group.iter().map(|p| format!("`{}`", p["name"].as_str().unwrap_or_default())).collect();
    match names.as_slice() {
        [first, _, _, .., last] => format!("{first} … {last}"),
        few => few.join(", "),
    }
}

#[test]
fn the_page_of_the_effects_is_what_the_program_says() {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["effects", "--json"]).assert().success();
    let effects: Vec<Value> = serde_json::from_slice(&output.get_output().stdout).unwrap();
    let (path, made) = (root().join(EFFECTS), effects_page(&effects));
    if std::env::var_os("MATDB_WRITE_EFFECTS").is_some() {
        return fs::write(path, made).unwrap();
    }
    let committed = fs::read_to_string(path).unwrap_or_default();
    assert!(committed == made, "{EFFECTS} is stale; write it by `{EFFECTS_COMMAND}`");
}

#[test]
fn anchors_are_those_of_the_book() {
    let text = "# A page\n\n## residuals.csv, schema 3\n\n```sh\n# no heading\n```\n\n## A page\n";
    assert_eq!(Vec::from_iter(anchors(text)), ["a-page", "a-page-1", "residualscsv-schema-3"]);
    assert_eq!(links("see [a](b.md#c) and `[d](e)` ![f](g.png)"), ["b.md#c", "g.png"]);
}
