//! One channel of a raster as a figure for a paper: pixels, axes, colour bar, title.

use thiserror::Error;

use super::axis::{Tick, ticks};
use super::drawing::{Anchor, Drawing, DrawingError, Rgb, Shape, Text, Weight, text_width_px};
use crate::geometry::raster::Raster;

/// The longest sides of the data area in which pixels are still drawn larger than 1 px.
const DATA_WIDTH_PX: usize = 1200;
const DATA_HEIGHT_PX: usize = 1000;

const INK: Rgb = [34, 34, 34];
const QUIET_INK: Rgb = [96, 96, 96];
const NOTHING: Rgb = [221, 221, 221];

const TITLE_PX: f32 = 27.0;
const LABEL_PX: f32 = 20.0;
const TICK_LABEL_PX: f32 = 18.0;
const LINE_SPACING: f32 = 1.4;
/// Height of a digit over the font size.
const DIGIT_HEIGHT: f32 = 0.73;

const MARGIN_PX: f32 = 28.0;
const GAP_PX: f32 = 12.0;
const TICK_PX: f32 = 7.0;
const STROKE_PX: f32 = 2.0;
const BAR_WIDTH_PX: f32 = 24.0;
const BAR_MIN_HEIGHT_PX: f32 = 240.0;
/// Height of the triangle that ends a colour bar beyond which there are values.
const BEYOND_PX: f32 = 16.0;
const TITLE_MIN_WIDTH_PX: f32 = 420.0;

const NOTHING_NOTE: &str = "no detection";

/// A picture of one channel of a raster.
///
/// Every pixel of the raster is a square of whole image pixels, coloured by viridis. NaN is
/// light grey with a note beside it; a value beyond the range has the colour of the range's end,
/// and the colour bar ends in a triangle there.
#[derive(Clone, Copy, Debug)]
pub struct Figure<'a> {
    /// Where the channel is.
    pub raster: &'a Raster,
    /// The channel's name.
    pub channel: &'a str,
    /// First line, bold; may be empty.
    pub title: &'a str,
    /// Second line, quiet; may be empty.
    pub subtitle: &'a str,
    /// Quantity and unit of the colours, such as `received power, dBm`.
    pub colour_label: &'a str,
    /// Values of the first and the last colour, in the channel's unit; of the data if `None`.
    pub range: Option<(f64, f64)>,
    /// Quantity and unit along x, such as `x, m`.
    pub x_label: &'a str,
    /// Quantity and unit along y, such as `y, m`.
    pub y_label: &'a str,
}

/// Why a raster gave no figure.
#[derive(Debug, Error)]
pub enum FigureError {
    /// The raster has no such channel.
    #[error("draw channel {channel:?}: the raster has {available}; name one of these")]
    NoChannel {
        /// The name asked for.
        channel: String,
        /// The names there are.
        available: String,
    },
    /// The raster's numbers contradict each other or span no area.
    #[error(
        "draw {values} values on {width} × {height} pixels of {pixel_m} m: \
         give one value per pixel and a pixel a finite size and place"
    )]
    Grid {
        /// Values in the channel.
        values: usize,
        /// Columns of the raster.
        width: usize,
        /// Rows of the raster.
        height: usize,
        /// Side of a pixel, m.
        pixel_m: f64,
    },
    /// The range of the colours is empty, reversed or not finite.
    #[error("colour values from {low} to {high}: give two finite numbers, the smaller first")]
    Range {
        /// Value of the first colour, in the channel's unit.
        low: f64,
        /// Value of the last colour, in the channel's unit.
        high: f64,
    },
    /// The page could not be drawn.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
}

