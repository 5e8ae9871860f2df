//! The forms of licences, DOIs, ORCIDs, addresses, hashes and days.

use crate::formats::text::nearest;

/// Identifiers of SPDX's list that data and programs are most often under (spdx.org/licenses).
const LICENCES: [&str; 32] = [
    "0BSD",
    "AGPL-3.0-only",
    "AGPL-3.0-or-later",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC-BY-3.0",
    "CC-BY-4.0",
    "CC-BY-NC-3.0",
    "CC-BY-NC-4.0",
    "CC-BY-NC-ND-4.0",
    "CC-BY-NC-SA-4.0",
    "CC-BY-ND-4.0",
    "CC-BY-SA-3.0",
    "CC-BY-SA-4.0",
    "CC-PDDC",
    "CC0-1.0",
    "CDLA-Permissive-1.0",
    "CDLA-Permissive-2.0",
    "CDLA-Sharing-1.0",
    "GPL-2.0-only",
    "GPL-2.0-or-later",
    "GPL-3.0-only",
    "GPL-3.0-or-later",
    "LGPL-3.0-or-later",
    "MIT",
    "MPL-2.0",
    "ODC-By-1.0",
    "ODbL-1.0",
    "PDDL-1.0",
    "etalab-2.0",
];

/// A sentence on the first identifier of a licence expression that is neither a usual one of SPDX's list nor a
/// `LicenseRef-…`; `None` if there is none. The list has others.
///
/// ```
/// use matdb::material::form::licence_doubt;
/// assert!(licence_doubt("MIT OR CC-BY-4.0").is_none() && licence_doubt("LicenseRef-ours").is_none());
/// assert!(licence_doubt("CC-BY").unwrap().contains("did you mean `CC-BY-4.0`?"));
/// ```
pub fn licence_doubt(text: &str) -> Option<String> {
    let stranger = licence_names(text)
        .find(|name| !name.contains("LicenseRef-") && !LICENCES.contains(name))?;
    // A name without its version is nearest to its latest.
    let begun = LICENCES.iter().rev().find(|known| {
        known.strip_prefix(stranger).is_some_and(|rest| {
            rest.strip_prefix('-').is_some_and(|version| version.starts_with(char::is_numeric))
        })
    });
    let meant = begun.copied().or_else(|| nearest(stranger, LICENCES));
    let meant = meant.map_or(String::new(), |name| format!("; did you mean `{name}`?"));
    Some(format!(
        "the licence `{stranger}` is not a usual SPDX identifier (spdx.org/licenses){meant}"
    ))
}

/// The identifiers in a licence expression, in its order.
pub fn licence_names(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|c: char| c.is_whitespace() || "()".contains(c));
    words.filter(|word| !["", "AND", "OR", "WITH"].contains(word))
}

/// The licences of which a reader may choose one, by SPDX's usual identifiers; none of an expression that says more,
/// or names a licence that is none of these.
///
/// ```
/// use matdb::material::form::alternative_licences;
/// assert_eq!(alternative_licences("MIT OR CC0-1.0").unwrap(), ["MIT", "CC0-1.0"]);
/// assert_eq!(alternative_licences("CC-BY-4.0 AND CC0-1.0"), None);
/// assert_eq!(alternative_licences("LicenseRef-ours"), None);
/// assert_eq!(alternative_licences("CC-BY"), None, "without its version it is on no list");
/// ```
pub fn alternative_licences(text: &str) -> Option<Vec<&str>> {
    let names = text.split(" OR ").map(str::trim);
    names.map(|name| LICENCES.contains(&name).then_some(name)).collect()
}

/// Whether a text is an ORCID: sixteen digits in groups of four, of which the last, which may be `X`, checks the
/// others (ISO 7064, mod 11-2).
///
/// ```
/// use matdb::material::form::is_orcid;
/// assert!(is_orcid("0000-0002-1825-0097") && is_orcid("0000-0002-9079-593X"));
/// assert!(!is_orcid("0000-0002-1825-0098") && !is_orcid("0000000218250097"));
/// ```
pub fn is_orcid(text: &str) -> bool {
    let groups: Vec<&str> = text.split('-').collect();
    let is_grouped = groups.len() == 4 && groups.iter().all(|group| group.len() == 4);
    let sum = text.chars().filter(|c| *c != '-').enumerate().try_fold(0, |sum, (place, c)| {
        let digit = if place == 15 && c == 'X' { 10 } else { c.to_digit(10)? };
        Some(if place == 15 { sum + digit } else { (sum + digit) * 2 % 11 })
    });
    is_grouped && sum.is_some_and(|sum| sum % 11 == 1)
}

