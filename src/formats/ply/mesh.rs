//! PLY to triangle mesh, and back.

use std::fmt::Write;

use glam::DVec3;

use super::body::{Body, Row};
use super::header::{Element, Header, MOST_EXACT, Shape};
use super::parallel;
use crate::formats::error::FormatError;
use crate::geometry::Mesh;
use crate::geometry::mesh::LabelBuilder;

/// Most labels of a file per byte.
const LABELS_PER_BYTE: usize = 2;

/// Reads the `vertex` and `face` elements of a PLY file.
///
/// Polygons become fans of triangles round their first corner; faces of one or two corners are no surface and are skipped. Strips
/// of triangles (`tristrips`) are read, too, in which -1 begins another strip. Every integer property of the faces
/// becomes labels named for it, with the decimal values as names. A file without faces gives a mesh
/// without facets.
///
/// # Errors
///
/// Names the line, byte or face (numbered from 0) at which the file breaks its format or its header,
/// or where a face refers to a vertex that does not exist.
pub fn read_mesh(bytes: &[u8]) -> Result<Mesh, FormatError> {
    let header = Header::read(bytes)?;
    let vertices = header.element("vertex").map_or(0, |element| element.count);
    let mut body = Body::new(&header, bytes.len());
    let (mut mesh, mut strips, mut thin) = (Mesh::default(), Vec::new(), None);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => mesh.vertices = read_vertices(&mut body, element)?,
            "face" => {
                let list = corner_list(element)?;
                if let Some(facets) = parallel::triangles(&mut body, element, vertices) {
                    mesh.facets = facets;
                    continue;
                }
                let mut faces = Faces::new(element, vertices, bytes.len());
                body.for_each_row(element, list, |n, row| faces.push(n, row))?;
                (mesh.facets, thin) = (faces.facets, faces.thin);
                mesh.labels = faces.labels.into_iter().map(|(_, l)| l.finish()).collect();
            }
            "tristrips" => {
                let list = corner_list(element)?;
                body.for_each_row(element, list, |n, row| strip(&mut strips, vertices, n, row))?;
            }
            _ => body.skip(element)?,
        }
    }
    // In a damaged binary file a wrong number of corners shifts all that follows.
    if let Some((face, corners)) = thin.filter(|_| body.has_more_bytes()) {
        return Err(FormatError::at(
            format!("face {face}"),
            format!("has {corners} corners, and bytes are left over at the end"),
            "repair or export the mesh again",
        ));
    }
    let facets = mesh.facets.len().saturating_add(strips.len());
    check_labels("tristrips", facets, mesh.labels.len(), bytes.len())?;
    mesh.push_unnamed(strips);
    Ok(mesh)
}

/// A binary file of vertices, in double precision, and facets; labels of facets are left out.
pub fn write_mesh(mesh: &Mesh) -> Vec<u8> {
    let (vertices, facets) = (mesh.vertices.len(), mesh.facets.len());
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nelement face {facets}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.extend(
        mesh.vertices.iter().flat_map(|vertex| vertex.to_array()).flat_map(f64::to_le_bytes),
    );
    for facet in &mesh.facets {
        bytes.push(3);
        bytes.extend(facet.iter().flat_map(|index| index.to_le_bytes()));
    }
    bytes
}

/// The triangles of strips, of which every other one runs the other way round.
fn strip(
    facets: &mut Vec<[u32; 3]>,
    vertices: usize,
    number: usize,
    row: &Row,
) -> Result<(), FormatError> {
    if let Some(&stray) =
        (row.list.iter()).find(|&&corner| corner != -1.0 && vertex(corner, vertices).is_none())
    {
        return Err(no_such_vertex("tristrips", number, stray, vertices));
    }
    facets.reserve_exact(row.list.len());
    for strip in row.list.split(|corner| *corner == -1.0) {
        for (at, corners) in strip.windows(3).enumerate() {
            let [a, b, c] = std::array::from_fn(|k| corners[k] as u32);
            if a != b && b != c && c != a {
                facets.push(if at % 2 == 1 { [b, a, c] } else { [a, b, c] });
            }
        }
    }
    Ok(())
}