impl Figure<'_> {
    /// The figure as the bytes of a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        Ok(self.drawing()?.png()?)
    }

    /// The figure as the text of an SVG file, with the raster's pixels embedded as an image.
    pub fn svg(&self) -> Result<String, FigureError> {
        Ok(self.drawing()?.svg()?)
    }

    fn drawing(&self) -> Result<Drawing, FigureError> {
        let values = self.values()?;
        let colours = Colours::over(values, self.range)?;
        let (x_ticks, y_ticks) = (self.x_ticks(), self.y_ticks());
        let bar = Bar::new(self.colour_label, colours.as_ref(), values, self.data_height_px());
        let page = self.page(&y_ticks, &bar);

        let mut shapes = self.heading(&page);
        shapes.push(self.cells(&page, values, colours.as_ref()));
        shapes.push(frame(page.left, page.top, page.data_width, page.data_height));
        shapes.extend(self.x_axis(&page, &x_ticks));
        shapes.extend(self.y_axis(&page, &y_ticks));
        shapes.extend(bar.shapes(page.left + page.data_width + 2.5 * GAP_PX, page.top));
        Ok(Drawing { width_px: page.width, height_px: page.height, shapes })
    }

    fn values(&self) -> Result<&[f32], FigureError> {
        let raster = self.raster;
        let values = raster.channel(self.channel).ok_or_else(|| FigureError::NoChannel {
            channel: self.channel.into(),
            available: raster
                .channels
                .iter()
                .map(|c| c.name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let filled =
            !values.is_empty() && raster.width.checked_mul(raster.height) == Some(values.len());
        let placed = raster.x_min_m.is_finite() && raster.y_min_m.is_finite();
        if filled && placed && raster.pixel_m > 0.0 && raster.pixel_m.is_finite() {
            return Ok(values);
        }
        Err(FigureError::Grid {
            values: values.len(),
            width: raster.width,
            height: raster.height,
            pixel_m: raster.pixel_m,
        })
    }

    /// Side of a raster pixel, px.
    fn cell_px(&self) -> usize {
        (DATA_WIDTH_PX / self.raster.width).min(DATA_HEIGHT_PX / self.raster.height).max(1)
    }

    fn data_width_px(&self) -> f32 {
        (self.raster.width * self.cell_px()) as f32
    }

    fn data_height_px(&self) -> f32 {
        (self.raster.height * self.cell_px()) as f32
    }

    fn x_ticks(&self) -> Vec<Tick> {
        let Raster { x_min_m, pixel_m, width, .. } = *self.raster;
        ticks(x_min_m, x_min_m + pixel_m * width as f64, ticks_along(self.data_width_px()))
    }

    fn y_ticks(&self) -> Vec<Tick> {
        let Raster { y_min_m, pixel_m, height, .. } = *self.raster;
        ticks(y_min_m, y_min_m + pixel_m * height as f64, ticks_along(self.data_height_px()))
    }

    fn page(&self, y_ticks: &[Tick], bar: &Bar) -> Page {
        let (data_width, data_height) = (self.data_width_px(), self.data_height_px());
        let y_labels = LINE_SPACING * LABEL_PX + widest(y_ticks) + TICK_PX + GAP_PX;
        let left = (MARGIN_PX + y_labels).round();
        let content = (data_width + 2.5 * GAP_PX + bar.width()).max(TITLE_MIN_WIDTH_PX);
        let title = wrapped(self.title, TITLE_PX, Weight::SemiBold, content);
        let subtitle = wrapped(self.subtitle, LABEL_PX, Weight::Regular, content);
        let heading =
            LINE_SPACING * (TITLE_PX * title.len() as f32 + LABEL_PX * subtitle.len() as f32);
        let top = (MARGIN_PX + heading + GAP_PX).round();
        let x_labels = TICK_PX + LINE_SPACING * (TICK_LABEL_PX + LABEL_PX) + 1.5 * GAP_PX;
        let bottom = (data_height + x_labels).max(bar.height);
        let (width, height) = (left + content + MARGIN_PX, top + bottom + MARGIN_PX / 2.0);
        let (width, height) = (width.ceil(), height.ceil());
        Page { width, height, left, top, data_width, data_height, title, subtitle }
    }

    fn heading(&self, page: &Page) -> Vec<Shape> {
        let title = page.title.iter().map(|line| (line, TITLE_PX, Weight::SemiBold, INK));
        let subtitle =
            page.subtitle.iter().map(|line| (line, LABEL_PX, Weight::Regular, QUIET_INK));
        let mut y = MARGIN_PX - 0.35 * TITLE_PX;
        title
            .chain(subtitle)
            .map(|(line, size_px, weight, colour)| {
                y += LINE_SPACING * size_px;
                let at = (page.left, y.round());
                let (text, anchor) = (line.clone(), Anchor::Start);
                Shape::Text(Text { text, at, anchor, size_px, weight, colour, upwards: false })
            })
            .collect()
    }

    fn cells(&self, page: &Page, values: &[f32], colours: Option<&Colours>) -> Shape {
        Shape::Cells {
            left_px: page.left as u32,
            top_px: page.top as u32,
            cell_px: self.cell_px() as u32,
            columns: self.raster.width,
            colours: values.iter().map(|&v| colours.map_or(NOTHING, |c| c.of(v))).collect(),
        }
    }

    fn x_axis(&self, page: &Page, ticks: &[Tick]) -> Vec<Shape> {
        let bottom = page.top + page.data_height;
        let label_y = bottom + TICK_PX + GAP_PX / 2.0 + DIGIT_HEIGHT * TICK_LABEL_PX;
        let middle = page.left + page.data_width / 2.0;
        let title_y = label_y + GAP_PX + LABEL_PX;
        let mut shapes = vec![text(self.x_label, (middle, title_y), Anchor::Middle, LABEL_PX)];
        for tick in ticks {
            let along = (tick.value - self.raster.x_min_m) / self.raster.pixel_m;
            let x = (page.left + along as f32 * self.cell_px() as f32).round();
            shapes.push(line((x, bottom), (x, bottom + STROKE_PX + TICK_PX)));
            shapes.push(text(&tick.label, (x, label_y), Anchor::Middle, TICK_LABEL_PX));
        }
        shapes
    }

    fn y_axis(&self, page: &Page, ticks: &[Tick]) -> Vec<Shape> {
        let bottom = page.top + page.data_height;
        let label_x = page.left - STROKE_PX - TICK_PX - GAP_PX / 2.0;
        let title_x = label_x - widest(ticks) - GAP_PX;
        let middle = (title_x, page.top + page.data_height / 2.0);
        let mut shapes = vec![upward(self.y_label, middle)];
        for tick in ticks {
            let along = (tick.value - self.raster.y_min_m) / self.raster.pixel_m;
            let y = (bottom - along as f32 * self.cell_px() as f32).round();
            let base_y = y + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX;
            shapes.push(line((page.left - STROKE_PX - TICK_PX, y), (page.left, y)));
            shapes.push(text(&tick.label, (label_x, base_y), Anchor::End, TICK_LABEL_PX));
        }
        shapes
    }
}

/// Where things are, px.
struct Page {
    width: f32,
    height: f32,
    left: f32,
    top: f32,
    data_width: f32,
    data_height: f32,
    title: Vec<String>,
    subtitle: Vec<String>,
}

/// Values to colours.
struct Colours {
    low: f64,
    high: f64,
    steps: Vec<Rgb>,
}

impl Colours {
    /// Colours for a range, or for the finite values; `None` where there are neither.
    fn over(values: &[f32], range: Option<(f64, f64)>) -> Result<Option<Colours>, FigureError> {
        let Some((low, high)) = range.or_else(|| span(values)) else { return Ok(None) };
        if !(low < high && (high - low).is_finite()) {
            return Err(FigureError::Range { low, high });
        }
        let steps = (0..256).map(|step| colorous::VIRIDIS.eval_rational(step, 256).into_array());
        Ok(Some(Colours { low, high, steps: steps.collect() }))
    }

    fn of(&self, value: f32) -> Rgb {
        if value.is_nan() {
            return NOTHING;
        }
        let share = (f64::from(value) - self.low) / (self.high - self.low);
        self.steps[(255.0 * share.clamp(0.0, 1.0)).round() as usize]
    }
}

/// Least and greatest finite value; a little around a single one, which has no span of its own.
fn span(values: &[f32]) -> Option<(f64, f64)> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let low = f64::from(finite().reduce(f32::min)?);
    let high = f64::from(finite().reduce(f32::max)?);
    let around = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
    Some(if low < high { (low, high) } else { (low - around, high + around) })
}

/// The column right of the data: the colour bar, and below it the note on what is grey.
struct Bar<'a> {
    label: &'a str,
    colours: Option<&'a Colours>,
    ticks: Vec<Tick>,
    height: f32,
    below: bool,
    above: bool,
    gaps: bool,
}

