//! A scene with its materials, ready for the renderer: what `render` and `compare` share.

use std::path::Path;

use super::database::Database;
use super::materials::{Found, find, not_to_be_used};
use crate::brdf::Brdf;
use crate::effects::{Chosen, Level, Model, Receiver, SceneEffects, resolve};
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::material::Material;
use crate::radar::Radar;
use crate::render::{Bounce, Setup, Surface};
use crate::scene::Scene;
use crate::trace::{Bvh, ScanGeometry};
use crate::units::{range, ratio_from_db, rounded, shown};

/// A material as one scene uses it.
pub(super) struct Used {
    pub found: Found,
    pub scattering: Brdf,
    /// Its own effects.
    pub effects: Chosen,
}

/// Sentences on materials that are not to be used, or make no claim at the radar's frequency.
pub(super) fn notices(used: &[Used], radar: &Radar) -> Vec<String> {
    let materials = || used.iter().map(|used| &used.found.material);
    let extrapolated = materials().filter_map(|material| extrapolated(material, radar));
    materials().filter_map(not_to_be_used).chain(extrapolated).collect()
}

/// That a material makes no claim at the radar's frequency.
fn extrapolated(material: &Material, radar: &Radar) -> Option<String> {
    let frequency_ghz = radar.centre_frequency_ghz;
    let outside_ghz = material.frequency_outside_hz(frequency_ghz * 1e9) / 1e9;
    (outside_ghz > 0.0).then(|| {
        format!(
            "`{}` is described for {} GHz, the radar works at {frequency_ghz} GHz, {} GHz away: what it \
             returns is extrapolated",
            material.slug,
            range(material.frequency_hz.map(|hz| hz / 1e9)),
            shown(rounded(outside_ghz))
        )
    })
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

/// The effects of a scene, of its radar and of its materials.
pub(super) fn effects(
    scene: &Scene,
    path: &Path,
    used: &[Used],
    material_of_region: &[u16],
) -> Result<SceneEffects, Error> {
    let mut effects = SceneEffects::default();
    let at = |table: &str| format!("{}: [[{table}]]", path.display());
    effects.add(chosen(&scene.file.effect, Level::Scene, at("effect"))?);
    effects.add(chosen(&scene.radar().effect, Level::Instrument, at("radar.effect"))?);
    for (number, Used { effects: own, .. }) in (0u16..).zip(used) {
        let on: Vec<bool> = material_of_region.iter().map(|&of| of == number).collect();
        effects.add_to_regions(own.clone(), &on);
    }
    Ok(effects)
}

/// What the entries at a place mean.
pub(super) fn chosen(
    entries: &[EffectEntry],
    level: Level,
    place: String,
) -> Result<Chosen, Error> {
    resolve(entries, level).map_err(|error| Error::Effect { place, error })
}

/// The effects on the laws of a scene; `None` when there are none.
pub(super) fn model<'a>(
    effects: &'a SceneEffects,
    scene: &Scene,
    used: &[Used],
    material_of_region: &[u16],
) -> Option<Model<'a>> {
    let law = |&material: &u16| used[usize::from(material)].scattering.clone();
    let laws = material_of_region.iter().map(law).collect();
    (!effects.is_empty()).then(|| effects.model(laws, Receiver::declared(scene.radar())))
}

/// A scene as the renderer takes it.
pub(super) fn setup<'a>(
    scene: &'a Scene,
    bvh: &'a Bvh,
    surfaces: &'a [Surface],
    effects: Option<&'a Model>,
) -> Setup<'a> {
    Setup {
        geometry: ScanGeometry::new(
            scene.radar(),
            &scene.chirps,
            bvh,
            &scene.target.region_of_facet,
        ),
        surfaces,
        bounce: scene.file.bounce.map(|bounce| Bounce {
            rays: bounce.rays,
            outside_spot: ratio_from_db(bounce.outside_spot_db),
        }),
        effects,
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
            let place = format!("{asked_by}material `{}`", found.material.slug);
            let effects = chosen(&found.material.effects, Level::Material, place)?;
            used.push(Used { found, scattering, effects });
            names.push(&region.material);
        }
        of_region.push(known.unwrap_or(names.len() - 1) as u16);
    }
    Ok((used, of_region))
}
