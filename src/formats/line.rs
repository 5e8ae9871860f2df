//! What the readers of text formats share: text and its lines, points in words, and excerpts for errors.

use std::borrow::Cow;

use glam::DVec3;

use super::error::FormatError;

/// The text of a file, without the byte order mark that some editors put before it.
///
/// # Errors
/// Text in UTF-16.
pub(super) fn text(bytes: &[u8]) -> Result<Cow<'_, str>, FormatError> {
    Ok(String::from_utf8_lossy(unmarked(bytes)?))
}

/// The bytes of a text without their mark.
///
/// # Errors
/// Text in UTF-16.
pub(super) fn unmarked(bytes: &[u8]) -> Result<&[u8], FormatError> {
    if let [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] = bytes {
        return Err(FormatError::at("the file", "the text is UTF-16", "save it as UTF-8"));
    }
    Ok(without_mark(bytes))
}

/// A file without a byte order mark of UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Lines that end with a line feed, a carriage return or both.
pub(super) fn lines(mut text: &str) -> impl Iterator<Item = &str> {
    std::iter::from_fn(move || {
        if text.is_empty() {
            return None;
        }
        let (line, rest) = text.split_at(text.find(['\n', '\r']).unwrap_or(text.len()));
        let rest_of_end = rest.strip_prefix("\r\n");
        text = rest_of_end.unwrap_or_else(|| rest.get(1..).unwrap_or_default());
        Some(line)
    })
}

/// The point that the first three words spell; further words are left alone.
pub(super) fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<DVec3> {
    let mut coordinate = || words.next()?.parse::<f64>().ok();
    Some(DVec3::new(coordinate()?, coordinate()?, coordinate()?))
}

/// Enough of a file's text to recognise it by, quoted.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST_CHARS: usize = 60;
    format!("{:?}", text.chars().take(LONGEST_CHARS).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_ends_in_any_of_three_ways() {
        let found: Vec<&str> = lines("a\r\nb\rc\n\r\rd").collect();
        assert_eq!(found, ["a", "b", "c", "", "", "d"]);
        assert_eq!(lines("").count(), 0);
        assert_eq!(lines("a\n").count(), 1);
    }

    #[test]
    fn a_byte_order_mark_is_no_text() {
        assert_eq!(text(b"\xEF\xBB\xBFv 0 0 0").unwrap(), "v 0 0 0");
        let refused = text(b"\xFF\xFEv\0").unwrap_err().to_string();
        assert_eq!(refused, "the file: the text is UTF-16; save it as UTF-8");
    }
}
