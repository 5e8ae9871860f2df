//! The diagnosis of a cloud as a user asks for it, checked before it runs.

use std::path::{Path, PathBuf};

use super::earlier::check_folder;
use super::recipients::{check_recipients, find_recipient};
use super::scene_after::{AFTER, after_of, check_beside};
use crate::diagnose::{
    DiagnoseError, MeasuredScene, Options, Report, declared_receiver, diagnose_together,
};
use crate::effects::{About, Antenna, BeamSpot, Effect, RangeCell, SecondBounce, Setting, library};
use crate::error::Error;
use crate::files::folder_of;
use crate::formats::words::counted;
use crate::material::Input;
use crate::measure::{Cloud, CloudError};
use crate::radar::{Pattern, Radar, RadarError, Receiver, Returns};
use crate::report::{Choice, Measurands, Reason};
use crate::scene::{Scene, read_text};
use crate::setup::{ReadyScene, absolute, antenna};
use crate::store::Store;
use crate::units::ratio_from_db;

/// Warning for a scene according to which every chirp would measure its power exactly.
const NO_SPECKLE: &str = "the scene declares no speckle, so that any scatter of the powers is an effect to be found; a \
                          measured cloud has some: state `looks` under [radar.speckle]";

/// Most clouds of one diagnosis, all of which are in memory.
const MOST_CLOUDS: usize = 1000;

/// What to diagnose, and where the answer goes.
#[derive(Clone, Copy)]
pub struct CloudRequest<'a> {
    /// The cloud's file.
    pub cloud: &'a Path,
    /// The scene that was measured.
    pub scene: &'a Path,
    /// Further clouds of the same target, each with its scene.
    pub further: &'a [(&'a Path, &'a Path)],
    /// The receiver of the scene that the one cloud is of; the radars themselves for `None`.
    pub receiver: Option<&'a str>,
    /// Effects to try; all for an empty list.
    pub effects: &'a [&'static dyn Effect],
    /// Effects of a program's own, which are tried as well. No file can declare them.
    pub own_effects: &'a [&'static dyn Effect],
    /// The material that alone receives what is found; all of the scene for `None`.
    pub material: Option<&'a str>,
    /// Seed of everything random.
    pub seed: u64,
    /// Whether controls are computed.
    pub controls: bool,
    /// Folder of the report.
    pub folder: &'a Path,
    /// Whether what is found will be stored.
    pub add: bool,
}

/// A request whose scene is loaded and that nothing hinders.
pub struct CheckedRequest<'a> {
    /// What was asked.
    pub request: CloudRequest<'a>,
    /// The scene with its materials.
    pub ready: ReadyScene,
    /// The antenna that the cloud is of; none for the radar's own.
    pub antenna: Option<Antenna>,
    /// Text of the scene file.
    pub scene_text: String,
    /// The scenes of the further clouds.
    pub further: Vec<LoadedScene>,
    /// The material that alone receives what is found, as its place among those of the scene.
    pub recipient: Option<usize>,
    /// Effects to try, and the others.
    pub choice: Choice,
    /// What the clouds and scenes were made of, where these are no files; else empty.
    pub given: Vec<Input>,
}

/// A scene of a request.
pub struct LoadedScene {
    /// Its file.
    pub path: PathBuf,
    /// The scene with its materials.
    pub ready: ReadyScene,
    /// Text of the scene file.
    pub text: String,
}

impl LoadedScene {
    fn load(path: &Path, store: Option<&Store>) -> Result<LoadedScene, Error> {
        let text = read_text(path)?;
        let ready = ReadyScene::new(Scene::load(path)?, path, store)?;
        Ok(LoadedScene { path: path.to_owned(), ready, text })
    }
}

/// The scene of each of several clouds: one for each in the same order, or one for all.
///
/// # Errors
/// Another number of scenes.
pub fn scene_of_each<Given: Copy>(scenes: &[Given], clouds: usize) -> Result<Vec<Given>, Error> {
    match scenes {
        [one] => Ok(vec![*one; clouds]),
        _ if scenes.len() == clouds => Ok(scenes.to_vec()),
        _ => Err(Error::usage(
            format!("{} for {}", counted(scenes.len(), "scene"), counted(clouds, "cloud")),
            "give --scene once for each cloud, in the same order, or once for all",
        )),
    }
}

