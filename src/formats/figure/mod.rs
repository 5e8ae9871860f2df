//! Figures for papers: rasters with a colour bar, plots of curves and points, and bars, as PNG and SVG.

mod axes;
mod bars;
mod colour_bar;
pub mod drawing;
mod error;
mod plot;
mod raster;
mod style;
pub mod ticks;

pub use bars::{Bar, Bars};
pub use colour_bar::Scale;
pub use error::FigureError;
pub use plot::{Plot, Series, Style};
pub use raster::{Figure, beside};