impl<'a> Bar<'a> {
    fn new(label: &'a str, colours: Option<&'a Colours>, values: &[f32], data_height: f32) -> Self {
        let label_px = text_width_px(label, LABEL_PX, Weight::Regular);
        // In f32, so that an end that the data reach exactly is not taken for passed.
        let any = |beyond: &dyn Fn(&Colours, f32) -> bool| {
            colours.is_some_and(|c| values.iter().any(|&value| beyond(c, value)))
        };
        let mut bar = Bar {
            label,
            colours,
            ticks: Vec::new(),
            height: data_height.max(BAR_MIN_HEIGHT_PX),
            below: any(&|c, value| value < c.low as f32),
            above: any(&|c, value| value > c.high as f32),
            gaps: values.iter().any(|v| v.is_nan()),
        };
        bar.height += (label_px - bar.ramp_height()).max(0.0);
        if let Some(Colours { low, high, .. }) = colours {
            bar.ticks = ticks(*low, *high, ticks_along(bar.ramp_height()).max(3));
        }
        bar
    }

    fn width(&self) -> f32 {
        let ticks = TICK_PX + GAP_PX + widest(&self.ticks) + LINE_SPACING * LABEL_PX;
        let note = GAP_PX + text_width_px(NOTHING_NOTE, TICK_LABEL_PX, Weight::Regular);
        let note = if self.gaps { note } else { 0.0 };
        BAR_WIDTH_PX + note.max(if self.colours.is_some() { ticks } else { 0.0 })
    }

