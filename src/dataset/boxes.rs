//! Boxes of instances in the forms that detectors are trained with.

use serde_json::{Value, json};

use super::images::{ImageRecord, InstanceBox, Members};
use super::labels::Classes;
use super::scan::ScanRow;
use crate::formats::xml::escaped;

/// The boxes of some scans in the form of COCO.
pub(super) fn coco(classes: &Classes, rows: &[ScanRow]) -> Value {
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    let instances = classes.instances.len() as u32;
    for row in rows {
        let Some(record) = &row.image else { continue };
        // Unique in the whole data set, and from 1: readers take 0 for none.
        let image = row.scan + 1;
        images.push(json!({
            "id": image,
            "file_name": image_of(row),
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

/// The boxes of some scans in the form of Pascal VOC: a document for each scan.
pub(super) fn voc(rows: &[ScanRow]) -> Vec<(&str, Members)> {
    let mut documents = Vec::new();
    for row in rows {
        let Some(record) = &row.image else { continue };
        let document = annotation(&image_of(row), record).into_bytes();
        documents.push((row.key.as_str(), vec![("xml".to_owned(), document)]));
    }
    documents
}

/// Pixels count from 1, and both corners of a box are within it.
fn annotation(image: &str, ImageRecord { width, height, boxes, .. }: &ImageRecord) -> String {
    let mut text = format!(
        "<annotation>\n  <folder>images</folder>\n  <filename>{}</filename>\n  \
         <size><width>{width}</width><height>{height}</height><depth>1</depth></size>\n",
        escaped(image)
    );
    for InstanceBox { name, bbox, .. } in boxes {
        let &Some([column, row, width, height]) = bbox else { continue };
        text += &format!(
            "  <object>\n    <name>{}</name>\n    <bndbox><xmin>{}</xmin><ymin>{}</ymin><xmax>{}</xmax><ymax>{}</ymax></bndbox>\n  \
             </object>\n",
            escaped(name),
            column + 1,
            row + 1,
            column + width,
            row + height
        );
    }
    text + "</annotation>\n"
}

/// Name of the image that boxes are of.
fn image_of(row: &ScanRow) -> String {
    format!("{}.power.exr", row.key)
}