impl<'a> CloudRequest<'a> {
    /// The clouds' files.
    pub fn clouds(&self) -> impl Iterator<Item = &'a Path> {
        [self.cloud].into_iter().chain(self.further.iter().map(|(cloud, _)| *cloud))
    }

    /// The files that a user names, each once.
    pub fn inputs(&self) -> Vec<&'a Path> {
        let mut inputs = vec![self.cloud, self.scene];
        for path in self.further.iter().flat_map(|(cloud, scene)| [*cloud, *scene]) {
            if !inputs.contains(&path) {
                inputs.push(path);
            }
        }
        inputs
    }

    /// Loads the scene, with materials from `store` or built in, and checks everything that could hinder the
    /// answer, since a diagnosis takes a while.
    ///
    /// # Errors
    /// A scene that cannot be loaded or declares what no diagnosis predicts; a folder with files of somebody else;
    /// effects or a material that do not suit the scene.
    pub fn check(self, store: Option<&Store>) -> Result<CheckedRequest<'a>, Error> {
        let first = LoadedScene::load(self.scene, store)?;
        let further = self.further.iter().map(|(_, path)| LoadedScene::load(path, store));
        let further = further.collect::<Result<_, _>>()?;
        let checked = self.check_ready(first, further)?;
        checked.check_output()?;
        Ok(checked)
    }

    /// As [`CloudRequest::check`], of scenes with their materials and the texts of their files, which need not be what the
    /// files have; and without a look at the files that will be written. `further` are those of the further clouds.
    ///
    /// # Errors
    /// As [`CloudRequest::check`].
    pub fn check_ready(
        self,
        first: LoadedScene,
        further: Vec<LoadedScene>,
    ) -> Result<CheckedRequest<'a>, Error> {
        let LoadedScene { ready, text: scene_text, .. } = first;
        let antenna = self.receiver.map(|name| self.antenna(&ready.scene, name)).transpose()?;
        check_predicted(&ready.scene, self.scene, antenna)?;
        check_declared(&ready, self.scene, antenna)?;
        for LoadedScene { path, ready, .. } in &further {
            check_predicted(&ready.scene, path, None)?;
            check_declared(ready, path, None)?;
        }
        self.check_together(&ready, &further)?;
        let recipient = self.material.map(|name| find_recipient(&ready, name)).transpose()?;
        if self.add && !self.own_effects.is_empty() {
            return Err(Error::usage(
                "effects of a program's own cannot be stored",
                "diagnose without storing, or without them",
            ));
        }
        if self.add {
            check_recipients(&ready)?;
        }
        let scenes: Vec<&ReadyScene> =
            [&ready].into_iter().chain(further.iter().map(|one| &one.ready)).collect();
        let choice = self.choose_effects(&scenes)?;
        let given = Vec::new();
        Ok(CheckedRequest {
            request: self,
            ready,
            antenna,
            scene_text,
            further,
            recipient,
            choice,
            given,
        })
    }

    /// The antenna of a receiver of the scene.
    fn antenna(&self, scene: &Scene, name: &str) -> Result<Antenna, Error> {
        if !self.further.is_empty() {
            return Err(Error::usage(
                format!("receiver `{name}` has one cloud, and {} are given", self.clouds().count()),
                "diagnose its cloud alone, or leave --receiver out: several clouds are those of radars",
            ));
        }
        let receivers = &scene.file.receiver;
        if let Some(receiver) = receivers.iter().find(|receiver| receiver.name == name) {
            return Ok(antenna(receiver, scene.radar()));
        }
        let names: Vec<&str> = receivers.iter().map(|receiver| receiver.name.as_str()).collect();
        let way_out = match &names[..] {
            [] => "leave --receiver out: the cloud is that of the radar".to_owned(),
            names => format!("name one of {}, or leave --receiver out", names.join(", ")),
        };
        let scene = self.scene.display();
        Err(Error::usage(format!("{scene} has no receiver `{name}`"), way_out))
    }

    /// Checks that several clouds differ and that their scenes have the same regions of the same materials.
    fn check_together(&self, first: &ReadyScene, further: &[LoadedScene]) -> Result<(), Error> {
        if self.further.len() >= MOST_CLOUDS {
            return Err(Error::usage(
                format!("{} clouds are more than {MOST_CLOUDS}", self.further.len() + 1),
                "diagnose them in groups",
            ));
        }
        for (number, cloud) in self.clouds().enumerate() {
            let real = cloud.canonicalize().ok();
            if real.is_some()
                && self.clouds().take(number).any(|other| other.canonicalize().ok() == real)
            {
                let problem = format!("the cloud {} is given twice", cloud.display());
                return Err(Error::usage(problem, "give each cloud once"));
            }
        }
        let regions = &first.scene.target.regions;
        for other in further {
            let own = &other.ready.scene.target.regions;
            check_given(first, &other.ready)?;
            let pairs = regions.iter().zip(own);
            let differs = pairs.clone().find(|(a, b)| a.name != b.name || a.material != b.material);
            let [path, own_path] = [self.scene, &other.path].map(|path| path.display().to_string());
            let problem = if let Some((a, b)) = differs {
                format!(
                    "region `{}` is of `{}` in {path}, and region `{}` is of `{}` in {own_path}",
                    a.name, a.material, b.name, b.material
                )
            } else if regions.len() != own.len() {
                format!("{path} has {} regions, and {own_path} has {}", regions.len(), own.len())
            } else {
                continue;
            };
            return Err(Error::usage(
                problem,
                "give all scenes the same regions of the same materials, or diagnose the clouds apart",
            ));
        }
        Ok(())
    }

    /// The effects to try: those that no scene declares, and that every scan can tell.
    fn choose_effects(&self, scenes: &[&ReadyScene]) -> Result<Choice, Error> {
        let mut declared = Vec::new();
        let mut measured = Measurands {
            times: true,
            ranges: true,
            at_other_antenna: self.receiver.is_some(),
            by_range_receiver: false,
            with_bounce: false,
            with_sheets: false,
        };
        for ready in scenes {
            let (model, scene) = (ready.model(), &ready.scene);
            let rendered = Rendered::of(scene, None);
            for (effect, _) in model.iter().flat_map(|model| &model.effects) {
                declared.push(effect.name());
            }
            declared.extend(rendered.effects().iter().map(|(effect, _)| effect.name()));
            let (_, of_radar) = declared_receiver(scene.radar()).map_err(DiagnoseError::from)?;
            measured.times &= scene.chirps.is_timed();
            measured.ranges &= of_radar.range_sd_m > 0.0;
            measured.by_range_receiver |= scene.radar().receiver.is_some();
            measured.with_bounce |= scene.file.bounce.is_some();
            measured.with_sheets |= scene.target.transmits();
        }
        let mut asked =
            if self.effects.is_empty() { library().to_vec() } else { self.effects.to_vec() };
        asked.extend(self.own_effects);
        let choice = Choice::new(&asked, &declared, measured);
        if !self.effects.is_empty() {
            type Refusal = (Reason, fn(String) -> DiagnoseError);
            let refusals: [Refusal; 6] = [
                (Reason::NoTimes, |effects| DiagnoseError::Untimed { effects }),
                (Reason::NoRanges, |effects| DiagnoseError::Unranged { effects }),
                (Reason::OtherAntenna, |effects| DiagnoseError::OtherAntenna { effects }),
                (Reason::RangeReceiver, |effects| DiagnoseError::RangeReceiver { effects }),
                (Reason::Bounce, |effects| DiagnoseError::Bounce { effects }),
                (Reason::Sheets, |effects| DiagnoseError::Sheets { effects }),
            ];
            for (reason, refusal) in refusals {
                let names = choice.left_out(reason);
                if !names.is_empty() {
                    return Err(refusal(names.join(" and ")).into());
                }
            }
        }
        if choice.tried.is_empty() {
            let names: Vec<&str> = asked.iter().map(|effect| effect.name()).collect();
            return Err(Error::usage(
                format!("the scene declares {} already", names.join(", ")),
                "name other effects, or diagnose with the scene that lacks them",
            ));
        }
        Ok(choice)
    }
}

