//! The table of all scans: a row for each, with everything that was drawn for it.

use std::collections::BTreeSet;

use super::scan::ScanRow;
use super::table::{self, Column, Kind, Values};
use crate::error::Error;

/// The table, of the rows with the names of their shards.
///
/// # Errors
/// What cannot be encoded.
pub(super) fn table(rows: &[(String, ScanRow)]) -> Result<Vec<u8>, Error> {
    let columns = columns(rows.iter().map(|(_, row)| row));
    let (described, values) = columns
        .iter()
        .map(|(column, value)| (column.clone(), value(rows)))
        .unzip::<_, _, Vec<_>, Vec<_>>();
    table::write("scans", &described, [values])
}

/// A seed of a scan.
type Seed = fn(&ScanRow) -> u64;
/// How a column is filled from all rows.
type Fill = Box<dyn Fn(&[(String, ScanRow)]) -> Values>;

/// The columns of the table of these scans, in their order.
pub(super) fn columns<'a>(rows: impl Iterator<Item = &'a ScanRow>) -> Vec<(Column, Fill)> {
    let (mut options, mut numbers, mut texts_drawn) =
        (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for row in rows {
        texts_drawn.extend(row.texts.keys().cloned());
        options.extend(row.options.keys().cloned());
        numbers.extend(row.numbers.keys().cloned());
    }
    let mut columns: Vec<(Column, Fill)> = Vec::new();
    let mut texts = |name: &str, about: &str, value: fn(&(String, ScanRow)) -> String| {
        columns.push((
            column(name, Kind::Text, about),
            Box::new(move |rows| Values::Texts(rows.iter().map(value).collect())),
        ));
    };
    texts("key", "name of the scan, which its images have", |(_, row)| row.key.clone());
    texts("split", "split", |(_, row)| row.split.clone());
    texts("shard", "name of the files that hold it", |(shard, _)| shard.clone());
    texts("shapes", "hash of its placed meshes", |(_, row)| row.shapes.clone());
    let mut counts = |name: &str, about: &str, value: fn(&ScanRow) -> u32| {
        columns.push((
            column(name, Kind::Int32, about),
            Box::new(move |rows| {
                Values::Ints(rows.iter().map(|(_, row)| value(row) as i32).collect())
            }),
        ));
    };
    counts("scan", "number of the scan, as in the tables of points", |row| row.scan);
    counts("target", "number of its target, the same for repeats", |row| row.target);
    counts("chirps", "chirps", |row| row.chirps);
    counts("hits", "chirps whose axis hits something", |row| row.hits);
    counts("detections", "returns of the radar at or above the threshold", |row| row.detections);
    counts("threat_chirps", "chirps whose axis hits an object that is looked for", |row| {
        row.threat_chirps
    });
    let seeds: [(&str, &str, Seed); 2] = [
        ("seed", "seed of the target", |row| row.seed),
        ("noise_seed", "seed of the noise", |row| row.noise_seed),
    ];
    for (name, about, value) in seeds {
        columns.push((
            column(name, Kind::Int64, about),
            Box::new(move |rows| {
                Values::Longs(rows.iter().map(|(_, row)| value(row) as i64).collect())
            }),
        ));
    }
    let mut doubles = |name: String, about: String, value: Box<dyn Fn(&ScanRow) -> f64>| {
        columns.push((
            Column { name, kind: Kind::Double, unit: "", about },
            Box::new(move |rows| Values::Doubles(rows.iter().map(|(_, row)| value(row)).collect())),
        ));
    };
    for key in numbers {
        let about = format!(
            "what was drawn for {key}, in the unit that its name ends in; NaN where nothing was"
        );
        let of_row = key.clone();
        doubles(
            key,
            about,
            Box::new(move |row| row.numbers.get(&of_row).copied().unwrap_or(f64::NAN)),
        );
    }
    for key in texts_drawn {
        let column = column(&key, Kind::Text, &format!("what was drawn for {key}"));
        columns.push((
            column,
            Box::new(move |rows| {
                let texts =
                    rows.iter().map(|(_, row)| row.texts.get(&key).cloned().unwrap_or_default());
                Values::Texts(texts.collect())
            }),
        ));
    }
    for name in options {
        let about = format!("what was chosen of {name}");
        let column = column(&format!("choose.{name}"), Kind::Text, &about);
        columns.push((
            column,
            Box::new(move |rows| {
                Values::Texts(
                    rows.iter()
                        .map(|(_, row)| row.options.get(&name).cloned().unwrap_or_default())
                        .collect(),
                )
            }),
        ));
    }
    columns
}

fn column(name: &str, kind: Kind, about: &str) -> Column {
    Column { name: name.to_owned(), kind, unit: "", about: about.to_owned() }
}
