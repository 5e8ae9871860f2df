//! The numbers after a PLY header, row by row, whatever their encoding.

use ply_rs::ply::Encoding;

use super::header::{Element, Header, Scalar, Shape};
use crate::formats::error::FormatError;

/// The part of the file's data that is still unread.
pub(super) struct Body<'a> {
    encoding: Encoding,
    rest: &'a [u8],
    file_bytes: usize,
    line: usize,
    /// Where the entry begins that was read last.
    line_of_row: usize,
}

/// One entry of an element.
pub(super) struct Row {
    /// A number per property; NaN in the place of a list.
    pub scalars: Vec<f64>,
    /// The items of the list that was asked for.
    pub list: Vec<f64>,
}

impl<'a> Body<'a> {
    pub fn new(header: &Header<'a>, file_bytes: usize) -> Body<'a> {
        let Header { encoding, body, lines, .. } = *header;
        Body { encoding, rest: body, file_bytes, line: lines + 1, line_of_row: lines + 1 }
    }

    /// Hands every entry of `element` to `visit` with its number; `list` is the one list to keep.
    pub fn for_each_row(
        &mut self,
        element: &Element,
        list: Option<usize>,
        mut visit: impl FnMut(usize, &Row) -> Result<(), FormatError>,
    ) -> Result<(), FormatError> {
        let mut row = Row { scalars: vec![f64::NAN; element.properties.len()], list: Vec::new() };
        for number in 0..element.count {
            self.read_row(element, list, &mut row).ok_or_else(|| self.mismatch(element, number))?;
            visit(number, &row)?;
        }
        Ok(())
    }

    /// Reads over an element that nobody wants.
    pub fn skip(&mut self, element: &Element) -> Result<(), FormatError> {
        self.for_each_row(element, None, |_, _| Ok(()))
    }

    /// The bytes of all entries of `element` if each has `row_bytes` of them, least significant first.
    pub fn rows(&self, element: &Element, row_bytes: usize) -> Option<&'a [u8]> {
        let is_little = self.encoding == Encoding::BinaryLittleEndian;
        is_little.then(|| self.rest.get(..element.count.checked_mul(row_bytes)?)).flatten()
    }

    /// Goes on after `bytes` that were read by themselves.
    pub fn advance(&mut self, bytes: usize) {
        self.rest = self.rest.get(bytes..).unwrap_or_default();
    }

    /// Whether a binary file goes on behind what was read.
    pub fn has_more_bytes(&self) -> bool {
        self.encoding != Encoding::Ascii && !self.rest.is_empty()
    }

    fn read_row(&mut self, element: &Element, list: Option<usize>, row: &mut Row) -> Option<()> {
        let is_text = self.encoding == Encoding::Ascii;
        if is_text {
            self.skip_to_text();
        }
        self.line_of_row = self.line;
        for (at, (property, value)) in element.properties.iter().zip(&mut row.scalars).enumerate() {
            match property.shape {
                Shape::Scalar(scalar) => *value = self.number(scalar)?,
                Shape::List { count, item } => {
                    let items = self.count(count)?;
                    if list == Some(at) {
                        self.keep(items, item, &mut row.list)?;
                    } else {
                        (0..items).try_for_each(|_| self.number(item).map(drop))?;
                    }
                }
            }
        }
        if is_text { self.end_of_line() } else { Some(()) }
    }

    /// A list's length, which every item's least size of one byte bounds by the bytes left.
    fn count(&mut self, scalar: Scalar) -> Option<usize> {
        let count = self.number(scalar)?;
        (count.fract() == 0.0 && (0.0..=self.rest.len() as f64).contains(&count))
            .then_some(count as usize)
    }

    fn keep(&mut self, items: usize, item: Scalar, list: &mut Vec<f64>) -> Option<()> {
        list.clear();
        list.reserve_exact(items);
        for _ in 0..items {
            list.push(self.number(item)?);
        }
        Some(())
    }

    #[inline(always)]
    fn number(&mut self, scalar: Scalar) -> Option<f64> {
        if self.encoding == Encoding::Ascii {
            return self.text_number(scalar);
        }
        Some(match scalar {
            Scalar::Char => i8::from_le_bytes(self.take()?).into(),
            Scalar::UChar => u8::from_le_bytes(self.take()?).into(),
            Scalar::Short => i16::from_le_bytes(self.take()?).into(),
            Scalar::UShort => u16::from_le_bytes(self.take()?).into(),
            Scalar::Int => i32::from_le_bytes(self.take()?).into(),
            Scalar::UInt => u32::from_le_bytes(self.take()?).into(),
            Scalar::Float => f32::from_le_bytes(self.take()?).into(),
            Scalar::Double => f64::from_le_bytes(self.take()?),
            Scalar::Long => i64::from_le_bytes(self.take()?) as f64,
            Scalar::ULong => u64::from_le_bytes(self.take()?) as f64,
        })
    }

    /// The next `N` bytes, least significant first.
    #[inline(always)]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (&(mut bytes), rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        if self.encoding == Encoding::BinaryBigEndian {
            bytes.reverse();
        }
        Some(bytes)
    }

    /// The next number of a text; a long entry may go on in the next line. Floats keep all the digits of the text, even where the header
    /// says single precision.
    fn text_number(&mut self, scalar: Scalar) -> Option<f64> {
        self.skip_to_text();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        let value: f64 = str::from_utf8(word).ok()?.parse().ok()?;
        self.rest = rest;
        scalar.holds(value).then_some(value)
    }

    fn skip_to_text(&mut self) {
        let text = self.rest.trim_ascii_start();
        let skipped = &self.rest[..self.rest.len() - text.len()];
        let ends = skipped.iter().enumerate().filter(|(at, byte)| match byte {
            b'\n' => true,
            b'\r' => self.rest.get(at + 1) != Some(&b'\n'),
            _ => false,
        });
        self.line += ends.count();
        self.rest = text;
    }

    fn skip_blanks(&mut self) {
        while let [b' ' | b'\t', rest @ ..] = self.rest {
            self.rest = rest;
        }
    }

    fn end_of_line(&mut self) -> Option<()> {
        self.skip_blanks();
        matches!(self.rest, [] | [b'\r' | b'\n', ..]).then_some(())
    }

    fn mismatch(&self, element: &Element, number: usize) -> FormatError {
        let place = match self.encoding {
            Encoding::Ascii => format!("line {}", self.line_of_row),
            _ => format!("byte {}", self.file_bytes - self.rest.len()),
        };
        let rest = match self.encoding {
            Encoding::Ascii => self.rest.trim_ascii_start(),
            _ => self.rest,
        };
        let problem = match rest {
            [] => format!("the file ends inside {} {number}", element.name),
            _ => format!("{} {number} does not follow the header", element.name),
        };
        FormatError::at(place, problem, "copy or export the file again")
    }
}
