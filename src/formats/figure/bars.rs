//! Named values as bars, from left to right.

use super::axes::{Axes, Axis};
use super::drawing::{Anchor, Drawing, Rgb, Shape, Weight, text_width_px};
use super::error::FigureError;
use super::ink::Ink;
use super::style::{
    DIGIT_HEIGHT, GAP_PX, LINE_SPACING, MARGIN_PX, QUIET_INK, STROKE_PX, TICK_LABEL_PX, TICK_PX,
    text,
};

/// Width of the data area, px.
const DATA_WIDTH_PX: f32 = 700.0;
/// Height of a bar with the gap to the next, px.
const ROW_PX: f32 = 40.0;
/// Share of that height that is bar.
const BAR_SHARE: f32 = 0.62;
/// Bars without a meaning.
const QUIET: Rgb = [170, 170, 170];
/// The page itself.
const PAGE: Rgb = [255, 255, 255];

/// A bar for each name, the first at the top.
#[derive(Clone, Debug)]
pub struct Bars<'a> {
    /// First line, bold; may be empty.
    pub title: &'a str,
    /// Second line, quiet; may be empty.
    pub subtitle: &'a str,
    /// Quantity and unit of the bars.
    pub label: &'a str,
    /// The bars.
    pub bars: Vec<Bar<'a>>,
    /// A value that all bars are held against, and what it is.
    pub guide: Option<(f64, &'a str)>,
}

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar<'a> {
    /// Its name, left of it.
    pub name: &'a str,
    /// Its length; negative ones are drawn as none.
    pub value: f64,
    /// What is written behind it, such as the value.
    pub note: String,
    /// What its colour stands for; grey without one.
    pub ink: Option<Ink>,
}

impl Bars<'_> {
    /// The bars as a page.
    ///
    /// # Errors
    /// When there is no bar, or one has no finite value.
    pub fn drawing(&self) -> Result<Drawing, FigureError> {
        if self.bars.is_empty() || self.bars.iter().any(|bar| !bar.value.is_finite()) {
            return Err(FigureError::NoBars { bars: self.bars.len() });
        }
        let data = [DATA_WIDTH_PX, ROW_PX * self.bars.len() as f32];
        let names = self.bars.iter().map(|bar| width(bar.name)).fold(0.0, f32::max);
        let x = Axis { label: self.label, low: 0.0, high: self.high() };
        let y = Axis { label: "", low: 0.0, high: 1.0 };
        let mut axes = Axes::new([x, y], data, [self.title, self.subtitle], data[0]);
        axes.left = (MARGIN_PX + names + GAP_PX).round();
        axes.hide_y();
        axes.top += self.guide.map_or(0.0, |_| LINE_SPACING * TICK_LABEL_PX);
        let rows = || (0u16..).zip(&self.bars);
        let mut shapes: Vec<Shape> = rows().map(|(row, bar)| area(&axes, row, bar)).collect();
        shapes.extend(self.guide.iter().flat_map(|guide| guide_shapes(&axes, *guide)));
        shapes.extend(rows().flat_map(|(row, bar)| texts(&axes, row, bar)));
        shapes.extend(axes.shapes());
        Ok(Drawing {
            width_px: (axes.left + data[0] + MARGIN_PX).ceil(),
            height_px: (axes.top + axes.height_with_labels() + MARGIN_PX / 2.0).ceil(),
            shapes,
        })
    }

    /// The value at the right end: every bar and the note behind it fit.
    fn high(&self) -> f64 {
        let mut high = self.guide.map_or(0.0, |(value, _)| 1.1 * value);
        for bar in &self.bars {
            // Share of the width that the note takes.
            let note = f64::from(((width(&bar.note) + 2.0 * GAP_PX) / DATA_WIDTH_PX).min(0.8));
            high = high.max(bar.value.max(0.0) / (1.0 - note));
        }
        if high > 0.0 && high.is_finite() { high } else { 1.0 }
    }
}

/// Middle of a row and right end of its bar, px.
fn end(axes: &Axes, row: u16, bar: &Bar) -> (f32, f32) {
    (axes.at(bar.value.max(0.0), 0.0).0, axes.top + (f32::from(row) + 0.5) * ROW_PX)
}

