//! A scene with its materials, ready for the renderer.

use std::path::{Path, PathBuf};

use super::materials::{MaterialRevision, find_material, status_warning};
use crate::brdf::{BeyondBeam, Brdf, Excess, ScatteringModel};
use crate::effects::{EffectList, Level, Model, Receiver, SceneEffects, resolve};
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::formats::words::{listed, significant};
use crate::frames::{Global, Point, Pose};
use crate::geometry::Raster;
use crate::material::{Curve, Lobes, Material};
use crate::radar::{Beam, Channel, Radar, SpeckleForm};
use crate::render::{Bounce, RenderError, Scan, Setup, Sheet, SheetGain, Surface, power_image};
use crate::scene::{KeyChange, Region, Scene, SceneError, SceneFile, read_text};
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
    /// Name of the fit or the curve that is rendered.
    pub rendered: String,
    /// The law that is rendered.
    pub scattering: Brdf,
    /// Whose lobes the law has.
    pub lobes: Lobes,
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
    /// For every region the sheet that it is; `None` where nothing passes.
    pub sheets: Vec<Option<Sheet>>,
    /// Names of the effects of a program's own.
    own_effects: Vec<&'static str>,
}

/// What [`Setup`] borrows besides the scene: the hierarchy over the mesh, a surface per region and the
/// effects with their laws.
pub struct Assembly<'a> {
    ready: &'a ReadyScene,
    bvh: Bvh<'a>,
    surfaces: Vec<Surface<'a>>,
    model: Option<Model<'a>>,
}

/// What a law of speckle gets wrong for several antennas.
const INDEPENDENT_ANTENNAS: &str = "radar.speckle.form = \"law\" gives every antenna a field of its own, and antennas near each other see in \
                                    truth the same one: form = \"scatterers\" has that";

impl SceneMaterial {
    /// Width of its narrowest lobe, rad, where its lobes include the beam that saw them; infinite without a lobe.
    fn seen_lobe_rad(&self) -> Option<f64> {
        self.lobes.seen_lobe_rad(&self.scattering)
    }

    /// Whose lobes its law has.
    pub fn rendered_lobes(&self) -> Lobes {
        self.lobes.of(&self.scattering)
    }

    /// The curve that is rendered, or that the rendered law belongs to.
    fn curve(&self) -> Option<&Curve> {
        self.found.material.curve_behind(&self.rendered)
    }
}

impl ReadyScene {
    /// Loads a scene file and the materials that it names, from `store` or from those that are built in.
    ///
    /// # Errors
    /// A scene, material or effect that cannot be loaded, by its file and place.
    pub fn open(path: &Path, store: Option<&Store>) -> Result<ReadyScene, Error> {
        ReadyScene::new(Scene::load(path)?, path, store)
    }

    /// As [`open`](Self::open), with keys of the scene file changed.
    ///
    /// # Errors
    /// As [`open`](Self::open); a change is named if the scene can be loaded without it.
    pub fn open_changed(
        path: &Path,
        changes: &[KeyChange],
        store: Option<&Store>,
    ) -> Result<ReadyScene, Error> {
        let text = read_text(path)?;
        let open = |changes: &[KeyChange]| -> Result<ReadyScene, Error> {
            let at = |error| SceneError::Format { file: path.to_owned(), error };
            let file = SceneFile::parse_changed(&text, changes).map_err(at)?;
            ReadyScene::new(Scene::resolve(file, path)?, path, store)
        };
        open(changes).map_err(|error| {
            if changes.is_empty() || open(&[]).is_err() {
                return error;
            }
            let mut faults = changes.to_vec();
            for place in 0..changes.len() {
                if open(&[&changes[..place], &changes[place + 1..]].concat()).is_ok() {
                    faults = vec![changes[place].clone()];
                }
            }
            let faults: Vec<String> = faults.iter().map(KeyChange::to_string).collect();
            Error::Change { changes: faults.join(", "), error: Box::new(error) }
        })
    }

