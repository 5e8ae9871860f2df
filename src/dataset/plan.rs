//! A data set as it was planned: its folder has everything that its scans are made of.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::labels::Classes;
use super::layout::{INPUTS, MATERIALS, PLAN, SCENE, SPEC};
use super::recipe::Recipe;
use super::scan::MadeScan;
use super::shard::{ShardFiles, write_inside};
use super::spec::{Spec, alike, at, format_error};
use crate::error::Error;
use crate::files::{read_small, read_whole};
use crate::formats::text::{from_toml, to_toml};
use crate::material::Material;
use crate::radar::Pattern;
use crate::scene::file::MeshEntry;
use crate::scene::{GivenMeshes, KeyChange, SceneFile, builtin, file_mesh, read_text};
use crate::setup::find_material;
use crate::store::Store;

/// Least scans that are made for a plan, to see whether they can be, how long they take and how large they are.
const TRIALS: u32 = 3;
/// Scans that a plan draws and puts together, but does not make.
const DRAWN: u32 = 50;

/// A data set and the folder that it is made in.
pub struct Dataset {
    pub(super) folder: PathBuf,
    pub(super) plan: Plan,
    pub(super) recipe: Recipe,
}

/// What was found out before the first scan, as `plan.toml` keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the data set.
    pub name: String,
    /// The program that planned it; no other may make it.
    pub program: String,
    /// BLAKE3 of program, specification, inputs and first scan: two plans with the same give the same bytes.
    pub id: String,
    /// BLAKE3 of what the first scan gives: another machine that gives other bytes is refused.
    pub first_scan: String,
    /// Number of scans.
    pub scans: u32,
    /// Number of shards.
    pub shards: u32,
    /// Time that a scan takes one core, measured where it was planned, s.
    pub seconds_per_scan: f64,
    /// Bytes that a scan takes on the disk.
    pub bytes_per_scan: u64,
    /// The names behind the labels.
    pub classes: Classes,
    /// The splits.
    pub split: Vec<PlannedSplit>,
    /// Files that scans are made of.
    pub input: Vec<Input>,
}

/// A split of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedSplit {
    /// Its name.
    pub name: String,
    /// Number of its scans.
    pub scans: u32,
    /// Number of its shards.
    pub shards: u32,
    /// For every choice whose options are kept apart those that it has.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub apart: BTreeMap<String, Vec<String>>,
}

/// A file that scans are made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// As the specification or the scene names it.
    pub name: String,
    /// Its copy in the folder.
    pub file: String,
    /// BLAKE3 of its bytes.
    pub blake3: String,
}

/// This program, as plans name it.
pub(super) const PROGRAM: &str = concat!("matdb ", env!("CARGO_PKG_VERSION"));

impl Dataset {
    /// Plans the data set of a specification in a folder, with everything that its scans are made of. A folder with the same
    /// plan stays as it is.
    ///
    /// # Errors
    /// A specification that contradicts itself or its scene, scans that cannot be made, objects that are never in view, and a
    /// folder with another plan or other files.
    pub fn make_plan(spec: &Path, folder: &Path, store: Option<&Store>) -> Result<Dataset, Error> {
        let gathered = Gathered::new(spec, store)?;
        if folder.join(PLAN).exists() {
            let known = Dataset::open(folder)?;
            return known.check_same(&gathered).map(|()| known);
        }
        // A plan that was interrupted may have left some of its inputs.
        let is_own = |name: &str| name == SPEC || name == INPUTS || name.starts_with(".matdb-");
        let mut names = folder.read_dir().into_iter().flatten().flatten();
        if names.any(|entry| !is_own(&entry.file_name().to_string_lossy())) {
            return Err(Error::usage(
                format!("{} has other files in it", folder.display()),
                "give a new or an empty folder",
            ));
        }
        let staged = tempfile::tempdir().map_err(|reason| {
            Error::usage(format!("no temporary folder can be made: {reason}"), "set TMPDIR")
        })?;
        write_inside(staged.path(), &gathered.files)?;
        let recipe = recipe(staged.path(), &gathered.inputs, &gathered.scene)?;
        let plan = planned(&recipe, &gathered)?;
        let mut files = gathered.files;
        files.push((PLAN.to_owned(), to_toml(&plan)?.into_bytes()));
        write_inside(folder, &files)?;
        Dataset::open(folder)
    }

