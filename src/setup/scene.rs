//! A scene with its materials, ready for the renderer.

use std::path::{Path, PathBuf};

use super::materials::{MaterialRevision, find_material, status_warning};
use crate::brdf::Brdf;
use crate::effects::{EffectList, Level, Model, Receiver, SceneEffects, resolve};
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::frames::{Global, Point, Pose};
use crate::geometry::Raster;
use crate::material::Material;
use crate::radar::{Channel, Radar};
use crate::render::{Bounce, RenderError, Scan, Setup, Surface, power_image};
use crate::scene::Scene;
use crate::store::Store;
use crate::trace::{Bvh, ScanGeometry};
use crate::units::{range, ratio_from_db, rounded, shown};

/// A material as a scene uses it.
#[derive(Clone)]
pub struct SceneMaterial {
    /// Its name as the regions of the scene give it: `NAME` or `NAME@REVISION`.
    pub name: String,
    /// The material and its revision.
    pub found: MaterialRevision,
    /// The law that is rendered.
    pub scattering: Brdf,
    /// The effects that the material declares.
    pub effects: EffectList,
}

/// A scene file with everything that it names: meshes, scan, materials, laws and effects.
#[derive(Clone)]
pub struct ReadyScene {
    /// Radar, scan and target.
    pub scene: Scene,
    /// The scene file.
    pub path: PathBuf,
    /// The scene's materials, each once, in the order in which regions first name them.
    pub materials: Vec<SceneMaterial>,
    /// For every region, the place of its material in `materials`.
    pub material_of_region: Vec<u16>,
    /// Effects of the scene, of its radar and of its materials.
    pub effects: SceneEffects,
}

/// What [`Setup`] borrows besides the scene: the hierarchy over the mesh, a surface per region and the
/// effects with their laws.
pub struct Assembly<'a> {
    ready: &'a ReadyScene,
    bvh: Bvh<'a>,
    surfaces: Vec<Surface<'a>>,
    model: Option<Model<'a>>,
}

impl ReadyScene {
    /// Loads a scene file and the materials that it names, from `store` or from those that are built in.
    ///
    /// # Errors
    /// A scene, material or effect that cannot be loaded, by its file and place.
    pub fn open(path: &Path, store: Option<&Store>) -> Result<ReadyScene, Error> {
        ReadyScene::new(Scene::load(path)?, path, store)
    }

    /// As [`open`](Self::open), of a scene that was loaded from `path` and may have been changed since.
    ///
    /// # Errors
    /// A material or effect that cannot be loaded, by the file and place that name it.
    pub fn new(scene: Scene, path: &Path, store: Option<&Store>) -> Result<ReadyScene, Error> {
        let (materials, material_of_region) = find_materials(&scene, path, store)?;
        let effects = find_effects(&scene, path, &materials, &material_of_region)?;
        Ok(ReadyScene { scene, path: path.to_owned(), materials, material_of_region, effects })
    }

    /// As [`open`](Self::open), of a scene that renders the mean power of its radar, without receiver, speckle and
    /// noise: a draw of speckle would add an error to that of a measurement, or hide it. `pose` moves the target.
    ///
    /// # Errors
    /// A scene, material or effect that cannot be loaded, by its file and place.
    pub fn open_mean(
        path: &Path,
        pose: Pose<Global, Global>,
        store: Option<&Store>,
    ) -> Result<ReadyScene, Error> {
        let mut scene = Scene::load(path)?;
        let radar = &mut scene.file.radar;
        (radar.receiver, radar.speckle, radar.noise) = (None, None, None);
        for vertex in &mut scene.target.mesh.vertices {
            *vertex = (pose * Point::from(*vertex)).xyz;
        }
        ReadyScene::new(scene, path, store)
    }

    /// The law of every region.
    pub fn laws(&self) -> Vec<Brdf> {
        self.of_regions().map(|material| material.scattering.clone()).collect()
    }