/// A polygon with many corners, or a strip, repeats all labels as often, so a small file could ask for very many. A triangle
/// has fewer labels than bytes, and the whole file may have [`LABELS_PER_BYTE`].
fn check_labels(
    place: impl std::fmt::Display,
    facets: usize,
    labels: usize,
    file_bytes: usize,
) -> Result<(), FormatError> {
    if facets.saturating_mul(labels) <= file_bytes.saturating_mul(LABELS_PER_BYTE) {
        return Ok(());
    }
    Err(FormatError::at(
        place.to_string(),
        format!("{labels} labels on polygons of so many corners"),
        "export the mesh as triangles, or without the face properties",
    ))
}

/// The number of a vertex, if there is such a one.
fn vertex(corner: f64, vertices: usize) -> Option<u32> {
    let index = corner as u32;
    (f64::from(index) == corner && (index as usize) < vertices).then_some(index)
}

fn no_such_vertex(what: &str, number: usize, corner: f64, vertices: usize) -> FormatError {
    FormatError::at(
        format!("{what} {number}"),
        format!("refers to vertex {corner}, but the file has {vertices} vertices"),
        "repair or export the mesh again",
    )
}

fn read_vertices(body: &mut Body, element: &Element) -> Result<Vec<DVec3>, FormatError> {
    let (x, y, z) = (element.scalar("x")?, element.scalar("y")?, element.scalar("z")?);
    if let Some(vertices) = parallel::vertices(body, element, [x, y, z]) {
        return Ok(vertices);
    }
    let mut vertices = Vec::with_capacity(element.count);
    body.for_each_row(element, None, |_, Row { scalars, .. }| {
        vertices.push(DVec3::new(scalars[x], scalars[y], scalars[z]));
        Ok(())
    })?;
    Ok(vertices)
}

/// Where among a face's properties its corners are.
fn corner_list(element: &Element) -> Result<Option<usize>, FormatError> {
    let at = element.properties.iter().position(|property| {
        matches!(property.shape, Shape::List { .. })
            && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
    });
    if at.is_none() && element.count > 0 {
        return Err(FormatError::at(
            "header",
            format!("element {} has no list called vertex_indices or vertex_index", element.name),
            "export the mesh as triangles",
        ));
    }
    Ok(at)
}

/// The faces read so far.
struct Faces {
    vertices: usize,
    facets: Vec<[u32; 3]>,
    /// The first face of fewer than three corners, and their number.
    thin: Option<(usize, usize)>,
    /// Each with the place of its property.
    labels: Vec<(usize, LabelBuilder)>,
    file_bytes: usize,
    text: String,
}

impl Faces {
    fn new(element: &Element, vertices: usize, file_bytes: usize) -> Faces {
        let labels = element.properties.iter().enumerate().filter_map(|(at, p)| match p.shape {
            Shape::Scalar(scalar) if scalar.integer_range().is_some() => {
                Some((at, LabelBuilder::new(&p.name)))
            }
            _ => None,
        });
        Faces {
            vertices,
            facets: Vec::with_capacity(element.count),
            thin: None,
            labels: labels.collect(),
            file_bytes,
            text: String::new(),
        }
    }

    fn push(&mut self, face: usize, row: &Row) -> Result<(), FormatError> {
        let corners = row.list.as_slice();
        if let Some(&stray) =
            corners.iter().find(|&&corner| vertex(corner, self.vertices).is_none())
        {
            return Err(no_such_vertex("face", face, stray, self.vertices));
        }
        if corners.len() < 3 {
            self.thin.get_or_insert((face, corners.len()));
        }
        let [first, second, others @ ..] = corners else { return Ok(()) };
        let mut previous = *second;
        for &next in others {
            self.facets.push([*first as u32, previous as u32, next as u32]);
            previous = next;
        }
        self.label(face, &row.scalars, others.len())
    }

