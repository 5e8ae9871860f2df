//! How our figures look: ink, sizes, and the small shapes that all of them share.

use super::drawing::{Anchor, Rgb, Shape, Text, Weight, text_width_px};
use super::ticks::Tick;

pub(super) const INK: Rgb = [34, 34, 34];
pub(super) const QUIET_INK: Rgb = [96, 96, 96];

pub(super) const TITLE_PX: f32 = 27.0;
pub(super) const LABEL_PX: f32 = 20.0;
pub(super) const TICK_LABEL_PX: f32 = 18.0;
pub(super) const LINE_SPACING: f32 = 1.4;
/// Height of a digit over the font size.
pub(super) const DIGIT_HEIGHT: f32 = 0.73;

pub(super) const MARGIN_PX: f32 = 28.0;
pub(super) const GAP_PX: f32 = 12.0;
pub(super) const TICK_PX: f32 = 7.0;
pub(super) const STROKE_PX: f32 = 2.0;
pub(super) const TITLE_MIN_WIDTH_PX: f32 = 420.0;

/// A frame that covers none of what it surrounds.
pub(super) fn frame(left: f32, top: f32, width: f32, height: f32) -> Shape {
    let out = STROKE_PX / 2.0;
    let (left, top, right, bottom) =
        (left - out, top - out, left + width + out, top + height + out);
    // The last point overshoots by half a stroke so that the corner is filled.
    let points =
        vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top - out)];
    Shape::Line { points, colour: INK, thickness_px: STROKE_PX }
}

pub(super) fn line(from: (f32, f32), to: (f32, f32)) -> Shape {
    Shape::Line { points: vec![from, to], colour: INK, thickness_px: STROKE_PX }
}

pub(super) fn text(text: &str, (x, y): (f32, f32), anchor: Anchor, size_px: f32) -> Shape {
    let (text, at, weight) = (text.to_owned(), (x, y.round()), Weight::Regular);
    Shape::Text(Text { text, at, anchor, size_px, weight, colour: INK, upwards: false })
}

pub(super) fn upward(text: &str, (x, y): (f32, f32)) -> Shape {
    let (at, weight, anchor) = ((x.round(), y), Weight::Regular, Anchor::Middle);
    let text = text.to_owned();
    Shape::Text(Text { text, at, anchor, size_px: LABEL_PX, weight, colour: INK, upwards: true })
}

/// How many ticks suit a vertical axis of this length: their labels stand one above the other.
pub(super) fn ticks_up(length_px: f32) -> usize {
    (length_px / 60.0) as usize
}

/// How many ticks suit an axis of this length.
pub(super) fn ticks_along(length_px: f32) -> usize {
    (length_px / 95.0) as usize
}

pub(super) fn widest(ticks: &[Tick]) -> f32 {
    let widths = ticks.iter().map(|t| text_width_px(&t.label, TICK_LABEL_PX, Weight::Regular));
    widths.fold(0.0, f32::max)
}

/// Lines no wider than `width_px`, unless a single word is.
pub(super) fn wrapped(text: &str, size_px: f32, weight: Weight, width_px: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width_px(&format!("{line} {word}"), size_px, weight) <= width_px => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_titles_are_wrapped_at_words() {
        let lines = wrapped("one two  three", 20.0, Weight::Regular, 95.0);
        assert_eq!(lines, ["one two", "three"]);
        assert!(wrapped(" ", 20.0, Weight::Regular, 95.0).is_empty());
    }
}
