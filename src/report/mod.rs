//! What a person reads: the page, the pictures, the tables and the words of a diagnosis, and the record of a
//! rendering. Plain values go in and the bytes of files come out; nothing here writes a file.

mod cannot_tell;
mod choice;
mod cloud;
mod curve;
mod effect;
mod json;
mod picture;
mod residuals;
mod scan;
mod shell;
mod templates;
mod words;

pub use cannot_tell::CannotTell;
pub use choice::{Choice, Measured, NotTried, Reason, terms_not_asked};
pub use cloud::{CloudAnswer, CloudReport, NextSteps};
pub use curve::{CurveAnswer, CurveRequest};
pub use json::{Record, json_file};
pub use picture::Picture;
pub use scan::{Counts, PowerRange, ReceiverRecord, RegionRecord, ScanRecord};
pub use shell::shell_word;
