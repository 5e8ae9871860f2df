//! Residuals over the target plane, before and after.

use super::models::shown;
use super::outline::Outline;
use super::places::strongest;
use super::raster::{CHANNEL, Pick, Plane, empty, filled, pixel_m};
use crate::diagnose::{Errors, Report, Row};
use crate::formats::figure::drawing::{Drawing, Shape};
use crate::formats::figure::{Figure, FigureError, Scale};
use crate::formats::words::signed;
use crate::geometry::Raster;
use crate::report::picture::Picture;
use crate::units::db_from_ratio;

/// Share of the pixels within the scale of colours on a map with speckle.
const MOST: f64 = 0.98;
/// Share of the pixels within the scale of colours on a map without speckle, whose structure may be in few pixels.
const NEARLY_ALL: f64 = 0.999;

/// Shortest and longest reach of the colours of a residual, dB.
const RESIDUAL_REACH_DB: [f64; 2] = [0.5, 10.0];

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

/// One map of a picture.
struct Panel {
    title: &'static str,
    /// The line under the title.
    note: String,
    /// What it shows of a shot.
    pick: Pick,
}

/// Observed − predicted, dB, of what was detected.
pub(super) fn residuals(report: &Report, plane: Plane) -> Result<Picture, FigureError> {
    let subject = Subject {
        file: "residual-map",
        title: "Residual over the target",
        quantity: "observed − predicted, dB",
        gaps: "no detection",
        reach: RESIDUAL_REACH_DB,
        share: MOST,
        caption: "Observed − predicted power over the target plane, averaged over the detections \
                  of each pixel. Red is more power than predicted, blue less. A model that is right leaves speckle without shape.",
    };
    let notes = [error_note(&report.error.before), error_note(&report.error.after)];
    let picks: [Pick; 2] =
        [|row| Some(db_from_ratio(row.observed_w? / row.before_w)), residual_after_db];
    maps(&subject, report, plane, before_after(report, notes, picks))
}

/// Observed − predicted power with the effects, dB; none where nothing was detected.
fn residual_after_db(row: &Row) -> Option<f64> {
    Some(db_from_ratio(row.observed_w? / row.after_w))
}

/// Mean of observed − predicted power with the effects, dB, over the target plane of a radar with a spot of this diameter, m;
/// and how far its colours reach to both sides of 0, dB.
pub(in crate::report) fn map_after(rows: &[Row], spot_m: f64) -> (Raster, f64) {
    let around = empty(rows, pixel_m(rows, spot_m));
    let map = filled(&around, rows, residual_after_db);
    let reach_db = reach(&map, RESIDUAL_REACH_DB, MOST);
    (map, reach_db)
}

fn error_note(errors: &Errors) -> String {
    format!("rmse {:.2} dB, mean {} dB", errors.rmse_db, signed(errors.bias_db, 2))
}

/// Mean quantile residual, which chirps without a detection have, too.
pub(super) fn quantiles(report: &Report, plane: Plane) -> Result<Picture, FigureError> {
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
    let notes = [
        quantile_note(report.rows.iter().map(|row| row.z_before)),
        quantile_note(report.rows.iter().map(|row| row.z_after)),
    ];
    let picks: [Pick; 2] = [|row| Some(row.z_before), |row| Some(row.z_after)];
    maps(&subject, report, plane, before_after(report, notes, picks))
}

fn quantile_note(z: impl ExactSizeIterator<Item = f64> + Clone) -> String {
    let count = z.len().max(1) as f64;
    let mean = z.clone().sum::<f64>() / count;
    let rms = (z.map(|z| z.powi(2)).sum::<f64>() / count).sqrt();
    format!("of all chirps: rms {rms:.2}, mean {}", signed(mean, 2))
}

