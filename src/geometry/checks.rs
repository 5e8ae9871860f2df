//! What tests ask of a whole mesh.

use std::collections::{HashMap, HashSet};

use super::Mesh;

/// How often each directed edge occurs.
fn directed_edges(mesh: &Mesh) -> HashMap<(u32, u32), u32> {
    let mut count = HashMap::new();
    for &[a, b, c] in &mesh.facets {
        for edge in [(a, b), (b, c), (c, a)] {
            *count.entry(edge).or_insert(0) += 1;
        }
    }
    count
}

/// Whether every edge joins exactly two facets that agree on which side is out.
pub fn is_closed(mesh: &Mesh) -> bool {
    let edges = directed_edges(mesh);
    edges.iter().all(|(&(a, b), &n)| a != b && n == 1 && edges.contains_key(&(b, a)))
}

/// Vertices − edges + facets, counting only vertices in use: 2 − 2·genus for each closed part.
pub fn euler_characteristic(mesh: &Mesh) -> i64 {
    let vertices: HashSet<u32> = mesh.facets.iter().flatten().copied().collect();
    let edges = directed_edges(mesh).len() as i64 / 2;
    vertices.len() as i64 - edges + mesh.facets.len() as i64
}

/// Number of pieces that share no vertex.
pub fn component_count(mesh: &Mesh) -> usize {
    let mut parent: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let root = |parent: &[u32], mut v: u32| {
        while parent[v as usize] != v {
            v = parent[v as usize];
        }
        v
    };
    for &[a, b, c] in &mesh.facets {
        for other in [b, c] {
            let (low, high) = (root(&parent, a), root(&parent, other));
            parent[low.max(high) as usize] = low.min(high);
        }
    }
    mesh.facets.iter().map(|f| root(&parent, f[0])).collect::<HashSet<_>>().len()
}

/// Total area, m².
pub fn area_m2(mesh: &Mesh) -> f64 {
    (0..mesh.facets.len()).map(|f| 0.5 * mesh.area_normal(f).length()).sum()
}

/// Enclosed volume, m³; positive when the normals of a closed mesh point out.
pub fn volume_m3(mesh: &Mesh) -> f64 {
    (0..mesh.facets.len()).map(|f| mesh.area_normal(f).dot(mesh.corners(f)[0]) / 6.0).sum()
}
