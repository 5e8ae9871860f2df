//! `beat.npy`: the sampled beat signals, for those who bring their own receiver.

use std::path::Path;

use crate::error::Error;
use crate::files::FilesError;
use crate::formats::npy;
use crate::render::{Footprints, RenderError, Setup, beat_signals};
use crate::scene::Scene;
use crate::setup::View;

/// Bytes that the signals of all antennas together may take.
const MOST_BYTES: usize = 1 << 30;

/// Rows, one per look of each chirp, and samples of an array of beat signals.
#[derive(Clone, Copy)]
pub(super) struct Shape([usize; 2]);

impl Shape {
    /// The shape for a scene that has a receiver and whose signals fit into memory.
    pub fn new(scene: &Scene) -> Result<Shape, Error> {
        let usage = |problem: String, way_out: &str| {
            Err(Error::Usage { problem, way_out: way_out.to_owned() })
        };
        let radar = scene.radar();
        if radar.receiver.is_none() {
            let problem = "--beat has no signal to write without a receiver".to_owned();
            return usage(problem, "add a [radar.receiver] table to the scene");
        }
        let looks = radar.speckle.map_or(1, |speckle| speckle.looks as usize);
        let (rows, columns) = (scene.chirps.rays.len().saturating_mul(looks), radar.chirp.samples);
        let antennas = 1 + scene.file.receiver.len();
        let bytes = [columns, antennas, 8].into_iter().fold(rows, usize::saturating_mul);
        if bytes > MOST_BYTES {
            let problem = format!(
                "beat signals of {antennas} × {rows} × {columns} samples take {} MB",
                bytes / 1_000_000
            );
            let way_out =
                "1 GiB is the most: use fewer looks, chirps, receivers or radar.chirp.samples";
            return usage(problem, way_out);
        }
        Ok(Shape([rows, columns]))
    }
}

/// One array per antenna.
pub(super) fn encode(
    scene: &Path,
    Shape(shape): Shape,
    setup: &Setup,
    footprints: &Footprints,
    views: &[View],
) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let encode = |view: &View| {
        let name = view.file_name("beat", "npy");
        let at = |error| Error::Render {
            scene: scene.to_owned(),
            antenna: format!("{name}: "),
            error: Box::new(error),
        };
        let signals = beat_signals(setup, footprints, view.observer).map_err(at)?;
        let mut failed: Option<RenderError> = None;
        let rows = signals.map_while(|signals| signals.map_err(|e| failed = Some(e)).ok());
        let mut bytes = Vec::new();
        let written = npy::write_complex64(&mut bytes, shape, rows.flatten().flatten());
        if let Some(error) = failed {
            return Err(at(error));
        }
        match written {
            Ok(()) => Ok((name, bytes)),
            Err(reason) => {
                let (verb, path, way_out) = ("encode", name.into(), "leave out --beat");
                Err(FilesError { verb, path, reason, way_out }.into())
            }
        }
    };
    views.iter().map(encode).collect()
}
