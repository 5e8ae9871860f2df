//! Curves and points over two axes.

use super::axes::{Axes, Axis};
use super::drawing::{Anchor, Drawing, Point, Rgb, Shape, Weight, text_width_px};
use super::error::FigureError;
use super::ink::Ink;
use super::style::{DIGIT_HEIGHT, GAP_PX, LINE_SPACING, MARGIN_PX, STROKE_PX, TICK_LABEL_PX, text};

/// Longest sides of the data area, px.
const DATA_WIDTH_PX: f32 = 780.0;
const DATA_HEIGHT_PX: f32 = 560.0;
const EQUAL_SIDE_PX: f32 = 900.0;

const CURVE_PX: f32 = 2.5;
/// Side of a point, px.
const POINT_PX: f32 = 7.0;
/// Side of a point in a series of more than [`DENSE`] points, px.
const DENSE_POINT_PX: f32 = 3.0;
/// Largest number of points that do not hide each other.
const DENSE: usize = 1000;
/// Length of the sample before a name in the legend, px.
const SAMPLE_PX: f32 = 34.0;
/// Length of a dash and of the gap after it, px.
const DASH_PX: f32 = 7.0;

/// Colour of lines that are not data.
const GUIDE_INK: Rgb = [140, 140, 140];

/// A plot of any number of series.
#[derive(Clone, Debug, Default)]
pub struct Plot<'a> {
    /// First line, bold; may be empty.
    pub title: &'a str,
    /// Second line, quiet; may be empty.
    pub subtitle: &'a str,
    /// Quantity and unit along x.
    pub x_label: &'a str,
    /// Quantity and unit along y.
    pub y_label: &'a str,
    /// Values at the ends of x; around the data if `None`, see [`Plot::x_span`].
    pub x_range: Option<(f64, f64)>,
    /// Values at the ends of y; around the data if `None`, see [`Plot::y_span`].
    pub y_range: Option<(f64, f64)>,
    /// One unit is as long along x as along y, as on a map.
    pub equal: bool,
    /// What is drawn, the first lowest.
    pub series: Vec<Series>,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; none when empty.
    pub name: String,
    /// How the points are drawn.
    pub style: Style,
    /// What its colour stands for; a guide is grey.
    pub ink: Ink,
    /// (x, y); a point that is not finite interrupts a curve.
    pub points: Vec<(f64, f64)>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line through the points.
    Curve,
    /// A small square at each point.
    Points,
    /// A small triangle that points down: the truth is below.
    Below,
    /// A small triangle that points up: the truth is above.
    Above,
    /// The area that the points go round, in a tint of its colour. It is not in the legend and does not
    /// widen the axes.
    Band,
    /// Upright bars, each from one point to the next one. They are not in the legend.
    ErrorBars,
    /// Dashes through the points: a curve outside the range for which it is claimed. It is not in the legend.
    Beyond,
    /// A thin grey line to judge data by, such as zero. It does not widen the axes.
    Guide,
}

impl Style {
    /// Whether the points are data, which the axes are made for.
    fn is_data(self) -> bool {
        matches!(self, Style::Points | Style::Below | Style::Above | Style::ErrorBars)
    }

    /// Whether a series of this style has a line of the legend.
    fn is_named(self) -> bool {
        !matches!(self, Style::Band | Style::ErrorBars | Style::Beyond)
    }
}

