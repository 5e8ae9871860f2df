//! Drawings that take their colours from the page's style, light or dark, and say in words what they
//! show.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::formats::figure::ticks::ticks;
use crate::formats::html::clean;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 64.0;

/// Points of one series from which on they are drawn small.
const MANY: usize = 400;

/// A plot over the angle of incidence.
pub(super) struct Plot<'a> {
    /// Tells the parts of one drawing on a page from those of another.
    pub(super) id: String,
    /// What is drawn.
    pub(super) title: String,
    /// The same in a sentence or two, for those who do not see it.
    pub(super) description: String,
    /// Quantity and unit upwards.
    pub(super) y_label: &'a str,
    /// Range of angles that is claimed, °; what lies outside is shaded.
    pub(super) claimed_deg: [f64; 2],
    /// What is drawn, the first lowest.
    pub(super) series: Vec<Series>,
}

/// Points that belong together, (°, dB).
pub(super) struct Series {
    /// How they are drawn.
    pub(super) shape: Shape,
    /// Classes of the style: ink and kind.
    pub(super) class: String,
    /// Where they are.
    pub(super) points: Vec<(f64, f64)>,
}

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// A line.
    Line,
    /// The area that the points go round.
    Band,
    /// A round point each.
    Dots,
    /// A triangle that points down: the truth is below.
    Below,
    /// A triangle that points up.
    Above,
}

impl Plot<'_> {
    /// The drawing; none when there is nothing finite to draw.
    pub(super) fn svg(&self) -> Option<String> {
        let y = self.y_range()?;
        let frame = Frame { y };
        let (id, title) = (&self.id, escaped(&self.title));
        let mut svg = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
             aria-labelledby=\"{id}-title {id}-text\"><title id=\"{id}-title\">{title}</title>\
             <desc id=\"{id}-text\">{}</desc>",
            escaped(&self.description)
        );
        svg += &frame.paper(self.claimed_deg, self.y_label);
        for series in &self.series {
            svg += &frame.series(series);
        }
        Some(svg + "</svg>")
    }

    /// Of everything but bands, which may reach far.
    fn y_range(&self) -> Option<[f64; 2]> {
        let own = self.series.iter().filter(|series| series.shape != Shape::Band);
        let levels = || own.clone().flat_map(|s| &s.points).map(|p| p.1).filter(|y| y.is_finite());
        let [low, high] = [levels().reduce(f64::min)?, levels().reduce(f64::max)?];
        let room = (0.06 * (high - low)).max(1.0);
        Some([low - room, high + room])
    }
}

/// The paper of a plot and the way from values to it.
struct Frame {
    y: [f64; 2],
}

