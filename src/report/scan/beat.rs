//! `beat.npy`: the sampled beat signals, for those who bring their own receiver.

use crate::error::Error;
use crate::files::{FilesError, WayOut};
use crate::formats::npy;
use crate::render::{Footprints, RenderError, Setup, beat_signals};
use crate::scene::Scene;
use crate::setup::{ReadyScene, View};

/// Bytes that the signals of all antennas together may take.
const MOST_BYTES: usize = 1 << 30;

/// Rows, one per look of each chirp, and samples of an array of beat signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BeatShape([usize; 2]);

impl BeatShape {
    /// The shape of the beat signals of a scene at one antenna.
    ///
    /// # Errors
    /// The scene's radar has no receiver, or the signals of all antennas take more than 1 GiB.
    pub fn new(scene: &Scene) -> Result<BeatShape, Error> {
        let radar = scene.radar();
        if radar.receiver.is_none() {
            let problem = "a radar without a receiver has no beat signals";
            return Err(Error::usage(problem, "add a [radar.receiver] table to the scene"));
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
            return Err(Error::usage(problem, way_out));
        }
        Ok(BeatShape([rows, columns]))
    }

    /// The array of an antenna as an NPY file.
    pub(super) fn encode(
        self,
        ready: &ReadyScene,
        setup: &Setup,
        footprints: &Footprints,
        view: &View,
    ) -> Result<(String, Vec<u8>), Error> {
        let name = view.file_name("beat", "npy");
        let at = |error| ready.render_error(&format!("{name}: "), error);
        let signals = beat_signals(setup, footprints, view.observer).map_err(at)?;
        let mut failed: Option<RenderError> = None;
        let rows = signals.map_while(|signals| signals.map_err(|e| failed = Some(e)).ok());
        let mut bytes = Vec::new();
        let written = npy::write_complex64(&mut bytes, self.0, rows.flatten().flatten());
        if let Some(error) = failed {
            return Err(at(error));
        }
        match written {
            Ok(()) => Ok((name, bytes)),
            Err(reason) => {
                let (verb, path, way_out) =
                    ("encode", name.into(), WayOut::Words("leave the beat signals out"));
                Err(FilesError { verb, path, reason, way_out }.into())
            }
        }
    }
}