    fn label(&mut self, face: usize, scalars: &[f64], facets: usize) -> Result<(), FormatError> {
        let place = format_args!("face {face}");
        check_labels(place, self.facets.len(), self.labels.len(), self.file_bytes)?;
        for (at, label) in &mut self.labels {
            if scalars[*at].abs() > MOST_EXACT {
                return Err(FormatError::at(
                    place.to_string(),
                    format!("the label {} has more than 53 bits", scalars[*at]),
                    "number the parts from 0",
                ));
            }
            self.text.clear();
            // Writing to a string cannot fail.
            let _ = write!(self.text, "{}", scalars[*at] as i64);
            label.push(&self.text, facets);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::FacetLabels;

    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

    fn ascii(face_properties: &str, faces: &[&str]) -> String {
        format!(
            "ply\nformat ascii 1.0\ncomment made by hand\nobj_info none\nelement vertex 4\n\
             property float x\nproperty float y\nproperty float z\nelement face {}\n\
             {face_properties}end_header\n{SQUARE}{}\n",
            faces.len(),
            faces.join("\n")
        )
    }

    fn binary(encoding: &str, properties: &str, body: &[u8]) -> Vec<u8> {
        let header = format!("ply\nformat binary_{encoding}_endian 1.0\n{properties}end_header\n");
        [header.as_bytes(), body].concat()
    }

    fn message(text: &str) -> String {
        read_mesh(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_mesh_that_was_written_is_read_again() {
        let vertices = vec![DVec3::new(0.1, -1e-300, 7.0), DVec3::X, DVec3::Y, DVec3::ONE];
        let mesh = Mesh { vertices, facets: vec![[0, 1, 2], [3, 2, 1]], labels: Vec::new() };
        assert_eq!(read_mesh(&write_mesh(&mesh)).unwrap(), mesh);
    }

    #[test]
    fn triangles_and_polygons_in_ascii() {
        for name in ["vertex_index", "vertex_indices"] {
            let text =
                ascii(&format!("property list uchar int {name}\n"), &["3 0 1 2", "4 0 1 2 3"]);
            let mesh = read_mesh(text.as_bytes()).unwrap();
            assert_eq!(mesh.facets, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.vertices[2], DVec3::new(1.0, 1.0, 0.0));
            assert!(mesh.labels.is_empty());
        }
    }

    #[test]
    fn every_encoding_gives_the_same_mesh() {
        let properties = "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                          element face 1\nproperty list int ushort vertex_indices\n";
        let numbers = [0.0, 0.5, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.25f64];
        let little: Vec<u8> = (numbers.iter().flat_map(|x| x.to_le_bytes()))
            .chain(3i32.to_le_bytes())
            .chain([2u16, 1, 0].iter().flat_map(|i| i.to_le_bytes()))
            .collect();
        let big: Vec<u8> = (numbers.iter().flat_map(|x| x.to_be_bytes()))
            .chain(3i32.to_be_bytes())
            .chain([2u16, 1, 0].iter().flat_map(|i| i.to_be_bytes()))
            .collect();
        let text = format!(
            "ply\nformat ascii 1.0\n{properties}end_header\n0 0.5 -1\n1 2 3\n4 5 6.25\n3 2 1 0"
        );
        let mesh = read_mesh(&binary("little", properties, &little)).unwrap();
        assert_eq!(mesh.facets, [[2, 1, 0]]);
        assert_eq!(mesh.vertices[0], DVec3::new(0.0, 0.5, -1.0));
        assert_eq!(read_mesh(&binary("big", properties, &big)).unwrap(), mesh);
        assert_eq!(read_mesh(text.as_bytes()).unwrap(), mesh);
    }

    /// A grid of squares, each of two triangles, with a further number for each vertex.
    fn grid(encoding: &str, item: &str, side: u32) -> Vec<u8> {
        let is_little = encoding == "little";
        let float = |x: f32| if is_little { x.to_le_bytes() } else { x.to_be_bytes() };
        let index = |i: u32| if is_little { i.to_le_bytes() } else { i.to_be_bytes() };
        let mut body = Vec::new();
        for at in 0..side * side {
            let (x, y) = ((at % side) as f32, (at / side) as f32);
            body.push(at as u8);
            body.extend([x * 0.1, y * 0.1, (x * y).sin()].map(float).as_flattened());
        }
        for at in (0..side * (side - 1)).filter(|at| at % side < side - 1) {
            for corners in [[at, at + 1, at + side], [at + 1, at + side + 1, at + side]] {
                body.push(3);
                body.extend(corners.map(index).as_flattened());
            }
        }
        let properties = format!(
            "element vertex {}\nproperty uchar flag\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar {item} vertex_indices\n",
            side * side,
            2 * (side - 1) * (side - 1)
        );
        binary(encoding, &properties, &body)
    }

    #[test]
    fn the_common_layout_gives_what_the_general_reader_does() {
        // More rows than one thread takes at a time; only little-endian files take the short way.
        let general = read_mesh(&grid("big", "int", 160)).unwrap();
        assert_eq!(general.facets.len(), 2 * 159 * 159);
        for item in ["int", "uint"] {
            assert_eq!(read_mesh(&grid("little", item, 160)).unwrap(), general);
        }
    }

    #[test]
    fn faults_in_the_common_layout_have_the_place_that_the_general_reader_finds() {
        let good = grid("little", "int", 4);
        let face = |number: usize| good.len() - 13 * (18 - number);
        let altered = |at: usize, byte: u8| {
            let mut bytes = good.clone();
            bytes[at] = byte;
            read_mesh(&bytes)
        };
        let problem = |at, byte| altered(at, byte).unwrap_err().to_string();
        assert!(problem(face(7) + 1, 16).starts_with("face 7: refers to vertex 16, but the file"));
        assert!(problem(face(9) + 12, 255).starts_with("face 9: refers to vertex -16"));
        assert!(problem(face(3), 2).starts_with("face "));
        let thin = [&good[..face(17)], &[2], &good[face(17) + 1..]].concat();
        let problem_of = |bytes: &[u8]| read_mesh(bytes).unwrap_err().to_string();
        assert!(problem_of(&thin).starts_with("face 17: has 2 corners, and bytes are left over"));
        assert_eq!(read_mesh(&thin[..thin.len() - 4]).unwrap().facets.len(), 17);
        assert!(problem(face(17), 4).starts_with(&format!("byte {}: the file ends", good.len())));
        assert!(read_mesh(&good[..good.len() - 1]).is_err());
        // Four corners on the way, and the file is as long as it must be.
        let mut quad = good.clone();
        quad[face(0)] = 4;
        quad.splice(face(1)..face(1), 0u32.to_le_bytes());
        assert_eq!(read_mesh(&quad).unwrap().facets.len(), 19);
    }

    #[test]
    fn other_peoples_ways_to_write_a_mesh() {
        let plain = ascii("property list uchar int vertex_index\n", &["3 0 1 2", "3 0 2 3"]);
        let expected = read_mesh(plain.as_bytes()).unwrap();
        let wrapped = plain.replace("3 0 2 3", "3\n0 2\n3").replace("1 1 0", "1\n1 0");
        let wide = plain.replace("uchar int vertex", "int64 uint64 vertex");
        let thin = plain.replace("element face 2", "element face 3") + "2 0 1\n";
        for text in [format!("\u{feff}{plain}"), plain.replace('\n', "\r"), wrapped, wide, thin] {
            assert_eq!(read_mesh(text.as_bytes()).unwrap(), expected, "{text}");
        }
        let strips = ascii("property list uchar int vertex_index\n", &["7 3 0 2 1 -1 0 1"]);
        let strips = strips.replace("element face", "element tristrips");
        let facets = [[3, 0, 2], [2, 0, 1]];
        assert_eq!(read_mesh(strips.as_bytes()).unwrap().facets, facets);
        let beyond = strips.replace("2 1 -1", "2 4 -1");
        assert!(message(&beyond).starts_with("tristrips 0: refers to vertex 4, but"));
    }

    #[test]
    fn integers_of_64_bits_in_binary() {
        let properties = "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                          element face 1\nproperty list uchar int64 vertex_indices\nproperty int64 part\n";
        let body = |part: i64| -> Vec<u8> {
            let numbers = [0.0, 0.5, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.25f64];
            let vertices = numbers.iter().flat_map(|x| x.to_le_bytes());
            let face = [2_i64, 1, 0, part].into_iter().flat_map(i64::to_le_bytes);
            vertices.chain([3]).chain(face).collect()
        };
        let mesh = read_mesh(&binary("little", properties, &body(-7))).unwrap();
        assert_eq!((mesh.facets[0], mesh.labels[0].names[0].as_str()), ([2, 1, 0], "-7"));
        // A double does not hold it, and parts would become one.
        let refused = read_mesh(&binary("little", properties, &body(i64::MAX))).unwrap_err();
        assert!(refused.to_string().starts_with("face 0: the label "), "{refused}");
    }

    #[test]
    fn crlf_line_ends() {
        let text = ascii("property list uchar int vertex_index\n", &["3 0 1 2", "3 0 2 3"]);
        let crlf = text.replace('\n', "\r\n");
        assert_eq!(read_mesh(crlf.as_bytes()), read_mesh(text.as_bytes()));
        assert_eq!(read_mesh(crlf.as_bytes()).unwrap().facets.len(), 2);
    }

    #[test]
    fn integer_face_properties_become_labels_of_every_triangle() {
        let properties = "property int part\nproperty float quality\n\
                          property list uchar uint vertex_indices\nproperty uint8 red\n\
                          property list uint8 float32 texcoord\n";
        let text = ascii(properties, &["-7 0.5 4 0 1 2 3 255 2 0.1 0.2", "9 1 3 0 1 2 255 0"]);
        let mesh = read_mesh(text.as_bytes()).unwrap();
        assert_eq!(
            mesh.labels,
            [
                FacetLabels::from_names("part", ["-7", "-7", "9"]),
                FacetLabels::from_names("red", ["255"; 3]),
            ]
        );
    }

    #[test]
    fn further_properties_and_elements_are_passed_over() {
        let properties = "element camera 2\nproperty list uchar float view\nproperty int8 id\n\
                          element vertex 3\nproperty uint8 flag\nproperty int16 x\n\
                          property list uchar uchar extra\nproperty float64 y\n\
                          property int32 z\nelement face 1\n\
                          property list ushort uint8 vertex_indices\n";
        let mut body = vec![1, 0, 0, 0, 0, 5, 0, 6];
        for x in 0..3i16 {
            body.push(9);
            body.extend(x.to_le_bytes());
            body.extend([2, 8, 8]);
            body.extend((f64::from(x) * 0.25).to_le_bytes());
            body.extend((-i32::from(x)).to_le_bytes());
        }
        body.extend([3, 0, 0, 1, 2]);
        body.extend(b"bytes after the end");
        let mesh = read_mesh(&binary("little", properties, &body)).unwrap();
        assert_eq!(mesh.vertices[2], DVec3::new(2.0, 0.5, -2.0));
        assert_eq!(mesh.facets, [[0, 1, 2]]);
    }

    #[test]
    fn comments_need_not_be_utf8() {
        let text = ascii("property list uchar int vertex_index\n", &["3 0 1 2"]);
        let mut bytes = text.into_bytes();
        let at = bytes.windows(4).position(|w| w == b"made").unwrap();
        bytes[at] = 0xe9;
        assert_eq!(read_mesh(&bytes).unwrap().facets.len(), 1);
    }

    #[test]
    fn bad_indices_name_the_face() {
        let properties = "property list uchar int vertex_indices\n";
        assert_eq!(
            message(&ascii(properties, &["3 0 1 2", "3 0 1 -2"])),
            "face 1: refers to vertex -2, but the file has 4 vertices; \
             repair or export the mesh again"
        );
        let bad = ["3 0 1 4", "3 4000000000 1 2", "3 0 1.5 2", "2 0 4"];
        for face in bad {
            let text = ascii("property list uchar double vertex_indices\n", &["3 0 1 2", face]);
            assert!(message(&text).starts_with("face 1: "), "{face}: {}", message(&text));
        }
    }

    #[test]
    fn ascii_errors_name_the_line() {
        let properties = "property list uchar int vertex_indices\n";
        let too_long = ascii(properties, &["3 0 1 2", "3 0 1 2 3"]);
        let too_short = ascii(properties, &["3 0 1 2", "3 0 1"]);
        let no_number = ascii(properties, &["3 0 1 2", "3 0 1 two"]);
        for text in [too_long, no_number] {
            assert_eq!(
                message(&text),
                "line 17: face 1 does not follow the header; copy or export the file again"
            );
        }
        for text in [ascii(properties, &["3 0 1 2", "3"]), too_short] {
            assert_eq!(
                message(&text),
                "line 17: the file ends inside face 1; copy or export the file again"
            );
        }
        // A row that lacks a number takes the first of the next, which then is too long.
        let short = ascii(properties, &["3 0 1", "3 0 1 2"]);
        assert!(message(&short).starts_with("line 16: face 0 does not follow"));
    }

    #[test]
    fn binary_errors_name_the_byte() {
        let properties = "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
                          element face 1\nproperty list uchar int vertex_indices\n";
        let bytes = binary("little", properties, &[3, 0, 0]);
        let problem = read_mesh(&bytes).unwrap_err().to_string();
        assert!(problem.starts_with(&format!("byte {}: face 0", bytes.len() - 2)), "{problem}");
    }

    #[test]
    fn header_errors_name_the_line_or_the_name() {
        let good = ascii("property list uchar int vertex_indices\n", &["3 0 1 2"]);
        let cases = [
            (
                "property float y",
                "property flat y",
                "line 7: cannot understand \"property flat y\"",
            ),
            ("property float y", "property float x", "header: an element or one of its"),
            ("element face", "element vertex", "header: an element or one of its"),
            ("property float y", "property float v", "header: element vertex has no number"),
            ("vertex_indices", "corners", "header: element face has no list"),
            ("end_header", "end", "byte 214: the header has no end_header line"),
            ("format ascii 1.0\n", "", "header: No format line found;"),
            ("ply\n", "", "byte 0: this is not a PLY file"),
            ("vertex 4", "vertex 1000000000000", "header: 1000000000000 entries of element vertex"),
            ("vertex 4", "vertex 99999999999999999999999", "line 5: cannot understand"),
            ("obj_info", "element ghost 4000000000\nobj_info", "header: element ghost has 4000"),
        ];
        for (what, instead, expected) in cases {
            let problem = message(&good.replacen(what, instead, 1));
            assert!(problem.starts_with(expected), "{instead}: {problem}");
        }
    }

    #[test]
    fn many_labels_on_large_polygons_are_refused() {
        let labels: String = (0..50).map(|i| format!("property uchar l{i}\n")).collect();
        let face = format!("{}1000{}", "1 ".repeat(50), " 0".repeat(1000));
        let text = ascii(&format!("{labels}property list int int vertex_indices\n"), &[&face]);
        assert!(message(&text).starts_with("face 0: 50 labels on polygons"));
    }

    #[test]
    fn a_cloud_is_a_mesh_without_facets() {
        let text = ascii("property list uchar int vertex_indices\n", &[]);
        let mesh = read_mesh(text.as_bytes()).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.facets.len()), (4, 0));
    }
}
