//! Descriptions of a complete data set.

use serde::Serialize;
use serde_json::Value;

use super::archive::archive;
use super::boxes;
use super::card::card;
use super::croissant;
use super::layout::SCANS;
use super::plan::Dataset;
use super::scans;
use crate::error::Error;
use crate::files::read_whole;

/// What was published.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DatasetPublication {
    /// Number of scans.
    pub scans: u32,
    /// Files that were written.
    pub files: Vec<String>,
    /// What a person should not overlook.
    pub notices: Vec<String>,
}

impl Dataset {
    /// Writes `croissant.json`, the page `README.md`, and the boxes of each shard in the forms of COCO and of Pascal VOC.
    ///
    /// # Errors
    /// A data set that is not complete and sound; files that cannot be written.
    pub fn publish(&self) -> Result<DatasetPublication, Error> {
        let found = self.check();
        if let Some(problem) = found.problems.first() {
            return Err(Error::usage(
                format!("{} is not complete: {problem}", self.folder.display()),
                "`matdb dataset run` makes what is missing",
            ));
        }
        let rows = self.rows()?;
        let columns = scans::columns(rows.iter().flat_map(|(_, rows)| rows));
        let columns: Vec<_> = columns.into_iter().map(|(column, _)| column).collect();
        let table = read_whole(&self.folder.join(SCANS))?;
        let document = croissant::document(self, &table, &columns);
        let mut files = vec![
            ("croissant.json".to_owned(), pretty(&document)),
            ("README.md".to_owned(), card(self, &columns).into_bytes()),
        ];
        if self.recipe.spec.images {
            for (name, rows) in &rows {
                let coco = boxes::coco(&self.plan.classes, rows);
                files.push((format!("coco/{name}.json"), pretty(&coco)));
                files.push((format!("voc/{name}.tar"), archive(&boxes::voc(rows))?));
            }
        }
        self.write(&files)?;
        let mut published =
            DatasetPublication { scans: found.scans, ..DatasetPublication::default() };
        published.files = files.into_iter().map(|(name, _)| name).collect();
        if self.recipe.spec.licence.is_empty() {
            let notice =
                "the specification states no licence, without which others cannot use the data set";
            published.notices.push(notice.to_owned());
        }
        Ok(published)
    }
}

fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}