/// Whether a text has the form of an SPDX licence expression: identifiers such as `CC-BY-4.0` or
/// `LicenseRef-proprietary`, joined by `AND`, `OR` and `WITH` (spdx.github.io/spdx-spec, annex
/// "SPDX license expressions"). Whether the list has the identifier is not asked.
///
/// ```
/// use matdb::material::form::is_licence;
/// assert!(is_licence("CC-BY-4.0") && is_licence("(MIT OR Apache-2.0) AND LicenseRef-ours"));
/// assert!(!is_licence("all rights reserved") && !is_licence("MIT OR"));
/// ```
pub fn is_licence(text: &str) -> bool {
    let spaced = text.replace('(', " ( ").replace(')', " ) ");
    let (mut open, mut wants_name) = (0u32, true);
    for word in spaced.split_whitespace() {
        match word {
            "(" if wants_name => open += 1,
            ")" if !wants_name && open > 0 => open -= 1,
            "AND" | "OR" | "WITH" if !wants_name => wants_name = true,
            "AND" | "OR" | "WITH" | "(" | ")" => return false,
            word if wants_name && is_identifier(word) => wants_name = false,
            _ => return false,
        }
    }
    open == 0 && !wants_name
}

fn is_identifier(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphanumeric())
        && word.chars().all(|c| c.is_ascii_alphanumeric() || ".-+:".contains(c))
}

/// Whether a text is a DOI without a resolver in front: `10.`, digits, `/` and a name.
pub fn is_doi(text: &str) -> bool {
    let parts = text.strip_prefix("10.").and_then(|rest| rest.split_once('/'));
    parts.is_some_and(|(registrant, name)| {
        registrant.len() >= 4
            && registrant.chars().all(|c| c.is_ascii_digit() || c == '.')
            && !name.is_empty()
            && !name.contains(|c: char| c.is_whitespace() || c.is_control())
    })
}

/// Whether a text is an address that a browser opens from the web.
pub fn is_address(text: &str) -> bool {
    let rest = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
    rest.is_some_and(|rest| {
        rest.starts_with(|c: char| c.is_alphanumeric() || c == '[')
            && !rest.contains(|c: char| c.is_whitespace() || c.is_control())
    })
}

/// Whether a text is 64 lower-case hexadecimal digits.
pub(super) fn is_hash(text: &str) -> bool {
    text.len() == 64 && text.chars().all(|c| c.is_ascii_digit() || ('a'..='f').contains(&c))
}

/// Whether a text is a day of the Gregorian calendar as ISO 8601 writes it.
pub(super) fn is_date(text: &str) -> bool {
    let dashes = text.get(4..5) == Some("-") && text.get(7..8) == Some("-");
    let [Some(year), Some(month), Some(day)] =
        [0..4, 5..7, 8..10].map(|digits| text.get(digits).and_then(whole_number))
    else {
        return false;
    };
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 if is_leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    };
    text.len() == 10 && dashes && (1..=days).contains(&day)
}

/// The number that a text of digits alone is.
fn whole_number(digits: &str) -> Option<u32> {
    digits.chars().all(|c| c.is_ascii_digit()).then(|| digits.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dois_and_addresses_have_their_forms() {
        assert!(is_doi("10.1109/TTHZ.2017.2702590") && is_doi("10.5281/zenodo.1"));
        for bad in ["https://doi.org/10.1/x", "10.1234", "10.1234/", "10.x/y", "10.1234/a b", "12"]
        {
            assert!(!is_doi(bad), "{bad}");
        }
        assert!(is_address("https://example.org/a") && is_address("http://x"));
        for bad in [
            "javascript:alert(1)",
            "ftp://x",
            "https://",
            "https:// x",
            "example.org",
            "https://a\nb",
        ] {
            assert!(!is_address(bad), "{bad}");
        }
    }

    #[test]
    fn only_days_of_the_calendar_are_dates() {
        for day in ["2026-03-14", "2024-02-29", "2000-02-29", "1999-12-31"] {
            assert!(is_date(day), "{day}");
        }
        for text in
            ["2026-02-29", "1900-02-29", "2026-13-01", "2026-1-1", "14.3.2026", "2026-03-14T00", ""]
        {
            assert!(!is_date(text), "{text}");
        }
    }
}