fn area(axes: &Axes, row: u16, bar: &Bar) -> Shape {
    let (right, middle) = end(axes, row, bar);
    let half = 0.5 * BAR_SHARE * ROW_PX;
    let colour = bar.ink.map_or(QUIET, Ink::colour);
    Shape::Area { corners: rectangle([axes.left, right], [middle - half, middle + half]), colour }
}

/// The name left of a bar, and the note behind it, which a guide does not strike through.
fn texts(axes: &Axes, row: u16, bar: &Bar) -> [Shape; 3] {
    let (right, middle) = end(axes, row, bar);
    let base_y = middle + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX;
    let name_at = (axes.left - TICK_PX - GAP_PX / 2.0, base_y);
    let note_at = (right + GAP_PX / 2.0, base_y);
    let half = 0.6 * TICK_LABEL_PX;
    let behind = [note_at.0 - GAP_PX / 4.0, note_at.0 + width(&bar.note) + GAP_PX / 4.0];
    [
        text(bar.name, name_at, Anchor::End, TICK_LABEL_PX),
        Shape::Area { corners: rectangle(behind, [middle - half, middle + half]), colour: PAGE },
        text(&bar.note, note_at, Anchor::Start, TICK_LABEL_PX),
    ]
}

fn rectangle([left, right]: [f32; 2], [top, bottom]: [f32; 2]) -> Vec<(f32, f32)> {
    vec![(left, top), (right, top), (right, bottom), (left, bottom)]
}

fn width(text: &str) -> f32 {
    text_width_px(text, TICK_LABEL_PX, Weight::Regular)
}

/// A line across all bars with its name above, kept within the page.
fn guide_shapes(axes: &Axes, (value, name): (f64, &str)) -> Vec<Shape> {
    let x = axes.at(value, 0.0).0.round();
    let ends = [(x, axes.top - GAP_PX / 2.0), (x, axes.top + axes.data_height)];
    let half = width(name) / 2.0;
    let middle =
        x.clamp(axes.left + half, (axes.left + axes.data_width - half).max(axes.left + half));
    vec![
        Shape::Line { points: ends.to_vec(), colour: QUIET_INK, thickness_px: STROKE_PX },
        text(name, (middle, axes.top - GAP_PX), Anchor::Middle, TICK_LABEL_PX),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bars(values: &[f64]) -> Bars<'static> {
        let bar = |&value: &f64| Bar { name: "drift", value, note: value.to_string(), ink: None };
        let bars = values.iter().map(bar).collect();
        Bars { title: "Gain", subtitle: "", label: "gain, 1", bars, guide: Some((2.0, "floor")) }
    }

    fn lengths(bars: &Bars) -> Vec<f32> {
        let length = |shape: &Shape| match shape {
            Shape::Area { corners, colour } if *colour != PAGE => Some(corners[1].0 - corners[0].0),
            _ => None,
        };
        bars.drawing().unwrap().shapes.iter().filter_map(length).collect()
    }

    #[test]
    fn lengths_are_as_the_values_and_nothing_leaves_the_page() {
        let bars = bars(&[4.0, 1.0, -3.0, 0.0]);
        let lengths = lengths(&bars);
        assert!((lengths[0] / lengths[1] - 4.0).abs() < 1e-4, "{lengths:?}");
        assert_eq!(lengths[2..], [0.0, 0.0]);
        let page = bars.drawing().unwrap();
        for shape in &page.shapes {
            let Shape::Text(text) = shape else { continue };
            if text.upwards || text.anchor != Anchor::Start {
                continue;
            }
            let end = text.at.0 + text_width_px(&text.text, text.size_px, text.weight);
            assert!(end <= page.width_px, "{}", text.text);
        }
    }

    #[test]
    fn no_bar_and_no_number_are_refused() {
        assert!(matches!(bars(&[]).drawing(), Err(FigureError::NoBars { bars: 0 })));
        assert!(bars(&[1.0, f64::NAN]).drawing().is_err());
        assert!(bars(&[0.0]).drawing().is_ok());
    }
}
