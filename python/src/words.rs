//! Sentences of the command line as Python says them.

/// Keywords of flags that have another name.
const KEYWORDS: [(&str, &str); 10] = [
    ("alpha", "fixed"),
    ("class", "material_class"),
    ("edge-margin", "edge_margin_m"),
    ("fix", "fixed"),
    ("frequency", "frequency_ghz"),
    ("limit", "most"),
    ("look-at", "look_at_m"),
    ("radar-at", "radar_at_m"),
    ("threshold", "threshold_dbm"),
    ("within", "within_db"),
];

/// What stands behind a flag and is not its value.
const WORDS: [&str; 7] = ["and", "at", "once", "or", "out", "states", "where"];

/// A sentence with keywords in the place of flags: `unit="mm"` for `--unit mm`. What stands in backticks is a command and
/// stays.
pub(crate) fn in_python(sentence: &str) -> String {
    // Python asks for the folder, and opens the database, elsewhere.
    let sentence = sentence.replace(" (-o)", "").replace(" (--db, $MATDB)", "");
    let parts = sentence.split('`').enumerate();
    let parts =
        parts.map(|(number, part)| if number % 2 == 0 { keywords(part) } else { part.to_owned() });
    parts.collect::<Vec<_>>().join("`")
}

fn keywords(text: &str) -> String {
    let mut parts = text.split("--");
    let mut said = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|one: char| !(one.is_ascii_lowercase() || one == '-'));
        let (flag, rest) = part.split_at(end.unwrap_or(part.len()));
        if flag.is_empty() || !(said.is_empty() || said.ends_with([' ', '('])) {
            said = said + "--" + part;
            continue;
        }
        let keyword = KEYWORDS.iter().find(|(known, _)| *known == flag);
        let keyword = keyword.map_or(flag.replace('-', "_"), |(_, keyword)| (*keyword).to_owned());
        let (value, rest) = value(rest);
        said += &keyword;
        if !value.is_empty() {
            said = said + "=" + &literal(value);
        }
        said += rest;
    }
    said
}

/// The value at the beginning of what stands behind a flag, and the rest.
fn value(text: &str) -> (&str, &str) {
    let none = ("", text);
    let Some(after) = text.strip_prefix(' ') else { return none };
    let length = match after.strip_prefix('"') {
        Some(quoted) => quoted.find('"').map_or(after.len(), |end| end + 2),
        None => {
            let word = after.split(' ').next().unwrap_or_default();
            word.trim_end_matches([',', ';', ':', ')']).len()
        }
    };
    let (value, rest) = after.split_at(length);
    if value.is_empty() || WORDS.contains(&value) { none } else { (value, rest) }
}

/// A value of a flag as Python writes it.
fn literal(value: &str) -> String {
    if value.starts_with('"') || value.parse::<f64>().is_ok() {
        return value.to_owned();
    }
    if value.split(',').all(|number| number.parse::<f64>().is_ok()) {
        return format!("({})", value.replace(',', ", "));
    }
    if !value.contains('=') {
        return format!("\"{value}\"");
    }
    let pairs = value.split(',').map(|pair| {
        let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
        format!("\"{name}\": {}", literal(value))
    });
    format!("{{{}}}", pairs.collect::<Vec<_>>().join(", "))
}
