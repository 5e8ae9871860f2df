//! How to cite a publication: `CITATION.cff` (Citation File Format 1.2.0) and, where Zenodo knows the licence,
//! `.zenodo.json`, which Zenodo then reads instead. Both come from the same record.

use serde_json::{Value, json};

use super::context::Context;
use crate::catalogue::about::{Institute, Person};
use crate::material::form::alternative_licences;

/// The web address of a DOI.
pub(super) fn doi_url(doi: &str) -> String {
    format!("https://doi.org/{doi}")
}

/// `CITATION.cff`.
pub(super) fn cff(context: &Context) -> String {
    let about = context.about;
    let licence = about.licence.as_deref();
    // The format takes several licences only as alternatives, and only those of SPDX's list.
    let alternatives = licence.and_then(alternative_licences).unwrap_or_default();
    let unsaid = licence.filter(|_| alternatives.is_empty());
    let message = format!(
        "If you use these data, please cite them as below, and the source of each number.{}",
        unsaid.map_or(String::new(), |licence| format!(" Licence: {licence}."))
    );
    let mut text = format!("cff-version: 1.2.0\nmessage: {}\ntype: dataset\n", quoted(&message));
    let only = if let [only] = alternatives.as_slice() { Some(*only) } else { None };
    let fields = [
        ("title", Some(about.title.as_str())),
        ("abstract", Some(about.description.as_str())),
        ("version", about.version.as_deref()),
        ("date-released", context.day()),
        ("license", only),
        ("doi", about.doi.as_deref()),
        ("url", about.url.as_deref()),
    ];
    for (key, value) in fields {
        if let Some(value) = value {
            text += &format!("{key}: {}\n", quoted(value));
        }
    }
    if alternatives.len() > 1 {
        text += "license:\n";
        alternatives.iter().for_each(|licence| text += &format!("  - {}\n", quoted(licence)));
    }
    text + "authors:\n" + &cff_authors(context)
}

/// The list of authors in `CITATION.cff`.
fn cff_authors(context: &Context) -> String {
    let about = context.about;
    let mut text = String::new();
    if !about.has_authors() {
        text += &format!("  - name: {}\n", quoted(&context.anonymous_author()));
    }
    for Person { family, given, orcid, affiliation } in &about.people {
        text += &format!("  - family-names: {}\n", quoted(family));
        text += &format!("    given-names: {}\n", quoted(given));
        if let Some(orcid) = orcid {
            text += &format!("    orcid: {}\n", quoted(&orcid_url(orcid)));
        }
        if let Some(affiliation) = affiliation {
            text += &format!("    affiliation: {}\n", quoted(affiliation));
        }
    }
    for Institute { name, url } in &about.institutes {
        text += &format!("  - name: {}\n", quoted(name));
        if let Some(url) = url {
            text += &format!("    website: {}\n", quoted(url));
        }
    }
    text
}

pub(super) fn orcid_url(orcid: &str) -> String {
    format!("https://orcid.org/{orcid}")
}

/// `.zenodo.json`; none where the licence is not one of SPDX's list: Zenodo knows one, by its identifier in small
/// letters, and puts data that name none under CC0.
pub(super) fn zenodo(context: &Context) -> Option<Value> {
    let about = context.about;
    let alternatives = alternative_licences(about.licence.as_deref()?)?;
    let [licence] = alternatives.as_slice() else { return None };
    let mut record = json!({
        "upload_type": "dataset",
        "title": about.title,
        // Zenodo reads it as HTML.
        "description": escaped(&about.description),
        "creators": zenodo_creators(context),
        "access_right": "open",
        "license": licence.to_lowercase(),
    });
    insert(&mut record, "version", about.version.as_deref());
    insert(&mut record, "publication_date", context.day());
    insert(&mut record, "doi", about.doi.as_deref());
    Some(record)
}

fn zenodo_creators(context: &Context) -> Vec<Value> {
    let about = context.about;
    if !about.has_authors() {
        return vec![json!({ "name": context.anonymous_author() })];
    }
    let mut creators = Vec::new();
    for Person { family, given, orcid, affiliation } in &about.people {
        let mut creator = json!({ "name": format!("{family}, {given}") });
        insert(&mut creator, "orcid", orcid.as_deref());
        insert(&mut creator, "affiliation", affiliation.as_deref());
        creators.push(creator);
    }
    creators.extend(about.institutes.iter().map(|institute| json!({ "name": institute.name })));
    creators
}

