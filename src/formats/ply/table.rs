//! PLY to table of numbers, and back: a point cloud with whatever was measured at each point.

use super::body::{Body, Row};
use super::header::{Header, Scalar, Shape};
use crate::formats::error::FormatError;

/// The scalar properties of a PLY file's `vertex` element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Free text, a line each.
    pub comments: Vec<String>,
    /// Columns in the file's order, all of one length.
    pub columns: Vec<Column>,
}

/// One property of every point.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The property's name: letters, digits, `_` and `-`, not beginning with a digit or `-`.
    pub name: String,
    /// How a file stores it.
    pub scalar: Scalar,
    /// A value per point; an `f64` holds every [`Scalar`] of up to 53 bits exactly.
    pub values: Vec<f64>,
}

impl Table {
    /// The values of a column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Number of points.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }
}

/// Reads the comments and the `vertex` element of a PLY file; its lists and the other elements are
/// passed over.
///
/// # Errors
///
/// Names the line or byte at which the file breaks its format or its header, and tells when there is
/// no `vertex` element.
pub fn read_table(bytes: &[u8]) -> Result<Table, FormatError> {
    let header = Header::read(bytes)?;
    let mut body = Body::new(&header, bytes.len());
    for element in &header.elements {
        if element.name != "vertex" {
            body.skip(element)?;
            continue;
        }
        let scalars = element.properties.iter().enumerate().filter_map(|(at, p)| match p.shape {
            Shape::Scalar(scalar) => {
                let values = Vec::with_capacity(element.count);
                Some((at, Column { name: p.name.clone(), scalar, values }))
            }
            Shape::List { .. } => None,
        });
        let mut columns: Vec<(usize, Column)> = scalars.collect();
        body.for_each_row(element, None, |_, Row { scalars, .. }| {
            columns.iter_mut().for_each(|(at, column)| column.values.push(scalars[*at]));
            Ok(())
        })?;
        let columns = columns.into_iter().map(|(_, column)| column).collect();
        return Ok(Table { comments: header.comments, columns });
    }
    Err(FormatError::at("header", "there is no vertex element", "check that this is a point cloud"))
}

/// Writes a table as the `vertex` element of a binary little-endian PLY file.
///
/// Control characters in comments become blanks. Values of a `float` column are rounded to single
/// precision.
///
/// # Errors
///
/// Names the column that is shorter or longer than the first, has a name that no reader would
/// understand or that another has too, or has a value that its integer type cannot hold.
pub fn write_table(table: &Table) -> Result<Vec<u8>, FormatError> {
    check(table)?;
    let mut bytes = header_text(table).into_bytes();
    for row in 0..table.rows() {
        for column in &table.columns {
            put(&mut bytes, column.scalar, column.values[row]);
        }
    }
    Ok(bytes)
}

/// Refuses a table that has no form as PLY.
fn check(table: &Table) -> Result<(), FormatError> {
    let rows = table.rows();
    for (at, Column { name, scalar, values }) in table.columns.iter().enumerate() {
        if !is_name(name) {
            return Err(column_fault(
                name,
                "is not a PLY name",
                "use letters, digits and underscores",
            ));
        }
        if table.columns[..at].iter().any(|other| other.name == *name) {
            return Err(column_fault(name, "is there twice", "rename one"));
        }
        if values.len() != rows {
            let problem = format!("has {} values where the first has {rows}", values.len());
            return Err(column_fault(name, problem, "give all columns one length"));
        }
        if let Some(row) = values.iter().position(|&value| !scalar.holds(value)) {
            let problem = format!("row {row}: {} cannot hold {}", scalar.name(), values[row]);
            return Err(column_fault(name, problem, "use a wider type"));
        }
    }
    Ok(())
}

fn column_fault(name: &str, problem: impl Into<String>, way_out: &str) -> FormatError {
    FormatError::at(format!("column {name:?}"), problem, way_out)
}

fn is_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
}

fn header_text(table: &Table) -> String {
    let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".to_owned()];
    lines.extend(table.comments.iter().map(|comment| format!("comment {}", one_line(comment))));
    lines.push(format!("element vertex {}", table.rows()));
    for Column { name, scalar, .. } in &table.columns {
        lines.push(format!("property {} {name}", scalar.name()));
    }
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}

fn one_line(comment: &str) -> String {
    comment.replace(char::is_control, " ")
}

