//! The report on a cloud: page, record, table of residuals and pictures.

mod answer;
mod bars;
mod maps;
mod models;
mod outline;
mod page;
mod pictures;
mod places;
mod quantiles;
mod raster;
mod record;
#[cfg(test)]
pub(super) mod testing;
mod text;
mod trends;

use std::path::Path;

use self::raster::Plane;
use super::json::json_file;
use super::picture::Picture;
use super::residuals;
use super::view::diagnosis_page;
use super::words::sentence;
use crate::diagnose::Verdict;
use crate::error::Error;
use places::Peak;

pub use answer::{CloudAnswer, NextSteps};
pub(super) use maps::map_after;
pub(super) use outline::Outline;
pub(super) use raster::CHANNEL;
pub use record::CloudRecord;

/// A report on a cloud with its pictures drawn.
pub struct CloudReport<'a> {
    answer: CloudAnswer<'a>,
    pictures: Vec<Picture>,
    /// Where something unknown is strongest.
    peaks: Vec<Peak>,
    /// A sentence for each picture that could not be drawn.
    pub notices: Vec<String>,
}

impl<'a> CloudReport<'a> {
    /// Draws the pictures of a diagnosis.
    pub fn new(answer: CloudAnswer<'a>) -> CloudReport<'a> {
        let radar = answer.scene.radar();
        let (spot_m, range_m) = (radar.spot_fwhm_m(), radar.frames().pattern_range_m);
        let (pictures, notices) = pictures::pictures(answer.report, Plane { spot_m, range_m });
        let peaks = places::strongest(&answer.report.rows, spot_m);
        CloudReport { answer, pictures, peaks, notices }
    }

    /// `report.json` and `residuals.csv`.
    ///
    /// # Errors
    /// A number that JSON does not have.
    pub fn tables(&self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        Ok(vec![
            ("report.json".to_owned(), json_file(&self.record())?),
            ("residuals.csv".to_owned(), residuals::of_cloud(&self.answer.report.rows)),
        ])
    }

    /// [`CloudReport::tables`], `view.html`, and two files for every picture.
    ///
    /// # Errors
    /// A picture that is too large to be drawn.
    pub fn tables_and_pictures(&self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let mut files = self.tables()?;
        let CloudAnswer { scene, report, .. } = self.answer;
        files.push(("view.html".to_owned(), diagnosis_page(scene, report)?));
        for picture in &self.pictures {
            files.extend(picture.files()?);
        }
        Ok(files)
    }

    /// The bytes of `report.html`.
    ///
    /// # Errors
    /// A picture that cannot be drawn.
    pub fn page(&self, next: &NextSteps) -> Result<Vec<u8>, Error> {
        page::page(self.answer, &self.pictures, &self.peaks, next)
    }

    /// What `report.json` holds.
    pub fn record(&self) -> CloudRecord<'_> {
        CloudRecord::new(self.answer.report, self.answer.not_tried)
    }

    /// Why several clouds contradict each other, in a sentence; none where they do not.
    pub fn contradiction(&self) -> Option<String> {
        let report = self.answer.report;
        (report.verdict == Verdict::Contradictory).then(|| sentence(report))
    }

    /// The diagnosis for the terminal; `files` are the names of those that were written to `folder`.
    pub fn text(&self, files: &[String], folder: &Path) -> String {
        text::text(self.answer.report, &self.peaks, files, folder)
    }
}