    /// Opens a folder with a plan.
    ///
    /// # Errors
    /// A folder without one, a plan of another version of the program, and inputs that have changed since.
    pub fn open(folder: &Path) -> Result<Dataset, Error> {
        let path = folder.join(PLAN);
        if !path.is_file() {
            return Err(Error::usage(
                format!("{} has no plan of a data set", folder.display()),
                "`matdb dataset plan SPEC.toml -o DIR` makes one",
            ));
        }
        let text = String::from_utf8_lossy(&read_small(&path)?).into_owned();
        let plan: Plan = from_toml(&text).map_err(|error| format_error(&path, error))?;
        if plan.program != PROGRAM {
            return Err(Error::usage(
                format!(
                    "{} was planned by {} and this is {PROGRAM}",
                    folder.display(),
                    plan.program
                ),
                "go on with that version, or plan it anew in another folder",
            ));
        }
        for Input { file, blake3, .. } in &plan.input {
            let bytes = read_whole(&folder.join(file))?;
            if blake3::hash(&bytes).to_hex().as_str() != blake3 {
                return Err(Error::usage(
                    format!(
                        "{} is not what it was when the data set was planned",
                        folder.join(file).display()
                    ),
                    "bring it back, or plan anew in another folder",
                ));
            }
        }
        let recipe = recipe(folder, &plan.input, &folder.join(SCENE))?;
        let Plan { first_scan, seconds_per_scan, bytes_per_scan, input, .. } = plan.clone();
        if Plan::of(&recipe, input, first_scan, seconds_per_scan, bytes_per_scan) != plan {
            return Err(Error::usage(
                format!("{} is not what it was when the data set was planned", path.display()),
                "bring it back, or plan anew in another folder",
            ));
        }
        Ok(Dataset { folder: folder.to_owned(), plan, recipe })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn check_same(&self, gathered: &Gathered) -> Result<(), Error> {
        if self.plan.input == gathered.inputs {
            return Ok(());
        }
        let old: BTreeMap<&str, &str> =
            self.plan.input.iter().map(|one| (one.name.as_str(), one.blake3.as_str())).collect();
        let other = gathered
            .inputs
            .iter()
            .find(|one| old.get(one.name.as_str()) != Some(&one.blake3.as_str()));
        let other = other.map_or("a file".to_owned(), |one| format!("`{}`", one.name));
        Err(Error::usage(
            format!("{} has another plan: {other} differs", self.folder.display()),
            "give another folder, or remove this one",
        ))
    }
}

/// Everything that a data set is made of, read from where the specification and the scene are.
struct Gathered {
    inputs: Vec<Input>,
    /// Their paths in the folder of the plan, and their bytes.
    files: Vec<(String, Vec<u8>)>,
    /// Where the scene is.
    scene: PathBuf,
}

impl Gathered {
    fn new(spec_path: &Path, store: Option<&Store>) -> Result<Gathered, Error> {
        let spec_text = String::from_utf8_lossy(&read_small(spec_path)?).into_owned();
        let spec = Spec::parse(&spec_text, spec_path)?;
        let of_spec = spec_path.parent().unwrap_or(Path::new(""));
        let scene_path = match builtin::name(Path::new(&spec.scene)) {
            Some(_) => PathBuf::from(&spec.scene),
            None => of_spec.join(&spec.scene),
        };
        let scene_text = read_text(&scene_path)?;
        let scene = SceneFile::parse(&scene_text);
        let scene = scene.map_err(|error| format_error(&scene_path, error))?;
        // Files of a built-in scene's changes are in the folder of the specification.
        let of_scene = match builtin::name(&scene_path) {
            Some(_) => of_spec,
            None => scene_path.parent().unwrap_or(Path::new("")),
        };
        let mut gathered =
            Gathered { inputs: Vec::new(), files: Vec::new(), scene: scene_path.clone() };
        gathered.add("specification", SPEC, spec_text.into_bytes());
        gathered.add("scene", SCENE, scene_text.clone().into_bytes());
        let names = Names::of(&spec, &scene, &scene_text, &scene_path)?;
        let mut materials: BTreeMap<String, Material> = BTreeMap::new();
        for name in &names.materials {
            let asked_by = format!("{}: ", scene_path.display());
            materials.insert(name.clone(), find_material(store, name, &asked_by)?.material);
        }
        let text = serde_json::to_vec(&materials).map_err(|error| {
            Error::usage(format!("a material cannot be written: {error}"), "report this")
        })?;
        gathered.add("materials", MATERIALS, text);
        let reports = spec.effect.iter().filter_map(|effect| effect.report.as_ref());
        let named = names.files.iter().map(|name| (name, of_scene));
        for (name, folder) in named.chain(reports.map(|name| (name, of_spec))) {
            if gathered.inputs.iter().any(|input| input.name == *name) {
                continue;
            }
            let base = Path::new(name).file_name().unwrap_or_default().to_string_lossy();
            let file = format!("{INPUTS}/{:02}-{base}", gathered.files.len());
            let bytes = read_whole(&folder.join(name))?;
            gathered.add(name, &file, bytes);
        }
        Ok(gathered)
    }

