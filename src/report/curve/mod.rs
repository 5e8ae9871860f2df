//! The report on a curve: page, record, table of residuals and picture.

mod answer;
mod page;
mod picture;
mod request;
mod text;

use std::path::Path;

use super::json::{Record, json_file};
use super::residuals;
use crate::diagnose::curve::CurveReport;
use crate::error::Error;

pub use answer::CurveAnswer;
pub use request::{CurveRequest, curve_law, curve_terms};

impl CurveAnswer<'_> {
    /// `report.html`, `report.json`, `residuals.csv`, `curve.svg` and `curve.png`.
    ///
    /// # Errors
    /// A picture that cannot be drawn.
    pub fn files(self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let picture = picture::picture(self.report)?;
        let [svg, png] = picture.files()?;
        Ok(vec![
            ("report.html".to_owned(), page::page(self, &picture)?),
            ("report.json".to_owned(), json_file(&self.record())?),
            ("residuals.csv".to_owned(), residuals::of_curve(&self.report.rows)),
            svg,
            png,
        ])
    }

    /// What `report.json` holds.
    pub fn record(&self) -> Record<'_, CurveReport> {
        Record { report: self.report, not_tried: self.not_tried }
    }

    /// The diagnosis for the terminal; `folder` is where its files were written.
    pub fn text(self, folder: &Path) -> String {
        text::text(self, folder)
    }
}