impl CheckedRequest<'_> {
    /// Checks that the answer will not replace what is read, or somebody's own scene or material.
    ///
    /// # Errors
    /// The file that would be replaced.
    pub fn check_output(&self) -> Result<(), Error> {
        let mut written = vec![AFTER.to_owned()];
        for material in &self.ready.materials {
            written.push(material_file(&material.name));
        }
        for number in 0..self.further.len() {
            written.push(after_of(number + 1));
        }
        let read = self.files_read();
        let read: Vec<&Path> = read.iter().map(PathBuf::as_path).collect();
        check_folder(self.request.folder, &read, &written)?;
        if self.request.add {
            check_beside(self.request.scene)?;
            self.further.iter().try_for_each(|scene| check_beside(&scene.path))?;
        }
        Ok(())
    }

    /// The files that it is made of: clouds, scenes, and what these name.
    pub fn files_read(&self) -> Vec<PathBuf> {
        let mut read: Vec<PathBuf> =
            self.request.inputs().into_iter().map(Path::to_owned).collect();
        read.extend(named_files(&self.ready.scene, self.request.scene));
        for other in &self.further {
            read.extend(named_files(&other.ready.scene, &other.path));
        }
        read
    }

    /// Sentences on the scene and its materials that the report repeats.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for notice in self.scenes().flat_map(ReadyScene::notices) {
            if !notices.contains(&notice) {
                notices.push(notice);
            }
        }
        if let Some(name) = self.request.receiver {
            notices.push(format!("the cloud is that of receiver `{name}`"));
        }
        if !self.request.own_effects.is_empty() {
            let names: Vec<&str> =
                self.request.own_effects.iter().map(|effect| effect.name()).collect();
            notices.push(format!(
                "effects of a program's own were tried as well, which no file can declare: {}",
                names.join(", ")
            ));
        }
        if self.ready.scene.radar().speckle.is_none() {
            notices.push(NO_SPECKLE.to_owned());
        }
        notices
    }

    /// The scene of every cloud.
    pub fn scenes(&self) -> impl Iterator<Item = &ReadyScene> {
        [&self.ready].into_iter().chain(self.further.iter().map(|one| &one.ready))
    }

    /// The clouds of the request, one for each scene, as `read` reads them.
    ///
    /// # Errors
    /// Those of `read`; powers of an unknown level; a scan that holds only chirps that were detected.
    pub fn read_clouds(
        &self,
        read: impl Fn(&Path, &Radar) -> Result<Cloud, Error>,
    ) -> Result<Vec<Cloud>, Error> {
        let read_one = |(path, ready): (&Path, &ReadyScene)| {
            if ready.scene.chirps.only_detected {
                return Err(Error::usage(
                    format!("the scan of {} holds only chirps that were detected", path.display()),
                    "a diagnosis needs the silent ones: give the scene the whole scan, and set radar.scan.complete",
                ));
            }
            absolute(read(path, ready.scene.radar())?, path)
        };
        let clouds = self.request.clouds().zip(self.scenes()).map(read_one);
        let clouds = clouds.collect::<Result<Vec<_>, _>>()?;
        let paths: Vec<&Path> = self.request.clouds().collect();
        for (number, cloud) in clouds.iter().enumerate() {
            let same = clouds[..number].iter().position(|other| are_the_same(cloud, other));
            if let Some(other) = same {
                let [other, own] = [other, number].map(|number| paths[number].display());
                return Err(Error::usage(
                    format!("the clouds {other} and {own} have the same powers"),
                    "give each measurement once",
                ));
            }
        }
        Ok(clouds)
    }

    /// Diagnoses the clouds, one for each scene; `hear` receives in a few words what is being done.
    ///
    /// # Errors
    /// When the data are too few to tell anything, or are not of these scenes.
    pub fn diagnose(
        &self,
        clouds: &[Cloud],
        hear: &(dyn Fn(&str) + Sync),
    ) -> Result<Report, DiagnoseError> {
        let models: Vec<_> = self.scenes().map(ReadyScene::model).collect();
        let rendered = self.scenes().map(|ready| {
            let several_paths = has_several_paths(&ready.scene);
            let cell = if several_paths { RangeCell::of(ready.scene.radar())? } else { None };
            Ok(Rendered::of(&ready.scene, cell))
        });
        let rendered = rendered.collect::<Result<Vec<_>, RadarError>>()?;
        let laws: Vec<_> =
            self.scenes().map(|ready| (ready.laws(), ready.seen_lobe_rad())).collect();
        let declared: Vec<Vec<(&dyn Effect, Vec<f64>)>> = std::iter::zip(&models, &rendered)
            .map(|(model, rendered)| {
                let mut effects = rendered.effects();
                effects.extend(model.iter().flat_map(|model| model.effects.iter().cloned()));
                effects
            })
            .collect();
        let mut measured = Vec::new();
        for (number, (ready, cloud)) in self.scenes().zip(clouds).enumerate() {
            let ((laws, seen_lobe_rad), declared_effects) = (&laws[number], &declared[number]);
            measured.push(MeasuredScene {
                scene: &ready.scene,
                cloud,
                antenna: self.antenna,
                laws,
                sheets: &ready.sheets,
                seen_lobe_rad,
                declared_effects,
            });
        }
        let CloudRequest { seed, controls, .. } = self.request;
        let options = Options { seed, controls };
        let mut report = diagnose_together(&measured, options, &self.choice.tried, hear)?;
        for (part, name) in report.clouds.iter_mut().zip(self.request.clouds()) {
            part.name = name.display().to_string();
        }
        Ok(report)
    }
}

