//! Residuals over the target plane, before and after.

use std::f64::consts::TAU;

use super::{Picture, shown};
use crate::cli::diagnose::words::signed;
use crate::diagnose::{Found, Report, Row};
use crate::effects::Place;
use crate::formats::figure::drawing::{Drawing, Shape};
use crate::formats::figure::{Figure, FigureError, Scale};
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::radar::scan::PATTERN_RANGE_M;

/// Looks in a pixel, in the mean, from which speckle does not hide the rest.
const LOOKS_PER_PIXEL: f64 = 8.0;
/// Colours reach as far as this share of the pixels where speckle is among them.
const MOST: f64 = 0.98;
/// The same where nothing is: few pixels may be all that there is.
const NEARLY_ALL: f64 = 0.999;

/// What a map shows.
struct Subject {
    file: &'static str,
    title: &'static str,
    quantity: &'static str,
    gaps: &'static str,
    /// Shortest and longest reach of the colours.
    reach: [f64; 2],
    /// Share of the pixels within that reach.
    share: f64,
    caption: &'static str,
}

/// What one of two maps shows of a look, and the line under its title.
type Panel<'a> = (&'a dyn Fn(&Row) -> Option<f64>, String);

/// Observed − predicted, dB, of what was detected.
pub(super) fn residuals(report: &Report, spot_m: f64) -> Result<Picture, FigureError> {
    let subject = Subject {
        file: "residual-map",
        title: "Residual over the target",
        quantity: "observed − predicted, dB",
        gaps: "no detection",
        reach: [0.5, 10.0],
        share: MOST,
        caption: "Observed − predicted power over the target plane, averaged over the detections \
                  of each pixel. Red is more power than predicted, blue less. A model that is right leaves speckle without shape.",
    };
    let residual = |predicted: fn(&Row) -> f64| {
        move |row: &Row| row.observed_dbm.map(|observed| observed - predicted(row))
    };
    let [before, after] = [&report.error.before, &report.error.after]
        .map(|e| format!("rmse {:.2} dB, mean {} dB", e.rmse_db, signed(e.bias_db, 2)));
    let before = (&residual(|row| row.before_dbm) as &dyn Fn(&Row) -> Option<f64>, before);
    let after = (&residual(|row| row.after_dbm) as &dyn Fn(&Row) -> Option<f64>, after);
    maps(&subject, report, spot_m, &before_after(report, [before, after]))
}

/// Mean quantile residual, which chirps that saw nothing have, too.
pub(super) fn quantiles(report: &Report, spot_m: f64) -> Result<Picture, FigureError> {
    let subject = Subject {
        file: "quantile-map",
        title: "Quantile residual over the target",
        quantity: "mean z, standard deviations",
        gaps: "no chirp",
        reach: [0.5, 3.0],
        share: MOST,
        caption: "Mean quantile residual z over the target plane. It counts the chirps that hit the \
                  target and saw nothing, too: z is standard normal if the model is right, and blue \
                  where less comes back than the model says.",
    };
    let size = |pick: fn(&Row) -> f64| {
        let rows = &report.rows;
        let mean = rows.iter().map(pick).sum::<f64>() / rows.len().max(1) as f64;
        let squares = rows.iter().map(|row| pick(row).powi(2)).sum::<f64>();
        let rms = (squares / rows.len().max(1) as f64).sqrt();
        format!("of all chirps: rms {rms:.2}, mean {}", signed(mean, 2))
    };
    let (before, after) = (|row: &Row| row.z_before, |row: &Row| row.z_after);
    let panels: [Panel; 2] =
        [(&|row| Some(row.z_before), size(before)), (&|row| Some(row.z_after), size(after))];
    maps(&subject, report, spot_m, &before_after(report, panels))
}

