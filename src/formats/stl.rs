//! STL, binary and ascii: unconnected triangles, which become a mesh of shared vertices.
//!
//! Normals and attribute bytes are ignored: a facet's corners say the same, and more exactly.

use std::collections::HashMap;

use glam::DVec3;

use super::error::FormatError;
use super::line::{self, excerpt, point};
use crate::geometry::Mesh;
use crate::geometry::mesh::LabelBuilder;

const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;

/// Reads the triangles of an STL file. Corners of equal bits become one vertex.
///
/// A file is binary when its length is what its count asks for, even if it begins with `solid`; behind the facets it may hold less
/// than a facet takes, or zeros. An ascii file of several solids gets the label `solid` with their names. Several
/// statements may be on one line, and the ends of loops, facets and solids in one word or two.
///
/// # Errors
///
/// When a binary file's length and its count disagree; names the line at which an ascii file
/// breaks the format or ends too early.
pub fn read_mesh(bytes: &[u8]) -> Result<Mesh, FormatError> {
    if let Some((facets, [])) = binary_facets(bytes) {
        return Ok(read_binary(facets));
    }
    if is_text(line::without_mark(bytes)) {
        return read_ascii(&line::text(bytes)?);
    }
    match binary_facets(bytes) {
        Some((facets, rest)) if is_padding(facets, rest) => Ok(read_binary(facets)),
        // Of text in UTF-16 this says so.
        _ => line::text(bytes.get(..HEADER_BYTES).unwrap_or(bytes)).and(Err(neither(bytes))),
    }
}

/// The bytes of as many facets as the header says, and those behind them.
fn binary_facets(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (header, facets) = bytes.split_at_checked(HEADER_BYTES)?;
    let count = u32::from_le_bytes(*header.last_chunk()?) as usize;
    facets.split_at_checked(count.checked_mul(FACET_BYTES)?)
}

/// Whether the bytes behind the facets can be no facet that the count has missed.
fn is_padding(facets: &[u8], rest: &[u8]) -> bool {
    !facets.is_empty() && (rest.len() < FACET_BYTES || rest.iter().all(|byte| *byte == 0))
}

/// Binary files that are cut short may begin with `solid` too, but hold zero bytes.
fn is_text(bytes: &[u8]) -> bool {
    let starts_well = bytes
        .trim_ascii_start()
        .first_chunk::<5>()
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    starts_well && !bytes.contains(&0)
}

fn neither(bytes: &[u8]) -> FormatError {
    let Some(count) = bytes.get(80..).and_then(|b| b.first_chunk()).copied() else {
        return FormatError::at("byte 0", "this is not an STL file", "check its extension");
    };
    let count = u32::from_le_bytes(count);
    let expected_bytes = HEADER_BYTES as u64 + FACET_BYTES as u64 * u64::from(count);
    FormatError::at(
        "byte 80",
        format!("{count} facets take {expected_bytes} bytes, but the file has {}", bytes.len()),
        "copy or export the file again",
    )
}

fn read_binary(facets: &[u8]) -> Mesh {
    let mut welder = Welder::default();
    let facets = facets.as_chunks::<FACET_BYTES>().0.iter().map(|facet| {
        let (_normal, corners) = facet.split_at(12);
        let mut vertices = corners.as_chunks().0.iter().map(|c| welder.vertex(corner(c)));
        std::array::from_fn(|_| vertices.next().unwrap_or_default())
    });
    let facets = facets.collect();
    Mesh { vertices: welder.vertices, facets, labels: Vec::new() }
}

/// A corner: x, y and z in single precision, least significant byte first.
fn corner(bytes: &[u8; 12]) -> DVec3 {
    let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3] = *bytes;
    [[x0, x1, x2, x3], [y0, y1, y2, y3], [z0, z1, z2, z3]]
        .map(|coordinate| f64::from(f32::from_le_bytes(coordinate)))
        .into()
}

fn read_ascii(text: &str) -> Result<Mesh, FormatError> {
    let mut reader = AsciiReader::new();
    let mut lines = 0;
    for line in line::lines(text) {
        lines += 1;
        reader.read(line).map_err(|problem| malformed(lines, problem))?;
    }
    reader.finish().map_err(|problem| malformed(lines, problem))
}

struct AsciiReader {
    welder: Welder,
    facets: Vec<[u32; 3]>,
    /// Of the facet being read.
    corners: Vec<u32>,
    /// Name of the solid being read.
    solid: Option<String>,
    solids: LabelBuilder,
}

impl AsciiReader {
    fn new() -> AsciiReader {
        AsciiReader {
            welder: Welder::default(),
            facets: Vec::new(),
            corners: Vec::new(),
            solid: None,
            solids: LabelBuilder::new("solid"),
        }
    }

