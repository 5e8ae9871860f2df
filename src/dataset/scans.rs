//! The table of all scans: a row for each, with everything that was drawn for it.

use std::collections::BTreeSet;

use super::scan::ScanRow;
use super::table::{self, Column, Kind, Values};
use crate::error::Error;

/// A scan with the name of its shard.
pub(super) type Row = (String, ScanRow);
/// How a column is filled from all rows.
type Fill = Box<dyn Fn(&[Row]) -> Values>;

/// The table.
///
/// # Errors
/// What cannot be encoded.
pub(super) fn table(rows: &[Row]) -> Result<Vec<u8>, Error> {
    let columns = columns(rows.iter().map(|(_, row)| row));
    let values: Vec<Values> = columns.iter().map(|(_, fill)| fill(rows)).collect();
    let described: Vec<Column> = columns.into_iter().map(|(column, _)| column).collect();
    table::write("scans", &described, [&values[..]])
}

/// The columns of the table of these scans, in their order.
pub(super) fn columns<'a>(rows: impl Iterator<Item = &'a ScanRow>) -> Vec<(Column, Fill)> {
    let (mut options, mut numbers, mut texts) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for row in rows {
        options.extend(row.options.keys().cloned());
        numbers.extend(row.numbers.keys().cloned());
        texts.extend(row.texts.keys().cloned());
    }
    let mut columns = vec![
        text("key", "name of the scan, which its images have", |(_, row)| row.key.clone()),
        text("split", "split", |(_, row)| row.split.clone()),
        text("shard", "name of the files that hold it", |(shard, _)| shard.clone()),
        text("shapes", "hash of its placed meshes", |(_, row)| row.shapes.clone()),
        count("scan", "number of the scan, as in the tables of points", |row| row.scan),
        count("target", "number of its target, the same for repeats", |row| row.target),
        count("chirps", "chirps", |row| row.chirps),
        count("hits", "chirps whose axis hits something", |row| row.hits),
        count("detections", "returns of the radar at or above the threshold", |row| row.detections),
        count("threat_chirps", "chirps whose axis hits an object that is looked for", |row| {
            row.threat_chirps
        }),
        seed("seed", "seed of the target", |row| row.seed),
        seed("noise_seed", "seed of the noise", |row| row.noise_seed),
    ];
    for key in numbers {
        let about = format!(
            "what was drawn for {key}, in the unit that its name ends in; NaN where nothing was"
        );
        let column = column(&key, Kind::Double, &about);
        let value = move |(_, row): &Row| row.numbers.get(&key).copied().unwrap_or(f64::NAN);
        columns.push((column, of_each(value, Values::Doubles)));
    }
    for key in texts {
        let about = format!("what was drawn for {key}");
        columns.push(text(&key.clone(), &about, move |(_, row)| {
            row.texts.get(&key).cloned().unwrap_or_default()
        }));
    }
    for name in options {
        let about = format!("what was chosen of {name}");
        columns.push(text(&format!("choose.{name}"), &about, move |(_, row)| {
            row.options.get(&name).cloned().unwrap_or_default()
        }));
    }
    columns
}

fn column(name: &str, kind: Kind, about: &str) -> Column {
    Column { name: name.to_owned(), kind, unit: "", about: about.to_owned() }
}

fn of_each<T: 'static>(value: impl Fn(&Row) -> T + 'static, values: fn(Vec<T>) -> Values) -> Fill {
    Box::new(move |rows| values(rows.iter().map(&value).collect()))
}

fn text(name: &str, about: &str, value: impl Fn(&Row) -> String + 'static) -> (Column, Fill) {
    (column(name, Kind::Text, about), of_each(value, Values::Texts))
}

fn count(name: &str, about: &str, value: fn(&ScanRow) -> u32) -> (Column, Fill) {
    let fill = of_each(move |(_, row)| value(row) as i32, Values::Ints);
    (column(name, Kind::Int32, about), fill)
}

fn seed(name: &str, about: &str, value: fn(&ScanRow) -> u64) -> (Column, Fill) {
    let fill = of_each(move |(_, row)| value(row) as i64, Values::Longs);
    (column(name, Kind::Int64, about), fill)
}