/// The smooth term that the final model lacks; nothing where there is none.
pub(super) fn unknown(report: &Report, spot_m: f64) -> Result<Picture, FigureError> {
    let subject = Subject {
        file: "unknown-map",
        title: "What is unknown, over the target",
        quantity: "power that the model lacks, dB",
        gaps: "no chirp",
        reach: [0.5, 20.0],
        share: NEARLY_ALL,
        caption: "What a smooth term over all covariates would add to the model's mean power, averaged \
                  over the chirps of each pixel. It has no name: no effect in the library does this to the data. Small rings stand \
                  where it is strongest.",
    };
    if report.rows.iter().all(|row| row.unknown_db == 0.0) {
        let Subject { file, title, .. } = subject;
        let caption = String::new();
        return Ok(Picture { file, title, caption, panels: Vec::new(), columns: 1 });
    }
    let squares: f64 = report.rows.iter().map(|row| row.unknown_db.powi(2)).sum();
    let rms_db = (squares / report.rows.len().max(1) as f64).sqrt();
    let note = format!("rms {rms_db:.2} dB over all chirps");
    let title = subject.title;
    let mut picture =
        maps(&subject, report, spot_m, &[(title, (&|row: &Row| Some(row.unknown_db), note))])?;
    let raster = raster(&report.rows, pixel_m(&report.rows, spot_m));
    for map in &mut picture.panels {
        let rings = strongest(&report.rows, spot_m)
            .into_iter()
            .map(|Peak { x_m, y_m, .. }| (x_m, y_m, 1.5 * raster.pixel_m))
            .map(|(x_m, y_m, radius_m)| Outline::Ring { x_m, y_m, radius_m });
        let rings: Vec<Shape> = rings.filter_map(|ring| ring.on(map, &raster)).collect();
        map.shapes.extend(rings);
    }
    Ok(picture)
}

/// Where something unknown is strong, in the target plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli::diagnose) struct Peak {
    pub x_m: f64,
    pub y_m: f64,
    /// Power that the model lacks there, in the mean of a pixel, dB.
    pub db: f64,
}

/// Places that are told.
const MOST_PLACES: usize = 3;
/// Pixels between two of them at least.
const APART: f64 = 4.0;
/// Share of the strongest that another place has at least.
const AS_STRONG: f64 = 0.5;

/// Where the unknown is strongest, the strongest first; nothing where nothing is unknown.
pub(in crate::cli::diagnose) fn strongest(rows: &[Row], spot_m: f64) -> Vec<Peak> {
    let pixel_m = pixel_m(rows, spot_m);
    let map = filled(&raster(rows, pixel_m), rows, &|row| Some(row.unknown_db));
    let values = map.channels.first().map_or(&[][..], |channel| &channel.values);
    let place = |(index, &db): (usize, &f32)| Peak {
        x_m: map.x_min_m + (0.5 + (index % map.width) as f64) * pixel_m,
        y_m: map.y_min_m + (map.height as f64 - 0.5 - (index / map.width) as f64) * pixel_m,
        db: f64::from(db),
    };
    let places = values.iter().enumerate().map(place);
    let mut places: Vec<Peak> = places.filter(|place| place.db.abs() > 0.0).collect();
    places.sort_by(|a, b| b.db.abs().total_cmp(&a.db.abs()));
    let mut told: Vec<Peak> = Vec::new();
    for place in places {
        let is_near =
            |other: &Peak| (place.x_m - other.x_m).hypot(place.y_m - other.y_m) < APART * pixel_m;
        let is_weak = told.first().is_some_and(|first| place.db.abs() < AS_STRONG * first.db.abs());
        if told.len() == MOST_PLACES || is_weak {
            break;
        }
        if !told.iter().any(is_near) {
            told.push(place);
        }
    }
    told
}

/// The panels of the models that a picture shows, with their titles.
fn before_after<'a>(report: &Report, panels: [Panel<'a>; 2]) -> Vec<(&'static str, Panel<'a>)> {
    let titles = match report.effects.is_empty() {
        true => ["Base model", ""],
        false => ["Before: base model", "After: with the effects"],
    };
    titles.into_iter().zip(shown(report, panels)).collect()
}

