//! Points with whatever was measured at each, from any format of clouds: a table of numbers under names.
//!
//! | format | endings | columns |
//! |---|---|---|
//! | PLY | `ply` | the scalar properties of its vertices |
//! | text | `csv`, `xyz`, `txt`, `asc`, `pts` | as its header names them; without one x, y, z and power where they are four (three without a power), else 1, 2, 3 … |
//! | PCD | `pcd` | its fields of one value |
//! | LAS | `las`, `laz` | `x y z intensity`, `gps_time` where it has one, and its extra bytes by their names |

mod las;
mod lzf;
mod numbers;
mod pcd;

use self::numbers::Numbers;
use super::FormatError;
use super::columns::{ColumnNames, passed_over, twice};
use super::csv::{self, Names};
use super::ply;

/// The formats of files of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointFormat {
    /// Stanford polygons.
    Ply,
    /// Text under a header.
    Csv,
    /// Text, mostly without a header.
    Xyz,
    /// The format of the Point Cloud Library.
    Pcd,
    /// The ASPRS format, compressed or not.
    Las,
}

impl PointFormat {
    /// Every ending that [`PointFormat::from_extension`] knows.
    pub const EXTENSIONS: [&str; 9] =
        ["ply", "csv", "xyz", "txt", "asc", "pts", "pcd", "las", "laz"];

    /// The format that a file's extension stands for, in upper or lower case and without the dot.
    pub fn from_extension(extension: &str) -> Option<PointFormat> {
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Some(PointFormat::Ply),
            "csv" => Some(PointFormat::Csv),
            "xyz" | "txt" | "asc" | "pts" => Some(PointFormat::Xyz),
            "pcd" => Some(PointFormat::Pcd),
            "las" | "laz" => Some(PointFormat::Las),
            _ => None,
        }
    }
}

/// Points under named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTable {
    cells: Cells,
}

#[derive(Clone, Debug, PartialEq)]
enum Cells {
    Text(csv::Table),
    Numbers(Numbers),
}

impl PointTable {
    /// Reads a whole file.
    ///
    /// # Errors
    /// The place at which the bytes break the format.
    pub fn read(format: PointFormat, bytes: &[u8]) -> Result<PointTable, FormatError> {
        let cells = match format {
            PointFormat::Ply => return Ok(of_ply(ply::read_table(bytes)?)),
            PointFormat::Csv => Cells::Text(csv::Table::parse(bytes, Names::InFirstLine)?),
            PointFormat::Xyz => Cells::Text(text(bytes)?),
            PointFormat::Pcd => Cells::Numbers(pcd::read(bytes)?),
            PointFormat::Las => Cells::Numbers(las::read(bytes)?),
        };
        Ok(PointTable { cells })
    }

    /// Points of columns of equal length, by their names.
    pub fn of_columns(columns: Vec<(String, Vec<f64>)>) -> PointTable {
        let (names, columns) = columns.into_iter().unzip();
        PointTable { cells: Cells::Numbers(Numbers { names, columns }) }
    }

    /// Leaves out the points that have no place: of which a cell in one of these columns is not a number, as in the empty pixels
    /// of an organised cloud. Gives how many they are.
    pub fn pass_over_empty(&mut self, places: &[&str]) -> usize {
        let points = 0..self.len();
        let is_kept: Vec<bool> = match &self.cells {
            Cells::Text(table) => points
                .map(|row| !places.iter().any(|column| table.is_not_a_number(row, column)))
                .collect(),
            Cells::Numbers(Numbers { names, columns }) => {
                let places =
                    names.iter().zip(columns).filter(|(name, _)| places.contains(&name.as_str()));
                let places: Vec<&Vec<f64>> = places.map(|(_, column)| column).collect();
                points.map(|row| !places.iter().any(|column| column[row].is_nan())).collect()
            }
        };
        match &mut self.cells {
            Cells::Text(table) => table.keep(&is_kept),
            Cells::Numbers(numbers) => {
                for column in &mut numbers.columns {
                    let mut kept = is_kept.iter();
                    column.retain(|_| *kept.next().unwrap_or(&false));
                }
            }
        }
        is_kept.iter().filter(|is_kept| !**is_kept).count()
    }

