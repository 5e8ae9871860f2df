//! Text and numbers as people read them.

use std::borrow::Cow;

use crate::material::SourceKind;
use crate::units::shown;

/// Text without control characters, which no page may hold; line ends and tabs stay.
pub(super) fn clean(text: &str) -> String {
    let visible =
        |c: char| if c.is_control() && !matches!(c, '\n' | '\t') { '\u{fffd}' } else { c };
    text.chars().map(visible).collect()
}

/// Text on one line of at most so many characters, without marks that turn its direction: for titles,
/// which cannot be kept apart from what surrounds them.
pub(super) fn cut(text: &str, most: usize) -> String {
    let turns = |c: &char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let line = || text.chars().filter(|c| !turns(c)).map(|c| if c.is_control() { ' ' } else { c });
    let short: String = line().take(most).collect();
    if line().nth(most).is_some() { short.trim_end().to_owned() + "…" } else { short }
}

/// Four significant digits.
pub(super) fn digits(value: f64) -> String {
    shown(format!("{value:.3e}").parse().unwrap_or(value)).replace('-', "−")
}

/// Decibels to a tenth; −0.0 is 0.0.
pub(super) fn decibels(level_db: f64) -> String {
    match level_db.is_finite() {
        true => format!("{:.1}", level_db + 0.0).replace("-0.0", "0.0").replace('-', "−"),
        false => "nothing".to_owned(),
    }
}

/// A share as a person would say it.
pub(super) fn percent(part: usize, whole: usize) -> String {
    match (part, whole) {
        (0, _) => "none".to_owned(),
        (part, whole) if part == whole => "all".to_owned(),
        (part, whole) => format!("{:.1} %", 100.0 * part as f64 / whole as f64),
    }
}

/// A count with its thousands apart.
pub(super) fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| std::str::from_utf8(g).unwrap_or("")).collect();
    groups.join("\u{202f}")
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
    let start = |text: &str| text.find("Not known:");
    let mut rest: Cow<str> = description.split_whitespace().collect::<Vec<_>>().join(" ").into();
    let mut found = Vec::new();
    while let Some(at) = start(&rest) {
        let text = rest.get(at + "Not known:".len()..).unwrap_or("").trim().to_owned();
        let end = text.find(". ").map_or(text.len(), |dot| dot + 1);
        let (sentence, after) = text.split_at(end);
        found.push(capital(sentence));
        rest = after.to_owned().into();
    }
    found.retain(|sentence| !sentence.is_empty());
    found
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.trim().chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_and_marks_of_direction_do_not_reach_a_title() {
        assert_eq!(clean("a\0b\u{1b}[2J\nc"), "a\u{fffd}b\u{fffd}[2J\nc");
        assert_eq!(cut("ab\u{202e}cd\nef", 6), "abcd e…");
        assert_eq!(cut("abc", 3), "abc");
    }

    #[test]
    fn what_is_not_known_is_taken_from_the_description() {
        let text = "A block. Not known: roughness and\ndiffuse return. More. Not known: its age";
        assert_eq!(gaps(text), ["Roughness and diffuse return.", "Its age"]);
        assert!(gaps("All is known.").is_empty());
    }

    #[test]
    fn numbers_are_short_and_signed_with_a_minus() {
        assert_eq!([digits(-0.016040620), digits(2.0)], ["−0.01604", "2"]);
        assert_eq!([-10.0, -0.04, f64::NEG_INFINITY].map(decibels), ["−10.0", "0.0", "nothing"]);
        assert_eq!([grouped(7), grouped(18_529)], ["7", "18\u{202f}529"]);
        assert_eq!([percent(0, 9), percent(1, 8), percent(9, 9)], ["none", "12.5 %", "all"]);
    }
}
