//! Everything that a diagnosis leaves behind: the report, the scene with what was found, and files or stored
//! revisions of the materials that receive it.

use std::path::{Path, PathBuf};

use super::provenance::activity;
use super::recipients::{Adoption, Recipient, pinned_name, replaced_name};
use super::request::{CheckedRequest, material_file};
use super::scene_after::{
    AFTER, MARK, after_of, name_beside, of_own_echoes, relocate_files, scene_with_found,
};
use crate::diagnose::{FoundEffect, LEAST_SHOTS, Report, Verdict};
use crate::effects::Level;
use crate::error::Error;
use crate::files::folder_of;
use crate::formats::words::listed;
use crate::material::{Activity, Material, file};
use crate::report::{CloudAnswer, CloudReport, NextSteps, shell_word};
use crate::scene::{Scene, SceneFile};
use crate::setup::{Database, USUAL_DATABASE};
use crate::store::{Addition, Store};

/// First line of a material's file.
const FOUND: &str = "# A material with what `matdb diagnose` found in it.\n";

/// Name and bytes of a file.
type File = (String, Vec<u8>);

/// A folder, and the files for it.
type Beside<'a> = (&'a Path, Vec<File>);

/// A scene of a diagnosis.
struct DiagnosedScene<'a> {
    scene: &'a Scene,
    path: &'a Path,
    text: &'a str,
    /// Its clouds, from 0.
    clouds: Vec<u16>,
}

/// A diagnosis with everything that its files are made of.
pub struct Publication<'a> {
    checked: &'a CheckedRequest<'a>,
    adoption: Adoption<'a>,
    recipients: Vec<Recipient>,
    report: CloudReport<'a>,
    next: NextSteps,
}

/// What was published.
#[derive(Default)]
pub struct PublicationResult {
    /// Files for the folder of the report, `report.html` first.
    pub files: Vec<(String, Vec<u8>)>,
    /// Materials that were stored, with their revisions.
    pub stored: Vec<String>,
    /// The revisions that were current before these, where they are new.
    pub replaced: Vec<String>,
}

