//! What a person reads. Plain values go in and the bytes of files come out; nothing here writes a file.

mod comparison;
mod material_plot;
mod measurement;
mod neighbours;
mod radar;

pub use comparison::Comparison;
pub use material_plot::{
    FigureFormat, appendix_figures, curve_points, fit_layers, incidence_plot, material_plot,
    sweep_plot,
};
pub use measurement::{measured_curve_plot, pose_record};
pub use neighbours::{Neighbour, NeighbourReport, NeighbourSearch};
pub use radar::RadarReport;
