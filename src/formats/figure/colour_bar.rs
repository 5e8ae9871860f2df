//! Values to colours, and the bar beside a raster that explains them.

use super::drawing::{Anchor, Rgb, Shape, Weight, text_width_px};
use super::error::FigureError;
use super::style::{
    DIGIT_HEIGHT, GAP_PX, LABEL_PX, LINE_SPACING, TICK_LABEL_PX, TICK_PX, line, text, ticks_along,
    upward, widest,
};
use super::ticks::{Tick, ticks};

/// The colour of NaN.
pub(super) const NOTHING: Rgb = [221, 221, 221];
/// The colour of NaN among colours that are nearly white in their middle.
const NOTHING_BESIDE_WHITE: Rgb = [178, 178, 178];

/// Which colours stand for which values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Viridis, from the least to the greatest value.
    Sequential,
    /// Blue below 0, nearly white at 0, red above: for differences. A range that is not given
    /// reaches equally far to both sides of 0.
    Diverging,
}

impl Scale {
    /// The colour at a share of the way from the least to the greatest value, 0 to 1; beyond them that of the nearer end.
    pub fn colour_at(self, share: f64) -> Rgb {
        self.colour((255.0 * share.clamp(0.0, 1.0)).round() as usize)
    }

    /// The colour of a step from 0 to 255.
    fn colour(self, step: usize) -> Rgb {
        let colour = match self {
            Scale::Sequential => colorous::VIRIDIS.eval_rational(step, 256),
            Scale::Diverging => colorous::RED_BLUE.eval_rational(255 - step, 256),
        };
        colour.into_array()
    }
}

const BAR_WIDTH_PX: f32 = 24.0;
const BAR_MIN_HEIGHT_PX: f32 = 240.0;
/// Height of the triangle that ends a colour bar beyond which there are values.
const BEYOND_PX: f32 = 16.0;

/// Values to colours.
pub(super) struct Colours {
    low: f64,
    high: f64,
    steps: Vec<Rgb>,
    nothing: Rgb,
}

impl Colours {
    /// Colours for a range, or for the finite values; `None` where there are neither.
    pub fn over(
        values: &[f32],
        range: Option<(f64, f64)>,
        scale: Scale,
    ) -> Result<Option<Colours>, FigureError> {
        let Some((low, high)) = range.or_else(|| span(values, scale)) else { return Ok(None) };
        if !(low < high && (high - low).is_finite()) {
            return Err(FigureError::Range { low, high });
        }
        let steps = (0..256).map(|step| scale.colour(step)).collect();
        Ok(Some(Colours { low, high, steps, nothing: nothing(scale) }))
    }

    pub fn of(&self, value: f32) -> Rgb {
        if value.is_nan() {
            return self.nothing;
        }
        let share = (f64::from(value) - self.low) / (self.high - self.low);
        self.steps[(255.0 * share.clamp(0.0, 1.0)).round() as usize]
    }
}

/// The colour of every value, from the least to the greatest of them as on a [`Scale::Sequential`]; NaN is grey.
pub fn colours_of(values: &[f32]) -> Vec<Rgb> {
    match Colours::over(values, None, Scale::Sequential) {
        Ok(Some(colours)) => values.iter().map(|value| colours.of(*value)).collect(),
        _ => vec![NOTHING; values.len()],
    }
}

/// The colour of NaN on a scale.
pub(super) fn nothing(scale: Scale) -> Rgb {
    match scale {
        Scale::Sequential => NOTHING,
        Scale::Diverging => NOTHING_BESIDE_WHITE,
    }
}

/// Least and greatest finite value, as far to both sides of 0 on a diverging scale; a little around
/// a single one, which has no span of its own.
fn span(values: &[f32], scale: Scale) -> Option<(f64, f64)> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let low = f64::from(finite().reduce(f32::min)?);
    let high = f64::from(finite().reduce(f32::max)?);
    if scale == Scale::Diverging {
        let reach = low.abs().max(high.abs());
        let reach = if reach > 0.0 { reach } else { 1.0 };
        return Some((-reach, reach));
    }
    let around = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
    Some(if low < high { (low, high) } else { (low - around, high + around) })
}

/// The column right of the data: the colour bar, and below it the note on what is grey.
pub(super) struct Bar<'a> {
    label: &'a str,
    colours: Option<&'a Colours>,
    ticks: Vec<Tick>,
    pub height: f32,
    below: bool,
    above: bool,
    /// Colour of what has no value, and its meaning in words.
    gaps: Option<(Rgb, &'a str)>,
}

