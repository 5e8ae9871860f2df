//! A scene with its materials, ready for the renderer: what `render` and `compare` share.

use std::path::Path;

use super::database::Database;
use super::materials::{Found, find};
use crate::error::Error;
use crate::render::{Bounce, Setup, Surface};
use crate::scene::Scene;
use crate::trace::Bvh;
use crate::units::ratio_from_db;

/// A material as one scene uses it.
pub(super) struct Used {
    pub found: Found,
    pub scattering: crate::brdf::Brdf,
}

/// The surface of each region of a scene.
pub(super) fn surfaces<'a>(
    scene: &Scene,
    used: &'a [Used],
    material_of_region: &[u16],
) -> Vec<Surface<'a>> {
    std::iter::zip(&scene.target.regions, material_of_region)
        .map(|(region, &material)| Surface {
            scattering: &used[usize::from(material)].scattering,
            grain: region.grain,
        })
        .collect()
}

/// A scene as the renderer takes it.
pub(super) fn setup<'a>(scene: &'a Scene, bvh: &'a Bvh, surfaces: &'a [Surface]) -> Setup<'a> {
    Setup {
        radar: scene.radar(),
        chirps: &scene.chirps,
        bvh,
        region_of_facet: &scene.target.region_of_facet,
        surfaces,
        bounce: scene.file.bounce.map(|bounce| Bounce {
            rays: bounce.rays,
            outside_spot: ratio_from_db(bounce.outside_spot_db),
        }),
        seed: scene.file.seed,
    }
}

/// The scene's materials, each once, and for every region the number of its material.
pub(super) fn materials(
    scene: &Scene,
    path: &Path,
    db: &Database,
) -> Result<(Vec<Used>, Vec<u16>), Error> {
    let store = db.read()?;
    let mut names: Vec<&str> = Vec::new();
    let mut used = Vec::new();
    let mut of_region = Vec::new();
    for region in &scene.target.regions {
        let known = names.iter().position(|name| *name == region.material);
        if known.is_none() {
            let asked_by = format!("{}: region `{}`: ", path.display(), region.name);
            let found = find(store.as_ref(), &region.material, &asked_by)?;
            let scattering = found.material.scattering()?;
            used.push(Used { found, scattering });
            names.push(&region.material);
        }
        of_region.push(known.unwrap_or(names.len() - 1) as u16);
    }
    Ok((used, of_region))
}
