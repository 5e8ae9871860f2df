//! A material to begin with: a commented entry and the curve that it names.

use crate::material::Slug;

/// A complete `material.toml`; docs/materials.md shows the same.
pub const MATERIAL_TEMPLATE: &str = include_str!("material-template.toml");

/// Example of the curve that the template names.
const CURVE: &str = "# Replace these rows by yours. Where nothing was detected: censor = left, and the limit in threshold_db.
theta_deg,sigma0_db,censor,threshold_db
0,-2.0,none,
10,-17.5,none,
30,-19.0,none,
60,,left,-30.0
";

/// Names and bytes of `material.toml` and `scan.csv` of a material of this name.
pub fn new_material(name: &Slug) -> [(String, Vec<u8>); 2] {
    let text = MATERIAL_TEMPLATE.replacen("my-paint", name.as_str(), 1);
    [
        ("material.toml".to_owned(), text.into_bytes()),
        ("scan.csv".to_owned(), CURVE.as_bytes().to_vec()),
    ]
}
