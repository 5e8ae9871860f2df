//! Descriptions of a complete data set.

use serde::Serialize;
use serde_json::{Value, json};

use super::card::card;
use super::croissant;
use super::labels::Classes;
use super::layout::SCANS;
use super::plan::Dataset;
use super::scan::ScanRow;
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
    /// Writes `croissant.json`, the page `README.md`, and the boxes of each shard in the form of COCO.
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
                files.push((format!("coco/{name}.json"), pretty(&coco(&self.plan.classes, rows))));
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

/// The boxes of some scans in the form of COCO.
fn coco(classes: &Classes, rows: &[ScanRow]) -> Value {
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    let instances = classes.instances.len() as u32;
    for row in rows {
        let Some(record) = &row.image else { continue };
        // Unique in the whole data set, and from 1: readers take 0 for none.
        let image = row.scan + 1;
        images.push(json!({
            "id": image,
            "file_name": format!("{}.power.exr", row.key),
            "width": record.width,
            "height": record.height,
        }));
        for one in &record.boxes {
            let Some(bbox) = one.bbox else { continue };
            annotations.push(json!({
                "id": row.scan * instances + u32::from(one.instance),
                "image_id": image,
                "category_id": one.instance,
                "bbox": bbox,
                "area": one.pixels,
                "iscrowd": 0,
            }));
        }
    }
    let categories = (1u16..).zip(&classes.instances).map(|(id, name)| {
        let kind = if classes.objects.contains(name) { "object" } else { "surroundings" };
        json!({"id": id, "name": name, "supercategory": kind})
    });
    json!({"images": images, "annotations": annotations, "categories": categories.collect::<Vec<_>>()})
}

fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}
