//! The header of a PLY file: its encoding, elements and properties.

use std::io::Cursor;

use ply_rs::parser::{ParseError, Parser, Reader};
use ply_rs::ply::{DefaultElement, ElementDef, Encoding, PropertyDef, PropertyType, ScalarType};

use crate::formats::error::FormatError;
use crate::formats::line::{excerpt, without_mark};

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// 8-bit signed integer.
    Char,
    /// 8-bit unsigned integer.
    UChar,
    /// 16-bit signed integer.
    Short,
    /// 16-bit unsigned integer.
    UShort,
    /// 32-bit signed integer.
    Int,
    /// 32-bit unsigned integer.
    UInt,
    /// 32-bit floating point.
    Float,
    /// 64-bit floating point.
    Double,
    /// 64-bit signed integer, rounded where it has more than 53 bits. Not in the format's first description.
    Long,
    /// 64-bit unsigned integer, rounded where it has more than 53 bits. Not in the format's first description.
    ULong,
}

/// The largest integer of 53 bits. Doubles hold all up to it.
pub(super) const MOST_EXACT: f64 = ((1_u64 << 53) - 1) as f64;

impl Scalar {
    /// The name a header gives it.
    pub fn name(self) -> &'static str {
        match self {
            Scalar::Char => "char",
            Scalar::UChar => "uchar",
            Scalar::Short => "short",
            Scalar::UShort => "ushort",
            Scalar::Int => "int",
            Scalar::UInt => "uint",
            Scalar::Float => "float",
            Scalar::Double => "double",
            Scalar::Long => "int64",
            Scalar::ULong => "uint64",
        }
    }

    /// The 64-bit integer that a header's word stands for.
    fn wide(word: &str) -> Option<Scalar> {
        [Scalar::Long, Scalar::ULong].into_iter().find(|scalar| scalar.name() == word)
    }

    /// Whether `value` can be stored: integers take whole numbers in their range, floats anything.
    pub fn holds(self, value: f64) -> bool {
        self.integer_range().is_none_or(|(least, greatest)| {
            value.fract() == 0.0 && (least..=greatest).contains(&value)
        })
    }

    /// The least and greatest integer, or `None` for the floats.
    pub(super) fn integer_range(self) -> Option<(f64, f64)> {
        match self {
            Scalar::Char => Some((i8::MIN.into(), i8::MAX.into())),
            Scalar::UChar => Some((u8::MIN.into(), u8::MAX.into())),
            Scalar::Short => Some((i16::MIN.into(), i16::MAX.into())),
            Scalar::UShort => Some((u16::MIN.into(), u16::MAX.into())),
            Scalar::Int => Some((i32::MIN.into(), i32::MAX.into())),
            Scalar::UInt => Some((u32::MIN.into(), u32::MAX.into())),
            Scalar::Long => Some((i64::MIN as f64, i64::MAX as f64)),
            Scalar::ULong => Some((0.0, u64::MAX as f64)),
            Scalar::Float | Scalar::Double => None,
        }
    }

    pub(super) fn size_bytes(self) -> usize {
        match self {
            Scalar::Char | Scalar::UChar => 1,
            Scalar::Short | Scalar::UShort => 2,
            Scalar::Int | Scalar::UInt | Scalar::Float => 4,
            Scalar::Double | Scalar::Long | Scalar::ULong => 8,
        }
    }
}

impl From<&ScalarType> for Scalar {
    fn from(scalar: &ScalarType) -> Scalar {
        match scalar {
            ScalarType::Char => Scalar::Char,
            ScalarType::UChar => Scalar::UChar,
            ScalarType::Short => Scalar::Short,
            ScalarType::UShort => Scalar::UShort,
            ScalarType::Int => Scalar::Int,
            ScalarType::UInt => Scalar::UInt,
            ScalarType::Float => Scalar::Float,
            ScalarType::Double => Scalar::Double,
        }
    }
}

