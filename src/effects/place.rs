//! The part of the target on which an effect acts.

use glam::DVec3;

use super::shot::Shot;

/// Most cells along an edge of the target.
const MOST_CELLS: usize = 20;

/// A part of the target plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Around the point of the target that is seen at x_t and y_t, within a radius along the surface.
    Round {
        /// x_t, m.
        x_m: f64,
        /// y_t, m.
        y_m: f64,
        /// Radius along the surface, m.
        radius_m: f64,
    },
    /// Beyond a line across the field of view.
    Beyond {
        /// Distance of the line from the field's centre, m.
        off_m: f64,
        /// Direction from the centre towards the place, counted from x_t towards y_t.
        direction_deg: f64,
    },
}

impl Place {
    /// Its position on the target in the global frame, m: for a round place the centre; for another the centre of its
    /// bounding box, and the sides of that box. `None` if no shot lies in it.
    pub fn on_target_m(&self, shots: &[Shot]) -> Option<(DVec3, Option<DVec3>)> {
        match *self {
            Place::Round { x_m, y_m, .. } => {
                let off_m = |shot: &Shot| (shot.xt_m - x_m).hypot(shot.yt_m - y_m);
                let nearest = shots.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
                Some((nearest.hit.point.xyz, None))
            }
            Place::Beyond { off_m, direction_deg } => {
                let inside = shots.iter().filter(|shot| along_m(shot, direction_deg) > off_m);
                let points = inside.map(|shot| shot.hit.point.xyz);
                let (least, most) =
                    (points.clone().reduce(DVec3::min)?, points.reduce(DVec3::max)?);
                Some((0.5 * (least + most), Some(most - least)))
            }
        }
    }
}

/// Distance of a shot from the field's centre, m, along `direction_deg`, counted from x_t towards y_t.
pub(super) fn along_m(shot: &Shot, direction_deg: f64) -> f64 {
    let (sin, cos) = direction_deg.to_radians().sin_cos();
    shot.xt_m * cos + shot.yt_m * sin
}

/// The middles of the cells of each of some sides, m, that hold a shot, with the side.
pub(super) fn cells_with_shots(shots: &[Shot], sides_m: [f64; 2]) -> Vec<([f64; 2], f64)> {
    let [left, right] = span(shots.iter().map(|shot| shot.xt_m));
    let [low, high] = span(shots.iter().map(|shot| shot.yt_m));
    let mut found = Vec::new();
    for side_m in sides_m {
        let (columns, rows) = (cells(right - left, side_m), cells(high - low, side_m));
        let (width, height) = ((right - left) / columns as f64, (high - low) / rows as f64);
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
            let [x, y] = [left + (column as f64 + 0.5) * width, low + (row as f64 + 0.5) * height];
            let reach_m = (0.5 * side_m).clamp(0.02, 0.3);
            if shots.iter().any(|l| (l.xt_m - x).hypot(l.yt_m - y) < reach_m) {
                found.push(([x, y], side_m));
            }
        }
    }
    found
}

/// Number of cells of a side along a length, both in m.
fn cells(length_m: f64, side_m: f64) -> usize {
    ((length_m / side_m).ceil() as usize).clamp(1, MOST_CELLS)
}

/// Least and largest of some numbers; zeros when there are none.
fn span(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let (least, most) = (values.clone().reduce(f64::min), values.reduce(f64::max));
    [least.unwrap_or(0.0), most.unwrap_or(0.0)]
}
