//! What a person reads: the page, the pictures, the tables and the words of a diagnosis, the files of a rendering,
//! plots of materials and fits. Plain values go in and the bytes of files come out; nothing here writes a file.

mod cannot_tell;
mod choice;
mod cloud;
mod comparison;
mod curve;
mod effect;
mod json;
mod material_plot;
mod measurement;
mod neighbours;
mod picture;
mod radar;
mod residuals;
mod scan;
mod shell;
mod templates;
mod words;

pub use cannot_tell::CannotTell;
pub use choice::{Choice, Measurands, Reason, UntriedEffect, terms_not_asked};
pub use cloud::{CloudAnswer, CloudRecord, CloudReport, NextSteps};
pub use comparison::Comparison;
pub use curve::{CurveAnswer, CurveRequest};
pub use json::{Record, json_file};
pub use material_plot::{
    FigureFormat, appendix_figures, curve_points, fit_layers, incidence_plot, material_plot,
    sweep_plot,
};
pub use measurement::{measured_curve_plot, pose_record};
pub use neighbours::{Neighbour, NeighbourReport, NeighbourSearch};
pub use picture::Picture;
pub use radar::RadarReport;
pub use scan::{
    BeatShape, Counts, PowerRange, ReceiverRecord, RegionRecord, RenderFiles, RenderRequest,
    RenderStage, ScanRecord,
};
pub use shell::shell_word;
