//! Characters that turn the direction of a line.

/// Whether a text turns the direction of what is written after it, so that a line shows its characters in
/// another order (Unicode's bidirectional embeddings, overrides and isolates).
pub fn turns_the_line(text: &str) -> bool {
    text.contains(is_turning)
}

/// Whether a character is one of those of [`turns_the_line`].
pub fn is_turning(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arabic_is_no_trick() {
        assert!(!turns_the_line("طلاء"));
        assert!(turns_the_line("paint\u{202e}txt.exe") && turns_the_line("\u{2067}a"));
    }
}