/// Sets a key that has a value.
pub(super) fn insert(record: &mut Value, key: &str, value: Option<&str>) {
    if let (Some(map), Some(value)) = (record.as_object_mut(), value) {
        map.insert(key.to_owned(), value.into());
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A text as YAML's double-quoted scalar: that of JSON, and without what YAML cannot print.
fn quoted(text: &str) -> String {
    let mut quoted = String::new();
    for c in Value::from(text).to_string().chars() {
        match c {
            '\u{7f}'..='\u{9f}'
            | '\u{feff}'
            | '\u{fffe}'
            | '\u{ffff}'
            | '\u{2028}'
            | '\u{2029}' => {
                quoted += &format!("\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::About;

    #[test]
    fn both_say_the_same() {
        let text =
            "title = 'A \"b\": c'\ndescription = 'x < y'\nversion = '1.2'\ndoi = '10.5281/zenodo.1'
            licence = 'CC-BY-4.0'
            [[person]]\nfamily = 'Roe'\ngiven = 'Ann'\norcid = '0000-0002-1825-0097'";
        let about = About::parse("about.toml", text).unwrap();
        let context = Context { about: &about, date: Some("2026-01-02T03:04:05Z"), materials: 1 };
        let (cff, zenodo) = (cff(&context), zenodo(&context).unwrap());
        let value = |key: &str| -> String {
            let line = cff.lines().find_map(|l| l.trim_start_matches([' ', '-']).strip_prefix(key));
            serde_json::from_str(line.unwrap().strip_prefix(": ").unwrap()).unwrap()
        };
        for (theirs, ours) in [
            ("title", "title"),
            ("version", "version"),
            ("doi", "doi"),
            ("publication_date", "date-released"),
        ] {
            assert_eq!(zenodo[theirs], value(ours), "{ours}");
        }
        assert_eq!(zenodo["description"].as_str().unwrap().replace("&lt;", "<"), value("abstract"));
        assert_eq!(zenodo["license"], value("license").to_lowercase());
        let creator = &zenodo["creators"][0];
        assert_eq!(creator["name"], format!("{}, {}", value("family-names"), value("given-names")));
        assert_eq!(orcid_url(creator["orcid"].as_str().unwrap()), value("orcid"));
        assert_eq!(value("date-released"), "2026-01-02");
    }

    #[test]
    fn a_licence_is_said_where_the_format_can_and_zenodo_is_told_nothing_where_it_would_take_cc0() {
        let of = |licence: &str| {
            let about = About { licence: Some(licence.to_owned()), ..About::default() };
            let context = Context { about: &about, date: None, materials: 1 };
            (cff(&context), zenodo(&context))
        };
        let (cff, zenodo) = of("CC0-1.0");
        assert!(cff.contains("\nlicense: \"CC0-1.0\"\n") && !cff.contains("Licence:"), "{cff}");
        assert_eq!(zenodo.unwrap()["license"], "cc0-1.0");
        let (cff, zenodo) = of("MIT OR CC0-1.0");
        assert!(cff.contains("\nlicense:\n  - \"MIT\"\n  - \"CC0-1.0\"\n"), "{cff}");
        assert_eq!(zenodo, None);
        for several in ["CC-BY-4.0 AND CC0-1.0", "LicenseRef-ours"] {
            let (cff, zenodo) = of(several);
            assert!(!cff.contains("\nlicense:"), "{cff}");
            assert!(cff.contains(&format!("of each number. Licence: {several}.\"\n")), "{cff}");
            assert_eq!(zenodo, None, "{several}");
        }
        let nothing = About { licence: None, ..About::default() };
        assert_eq!(self::zenodo(&Context { about: &nothing, date: None, materials: 0 }), None);
    }

    #[test]
    fn an_institute_answers_for_a_catalogue_as_a_person_does() {
        let text = "licence = 'CC0-1.0'\n[[institute]]\nname = 'Laboratory at University'\n\
                    url = 'https://lab.example.org'";
        let about = About::parse("about.toml", text).unwrap();
        let context = Context { about: &about, date: None, materials: 1 };
        let authors = "authors:\n  - name: \"Laboratory at University\"\n    website: \"https://lab.example.org\"\n";
        assert!(cff(&context).ends_with(authors), "{}", cff(&context));
        let creators = &zenodo(&context).unwrap()["creators"];
        assert_eq!(creators, &json!([{ "name": "Laboratory at University" }]));
        let comma = text.replace("Laboratory at", "Laboratory,");
        let refused = About::parse("about.toml", &comma).unwrap_err().to_string();
        assert!(refused.contains("without a comma"), "{refused}");
    }

    #[test]
    fn what_yaml_cannot_print_is_escaped() {
        assert_eq!(quoted("a\u{85}\n\"b"), "\"a\\u0085\\n\\\"b\"");
    }
}
