//! Links of the pages: web addresses, and DOIs through their resolver.

use crate::catalogue::about::About;
use crate::material::Source;

/// The address and the text of a link.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(super) struct Link {
    text: String,
    /// None where the text is shown without a link.
    href: Option<String>,
}

/// The link of a source, if it has a DOI or an address.
pub(super) fn of(source: &Source) -> Option<Link> {
    first(&source.doi, &source.url)
}

/// The link of a catalogue, if it has a DOI or an address.
pub(super) fn to_catalogue(about: &About) -> Option<Link> {
    first(&about.doi, &about.url)
}

fn first(doi: &Option<String>, url: &Option<String>) -> Option<Link> {
    match (doi, url) {
        (Some(doi), _) => Some(Link { text: format!("doi:{doi}"), href: doi_href(doi) }),
        (None, Some(url)) => Some(Link { text: url.clone(), href: web(url) }),
        (None, None) => None,
    }
}

/// The resolver's address of a DOI; none when it is not one.
pub(super) fn doi_href(doi: &str) -> Option<String> {
    let (prefix, suffix) = doi.split_once('/')?;
    let registrant = prefix.strip_prefix("10.")?;
    let is_number = registrant.chars().all(|c| c.is_ascii_digit() || c == '.');
    if registrant.is_empty() || !is_number || suffix.is_empty() {
        return None;
    }
    let escaped: String = suffix.bytes().map(escaped).collect();
    Some(format!("https://doi.org/{prefix}/{escaped}"))
}

fn escaped(byte: u8) -> String {
    let plain = byte.is_ascii_alphanumeric() || b"-._~()/:;".contains(&byte);
    if plain { char::from(byte).to_string() } else { format!("%{byte:02X}") }
}

/// An address of the web as it is; none for anything else.
pub(super) fn web(url: &str) -> Option<String> {
    let (scheme, rest) = url.split_once("://")?;
    let is_web = ["http", "https"].iter().any(|known| scheme.eq_ignore_ascii_case(known));
    let sound = !rest.is_empty() && !url.chars().any(|c| c.is_control() || c.is_whitespace());
    (is_web && sound).then(|| url.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_web_can_be_clicked() {
        assert_eq!(web("HTTPS://a.example/x?y=1").as_deref(), Some("HTTPS://a.example/x?y=1"));
        for bad in [
            "javascript:alert(1)",
            "javascript://a%0aalert(1)",
            " http://a",
            "data:text/html,x",
            "file:///etc/passwd",
            "http://",
            "http://a\tb",
        ] {
            assert_eq!(web(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_doi_keeps_its_signs_out_of_the_address() {
        let href = doi_href("10.1002/(SICI)1<2::AID>3.0\"#x").unwrap();
        assert_eq!(href, "https://doi.org/10.1002/(SICI)1%3C2::AID%3E3.0%22%23x");
        assert_eq!(doi_href("10.1109/TTHZ.2017.2702590").unwrap().len(), 41);
        assert!(
            ["10./x", "10.1000/", "x/y", "10.1000", "10.a/b"].iter().all(|d| doi_href(d).is_none())
        );
    }
}
