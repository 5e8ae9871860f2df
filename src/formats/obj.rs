//! Wavefront OBJ: vertices, polygons and their names.
//!
//! The reader takes `v`, `f`, `g`, `o` and `usemtl` and skips every other statement, also `mtllib`, so
//! that it never opens a second file. Corners may be written `1`, `1/2`, `1//3` or `1/2/3`, count
//! from 1 or back from -1, and refer to vertices further down. A backslash continues a line.

use std::borrow::Cow;

use super::error::FormatError;
use super::line::{self, excerpt, point};
use crate::geometry::Mesh;
use crate::geometry::mesh::LabelBuilder;

/// Reads the polygons of an OBJ file.
///
/// Polygons become fans of triangles round their first corner; faces of one or two corners are no surface and are skipped, as
/// lines are. Facets are labelled `usemtl` by
/// material name and `group` by the text of the latest `g` or `o`; a label that no facet has a name
/// in is left out.
///
/// # Errors
///
/// Names the line of a vertex without three numbers, of a face without corners, or of a face that refers to a vertex that does
/// not exist.
pub fn read_mesh(bytes: &[u8]) -> Result<Mesh, FormatError> {
    let text = line::text(bytes)?;
    let mut reader = Reader::new();
    for (line, statement) in statements(&text) {
        reader.read(line, &statement).map_err(|problem| malformed(line, problem))?;
    }
    reader.finish()
}

/// Logical lines with the number, from 1, of their first physical line.
fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (1..).zip(line::lines(text));
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let mut statement = Cow::Borrowed(line);
        let is_comment = line.trim_start().starts_with('#');
        while !is_comment && statement.ends_with('\\') {
            let joined = statement.to_mut();
            joined.pop();
            joined.push(' ');
            joined.push_str(lines.next().map_or("", |(_, line)| line));
        }
        Some((number, statement))
    })
}

struct Reader {
    mesh: Mesh,
    materials: LabelBuilder,
    groups: LabelBuilder,
    material: String,
    group: String,
    /// The greatest vertex index any face refers to, and that face's line.
    furthest: (u32, usize),
}

impl Reader {
    fn new() -> Reader {
        Reader {
            mesh: Mesh::default(),
            materials: LabelBuilder::new("usemtl"),
            groups: LabelBuilder::new("group"),
            material: String::new(),
            group: String::new(),
            furthest: (0, 0),
        }
    }

    fn read(&mut self, line: usize, statement: &str) -> Result<(), String> {
        let statement = statement.trim();
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        match keyword {
            "v" => self.vertex(rest)?,
            "f" => self.face(line, rest)?,
            "g" | "o" => self.group = rest.trim().to_owned(),
            "usemtl" => self.material = rest.trim().to_owned(),
            _ => {}
        }
        Ok(())
    }

    fn vertex(&mut self, rest: &str) -> Result<(), String> {
        let vertex = point(rest.split_whitespace())
            .ok_or_else(|| format!("vertex {} is not three numbers", excerpt(rest)))?;
        self.mesh.vertices.push(vertex);
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &str) -> Result<(), String> {
        let facets_before = self.mesh.facets.len();
        let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let first = words.next().ok_or("a face has no corners")?;
        let first = self.corner(line, first)?;
        let mut previous = None;
        for word in words {
            let next = self.corner(line, word)?;
            if let Some(previous) = previous.replace(next) {
                self.mesh.facets.push([first, previous, next]);
            }
        }
        let facets = self.mesh.facets.len() - facets_before;
        self.materials.push(&self.material, facets);
        self.groups.push(&self.group, facets);
        Ok(())
    }

    /// The vertex, from 0, that a corner such as `12/3/4` or `-1` refers to.
    fn corner(&mut self, line: usize, word: &str) -> Result<u32, String> {
        let (vertex, _) = word.split_once('/').unwrap_or((word, ""));
        let number: i64 =
            vertex.parse().map_err(|_| format!("corner {} has no vertex number", excerpt(word)))?;
        let before = if number < 0 { self.mesh.vertices.len() as i64 } else { -1 };
        let index = u32::try_from(number.saturating_add(before))
            .map_err(|_| format!("there is no vertex {number}"))?;
        self.furthest = self.furthest.max((index, line));
        Ok(index)
    }

    fn finish(self) -> Result<Mesh, FormatError> {
        let Reader { mut mesh, materials, groups, furthest: (index, line), .. } = self;
        let vertices = mesh.vertices.len();
        if line > 0 && index as usize >= vertices {
            let vertex = u64::from(index) + 1;
            let problem = format!("there is no vertex {vertex}, only {vertices} are defined");
            return Err(malformed(line, problem));
        }
        let labels = [materials.finish(), groups.finish()].into_iter();
        mesh.labels =
            labels.filter(|label| label.names.iter().any(|name| !name.is_empty())).collect();
        Ok(mesh)
    }
}