impl Plot<'_> {
    /// The plot as the bytes of a PNG file.
    ///
    /// # Errors
    /// When there is no finite point and no range.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        Ok(self.drawing()?.png()?)
    }

    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// When there is no finite point and no range.
    pub fn svg(&self) -> Result<String, FigureError> {
        Ok(self.drawing()?.svg()?)
    }

    /// The plot as a page.
    ///
    /// # Errors
    /// When there is no finite point and no range.
    pub fn drawing(&self) -> Result<Drawing, FigureError> {
        let [x, y] = self.axes()?;
        let data = self.size(x.high - x.low, y.high - y.low);
        let mut axes = Axes::new([x, y], data, [self.title, self.subtitle], data[0]);
        let (legend, legend_height) = self.legend(axes.left, axes.top, data[0]);
        axes.top += legend_height;
        let mut shapes: Vec<Shape> =
            self.series.iter().flat_map(|series| series.shapes(&axes)).collect();
        shapes.extend(axes.shapes());
        shapes.extend(legend);
        Ok(Drawing {
            width_px: (axes.left + data[0] + MARGIN_PX).ceil(),
            height_px: (axes.top + axes.height_with_labels() + MARGIN_PX / 2.0).ceil(),
            shapes,
        })
    }

    /// The two axes, x first.
    pub(super) fn axes(&self) -> Result<[Axis<'_>; 2], FigureError> {
        let x = axis(self.x_label, self.x_range.or_else(|| self.x_span()))?;
        let y = axis(self.y_label, self.y_range.or_else(|| self.y_span()))?;
        Ok([x, y])
    }

    /// The range of x around the points; around the curves in a plot without points. None without finite values.
    pub fn x_span(&self) -> Option<(f64, f64)> {
        with_room(self.core(|p| p.0)?)
    }

    /// The range of y around the points, and around what the curves do between them, up to half as much again to either
    /// side: the tail of a curve squeezes nothing. Around the curves in a plot without points. None without finite values.
    pub fn y_span(&self) -> Option<(f64, f64)> {
        let (low, high) = self.core(|p| p.1)?;
        let x = self.x_range.or_else(|| self.x_span())?;
        let curves = self.series.iter().filter(|s| matches!(s.style, Style::Curve | Style::Beyond));
        let inside = curves.flat_map(|s| &s.points).filter(|p| p.0 >= x.0 && p.0 <= x.1);
        let most = 0.5 * (high - low);
        let mut span = (low, high);
        for level in inside.map(|p| p.1).filter(|level| level.is_finite()) {
            span = (span.0.min(level.max(low - most)), span.1.max(level.min(high + most)));
        }
        with_room(span)
    }

    /// Least and greatest of the finite values of the points; of the curves where the points have no extent.
    fn core(&self, of: fn(&(f64, f64)) -> f64) -> Option<(f64, f64)> {
        let kinds: [fn(Style) -> bool; 3] = [
            Style::is_data,
            |style| style.is_data() || style == Style::Curve,
            |style| !matches!(style, Style::Band | Style::Guide),
        ];
        let spans = kinds.map(|is_wanted| {
            let wanted = self.series.iter().filter(|s| is_wanted(s.style));
            let finite =
                wanted.flat_map(|s| &s.points).filter(|p| p.0.is_finite() && p.1.is_finite());
            let values = finite.map(of);
            Some((values.clone().reduce(f64::min)?, values.reduce(f64::max)?))
        });
        let found = spans.iter().flatten();
        found.clone().find(|(low, high)| low < high).or(found.last()).copied()
    }

    fn size(&self, width: f64, height: f64) -> [f32; 2] {
        if !self.equal {
            return [DATA_WIDTH_PX, DATA_HEIGHT_PX];
        }
        let scale = f64::from(EQUAL_SIDE_PX) / width.max(height);
        // A sliver still needs room for its ticks.
        [width, height].map(|side| ((side * scale) as f32).max(EQUAL_SIDE_PX / 4.0).round())
    }

    /// Names of the series in rows from this corner, between the heading and the data, and their height, px.
    fn legend(&self, left: f32, top: f32, width: f32) -> (Vec<Shape>, f32) {
        let row_px = LINE_SPACING * TICK_LABEL_PX;
        let (mut shapes, mut x, mut rows) = (Vec::new(), left, 0.0);
        let named = self.series.iter().filter(|s| !s.name.is_empty() && s.style.is_named());
        for series in named {
            let name_px = text_width_px(&series.name, TICK_LABEL_PX, Weight::Regular);
            let entry_px = SAMPLE_PX + GAP_PX + name_px;
            if rows == 0.0 || x + entry_px > left + width {
                (x, rows) = (left, rows + 1.0);
            }
            let y = top + (rows - 0.5) * row_px;
            let sample = match series.style {
                Style::Points | Style::Below | Style::Above => {
                    Trace::Marks(vec![(x + SAMPLE_PX / 2.0, y)])
                }
                _ => Trace::Lines(vec![vec![(x, y), (x + SAMPLE_PX, y)]]),
            };
            shapes.extend(series.style.paint(sample, series.colour(), POINT_PX));
            let base = (x + SAMPLE_PX + GAP_PX, y + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX);
            shapes.push(text(&series.name, base, Anchor::Start, TICK_LABEL_PX));
            x += entry_px + 2.0 * GAP_PX;
        }
        let below = if rows > 0.0 { GAP_PX } else { 0.0 };
        (shapes, (rows * row_px + below).round())
    }
}