fn put(bytes: &mut Vec<u8>, scalar: Scalar, value: f64) {
    match scalar {
        Scalar::Char => bytes.extend((value as i8).to_le_bytes()),
        Scalar::UChar => bytes.extend((value as u8).to_le_bytes()),
        Scalar::Short => bytes.extend((value as i16).to_le_bytes()),
        Scalar::UShort => bytes.extend((value as u16).to_le_bytes()),
        Scalar::Int => bytes.extend((value as i32).to_le_bytes()),
        Scalar::UInt => bytes.extend((value as u32).to_le_bytes()),
        Scalar::Float => bytes.extend((value as f32).to_le_bytes()),
        Scalar::Double => bytes.extend(value.to_le_bytes()),
        Scalar::Long => bytes.extend((value as i64).to_le_bytes()),
        Scalar::ULong => bytes.extend((value as u64).to_le_bytes()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let column = |name: &str, scalar, values: &[f64]| Column {
            name: name.to_owned(),
            scalar,
            values: values.to_vec(),
        };
        Table {
            comments: vec!["seed 7".to_owned(), String::new(), "power in dBm, µ ± σ".to_owned()],
            columns: vec![
                column("x", Scalar::Double, &[0.1, -1e-300, f64::INFINITY]),
                column("power_dbm", Scalar::Float, &[-60.5, -0.0, 3.0]),
                column("facet", Scalar::UInt, &[0.0, 1.0, f64::from(u32::MAX)]),
                column("offset", Scalar::Int, &[f64::from(i32::MIN), 0.0, 5.0]),
                column("part", Scalar::UShort, &[0.0, 65535.0, 7.0]),
                column("step", Scalar::Short, &[-32768.0, 32767.0, 7.0]),
                column("flag", Scalar::UChar, &[0.0, 255.0, 7.0]),
                column("sign", Scalar::Char, &[-128.0, 127.0, 7.0]),
                column("label", Scalar::Long, &[-9007199254740992.0, 0.0, 7.0]),
                column("serial", Scalar::ULong, &[9007199254740992.0, 0.0, 7.0]),
            ],
        }
    }

    #[test]
    fn what_is_written_is_read() {
        assert_eq!(read_table(&write_table(&table()).unwrap()), Ok(table()));
    }

    #[test]
    fn an_empty_table_is_written_and_read() {
        let empty = Table::default();
        assert_eq!(read_table(&write_table(&empty).unwrap()), Ok(empty));
    }

    #[test]
    fn nan_survives() {
        let mut nan = table();
        nan.columns[0].values[1] = f64::NAN;
        let back = read_table(&write_table(&nan).unwrap()).unwrap();
        assert!(back.column("x").unwrap()[1].is_nan());
    }

    #[test]
    fn comments_cannot_break_the_header() {
        let mut hostile = table();
        hostile.comments = vec!["a\nend_header\r\nelement face 9\u{85}\0".to_owned()];
        let back = read_table(&write_table(&hostile).unwrap()).unwrap();
        assert_eq!(back.comments, ["a end_header  element face 9  "]);
        assert_eq!(back.columns, hostile.columns);
    }

    #[test]
    fn columns_that_no_file_could_hold_are_refused() {
        let refused = |change: fn(&mut Table), expected: &str| {
            let mut bad = table();
            change(&mut bad);
            let problem = write_table(&bad).unwrap_err().to_string();
            assert!(problem.starts_with(expected), "{problem}");
        };
        refused(|t| t.columns[1].values.truncate(2), "column \"power_dbm\": has 2 values where");
        refused(|t| t.columns[1].name = "x".into(), "column \"x\": is there twice");
        refused(
            |t| t.columns[1].name = "power dbm".into(),
            "column \"power dbm\": is not a PLY name",
        );
        refused(|t| t.columns[2].values[1] = -1.0, "column \"facet\": row 1: uint cannot hold -1");
        refused(|t| t.columns[2].values[1] = f64::NAN, "column \"facet\": row 1: uint cannot hold");
        refused(|t| t.columns[6].values[2] = 0.5, "column \"flag\": row 2: uchar cannot hold 0.5");
    }

    #[test]
    fn other_elements_and_lists_are_passed_over_in_every_encoding() {
        let header = "element sensor 1\nproperty list uchar uchar id\nelement vertex 2\n\
                      property ushort x\nproperty list uchar short neighbours\n\
                      property uchar hits\nelement face 1\nproperty int n\nend_header\n";
        let body = |encoding: &str, bytes: &[u8]| {
            [format!("ply\nformat {encoding} 1.0\n{header}").as_bytes(), bytes].concat()
        };
        let files = [
            body("ascii", b"2 1 1\n258 1 -1 3\n\n5 0 4\n7\n"),
            body("binary_little_endian", &[2, 1, 1, 2, 1, 1, 255, 255, 3, 5, 0, 0, 4, 7, 0, 0, 0]),
            body("binary_big_endian", &[2, 1, 1, 1, 2, 1, 255, 255, 3, 0, 5, 0, 4, 0, 0, 0, 7]),
        ];
        for file in files {
            let table = read_table(&file).unwrap();
            assert_eq!(table.column("x"), Some([258.0, 5.0].as_slice()));
            assert_eq!(table.column("hits"), Some([3.0, 4.0].as_slice()));
            assert_eq!(table.columns.len(), 2);
        }
    }

    #[test]
    fn ascii_integers_must_fit_their_type() {
        let file = |value: &str| {
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty uchar hits\nend_header\n{value}\n"
            )
        };
        assert!(read_table(file("255.0").as_bytes()).is_ok());
        for value in ["256", "-1", "1.5", "nan", ""] {
            assert!(read_table(file(value).as_bytes()).is_err(), "{value}");
        }
    }

    #[test]
    fn a_file_without_vertices_says_so() {
        let problem = read_table(b"ply\nformat ascii 1.0\nend_header\n").unwrap_err();
        assert!(problem.to_string().starts_with("header: there is no vertex element"));
    }
}
