//! A plot as part of a web page.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::axes::Axes;
use super::drawing::Point;
use super::error::FigureError;
use super::plot::{Plot, Style, Trace};
use crate::formats::xml::escaped;

const WIDTH: f32 = 720.0;
const HEIGHT: f32 = 420.0;
const LEFT: f32 = 84.0;
const RIGHT: f32 = WIDTH - 18.0;
const TOP: f32 = 44.0;
const BOTTOM: f32 = HEIGHT - 64.0;

/// About how many ticks the axes have.
const TICKS: [usize; 2] = [9, 7];

/// A series of more points than this is drawn small.
const MANY: usize = 400;

/// What a web page adds to a plot.
#[derive(Clone, Debug)]
pub struct Inline<'a> {
    /// Start of the element ids; no other plot of the page has it.
    pub id: &'a str,
    /// The plot in a sentence or two, for readers who do not see it.
    pub description: &'a str,
    /// The range of x for which the data are claimed; what lies outside it is shaded.
    pub claimed: (f64, f64),
    /// Classes of each series, in the order of the plot's series.
    pub classes: &'a [String],
}

impl Plot<'_> {
    /// The plot as an SVG element of a web page: the page's style sheet gives the colours, light or dark,
    /// and its fonts write the text.
    ///
    /// The title is the element's accessible name. The subtitle and the legend are left to the page. The
    /// For scripts, `data-x` holds the values at the ends of x and where those stand, `data-y` the same of y, and the
    /// `data-name` of a path the name of its series. The
    /// style sheet finds the classes `plot`, `unclaimed`, `grid` and `zero`, the texts `tick` and `label`,
    /// and for a series `line`, `band`, `dots` or `mark`, with `many` where it has many points, together
    /// with [`Inline::classes`].
    ///
    /// # Errors
    /// When there is no finite point and no range.
    pub fn inline_svg(&self, page: &Inline) -> Result<String, FigureError> {
        let area = [LEFT, TOP, RIGHT - LEFT, BOTTOM - TOP];
        let axes = Axes::bare(self.axes()?, area, TICKS);
        let id = page.id;
        let mut svg = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" data-x=\"{} {} {LEFT} {RIGHT}\" \
             data-y=\"{} {} {BOTTOM} {TOP}\" role=\"img\" aria-labelledby=\"{id}-title {id}-text\"><title id=\"{id}-title\">{}</title>\
             <desc id=\"{id}-text\">{}</desc>",
            axes.x.low,
            axes.x.high,
            axes.y.low,
            axes.y.high,
            escaped(self.title),
            escaped(page.description)
        );
        svg += &unclaimed(&axes, page.claimed);
        svg += &grid(&axes);
        let classes = page.classes.iter().map(String::as_str).chain(std::iter::repeat(""));
        for (series, class) in self.series.iter().zip(classes) {
            let many = if series.points.len() > MANY { " many" } else { "" };
            let (shape, path) = path(series.style, &series.trace(&axes));
            if path.is_empty() {
                continue;
            }
            svg += &format!("<path class=\"{shape}{many} {class}\"");
            if !series.name.is_empty() {
                svg += &format!(" data-name=\"{}\"", escaped(&series.name));
            }
            svg += &format!(" d=\"{path}\"/>");
        }
        Ok(svg + "</svg>")
    }
}

/// Shades what lies outside the claimed range of x.
fn unclaimed(axes: &Axes, (low, high): (f64, f64)) -> String {
    let [low, high] = [low, high].map(|x| axes.at(x, 0.0).0.clamp(LEFT, RIGHT));
    let mut svg = String::new();
    for (from, to) in [(LEFT, low), (high, RIGHT)] {
        if to > from {
            let path = format!("M{from:.1} {TOP}H{to:.1}V{BOTTOM}H{from:.1}Z");
            svg += &format!("<path class=\"unclaimed\" d=\"{path}\"/>");
        }
    }
    svg
}

