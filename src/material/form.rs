//! The forms of licences, DOIs and addresses, as others will look them up.

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
}