/// A map for each panel, all in the colours of the first.
fn maps(
    subject: &Subject,
    report: &Report,
    spot_m: f64,
    panels: &[(&'static str, Panel)],
) -> Result<Picture, FigureError> {
    let pixel_m = pixel_m(&report.rows, spot_m);
    let empty = raster(&report.rows, pixel_m);
    let rasters = panels.iter().map(|(_, (pick, _))| filled(&empty, &report.rows, *pick));
    let rasters: Vec<Raster> = rasters.collect();
    let outlines: Vec<Outline> =
        report.effects.iter().filter_map(|f| Outline::new(f, &report.rows)).collect();
    let reach = rasters.first().map_or(0.0, |first| reach(first, subject.reach, subject.share));
    let drawing = |(raster, (title, (_, note))): (&Raster, &(&'static str, Panel))| {
        let figure = Figure {
            raster,
            channel: CHANNEL,
            title,
            subtitle: note,
            colour_label: subject.quantity,
            range: Some((-reach, reach)),
            scale: Scale::Diverging,
            gaps: subject.gaps,
            x_label: "x in the target plane, m",
            y_label: "y in the target plane, m",
        };
        let mut drawing = figure.drawing()?;
        let lines = outlines.iter().filter_map(|outline| outline.on(&drawing, raster));
        let lines: Vec<Shape> = lines.collect();
        drawing.shapes.extend(lines);
        Ok(drawing)
    };
    let drawn =
        rasters.iter().zip(panels).map(drawing).collect::<Result<Vec<Drawing>, FigureError>>()?;
    let is_drawn = |outline: &&Outline| {
        drawn.first().is_some_and(|map: &Drawing| outline.on(map, &empty).is_some())
    };
    let told: String = outlines.iter().filter(is_drawn).map(Outline::caption).collect();
    let caption = format!("{} Pixels of {:.0} mm.{told}", subject.caption, 1e3 * pixel_m);
    let Subject { file, title, .. } = *subject;
    Ok(Picture { file, title, caption, panels: drawn, columns: panels.len() })
}

/// Where an effect of one part of the target was found, in the target plane.
enum Outline {
    /// Round a patch.
    Ring { x_m: f64, y_m: f64, radius_m: f64 },
    /// The border of a layer: so far from the middle, in a direction from x towards y.
    Line { off_m: f64, direction_deg: f64 },
}

impl Outline {
    fn new(found: &Found, rows: &[Row]) -> Option<Outline> {
        match found.place? {
            Place::Beyond { off_m, direction_deg } => Some(Outline::Line { off_m, direction_deg }),
            Place::Round { x_m, y_m, radius_m } => {
                let off_m = |row: &&Row| (row.xt_m - x_m).hypot(row.yt_m - y_m);
                let nearest = rows.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
                // The radius is one on the surface, and the plane lies where the pattern is told.
                let radius_m = radius_m * PATTERN_RANGE_M / nearest.range_m;
                Some(Outline::Ring { x_m, y_m, radius_m })
            }
        }
    }

    /// What a caption says of it.
    fn caption(&self) -> &'static str {
        match self {
            Outline::Ring { .. } => {
                " The ring is the patch that was found, as wide as on a surface that faces the radar."
            }
            Outline::Line { .. } => " The line is the border of the layer that was found.",
        }
    }

    /// Its points in the target plane, m.
    fn points_m(&self) -> Vec<[f64; 2]> {
        const CORNERS: u32 = 72;
        /// As far as a field of view reaches, and how finely a line is followed.
        const HALF_M: f64 = 4.0;
        const STEPS: i32 = 2000;
        match *self {
            Outline::Ring { x_m, y_m, radius_m } => {
                let corners = (0..=CORNERS).map(|k| f64::from(k) / f64::from(CORNERS) * TAU);
                let corner = |turn: f64| [x_m + radius_m * turn.cos(), y_m + radius_m * turn.sin()];
                corners.map(corner).collect()
            }
            Outline::Line { off_m, direction_deg } => {
                let (sin, cos) = direction_deg.to_radians().sin_cos();
                let along = (-STEPS..=STEPS).map(|k| HALF_M * f64::from(k) / f64::from(STEPS));
                along.map(|t| [off_m * cos - t * sin, off_m * sin + t * cos]).collect()
            }
        }
    }

    /// As a line on a map of this raster: as far as it lies there, and a ring beyond it along its frame.
    fn on(&self, map: &Drawing, raster: &Raster) -> Option<Shape> {
        let [left_px, top_px, cell_px] = map.shapes.iter().find_map(|shape| match *shape {
            Shape::Cells { left_px, top_px, cell_px, .. } => Some([left_px, top_px, cell_px]),
            _ => None,
        })?;
        let [wide_m, high_m] = [raster.width, raster.height].map(|n| n as f64 * raster.pixel_m);
        let px = |length_m: f64| length_m / raster.pixel_m * f64::from(cell_px);
        let inside = |[x_m, y_m]: [f64; 2]| [x_m - raster.x_min_m, y_m - raster.y_min_m];
        let is_inside =
            |[x, y]: &[f64; 2]| (0.0..=wide_m).contains(x) && (0.0..=high_m).contains(y);
        let point = |[x, y]: [f64; 2]| {
            ((f64::from(left_px) + px(x)) as f32, (f64::from(top_px) + px(high_m - y)) as f32)
        };
        let kept = |place: [f64; 2]| match self {
            Outline::Ring { .. } => {
                Some([place[0].clamp(0.0, wide_m), place[1].clamp(0.0, high_m)])
            }
            Outline::Line { .. } => Some(place).filter(is_inside),
        };
        let points: Vec<_> =
            self.points_m().into_iter().map(inside).filter_map(kept).map(point).collect();
        (points.len() > 1).then_some(Shape::Line { points, colour: [0; 3], thickness_px: 2.0 })
    }
}

const CHANNEL: &str = "residual";

/// A spot, or more where the scan is sparse.
fn pixel_m(rows: &[Row], spot_m: f64) -> f64 {
    let cell = |row: &Row| [row.xt_m, row.yt_m].map(|x| (x / spot_m).floor() as i64);
    let mut cells: Vec<[i64; 2]> = rows.iter().map(cell).collect();
    cells.sort_unstable();
    cells.dedup();
    let looks = rows.len() as f64 / cells.len().max(1) as f64;
    let pixel_m = spot_m * (LOOKS_PER_PIXEL / looks.max(1e-3)).sqrt().max(1.0);
    // Whole millimetres, so that a caption tells it exactly.
    (1e3 * pixel_m).round().max(1.0) * 1e-3
}

fn raster(rows: &[Row], pixel_m: f64) -> Raster {
    // What a scan of a metre needs many times over; a stray look must not ask for more memory.
    const MOST_PIXELS: f64 = 1000.0;
    let axis = |pick: fn(&Row) -> f64| {
        let values = rows.iter().map(pick).filter(|x| x.is_finite());
        let [low, high] =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        // A pixel more at each side keeps the target off the frame.
        let first = (low / pixel_m).floor() - 1.0;
        let count = ((high / pixel_m).floor() - first + 2.0).clamp(1.0, MOST_PIXELS);
        (first * pixel_m, count as usize)
    };
    let ((x_min_m, width), (y_min_m, height)) = (axis(|row| row.xt_m), axis(|row| row.yt_m));
    Raster { width, height, x_min_m, y_min_m, pixel_m, channels: Vec::new() }
}

/// The mean of what is picked over the looks of every pixel.
fn filled(empty: &Raster, rows: &[Row], pick: &dyn Fn(&Row) -> Option<f64>) -> Raster {
    let mut sums = vec![(0.0, 0u32); empty.width * empty.height];
    for row in rows {
        let column = ((row.xt_m - empty.x_min_m) / empty.pixel_m).floor();
        let up = ((row.yt_m - empty.y_min_m) / empty.pixel_m).floor();
        let inside =
            (0.0..empty.width as f64).contains(&column) && (0.0..empty.height as f64).contains(&up);
        let Some(value) = pick(row).filter(|_| inside) else { continue };
        let index = (empty.height - 1 - up as usize) * empty.width + column as usize;
        if let Some((sum, count)) = sums.get_mut(index) {
            (*sum, *count) = (*sum + value, *count + 1);
        }
    }
    let values = sums.into_iter().map(|(sum, count)| (sum / f64::from(count)) as f32).collect();
    let channels = vec![Channel { name: CHANNEL.to_owned(), values }];
    Raster { channels, ..empty.clone() }
}

/// How far the colours of both maps reach: as far as this share of the first, in steps of a half.
fn reach(raster: &Raster, [least, most]: [f64; 2], share: f64) -> f64 {
    let values = raster.channels.iter().flat_map(|c| &c.values).filter(|v| v.is_finite());
    let mut sizes: Vec<f32> = values.map(|v| v.abs()).collect();
    sizes.sort_by(f32::total_cmp);
    let place = (share * sizes.len() as f64) as usize;
    let size = sizes.get(place).or(sizes.last()).copied().map_or(0.0, f64::from);
    (2.0 * size).ceil().clamp(2.0 * least, 2.0 * most) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::diagnose::testing::row;

    #[test]
    fn a_pixel_is_the_mean_of_its_looks_and_upright() {
        let at = |xt_m, yt_m, observed_dbm| Row { xt_m, yt_m, observed_dbm, ..row() };
        let rows =
            [at(0.005, 0.005, Some(-50.0)), at(0.006, 0.004, Some(-53.0)), at(0.035, 0.025, None)];
        let empty = raster(&rows, 0.01);
        assert_eq!((empty.width, empty.height), (6, 5));
        let map = filled(&empty, &rows, &|row| row.observed_dbm);
        let values = map.channel(CHANNEL).unwrap();
        // The lowest row but the margin's is the last but one.
        assert_eq!(values[3 * 6 + 1], -51.5);
        assert_eq!(values.iter().filter(|v| v.is_nan()).count(), 29);
    }

    #[test]
    fn a_ring_stands_where_its_patch_is() {
        let empty = raster(&[Row { xt_m: 0.105, yt_m: 0.055, ..row() }, row()], 0.01);
        let cells = Shape::Cells {
            left_px: 20,
            top_px: 30,
            cell_px: 10,
            columns: empty.width,
            colours: Vec::new(),
        };
        let map = Drawing { width_px: 0.0, height_px: 0.0, shapes: vec![cells] };
        let ring = Outline::Ring { x_m: 0.05, y_m: 0.02, radius_m: 0.03 };
        let Some(Shape::Line { points, .. }) = ring.on(&map, &empty) else { panic!() };
        // The map begins 10 mm left of and below the origin, and ends 70 mm above it.
        assert!(
            (points[0].0 - 110.0).abs() < 1e-3 && (points[0].1 - 80.0).abs() < 1e-3,
            "{points:?}"
        );
        let top = points[18];
        assert!((top.0 - 80.0).abs() < 1e-3 && (top.1 - 50.0).abs() < 1e-3, "{top:?}");
        // A border 40 mm up goes from side to side, and one beyond the map is not drawn.
        let border = |off_m| Outline::Line { off_m, direction_deg: 90.0 }.on(&map, &empty);
        let Some(Shape::Line { points, .. }) = border(0.04) else { panic!() };
        let [from, to] = [points[0], points[points.len() - 1]];
        assert!((from.1 - 60.0).abs() < 1e-3 && (to.1 - 60.0).abs() < 1e-3, "{from:?}");
        assert!((from.0 - to.0).abs() > 120.0, "{from:?} {to:?}");
        assert!(border(0.2).is_none());
    }

    #[test]
    fn the_strongest_places_are_apart_and_small_ones_are_within_the_colours() {
        let look = |i: u32| {
            let (xt_m, yt_m) = (0.004 * f64::from(i % 100), 0.004 * f64::from(i / 100));
            let unknown_db = match [xt_m, yt_m].map(|at| at < 0.02) {
                [true, true] => 4.0,
                [false, true] if xt_m > 0.36 => -3.0,
                _ => 0.2,
            };
            Row { xt_m, yt_m, unknown_db, ..row() }
        };
        let rows: Vec<Row> = (0..10_000).map(look).collect();
        let places = strongest(&rows, 0.016);
        let [first, second] = places[..] else { panic!("{places:?}") };
        assert!(first.db > 3.0 && first.x_m < 0.03 && first.y_m < 0.03, "{first:?}");
        assert!(second.db < -2.0 && second.x_m > 0.35 && second.y_m < 0.03, "{second:?}");
        let map = filled(&raster(&rows, 0.016), &rows, &|row| Some(row.unknown_db));
        assert_eq!([MOST, NEARLY_ALL].map(|share| reach(&map, [0.5, 20.0], share)), [0.5, 4.0]);
        assert_eq!(strongest(&[row()], 0.016), []);
    }

    #[test]
    fn a_sparse_scan_has_larger_pixels_and_colours_reach_a_round_value() {
        let place = |i: u32, step_m: f64| Row {
            xt_m: step_m * f64::from(i % 100),
            yt_m: step_m * f64::from(i / 100),
            ..row()
        };
        let dense: Vec<Row> = (0..10_000).map(|i| place(i, 0.004)).collect();
        let sparse: Vec<Row> = (0..10_000).map(|i| place(i, 0.016)).collect();
        assert_eq!(pixel_m(&dense, 0.016), 0.016);
        assert!((pixel_m(&sparse, 0.016) / 0.016 - 8f64.sqrt()).abs() < 0.1);
        let map = filled(&raster(&dense, 0.016), &dense, &|_| Some(-1.3));
        assert_eq!(reach(&map, [0.5, 10.0], MOST), 1.5);
    }
}