/// The reason why an error is an answer, too: the data or the scene do not allow a diagnosis.
///
/// # Errors
/// Every other error, as it is.
pub fn as_answer(error: Error) -> Result<DiagnoseError, Error> {
    match error {
        Error::Diagnose(error) => Ok(error),
        // Nothing was detected.
        Error::Cloud { error: CloudError::Empty, .. } => Ok(DiagnoseError::TooFew { detected: 0 }),
        other => Err(other),
    }
}

/// Name of the file of a material that a scene names so.
pub(super) fn material_file(name: &str) -> String {
    format!("material-{}.toml", name.replace(['@', ':'], "-"))
}

/// Whether two clouds are one measurement, perhaps by way of another file: all powers agree to what files keep of them.
fn are_the_same(cloud: &Cloud, other: &Cloud) -> bool {
    const KEPT: f64 = 1e-4;
    let (own, others) = (cloud.points(), other.points());
    let mut pairs = own.iter().zip(others);
    own.len() == others.len()
        && pairs.all(|(a, b)| (a.power_w - b.power_w).abs() <= KEPT * a.power_w.max(b.power_w))
}

/// Files that a scene names: meshes and a scan.
fn named_files(scene: &Scene, path: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for mesh in &scene.file.mesh {
        if mesh.is_in_a_file() {
            files.push(folder_of(path).join(&mesh.file));
        }
    }
    if let Pattern::Rays(explicit) | Pattern::Angles(explicit) = &scene.radar().scan {
        files.push(folder_of(path).join(&explicit.file));
    }
    files
}