impl<'a> Publication<'a> {
    /// Draws the pictures of a diagnosis; `notices` are those of the request, `program` and `command` what a
    /// person types.
    pub fn new(
        checked: &'a CheckedRequest<'a>,
        report: &'a Report,
        notices: &'a [String],
        [program, command]: [String; 2],
    ) -> Publication<'a> {
        let CheckedRequest { request, ready, recipient, choice, .. } = checked;
        let adoption = Adoption { ready, report, wanted: *recipient };
        let answer = CloudAnswer {
            report,
            scene: &ready.scene,
            scene_path: request.scene,
            cloud_path: request.cloud,
            notices,
            not_tried: &choice.not_tried,
            seed: request.seed,
        };
        let beside = request.scene.with_file_name(name_beside(request.scene));
        let next = NextSteps {
            program,
            command,
            scene_after: shell_word(&request.folder.join(AFTER)),
            scene_beside: shell_word(&beside),
            ..NextSteps::default()
        };
        // Nothing is stored of clouds that contradict each other.
        let is_answer = report.verdict != Verdict::Contradictory;
        let recipients = if is_answer { adoption.recipients() } else { Vec::new() };
        Publication { checked, adoption, recipients, report: CloudReport::new(answer), next }
    }

    /// The same for a caller who has the scenes with what was found in the folder of the report, and not next to the old ones.
    pub fn with_scenes_in_folder(mut self) -> Publication<'a> {
        self.next.scene_beside.clone_from(&self.next.scene_after);
        self
    }

    /// The first cloud of every scene, from 0, in the order in which [`Publication::store`] gives the scenes.
    pub fn cloud_of_each_scene(&self) -> Vec<usize> {
        self.scenes().iter().map(|one| usize::from(one.clouds[0])).collect()
    }

    /// The report.
    pub fn report(&self) -> &CloudReport<'a> {
        &self.report
    }

    /// The page of a report without its other files.
    ///
    /// # Errors
    /// A picture that cannot be drawn.
    pub fn page_alone(&self) -> Result<Vec<u8>, Error> {
        self.report.page(&NextSteps { is_alone: true, ..self.next.clone() })
    }

    /// The files of a diagnosis of which nothing is stored.
    ///
    /// # Errors
    /// A picture, page or material that cannot be written.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let mut files = self.report.tables_and_pictures()?;
        if self.adoption.report.verdict == Verdict::Contradictory {
            files.push(("report.html".to_owned(), self.report.page(&self.next)?));
            files.sort_by_key(|(name, _)| name != "report.html");
            return Ok(files);
        }
        let (mut next, mut names) = (self.next.clone(), Vec::new());
        let mut material_files = Vec::new();
        for recipient in &self.recipients {
            let title = self.title(&self.activity()?);
            let material = self.adoption.make_material(recipient, &title)?;
            let name = material_file(&self.adoption.ready.materials[recipient.number].name);
            next.material_files.push(shell_word(&self.checked.request.folder.join(&name)));
            files.push((name.clone(), (FOUND.to_owned() + &file::write(&material)?).into_bytes()));
            names.push(material.slug.to_string());
            material_files.push(name);
        }
        let names = self.adoption.region_names(&self.recipients, &names);
        files.extend(self.scenes_after(&names, &head(&material_files))?);
        files.push(("report.html".to_owned(), self.report.page(&next)?));
        files.sort_by_key(|(name, _)| name != "report.html");
        Ok(files)
    }

    /// Stores what was found, or what was tried and not found, as new revisions of the materials. `write` receives
    /// the files for the folder of the report and those to be put next to the scene; if it fails, nothing is stored.
    ///
    /// # Errors
    /// What the database or `write` refuses.
    pub fn store<Written>(
        &self,
        store: &mut Store,
        write: impl FnOnce(&[File], &[Beside]) -> Result<Written, Error>,
    ) -> Result<(PublicationResult, Written), Error> {
        if self.adoption.report.effects.is_empty() {
            self.store_not_found(store, write)
        } else {
            self.store_found(store, write)
        }
    }

    fn store_found<Written>(
        &self,
        store: &mut Store,
        write: impl FnOnce(&[File], &[Beside]) -> Result<Written, Error>,
    ) -> Result<(PublicationResult, Written), Error> {
        let mut files = self.report.tables_and_pictures()?;
        let activity = self.activity()?;
        let title = self.title(&activity);
        let (mut materials, mut last) = (Vec::new(), Vec::new());
        for recipient in &self.recipients {
            materials.extend(self.adoption.revise(recipient, &title, store)?);
            last.push(materials.len() - 1);
        }
        let (mut published, mut all_added) = (PublicationResult::default(), Vec::new());
        store.record(activity);
        let written = store.add_if(&materials, |added| {
            for (material, added) in at_places(&materials, added, &last) {
                published.stored.push(pinned_name(material, added));
            }
            all_added = added.to_vec();
            let next = NextSteps {
                is_stored: self.unstored().len() < self.adoption.report.effects.len(),
                stored: published.stored.clone(),
                ..self.next.clone()
            };
            let names = self.adoption.region_names(&self.recipients, &published.stored);
            files.extend(self.scenes_after(&names, MARK)?);
            files.push(("report.html".to_owned(), self.report.page(&next)?));
            files.sort_by_key(|(name, _)| name != "report.html");
            let mut beside = Vec::new();
            for one in self.scenes() {
                let text = one.text_with(MARK, &self.scene_with(&one, &names))?;
                beside.push((folder_of(one.path), vec![(name_beside(one.path), text)]));
            }
            write(&files, &beside)
        })?;
        for (material, added) in at_places(&materials, &all_added, &last) {
            published.replaced.extend(replaced_name(material, added, store));
        }
        published.files = files;
        Ok((published, written))
    }

    fn store_not_found<Written>(
        &self,
        store: &mut Store,
        write: impl FnOnce(&[File], &[Beside]) -> Result<Written, Error>,
    ) -> Result<(PublicationResult, Written), Error> {
        let mut published =
            PublicationResult { files: self.files()?, ..PublicationResult::default() };
        let activity = self.activity()?;
        let title = self.title(&activity);
        let (materials, last) = self.adoption.record_not_found(&title, store)?;
        store.record(activity);
        let written = store.add_if(&materials, |added| {
            for (material, added) in at_places(&materials, added, &last) {
                published.stored.push(pinned_name(material, added));
            }
            write(&published.files, &[])
        })?;
        Ok((published, written))
    }

    /// Effects of a material that no material receives.
    pub fn unstored(&self) -> Vec<&'static str> {
        let mut unstored = Vec::new();
        for found in &self.adoption.report.effects {
            if found.level == Level::Material && self.recipients.is_empty() {
                unstored.push(found.name);
            }
        }
        unstored
    }

    /// Sentences on pictures and numbers that are missing or uncertain, and on materials that stay as they were.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = self.report.notices.clone();
        if !self.adoption.report.base.converged {
            notices.push("the final fit did not converge: take the numbers with care".to_owned());
        }
        // Of contradictory clouds nothing is stored, and no scene is written.
        if self.adoption.report.verdict == Verdict::Contradictory {
            return notices;
        }
        let unstored = self.unstored();
        if !unstored.is_empty() {
            notices.push(format!(
                "kept in the report alone, as no material has the {LEAST_SHOTS} chirps on the target that take {}: {}",
                if unstored.len() == 1 { "it" } else { "them" },
                listed(&unstored)
            ));
        }
        notices.extend(self.unchanged());
        notices.extend(self.left_out());
        notices.extend(self.without_receivers());
        notices
    }

    /// That materials keep what they had.
    fn unchanged(&self) -> Option<String> {
        let mut names = Vec::new();
        for (number, material) in self.adoption.ready.materials.iter().enumerate() {
            if self.recipients.iter().all(|recipient| recipient.number != number) {
                names.push(material.name.as_str());
            }
        }
        let is_notable = !self.adoption.report.effects.is_empty() && !names.is_empty();
        is_notable.then(|| {
            format!("as before, without a law or effects of their own: {}", names.join(", "))
        })
    }

    /// Every scene once, with its clouds.
    fn scenes(&self) -> Vec<DiagnosedScene<'_>> {
        let CheckedRequest { request, ready, scene_text, further, .. } = self.checked;
        let first = (&ready.scene, request.scene, scene_text);
        let others = further.iter().map(|one| (&one.ready.scene, &*one.path, &one.text));
        let mut scenes: Vec<DiagnosedScene> = Vec::new();
        for (cloud, (scene, path, text)) in (0..).zip([first].into_iter().chain(others)) {
            // A program may have scenes that differ from those of their files.
            let is_it = |known: &&mut DiagnosedScene| {
                real(known.path) == real(path) && known.text == text.as_str()
            };
            match scenes.iter_mut().find(is_it) {
                Some(known) => known.clouds.push(cloud),
                None => scenes.push(DiagnosedScene { scene, path, text, clouds: vec![cloud] }),
            }
        }
        scenes
    }

    /// The effects that a scene can declare: those on all of its clouds. A place on the target is that of the first scene.
    fn effects_of(&self, one: &DiagnosedScene) -> Vec<FoundEffect> {
        let is_first = one.clouds.contains(&0);
        let holds = |found: &&FoundEffect| {
            let acts = |cloud| found.scans.is_empty() || found.scans.contains(cloud);
            one.clouds.iter().all(acts) && (is_first || found.place.is_none())
        };
        self.adoption.report.effects.iter().filter(holds).cloned().collect()
    }

    fn scene_with(&self, one: &DiagnosedScene, materials: &[String]) -> SceneFile {
        let Report { clouds, base, .. } = self.adoption.report;
        let cloud = one.clouds.first().and_then(|cloud| clouds.get(usize::from(*cloud)));
        let level_db = cloud.map_or(base.level_db, |part| part.level_db).map(|level| level.value);
        scene_with_found(one.scene, &self.effects_of(one), level_db, materials)
    }

    /// The scenes with what was found, for the folder of the report.
    fn scenes_after(&self, materials: &[String], head: &str) -> Result<Vec<File>, Error> {
        let mut files = Vec::new();
        for one in self.scenes() {
            let file = self.scene_with(&one, materials);
            let file = relocate_files(file, one.path, self.checked.request.folder)?;
            let name = match one.clouds[0] {
                0 => AFTER.to_owned(),
                number => after_of(usize::from(number)),
            };
            files.push((name, one.text_with(head, &file)?));
        }
        Ok(files)
    }

    /// Effects that a scene cannot declare.
    fn left_out(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for one in self.scenes() {
            let declared = self.effects_of(&one);
            let is_here = |found: &&FoundEffect| {
                let acts = |cloud| found.scans.is_empty() || found.scans.contains(cloud);
                one.clouds.iter().any(acts) && !declared.contains(found)
            };
            let left: Vec<&str> =
                self.adoption.report.effects.iter().filter(is_here).map(|one| one.name).collect();
            if !left.is_empty() {
                notices.push(format!(
                    "the scene after {} lacks {}: not all clouds of the scene have it, or its place is that of the first \
                     scene",
                    one.path.display(),
                    listed(&left)
                ));
            }
        }
        notices
    }

    /// That scenes lose their other antennas, at which no effect of the radar's own echoes can be rendered.
    fn without_receivers(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for one in self.scenes().iter().filter(|one| !one.scene.file.receiver.is_empty()) {
            let found = self.effects_of(one);
            let names = of_own_echoes(&found);
            if !names.is_empty() {
                notices.push(format!(
                    "the scene after {} has no [[receiver]]: nothing says what {} does at another antenna",
                    one.path.display(),
                    listed(&names)
                ));
            }
        }
        notices
    }

    /// The command and the files that it was given.
    fn activity(&self) -> Result<Activity, Error> {
        let CheckedRequest { request, given, .. } = self.checked;
        let command = "diagnose";
        if given.is_empty() {
            return Ok(activity(command, &request.inputs())?);
        }
        Ok(Activity { command: command.to_owned(), inputs: given.clone(), origin: None })
    }

    /// Where the stored numbers come from: files of one name differ by what is in them.
    fn title(&self, activity: &Activity) -> String {
        let mut files = Vec::new();
        for input in &activity.inputs {
            let hash = input.hash.get(..12).unwrap_or_default();
            files.push(format!("{} (BLAKE3 {hash})", input.name));
        }
        format!("Diagnosis of {}, seed {}", files.join(" with "), self.checked.request.seed)
    }
}

