//! What is fuzzed: a function for each kind of file that `matdb` reads from others. It gets any bytes and must not
//! panic. What is accepted must keep a promise: numbers are finite, a copy says the same, a material can be rendered.

mod clouds;
mod curves;
mod databases;
mod materials;
mod meshes;
mod scenes;

/// Something to fuzz: it gets any bytes and panics where a promise is broken.
pub type Target = fn(&[u8]);

/// Every target by its name, which is also that of its folder in `corpus/`.
pub const TARGETS: [(&str, Target); 22] = [
    ("ply", meshes::ply),
    ("obj", meshes::obj),
    ("stl", meshes::stl),
    ("ply_table", meshes::ply_table),
    ("exr", meshes::exr),
    ("scene", scenes::scene),
    ("rays", scenes::rays),
    ("pose", scenes::pose),
    ("cloud", clouds::cloud),
    ("measured", clouds::measured),
    ("curve", curves::curve),
    ("backscatter", curves::backscatter),
    ("in_plane", curves::in_plane),
    ("bsdf", curves::bsdf),
    ("material", materials::material),
    ("law", materials::law),
    ("universal_brdf", materials::universal_brdf),
    ("optical_constants", materials::optical_constants),
    ("about", databases::about),
    ("database", databases::database),
    ("publication", databases::publication),
    ("words", databases::words),
];

/// The target of this name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.iter().find(|(known, _)| *known == name).map(|(_, run)| *run)
}

/// The first byte, which chooses among variants, and the rest.
fn choice(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (first, rest) = bytes.split_first()?;
    Some((usize::from(*first), rest))
}