/// An axis over a range.
fn axis(label: &str, range: Option<(f64, f64)>) -> Result<Axis<'_>, FigureError> {
    let (low, high) = range.unwrap_or((f64::NAN, f64::NAN));
    if low < high && (high - low).is_finite() {
        return Ok(Axis { label, low, high });
    }
    Err(FigureError::Range { low, high })
}

/// A little room at both ends, but none below 0 for what is not negative.
fn with_room((low, high): (f64, f64)) -> Option<(f64, f64)> {
    let room = if low < high { 0.04 * (high - low) } else { low.abs().max(1.0) };
    let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
    Some(((low - room).max(floor), high + room))
}

/// What of a series lies inside the axes, px.
pub(super) enum Trace {
    /// Lines, each through its points.
    Lines(Vec<Vec<Point>>),
    /// Corners of an area.
    Area(Vec<Point>),
    /// Places of marks.
    Marks(Vec<Point>),
}

impl Series {
    /// What of it lies inside the axes, px.
    pub(super) fn trace(&self, axes: &Axes) -> Trace {
        let (x, y) = (axes.x, axes.y);
        let at = |&(px, py): &(f64, f64)| axes.at(px, py);
        let visible = |&(px, py): &(f64, f64)| x.holds(px) && y.holds(py);
        match self.style {
            Style::Points | Style::Below | Style::Above => {
                Trace::Marks(self.points.iter().filter(|p| visible(p)).map(at).collect())
            }
            Style::Band => {
                let finite = self.points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
                let corners = finite
                    .map(|&(px, py)| axes.at(px.clamp(x.low, x.high), py.clamp(y.low, y.high)));
                Trace::Area(corners.collect())
            }
            Style::ErrorBars => {
                let bars = self
                    .points
                    .chunks_exact(2)
                    .filter(|bar| bar.iter().all(|&(px, py)| x.holds(px) && py.is_finite()));
                let ends = |&(px, py): &(f64, f64)| axes.at(px, py.clamp(y.low, y.high));
                Trace::Lines(bars.map(|bar| bar.iter().map(ends).collect()).collect())
            }
            Style::Curve | Style::Beyond | Style::Guide => {
                let runs = self.points.chunk_by(|a, b| visible(a) && visible(b));
                let on_page = runs.map(|run| run.iter().map(at).collect::<Vec<_>>());
                let lines = on_page.flat_map(|run| match self.style {
                    Style::Beyond => dashes(&run),
                    _ => vec![run],
                });
                Trace::Lines(lines.filter(|line| line.len() > 1).collect())
            }
        }
    }

    fn colour(&self) -> Rgb {
        if self.style == Style::Guide { GUIDE_INK } else { self.ink.colour() }
    }

    fn shapes(&self, axes: &Axes) -> Vec<Shape> {
        if self.points.len() > DENSE {
            // Paler, so that curves stand out of the cloud.
            return self.style.paint(self.trace(axes), self.colour().map(pale), DENSE_POINT_PX);
        }
        self.style.paint(self.trace(axes), self.colour(), POINT_PX)
    }
}

impl Style {
    /// The shapes of a trace in this style; `side` is that of a mark, px.
    fn paint(self, trace: Trace, colour: Rgb, side: f32) -> Vec<Shape> {
        let thickness_px = if self == Style::Guide { STROKE_PX } else { CURVE_PX };
        match trace {
            Trace::Lines(lines) => {
                let line = |points| Shape::Line { points, colour, thickness_px };
                lines.into_iter().map(line).collect()
            }
            Trace::Area(corners) if corners.len() > 2 => {
                vec![Shape::Area { corners, colour: colour.map(tint) }]
            }
            Trace::Area(_) => Vec::new(),
            Trace::Marks(places) => {
                let mark = |at| Shape::Area { corners: self.corners(at, side / 2.0), colour };
                places.into_iter().map(mark).collect()
            }
        }
    }

