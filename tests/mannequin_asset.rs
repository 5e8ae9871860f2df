//! Promise: the embedded mannequin is what its generator makes, bit for bit.

#[path = "../examples/mannequin/body.rs"]
mod body;

use matdb::geometry::Mesh;
use matdb::scene::mannequin;

#[test]
fn the_generator_makes_the_embedded_mesh() {
    let (made, embedded) = (body::mannequin(), mannequin::mannequin());
    let bits = |mesh: &Mesh| -> Vec<[u64; 3]> {
        mesh.vertices.iter().map(|vertex| vertex.to_array().map(f64::to_bits)).collect()
    };
    assert!(bits(&embedded) == bits(&made));
    assert!(embedded.facets == made.facets && embedded.labels == made.labels);
}
