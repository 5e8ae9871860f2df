//! Tables of text with a header, in one dialect, and errors that name the line and the column.
//!
//! Cells are separated by what the header line has most of: commas, semicolons or tabs; blanks where it has none of
//! these. Where commas do not separate, one comma in a number is its decimal sign, as in `-3,5`. In a first line of such
//! numbers the commas do not count. A byte order mark and
//! lines of `#` or `//` at the head are passed over. The last of these has the names where numbers follow and it has a word
//! for each of them, as `numpy.savetxt` writes its header.

use csv::StringRecord;

use super::columns::{ColumnNames, passed_over, twice};
use super::error::FormatError;
use super::line::unmarked;

/// A table of text cells under named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Row>,
    separator: Separator,
}

/// One line of a [`Table`].
#[derive(Clone, Debug, PartialEq)]
struct Row {
    line: u64,
    cells: StringRecord,
}

/// What stands between two cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Byte(u8),
    Blanks,
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
    /// Whether a comma may be the decimal sign.
    has_decimal_commas: bool,
}

/// Whether the first line has the names of the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Names {
    /// It has.
    InFirstLine,
    /// It has, unless there is a number in it; the columns are then called 1, 2, 3 ….
    WhereTheyAre,
}

impl Table {
    /// Reads a table whose header holds all of `required` and nothing beyond those and `optional`.
    ///
    /// # Errors
    /// What the header lacks or has too much; the line that is not like the header.
    pub fn read(bytes: &[u8], required: &[&str], optional: &[&str]) -> Result<Table, FormatError> {
        let table = Table::parse(bytes, Names::InFirstLine)?;
        table.check(required)?;
        let known: Vec<&str> = required.iter().chain(optional).copied().collect();
        match table.unknown(&known).first() {
            None => Ok(table),
            Some(unknown) => Err(FormatError::at(
                "the header",
                format!("unknown column `{unknown}`"),
                format!("the columns are {}", known.join(", ")),
            )),
        }
    }

    /// Reads a table of any columns.
    ///
    /// # Errors
    /// The line that is not like the header.
    pub fn parse(bytes: &[u8], names: Names) -> Result<Table, FormatError> {
        let bytes = unmarked(bytes)?;
        let head = head(bytes);
        let bytes = without_head(bytes);
        let separator = Separator::of(&bytes);
        let mut rows = separator.rows(&bytes)?.into_iter().peekable();
        let first = rows.peek().map(|row| row.cells.clone()).unwrap_or_default();
        let has_decimal_commas = separator.has_decimal_commas();
        // NaN is no name, either.
        let has_numbers = first.iter().any(|text| parse(text, has_decimal_commas).is_some());
        let commented =
            head.filter(|_| has_numbers).and_then(|head| separator.names(head, first.len()));
        let columns = if let Some(commented) = commented {
            commented
        } else if has_numbers && names == Names::WhereTheyAre {
            (1..=first.len()).map(|number| number.to_string()).collect()
        } else {
            rows.next();
            first.iter().map(str::to_owned).collect()
        };
        let table = Table { columns, rows: rows.collect(), separator };
        table.rows.iter().try_for_each(|row| table.check_length(row))?;
        Ok(table)
    }

    fn check_length(&self, Row { line, cells }: &Row) -> Result<(), FormatError> {
        if cells.len() == self.columns.len() {
            return Ok(());
        }
        let problem = format!("{} cells under a header of {}", cells.len(), self.columns.len());
        Err(FormatError::at(format!("line {line}"), problem, "mend the line"))
    }

    /// Gives columns the names by which they are asked for.
    ///
    /// # Errors
    /// Names of no column, or of several.
    pub fn rename(&mut self, names: &ColumnNames) -> Result<(), FormatError> {
        names.apply(&mut self.columns)
    }

    /// Writes the names of all columns in lower case.
    pub fn lower_case(&mut self) {
        self.columns.iter_mut().for_each(|column| column.make_ascii_lowercase());
    }

    /// Refuses a table that lacks a required column or has one name twice.
    ///
    /// # Errors
    /// Which column it is.
    pub fn check(&self, required: &[&str]) -> Result<(), FormatError> {
        let problem = if let Some(missing) = required.iter().find(|name| !self.has(name)) {
            format!("there is no column `{missing}`")
        } else if let Some(name) = twice(&self.columns) {
            format!("column `{name}` is there twice")
        } else {
            return Ok(());
        };
        let way_out = format!(
            "the columns are {}; give another its name by --columns THEIRS=OURS, or pass it over by --columns THEIRS=-",
            self.columns.join(", ")
        );
        Err(FormatError::at("the header", problem, way_out))
    }

