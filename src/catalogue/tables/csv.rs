//! Tables as comma-separated values: UTF-8 with a header. A cell without a value is empty, and numbers have as many
//! digits as it takes to read them back bit for bit. A text that a spreadsheet would take for a formula has an apostrophe
//! before it.

use std::io;

use crate::catalogue::error::CatalogueError;
use crate::catalogue::folder::Folder;
use crate::catalogue::units::unit;
use crate::store::{Cell, ColumnKind, Store, StoreError, Table};

/// Writes a table row by row; returns the number of rows.
pub(super) fn write(
    folder: &mut Folder,
    store: &Store,
    table: &Table,
    path: &str,
) -> Result<u64, CatalogueError> {
    let mut rows = 0;
    let mut read = Ok(());
    folder.stream(path, |out| {
        let mut csv = ::csv::Writer::from_writer(out);
        csv.write_record(table.columns.iter().map(|column| column.name.as_str()))?;
        // A failure to read ends the file, too, and is the one to report.
        match store.rows(table, |cells| {
            rows += 1;
            csv.write_record(cells.iter().map(text)).map_err(|e| Failure::Write(e.into()))
        }) {
            Ok(()) => csv.flush(),
            Err(Failure::Write(reason)) => Err(reason),
            Err(Failure::Read(error)) => {
                read = Err(error);
                Ok(())
            }
        }
    })?;
    read?;
    Ok(rows)
}

enum Failure {
    Read(StoreError),
    Write(io::Error),
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Failure {
        Failure::Read(error)
    }
}

fn text(cell: &Cell) -> String {
    match cell {
        Cell::Null => String::new(),
        Cell::Integer(number) => number.to_string(),
        Cell::Real(number) => format!("{number:?}"),
        Cell::Text(text) if is_formula(text) => format!("'{text}"),
        Cell::Text(text) => (*text).to_owned(),
    }
}

/// Whether a spreadsheet would compute a text, which can send the table to a stranger.
fn is_formula(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err()
}

/// The units of all numeric columns, one per line.
pub(super) fn units(tables: &[Table]) -> Vec<u8> {
    let mut lines = "table,column,ucum,note\n".to_owned();
    for table in tables {
        for column in table.columns.iter().filter(|column| column.kind != ColumnKind::Text) {
            let (code, note) = match unit(&table.name, &column.name) {
                Ok(code) => (code, String::new()),
                Err(place) => ("", format!("the unit is in {place}")),
            };
            lines += &format!("{},{},{code},{note}\n", table.name, column.name);
        }
    }
    lines.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_is_a_formula() {
        let cell = |words: &str| text(&Cell::Text(words));
        for words in ["=HYPERLINK(\"http://x\")", "+A1", "-A1+2", "@SUM(A1)", "\t=1"] {
            assert_eq!(cell(words), format!("'{words}"));
        }
        for words in ["", "-40", "+1e3", "a = 1", "paint"] {
            assert_eq!(cell(words), words);
        }
    }
}
