//! Where the beams of a scan aim.

use rayon::prelude::*;

use super::lattice::Aim;
use crate::frames::Point;
use crate::radar::{Beam, Chirps, Radar};

/// The aim of every chirp: where the axis passes the focus, across the target plane.
pub(super) fn aims(radar: &Radar, chirps: &Chirps) -> Vec<Aim> {
    let beam = Beam::new(radar);
    let target_from_global = radar.frames().global_from_target.inverse();
    let aims = chirps.rays.par_iter().with_min_len(1 << 10).map(|axis| {
        let focus = axis.origin.xyz + radar.beam.focus_m * axis.direction.xyz();
        let focus = (target_from_global * Point::from(focus)).xyz;
        Aim { at_m: [focus.x, focus.y], waist_m: beam.along(axis).waist_m }
    });
    aims.collect()
}
