//! The outline of an effect that acts in one part of the target, on a map.

use std::f64::consts::TAU;

use crate::diagnose::{FoundEffect, Row};
use crate::effects::Place;
use crate::formats::figure::drawing::{Drawing, Shape};
use crate::geometry::Raster;

/// Where an effect acts, in the target plane.
#[derive(Clone, Copy)]
pub(in crate::report) enum Outline {
    /// Around a patch.
    Ring { x_m: f64, y_m: f64, radius_m: f64 },
    /// The border of a layer, `off_m` from the middle of the field of view in a direction from x towards y.
    Line { off_m: f64, direction_deg: f64 },
}

impl Outline {
    /// The outline of an effect on a target plane at a range, m; `None` where it acts everywhere.
    pub fn new(found: &FoundEffect, rows: &[Row], plane_m: f64) -> Option<Outline> {
        match found.place? {
            Place::Beyond { off_m, direction_deg } => Some(Outline::Line { off_m, direction_deg }),
            Place::Round { x_m, y_m, radius_m } => {
                let nearest = rows
                    .iter()
                    .min_by(|a, b| distance_m(a, x_m, y_m).total_cmp(&distance_m(b, x_m, y_m)))?;
                // The radius is one on the surface.
                let radius_m = radius_m * plane_m / nearest.range_m;
                Some(Outline::Ring { x_m, y_m, radius_m })
            }
        }
    }

    /// What a caption says of it.
    pub fn caption(&self) -> &'static str {
        match self {
            Outline::Ring { .. } => {
                " The ring is the patch that was found, as wide as on a surface that faces the radar."
            }
            Outline::Line { .. } => " The line is the border of the layer that was found.",
        }
    }

    /// What it is of its effect.
    pub fn name(&self) -> &'static str {
        match self {
            Outline::Ring { .. } => "outline",
            Outline::Line { .. } => "border",
        }
    }

    /// Its points in the target plane, m.
    pub fn points_m(&self) -> Vec<[f64; 2]> {
        const CORNERS: u32 = 72;
        /// As far as a field of view reaches, and how finely a line is followed.
        const HALF_M: f64 = 4.0;
        const STEPS: i32 = 2000;
        let mut points_m = Vec::new();
        match *self {
            Outline::Ring { x_m, y_m, radius_m } => {
                for corner in 0..=CORNERS {
                    let turn = f64::from(corner) / f64::from(CORNERS) * TAU;
                    points_m.push([x_m + radius_m * turn.cos(), y_m + radius_m * turn.sin()]);
                }
            }
            Outline::Line { off_m, direction_deg } => {
                let (sin, cos) = direction_deg.to_radians().sin_cos();
                for step in -STEPS..=STEPS {
                    let along_m = HALF_M * f64::from(step) / f64::from(STEPS);
                    points_m.push([off_m * cos - along_m * sin, off_m * sin + along_m * cos]);
                }
            }
        }
        points_m
    }

    /// As a line on a map of this raster. What lies outside the map is left out of a border; a ring follows the
    /// frame there. `None` where nothing is inside.
    pub fn on(&self, map: &Drawing, raster: &Raster) -> Option<Shape> {
        let [left_px, top_px, cell_px] = map.shapes.iter().find_map(|shape| match *shape {
            Shape::Cells { left_px, top_px, cell_px, .. } => Some([left_px, top_px, cell_px]),
            _ => None,
        })?;
        let [wide_m, high_m] = [raster.width, raster.height].map(|n| n as f64 * raster.pixel_m);
        let mut points = Vec::new();
        for [x_m, y_m] in self.points_m() {
            let [mut x_m, mut y_m] = [x_m - raster.x_min_m, y_m - raster.y_min_m];
            match self {
                Outline::Ring { .. } => {
                    [x_m, y_m] = [x_m.clamp(0.0, wide_m), y_m.clamp(0.0, high_m)];
                }
                Outline::Line { .. } => {
                    if !(0.0..=wide_m).contains(&x_m) || !(0.0..=high_m).contains(&y_m) {
                        continue;
                    }
                }
            }
            let [right_px, down_px] =
                [x_m, high_m - y_m].map(|m| m / raster.pixel_m * f64::from(cell_px));
            points.push((
                (f64::from(left_px) + right_px) as f32,
                (f64::from(top_px) + down_px) as f32,
            ));
        }
        (points.len() > 1).then_some(Shape::Line { points, colour: [0; 3], thickness_px: 2.0 })
    }
}

/// Distance of a shot from a place in the target plane, m.
fn distance_m(row: &Row, x_m: f64, y_m: f64) -> f64 {
    (row.xt_m - x_m).hypot(row.yt_m - y_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::cloud::raster::empty;
    use crate::report::cloud::testing::row;

    #[test]
    fn a_ring_stands_where_its_patch_is() {
        let around = empty(&[Row { xt_m: 0.105, yt_m: 0.055, ..row() }, row()], 0.01);
        let cells = Shape::Cells {
            left_px: 20,
            top_px: 30,
            cell_px: 10,
            columns: around.width,
            colours: Vec::new(),
        };
        let map = Drawing { width_px: 0.0, height_px: 0.0, shapes: vec![cells] };
        let ring = Outline::Ring { x_m: 0.05, y_m: 0.02, radius_m: 0.03 };
        let Some(Shape::Line { points, .. }) = ring.on(&map, &around) else { panic!() };
        // The map begins 10 mm left of and below the origin, and ends 70 mm above it.
        assert!(
            (points[0].0 - 110.0).abs() < 1e-3 && (points[0].1 - 80.0).abs() < 1e-3,
            "{points:?}"
        );
        let top = points[18];
        assert!((top.0 - 80.0).abs() < 1e-3 && (top.1 - 50.0).abs() < 1e-3, "{top:?}");
        // A border 40 mm up goes from side to side, and one beyond the map is not drawn.
        let border = |off_m| Outline::Line { off_m, direction_deg: 90.0 }.on(&map, &around);
        let Some(Shape::Line { points, .. }) = border(0.04) else { panic!() };
        let [from, to] = [points[0], points[points.len() - 1]];
        assert!((from.1 - 60.0).abs() < 1e-3 && (to.1 - 60.0).abs() < 1e-3, "{from:?}");
        assert!((from.0 - to.0).abs() > 120.0, "{from:?} {to:?}");
        assert!(border(0.2).is_none());
    }
}