fn malformed(line: usize, problem: String) -> FormatError {
    FormatError::at(format!("line {line}"), problem, "repair or export the mesh again")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::FacetLabels;
    use glam::DVec3;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(statements: &str) -> Result<Mesh, FormatError> {
        read_mesh(format!("{SQUARE}{statements}").as_bytes())
    }

    fn message(statements: &str) -> String {
        read(statements).unwrap_err().to_string()
    }

    #[test]
    fn corners_in_every_notation() {
        for face in ["1 2 3", "1/7 2/7 3/7", "1//1 2//1 3//1", "1/7/1 2/7/1 3/7/1", "-4 -3 -2"] {
            let mesh = read(&format!("vt 0 0\nvn 0 0 1\nf  {face} \n")).unwrap();
            assert_eq!(mesh.facets, [[0, 1, 2]], "{face}");
        }
    }

    #[test]
    fn polygons_become_fans() {
        assert_eq!(read("f 1 2 3 4 # a square").unwrap().facets, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn coordinates_keep_double_precision_and_ignore_weight_and_colour() {
        let mesh = read_mesh(b"v 0.1 -2e-3 .5 1.0 0.2 0.3 0.4\r\n").unwrap();
        assert_eq!(mesh.vertices, [DVec3::new(0.1, -2e-3, 0.5)]);
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        let mesh = read_mesh(format!("f 1 2 3\n{SQUARE}").as_bytes()).unwrap();
        assert_eq!(mesh.facets, [[0, 1, 2]]);
    }

    #[test]
    fn materials_and_groups_label_facets() {
        let mesh = read(
            "mtllib no such file.mtl\nf 1 2 3\no my body\nusemtl skin #1\nf 1 2 3 4\n\
             g\nf 1 2 4\ng arm left\nusemtl cloth\nf 1 2 4\n",
        );
        assert_eq!(
            mesh.unwrap().labels,
            [
                FacetLabels::from_names("usemtl", ["", "skin #1", "skin #1", "skin #1", "cloth"]),
                FacetLabels::from_names("group", ["", "my body", "my body", "", "arm left"]),
            ]
        );
        assert!(read("f 1 2 3\n").unwrap().labels.is_empty());
    }

    #[test]
    fn lines_may_be_continued_and_end_in_crlf() {
        let mesh = read("f 1 \\\r\n2 \\\r\n3\r\nf 2 3 4 \\").unwrap();
        assert_eq!(mesh.facets, [[0, 1, 2], [1, 2, 3]]);
    }

    #[test]
    fn a_byte_order_mark_and_old_line_ends_lose_no_vertex() {
        let text = format!("{SQUARE}f 1 2 3\nf 1 3 4\n");
        let expected = read_mesh(text.as_bytes()).unwrap();
        assert_eq!(expected.vertices.len(), 4);
        let mixed = text.replacen('\n', "\r", 2);
        for text in [format!("\u{feff}{text}"), text.replace('\n', "\r"), mixed] {
            assert_eq!(read_mesh(text.as_bytes()).unwrap(), expected, "{text:?}");
        }
    }

    #[test]
    fn faces_of_two_corners_are_lines() {
        let mesh = read("usemtl a\nf 1 2\nf 1\nf 1 2 3\n").unwrap();
        assert_eq!(mesh.facets, [[0, 1, 2]]);
        assert_eq!(mesh.labels[0].names.len(), 1);
    }

    #[test]
    fn text_need_not_be_utf8() {
        let mesh = read_mesh(b"# caf\xe9\nv 0 0 0\nusemtl \xe9\nf 1 1 1\n").unwrap();
        assert_eq!(mesh.labels[0].names, ["\u{fffd}"]);
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("f 1 2 3\nf 1 2 5\nf 1 2 3", "line 6: there is no vertex 5, only 4 are defined; "),
            ("\nf 1 2 0", "line 6: there is no vertex 0; "),
            ("f 1 2 -5", "line 5: there is no vertex -5; "),
            ("f 1 2 9999999999", "line 5: there is no vertex 9999999999; "),
            ("f 1 5", "line 5: there is no vertex 5, only 4 are defined; "),
            ("f", "line 5: a face has no corners; "),
            ("f # 1 2 3", "line 5: a face has no corners; "),
            ("f 1 2 x/1/1", "line 5: corner \"x/1/1\" has no vertex number; "),
            ("v 1 2", "line 5: vertex \"1 2\" is not three numbers; "),
            ("f 1 \\\n2 3\nv 1 \\\n x 3", "line 7: vertex \"1   x 3\" is not"),
        ];
        for (statements, expected) in cases {
            let problem = message(statements);
            assert!(problem.starts_with(expected), "{statements}: {problem}");
        }
    }
}
