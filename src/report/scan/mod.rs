//! The record of a rendering, `scan.json`, and what a person should not overlook in it.

mod counts;
mod notices;
mod record;

pub use counts::{Counts, PowerRange, RegionRecord};
pub use record::{ReceiverRecord, ScanRecord};