    /// As [`open`](Self::open), of a scene that was loaded from `path` and may have been changed since.
    ///
    /// # Errors
    /// A material or effect that cannot be loaded, by the file and place that name it.
    pub fn new(scene: Scene, path: &Path, store: Option<&Store>) -> Result<ReadyScene, Error> {
        let (materials, material_of_region) = find_materials(&scene, path, store)?;
        let effects = find_effects(&scene, path, &materials, &material_of_region)?;
        let sheets = Vec::new();
        let path = path.to_owned();
        let own_effects = Vec::new();
        let mut ready =
            ReadyScene { scene, path, materials, material_of_region, effects, sheets, own_effects };
        ready.sheets = ready.find_sheets()?;
        Ok(ready)
    }

    /// The same with effects of a program's own on the whole scan, which no file can declare.
    pub fn with_own_effects(mut self, effects: EffectList) -> ReadyScene {
        self.own_effects.extend(effects.iter().map(|(effect, _)| effect.name()));
        self.effects.add(effects);
        self
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
        ReadyScene::new_mean(Scene::load(path)?, path, pose, store)
    }

    /// As [`open_mean`](Self::open_mean), of a scene that was loaded from `path` and may have been changed since.
    ///
    /// # Errors
    /// A material or effect that cannot be loaded, by the file and place that name it.
    pub fn new_mean(
        mut scene: Scene,
        path: &Path,
        pose: Pose<Global, Global>,
        store: Option<&Store>,
    ) -> Result<ReadyScene, Error> {
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

    /// Width of the narrowest lobe of every region whose lobes include the beam that saw them, rad; none where they are
    /// the surface's own.
    pub fn seen_lobe_rad(&self) -> Vec<Option<f64>> {
        self.of_regions().map(SceneMaterial::seen_lobe_rad).collect()
    }

    /// The effects on the laws of the scene; `None` when it declares none.
    pub fn model(&self) -> Option<Model<'_>> {
        let receiver = Receiver::declared(self.scene.radar());
        (!self.effects.is_empty()).then(|| self.effects.model(self.laws(), receiver))
    }