/// One number, or as many as a leading count says.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Shape {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Shape {
    /// The fewest bytes one value takes: in ascii a digit and a separator.
    fn least_bytes(self, encoding: Encoding) -> usize {
        match (encoding, self) {
            (Encoding::Ascii, _) => 2,
            (_, Shape::Scalar(scalar) | Shape::List { count: scalar, .. }) => scalar.size_bytes(),
        }
    }
}

pub(super) struct Property {
    pub name: String,
    pub shape: Shape,
}

impl From<PropertyDef> for Property {
    fn from(property: PropertyDef) -> Property {
        let shape = match &property.data_type {
            PropertyType::Scalar(scalar) => Shape::Scalar(scalar.into()),
            PropertyType::List(count, item) => {
                Shape::List { count: count.into(), item: item.into() }
            }
        };
        Property { name: property.name, shape }
    }
}

pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

impl Element {
    /// Where among the properties the scalar `name` is.
    pub fn scalar(&self, name: &str) -> Result<usize, FormatError> {
        let at = self
            .properties
            .iter()
            .position(|p| p.name == name && matches!(p.shape, Shape::Scalar(_)));
        at.ok_or_else(|| {
            FormatError::at(
                "header",
                format!("element {} has no number called {name}", self.name),
                "export the file again with that property",
            )
        })
    }

    fn least_bytes(&self, encoding: Encoding) -> usize {
        self.properties.iter().map(|p| p.shape.least_bytes(encoding)).sum()
    }
}

impl From<ElementDef> for Element {
    fn from(element: ElementDef) -> Element {
        let properties = element.properties.into_values().map(Property::from).collect();
        Element { name: element.name, count: element.count, properties }
    }
}

/// A header whose counts fit the file it came from.
pub(super) struct Header<'a> {
    pub encoding: Encoding,
    pub comments: Vec<String>,
    pub elements: Vec<Element>,
    /// Number of lines up to and including `end_header`.
    pub lines: usize,
    /// The bytes after the header.
    pub body: &'a [u8],
}

impl Header<'_> {
    /// Parses the header and checks every count against the bytes that follow.
    pub fn read(bytes: &[u8]) -> Result<Header<'_>, FormatError> {
        let (text, body) = split(without_mark(bytes))?;
        // The parser knows no integers of 64 bits: it reads them as doubles, which are as long.
        let (known, wide) = without_wide(&text);
        let mut reader = Reader::new(Cursor::new(known.as_bytes()));
        let parsed = Parser::<DefaultElement>::new()
            .read_header(&mut reader)
            .map_err(|error| not_understood(&text, &error))?;
        let mut elements: Vec<Element> = parsed.elements.into_values().map(Element::from).collect();
        widen(&mut elements, &wide);
        let header = Header {
            encoding: parsed.encoding,
            comments: parsed.comments,
            elements,
            lines: text.lines().count(),
            body,
        };
        header.check_names(&text)?;
        header.check_counts()?;
        Ok(header)
    }

    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }

    /// The parser lets the later of two equal names replace the earlier, which would shift the data.
    fn check_names(&self, text: &str) -> Result<(), FormatError> {
        let declared = |what: &str| text.lines().filter(|line| line.starts_with(what)).count();
        let properties: usize = self.elements.iter().map(|e| e.properties.len()).sum();
        if declared("element") == self.elements.len() && declared("property") == properties {
            return Ok(());
        }
        Err(FormatError::at(
            "header",
            "an element or one of its properties is declared twice",
            "give each a name of its own",
        ))
    }

    fn check_counts(&self) -> Result<(), FormatError> {
        // The last number of an ascii file needs no separator.
        let mut left_bytes = self.body.len() + usize::from(self.encoding == Encoding::Ascii);
        for Element { name, count, properties } in &self.elements {
            if *count > 0 && properties.is_empty() {
                return Err(FormatError::at(
                    "header",
                    format!("element {name} has {count} entries but no properties"),
                    "remove the element",
                ));
            }
        }
        for element in &self.elements {
            let needed_bytes = element.count.checked_mul(element.least_bytes(self.encoding));
            left_bytes = needed_bytes.and_then(|n| left_bytes.checked_sub(n)).ok_or_else(|| {
                FormatError::at(
                    "header",
                    format!(
                        "{} entries of element {} do not fit the {} bytes of data",
                        element.count,
                        element.name,
                        self.body.len()
                    ),
                    "the file is cut short or its header is wrong; copy or export it again",
                )
            })?;
        }
        Ok(())
    }
}

