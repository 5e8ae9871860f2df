//! PCD, the format of the Point Cloud Library, version 0.7 and earlier: ascii, binary, and compressed.
//!
//! Fields of several values, such as descriptors, and those called `_` are passed over, and so are points whose
//! place is not a number: an organised cloud has one for every pixel.

use super::lzf::decompress;
use super::numbers::Numbers;
use crate::formats::FormatError;
use crate::formats::line::excerpt;

/// One field of every point.
#[derive(Clone, Debug)]
struct Field {
    name: String,
    size: usize,
    kind: char,
    count: usize,
}

/// How the points are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Data {
    Ascii,
    Binary,
    Compressed,
}

struct Header {
    fields: Vec<Field>,
    points: usize,
    data: Data,
    /// Lines of the header, and where the points begin, byte.
    lines: usize,
    start: usize,
}

/// The lines of a header without comments: their numbers and words.
#[derive(Default)]
struct Entries<'a>(Vec<(usize, Vec<&'a str>)>);

/// The number of a line, and its words behind the first.
type Entry<'e> = (usize, &'e [&'e str]);

impl Entries<'_> {
    fn find(&self, name: &str) -> Option<Entry<'_>> {
        let (line, words) = self.0.iter().find(|(_, words)| words[0] == name)?;
        Some((*line, &words[1..]))
    }

    fn get(&self, name: &str) -> Result<Entry<'_>, FormatError> {
        self.find(name).ok_or_else(|| {
            FormatError::at("header", format!("there is no line {name}"), "mend the header")
        })
    }
}

