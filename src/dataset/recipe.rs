//! Everything that scans are made of, in memory: the specification, the scene with its meshes and its materials.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::draw::Drawn;
use super::effect::{DrawnEffect, EffectLaw};
use super::labels::Classes;
use super::place::{self, Put};
use super::posterior::{DrawnMaterial, Scatter};
use super::spec::{EffectDraw, Spec, at, format_error, refused};
use super::split::Split;
use super::streams::{Kind, stream};
use crate::effects::Level;
use crate::error::Error;
use crate::material::Material;
use crate::radar::Pattern;
use crate::scene::{GivenMaterials, GivenMeshes, KeyChange, Scene, SceneFile};
use crate::setup::ReadyScene;

/// How often the numbers and places of a scan are drawn again.
const MOST_ATTEMPTS: usize = 20;

/// A data set that can be made, scan by scan.
pub(super) struct Recipe {
    pub spec: Spec,
    /// Where the scene is, from which a file of rays is named.
    path: PathBuf,
    /// What errors call it.
    shown: PathBuf,
    /// The scene's text. Its meshes are `given:FILE`.
    scene: String,
    meshes: GivenMeshes,
    materials: BTreeMap<String, Material>,
    scatters: Vec<Scatter>,
    effects: Vec<EffectLaw>,
    copies: BTreeMap<String, PathBuf>,
    pub splits: Vec<Split>,
    pub classes: Classes,
}

/// One scan before it is traced.
pub(super) struct Target {
    pub ready: ReadyScene,
    pub drawn: Drawn,
    /// Where meshes were put.
    pub placed: Vec<(String, Put)>,
}

impl Recipe {
    /// Prepares a data set; `copies` are the files that the specification and the scene name.
    ///
    /// # Errors
    /// What contradicts the scene or its materials.
    pub fn new(
        spec: Spec,
        [path, shown]: [&Path; 2],
        scene: String,
        meshes: GivenMeshes,
        materials: BTreeMap<String, Material>,
        copies: BTreeMap<String, PathBuf>,
    ) -> Result<Recipe, Error> {
        let mut scatters = Vec::new();
        for posterior in &spec.posterior {
            let material = material_of(&materials, &posterior.material, "[[posterior]]")?;
            scatters.push(Scatter::new(posterior, material)?);
        }
        let effects = spec.effect.iter().map(|draw| EffectLaw::new(draw, &copies));
        let effects = effects.collect::<Result<Vec<_>, _>>()?;
        for EffectDraw { name, material, .. } in &spec.effect {
            if let Some(material) = material {
                material_of(&materials, material, &format!("[[effect]] `{name}`"))?;
            }
        }
        let splits = Split::all(&spec);
        if let Some(empty) = splits.iter().find(|split| split.scans == 0) {
            return Err(refused(
                format!("split `{}`", empty.name),
                format!("gets none of {} scans", spec.scans),
                "make more scans, or give it a larger share",
            ));
        }
        let file = SceneFile::parse(&scene).map_err(|error| format_error(shown, error))?;
        let classes = Classes::new(&spec, &file, materials.keys())?;
        let [path, shown] = [path, shown].map(Path::to_owned);
        Ok(Recipe {
            spec,
            path,
            shown,
            scene,
            meshes,
            materials,
            scatters,
            effects,
            copies,
            splits,
            classes,
        })
    }

    /// The split of a shard.
    pub fn split_of_shard(&self, shard: u32) -> &Split {
        let place = self.splits.partition_point(|split| split.first_shard + split.shards <= shard);
        &self.splits[place.min(self.splits.len() - 1)]
    }

    /// The split of a scan.
    pub fn split_of_scan(&self, scan: u32) -> &Split {
        let place = self.splits.partition_point(|split| split.first + split.scans <= scan);
        &self.splits[place.min(self.splits.len() - 1)]
    }

    /// Number of all shards.
    pub fn shards(&self) -> u32 {
        self.splits.iter().map(|split| split.shards).sum()
    }

    /// The scene of a scan, with everything drawn and placed.
    ///
    /// # Errors
    /// A scene that cannot be, by the scan's name.
    pub fn target(&self, scan: u32) -> Result<Target, Error> {
        self.first_that(scan, Ok)
    }

    /// What `of` makes of the first target that it can be made of.
    ///
    /// # Errors
    /// Why it cannot be made of the first of all, by the scan's name.
    pub fn first_that<T>(
        &self,
        scan: u32,
        of: impl Fn(Target) -> Result<T, Error>,
    ) -> Result<T, Error> {
        // Numbers may be what no scene can have, leave no place for a mesh, or move the target out of view.
        let is_random = !self.spec.vary.is_empty() || !self.spec.place.is_empty();
        let more = if is_random { MOST_ATTEMPTS } else { 0 };
        let mut made = self.attempt(scan, 0).and_then(&of);
        for attempt in 1..=more {
            if made.is_ok() {
                break;
            }
            made = self.attempt(scan, attempt).and_then(&of).or(made);
        }
        made.map_err(|error| at(format!("scan {}", self.key(scan)), &error))
    }