    /// Gives columns the names by which they are asked for.
    ///
    /// # Errors
    /// Names of no column, or of several.
    pub fn rename(&mut self, names: &ColumnNames) -> Result<(), FormatError> {
        match &mut self.cells {
            Cells::Text(table) => table.rename(names),
            Cells::Numbers(numbers) => names.apply(&mut numbers.names),
        }
    }

    /// Writes the names of all columns in lower case.
    pub fn lower_case(&mut self) {
        match &mut self.cells {
            Cells::Text(table) => table.lower_case(),
            Cells::Numbers(numbers) => {
                numbers.names.iter_mut().for_each(|name| name.make_ascii_lowercase());
            }
        }
    }

    /// Names of the columns, in the file's order.
    pub fn names(&self) -> Vec<&str> {
        match &self.cells {
            Cells::Text(table) => table.columns().collect(),
            Cells::Numbers(numbers) => numbers.names.iter().map(String::as_str).collect(),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        match &self.cells {
            Cells::Text(table) => table.len(),
            Cells::Numbers(numbers) => numbers.columns.first().map_or(0, Vec::len),
        }
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Refuses two columns of one name.
    ///
    /// # Errors
    /// The name.
    pub fn check_names(&self) -> Result<(), FormatError> {
        let names: Vec<String> = self.names().into_iter().map(str::to_owned).collect();
        match twice(&names) {
            None => Ok(()),
            Some(name) => Err(FormatError::at(
                "the header",
                format!("column `{name}` is there twice"),
                "keep one, or rename one by --columns THEIRS=OURS",
            )),
        }
    }

    /// A sentence on the columns that are not among those.
    pub fn passed_over(&self, known: &[&str]) -> Option<String> {
        let mut names = self.names();
        names.retain(|name| !name.is_empty() && !known.contains(name));
        passed_over(&names, known)
    }

    /// The numbers of a column, NaN where a cell of text is empty; `None` where there is no such column.
    ///
    /// # Errors
    /// A cell of text that is no finite number.
    pub fn column(&self, name: &str) -> Result<Option<Vec<f64>>, FormatError> {
        match &self.cells {
            Cells::Text(table) if table.has(name) => {
                let cells = (0..table.len()).map(|row| table.number(row, name));
                cells.map(|cell| Ok(cell?.unwrap_or(f64::NAN))).collect::<Result<_, _>>().map(Some)
            }
            Cells::Text(_) => Ok(None),
            Cells::Numbers(Numbers { names, columns }) => {
                let at = names.iter().position(|known| known == name);
                Ok(at.map(|at| columns[at].clone()))
            }
        }
    }

    /// The numbers of a column in which no cell of a text is empty; `None` where there is no such column.
    ///
    /// # Errors
    /// A cell of text that is no finite number, or is empty.
    pub fn full_column(&self, name: &str) -> Result<Option<Vec<f64>>, FormatError> {
        let column = self.column(name)?;
        let is_text = matches!(self.cells, Cells::Text(_));
        match column.iter().flatten().position(|number| number.is_nan()) {
            Some(row) if is_text => Err(FormatError::at(
                format!("{}, column {name}", self.place(row)),
                "the cell is empty",
                "fill in a number, or leave the line out",
            )),
            _ => Ok(column),
        }
    }

    /// Where a point stands in the file: `line L` of a text, `point N` (from 0) of anything else.
    pub fn place(&self, point: usize) -> String {
        match &self.cells {
            Cells::Text(table) => table.place(point),
            Cells::Numbers(_) => format!("point {point}"),
        }
    }
}

fn of_ply(table: ply::Table) -> PointTable {
    let columns = table.columns.into_iter().map(|column| (column.name, column.values));
    PointTable::of_columns(columns.collect())
}

/// Text whose header may be missing.
fn text(bytes: &[u8]) -> Result<csv::Table, FormatError> {
    let mut table = match count_at_the_head(bytes) {
        None => csv::Table::parse(bytes, Names::WhereTheyAre)?,
        Some(count) => {
            let table = csv::Table::parse(&[b"#", bytes].concat(), Names::WhereTheyAre)?;
            if table.len() as u64 != count {
                let problem = format!("it states {count} points, and {} follow", table.len());
                let way_out = "give the whole file, or remove the line";
                return Err(FormatError::at("line 1", problem, way_out));
            }
            table
        }
    };
    let names = match table.columns().collect::<Vec<_>>()[..] {
        ["1", "2", "3"] => "1=x,2=y,3=z",
        ["1", "2", "3", "4"] => "1=x,2=y,3=z,4=power",
        _ => return Ok(table),
    };
    table.rename(&names.parse()?)?;
    Ok(table)
}

/// The first line, if it is the number of points, as scanners write it in a `.pts`, and the second has more than that.
fn count_at_the_head(bytes: &[u8]) -> Option<u64> {
    let mut lines = bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let count = count(lines.next()?)?;
    lines.next().filter(|line| self::count(line).is_none()).map(|_| count)
}

fn count(line: &[u8]) -> Option<u64> {
    let digits =
        std::str::from_utf8(line).ok().filter(|text| text.bytes().all(|b| b.is_ascii_digit()));
    digits?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(format: PointFormat, bytes: &[u8]) -> PointTable {
        PointTable::read(format, bytes).unwrap()
    }

    #[test]
    fn points_without_a_place_are_passed_over() {
        let ply = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float p\nend_header\nnan 1\n2 nan\n";
        for (format, bytes) in
            [(PointFormat::Csv, &b"x;p\nNaN;1\n2;nan\n"[..]), (PointFormat::Ply, &ply[..])]
        {
            let mut table = read(format, bytes);
            assert_eq!((table.pass_over_empty(&["x"]), table.len()), (1, 1));
            assert_eq!(table.column("x"), Ok(Some(vec![2.0])));
            if format == PointFormat::Csv {
                assert_eq!(table.place(0), "line 3");
            }
        }
        // An empty cell may be a slip.
        assert_eq!(read(PointFormat::Csv, b"x,p\n,1\n").pass_over_empty(&["x"]), 0);
    }

    #[test]
    fn text_has_its_own_names_or_those_of_four_columns() {
        let bare = read(PointFormat::Xyz, b"# theirs\n0 1 2 -60\n3 4 5 -61\n");
        assert_eq!(bare.names(), ["x", "y", "z", "power"]);
        assert_eq!(bare.column("power"), Ok(Some(vec![-60.0, -61.0])));
        let named = read(PointFormat::Xyz, b"X\tY\tZ\tIntensity\tnote\n0\t1\t2\t-60,5\tgood one\n");
        assert_eq!(named.column("Intensity"), Ok(Some(vec![-60.5])));
        assert_eq!(named.column("time"), Ok(None));
        let said = named.column("note").unwrap_err().to_string();
        assert!(said.starts_with("line 2, column note: `good one`"), "{said}");
        let mut five = read(PointFormat::Xyz, b"0 1 2 7 -60\n");
        five.rename(&"5=power_dbm".parse().unwrap()).unwrap();
        assert_eq!(five.names(), ["1", "2", "3", "4", "power_dbm"]);
        assert_eq!((five.len(), five.place(0)), (1, "line 1".to_owned()));
    }

    #[test]
    fn the_number_of_points_may_come_first() {
        let counted = read(PointFormat::Xyz, b"2\r\n0 1 2 -60\r\n3 4 5 -61\r\n");
        assert_eq!(counted.column("power"), Ok(Some(vec![-60.0, -61.0])));
        assert_eq!(counted.place(1), "line 3");
        let cut = PointTable::read(PointFormat::Xyz, b"3\n0 1 2 -60\n3 4 5 -61\n").unwrap_err();
        assert!(cut.to_string().starts_with("line 1: it states 3 points, and 2 follow"), "{cut}");
    }

    #[test]
    fn an_empty_cell_is_not_a_number() {
        let table = read(PointFormat::Csv, b"x_m,chirp\n1,\n2,7\n");
        let chirps = table.column("chirp").unwrap().unwrap();
        assert!(chirps[0].is_nan() && chirps[1] == 7.0);
    }

    #[test]
    fn every_ending_has_a_format() {
        for ending in PointFormat::EXTENSIONS {
            assert!(PointFormat::from_extension(&ending.to_uppercase()).is_some(), "{ending}");
        }
        assert_eq!(PointFormat::from_extension("stl"), None);
    }
}