    fn add(&mut self, name: &str, file: &str, bytes: Vec<u8>) {
        let blake3 = blake3::hash(&bytes).to_hex().to_string();
        self.inputs.push(Input { name: name.to_owned(), file: file.to_owned(), blake3 });
        self.files.push((file.to_owned(), bytes));
    }
}

/// What a scene may name with all changes that a specification makes.
#[derive(Default)]
struct Names {
    /// Files of meshes and of rays.
    files: BTreeSet<String>,
    /// Meshes that are built in.
    built_in: BTreeSet<String>,
    materials: BTreeSet<String>,
}

impl Names {
    fn of(spec: &Spec, scene: &SceneFile, text: &str, path: &Path) -> Result<Names, Error> {
        let mut names = Names::default();
        names.add(scene);
        // Each option by itself, and each value: what they set is in one of them.
        let sets = spec.choose.iter().flat_map(|choice| &choice.option).map(|option| {
            option.set.iter().map(|(key, value)| (key.clone(), value.clone())).collect::<Vec<_>>()
        });
        let values = spec.vary.iter().flat_map(|variation| {
            variation.values.iter().map(|value| {
                variation.keys.iter().map(|key| (key.clone(), value.clone())).collect()
            })
        });
        for set in sets.chain(values) {
            let keys: Vec<String> = set.iter().map(|(key, _)| key.clone()).collect();
            let changes = set.into_iter().map(|(key, value)| KeyChange::new(&key, value));
            let changed = changes
                .collect::<Result<Vec<_>, _>>()
                .and_then(|changes| SceneFile::parse_changed(text, &changes));
            names.add(
                &changed.map_err(|error| {
                    at(format!("{}: {}", path.display(), keys.join(", ")), &error)
                })?,
            );
        }
        Ok(names)
    }

