//! A page of refractiveindex.info's database: the part of YAML that it is written in.
//!
//! A page is a mapping of upper-case keys at the margin. `REFERENCES` and `COMMENTS` are texts, in the
//! line or indented below `|`; `CONDITIONS` a mapping; `DATA` a list whose items start with
//! `- type: …` and have one-line values, except `data: |` with a row of numbers per line.

use std::collections::BTreeMap;

use crate::formats::FormatError;
use crate::formats::words::shortened;

/// What stands on a page.
#[derive(Debug, Default)]
pub(super) struct Page<'a> {
    /// The head of the file says that it is in the public domain by CC0.
    pub is_cc0: bool,
    pub references: String,
    pub comments: String,
    /// Temperature, K.
    pub temperature_k: Option<f64>,
    pub data: Vec<Block<'a>>,
}

/// An item of `DATA`.
#[derive(Debug, Default)]
pub(super) struct Block<'a> {
    /// Its line in the file, from 1.
    pub line: usize,
    /// `tabulated nk`, `formula 4` …
    pub kind: &'a str,
    /// One-line values by key, with their lines.
    pub values: BTreeMap<&'a str, (usize, &'a str)>,
    /// Rows of the table with their lines.
    pub rows: Vec<(usize, Vec<f64>)>,
}

/// Reads a page; lines are counted from 1.
pub(super) fn parse(text: &str) -> Result<Page<'_>, FormatError> {
    let mut page = Page::default();
    let mut section = "";
    let mut in_table = false;
    for (number, line) in (1..).zip(text.lines()) {
        let content = line.trim();
        if content.starts_with('#') {
            page.is_cc0 |= content.contains("CC0");
            continue;
        }
        if content.is_empty() || content == "---" {
            continue;
        }
        if !line.starts_with([' ', '\t']) && !content.starts_with('-') {
            let (key, rest) = key(content, number)?;
            section = key;
            in_table = false;
            add_text(&mut page, section, rest.trim_start_matches(['|', '>', '-']).trim());
            continue;
        }
        match section {
            "DATA" => in_table = data(&mut page.data, content, number, in_table)?,
            "CONDITIONS" | "SPECS" | "PROPERTIES" => condition(&mut page, content, number)?,
            _ => add_text(&mut page, section, content),
        }
    }
    if page.data.is_empty() {
        let problem = "there is no DATA with `- type: …`";
        let way_out = "give a data page of refractiveindex.info's database";
        return Err(FormatError::at("the file", problem, way_out));
    }
    Ok(page)
}

/// Splits a line into its key and its value.
fn key(content: &str, line: usize) -> Result<(&str, &str), FormatError> {
    let parts = content.split_once(':').map(|(key, rest)| (key.trim(), rest.trim()));
    parts.filter(|(key, _)| is_key(key)).ok_or_else(|| {
        let problem = format!("{:?} is not `key: value`", shortened(content, 40));
        let way_out = "give a data page of refractiveindex.info's database";
        FormatError::at(format!("line {line}"), problem, way_out)
    })
}

fn is_key(key: &str) -> bool {
    !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "_ ".contains(c))
}

fn add_text(page: &mut Page, section: &str, content: &str) {
    let text = match section {
        "REFERENCES" => &mut page.references,
        "COMMENTS" => &mut page.comments,
        _ => return,
    };
    if !text.is_empty() && !content.is_empty() {
        text.push(' ');
    }
    text.push_str(content);
}

fn condition(page: &mut Page, content: &str, line: usize) -> Result<(), FormatError> {
    // Other conditions nest as they like and say nothing that is kept.
    let Some(("temperature", rest)) = content.split_once(':').map(|(k, v)| (k.trim(), v.trim()))
    else {
        return Ok(());
    };
    if rest.is_empty() {
        return Ok(());
    }
    let temperature_k = number(rest.trim_end_matches('K').trim(), line)?;
    if temperature_k <= 0.0 {
        let problem = format!("a temperature of {temperature_k} K cannot be");
        return Err(FormatError::at(format!("line {line}"), problem, "give it in kelvin"));
    }
    page.temperature_k = Some(temperature_k);
    Ok(())
}

/// Takes a line of `DATA`; whether the lines after it may be rows of a table.
fn data<'a>(
    blocks: &mut Vec<Block<'a>>,
    content: &'a str,
    line: usize,
    in_table: bool,
) -> Result<bool, FormatError> {
    if let Some(item) = content.strip_prefix("- ") {
        let (key, value) = key(item.trim(), line)?;
        blocks.push(Block { line, ..Block::default() });
        return entry(blocks, key, value, line);
    }
    if in_table && content.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        let row: Vec<f64> =
            content.split_whitespace().map(|word| number(word, line)).collect::<Result<_, _>>()?;
        if let Some(block) = blocks.last_mut() {
            block.rows.push((line, row));
        }
        return Ok(true);
    }
    let (key, value) = key(content, line)?;
    entry(blocks, key, value, line)
}

fn entry<'a>(
    blocks: &mut [Block<'a>],
    key: &'a str,
    value: &'a str,
    line: usize,
) -> Result<bool, FormatError> {
    let Some(block) = blocks.last_mut() else {
        let problem = format!("`{key}` stands in DATA before the first `- type: …`");
        return Err(FormatError::at(format!("line {line}"), problem, "begin with `- type: …`"));
    };
    let value = value.trim_matches(['"', '\'']);
    if key == "type" {
        block.kind = value;
        return Ok(false);
    }
    block.values.insert(key, (line, value));
    Ok(key == "data")
}

/// A finite number, or where it is none.
pub(super) fn number(word: &str, line: usize) -> Result<f64, FormatError> {
    let value: f64 = word.parse().unwrap_or(f64::NAN);
    if value.is_finite() {
        return Ok(value);
    }
    let problem = format!("{:?} is not a finite number", shortened(word, 40));
    Err(FormatError::at(format!("line {line}"), problem, "mend the number"))
}