    /// The effects on the laws of the scene; `None` when it declares none.
    pub fn model(&self) -> Option<Model<'_>> {
        let receiver = Receiver::declared(self.scene.radar());
        (!self.effects.is_empty()).then(|| self.effects.model(self.laws(), receiver))
    }

    /// Prepares what the renderer borrows; it builds the hierarchy over the mesh.
    pub fn assemble(&self) -> Assembly<'_> {
        let surfaces = std::iter::zip(&self.scene.target.regions, self.of_regions())
            .map(|(region, material)| Surface {
                scattering: &material.scattering,
                depolarised_share: region.depolarised_share,
                grain: region.grain,
            })
            .collect();
        Assembly {
            ready: self,
            bvh: Bvh::new(&self.scene.target.mesh),
            surfaces,
            model: self.model(),
        }
    }

    /// The image of a scan of this scene, with the scene's pixels.
    pub fn image(&self, scan: &Scan) -> Raster {
        let radar = self.scene.radar();
        let field = self.scene.chirps.field(&radar.frames());
        let (spot_m, pixel_m) = (radar.spot_fwhm_m(), self.scene.pixel_m());
        power_image(scan, field, spot_m, &self.material_of_region, pixel_m)
    }

    /// Renders the fit of this name in every material that has one.
    ///
    /// # Errors
    /// No material of the scene has it.
    pub fn choose_fit(&mut self, name: &str) -> Result<(), Error> {
        let mut is_chosen = false;
        let mut known = Vec::new();
        for material in &mut self.materials {
            for fit in &material.found.material.fits {
                known.push(fit.name.as_str());
                if fit.name == name {
                    material.scattering = fit.model.clone();
                    is_chosen = true;
                }
            }
        }
        if is_chosen {
            return Ok(());
        }
        Err(Error::usage(
            format!("no material of the scene has a fit `{name}`"),
            format!("there are: {}", known.join(", ")),
        ))
    }

    /// Sentences on materials that are withdrawn or superseded, or make no claim at the radar's frequency.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for SceneMaterial { found, .. } in &self.materials {
            notices.extend(status_warning(&found.material));
        }
        for SceneMaterial { found, .. } in &self.materials {
            notices.extend(extrapolation_warning(&found.material, self.scene.radar()));
        }
        notices
    }

    /// An error of the renderer with the scene's file; `antenna` names the receiver that it is about, with a
    /// colon, or nothing.
    pub fn render_error(&self, antenna: &str, error: RenderError) -> Error {
        Error::Render {
            scene: self.path.clone(),
            antenna: antenna.to_owned(),
            error: Box::new(error),
        }
    }

    /// The material of every region.
    fn of_regions(&self) -> impl Iterator<Item = &SceneMaterial> {
        self.material_of_region.iter().map(|&material| &self.materials[usize::from(material)])
    }
}

impl<'a> Assembly<'a> {
    /// What the renderer takes.
    pub fn setup(&self) -> Setup<'_> {
        let scene = &self.ready.scene;
        Setup {
            geometry: ScanGeometry::new(
                scene.radar(),
                &scene.chirps,
                &self.bvh,
                &scene.target.region_of_facet,
            ),
            surfaces: &self.surfaces,
            bounce: scene.file.bounce.map(|bounce| Bounce {
                rays: bounce.rays,
                outside_spot: ratio_from_db(bounce.outside_spot_db),
            }),
            effects: self.model.as_ref(),
            channel: Channel::CoPolar,
            seed: scene.file.seed,
        }
    }

    /// The scene that this was assembled from.
    pub fn ready(&self) -> &'a ReadyScene {
        self.ready
    }

    /// The hierarchy over the scene's mesh.
    pub fn bvh(&self) -> &Bvh<'a> {
        &self.bvh
    }

    /// The effects with their laws; `None` when the scene declares none.
    pub fn model(&self) -> Option<&Model<'a>> {
        self.model.as_ref()
    }
}

/// The effects that entries of a file declare; `place` is the file and the table.
///
/// # Errors
/// An entry that is not an effect of this level, by its place.
pub fn resolve_effects(
    entries: &[EffectEntry],
    level: Level,
    place: String,
) -> Result<EffectList, Error> {
    resolve(entries, level).map_err(|error| Error::Effect { place, error })
}

/// The scene's materials, each once, and for every region the number of its material.
fn find_materials(
    scene: &Scene,
    path: &Path,
    store: Option<&Store>,
) -> Result<(Vec<SceneMaterial>, Vec<u16>), Error> {
    let mut materials: Vec<SceneMaterial> = Vec::new();
    let mut of_region = Vec::new();
    for region in &scene.target.regions {
        let known = materials.iter().position(|material| material.name == region.material);
        if known.is_none() {
            let asked_by = format!("{}: region `{}`: ", path.display(), region.name);
            let found = find_material(store, &region.material, &asked_by)?;
            let scattering = found.material.scattering()?;
            let place = format!("{asked_by}material `{}`", found.material.slug);
            let effects = resolve_effects(&found.material.effects, Level::Material, place)?;
            materials.push(SceneMaterial {
                name: region.material.clone(),
                found,
                scattering,
                effects,
            });
        }
        of_region.push(known.unwrap_or(materials.len() - 1) as u16);
    }
    Ok((materials, of_region))
}

/// The effects of a scene, of its radar and of its materials.
fn find_effects(
    scene: &Scene,
    path: &Path,
    materials: &[SceneMaterial],
    material_of_region: &[u16],
) -> Result<SceneEffects, Error> {
    let mut effects = SceneEffects::default();
    let of_scene = format!("{}: [[effect]]", path.display());
    effects.add(resolve_effects(&scene.file.effect, Level::Scene, of_scene)?);
    let of_radar = format!("{}: [[radar.effect]]", path.display());
    effects.add(resolve_effects(&scene.radar().effect, Level::Instrument, of_radar)?);
    for (number, material) in (0u16..).zip(materials) {
        let on: Vec<bool> = material_of_region.iter().map(|&of| of == number).collect();
        effects.add_to_regions(material.effects.clone(), &on);
    }
    Ok(effects)
}

/// That a material makes no claim at the radar's frequency.
fn extrapolation_warning(material: &Material, radar: &Radar) -> Option<String> {
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