    /// Prepares what the renderer borrows; it builds the hierarchy over the mesh.
    pub fn assemble(&self) -> Assembly<'_> {
        let regions = self.scene.target.regions.iter().zip(&self.sheets);
        let surfaces = std::iter::zip(regions, self.of_regions())
            .map(|((region, sheet), material)| {
                let opaque = Surface {
                    seen_lobe_rad: material.seen_lobe_rad(),
                    ..Surface::new(&material.scattering)
                };
                let surface = sheet.as_ref().map_or(opaque, Surface::of_sheet);
                let depolarised_share = region.depolarised_share;
                Surface { grain: region.grain, depolarised_share, ..surface }
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
                    material.rendered = fit.name.clone();
                    material.scattering = fit.model.clone();
                    material.lobes = fit.lobes;
                    is_chosen = true;
                }
            }
        }
        if is_chosen {
            self.sheets = self.find_sheets()?;
            return Ok(());
        }
        Err(Error::usage(
            format!("no material of the scene has a fit `{name}`"),
            format!("there are: {}", known.join(", ")),
        ))
    }

    /// Refuses materials whose numbers come from powers with another form of the footprint than the scene's. That it is
    /// not stated of some is a sentence.
    ///
    /// # Errors
    /// A material with another form.
    pub fn check_footprints(&self) -> Result<Option<String>, Error> {
        if let Some(problem) =
            self.materials.iter().find_map(|material| self.other_footprint(material))
        {
            let form = self.scene.radar().footprint.as_str();
            return Err(Error::usage(
                format!("{}: {problem}", self.path.display()),
                format!("change `footprint` under [radar], or measure the curve again with {form}"),
            ));
        }
        let unstated = self.materials.iter().filter(|material| {
            let curve = material.curve();
            curve.is_some_and(|curve| curve.illumination.footprint.is_none())
        });
        let names: Vec<String> = unstated.map(|material| format!("`{}`", material.name)).collect();
        Ok((!names.is_empty()).then(|| {
            format!(
                "the footprint with which it was reduced is not stated of the curve of {}: taken for that of the scene",
                listed(&names)
            )
        }))
    }

    /// That a material's numbers come from powers with another form of the footprint than the scene's.
    fn other_footprint(&self, material: &SceneMaterial) -> Option<String> {
        let (own, scene) =
            (material.curve()?.illumination.footprint?, self.scene.radar().footprint);
        (own != scene).then(|| {
            format!(
                "the curve of `{}` was reduced with footprint {}, the scene has footprint {}: levels differ by \
                 cos θ, 3 dB at 60°",
                material.name,
                own.as_str(),
                scene.as_str()
            )
        })
    }

    /// That a material's lobe is said to include a beam and is narrower than the one of the scene.
    fn too_narrow(&self, material: &SceneMaterial) -> Option<String> {
        let beam_rad = Beam::new(self.scene.radar()).towards(0.0, 0.0).divergence_rad();
        let lobe_rad = material.seen_lobe_rad()?;
        (lobe_rad < beam_rad).then(|| {
            format!(
                "the lobe of `{}` is taken as that of radar and surface together, and is narrower than this radar's \
                 beam: {} rad is below {}, and is seen as wide as that; lobes = \"surface\" in its [[fit]] says that it is the surface's own",
                material.name,
                significant(lobe_rad, 3),
                significant(beam_rad, 3)
            )
        })
    }

    /// Sentences on speckle as 0.1.0 had it, on materials that are withdrawn or superseded, make no claim at the radar's
    /// frequency, were reduced with another footprint than the scene's, have a narrower lobe than its beam, or reflect
    /// more than they receive or than a mirror, and on sheets with gain.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for SceneMaterial { found, .. } in &self.materials {
            notices.extend(status_warning(&found.material));
        }
        for SceneMaterial { found, .. } in &self.materials {
            notices.extend(extrapolation_warning(&found.material, self.scene.radar()));
            notices.extend(polarisation_warning(&found.material));
            notices.extend(found.material.relative_words());
        }
        let earlier = self.scene.radar().speckle.and_then(|speckle| speckle.earlier);
        notices.extend(earlier.map(|earlier| earlier.to_string()));
        if self.speckle_form() == Some(SpeckleForm::Law) && !self.scene.file.receiver.is_empty() {
            notices.push(INDEPENDENT_ANTENNAS.to_owned());
        }
        for material in &self.materials {
            notices.extend(self.other_footprint(material));
            notices.extend(self.too_narrow(material));
            notices.extend(too_much(material));
            notices.extend(self.beyond_beam(material));
        }
        notices.extend(self.gaining_sheets());
        if !self.own_effects.is_empty() {
            let names = self.own_effects.join(", ");
            notices
                .push(format!("effects of a program's own act that no file can declare: {names}"));
        }
        notices
    }

    /// That a material's curve returns what no surface does through this radar's beam.
    fn beyond_beam(&self, material: &SceneMaterial) -> Option<String> {
        let beam_rad = Beam::new(self.scene.radar()).towards(0.0, 0.0).divergence_rad();
        let beyond = BeyondBeam::of(&material.scattering, beam_rad)?;
        Some(format!("the law of `{}` {}", material.name, beyond.words(beam_rad)))
    }

    /// Regions that return and let through more than they receive.
    fn gaining_sheets(&self) -> Vec<String> {
        let regions = self.scene.target.regions.iter().zip(&self.sheets);
        let gaining = regions.zip(self.of_regions()).filter_map(|((region, sheet), material)| {
            let gain = SheetGain::of(sheet.as_ref()?, material.found.material.theta_rad)?;
            Some(format!(
                "the sheet of region `{}`, the law of `{}` with what its permittivity lets through, {}; nothing is cut \
                 off: give it a law that returns less, or a permittivity that passes less",
                region.name,
                material.name,
                gain.words()
            ))
        });
        gaining.collect()
    }

    /// How its speckle is made; none without speckle.
    pub fn speckle_form(&self) -> Option<SpeckleForm> {
        let (file, radar) = (&self.scene.file, self.scene.radar());
        let several_paths = file.spot.rays > 1 || file.bounce.is_some();
        let form = radar.speckle_form(!file.receiver.is_empty(), several_paths);
        radar.speckle.map(|_| form)
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

    /// The sheet of every region that transmits.
    fn find_sheets(&self) -> Result<Vec<Option<Sheet>>, Error> {
        let regions = self.scene.target.regions.iter().zip(self.of_regions());
        let sheets = regions.map(|(region, material)| {
            let at = |(problem, way_out): (String, &str)| {
                let Region { name, material, .. } = region;
                let place = format!("{}: region `{name}`", self.path.display());
                Error::usage(format!("{place}: material `{material}` {problem}"), way_out)
            };
            sheet(region, material, self.scene.radar()).map_err(at)
        });
        sheets.collect()
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
                in_phase: bounce.in_phase,
            }),
            effects: self.model.as_ref(),
            channel: Channel::CoPolar,
            most_sheets: scene.file.transmission.sheets,
            several_antennas: !scene.file.receiver.is_empty(),
            seed: scene.file.seed,
            noise_seed: scene.file.noise_seed,
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
            let found = match scene.given.get(&region.material) {
                Some(material) => MaterialRevision { material: material.clone(), revision: None },
                None => find_material(store, &region.material, &asked_by)?,
            };
            let scattering = found.material.scattering()?;
            let place = format!("{asked_by}material `{}`", found.material.slug);
            let effects = resolve_effects(&found.material.effects, Level::Material, place)?;
            materials.push(SceneMaterial {
                name: region.material.clone(),
                rendered: found.material.render.clone(),
                lobes: found.material.rendered_lobes(),
                found,
                scattering,
                effects,
            });
        }
        of_region.push(known.unwrap_or(materials.len() - 1) as u16);
    }
    Ok((materials, of_region))
}

