//! Words of the site: kinds, titles, and what is not known.

use std::borrow::Cow;

use crate::formats::words::{capitalised, grouped_with};
use crate::material::SourceKind;

/// A count with its thousands apart, which a line cannot break.
pub(super) fn grouped(count: usize) -> String {
    grouped_with(count, '\u{202f}')
}

/// What a kind promises, and what it does not.
pub(super) fn meaning(kind: SourceKind) -> &'static str {
    match kind {
        SourceKind::Measured => "somebody measured this",
        SourceKind::Literature => "a publication states it",
        SourceKind::Modelled => "computed by a physical model from other numbers",
        SourceKind::Synthetic => "chosen or simulated; nobody measured it",
    }
}

/// The sentences of a description that say what is not known.
pub(super) fn gaps(description: &str) -> Vec<String> {
    let mut rest: Cow<str> = description.split_whitespace().collect::<Vec<_>>().join(" ").into();
    let mut found = Vec::new();
    while let Some(at) = rest.find("Not known:") {
        let text = rest.get(at + "Not known:".len()..).unwrap_or("").trim().to_owned();
        let end = text.find(". ").map_or(text.len(), |dot| dot + 1);
        let (sentence, after) = text.split_at(end);
        found.push(capitalised(sentence.trim()));
        rest = after.to_owned().into();
    }
    found.retain(|sentence| !sentence.is_empty());
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_taken_from_the_description() {
        let text = "A block. Not known: roughness and\ndiffuse return. More. Not known: its age";
        assert_eq!(gaps(text), ["Roughness and diffuse return.", "Its age"]);
        assert!(gaps("All is known.").is_empty());
    }

    #[test]
    fn counts_have_their_thousands_apart() {
        assert_eq!([grouped(7), grouped(18_529)], ["7", "18\u{202f}529"]);
    }
}
