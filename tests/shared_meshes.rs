//! Meshes that others made are read whole: every `.ply` of the shared collection has as many
//! triangles as the table beside it says. Without the collection the test is skipped.

use std::fs;
use std::path::{Path, PathBuf};

use matdb::formats::MeshFormat;

/// The collection, where somebody has put it beside this crate.
fn collection() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/meshes");
    folder.is_dir().then_some(folder)
}

/// File names and triangle counts from the rows `| name.ply … | 1,234 | …`.
fn promised_triangles(table: &str) -> Vec<(String, usize)> {
    let row = |line: &str| {
        let mut cells = line.split('|').skip(1);
        let name = cells.next()?.split_whitespace().next()?.to_owned();
        let triangles = cells.next()?.trim().replace(',', "").parse().ok()?;
        name.ends_with(".ply").then_some((name, triangles))
    };
    table.lines().filter_map(row).collect()
}

#[test]
fn triangle_counts_are_as_promised() {
    let Some(folder) = collection() else {
        println!("skipped: there is no folder shared/data/meshes");
        return;
    };
    let table = fs::read_to_string(folder.join("PROVENANCE.md")).unwrap();
    let promised = promised_triangles(&table);
    assert!(!promised.is_empty());
    for (name, triangles) in promised {
        let mesh = MeshFormat::Ply.read(&fs::read(folder.join(&name)).unwrap()).unwrap();
        assert_eq!(mesh.facets.len(), triangles, "{name}");
    }
}