/// Reads a whole file.
pub(super) fn read(bytes: &[u8]) -> Result<Numbers, FormatError> {
    let header = Header::read(bytes)?;
    let body = &bytes[header.start..];
    match header.data {
        Data::Ascii => header.ascii(body),
        Data::Binary => header.binary(body),
        Data::Compressed => header.compressed(body),
    }
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Header, FormatError> {
        let mut entries = Entries::default();
        let (mut start, mut lines) = (0, 0);
        for line in bytes.split_inclusive(|byte| *byte == b'\n') {
            start += line.len();
            lines += 1;
            let text = std::str::from_utf8(line).map_err(|_| {
                let problem = "the header is not text";
                FormatError::at(format!("line {lines}"), problem, "is this a PCD file?")
            })?;
            let words: Vec<&str> = text.split_whitespace().collect();
            let is_last = words.first() == Some(&"DATA");
            if words.first().is_some_and(|word| !word.starts_with('#')) {
                entries.0.push((lines, words));
            }
            if is_last {
                return Header::of(&entries, lines, start);
            }
        }
        Err(FormatError::at("header", "there is no line DATA", "is this a complete PCD file?"))
    }

    fn of(entries: &Entries, lines: usize, start: usize) -> Result<Header, FormatError> {
        let (fields_line, names) = entries.get("FIELDS")?;
        let sizes = whole_numbers(entries.get("SIZE")?)?;
        let counts = entries.find("COUNT").map_or(Ok(vec![1; names.len()]), whole_numbers)?;
        let (_, kinds) = entries.get("TYPE")?;
        if [sizes.len(), counts.len(), kinds.len()].iter().any(|length| *length != names.len()) {
            let problem = "FIELDS, SIZE, TYPE and COUNT have different lengths";
            return Err(FormatError::at(format!("line {fields_line}"), problem, "mend the header"));
        }
        let mut fields = Vec::new();
        for (at, name) in names.iter().enumerate() {
            let kind = kinds[at].chars().next().unwrap_or(' ');
            let known = match kind {
                'F' => [4, 8].contains(&sizes[at]),
                'I' | 'U' => [1, 2, 4, 8].contains(&sizes[at]),
                _ => false,
            };
            if !known {
                let problem = format!("a field of type {} and {} bytes", kinds[at], sizes[at]);
                let way_out = "use F of 4 or 8, I or U of 1, 2, 4 or 8";
                return Err(FormatError::at(format!("line {fields_line}"), problem, way_out));
            }
            let (name, size) = ((*name).to_owned(), sizes[at]);
            fields.push(Field { name, size, kind, count: counts[at] });
        }
        let (line, form) = entries.get("DATA")?;
        let data = match form {
            ["ascii"] => Data::Ascii,
            ["binary"] => Data::Binary,
            ["binary_compressed"] => Data::Compressed,
            _ => {
                let problem = format!("{} is no form of data", excerpt(&form.join(" ")));
                let way_out = "write ascii, binary or binary_compressed";
                return Err(FormatError::at(format!("line {line}"), problem, way_out));
            }
        };
        let by_size = match ["WIDTH", "HEIGHT"].map(|name| entries.find(name)) {
            [Some(width), Some(height)] => {
                Some(whole_number(width)?.saturating_mul(whole_number(height)?))
            }
            _ => None,
        };
        let points = match (entries.find("POINTS"), by_size) {
            (Some(stated), by_size) => {
                let points = whole_number(stated)?;
                if by_size.is_some_and(|by_size| by_size != points) {
                    let problem = format!(
                        "there are {points} POINTS and WIDTH times HEIGHT is another number"
                    );
                    return Err(FormatError::at("header", problem, "correct one of the three"));
                }
                points
            }
            (None, Some(by_size)) => by_size,
            (None, None) => whole_number(entries.get("POINTS")?)?,
        };
        Ok(Header { fields, points, data, lines, start })
    }

    /// The fields that become columns.
    fn kept(&self) -> impl Iterator<Item = (usize, &Field)> {
        let fields = self.fields.iter().enumerate();
        fields.filter(|(_, field)| field.count == 1 && field.name != "_")
    }

    /// Columns without values.
    fn table(&self) -> Numbers {
        let names: Vec<String> = self.kept().map(|(_, field)| field.name.clone()).collect();
        let columns = vec![Vec::new(); names.len()];
        Numbers { names, columns }
    }

    /// Bytes of a point; `None` beyond any file.
    fn stride(&self) -> Option<usize> {
        let bytes = |field: &Field| field.size.checked_mul(field.count);
        self.fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(bytes(field)?))
    }

    /// Bytes of all points, which the body must have.
    fn bytes(&self) -> Option<usize> {
        self.stride()?.checked_mul(self.points)
    }

    fn cut_off(&self) -> FormatError {
        let problem = format!("the file ends before its {} points", self.points);
        FormatError::at("body", problem, "copy the file anew")
    }

    fn ascii(&self, body: &[u8]) -> Result<Numbers, FormatError> {
        let mut table = self.table();
        let words_of_point = self.fields.iter().fold(0_usize, |sum, f| sum.saturating_add(f.count));
        let kept: Vec<usize> = self.kept().map(|(index, _)| index).collect();
        let mut read = 0;
        for (line, bytes) in (self.lines + 1..).zip(body.split(|byte| *byte == b'\n')) {
            let text = String::from_utf8_lossy(bytes);
            let words: Vec<&str> = text.split_whitespace().collect();
            if words.is_empty() {
                continue;
            }
            if words.len() != words_of_point {
                let problem =
                    format!("{} numbers where the fields have {words_of_point}", words.len());
                return Err(FormatError::at(format!("line {line}"), problem, "mend the line"));
            }
            for (column, index) in std::iter::zip(&mut table.columns, &kept) {
                let word = words[self.words_before(*index)];
                column.push(word.parse().map_err(|_| {
                    let problem = format!("`{word}` is not a number");
                    FormatError::at(format!("line {line}"), problem, "mend the line")
                })?);
            }
            read += 1;
        }
        if read == self.points { Ok(table) } else { Err(self.cut_off()) }
    }

    /// Words of an ascii line before those of a field.
    fn words_before(&self, index: usize) -> usize {
        self.fields[..index].iter().map(|field| field.count).sum()
    }

    /// Point after point.
    fn binary(&self, body: &[u8]) -> Result<Numbers, FormatError> {
        let body = self.bytes().and_then(|length| body.get(..length));
        let (body, stride) = body.zip(self.stride()).ok_or_else(|| self.cut_off())?;
        let offsets = self.offsets();
        let mut table = self.table();
        for point in body.chunks_exact(stride.max(1)) {
            for (column, (index, field)) in std::iter::zip(&mut table.columns, self.kept()) {
                column.push(number(field, &point[offsets[index]..]));
            }
        }
        Ok(table)
    }

    /// Field after field, compressed as one block.
    fn compressed(&self, body: &[u8]) -> Result<Numbers, FormatError> {
        let block = size_at(body, 0).and_then(|length| body.get(8..)?.get(..length));
        let (block, length) = block.zip(size_at(body, 4)).ok_or_else(|| self.cut_off())?;
        if self.bytes() != Some(length) {
            let problem = format!("{length} bytes are not those of {} points", self.points);
            return Err(FormatError::at("body", problem, "write the file anew"));
        }
        let whole = decompress(block, length).ok_or_else(|| {
            FormatError::at("body", "the compressed points are damaged", "copy the file anew")
        })?;
        let offsets = self.offsets();
        let mut table = self.table();
        for (column, (index, field)) in std::iter::zip(&mut table.columns, self.kept()) {
            let start = offsets[index] * self.points;
            let values = whole[start..start + field.size * self.points].chunks_exact(field.size);
            column.extend(values.map(|bytes| number(field, bytes)));
        }
        Ok(table)
    }

    /// Where each field begins within a point, byte.
    fn offsets(&self) -> Vec<usize> {
        let begins = self.fields.iter().scan(0, |next, field| {
            let at = *next;
            *next += field.size * field.count;
            Some(at)
        });
        begins.collect()
    }
}

