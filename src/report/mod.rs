//! What a person reads: the page, the pictures, the tables and the words of a diagnosis, the files of a rendering and
//! of a measurement, plots of materials and fits, lists and histories of a database. Plain values go in; records and
//! the bytes of files come out. Nothing here writes a file.

mod calibration;
mod cannot_tell;
mod choice;
mod cloud;
mod comparison;
mod curve;
mod effect;
mod effect_help;
mod fit_plot;
mod history;
mod json;
mod level_table;
mod material_export;
mod material_list;
mod material_plot;
mod measurement;
mod neighbours;
mod picture;
mod prediction;
mod radar;
mod residuals;
mod scan;
mod search;
mod shell;
mod templates;
mod view;
mod words;

pub use calibration::CalibrationReport;
pub use cannot_tell::CannotTell;
pub use choice::{Choice, Measurands, Reason, UntriedEffect, terms_not_asked};
pub use cloud::{CloudAnswer, CloudRecord, CloudReport, NextSteps};
pub use comparison::Comparison;
pub use curve::{CurveAnswer, CurveRequest, curve_law, curve_terms};
pub use effect_help::EffectHelp;
pub use fit_plot::FitPlot;
pub use history::{RevisionRecord, revision_records};
pub use json::{Record, json_file};
pub use level_table::{AT_A_GLANCE_DEG, LevelRow, Sigma0Level, drawn_words, level_rows};
pub use material_export::{ExportReport, ExportRequest};
pub use material_list::{MaterialList, MaterialRow, UnknownWord};
pub use material_plot::{
    FigureFormat, appendix_figures, curve_points, fit_layers, incidence_plot, material_plot,
    sweep_plot,
};
pub use measurement::{MeasurementReport, MeasurementRequest};
pub use neighbours::{Neighbour, NeighbourReport, NeighbourSearch};
pub use picture::Picture;
pub use prediction::{PredictedLevel, Prediction, angles_deg};
pub use radar::RadarReport;
pub use scan::{
    BeatShape, Counts, PowerRange, ReceiverRecord, RegionRecord, RenderFiles, RenderProgress,
    RenderRequest, RenderStage, ScanRecord, rendering_glb,
};
pub use search::{MaterialHit, MaterialSearch};
pub use shell::shell_word;
pub use view::{CATALOGUE_VIEW, rendering_page};