/// A line across the data at every tick, the numbers beside them, and what the axes show.
fn grid(axes: &Axes) -> String {
    let mut svg = String::new();
    for tick in &axes.x_ticks {
        let x = axes.at(tick.value, 0.0).0;
        svg += &format!("<path class=\"grid\" d=\"M{x:.1} {TOP}V{BOTTOM}\"/>");
        svg += &text("tick", (x, BOTTOM + 26.0), "middle", &tick.label);
    }
    for tick in &axes.y_ticks {
        let y = axes.at(0.0, tick.value).1;
        let class = if tick.value == 0.0 { "grid zero" } else { "grid" };
        svg += &format!("<path class=\"{class}\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
        svg += &text("tick", (LEFT - 9.0, y + 6.0), "end", &tick.label);
    }
    svg += &text("label", ((LEFT + RIGHT) / 2.0, HEIGHT - 10.0), "middle", axes.x.label);
    svg + &text("label", (9.0, 26.0), "start", axes.y.label)
}

fn text(class: &str, (x, y): Point, anchor: &str, text: &str) -> String {
    let text = escaped(text);
    format!(
        "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
    )
}

/// The class and the path of a series; the path is empty where nothing of it is on the page.
fn path(style: Style, trace: &Trace) -> (&'static str, String) {
    match trace {
        Trace::Lines(lines) => ("line", lines.iter().map(|line| through(line)).collect()),
        Trace::Area(corners) => ("band", through(corners) + "Z"),
        Trace::Marks(places) => match style {
            Style::Below => ("mark", marks(places, "m-4-3h8l-4 7z")),
            Style::Above => ("mark", marks(places, "m-4 3h8l-4-7z")),
            // Of no length: the style sheet gives its width and its round or square end.
            _ => ("dots", marks(places, "h0")),
        },
    }
}

fn through(points: &[Point]) -> String {
    let mut path = String::new();
    for (number, (x, y)) in points.iter().enumerate() {
        let step = if number == 0 { 'M' } else { 'L' };
        let _ = write!(path, "{step}{x:.1} {y:.1}");
    }
    path
}

/// Marks, each once. Many are put on the nearest pixels: they then cost no more than the page is wide.
fn marks(places: &[Point], mark: &str) -> String {
    let parts = if places.len() > MANY { 1.0 } else { 10.0 };
    let places: BTreeSet<(i32, i32)> = places
        .iter()
        .map(|(x, y)| ((x * parts).round() as i32, (y * parts).round() as i32))
        .collect();
    let mut path = String::new();
    for (x, y) in places {
        let [x, y] = [x, y].map(|part| f64::from(part) / f64::from(parts));
        let _ = write!(path, "M{x} {y}{mark}");
    }
    path
}

#[cfg(test)]
mod tests {
    use super::super::{Ink, Series};
    use super::*;

    fn svg(style: Style, points: Vec<(f64, f64)>) -> Result<String, FigureError> {
        let plot = Plot {
            title: "<b>",
            x_label: "incidence, °",
            y_label: "σ⁰, dB",
            x_range: Some((0.0, 90.0)),
            series: vec![Series { name: String::new(), style, ink: Ink::Own(0), points }],
            ..Plot::default()
        };
        let classes = ["ink0 is-measured".to_owned()];
        let (description, claimed) = ("x & y\u{1b}", (0.0, 80.0));
        plot.inline_svg(&Inline { id: "a", description, claimed, classes: &classes })
    }

    #[test]
    fn a_drawing_says_what_it_shows_and_shades_what_is_not_claimed() {
        let svg = svg(Style::Points, vec![(0.0, 1.0), (10.0, f64::NAN)]).unwrap();
        let parts = [
            "<title id=\"a-title\">&lt;b&gt;</title>",
            "<desc id=\"a-text\">x &amp; y </desc>",
            "text-anchor=\"start\">σ⁰, dB</text>",
            "<path class=\"dots ink0 is-measured\" d=\"M84 200h0\"/>",
        ];
        for part in parts {
            assert!(svg.contains(part), "{part}: {svg}");
        }
        assert_eq!(svg.matches("unclaimed").count(), 1, "{svg}");
        assert!(!svg.contains("style=") && !svg.contains("fill=") && !svg.contains('#'), "{svg}");
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        assert!(svg(Style::Points, vec![(0.0, f64::NAN)]).is_err());
    }

    #[test]
    fn many_points_cost_no_more_than_the_page_holds() {
        let points = (0..100_000).map(|i| (f64::from(i % 90), f64::from(i % 7))).collect();
        let svg = svg(Style::Above, points).unwrap();
        assert!(svg.contains("mark many ink0") && svg.len() < 20_000, "{}", svg.len());
    }
}
