//! `beat.npy`: the sampled beat signals, for those who bring their own receiver.

use std::path::Path;

use super::views::View;
use crate::error::Error;
use crate::formats::npy;
use crate::render::{Footprints, RenderError, Setup, beat_signals};

/// Bytes that the signals of one antenna may take.
const MOST_BYTES: usize = 1 << 30;

/// One array per antenna, a row per chirp, or per look where a chirp has several.
pub(super) fn encode(
    scene: &Path,
    setup: &Setup,
    footprints: &Footprints,
    views: &[View],
) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let shape = shape(setup)?;
    let encode = |view: &View| {
        let at = |error| Error::Render { scene: scene.to_owned(), error };
        let signals = beat_signals(setup, footprints, view.observer).map_err(at)?;
        let mut failed: Option<RenderError> = None;
        let rows = signals.map_while(|signals| signals.map_err(|e| failed = Some(e)).ok());
        let mut bytes = Vec::new();
        let written = npy::write_complex64(&mut bytes, shape, rows.flatten().flatten());
        match (failed, written) {
            (Some(error), _) => Err(at(error)),
            (None, Err(reason)) => Err(Error::Io {
                verb: "encode",
                path: view.file("beat", "npy").into(),
                reason,
                way_out: "leave out --beat",
            }),
            (None, Ok(())) => Ok((view.file("beat", "npy"), bytes)),
        }
    };
    views.iter().map(encode).collect()
}

fn shape(setup: &Setup) -> Result<[usize; 2], Error> {
    let usage = |problem: String, way_out: &str| Error::Usage { problem, way_out: way_out.into() };
    if setup.radar.receiver.is_none() {
        let problem = "--beat has no signal to write without a receiver".to_owned();
        return Err(usage(problem, "add a [radar.receiver] table to the scene"));
    }
    let looks = setup.radar.speckle.map_or(1, |speckle| speckle.looks as usize);
    let [rows, columns] =
        [setup.chirps.rays.len().saturating_mul(looks), setup.radar.chirp.samples];
    let bytes = rows.saturating_mul(columns).saturating_mul(8);
    if bytes > MOST_BYTES {
        let problem =
            format!("beat signals of {rows} × {columns} samples take {} MB", bytes / 1_000_000);
        return Err(usage(
            problem,
            "use fewer looks, chirps or radar.chirp.samples; 1 GiB is the most",
        ));
    }
    Ok([rows, columns])
}