impl<'a> Bar<'a> {
    pub fn new(
        label: &'a str,
        gaps: (Rgb, &'a str),
        colours: Option<&'a Colours>,
        values: &[f32],
        data_height: f32,
    ) -> Self {
        let label_px = text_width_px(label, LABEL_PX, Weight::Regular);
        // In f32, so that an end that the data reach exactly is not taken for passed.
        let ends = colours.map(|colours| [colours.low as f32, colours.high as f32]);
        let mut bar = Bar {
            label,
            colours,
            ticks: Vec::new(),
            height: data_height.max(BAR_MIN_HEIGHT_PX),
            below: ends.is_some_and(|[low, _]| values.iter().any(|&value| value < low)),
            above: ends.is_some_and(|[_, high]| values.iter().any(|&value| value > high)),
            gaps: values.iter().any(|v| v.is_nan()).then_some(gaps),
        };
        bar.height += (label_px - bar.ramp_height()).max(0.0);
        if let Some(Colours { low, high, .. }) = colours {
            bar.ticks = ticks(*low, *high, ticks_along(bar.ramp_height()).max(3));
        }
        bar
    }

    pub fn width(&self) -> f32 {
        let ticks = TICK_PX + GAP_PX + widest(&self.ticks) + LINE_SPACING * LABEL_PX;
        let note = self.gaps.map_or(0.0, |(_, meaning)| {
            GAP_PX + text_width_px(meaning, TICK_LABEL_PX, Weight::Regular)
        });
        BAR_WIDTH_PX + note.max(if self.colours.is_some() { ticks } else { 0.0 })
    }

    /// Height of the part that runs through the colours, px.
    fn ramp_height(&self) -> f32 {
        let ends = f32::from(u8::from(self.below) + u8::from(self.above)) * BEYOND_PX;
        let note = if self.gaps.is_some() { BAR_WIDTH_PX + 2.0 * GAP_PX } else { 0.0 };
        (self.height - ends - note).round()
    }

    pub fn shapes(&self, left: f32, top: f32) -> Vec<Shape> {
        let left = left.round();
        let mut shapes = Vec::new();
        if let Some(colours) = self.colours {
            let top = top + if self.above { BEYOND_PX } else { 0.0 };
            shapes.extend(self.ramp(colours, left, top));
            shapes.extend(self.scale(colours, left + BAR_WIDTH_PX, top));
        }
        if let Some(gaps) = self.gaps {
            shapes.extend(note(gaps, left, (top + self.height - BAR_WIDTH_PX).round()));
        }
        shapes
    }

    fn ramp(&self, colours: &Colours, left: f32, top: f32) -> Vec<Shape> {
        let (rows, columns) = (self.ramp_height() as usize, BAR_WIDTH_PX as usize);
        let bottom = top + rows as f32;
        let cells = Shape::Cells {
            left_px: left as u32,
            top_px: top as u32,
            cell_px: 1,
            columns,
            colours: (0..rows)
                .map(|row| colours.steps[255 - 256 * row / rows.max(1)])
                .flat_map(|colour| std::iter::repeat_n(colour, columns))
                .collect(),
        };
        let mut shapes = vec![cells];
        if self.below {
            shapes.push(beyond(left, bottom, bottom + BEYOND_PX, colours.steps[0]));
        }
        if self.above {
            shapes.push(beyond(left, top, top - BEYOND_PX, colours.steps[255]));
        }
        shapes
    }

    fn scale(&self, colours: &Colours, x: f32, top: f32) -> Vec<Shape> {
        let label_x = x + TICK_PX + GAP_PX / 2.0;
        let title_x = label_x + widest(&self.ticks) + GAP_PX / 2.0 + LABEL_PX;
        let mut shapes = vec![upward(self.label, (title_x, top + self.ramp_height() / 2.0))];
        for tick in &self.ticks {
            let share = (tick.value - colours.low) / (colours.high - colours.low);
            let y = (top + (1.0 - share as f32) * self.ramp_height()).round();
            shapes.push(line((x, y), (x + TICK_PX, y)));
            let at = (label_x, y + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX);
            shapes.push(text(&tick.label, at, Anchor::Start, TICK_LABEL_PX));
        }
        shapes
    }
}

/// The triangle that says there are values beyond the end of the bar at `from`.
fn beyond(left: f32, from: f32, to: f32, colour: Rgb) -> Shape {
    let corners = [(left, from), (left + BAR_WIDTH_PX, from), (left + BAR_WIDTH_PX / 2.0, to)];
    Shape::Area { corners: corners.into(), colour }
}

fn note((colour, meaning): (Rgb, &str), left: f32, top: f32) -> [Shape; 2] {
    let swatch = Shape::Cells {
        left_px: left as u32,
        top_px: top as u32,
        cell_px: BAR_WIDTH_PX as u32,
        columns: 1,
        colours: vec![colour],
    };
    let base_y = top + BAR_WIDTH_PX / 2.0 + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX;
    let at = (left + BAR_WIDTH_PX + GAP_PX, base_y);
    [swatch, text(meaning, at, Anchor::Start, TICK_LABEL_PX)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_white_at_0_and_as_strong_below_as_above() {
        let colours = Colours::over(&[-1.0, 3.0], None, Scale::Diverging).unwrap().unwrap();
        assert_eq!((colours.low, colours.high), (-3.0, 3.0));
        assert!(colours.of(0.0).iter().all(|&channel| channel > 230));
        let [below, above] = [-3.0, 3.0].map(|value| colours.of(value));
        assert!(below[2] > 2 * below[0] && above[0] > 2 * above[2], "{below:?} {above:?}");
        let depth = |colour: Rgb| colour.iter().map(|&channel| u32::from(channel)).sum::<u32>();
        assert!(depth(below).abs_diff(depth(above)) < 60);
        assert!(depth(colours.of(f32::NAN)) + 150 < depth(colours.of(0.0)));
    }

    #[test]
    fn no_difference_at_all_is_white() {
        let colours = Colours::over(&[0.0, 0.0], None, Scale::Diverging).unwrap().unwrap();
        assert!(colours.of(0.0).iter().all(|&channel| channel > 230));
    }
}