impl Frame {
    fn at(&self, (theta_deg, level_db): (f64, f64)) -> (f64, f64) {
        let [low, high] = self.y;
        let up = ((level_db - low) / (high - low)).clamp(0.0, 1.0);
        (
            LEFT + theta_deg.clamp(0.0, 90.0) / 90.0 * (WIDTH - LEFT - RIGHT),
            HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM),
        )
    }

    fn paper(&self, claimed_deg: [f64; 2], y_label: &str) -> String {
        let (top, bottom) = (TOP, HEIGHT - BOTTOM);
        let x_at = |deg: f64| self.at((deg, 0.0)).0;
        let mut svg = String::new();
        let mut put = |text: std::fmt::Arguments| {
            // Writing to a string cannot fail.
            let _ = svg.write_fmt(text);
        };
        for [from, to] in [[0.0, claimed_deg[0]], [claimed_deg[1], 90.0]] {
            if to > from {
                let (x, width) = (x_at(from), x_at(to) - x_at(from));
                let height = bottom - top;
                put(format_args!(
                    "<rect class=\"unclaimed\" x=\"{x:.1}\" y=\"{top}\" width=\"{width:.1}\" \
                     height=\"{height}\"/>"
                ));
            }
        }
        for tick in ticks(self.y[0], self.y[1], 7) {
            let y = self.at((0.0, tick.value)).1;
            let class = if tick.value == 0.0 { "grid zero" } else { "grid" };
            let (end, beside, base) = (WIDTH - RIGHT, LEFT - 9.0, y + 6.0);
            put(format_args!(
                "<path class=\"{class}\" d=\"M{LEFT} {y:.1}H{end}\"/>\
                 <text class=\"tick\" x=\"{beside}\" y=\"{base:.1}\" text-anchor=\"end\">{}</text>",
                tick.label
            ));
        }
        for deg in (0..=90u32).step_by(15) {
            let (x, below) = (x_at(f64::from(deg)), bottom + 26.0);
            put(format_args!(
                "<path class=\"grid\" d=\"M{x:.1} {top}V{bottom}\"/>\
                 <text class=\"tick\" x=\"{x:.1}\" y=\"{below}\" text-anchor=\"middle\">{deg}</text>"
            ));
        }
        let (middle, low) = ((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 10.0);
        put(format_args!(
            "<text class=\"label\" x=\"{middle}\" y=\"{low}\" text-anchor=\"middle\">angle of incidence, \
             °</text><text class=\"label\" x=\"9\" y=\"26\">{y_label}</text>"
        ));
        svg
    }

    fn series(&self, series: &Series) -> String {
        let points = series.points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
        let places = points.map(|point| self.at(*point));
        let (name, path) = match series.shape {
            Shape::Line => ("line", through(places)),
            Shape::Band => ("band", through(places) + "Z"),
            Shape::Dots => ("dots", marks(places, |x, y| format!("M{x} {y}h0"))),
            Shape::Below => ("mark", marks(places, |x, y| format!("M{x} {y}m-4-3h8l-4 7z"))),
            Shape::Above => ("mark", marks(places, |x, y| format!("M{x} {y}m-4 3h8l-4-7z"))),
        };
        let many = if series.points.len() > MANY { " many" } else { "" };
        let empty = path.len() < 2;
        if empty {
            String::new()
        } else {
            format!("<path class=\"{name}{many} {}\" d=\"{path}\"/>", series.class)
        }
    }
}

fn through(places: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (number, (x, y)) in places.enumerate() {
        let step = if number == 0 { 'M' } else { 'L' };
        let _ = write!(path, "{step}{x:.1} {y:.1}");
    }
    path
}

/// Marks on the nearest pixels, each once: thousands of points cost no more than the paper is wide.
fn marks(places: impl Iterator<Item = (f64, f64)>, mark: fn(i64, i64) -> String) -> String {
    let pixels: BTreeSet<(i64, i64)> =
        places.map(|(x, y)| (x.round() as i64, y.round() as i64)).collect();
    pixels.into_iter().map(|(x, y)| mark(x, y)).collect()
}

/// Text inside a drawing.
fn escaped(text: &str) -> String {
    let mut svg = String::new();
    for letter in clean(text).chars() {
        match letter {
            '&' => svg.push_str("&amp;"),
            '<' => svg.push_str("&lt;"),
            '>' => svg.push_str("&gt;"),
            other => svg.push(other),
        }
    }
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot<'static> {
        let series = Series { shape: Shape::Dots, class: "ink0".to_owned(), points };
        Plot {
            id: "a".to_owned(),
            title: "<b>".to_owned(),
            description: "x & y".to_owned(),
            y_label: "dB",
            claimed_deg: [0.0, 80.0],
            series: vec![series],
        }
    }

    #[test]
    fn a_drawing_says_what_it_shows_and_shades_what_is_not_claimed() {
        let svg = plot(vec![(0.0, 1.0), (10.0, f64::NAN)]).svg().unwrap();
        assert!(svg.contains("&lt;b>") || svg.contains("&lt;b&gt;"), "{svg}");
        assert!(svg.contains("x &amp; y") && svg.contains("unclaimed"), "{svg}");
        assert!(plot(vec![(0.0, f64::NAN)]).svg().is_none());
    }

    #[test]
    fn many_points_cost_no_more_than_the_paper_holds() {
        let level = |i: u32| (f64::from(i % 90), f64::from(i % 7));
        let svg = plot((0..100_000).map(level).collect()).svg().unwrap();
        assert!(svg.len() < 20_000, "{}", svg.len());
    }
}
