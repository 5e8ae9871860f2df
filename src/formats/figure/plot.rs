//! Curves and points over two axes.

use super::axes::{Axes, Axis};
use super::drawing::{Anchor, Drawing, Point, Rgb, Shape, Weight, text_width_px};
use super::error::FigureError;
use super::style::{DIGIT_HEIGHT, GAP_PX, MARGIN_PX, PALETTE, STROKE_PX, TICK_LABEL_PX, text};

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
    /// Values at the ends of x; those of the data if `None`.
    pub x_range: Option<(f64, f64)>,
    /// Values at the ends of y; those of the data if `None`.
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
    /// The area that the points go round, in a tint of the colour of the other series of its name.
    /// It is not in the legend, takes no colour and does not widen the axes.
    Band,
    /// Upright bars, each from one point to the next one, in the colour of the other series of its
    /// name. They are not in the legend and take no colour.
    ErrorBars,
    /// Dashes through the points in the colour of the other series of its name: a curve outside the range for
    /// which it is claimed. It is not in the legend and takes no colour.
    Beyond,
    /// A thin grey line to judge data by, such as zero. It takes no colour and does not widen the axes.
    Guide,
}

impl Style {
    /// Whether a series of this style has a colour of the palette for itself.
    fn has_a_colour(self) -> bool {
        !matches!(self, Style::Band | Style::ErrorBars | Style::Beyond | Style::Guide)
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
        let axes = Axes::new([x, y], data, [self.title, self.subtitle], data[0]);
        let mut shapes: Vec<Shape> = std::iter::zip(&self.series, self.colours())
            .flat_map(|(series, colour)| series.shapes(&axes, colour))
            .collect();
        shapes.extend(axes.shapes());
        shapes.extend(self.legend(&axes));
        Ok(Drawing {
            width_px: (axes.left + data[0] + MARGIN_PX).ceil(),
            height_px: (axes.top + axes.height_with_labels() + MARGIN_PX / 2.0).ceil(),
            shapes,
        })
    }

    /// The two axes, x first.
    pub(super) fn axes(&self) -> Result<[Axis<'_>; 2], FigureError> {
        let x = Axis { label: self.x_label, ..self.axis(self.x_range, |p| p.0)? };
        let y = Axis { label: self.y_label, ..self.axis(self.y_range, |p| p.1)? };
        Ok([x, y])
    }

    /// One colour per series; bands, error bars and dashes have that of the other series of their name.
    fn colours(&self) -> Vec<Rgb> {
        let own: Vec<&Series> = self.series.iter().filter(|s| s.style.has_a_colour()).collect();
        let mut colours = Vec::with_capacity(self.series.len());
        for series in &self.series {
            let place = if series.style.has_a_colour() {
                own.iter().position(|other| std::ptr::eq(*other, series))
            } else {
                own.iter().position(|other| other.name == series.name)
            };
            colours.push(match series.style {
                Style::Guide => GUIDE_INK,
                _ => PALETTE[place.unwrap_or(0) % PALETTE.len()],
            });
        }
        colours
    }

