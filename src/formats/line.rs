//! What the readers of text formats share: points in words, and excerpts for errors.

use glam::DVec3;

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
