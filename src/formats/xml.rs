//! Text in XML.

/// Text that XML can hold, in an attribute too: its signs spelled out, control characters as blanks.
pub(crate) fn escaped(text: &str) -> String {
    let clean = text.replace(char::is_control, " ");
    clean.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_and_control_characters_are_escaped() {
        assert_eq!(escaped("a<b & \"c\">d\u{0}"), "a&lt;b &amp; &quot;c&quot;&gt;d ");
    }
}