    /// Reads a line, on which several statements may follow each other.
    fn read(&mut self, line: &str) -> Result<(), String> {
        let mut rest = line.trim();
        while !rest.is_empty() {
            let statement = rest;
            let keyword = word(&mut rest).to_ascii_lowercase();
            let ended = if keyword == "end" { word(&mut rest) } else { "" };
            match (keyword + ended).to_ascii_lowercase().as_str() {
                "vertex" => {
                    let coordinates = rest;
                    let corner = point((0..3).map(|_| word(&mut rest))).ok_or_else(|| {
                        format!("vertex {} is not three numbers", excerpt(coordinates))
                    })?;
                    self.corners.push(self.welder.vertex(corner));
                }
                "facet" => {
                    // The word `normal` and three numbers, of which some writers leave out all.
                    let mut behind = rest;
                    if word(&mut behind).eq_ignore_ascii_case("normal") {
                        for _ in 0..3 {
                            word(&mut behind);
                        }
                        rest = behind;
                    }
                }
                "outer" if word(&mut rest).eq_ignore_ascii_case("loop") => {}
                "endloop" => self.end_facet()?,
                "endfacet" => {}
                // Their names reach to the end of the line, or to the first facet.
                "solid" => self.solid = Some(name(&mut rest).to_owned()),
                "endsolid" => {
                    self.solid = None;
                    name(&mut rest);
                }
                _ => return Err(format!("{} is not STL", excerpt(statement))),
            }
            // Some writers add colours and numbers.
            let next = word(&mut { rest });
            if !KEYWORDS.iter().any(|known| next.eq_ignore_ascii_case(known)) {
                return Ok(());
            }
        }
        Ok(())
    }

    fn end_facet(&mut self) -> Result<(), String> {
        let corners = self.corners.as_slice().try_into();
        let facet = corners.map_err(|_| format!("a facet has {} corners", self.corners.len()))?;
        self.facets.push(facet);
        self.corners.clear();
        self.solids.push(self.solid.as_deref().unwrap_or(""), 1);
        Ok(())
    }

    fn finish(self) -> Result<Mesh, String> {
        if !self.corners.is_empty() {
            return Err("the file ends inside a facet".to_owned());
        }
        if self.solid.is_some() {
            return Err("the file ends without endsolid and may be cut short".to_owned());
        }
        let solids = self.solids.finish();
        let labels = if solids.names.len() > 1 { vec![solids] } else { Vec::new() };
        Ok(Mesh { vertices: self.welder.vertices, facets: self.facets, labels })
    }
}

/// Words that begin a statement.
const KEYWORDS: [&str; 8] =
    ["solid", "facet", "outer", "vertex", "endloop", "endfacet", "endsolid", "end"];

/// The name of a solid: what is before `facet normal` or `facet outer`, which the line then begins with.
fn name<'a>(line: &mut &'a str) -> &'a str {
    let whole = *line;
    loop {
        let before = *line;
        let mut behind = before;
        let is_facet = word(&mut behind).eq_ignore_ascii_case("facet");
        *line = behind;
        let next = word(&mut behind);
        if is_facet && ["normal", "outer"].iter().any(|known| next.eq_ignore_ascii_case(known)) {
            *line = before;
        } else if !line.is_empty() {
            continue;
        }
        return whole[..whole.len() - line.len()].trim_end();
    }
}

/// The next word of a line, which then begins behind it; empty at its end.
fn word<'a>(line: &mut &'a str) -> &'a str {
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    *line = rest.trim_start();
    word
}

fn malformed(line: usize, problem: String) -> FormatError {
    FormatError::at(format!("line {line}"), problem, "copy or export the file again")
}