    fn add(&mut self, scene: &SceneFile) {
        for mesh in &scene.mesh {
            let names = if mesh.is_in_a_file() { &mut self.files } else { &mut self.built_in };
            names.insert(mesh.file.clone());
        }
        if let Pattern::Rays(explicit) | Pattern::Angles(explicit) = &scene.radar.scan {
            self.files.insert(explicit.file.clone());
        }
        self.materials.extend(scene.region.iter().map(|region| region.material.clone()));
    }
}

/// What scans are made of, from the files of a folder. Errors call the scene `shown`.
fn recipe(folder: &Path, inputs: &[Input], shown: &Path) -> Result<Recipe, Error> {
    let spec_path = folder.join(SPEC);
    let spec_text = String::from_utf8_lossy(&read_small(&spec_path)?).into_owned();
    let spec = Spec::parse(&spec_text, &spec_path)?;
    let path = folder.join(SCENE);
    let scene_text = String::from_utf8_lossy(&read_small(&path)?).into_owned();
    let scene = SceneFile::parse(&scene_text).map_err(|error| format_error(shown, error))?;
    let materials: BTreeMap<String, Material> =
        serde_json::from_slice(&read_whole(&folder.join(MATERIALS))?).map_err(|error| {
            let problem = format!("{}: {error}", folder.join(MATERIALS).display());
            Error::usage(problem, "plan it anew in another folder")
        })?;
    let copies: BTreeMap<String, PathBuf> =
        inputs.iter().map(|one| (one.name.clone(), folder.join(&one.file))).collect();
    let names = Names::of(&spec, &scene, &scene_text, shown)?;
    let mut meshes = GivenMeshes::new();
    for name in &names.built_in {
        let entry = MeshEntry::of_file(name, name);
        meshes.insert(name.clone(), file_mesh(&entry, shown, &GivenMeshes::new())?);
    }
    for name in &names.files {
        let Some(copy) = copies.get(name).filter(|_| !name.ends_with(".csv")) else { continue };
        let entry = MeshEntry {
            file: copy.to_string_lossy().into_owned(),
            ..MeshEntry::of_file(name, name)
        };
        // The copy is named from the folder of the program, and not from that of the scene.
        meshes.insert(name.clone(), file_mesh(&entry, Path::new(""), &GivenMeshes::new())?);
    }
    Recipe::new(spec, [&path, shown], scene_text, meshes, materials, copies)
}

/// Refuses options that are kept apart and name files with the same bytes.
fn check_files(recipe: &Recipe, gathered: &Gathered) -> Result<(), Error> {
    let hashes: BTreeMap<&str, &str> =
        gathered.inputs.iter().map(|one| (one.name.as_str(), one.blake3.as_str())).collect();
    for choice in recipe.spec.choose.iter().filter(|choice| choice.apart) {
        let mut known: BTreeMap<String, &str> = BTreeMap::new();
        for option in &choice.option {
            let set = option.set.iter().map(|(key, value)| {
                let hash = value.as_str().and_then(|name| hashes.get(name));
                format!("{key}={}", hash.map_or_else(|| alike(value), |hash| (*hash).to_owned()))
            });
            let set = set.collect::<Vec<_>>().join(" ");
            if let Some(other) = known.insert(set, &option.name) {
                return Err(Error::usage(
                    format!(
                        "the splits leak: options `{other}` and `{}` of [[choose]] `{}` name files with the same bytes",
                        option.name, choice.name
                    ),
                    "leave one out",
                ));
            }
        }
    }
    Ok(())
}

/// The plan of a data set, from scans that are made to try it.
fn planned(recipe: &Recipe, gathered: &Gathered) -> Result<Plan, Error> {
    let spec = &recipe.spec;
    check_files(recipe, gathered)?;
    let drawn = spec.scans.min(DRAWN);
    (0..drawn).into_par_iter().try_for_each(|number| {
        let scan = u64::from(number) * u64::from(spec.scans) / u64::from(drawn);
        recipe.target(scan as u32).map(drop)
    })?;
    // All cores at once, as when the data set is made: one alone is faster.
    let cores = rayon::current_num_threads().max(1);
    let trials = spec.scans.min(TRIALS.max(2 * cores as u32));
    let begun = Instant::now();
    let made: Vec<MadeScan> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let spread =
                u64::from(spec.scans - 1) * u64::from(trial) / u64::from(trials - 1).max(1);
            recipe.make(spread as u32)
        })
        .collect::<Result<_, _>>()?;
    let core_seconds = begun.elapsed().as_secs_f64() * cores.min(trials as usize) as f64;
    for (place, object) in recipe.classes.instances.iter().enumerate() {
        let is_seen = made.iter().any(|one| one.chirps_of_instance[place] > 0);
        if recipe.classes.objects.contains(object) && !is_seen {
            return Err(Error::usage(
                format!("no chirp of {trials} scans hits the object `{object}`"),
                "put it into the field of view, in front of what hides it, or leave it out of objects",
            ));
        }
    }
    let first = ShardFiles::new(&made[..1])?;
    let all = ShardFiles::new(&made)?;
    let seconds_per_scan = core_seconds / f64::from(trials);
    let bytes_per_scan = all.bytes() / u64::from(trials);
    Ok(Plan::of(recipe, gathered.inputs.clone(), first.blake3(), seconds_per_scan, bytes_per_scan))
}

impl Plan {
    /// The plan of a data set, of which so much was measured.
    fn of(
        recipe: &Recipe,
        input: Vec<Input>,
        first_scan: String,
        seconds_per_scan: f64,
        bytes_per_scan: u64,
    ) -> Plan {
        let spec = &recipe.spec;
        let mut id = blake3::Hasher::new();
        id.update(PROGRAM.as_bytes());
        id.update(first_scan.as_bytes());
        input.iter().for_each(|input| _ = id.update(input.blake3.as_bytes()));
        let split = recipe.splits.iter().map(|split| PlannedSplit {
            name: split.name.clone(),
            scans: split.scans,
            shards: split.shards,
            apart: split.apart(spec),
        });
        Plan {
            name: spec.name.clone(),
            program: PROGRAM.to_owned(),
            id: id.finalize().to_hex().to_string(),
            first_scan,
            scans: spec.scans,
            shards: recipe.shards(),
            seconds_per_scan,
            bytes_per_scan,
            classes: recipe.classes.clone(),
            split: split.collect(),
            input,
        }
    }
}
