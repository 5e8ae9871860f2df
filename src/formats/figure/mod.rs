//! Figures: rasters with a colour bar, plots of curves and points, and bars, as PNG and SVG for papers; plots
//! also as part of a web page, in its colours and fonts.

mod axes;
mod bars;
mod colour_bar;
pub mod drawing;
mod error;
mod ink;
mod inline;
mod plot;
mod raster;
mod style;
pub mod ticks;

pub use bars::{Bar, Bars};
pub use colour_bar::{Scale, colours_of};
pub use error::FigureError;
pub use ink::{Ink, LESS_AND_MORE_HUE_DEG};
pub use inline::Inline;
pub use plot::{Plot, Series, Style};
pub use raster::{Figure, beside};