/// The sheet that a region is, if any; what is wrong with its material and what to do.
fn sheet(
    region: &Region,
    material: &SceneMaterial,
    radar: &Radar,
) -> Result<Option<Sheet>, (String, &'static str)> {
    const WAY_OUT: &str = "give the region thickness_m, or the material a `layered` law with layers and, behind them, \
                           air: eps_real = 1 and eps_imag = 0";
    let law = &material.scattering;
    if region.transmits {
        let sheet = Sheet::of_law(law, radar);
        let problem = "is not rendered by layers in air with a thickness above 0";
        return sheet.map(Some).ok_or_else(|| (problem.to_owned(), WAY_OUT));
    }
    let Some(thickness_m) = region.thickness_m else { return Ok(None) };
    if matches!(law, Brdf::Layered(_)) {
        let problem = "has layers of its own thickness".to_owned();
        return Err((problem, "write transmits = true in place of thickness_m"));
    }
    let of_material =
        || material.found.material.permittivity_near(radar.centre_frequency_ghz * 1e9);
    let Some(permittivity) = law.permittivity().or_else(of_material) else {
        let problem = "has no permittivity, which a sheet needs".to_owned();
        return Err((
            problem,
            "give it a [[permittivity]] whose key is its name, or take a material that has one",
        ));
    };
    Ok(Some(Sheet::of_thickness(law, thickness_m, permittivity, radar)))
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

/// That a material reflects more than it receives at an angle that it is described for.
fn too_much(material: &SceneMaterial) -> Option<String> {
    let excess = Excess::of(&material.scattering, material.found.material.theta_rad)?;
    Some(format!("the law of `{}` {}; nothing is cut off", material.name, excess.words()))
}

/// A curve that was measured across the polarisation that was sent says nothing of what a scene takes it for.
fn polarisation_warning(material: &Material) -> Option<String> {
    let curve = material.rendered_curve()?;
    let key = curve.instrument.as_ref()?;
    let instrument = material.instruments.iter().find(|instrument| instrument.key == *key)?;
    instrument.is_cross_polar().then(|| {
        format!(
            "curve `{}` of `{}` was measured across the polarisation that was sent; it is rendered as the co-polar return \
             that a law stands for",
            curve.name, material.slug
        )
    })
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
