//! Why a figure could not be drawn.

use thiserror::Error;

use super::drawing::DrawingError;

/// Why a figure could not be drawn.
#[derive(Debug, Error)]
pub enum FigureError {
    /// The raster has no such channel.
    #[error("draw channel {channel:?}: the raster has {available}; name one of these")]
    NoChannel {
        /// The name asked for.
        channel: String,
        /// The names there are.
        available: String,
    },
    /// The raster's numbers contradict each other or span no area.
    #[error(
        "draw {values} values on {width} × {height} pixels of {pixel_m} m: \
         give one value per pixel and a pixel a finite size and place"
    )]
    Grid {
        /// Values in the channel.
        values: usize,
        /// Columns of the raster.
        width: usize,
        /// Rows of the raster.
        height: usize,
        /// Side of a pixel, m.
        pixel_m: f64,
    },
    /// The range of the colours is empty, reversed or not finite.
    #[error("colour values from {low} to {high}: give two finite numbers, the smaller first")]
    Range {
        /// Value of the first colour, in the channel's unit.
        low: f64,
        /// Value of the last colour, in the channel's unit.
        high: f64,
    },
    /// There is no bar, or one without a finite length.
    #[error("draw {bars} bars: give at least one, each with a finite value")]
    NoBars {
        /// Bars asked for.
        bars: usize,
    },
    /// The page could not be drawn.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
}
