//! CSV tables with a header, and errors that name the line and the column.

use super::error::FormatError;

/// A table of text cells under named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Row>,
}

/// One line of a [`Table`].
#[derive(Clone, Debug, PartialEq)]
struct Row {
    line: u64,
    cells: Vec<String>,
}

/// A cell with its place, for errors.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    /// Line in the file, from 1.
    pub line: u64,
    /// Name of the column.
    pub column: &'a str,
    /// The text, trimmed.
    pub text: &'a str,
}

impl Table {
    /// Reads a table whose header holds all of `required` and nothing beyond those and `optional`.
    pub fn read(bytes: &[u8], required: &[&str], optional: &[&str]) -> Result<Table, FormatError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
        let header = reader.headers().map_err(malformed)?.clone();
        let columns: Vec<String> = header.iter().map(str::to_owned).collect();
        check_header(&columns, required, optional)?;
        let rows = reader
            .records()
            .map(|record| {
                let record = record.map_err(malformed)?;
                let line = record.position().map_or(0, csv::Position::line);
                Ok(Row { line, cells: record.iter().map(str::to_owned).collect() })
            })
            .collect::<Result<_, FormatError>>()?;
        Ok(Table { columns, rows })
    }

    /// Number of rows below the header.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row below the header.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The cell of a row and column; `None` where the column is absent or the cell is empty.
    pub fn cell<'a>(&'a self, row: usize, column: &'a str) -> Option<Cell<'a>> {
        let index = self.columns.iter().position(|c| c == column)?;
        let row = self.rows.get(row)?;
        let text = row.cells.get(index)?.as_str();
        (!text.is_empty()).then_some(Cell { line: row.line, column, text })
    }

    /// A finite number; `None` where the cell is absent or empty.
    pub fn number(&self, row: usize, column: &str) -> Result<Option<f64>, FormatError> {
        self.cell(row, column).map(|cell| cell.number()).transpose()
    }

    /// Whether there is such a column.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|known| known == column)
    }

    /// A finite number that must be there.
    pub fn required_number(&self, row: usize, column: &str) -> Result<f64, FormatError> {
        self.number(row, column)?.ok_or_else(|| {
            let place = format!("{}, column {column}", self.place(row));
            FormatError::at(place, "the cell is empty", "fill in a number")
        })
    }

    /// A number from the least to the greatest; `None` where the cell is absent or empty.
    pub fn number_within(
        &self,
        row: usize,
        column: &str,
        (least, greatest): (f64, f64),
    ) -> Result<Option<f64>, FormatError> {
        let value = self.number(row, column)?;
        match self.cell(row, column) {
            Some(cell) if value.is_some_and(|v| !(least..=greatest).contains(&v)) => {
                Err(cell.refuse(&format!("give a value from {least} to {greatest}")))
            }
            _ => Ok(value),
        }
    }

    /// A whole number of 32 bits that must be there.
    pub fn whole_number(&self, row: usize, column: &str) -> Result<u32, FormatError> {
        let value = self.required_number(row, column)?;
        let is_whole = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
        match self.cell(row, column) {
            Some(cell) if !is_whole => Err(cell.refuse("fill in a whole number, 0 or greater")),
            _ => Ok(value as u32),
        }
    }

    /// The line of a row in the file, from 1.
    pub fn line(&self, row: usize) -> usize {
        self.rows.get(row).map_or(0, |row| row.line as usize)
    }

    /// Where a row stands in the file: `line L`.
    pub fn place(&self, row: usize) -> String {
        format!("line {}", self.line(row))
    }
}

impl Cell<'_> {
    /// The cell as a finite number.
    pub fn number(&self) -> Result<f64, FormatError> {
        let value: f64 = self.text.parse().unwrap_or(f64::NAN);
        if value.is_finite() { Ok(value) } else { Err(self.refuse("fill in a finite number")) }
    }

    /// An error that shows the cell and its place.
    pub fn refuse(&self, way_out: &str) -> FormatError {
        FormatError::at(
            format!("line {}, column {}", self.line, self.column),
            format!("`{}` is not accepted here", self.text),
            way_out,
        )
    }
}

/// Refuses a header that lacks a required column, or holds an unknown one or one twice.
fn check_header(
    columns: &[String],
    required: &[&str],
    optional: &[&str],
) -> Result<(), FormatError> {
    for (mark, name) in [(';', "semicolons"), ('\t', "tabs")] {
        if required.len() > 1 && matches!(columns, [only] if only.contains(mark)) {
            let problem = format!("the cells are separated by {name}");
            return Err(FormatError::at(
                "line 1",
                problem,
                "separate them with commas, and write numbers with a point, as in -3.5",
            ));
        }
    }
    let known: Vec<&str> = required.iter().chain(optional).copied().collect();
    let problem = if let Some(missing) = required.iter().find(|r| !columns.iter().any(|c| c == *r))
    {
        format!("there is no column `{missing}`")
    } else if let Some(unknown) = columns.iter().find(|c| !known.contains(&c.as_str())) {
        format!("unknown column `{unknown}`")
    } else if let Some(at) = (1..columns.len()).find(|&at| columns[..at].contains(&columns[at])) {
        format!("column `{}` is there twice", columns[at])
    } else {
        return Ok(());
    };
    Err(FormatError::at("line 1", problem, format!("the columns are {}", known.join(", "))))
}

fn malformed(error: csv::Error) -> FormatError {
    let line = error.position().map_or(1, csv::Position::line);
    let problem = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} cells under a header of {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "the text is not UTF-8".to_owned(),
        _ => "the text is not CSV".to_owned(),
    };
    FormatError::at(format!("line {line}"), problem, "mend the line")
}

/// The bytes with the comment lines at the head emptied, so that the other lines keep their numbers.
pub fn without_head(bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    let mut is_head = true;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        is_head &= line.starts_with(b"#") || line.trim_ascii().is_empty();
        kept.extend_from_slice(if is_head { b"\n" } else { line });
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Table, FormatError> {
        Table::read(text.as_bytes(), &["theta_deg"], &["sigma0_db"])
    }

    #[test]
    fn cells_are_found_by_column() {
        let table = read("sigma0_db,theta_deg\n-3.5, 10\n,20\n").unwrap();
        assert_eq!(table.len(), 2);
        assert_eq!(table.required_number(0, "theta_deg").unwrap(), 10.0);
        assert_eq!(table.number(0, "sigma0_db").unwrap(), Some(-3.5));
        assert_eq!(table.number(1, "sigma0_db").unwrap(), None);
    }

    #[test]
    fn errors_name_line_and_column() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        assert!(message("sigma0_db\n1").contains("no column `theta_deg`"));
        let table = Table::read(b"theta_deg;sigma0_db\n1;-3,5\n", &["theta_deg", "sigma0_db"], &[]);
        let refused = table.unwrap_err().to_string();
        assert!(refused.starts_with("line 1: the cells are separated by semicolons;"), "{refused}");
        assert!(message("theta_deg,x\n1,2").contains("unknown column `x`"));
        assert!(message("theta_deg,theta_deg\n1,2").contains("twice"));
        assert!(message("theta_deg\n1\n2,3\n").starts_with("line 3: 2 cells"));
        let table = read("theta_deg\n1\nnan\n").unwrap();
        let refused = table.required_number(1, "theta_deg").unwrap_err().to_string();
        assert!(refused.starts_with("line 3, column theta_deg: `nan`"), "{refused}");
    }
}
