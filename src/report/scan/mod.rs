//! The files of a rendering: images and clouds of every antenna, beat signals, and the record, `scan.json`, with what a
//! person should not overlook in it.

mod beat;
mod counts;
mod files;
mod glb;
mod notices;
mod record;
mod request;

pub use beat::BeatShape;
pub use counts::{Counts, PowerRange, RegionRecord};
pub use glb::rendering_glb;
pub use record::{ReceiverRecord, ScanRecord};
pub use request::{RenderFiles, RenderProgress, RenderRequest, RenderStage};