    /// The named columns that are not among those.
    pub fn unknown(&self, known: &[&str]) -> Vec<&str> {
        let columns = self.columns.iter().map(String::as_str);
        columns.filter(|column| !column.is_empty() && !known.contains(column)).collect()
    }

    /// A sentence on the columns that are not among those.
    pub fn passed_over(&self, known: &[&str]) -> Option<String> {
        passed_over(&self.unknown(known), known)
    }

    /// Names of the columns, in the file's order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(String::as_str)
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
        let text = row.cells.get(index)?;
        let has_decimal_commas = self.separator.has_decimal_commas();
        (!text.is_empty()).then_some(Cell { line: row.line, column, text, has_decimal_commas })
    }

    /// A finite number; `None` where the cell is absent or empty.
    pub fn number(&self, row: usize, column: &str) -> Result<Option<f64>, FormatError> {
        self.cell(row, column).map(|cell| cell.number()).transpose()
    }

    /// Whether there is such a column.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|known| known == column)
    }

    /// Whether the cell says that there is no number: `nan`.
    pub fn is_not_a_number(&self, row: usize, column: &str) -> bool {
        let number = self.cell(row, column).map(|cell| parse(cell.text, cell.has_decimal_commas));
        number.flatten().is_some_and(f64::is_nan)
    }

    /// Leaves out the rows that are not to be kept, in order.
    pub fn keep(&mut self, is_kept: &[bool]) {
        let mut kept = is_kept.iter();
        self.rows.retain(|_| *kept.next().unwrap_or(&false));
    }

    /// A finite number that must be there.
    pub fn required_number(&self, row: usize, column: &str) -> Result<f64, FormatError> {
        self.number(row, column)?.ok_or_else(|| {
            let place = format!("{}, column {column}", self.place(row));
            FormatError::at(place, "the cell is empty", "fill in a number, or leave the line out")
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
                let [least, greatest] = [least, greatest].map(bound);
                Err(cell.refuse(&format!("give a value from {least} to {greatest}")))
            }
            _ => Ok(value),
        }
    }

    /// A number from the least to the greatest that must be there.
    pub fn required_within(
        &self,
        row: usize,
        column: &str,
        range: (f64, f64),
    ) -> Result<f64, FormatError> {
        let value = self.required_number(row, column)?;
        Ok(self.number_within(row, column, range)?.unwrap_or(value))
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
        parse(self.text, self.has_decimal_commas)
            .filter(|number| number.is_finite())
            .ok_or_else(|| self.refuse("fill in a finite number"))
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

/// A number, NaN and infinity among them.
fn parse(text: &str, has_decimal_commas: bool) -> Option<f64> {
    match text.split_once(',') {
        Some((whole, part)) if has_decimal_commas && !text.contains('.') => {
            format!("{whole}.{part}").parse().ok()
        }
        _ => text.parse().ok(),
    }
}

impl Separator {
    /// What the first line has most of.
    fn of(bytes: &[u8]) -> Separator {
        let lines = bytes.split(|byte| *byte == b'\n');
        let first = lines.map(<[u8]>::trim_ascii).find(|line| !line.is_empty()).unwrap_or(b"");
        if let Some(separator) = Separator::of_decimal_commas(first) {
            return separator;
        }
        let mut is_quoted = false;
        let mut counts = [(b',', 0), (b';', 0), (b'\t', 0)];
        for byte in first {
            is_quoted ^= *byte == b'"';
            let counted = counts.iter_mut().filter(|(mark, _)| !is_quoted && mark == byte);
            counted.for_each(|(_, count)| *count += 1);
        }
        // The first of equals is the last that `max_by_key` sees.
        match counts.iter().rev().max_by_key(|(_, count)| *count) {
            Some(&(mark, 1..)) => Separator::Byte(mark),
            _ if first.contains(&b' ') => Separator::Blanks,
            _ => Separator::Byte(b','),
        }
    }

    /// What separates numbers with decimal commas, where a line has nothing else.
    fn of_decimal_commas(line: &[u8]) -> Option<Separator> {
        let line = std::str::from_utf8(line).ok()?;
        let is_number = |cell: &str| match cell.trim().split_once(',') {
            Some((_, "")) => false,
            _ => parse(cell.trim(), true).is_some(),
        };
        let has_numbers = |cells: &[&str]| {
            let has_comma = cells.iter().any(|cell| cell.contains(','));
            cells.len() > 1 && has_comma && cells.iter().all(|cell| is_number(cell))
        };
        let by = |mark: char| line.split(mark).collect::<Vec<&str>>();
        let words: Vec<&str> = line.split_whitespace().collect();
        if has_numbers(&by(';')) {
            Some(Separator::Byte(b';'))
        } else if has_numbers(&by('\t')) {
            Some(Separator::Byte(b'\t'))
        } else {
            has_numbers(&words).then_some(Separator::Blanks)
        }
    }

    fn has_decimal_commas(self) -> bool {
        self != Separator::Byte(b',')
    }

    /// Different names of so many columns in the last line of a head; `None` where it has no such names.
    fn names(self, head: &[u8], count: usize) -> Option<Vec<String>> {
        let text = std::str::from_utf8(head).ok()?;
        let words: Vec<String> = match self {
            Separator::Byte(mark) if text.contains(mark as char) => {
                text.split(mark as char).map(|word| word.trim().to_owned()).collect()
            }
            _ => text.split_whitespace().map(str::to_owned).collect(),
        };
        let is_name = |word: &String| !word.is_empty() && parse(word, true).is_none();
        let are_names = words.len() == count && words.iter().all(is_name);
        (are_names && twice(&words).is_none()).then_some(words)
    }

    fn rows(self, bytes: &[u8]) -> Result<Vec<Row>, FormatError> {
        match self {
            Separator::Blanks => rows_of_words(bytes),
            Separator::Byte(mark) => {
                let mut reader = csv::ReaderBuilder::new()
                    .delimiter(mark)
                    .trim(csv::Trim::All)
                    .has_headers(false)
                    .flexible(true)
                    .from_reader(bytes);
                let rows = reader.records().map(|record| {
                    let cells = record.map_err(malformed)?;
                    let line = cells.position().map_or(0, csv::Position::line);
                    Ok(Row { line, cells })
                });
                rows.collect()
            }
        }
    }
}

fn rows_of_words(bytes: &[u8]) -> Result<Vec<Row>, FormatError> {
    let mut rows = Vec::new();
    for (line, bytes) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = std::str::from_utf8(bytes).map_err(|_| {
            FormatError::at(format!("line {line}"), "the text is not UTF-8", "save it as UTF-8")
        })?;
        let cells = StringRecord::from_iter(text.split_whitespace());
        if !cells.is_empty() {
            rows.push(Row { line, cells });
        }
    }
    Ok(rows)
}