    /// Height of the part that runs through the colours, px.
    fn ramp_height(&self) -> f32 {
        let ends = f32::from(u8::from(self.below) + u8::from(self.above)) * BEYOND_PX;
        let note = if self.gaps { BAR_WIDTH_PX + 2.0 * GAP_PX } else { 0.0 };
        (self.height - ends - note).round()
    }

    fn shapes(&self, left: f32, top: f32) -> Vec<Shape> {
        let left = left.round();
        let mut shapes = Vec::new();
        if let Some(colours) = self.colours {
            let top = top + if self.above { BEYOND_PX } else { 0.0 };
            shapes.extend(self.ramp(colours, left, top));
            shapes.extend(self.scale(colours, left + BAR_WIDTH_PX, top));
        }
        if self.gaps {
            shapes.extend(note(left, (top + self.height - BAR_WIDTH_PX).round()));
        }
        shapes
    }

    fn ramp(&self, colours: &Colours, left: f32, top: f32) -> Vec<Shape> {
        let (rows, columns) = (self.ramp_height() as usize, BAR_WIDTH_PX as usize);
        let bottom = top + rows as f32;
        let step = |row: usize| colours.steps[255 - 256 * row / rows.max(1)];
        let cells = Shape::Cells {
            left_px: left as u32,
            top_px: top as u32,
            cell_px: 1,
            columns,
            colours: (0..rows).flat_map(|row| std::iter::repeat_n(step(row), columns)).collect(),
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

fn note(left: f32, top: f32) -> [Shape; 2] {
    let swatch = Shape::Cells {
        left_px: left as u32,
        top_px: top as u32,
        cell_px: BAR_WIDTH_PX as u32,
        columns: 1,
        colours: vec![NOTHING],
    };
    let base_y = top + BAR_WIDTH_PX / 2.0 + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX;
    let at = (left + BAR_WIDTH_PX + GAP_PX, base_y);
    [swatch, text(NOTHING_NOTE, at, Anchor::Start, TICK_LABEL_PX)]
}

/// A frame that covers none of what it surrounds.
fn frame(left: f32, top: f32, width: f32, height: f32) -> Shape {
    let out = STROKE_PX / 2.0;
    let (left, top, right, bottom) =
        (left - out, top - out, left + width + out, top + height + out);
    // The last point overshoots by half a stroke so that the corner is filled.
    let points =
        vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top - out)];
    Shape::Line { points, colour: INK, thickness_px: STROKE_PX }
}

fn line(from: (f32, f32), to: (f32, f32)) -> Shape {
    Shape::Line { points: vec![from, to], colour: INK, thickness_px: STROKE_PX }
}

fn text(text: &str, (x, y): (f32, f32), anchor: Anchor, size_px: f32) -> Shape {
    let (text, at, weight) = (text.to_owned(), (x, y.round()), Weight::Regular);
    Shape::Text(Text { text, at, anchor, size_px, weight, colour: INK, upwards: false })
}

fn upward(text: &str, (x, y): (f32, f32)) -> Shape {
    let (at, weight, anchor) = ((x.round(), y), Weight::Regular, Anchor::Middle);
    let text = text.to_owned();
    Shape::Text(Text { text, at, anchor, size_px: LABEL_PX, weight, colour: INK, upwards: true })
}

/// How many ticks suit an axis of this length.
fn ticks_along(length_px: f32) -> usize {
    (length_px / 95.0) as usize
}

fn widest(ticks: &[Tick]) -> f32 {
    let widths = ticks.iter().map(|t| text_width_px(&t.label, TICK_LABEL_PX, Weight::Regular));
    widths.fold(0.0, f32::max)
}

/// Lines no wider than `width_px`, unless a single word is.
fn wrapped(text: &str, size_px: f32, weight: Weight, width_px: f32) -> Vec<String> {
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
    use crate::geometry::raster::Channel;

    const WIDTH: usize = 125;
    const HEIGHT: usize = 225;

    fn raster(value: impl Fn(f64, f64) -> f64) -> Raster {
        let mut raster = Raster {
            width: WIDTH,
            height: HEIGHT,
            x_min_m: -0.25,
            y_min_m: -0.45,
            pixel_m: 0.004,
            channels: Vec::new(),
        };
        let at = |i: usize| value(raster.x_m(i % WIDTH), raster.y_m(i / WIDTH)) as f32;
        let values = (0..WIDTH * HEIGHT).map(at).collect();
        raster.channels.push(Channel { name: "power_dbm".into(), values });
        raster
    }

    /// A smooth blob of −40 to −70 dBm with nothing around it.
    fn blob(x_m: f64, y_m: f64) -> f64 {
        let away = (x_m / 0.15).powi(2) + (y_m / 0.3).powi(2);
        if away < 1.0 { -40.0 - 30.0 * away } else { f64::NAN }
    }

    fn figure(raster: &Raster) -> Figure<'_> {
        Figure {
            raster,
            channel: "power_dbm",
            title: "Plate",
            subtitle: "300 GHz, θ = 20°",
            colour_label: "received power, dBm",
            range: Some((-70.0, -40.0)),
            x_label: "x, m",
            y_label: "y, m",
        }
    }