/// What a scene tells the renderer to follow beside single rays, as effects at work.
struct Rendered {
    /// Of several rays in a spot.
    spot: Option<BeamSpot>,
    /// Of second-order paths.
    bounce: Option<SecondBounce>,
}

impl Rendered {
    /// Of a scene, with echoes as a range receiver reads them.
    fn of(scene: &Scene, cell: Option<RangeCell>) -> Rendered {
        let diameter_m = scene.radar().spot_fwhm_m();
        let spot = (scene.file.spot.rays > 1).then_some(BeamSpot { diameter_m, cell });
        let bounce = scene.file.bounce.map(|bounce| SecondBounce {
            outside_spot: ratio_from_db(bounce.outside_spot_db),
            in_phase: bounce.in_phase,
            cell,
        });
        Rendered { spot, bounce }
    }

    fn effects(&self) -> Vec<(&dyn Effect, Vec<f64>)> {
        let spot = self.spot.as_ref().map(|spot| (spot as &dyn Effect, Vec::new()));
        let bounce = self.bounce.as_ref().map(|bounce| (bounce as &dyn Effect, Vec::new()));
        spot.into_iter().chain(bounce).collect()
    }
}

/// Refuses scenes whose program gave them different materials under one name.
fn check_given(first: &ReadyScene, other: &ReadyScene) -> Result<(), Error> {
    let (given, others) = (&first.scene.given, &other.scene.given);
    let differing =
        given.iter().find(|(name, one)| others.get(*name).is_some_and(|two| two != *one));
    differing.map_or(Ok(()), |(name, _)| {
        let problem = format!("`{name}` is one material in a scene and another one in the next");
        Err(Error::usage(problem, "give all scenes the same materials"))
    })
}

