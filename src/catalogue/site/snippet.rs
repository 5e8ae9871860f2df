//! How to go on with a material: the same steps on the command line and in Python.

use serde::Serialize;

use super::levels::range_deg;
use crate::formats::words::digits;
use crate::store::StoredRevision;

/// Angles of the example, °.
const ANGLES_DEG: [f64; 5] = [0.0, 5.0, 10.0, 20.0, 40.0];

/// Two texts that do the same.
#[derive(Debug, Serialize)]
pub(super) struct Snippet {
    /// For a shell.
    shell: String,
    /// For Python.
    python: String,
}

/// How to use the newest revision of a material from the catalogue's database; none of one that renders nothing.
pub(super) fn of(stored: &StoredRevision) -> Option<Snippet> {
    let material = &stored.material;
    material.scattering().ok()?;
    // A slug has small letters, digits and hyphens alone, so that neither a shell nor Python reads anything into it.
    let name = format!("{}@{}", material.slug, stored.revision);
    let [least, most] = range_deg(material);
    let claimed = ANGLES_DEG.into_iter().filter(|deg| *deg >= least && *deg <= most);
    let mut angles: Vec<String> = claimed.map(digits).collect();
    if angles.is_empty() {
        angles.push(digits(least));
    }
    let angles = [angles.join(","), angles.join(", ")];
    Some(Snippet {
        shell: format!(
            "matdb --db catalogue.sqlite show {name}\n\
             matdb --db catalogue.sqlite predict {name} --angles {}",
            angles[0]
        ),
        python: format!(
            "import matdb as md\n\n\
             material = md.open(\"catalogue.sqlite\")[\"{name}\"]\n\
             print(material)\n\
             print(material.sigma0_db([{}]))    # dB",
            angles[1]
        ),
    })
}