    fn attempt(&self, scan: u32, attempt: usize) -> Result<Target, Error> {
        let spec = &self.spec;
        let target = u64::from(scan / spec.repeats);
        let mut drawn = Drawn::new(spec, self.split_of_scan(scan), scan, attempt)?;
        let effects: Vec<DrawnEffect> = self
            .effects
            .iter()
            .enumerate()
            .filter_map(|(entry, law)| law.draw(spec, target, entry))
            .collect();
        let scatters = self.scatters.iter().enumerate();
        let materials: Vec<DrawnMaterial> = scatters
            .map(|(entry, scatter)| scatter.draw(spec, target, entry))
            .collect::<Result<_, _>>()?;
        drawn.note_all(&effects, &materials);

        let mut file = self.changed(&drawn.changes)?;
        self.check_classes(&file)?;
        file.name = self.key(scan);
        for entry in &mut file.mesh {
            entry.file = format!("given:{}", entry.file);
        }
        if let Pattern::Rays(explicit) | Pattern::Angles(explicit) = &mut file.radar.scan
            && let Some(copy) = self.copies.get(&explicit.file)
        {
            // As seen from the folder of the scene.
            explicit.file = copy.file_name().unwrap_or_default().to_string_lossy().into_owned();
        }
        let mut placed = Vec::new();
        for (entry, placing) in spec.place.iter().enumerate() {
            let entry = entry + (attempt << 16);
            let mut draws = stream(spec.seed, target, Kind::Place, entry);
            let put = place::put(placing, &mut file, &self.shown, &self.meshes, &mut draws)?;
            placed.push((placing.mesh.clone(), put));
        }
        let mut given: GivenMaterials = self.materials.clone();
        given.extend(materials.into_iter().map(|one| (one.name, one.material)));
        for DrawnEffect { entry, level, material } in effects {
            match level {
                Level::Instrument => file.radar.effect.push(entry),
                Level::Scene => file.effect.push(entry),
                Level::Material => {
                    if let Some(material) = material.and_then(|name| given.get_mut(&name)) {
                        material.effects.push(entry);
                    }
                }
            }
        }
        let has_own_rays = matches!(file.radar.scan, Pattern::Rays(_) | Pattern::Angles(_));
        let path = if has_own_rays { &self.path } else { &self.shown };
        let mut scene = Scene::resolve_given(file, path, &self.meshes)?;
        scene.given = given;
        let ready = ReadyScene::new(scene, &self.shown, None)?;
        Ok(Target { ready, drawn, placed })
    }

    /// Refuses a scene whose meshes or regions are others, so that labels would name the wrong ones.
    fn check_classes(&self, file: &SceneFile) -> Result<(), Error> {
        let Classes { instances, regions, .. } = &self.classes;
        let meshes = file.mesh.iter().map(|mesh| &mesh.name);
        if meshes.eq(instances) && file.region.iter().map(|region| &region.name).eq(regions) {
            return Ok(());
        }
        Err(refused(
            "the scene",
            "has other meshes or regions than the specification's, or in another order",
            "change keys of single meshes and regions, such as mesh.body.scale, and not their lists",
        ))
    }

    /// The scene with some changes; an error names the first that cannot be made.
    fn changed(&self, changes: &[KeyChange]) -> Result<SceneFile, Error> {
        SceneFile::parse_changed(&self.scene, changes).map_err(|error| {
            let fails =
                |count: &usize| SceneFile::parse_changed(&self.scene, &changes[..*count]).is_err();
            let first = (1..=changes.len()).find(fails).and_then(|count| changes.get(count - 1));
            match first {
                Some(change) => at(change, &error),
                None => format_error(&self.shown, error),
            }
        })
    }

    /// Name of a scan: `train-000012`.
    pub fn key(&self, scan: u32) -> String {
        let split = self.split_of_scan(scan);
        format!("{}-{:06}", split.name, scan - split.first)
    }
}

/// The material of a scene that an entry of a specification names.
fn material_of<'a>(
    materials: &'a BTreeMap<String, Material>,
    name: &str,
    entry: &str,
) -> Result<&'a Material, Error> {
    materials.get(name).ok_or_else(|| {
        let known: Vec<&str> = materials.keys().map(String::as_str).collect();
        let problem = format!("no region of the scene has the material `{name}`");
        refused(entry, problem, format!("there are: {}", known.join(", ")))
    })
}