/// Refuses effects that the scene or its materials declare and that have no meaning for this cloud.
fn check_declared(ready: &ReadyScene, path: &Path, antenna: Option<Antenna>) -> Result<(), Error> {
    let scene = &ready.scene;
    let has = |setting: Setting| match setting {
        Setting::SeveralRays => scene.file.spot.rays > 1,
        Setting::Bounce => scene.file.bounce.is_some(),
        Setting::RangeReceiver => scene.radar().receiver.is_some(),
        Setting::Sheets => scene.target.transmits(),
        Setting::OtherAntenna => antenna.is_some(),
    };
    for (effect, _) in ready.model().iter().flat_map(|model| &model.effects) {
        let About { name, conflicts, .. } = effect.about();
        if let Some(conflict) = conflicts.iter().find(|conflict| has(conflict.with)) {
            let problem = format!("{}: effect {name} {}", path.display(), conflict.problem);
            return Err(Error::usage(problem, conflict.way_out));
        }
    }
    Ok(())
}

/// Whether a chirp has several paths to the first surfaces and back.
fn has_several_paths(scene: &Scene) -> bool {
    scene.file.spot.rays > 1 || scene.file.bounce.is_some()
}

/// Refuses what a scene declares and no diagnosis predicts: it would be found as an effect.
fn check_predicted(scene: &Scene, path: &Path, antenna: Option<Antenna>) -> Result<(), Error> {
    let radar = scene.radar();
    let has_faults = radar.receiver.is_some_and(|receiver| {
        let Receiver { leakage, phase_noise, sweep_ripple, .. } = receiver;
        leakage.is_some() || phase_noise.is_some() || sweep_ripple.is_some()
    });
    let several_paths = has_several_paths(scene);
    let (what, way_out) = if has_faults {
        (
            "leakage, phase noise and a rippled sweep",
            "remove these tables of [radar.receiver], or replace it by [radar.noise]",
        )
    } else if radar.receiver.is_some() && radar.returns != Returns::Strongest {
        ("which of several echoes is not the strongest", "set radar.returns = \"strongest\"")
    } else if scene.target.transmits() && (several_paths || radar.receiver.is_some()) {
        (
            "what several rays, a second bounce or a range receiver find behind a region that transmits",
            "set spot.rays = 1, remove [bounce], and replace [radar.receiver] by [radar.noise]",
        )
    } else if scene.target.transmits() && antenna.is_some() {
        (
            "what lies behind a region that transmits for an antenna apart from the radar's",
            "diagnose the radar's own cloud",
        )
    } else if antenna.is_some() && several_paths {
        (
            "several rays or a second bounce at an antenna apart from the radar's",
            "set spot.rays = 1 and remove [bounce], or diagnose the radar's own cloud",
        )
    } else {
        return Ok(());
    };
    let problem = format!("{}: no diagnosis predicts {what}", path.display());
    Err(Error::usage(problem, way_out))
}