    /// The given range, or one that holds all finite values with a little room.
    fn axis(
        &self,
        range: Option<(f64, f64)>,
        of: fn(&(f64, f64)) -> f64,
    ) -> Result<Axis<'static>, FigureError> {
        let (low, high) = range.or_else(|| self.span(of)).unwrap_or((f64::NAN, f64::NAN));
        if low < high && (high - low).is_finite() {
            return Ok(Axis { label: "", low, high });
        }
        Err(FigureError::Range { low, high })
    }

    /// A range around all finite values of the data; none where there are none.
    fn span(&self, of: fn(&(f64, f64)) -> f64) -> Option<(f64, f64)> {
        let data = self.series.iter().filter(|s| !matches!(s.style, Style::Band | Style::Guide));
        let values = data.flat_map(|s| &s.points).map(of).filter(|value| value.is_finite());
        let (low, high) = (values.clone().reduce(f64::min)?, values.reduce(f64::max)?);
        let room = if low < high { 0.04 * (high - low) } else { low.abs().max(1.0) };
        Some((low - room, high + room))
    }

    fn size(&self, width: f64, height: f64) -> [f32; 2] {
        if !self.equal {
            return [DATA_WIDTH_PX, DATA_HEIGHT_PX];
        }
        let scale = f64::from(EQUAL_SIDE_PX) / width.max(height);
        // A sliver still needs room for its ticks.
        [width, height].map(|side| ((side * scale) as f32).max(EQUAL_SIDE_PX / 4.0).round())
    }

    /// Names of the series in the corner that hides the least: the upper right one if it hides nothing.
    fn legend(&self, axes: &Axes) -> Vec<Shape> {
        let named: Vec<(&Series, Rgb)> = std::iter::zip(&self.series, self.colours())
            .filter(|(series, _)| {
                !series.name.is_empty()
                    && (series.style.has_a_colour() || series.style == Style::Guide)
            })
            .collect();
        let row_px = 1.4 * TICK_LABEL_PX;
        let widest = named
            .iter()
            .map(|(series, _)| text_width_px(&series.name, TICK_LABEL_PX, Weight::Regular))
            .fold(0.0, f32::max);
        let size = (widest + SAMPLE_PX + 3.0 * GAP_PX, row_px * named.len() as f32 + 2.0 * GAP_PX);
        let (left, top) = self.emptiest_corner(axes, size);
        let left = left + GAP_PX;
        let mut shapes = Vec::new();
        for (row, (series, colour)) in named.into_iter().enumerate() {
            let y = top + GAP_PX + (row as f32 + 0.6) * row_px;
            let sample = match series.style {
                Style::Points | Style::Below | Style::Above => {
                    Trace::Marks(vec![(left + SAMPLE_PX / 2.0, y)])
                }
                _ => Trace::Lines(vec![vec![(left, y), (left + SAMPLE_PX, y)]]),
            };
            shapes.extend(series.style.paint(sample, colour, POINT_PX));
            let base = (left + SAMPLE_PX + GAP_PX, y + DIGIT_HEIGHT / 2.0 * TICK_LABEL_PX);
            shapes.push(text(&series.name, base, Anchor::Start, TICK_LABEL_PX));
        }
        shapes
    }
}