fn malformed(error: csv::Error) -> FormatError {
    let line = error.position().map_or(1, csv::Position::line);
    let (problem, way_out) = match error.kind() {
        csv::ErrorKind::Utf8 { .. } => ("the text is not UTF-8", "save the file as UTF-8"),
        _ => ("the text is not CSV", "mend the line"),
    };
    FormatError::at(format!("line {line}"), problem, way_out)
}

/// The bytes with the comment lines at the head emptied, so that the other lines keep their numbers.
/// The text of the last line of `#` or `//` before the table, without these marks.
fn head(bytes: &[u8]) -> Option<&[u8]> {
    let lines = bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let head = lines.take_while(|line| line.is_empty() || is_comment(line));
    let last = head.filter(|line| !line.is_empty()).last()?;
    let mark = last.iter().take_while(|byte| [b'#', b'/'].contains(byte)).count();
    Some(last[mark..].trim_ascii())
}

fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#") || line.starts_with(b"//")
}

fn without_head(bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    let mut is_head = true;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let text = line.trim_ascii();
        is_head &= text.is_empty() || is_comment(text);
        kept.extend_from_slice(if is_head { b"\n" } else { line });
    }
    kept
}

/// A bound in a sentence, with a power of ten where there are many zeros.
fn bound(value: f64) -> String {
    let is_plain = value == 0.0 || (1e-4..1e7).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Table, FormatError> {
        Table::read(text.as_bytes(), &["theta_deg"], &["sigma0_db"])
    }

    #[test]
    fn a_header_behind_a_comment_mark_is_one() {
        for text in [
            "# made by hand\n# E N RSSI\n1 2 -60\n",
            "#E,N,RSSI\n1,2,-60\n",
            "// E;N;RSSI\n1;2;-6,5\n",
        ] {
            for names in [Names::InFirstLine, Names::WhereTheyAre] {
                let table = Table::parse(text.as_bytes(), names).unwrap();
                let columns: Vec<&str> = table.columns().collect();
                assert_eq!((columns, table.len()), (vec!["E", "N", "RSSI"], 1), "{text}");
            }
        }
        for head in ["two words", "1 2 3", "E N E", "E  N RSSI dBm"] {
            let text = format!("# {head}\n1 2 -60\n");
            let table = Table::parse(text.as_bytes(), Names::WhereTheyAre).unwrap();
            assert_eq!(table.columns().collect::<Vec<_>>(), ["1", "2", "3"], "{head}");
        }
    }

    #[test]
    fn decimal_commas_do_not_separate_where_there_is_no_header() {
        for text in ["1,5;2,25;3\n4;5;6\n", "1,5\t2,25\t3\n4\t5\t6\n", "1,5 2,25 3\n4 5 6\n"] {
            let table = Table::parse(text.as_bytes(), Names::WhereTheyAre).unwrap();
            assert_eq!((table.columns().count(), table.len()), (3, 2), "{text}");
            assert_eq!(table.number(0, "2").unwrap(), Some(2.25), "{text}");
        }
        for text in ["1,5,2\n", "1, 5, 2\n", "1,5\n", "1.5,2.5;3\n"] {
            let table = Table::parse(text.as_bytes(), Names::WhereTheyAre).unwrap();
            assert_eq!(table.separator, Separator::Byte(b','), "{text}");
        }
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
        assert!(message("theta_deg,x\n1,2").contains("unknown column `x`"));
        assert!(message("theta_deg,theta_deg\n1,2").contains("twice"));
        assert!(message("theta_deg\n1\n2,3\n").starts_with("line 3: 2 cells"));
        let table = read("theta_deg\n1\nnan\n").unwrap();
        let refused = table.required_number(1, "theta_deg").unwrap_err().to_string();
        assert!(refused.starts_with("line 3, column theta_deg: `nan`"), "{refused}");
        for order in [u16::to_le_bytes, u16::to_be_bytes] {
            let text = "\u{feff}theta_deg\n1\n".encode_utf16();
            let bytes: Vec<u8> = text.flat_map(order).collect();
            let refused = Table::parse(&bytes, Names::InFirstLine).unwrap_err().to_string();
            assert!(
                refused.contains("UTF-16") && refused.contains("save it as UTF-8"),
                "{refused}"
            );
        }
    }

    #[test]
    fn cells_are_separated_by_what_the_header_has() {
        for text in [
            "theta_deg,sigma0_db\n10,-3.5\n",
            "theta_deg;sigma0_db\r\n10;-3,5\r\n",
            "\u{feff}# ours\ntheta_deg\tsigma0_db\n10\t-3,5\n",
            "// theirs\ntheta_deg  sigma0_db\n 10   -3.5\n",
        ] {
            let table = read(text).unwrap();
            assert_eq!(table.required_number(0, "theta_deg").unwrap(), 10.0, "{text}");
            assert_eq!(table.number(0, "sigma0_db").unwrap(), Some(-3.5), "{text}");
        }
        let twice = read("theta_deg;sigma0_db\n10;-3,5,1\n").unwrap();
        assert!(twice.number(0, "sigma0_db").is_err());
        let commas = read("theta_deg,sigma0_db\n10,\"-3,5\"\n").unwrap();
        assert!(commas.number(0, "sigma0_db").is_err(), "may be thousands");
    }

    #[test]
    fn a_table_of_numbers_may_lack_names() {
        let numbers = b"1 2 3\n4 5 6\n";
        let table = Table::parse(numbers, Names::WhereTheyAre).unwrap();
        assert_eq!((table.len(), table.required_number(1, "3").unwrap()), (2, 6.0));
        assert_eq!(Table::parse(numbers, Names::InFirstLine).unwrap().len(), 1);
        let named = Table::parse(b"X Y Z\n4 5 6\n", Names::WhereTheyAre).unwrap();
        assert_eq!(named.columns().collect::<Vec<_>>(), ["X", "Y", "Z"]);
    }
}