    struct Picture {
        width: usize,
        height: usize,
        rgb: Vec<u8>,
    }

    impl Picture {
        fn decode(bytes: &[u8]) -> Picture {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut rgb).unwrap();
            Picture { width: info.width as usize, height: info.height as usize, rgb }
        }

        fn at(&self, x: usize, y: usize) -> Rgb {
            let start = 3 * (y * self.width + x);
            [self.rgb[start], self.rgb[start + 1], self.rgb[start + 2]]
        }

        /// The cell of a raster, after checking that all its pixels are alike.
        fn cell(&self, page: &Page, column: usize, row: usize) -> Rgb {
            let (left, top) = (page.left as usize + 4 * column, page.top as usize + 4 * row);
            let colour = self.at(left, top);
            assert!((0..16).all(|i| self.at(left + i % 4, top + i / 4) == colour));
            colour
        }
    }

    fn page(figure: &Figure) -> Page {
        let values = figure.values().unwrap();
        let colours = Colours::over(values, figure.range).unwrap();
        let bar = Bar::new(figure.colour_label, colours.as_ref(), values, figure.data_height_px());
        figure.page(&figure.y_ticks(), &bar)
    }

    #[test]
    fn cells_have_the_colour_of_their_value() {
        let raster = raster(blob);
        let figure = figure(&raster);
        let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
        for (column, row) in [(62, 112), (50, 112), (70, 60), (40, 150)] {
            let share = (blob(raster.x_m(column), raster.y_m(row)) + 70.0) / 30.0;
            let wanted = colorous::VIRIDIS.eval_continuous(share).into_array();
            let cell = picture.cell(&page, column, row);
            let close = |channel: usize| cell[channel].abs_diff(wanted[channel]) <= 3;
            assert!((0..3).all(close), "{cell:?} for {wanted:?} at {column}, {row}");
        }
        for (column, row) in [(0, 0), (124, 224), (5, 112)] {
            assert_eq!(picture.cell(&page, column, row), NOTHING);
        }
    }

    #[test]
    fn the_page_is_upright_and_its_data_has_square_pixels() {
        let raster = raster(blob);
        let figure = figure(&raster);
        let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
        assert_eq!((page.data_width, page.data_height), (500.0, 900.0));
        assert!((1000..1200).contains(&picture.height) && (700..900).contains(&picture.width));
        let ink_left_of_the_data = picture.at(page.left as usize - 1, page.top as usize + 450);
        assert_eq!(ink_left_of_the_data, INK);
    }

    #[test]
    fn the_same_raster_gives_the_same_bytes() {
        let raster = raster(blob);
        assert_eq!(figure(&raster).png().unwrap(), figure(&raster).png().unwrap());
        assert_eq!(figure(&raster).svg().unwrap(), figure(&raster).svg().unwrap());
    }

    #[test]
    fn nothing_and_a_constant_can_be_drawn() {
        let colour_in_the_middle = |value: f64, range| {
            let raster = raster(|_, _| value);
            let figure = Figure { range, ..figure(&raster) };
            Picture::decode(&figure.png().unwrap()).cell(&page(&figure), 62, 112)
        };
        assert_eq!(colour_in_the_middle(f64::NAN, None), NOTHING);
        assert_eq!(colour_in_the_middle(f64::NAN, Some((-70.0, -40.0))), NOTHING);
        let middle = colorous::VIRIDIS.eval_rational(128, 256).into_array();
        assert_eq!(colour_in_the_middle(-40.0, None), middle);
        assert_eq!(colour_in_the_middle(0.0, None), middle);
        let lowest = colorous::VIRIDIS.eval_rational(0, 256).into_array();
        assert_eq!(colour_in_the_middle(f64::NEG_INFINITY, Some((-70.0, -40.0))), lowest);
    }

    #[test]
    fn any_shape_of_raster_fits_its_page() {
        for (width, height) in [(1, 1), (1, 225), (400, 3), (300, 1100)] {
            let values = (0..width * height).map(|i| i as f32).collect();
            let channels = vec![Channel { name: "power_dbm".into(), values }];
            let raster = Raster { width, height, channels, ..raster(blob) };
            let figure = Figure { range: None, ..figure(&raster) };
            let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
            assert!(page.left + page.data_width < picture.width as f32, "{width} × {height}");
            assert!(page.top + page.data_height < picture.height as f32, "{width} × {height}");
        }
    }

    #[test]
    fn long_titles_are_wrapped_at_words() {
        let lines = wrapped("one two  three", 20.0, Weight::Regular, 95.0);
        assert_eq!(lines, ["one two", "three"]);
        assert!(wrapped(" ", 20.0, Weight::Regular, 95.0).is_empty());
    }

    #[test]
    fn figures_that_cannot_be_drawn_say_why() {
        let good = raster(blob);
        let error = Figure { channel: "range_m", ..figure(&good) }.png().unwrap_err();
        assert!(error.to_string().contains("power_dbm"), "{error}");
        for range in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            let error = Figure { range: Some(range), ..figure(&good) }.png().unwrap_err();
            assert!(matches!(error, FigureError::Range { .. }), "{range:?}");
        }
        let empty = Raster { width: 0, height: 0, ..raster(blob) };
        let flat = Raster { pixel_m: 0.0, ..raster(blob) };
        let adrift = Raster { x_min_m: f64::NAN, ..raster(blob) };
        for bad in [empty, flat, adrift] {
            assert!(matches!(figure(&bad).png(), Err(FigureError::Grid { .. })));
        }
    }
}