/// The smooth term that the final model lacks; without panels where there is none.
pub(super) fn unknown(report: &Report, plane: Plane) -> Result<Picture, FigureError> {
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
    let Subject { file, title, .. } = subject;
    if report.rows.iter().all(|row| row.unknown_db == 0.0) {
        return Ok(Picture { file, title, caption: String::new(), panels: Vec::new(), columns: 1 });
    }
    let squares: f64 = report.rows.iter().map(|row| row.unknown_db.powi(2)).sum();
    let rms_db = (squares / report.rows.len().max(1) as f64).sqrt();
    let note = format!("rms {rms_db:.2} dB over all chirps");
    let panel = Panel { title, note, pick: |row| Some(row.unknown_db) };
    let mut picture = maps(&subject, report, plane, vec![panel])?;
    let raster = empty(&report.rows, pixel_m(&report.rows, plane.spot_m));
    for map in &mut picture.panels {
        for place in strongest(&report.rows, plane.spot_m) {
            let radius_m = 1.5 * raster.pixel_m;
            let ring = Outline::Ring { x_m: place.x_m, y_m: place.y_m, radius_m };
            let ring = ring.on(map, &raster);
            map.shapes.extend(ring);
        }
    }
    Ok(picture)
}

/// The panels of the models that a picture shows.
fn before_after(report: &Report, notes: [String; 2], picks: [Pick; 2]) -> Vec<Panel> {
    let titles = if report.effects.is_empty() {
        ["Base model", ""]
    } else {
        ["Before: base model", "After: with the effects"]
    };
    let mut panels = Vec::new();
    for ((title, note), pick) in titles.into_iter().zip(notes).zip(shown(report, picks)) {
        panels.push(Panel { title, note, pick });
    }
    panels
}

/// A map for each panel, all in the colours of the first.
fn maps(
    subject: &Subject,
    report: &Report,
    plane: Plane,
    panels: Vec<Panel>,
) -> Result<Picture, FigureError> {
    let around = empty(&report.rows, pixel_m(&report.rows, plane.spot_m));
    let mut rasters: Vec<Raster> = Vec::new();
    for panel in &panels {
        rasters.push(filled(&around, &report.rows, panel.pick));
    }
    let mut outlines: Vec<Outline> = Vec::new();
    for found in &report.effects {
        outlines.extend(Outline::new(found, &report.rows, plane.range_m));
    }
    let reach = rasters.first().map_or(0.0, |first| reach(first, subject.reach, subject.share));
    let mut maps = Vec::new();
    for (raster, panel) in rasters.iter().zip(&panels) {
        let mut map = draw(subject, panel, raster, reach)?;
        let lines: Vec<Shape> = outlines.iter().filter_map(|o| o.on(&map, raster)).collect();
        map.shapes.extend(lines);
        maps.push(map);
    }
    let mut caption = format!("{} Pixels of {:.0} mm.", subject.caption, 1e3 * around.pixel_m);
    for outline in &outlines {
        if maps.first().is_some_and(|map| outline.on(map, &around).is_some()) {
            caption += outline.caption();
        }
    }
    let Subject { file, title, .. } = *subject;
    Ok(Picture { file, title, caption, panels: maps, columns: panels.len() })
}

fn draw(
    subject: &Subject,
    panel: &Panel,
    raster: &Raster,
    reach: f64,
) -> Result<Drawing, FigureError> {
    let figure = Figure {
        raster,
        channel: CHANNEL,
        title: panel.title,
        subtitle: &panel.note,
        colour_label: subject.quantity,
        range: Some((-reach, reach)),
        scale: Scale::Diverging,
        gaps: subject.gaps,
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
    };
    figure.drawing()
}

/// How far the colours of all maps reach: over this share of the first one's pixels, in steps of a half.
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
    use crate::report::cloud::testing::square;

    #[test]
    fn colours_reach_a_round_value_and_small_places_are_within_them() {
        let rows = square(|x_m, y_m| if x_m < 0.02 && y_m < 0.02 { 4.0 } else { 0.2 });
        let around = empty(&rows, 0.016);
        let map = filled(&around, &rows, |row| Some(row.unknown_db));
        assert_eq!([MOST, NEARLY_ALL].map(|share| reach(&map, [0.5, 20.0], share)), [0.5, 4.0]);
        let map = filled(&around, &rows, |_| Some(-1.3));
        assert_eq!(reach(&map, [0.5, 10.0], MOST), 1.5);
    }
}
