//! Where an effect acts that acts on one part of the target.

use glam::DVec3;

use super::Shot;
use super::covering_layer::along_m;

/// A part of the target plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// About the point of the target that is seen at x_t and y_t, m, so far along the surface, m.
    Round {
        /// x_t, m.
        x_m: f64,
        /// y_t, m.
        y_m: f64,
        /// Along the surface, m.
        radius_m: f64,
    },
    /// Beyond a line across the field of view.
    Beyond {
        /// From the field's centre, m.
        off_m: f64,
        /// Where to, from x_t towards y_t.
        direction_deg: f64,
    },
}

impl Place {
    /// Where it is on a target in the global frame, m: the point that is its centre or, of what is not round, the middle of the
    /// box around it and the sides of that. `None` where no look lies in it.
    pub fn on_target_m(&self, looks: &[Shot]) -> Option<(DVec3, Option<DVec3>)> {
        let point = |look: &Shot| look.hit.point.xyz;
        match *self {
            Place::Round { x_m, y_m, .. } => {
                let off_m = |look: &&Shot| (look.xt_m - x_m).hypot(look.yt_m - y_m);
                let nearest = looks.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
                Some((point(nearest), None))
            }
            Place::Beyond { off_m, direction_deg } => {
                let points =
                    || looks.iter().filter(|look| along_m(look, direction_deg) > off_m).map(point);
                let (least, most) = (points().reduce(DVec3::min)?, points().reduce(DVec3::max)?);
                Some((0.5 * (least + most), Some(most - least)))
            }
        }
    }
}