impl DiagnosedScene<'_> {
    /// The text of the scene with what was found.
    fn text_with(&self, head: &str, file: &SceneFile) -> Result<Vec<u8>, Error> {
        let text = file.write(self.text).map_err(|error| {
            Error::usage(
                format!("{}: {error}", self.path.display()),
                "leave the scene as it is while it is diagnosed",
            )
        })?;
        Ok((head.to_owned() + &text).into_bytes())
    }
}

/// The program with its database, where that is not the usual one.
pub fn program(db: &Database) -> String {
    if db.path() == Path::new(USUAL_DATABASE) {
        "matdb".to_owned()
    } else {
        format!("matdb --db {}", shell_word(db.path()))
    }
}

/// A path without links and detours; that of a built-in scene, which is no file, as it is.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// The materials at these places with what adding them did.
fn at_places<'a>(
    materials: &'a [Material],
    added: &'a [Addition],
    places: &'a [usize],
) -> impl Iterator<Item = (&'a Material, Addition)> {
    places.iter().filter_map(|&place| Some((materials.get(place)?, *added.get(place)?)))
}

/// The first lines of a scene whose materials are in these files.
fn head(material_files: &[String]) -> String {
    if material_files.is_empty() {
        return "# The scene as `matdb diagnose` leaves it; it renders as it stands.\n".to_owned();
    }
    let mut froms = Vec::new();
    for name in material_files {
        froms.push(format!("--from {}", shell_word(name.as_ref())));
    }
    format!(
        "# The scene with what `matdb diagnose` found. To render it, add its materials first,\n\
         # from the folder of this file:\n# matdb add {}\n",
        froms.join(" ")
    )
}
