//! Renders a scan of a target with materials to detections. Plain values in and out: no files, no database.
//!
//! | step | file |
//! |---|---|
//! | intersections of the rays of each chirp with the target | `spot.rs`, equation (7) |
//! | the surfaces of the target | `surface.rs` |
//! | what the target lets through | `sheet.rs`, `sheet_energy.rs` |
//! | what the rays light, directly and by way of a first surface | `light.rs`, `bounce.rs` |
//! | power that arrives at an antenna | `paths.rs`, equation (11) |
//! | … in its polarisation | `polarised.rs` |
//! | … with declared physical effects | `effect_scan.rs` |
//! | the wave of a mirror that the spot reaches beyond | `coherent.rs` |
//! | speckle, a field fixed to the surface | `speckle/` |
//! | echoes that part in range | `returns.rs`, `layers.rs` |
//! | how far the target tilts within the spots | `curvature.rs` |
//! | how far neighbouring facets turn | `facet_steps.rs` |
//! | detection by the receiver, and the cause of each echo | `detect.rs`, `echo.rs` |
//! | tones of a beat signal | `tones.rs` |
//! | image and point cloud | `image.rs`, `cloud.rs` |
//! | many scans at once, on a graphics processor | `batch.rs` |

mod effect_scan;
mod batch;
mod behind;
mod bounce;
mod cloud;
mod coherent;
mod curvature;
mod detect;
mod echo;
mod edges;
mod error;
mod facet_steps;
mod image;
mod layers;
mod light;
mod observer;
mod path;
mod paths;
mod polarised;
mod returns;
mod scan;
mod setup;
mod sheet;
mod sheet_energy;
mod speckle;
mod spot;
mod surface;
mod tones;

pub use batch::{Batch, Take, Takes};
pub use bounce::Bounce;
pub use cloud::{BESIDE_THE_MEASURED, COLOURS, cloud_table};
pub use curvature::{SpotTilt, spot_tilts};
pub use echo::{Echo, Truth};
pub use error::RenderError;
pub use facet_steps::facet_steps;
pub use image::{CHANNELS, power_image};
pub(crate) use layers::{Layer, layers};
pub use observer::Observer;
pub use scan::{Scan, beat_signals, shade, shade_each, trace, trace_placed};
pub use setup::{MOST_SHEETS, Setup};
pub use sheet::Sheet;
pub use sheet_energy::SheetGain;
pub(crate) use spot::spot_rays;
pub use spot::{Behind, Footprints};
pub use surface::{Orientation, Surface};
pub use tones::Beats;
