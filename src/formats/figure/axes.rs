//! The frame around data, its two axes, and the title above it.

use super::drawing::{Anchor, Shape, Text, Weight};
use super::style::{
    DIGIT_HEIGHT, GAP_PX, INK, LABEL_PX, LINE_SPACING, MARGIN_PX, QUIET_INK, STROKE_PX,
    TICK_LABEL_PX, TICK_PX, TITLE_PX, frame, line, text, ticks_along, ticks_up, upward, widest,
    wrapped,
};
use super::ticks::{Tick, ticks};

/// Fewest ticks of an axis with room for them.
const FEWEST_TICKS: usize = 4;
/// So many wanted ticks are at least [`FEWEST_TICKS`]: a step is rounded up by a factor of 2.5 at most.
const SURELY_ENOUGH: usize = 10;

/// One axis: its quantity with its unit, and the values at its two ends.
#[derive(Clone, Copy)]
pub(super) struct Axis<'a> {
    pub label: &'a str,
    pub low: f64,
    pub high: f64,
}

impl Axis<'_> {
    /// Whether a value lies between the ends.
    pub fn holds(&self, value: f64) -> bool {
        value >= self.low && value <= self.high
    }

    /// Where a value lies from the low end, 0, to the high end, 1.
    fn share(&self, value: f64) -> f32 {
        ((value - self.low) / (self.high - self.low)) as f32
    }
}

/// About the wanted number of ticks, and at least four where that many are wanted.
fn four_ticks(axis: &Axis, wanted: usize) -> Vec<Tick> {
    let mut found = ticks(axis.low, axis.high, wanted);
    for more in wanted..SURELY_ENOUGH {
        if wanted < FEWEST_TICKS || found.len() >= FEWEST_TICKS {
            break;
        }
        found = ticks(axis.low, axis.high, more + 1);
    }
    found
}

/// Data area and heading of a page, px.
pub(super) struct Axes<'a> {
    pub x: Axis<'a>,
    pub y: Axis<'a>,
    pub x_ticks: Vec<Tick>,
    pub y_ticks: Vec<Tick>,
    title: Vec<String>,
    subtitle: Vec<String>,
    pub left: f32,
    pub top: f32,
    pub data_width: f32,
    pub data_height: f32,
}

impl<'a> Axes<'a> {
    /// Lays out a data area of the given size under a heading that is `content_width` wide.
    pub fn new(
        [x, y]: [Axis<'a>; 2],
        [data_width, data_height]: [f32; 2],
        [title, subtitle]: [&str; 2],
        content_width: f32,
    ) -> Axes<'a> {
        let wanted = [ticks_along(data_width), ticks_up(data_height)];
        let bare = Axes::bare([x, y], [0.0, 0.0, data_width, data_height], wanted);
        let y_labels = LINE_SPACING * LABEL_PX + widest(&bare.y_ticks) + TICK_PX + GAP_PX;
        let title = wrapped(title, TITLE_PX, Weight::SemiBold, content_width);
        let subtitle = wrapped(subtitle, LABEL_PX, Weight::Regular, content_width);
        let heading =
            LINE_SPACING * (TITLE_PX * title.len() as f32 + LABEL_PX * subtitle.len() as f32);
        let left = (MARGIN_PX + y_labels).round();
        let top = (MARGIN_PX + heading + GAP_PX).round();
        Axes { title, subtitle, left, top, ..bare }
    }

    /// A data area without a heading, whose axes have about the wanted numbers of ticks, and at least four where those are wanted.
    pub fn bare(
        [x, y]: [Axis<'a>; 2],
        [left, top, data_width, data_height]: [f32; 4],
        [x_wanted, y_wanted]: [usize; 2],
    ) -> Axes<'a> {
        Axes {
            x,
            y,
            x_ticks: four_ticks(&x, x_wanted),
            y_ticks: four_ticks(&y, y_wanted),
            title: Vec::new(),
            subtitle: Vec::new(),
            left,
            top,
            data_width,
            data_height,
        }
    }

    /// Removes the ticks of y, for an axis of names without a scale.
    pub fn hide_y(&mut self) {
        self.y_ticks.clear();
    }

    /// Height of the data area and what is written below it, px.
    pub fn height_with_labels(&self) -> f32 {
        self.data_height + TICK_PX + LINE_SPACING * (TICK_LABEL_PX + LABEL_PX) + 1.5 * GAP_PX
    }

    /// Where a value stands on the page, px.
    pub fn at(&self, x: f64, y: f64) -> (f32, f32) {
        let up = self.y.share(y) * self.data_height;
        (self.left + self.x.share(x) * self.data_width, self.top + self.data_height - up)
    }

    /// Frame, ticks, labels and heading.
    pub fn shapes(&self) -> Vec<Shape> {
        let mut shapes = self.heading();
        shapes.push(frame(self.left, self.top, self.data_width, self.data_height));
        shapes.extend(self.x_axis());
        shapes.extend(self.y_axis());
        shapes
    }

    fn heading(&self) -> Vec<Shape> {
        let title = self.title.iter().map(|line| (line, TITLE_PX, Weight::SemiBold, INK));
        let subtitle =
            self.subtitle.iter().map(|line| (line, LABEL_PX, Weight::Regular, QUIET_INK));
        let mut y = MARGIN_PX - 0.35 * TITLE_PX;
        title
            .chain(subtitle)
            .map(|(line, size_px, weight, colour)| {
                y += LINE_SPACING * size_px;
                let at = (self.left, y.round());
                let (text, anchor) = (line.clone(), Anchor::Start);
                Shape::Text(Text { text, at, anchor, size_px, weight, colour, upwards: false })
            })
            .collect()
    }

    fn x_axis(&self) -> Vec<Shape> {
        let bottom = self.top + self.data_height;
        let label_y = bottom + TICK_PX + GAP_PX / 2.0 + DIGIT_HEIGHT * TICK_LABEL_PX;
        let middle = self.left + self.data_width / 2.0;
        let title_y = label_y + GAP_PX + LABEL_PX;
        let mut shapes = vec![text(self.x.label, (middle, title_y), Anchor::Middle, LABEL_PX)];
        for tick in &self.x_ticks {
            let x = self.at(tick.value, self.y.low).0.round();
            shapes.push(line((x, bottom), (x, bottom + STROKE_PX + TICK_PX)));
            shapes.push(text(&tick.label, (x, label_y), Anchor::Middle, TICK_LABEL_PX));
        }
        shapes
    }

    fn y_axis(&self) -> Vec<Shape> {
        let label_x = self.left - STROKE_PX - TICK_PX - GAP_PX / 2.0;
        let title_x = label_x - widest(&self.y_ticks) - GAP_PX;
        let middle = (title_x, self.top + self.data_height / 2.0);
        let mut shapes = vec![upward(self.y.label, middle)];
        for tick in &self.y_ticks {
            let y = self.at(self.x.low, tick.value).1.round();
            let base_y = y + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX;
            shapes.push(line((self.left - STROKE_PX - TICK_PX, y), (self.left, y)));
            shapes.push(text(&tick.label, (label_x, base_y), Anchor::End, TICK_LABEL_PX));
        }
        shapes
    }
}
