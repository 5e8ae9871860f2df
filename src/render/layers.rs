//! The surfaces along the axis of every chirp, sheets and what lies behind, as a receiver parts their echoes.

use std::convert::Infallible;

use super::observer::Observer;
use super::path::Path;
use super::paths::Paths;
use super::returns::separate;
use super::setup::Setup;
use super::spot::Footprints;
use crate::trace::Hit;

/// A surface on the way of a chirp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// The hit on it.
    pub hit: Hit,
    /// Number of sheets in front of it.
    pub sheets: u8,
    /// Apparent range of its echo, m.
    pub range_m: f64,
    /// Mean power of its echo, W.
    pub power_w: f64,
    /// Distance in the target plane to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
}

/// The echoes of every chirp of a scan with one ray each, the nearest first, and the surfaces that each is of.
pub(crate) fn layers(setup: &Setup, footprints: &Footprints) -> Vec<Vec<Vec<Layer>>> {
    let paths = Paths::new(setup, Observer::Radar, footprints, None);
    let cell_m = setup.geometry.radar.range_cell_m();
    let Ok(of_chirps) = paths.of_all::<_, Infallible>(&|_| {}, |chirp, _, of_chirp, layers| {
        let echoes = separate(of_chirp, cell_m);
        let layer = |path: &Path| Layer {
            hit: path.hit,
            sheets: path.sheets,
            range_m: path.range_m,
            power_w: path.power_w,
            edge_m: footprints.edge_m_behind(path.sheets)[chirp],
        };
        layers
            .push(echoes.into_iter().map(|of| of_chirp[of].iter().map(layer).collect()).collect());
        Ok(())
    });
    of_chirps
}