/// A number of bytes, as the body states it.
fn size_at(body: &[u8], at: usize) -> Option<usize> {
    let bytes = body.get(at..at + 4)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
}

/// The number at the beginning of the bytes, little-endian.
fn number(field: &Field, bytes: &[u8]) -> f64 {
    let mut first = [0; 8];
    first[..field.size].copy_from_slice(&bytes[..field.size]);
    let whole = u64::from_le_bytes(first);
    match (field.kind, field.size) {
        ('F', 4) => f64::from(f32::from_bits(whole as u32)),
        ('F', _) => f64::from_bits(whole),
        ('I', 1) => f64::from(whole as u8 as i8),
        ('I', 2) => f64::from(whole as u16 as i16),
        ('I', 4) => f64::from(whole as u32 as i32),
        ('I', _) => whole as i64 as f64,
        _ => whole as f64,
    }
}

fn whole_numbers((line, words): Entry) -> Result<Vec<usize>, FormatError> {
    let numbers = words.iter().map(|word| word.parse().ok());
    numbers.collect::<Option<_>>().ok_or_else(|| {
        let problem = format!("{} are not whole numbers", excerpt(&words.join(" ")));
        FormatError::at(format!("line {line}"), problem, "mend the header")
    })
}

fn whole_number((line, words): Entry) -> Result<usize, FormatError> {
    match whole_numbers((line, words))?[..] {
        [number] => Ok(number),
        _ => Err(FormatError::at(format!("line {line}"), "give one number", "mend the header")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "# .PCD v0.7 - Point Cloud Data\nVERSION 0.7\nFIELDS x y z _ intensity d\n\
                        SIZE 4 4 4 1 2 4\nTYPE F F F U U F\nCOUNT 1 1 1 2 1 2\nWIDTH 2\nHEIGHT 1\n\
                        VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";

    fn read_all(bytes: &[u8]) -> Result<Numbers, String> {
        read(bytes).map_err(|error| error.to_string())
    }

    fn ascii(rows: &str) -> Result<Numbers, String> {
        read_all(format!("{HEAD}ascii\n{rows}").as_bytes())
    }

    /// x, y, z and the intensity of the two points.
    fn points() -> [(f32, f32, f32, u16); 2] {
        [(0.5, 1.0, -2.0, 7), (0.25, 1.5, 3.0, 65535)]
    }

    fn expected() -> Numbers {
        let names = ["x", "y", "z", "intensity"].map(str::to_owned).to_vec();
        let columns = vec![vec![0.5, 0.25], vec![1.0, 1.5], vec![-2.0, 3.0], vec![7.0, 65535.0]];
        Numbers { names, columns }
    }

    #[test]
    fn every_form_gives_the_same_points() {
        assert_eq!(ascii("0.5 1 -2 0 0 7 9 9\n0.25 1.5 3 0 0 65535 9 9\n"), Ok(expected()));
        let mut binary = format!("{HEAD}binary\n").into_bytes();
        for (x, y, z, intensity) in points() {
            binary.extend([x, y, z].iter().flat_map(|number| number.to_le_bytes()));
            binary.extend([0, 0]);
            binary.extend(intensity.to_le_bytes());
            binary.extend([0; 8]);
        }
        assert_eq!(read_all(&binary), Ok(expected()));
        let cut = read_all(&binary[..binary.len() - 1]).unwrap_err();
        assert!(cut.contains("ends before its 2 points"), "{cut}");
        let mut fields: Vec<u8> = Vec::new();
        for axis in 0..3 {
            let places = points().map(|(x, y, z, _)| [x, y, z][axis]);
            fields.extend(places.iter().flat_map(|place| place.to_le_bytes()));
        }
        fields.extend([0; 4]);
        fields.extend(points().iter().flat_map(|point| point.3.to_le_bytes()));
        fields.extend([0; 16]);
        // Bytes as they are, 32 at a time.
        let block: Vec<u8> = fields
            .chunks(32)
            .flat_map(|chunk| [&[chunk.len() as u8 - 1], chunk].concat())
            .collect();
        let mut compressed = format!("{HEAD}binary_compressed\n").into_bytes();
        compressed.extend((block.len() as u32).to_le_bytes());
        compressed.extend((fields.len() as u32).to_le_bytes());
        compressed.extend(block);
        assert_eq!(read_all(&compressed), Ok(expected()));
    }

    #[test]
    fn damage_is_named_with_its_line() {
        for (rows, said) in [
            ("1 2 3\n", "line 12: 3 numbers where the fields have 8"),
            ("a 2 3 0 0 1 9 9\n", "line 12: `a` is not a number"),
            ("1 2 3 0 0 1 9 9\n", "ends before its 2 points"),
        ] {
            let error = ascii(rows).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        let ours = format!("{HEAD}ascii\n");
        for (old, new, said) in [
            ("DATA ascii", "DATA text", "line 11: \"text\" is no form of data"),
            ("DATA ascii", "", "there is no line DATA"),
            ("FIELDS x", "FIELD x", "there is no line FIELDS"),
            ("TYPE F F F U U F", "TYPE F F F U U", "different lengths"),
            ("TYPE F", "TYPE X", "a field of type X and 4 bytes"),
            ("SIZE 4", "SIZE four", "are not whole numbers"),
            ("POINTS 2", "POINTS 2 2", "give one number"),
            ("POINTS 2", "POINTS 3", "WIDTH times HEIGHT is another number"),
            ("POINTS 2", "POINTS 99999999999999999999", "are not whole numbers"),
        ] {
            let error = read_all(ours.replace(old, new).as_bytes()).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        let vast = ours
            .replace("WIDTH 2\nHEIGHT 1\n", "")
            .replace("POINTS 2", "POINTS 18446744073709551615");
        assert!(read_all(vast.replace("ascii", "binary").as_bytes()).is_err());
    }
}