/// The types of each property, in the order of the header, of which some are integers of 64 bits.
type Wide = Vec<Vec<Option<Scalar>>>;

/// A header with doubles in the place of integers of 64 bits, and where these were.
fn without_wide(text: &str) -> (String, Wide) {
    let (mut known, mut wide) = (String::with_capacity(text.len()), Vec::new());
    for line in text.split_inclusive('\n') {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let ["property", types @ .., _name] = words.as_slice() {
            let types = types.strip_prefix(&["list"]).unwrap_or(types);
            let found: Vec<Option<Scalar>> = types.iter().map(|word| Scalar::wide(word)).collect();
            if found.iter().any(Option::is_some) {
                let double = |word| if Scalar::wide(word).is_some() { "double" } else { word };
                let (name, before) = words.split_last().unwrap_or((&"", &[]));
                let before: Vec<&str> = before.iter().map(|word| double(word)).collect();
                known += &format!("{} {name}\n", before.join(" "));
            } else {
                known += line;
            }
            wide.push(found);
        } else {
            known += line;
        }
    }
    (known, wide)
}

/// Gives properties the integers of 64 bits that the parser has read as doubles.
fn widen(elements: &mut [Element], wide: &Wide) {
    let properties = elements.iter_mut().flat_map(|element| &mut element.properties);
    for (property, wide) in properties.zip(wide) {
        match (&mut property.shape, wide.as_slice()) {
            (Shape::Scalar(scalar), [Some(wide)]) => *scalar = *wide,
            (Shape::List { count, item }, [of_count, of_item]) => {
                (*count, *item) = (of_count.unwrap_or(*count), of_item.unwrap_or(*item));
            }
            _ => {}
        }
    }
}

/// Splits a file after its `end_header` line. The lines of a header end as its first one does, in an old file with a carriage
/// return alone.
fn split(bytes: &[u8]) -> Result<(String, &[u8]), FormatError> {
    if !bytes.starts_with(b"ply") {
        return Err(FormatError::at("byte 0", "this is not a PLY file", "check its extension"));
    }
    let first = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(0);
    let is_old = bytes[first..].starts_with(b"\r") && !bytes[first..].starts_with(b"\r\n");
    let line_end = if is_old { b'\r' } else { b'\n' };
    let mut end = 0;
    for line in bytes.split_inclusive(|&byte| byte == line_end) {
        end += line.len();
        if line.trim_ascii_end() == b"end_header" {
            let (header, body) = bytes.split_at(end);
            let text = String::from_utf8_lossy(header);
            return Ok((if is_old { text.replace('\r', "\n") } else { text.into_owned() }, body));
        }
    }
    Err(FormatError::at(
        format!("byte {end}"),
        "the header has no end_header line",
        "the file is cut short; copy or export it again",
    ))
}

fn not_understood(text: &str, error: &ParseError) -> FormatError {
    let Some(line) = error.line() else {
        let problem = error.to_string();
        return FormatError::at("header", problem.trim_end_matches('.'), "export the file again");
    };
    let written = text.lines().nth(line.saturating_sub(1)).unwrap_or("");
    FormatError::at(
        format!("line {line}"),
        format!("cannot understand {} here", excerpt(written)),
        "mend the header or export the file again",
    )
}