impl Plot<'_> {
    /// Upper left point of a box of this size in the corner of the data area with the fewest points.
    fn emptiest_corner(&self, axes: &Axes, (width, height): (f32, f32)) -> (f32, f32) {
        let data = self.series.iter().filter(|series| series.style.has_a_colour());
        let points: Vec<(f32, f32)> =
            data.flat_map(|series| &series.points).map(|&(x, y)| axes.at(x, y)).collect();
        let right = axes.left + axes.data_width - width;
        let bottom = axes.top + axes.data_height - height;
        let corners =
            [(right, axes.top), (axes.left, axes.top), (right, bottom), (axes.left, bottom)];
        let emptiest = corners.into_iter().min_by_key(|&(left, top)| {
            let (columns, rows) = (left..=left + width, top..=top + height);
            points.iter().filter(|(x, y)| columns.contains(x) && rows.contains(y)).count()
        });
        emptiest.unwrap_or(corners[0])
    }
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

    fn shapes(&self, axes: &Axes, colour: Rgb) -> Vec<Shape> {
        let side = if self.points.len() > DENSE { DENSE_POINT_PX } else { POINT_PX };
        self.style.paint(self.trace(axes), colour, side)
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

/// A colour's channel on the way to white.
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
        Series { name: "parabola".into(), style, points }
    }

    #[test]
    fn curves_and_points_are_drawn_the_same_way_every_time() {
        let both = plot(vec![parabola(Style::Curve), parabola(Style::Points)]);
        let png = both.png().unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        assert_eq!(png, both.png().unwrap());
        assert!(both.svg().unwrap().contains("<svg"));
    }

    #[test]
    fn a_band_has_the_colour_of_its_curve_and_leaves_the_axes_alone() {
        let far = vec![(0.0, -1e9), (49.0, -1e9), (49.0, 1e9), (0.0, 1e9)];
        let band = Series { name: "parabola".into(), style: Style::Band, points: far };
        let alone = plot(vec![parabola(Style::Curve), parabola(Style::Below)]);
        let with = plot(vec![band, parabola(Style::Curve), parabola(Style::Below)]);
        let [without_band, with_band] = [&alone, &with].map(|plot| plot.drawing().unwrap());
        assert_eq!(with_band.shapes.len(), without_band.shapes.len() + 1);
        assert_eq!(with_band.shapes[1..], without_band.shapes[..]);
        assert_eq!(with.colours(), [PALETTE[0], PALETTE[0], PALETTE[1]]);
    }

    #[test]
    fn error_bars_have_the_colour_of_their_points_and_widen_the_axes() {
        let bars: Vec<(f64, f64)> = (0..50).flat_map(|i| [(f64::from(i), 0.0); 2]).collect();
        let bars = Series { name: "parabola".into(), style: Style::ErrorBars, points: bars };
        let tall = Series { points: vec![(3.0, -1e4), (3.0, 1e4)], ..bars.clone() };
        let zero = vec![(0.0, 0.0), (1e9, 0.0)];
        let guide = Series { name: String::new(), style: Style::Guide, points: zero };
        let other = Series { name: "other".into(), ..parabola(Style::Points) };
        let all = plot(vec![guide, parabola(Style::Points), bars, other]);
        assert_eq!(all.colours(), [GUIDE_INK, PALETTE[0], PALETTE[0], PALETTE[1]]);
        let y = |plot: &Plot| plot.axis(None, |p| p.1).unwrap().high;
        let with = plot(vec![parabola(Style::Points), tall]);
        assert!(y(&all) < 1e3 && y(&with) > 1e4);
        assert!(all.axis(None, |p| p.0).unwrap().high < 60.0, "a guide widens nothing");
        let lines = |plot: &Plot| {
            let shapes = plot.drawing().unwrap().shapes;
            let is_bar =
                |s: &&Shape| matches!(s, Shape::Line { colour, .. } if *colour == PALETTE[0]);
            shapes.iter().filter(is_bar).count()
        };
        assert_eq!(lines(&all), 50);
    }

    #[test]
    fn dashes_have_the_colour_of_their_curve_no_name_and_as_much_gap_as_line() {
        let beyond = Series { style: Style::Beyond, ..parabola(Style::Curve) };
        let with = plot(vec![beyond, parabola(Style::Curve)]);
        assert_eq!(with.colours(), [PALETTE[0], PALETTE[0]]);
        let names = |plot: &Plot| {
            let shapes = plot.drawing().unwrap().shapes;
            shapes.iter().filter(|s| matches!(s, Shape::Text(t) if t.text == "parabola")).count()
        };
        assert_eq!(names(&with), 1);
        let line: Vec<(f32, f32)> = (0..=700_u16).map(|x| (f32::from(x), 0.0)).collect();
        let dashes = dashes(&line);
        let drawn_px: f32 = dashes.iter().map(|d| d.last().unwrap().0 - d[0].0).sum();
        assert_eq!((dashes.len(), drawn_px), (51, 350.0));
    }

    #[test]
    fn the_legend_goes_where_it_hides_nothing() {
        let line = |slope: f64| {
            let points = (0..100).map(|i| (f64::from(i), slope * f64::from(i))).collect();
            plot(vec![Series { name: "line".into(), style: Style::Points, points }])
        };
        let name_at = |plot: &Plot| {
            let shapes = plot.drawing().unwrap().shapes;
            let name = shapes.iter().find_map(|shape| match shape {
                Shape::Text(text) if text.text == "line" => Some(text.at),
                _ => None,
            });
            name.unwrap()
        };
        let [rising, falling] = [1.0, -1.0].map(|slope| name_at(&line(slope)));
        assert!(rising.0 < 400.0 && falling.0 > 400.0, "{rising:?} {falling:?}");
        assert_eq!(rising.1, falling.1);
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
