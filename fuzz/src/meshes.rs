//! Meshes, tables and images.

use matdb::formats::ply::{read_table, write_table};
use matdb::formats::{MeshFormat, exr as image};
use matdb::frames::{Global, Point, Ray};
use matdb::trace::Bvh;

/// A scene refuses what lies farther out, m.
const FARTHEST_M: f64 = 1e5;

pub fn ply(bytes: &[u8]) {
    mesh(MeshFormat::Ply, bytes);
}

pub fn obj(bytes: &[u8]) {
    mesh(MeshFormat::Obj, bytes);
}

pub fn stl(bytes: &[u8]) {
    mesh(MeshFormat::Stl, bytes);
}

/// What is read is a mesh, its labels name every facet, and rays can be traced to it.
fn mesh(format: MeshFormat, bytes: &[u8]) {
    let Ok(mesh) = format.read(bytes) else { return };
    mesh.validate().expect("what was read is a mesh");
    for labels in &mesh.labels {
        assert_eq!(labels.name_of_facet.len(), mesh.facets.len());
        assert!(labels.name_of_facet.iter().all(|&name| (name as usize) < labels.names.len()));
    }
    let is_near = mesh.vertices.iter().all(|vertex| vertex.abs().max_element() < FARTHEST_M);
    let Some(facet) = (0..mesh.facets.len()).find(|&facet| !mesh.is_degenerate(facet)) else {
        return;
    };
    if !is_near {
        return;
    }
    let centroid = mesh.centroid(facet);
    let normal = mesh.area_normal(facet).normalize_or_zero();
    let origin: Point<Global> = Point::from(centroid + normal);
    let Some(direction) = origin.towards(Point::from(centroid)) else { return };
    if let Some(hit) = Bvh::new(&mesh).closest(&Ray { origin, direction }) {
        assert!((hit.facet as usize) < mesh.facets.len());
        assert!(hit.range_m.is_finite() && hit.point.xyz.is_finite());
        assert!((0.0..=1.0 + 1e-9).contains(&hit.cos_theta));
    }
}

/// What is read can be written, and the copy says the same.
pub fn ply_table(bytes: &[u8]) {
    let Ok(table) = read_table(bytes) else { return };
    let copy = write_table(&table).and_then(|bytes| read_table(&bytes)).expect("a table to copy");
    assert_eq!(copy.rows(), table.rows());
    assert_eq!(copy.columns.len(), table.columns.len());
}

/// A value for every pixel, and a copy with the same ones.
pub fn exr(bytes: &[u8]) {
    let Ok(raster) = image::read(bytes) else { return };
    for channel in &raster.channels {
        assert_eq!(channel.values.len(), raster.width * raster.height);
    }
    // Not every name that may be read may be written.
    let Ok(written) = image::write(&raster, &[]) else { return };
    let copy = image::read(&written).expect("an image that was written can be read");
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    for channel in &raster.channels {
        assert_eq!(copy.channel(&channel.name).map(bits), Some(bits(&channel.values)));
    }
}
