//! Writes the built-in mannequin as the binary PLY that the library embeds.
//!
//! `cargo run --release --example mannequin -- assets/mannequin.ply`
//!
//! Vertices are 64-bit numbers. `part` of a face is the number of its part: an index into the names
//! of the label, which `src/scene/mannequin.rs` repeats.

mod body;

use std::io::Write;

use matdb::geometry::Mesh;

fn main() -> std::io::Result<()> {
    let Some(path) = std::env::args().nth(1) else {
        return Err(std::io::Error::other("give the path of the PLY file to write"));
    };
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    write_ply(&mut file, &body::mannequin())?;
    file.flush()
}

fn write_ply(file: &mut impl Write, mesh: &Mesh) -> std::io::Result<()> {
    let parts = &mesh.labels[0];
    writeln!(file, "ply\nformat binary_little_endian 1.0")?;
    for (number, name) in parts.names.iter().enumerate() {
        writeln!(file, "comment part {number} {name}")?;
    }
    writeln!(file, "element vertex {}", mesh.vertices.len())?;
    writeln!(file, "property double x\nproperty double y\nproperty double z")?;
    writeln!(file, "element face {}", mesh.facets.len())?;
    writeln!(file, "property list uchar uint vertex_indices\nproperty uchar part\nend_header")?;
    for vertex in &mesh.vertices {
        vertex.to_array().into_iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))?;
    }
    for (facet, &part) in mesh.facets.iter().zip(&parts.name_of_facet) {
        file.write_all(&[3])?;
        facet.iter().try_for_each(|vertex| file.write_all(&vertex.to_le_bytes()))?;
        file.write_all(&[part as u8])?;
    }
    Ok(())
}