/// Gives each point a number, and equal points the same one.
#[derive(Default)]
struct Welder {
    vertices: Vec<DVec3>,
    number_of_bits: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn vertex(&mut self, point: DVec3) -> u32 {
        *self.number_of_bits.entry(point.to_array().map(f64::to_bits)).or_insert_with(|| {
            self.vertices.push(point);
            self.vertices.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLES: [[[f32; 3]; 3]; 2] = [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1]],
        [[0.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.0]],
    ];

    fn binary(title: &str) -> Vec<u8> {
        let mut bytes = title.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2u32.to_le_bytes());
        for corners in TRIANGLES {
            bytes.extend([f32::NAN; 3].iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    fn solid(name: &str) -> String {
        let facets: String = (TRIANGLES.iter())
            .map(|corners| {
                let vertices: String =
                    corners.iter().map(|[x, y, z]| format!("      vertex {x} {y} {z}\n")).collect();
                format!("  facet normal 0 0 1\n    outer loop\n{vertices}    endloop\n  endfacet\n")
            })
            .collect();
        format!("solid {name}\n{facets}endsolid {name}\n")
    }

    fn message(bytes: &[u8]) -> String {
        read_mesh(bytes).unwrap_err().to_string()
    }

    #[test]
    fn binary_corners_are_welded() {
        for title in ["made by hand", "solid of a writer that knows no better"] {
            let mesh = read_mesh(&binary(title)).unwrap();
            assert_eq!(mesh.facets, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.vertices[2], DVec3::new(1.0, 1.0, f64::from(0.1f32)));
            assert!(mesh.labels.is_empty());
        }
    }

    #[test]
    fn ascii_corners_are_welded() {
        for text in [solid("plate"), solid(""), solid("plate").replace('\n', "\r\n")] {
            for text in [text.to_uppercase(), text] {
                let mesh = read_mesh(text.as_bytes()).unwrap();
                assert_eq!(mesh.facets, [[0, 1, 2], [0, 2, 3]]);
                assert_eq!(mesh.vertices[2], DVec3::new(1.0, 1.0, 0.1));
                assert!(mesh.labels.is_empty());
            }
        }
    }

    #[test]
    fn words_may_be_on_any_lines_and_ends_in_two_words() {
        let usual = solid("plate");
        let expected = read_mesh(usual.as_bytes()).unwrap();
        let split = usual.replace("endloop", "end loop").replace("endfacet", "end facet");
        let joined = usual.replace("\n ", "  ");
        let coloured =
            usual.replace("1 0 0\n", "1 0 0 255 0 0\n").replace("endfacet", "endfacet 7");
        for text in [format!("\u{feff}{usual}"), usual.replace('\n', "\r"), split, joined, coloured]
        {
            assert_eq!(read_mesh(text.as_bytes()).unwrap(), expected, "{text:?}");
        }
        let mut line = "my facet of  facet normal 0 0 1";
        assert_eq!((name(&mut line), line), ("my facet of", "facet normal 0 0 1"));
        let mut line = "plate";
        assert_eq!((name(&mut line), line), ("plate", ""));
    }

    #[test]
    fn several_solids_are_all_read_and_labelled() {
        let mesh = read_mesh((solid("left arm") + &solid("right arm")).as_bytes()).unwrap();
        assert_eq!(mesh.facets.len(), 4);
        assert_eq!(mesh.vertices.len(), 4);
        let names = ["left arm", "left arm", "right arm", "right arm"];
        assert_eq!(mesh.labels, [crate::geometry::FacetLabels::from_names("solid", names)]);
    }

    #[test]
    fn a_binary_file_must_be_as_long_as_its_count_says() {
        for title in ["made by hand", "solid plate"] {
            let bytes = binary(title);
            for wrong in [&bytes[..183], &[bytes.as_slice(), &[7; 50]].concat()] {
                let expected = "byte 80: 2 facets take 184 bytes, but the file has";
                assert!(message(wrong).starts_with(expected), "{}", message(wrong));
            }
            // Less than a facet, or zeros, can be no facet.
            for rest in [&b"\r\n"[..], &[0; 512]] {
                let mesh = read_mesh(&[&bytes, rest].concat()).unwrap();
                assert_eq!(mesh, read_mesh(&bytes).unwrap());
            }
        }
        let none = [&binary("none")[..80], &[0; 104]].concat();
        assert!(message(&none).starts_with("byte 80: 0 facets take 84 bytes, but"));
        assert!(message(b"").starts_with("byte 0: this is not an STL file"));
        assert!(message(&[0; 80]).starts_with("byte 0: this is not an STL file"));
        assert!(message(&[0xff; 84]).starts_with("byte 80: 4294967295 facets"));
    }

    #[test]
    fn ascii_errors_name_the_line() {
        let good = solid("plate");
        let cases = [
            ("vertex 1 0 0", "vertex 1 0", "line 5: vertex \"1 0\" is not three numbers; "),
            ("vertex 1 0 0", "vertex 1 0,0 0", "line 5: vertex "),
            ("      vertex 1 0 0\n", "", "line 6: a facet has 2 corners; "),
            ("outer loop", "inner loop", "line 3: \"inner loop\" is not STL; "),
            (
                "endsolid plate\n",
                "",
                "line 15: the file ends without endsolid and may be cut short; ",
            ),
            (
                "endloop\n  endfacet\nendsolid plate\n",
                "",
                "line 14: the file ends inside a facet; ",
            ),
            ("facet normal 0 0 1", "normal 0 0 1", "line 2: \"normal 0 0 1\" is not STL; "),
        ];
        for (what, instead, expected) in cases {
            let problem = message(good.replacen(what, instead, 1).as_bytes());
            assert!(problem.starts_with(expected), "{instead}: {problem}");
        }
    }
}