    /// Corners of the mark around a place.
    fn corners(self, (x, y): Point, half: f32) -> Vec<Point> {
        let [left, top, right, bottom] = [x - half, y - half, x + half, y + half];
        match self {
            Style::Below => vec![(left, top), (right, top), (x, bottom)],
            Style::Above => vec![(left, bottom), (right, bottom), (x, top)],
            _ => vec![(left, top), (right, top), (right, bottom), (left, bottom)],
        }
    }
}

/// Every other piece of a line, each as long as [`DASH_PX`] along it or from one point to the next one.
fn dashes(points: &[(f32, f32)]) -> Vec<Vec<(f32, f32)>> {
    let mut pieces = vec![Vec::new()];
    let (mut drawn_px, mut before) = (0.0, None);
    for &point in points {
        let step_px = before.map_or(0.0, |(x, y): (f32, f32)| (point.0 - x).hypot(point.1 - y));
        drawn_px += step_px;
        before = Some(point);
        if let Some(piece) = pieces.last_mut() {
            piece.push(point);
        }
        if drawn_px >= DASH_PX {
            pieces.push(vec![point]);
            drawn_px = 0.0;
        }
    }
    pieces.into_iter().step_by(2).collect()
}

/// A colour's channel on half the way to white.
fn pale(channel: u8) -> u8 {
    255 - (255 - channel) / 2
}

/// A colour's channel on most of the way to white.
fn tint(channel: u8) -> u8 {
    255 - (255 - channel) / 4
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: Vec<Series>) -> Plot<'static> {
        Plot {
            title: "Lobe",
            x_label: "incidence, °",
            y_label: "σ⁰, dB",
            series,
            ..Plot::default()
        }
    }

    fn parabola(style: Style) -> Series {
        let points = (0..50).map(|i| (f64::from(i), -f64::from(i).powi(2))).collect();
        Series { name: "parabola".into(), style, ink: Ink::Own(0), points }
    }

    #[test]
    fn curves_and_points_are_drawn_the_same_way_every_time() {
        let both = plot(vec![parabola(Style::Curve), parabola(Style::Points)]);
        let png = both.png().unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        assert_eq!(png, both.png().unwrap());
        assert!(both.svg().unwrap().contains("<svg"));
    }

    fn words(plot: &Plot) -> Vec<(String, (f32, f32))> {
        let shapes = plot.drawing().unwrap().shapes;
        let texts = shapes.into_iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some((text.text, text.at)),
            _ => None,
        });
        texts.collect()
    }

    #[test]
    fn a_band_leaves_the_axes_alone_and_has_no_name() {
        let far = vec![(0.0, -1e9), (49.0, -1e9), (49.0, 1e9), (0.0, 1e9)];
        let band = Series { points: far, ..parabola(Style::Band) };
        let alone = plot(vec![parabola(Style::Curve), parabola(Style::Below)]);
        let with = plot(vec![band, parabola(Style::Curve), parabola(Style::Below)]);
        let [without_band, with_band] = [&alone, &with].map(|plot| plot.drawing().unwrap());
        assert_eq!(with_band.shapes.len(), without_band.shapes.len() + 1);
        assert_eq!(with_band.shapes[1..], without_band.shapes[..]);
    }

    #[test]
    fn error_bars_widen_the_axes_and_a_guide_does_not() {
        let tall = Series { points: vec![(3.0, -1e4), (3.0, 1e4)], ..parabola(Style::ErrorBars) };
        let guide = Series { points: vec![(0.0, 0.0), (1e9, 0.0)], ..parabola(Style::Guide) };
        let all = plot(vec![guide, parabola(Style::Points)]);
        let with = plot(vec![parabola(Style::Points), tall]);
        assert!(all.y_span().unwrap().1 < 1e3 && with.y_span().unwrap().1 > 1e4);
        assert!(all.x_span().unwrap().1 < 60.0);
        assert_eq!(all.series[0].colour(), GUIDE_INK);
    }

    #[test]
    fn axes_fit_the_points_and_not_the_tail_of_a_curve() {
        let points = (10..=60).map(|deg| (f64::from(deg), -0.1 * f64::from(deg))).collect();
        let tail =
            (0..900).map(|step| 0.1 * f64::from(step)).map(|deg| (deg, 3.0 - 0.02 * deg * deg));
        let points = Series { points, ..parabola(Style::Points) };
        let curve = Series { points: tail.collect(), ..parabola(Style::Curve) };
        let both = plot(vec![points, curve.clone()]);
        assert_eq!(both.x_span(), Some((8.0, 62.0)));
        // From −6 to −1, and half of that to both sides.
        let (low, high) = both.y_span().unwrap();
        assert!((-9.0..=-8.5).contains(&low) && (1.3..=2.0).contains(&high), "{low} to {high}");
        assert!(
            plot(vec![curve]).y_span().unwrap().0 < -150.0,
            "without points there is the curve"
        );
        let few =
            plot(vec![Series { points: vec![(0.0, 1.0), (70.0, 2.0)], ..parabola(Style::Points) }]);
        assert_eq!(few.x_span().unwrap().0, 0.0, "no angle is below 0");
    }

    #[test]
    fn each_axis_has_four_ticks_wherever_it_ends() {
        for high in (10..500).map(|step| f64::from(step) / 50.0) {
            let ranges =
                Plot { x_range: Some((0.0, high)), y_range: Some((-high, 0.3)), ..plot(vec![]) };
            let names = words(&ranges);
            let places = |of: fn(&(f32, f32)) -> f32| {
                let numbers =
                    names.iter().filter(|(text, _)| text.replace('−', "-").parse::<f64>().is_ok());
                let mut places: Vec<f32> = numbers.map(|(_, at)| of(at)).collect();
                places.sort_by(f32::total_cmp);
                places
            };
            // Numbers below the axis share their height, and those beside it their place.
            for mut places in [places(|at| at.0), places(|at| at.1)] {
                let all = places.len();
                places.dedup();
                assert!(places.len() > 4 && all - places.len() >= 3, "to {high}: {names:?}");
            }
        }
    }

    #[test]
    fn dashes_have_no_name_and_as_much_gap_as_line() {
        let with = plot(vec![parabola(Style::Beyond), parabola(Style::Curve)]);
        assert_eq!(words(&with).iter().filter(|(text, _)| text == "parabola").count(), 1);
        let line: Vec<(f32, f32)> = (0..=700_u16).map(|x| (f32::from(x), 0.0)).collect();
        let dashes = dashes(&line);
        let drawn_px: f32 = dashes.iter().map(|d| d.last().unwrap().0 - d[0].0).sum();
        assert_eq!((dashes.len(), drawn_px), (51, 350.0));
    }

    #[test]
    fn the_legend_stands_above_the_data_in_rows_that_fit() {
        let named = |name: &str| Series { name: name.to_owned(), ..parabola(Style::Points) };
        for count in [1, 3, 12] {
            let names: Vec<String> =
                (0..count).map(|i| format!("a curve of some name, {i}")).collect();
            let plot = plot(names.iter().map(|name| named(name)).collect());
            let page = plot.drawing().unwrap();
            let frame = page.shapes.iter().find_map(|shape| match shape {
                Shape::Line { points, .. } if points.len() == 5 => Some(points[0]),
                _ => None,
            });
            let (left, top) = frame.unwrap();
            for (text, at) in words(&plot).iter().filter(|(text, _)| names.contains(text)) {
                let right = at.0 + text_width_px(text, TICK_LABEL_PX, Weight::Regular);
                assert!(
                    at.1 < top && at.0 > left && right <= left + DATA_WIDTH_PX + 2.0,
                    "{text}: {at:?}"
                );
            }
            assert!(page.height_px > top + DATA_HEIGHT_PX);
        }
    }

    #[test]
    fn a_gap_interrupts_a_curve() {
        let gap = (25.0, f64::NAN);
        let mut series = parabola(Style::Curve);
        let whole = plot(vec![series.clone()]).drawing().unwrap().shapes.len();
        series.points[25] = gap;
        assert_eq!(plot(vec![series]).drawing().unwrap().shapes.len(), whole + 1);
    }

    #[test]
    fn a_map_keeps_its_proportions() {
        let map = Plot { equal: true, ..plot(vec![]) };
        assert_eq!(map.size(0.5, 0.9), [500.0, 900.0]);
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        assert!(plot(vec![]).png().is_err());
        let nan = Series { points: vec![(f64::NAN, 1.0)], ..parabola(Style::Points) };
        assert!(plot(vec![nan]).png().is_err());
    }
}
