//! Everything that a diagnosis leaves behind: the report, the scene with what was found, and, with
//! `--add`, revisions of materials; all of it or nothing.

use std::path::Path;

use super::earlier::Earlier;
use super::words::listed;
use super::{Asked, Context, Record, html, json, plots, residuals, text, typed};
use crate::adopt::{
    AFTER, Adoption, MARK, Recipient, activity, name_beside, pinned_name, relocate_files,
    replaced_name, scene_with_found,
};
use crate::cli::console::Console;
use crate::diagnose::LEAST_SHOTS;
use crate::effects::Level;
use crate::error::Error;
use crate::files::{Placement, folder_of, write_all};
use crate::formats::FormatError;
use crate::material::{Activity, Input, file};
use crate::setup::Database;

/// First line of a material's file.
const FOUND: &str = "# A material with what `matdb diagnose` found in it.\n";

type Files = Vec<(String, Vec<u8>)>;

/// Name of the file of a material that a scene names so.
pub(super) fn material_file(name: &str) -> String {
    format!("material-{}.toml", name.replace('@', "-"))
}

/// A diagnosis on its way out.
pub(super) struct Publication<'a> {
    pub asked: Asked<'a>,
    /// Text of the scene file.
    pub given: &'a str,
    pub adoption: Adoption<'a>,
}

impl Publication<'_> {
    /// Writes everything and says what matters.
    pub fn publish(
        &self,
        mut context: Context,
        db: &Database,
        console: &Console,
    ) -> Result<(), Error> {
        let spot_m = self.adoption.ready.scene.radar().spot_diameter_m;
        let (pictures, notices) = plots::pictures(self.adoption.report, spot_m);
        context.places = plots::strongest(&self.adoption.report.rows, spot_m);
        let takers = self.adoption.recipients();
        let is_stored = self.asked.args.add && !self.adoption.report.effects.is_empty();
        let not_tried = context.not_tried.clone();
        let record = Record { report: self.adoption.report, not_tried: &not_tried };
        let mut files: Files = vec![
            ("report.json".to_owned(), json(&record)?),
            ("residuals.csv".to_owned(), residuals::csv(&self.adoption.report.rows)),
        ];
        for picture in &pictures {
            files.extend(picture.files()?);
        }
        let homeless = self.homeless(&takers);
        context.is_added = is_stored && homeless.len() < self.adoption.report.effects.len();
        let page = |context: &Context| html::report(self.adoption.report, context, &pictures);
        let earlier = Earlier::in_folder(&self.asked.args.output, &self.asked.read());
        if is_stored {
            self.add(&takers, &mut files, &mut context, &page, db)?;
        } else {
            let (more, names) = self.alone(&takers)?;
            context.material_files = more.iter().map(|(name, _)| name.clone()).collect();
            files.extend(more);
            files.push((AFTER.to_owned(), self.after(&names, &head(&context))?));
            files.push(("report.html".to_owned(), page(&context)?));
            match self.asked.args.add {
                true => self.add_tried(&files, &mut context, db)?,
                false => write_all(&self.asked.args.output, &files)?,
            }
        }
        earlier.remove_all_but(&files, console);
        notices.iter().for_each(|notice| console.notice(notice));
        if !self.adoption.report.base.converged {
            console.notice("the final fit did not converge: take the numbers with care");
        }
        if !homeless.is_empty() {
            console.notice(&format!(
                "kept in the report alone, as no material has the {LEAST_SHOTS} chirps on the target that take {}: {}",
                if homeless.len() == 1 { "it" } else { "them" },
                listed(&homeless)
            ));
        }
        self.left_out(&takers).iter().for_each(|notice| console.notice(notice));
        files.sort_by_key(|(name, _)| name != "report.html");
        let names: Vec<String> = files.into_iter().map(|(name, _)| name).collect();
        let said =
            text::text(self.adoption.report, &context.places, &names, &self.asked.args.output);
        console.result(&(said + &self.stored(&context, &homeless, db)), &record)
    }

    /// Stores what was found in the database and beside the scene, and writes the report.
    fn add(
        &self,
        takers: &[Recipient],
        files: &mut Files,
        context: &mut Context,
        page: &dyn Fn(&Context) -> Result<Vec<u8>, Error>,
        db: &Database,
    ) -> Result<(), Error> {
        let mut store = db.write()?;
        let activity = self.activity()?;
        let title = self.title(&activity);
        let (mut materials, mut last) = (Vec::new(), Vec::new());
        for taker in takers {
            materials.extend(self.adoption.revise(taker, &title, &store)?);
            last.push(materials.len() - 1);
        }
        let scene = self.asked.scene;
        store.record(activity);
        let written = store.add_if(&materials, |added| {
            let stored =
                || last.iter().filter_map(|&at| Some((materials.get(at)?, *added.get(at)?)));
            context.added =
                stored().map(|(material, added)| pinned_name(material, added)).collect();
            context.replaced =
                stored().filter_map(|(material, added)| replaced_name(material, added)).collect();
            let names = self.adoption.region_names(takers, &context.added);
            files.push((AFTER.to_owned(), self.after(&names, MARK)?));
            files.push(("report.html".to_owned(), page(context)?));
            let file =
                scene_with_found(&self.adoption.ready.scene, &self.adoption.report.effects, &names);
            let beside = [(name_beside(scene), self.text(MARK, &file)?)];
            let folder = folder_of(scene);
            Placement::new(&[(&self.asked.args.output, files), (folder, &beside)])
                .map_err(Error::from)
        })?;
        written.keep();
        Ok(())
    }

    /// Stores what was tried and not found, and writes the files.
    fn add_tried(&self, files: &Files, context: &mut Context, db: &Database) -> Result<(), Error> {
        let mut store = db.write()?;
        let activity = self.activity()?;
        let title = self.title(&activity);
        let (materials, last) = self.adoption.record_not_found(&title, &store)?;
        store.record(activity);
        let written = store.add_if(&materials, |added| {
            let pin = |&at: &usize| Some(pinned_name(materials.get(at)?, *added.get(at)?));
            context.added = last.iter().filter_map(pin).collect();
            Placement::new(&[(&self.asked.args.output, files)]).map_err(Error::from)
        })?;
        written.keep();
        Ok(())
    }

    /// The files of materials that are not stored, and the materials of the regions with them.
    fn alone(&self, takers: &[Recipient]) -> Result<(Files, Vec<String>), Error> {
        let (mut files, mut slugs) = (Vec::new(), Vec::new());
        for taker in takers {
            let title = self.title(&self.activity()?);
            let material = self.adoption.make_material(taker, &title)?;
            let name = material_file(&self.adoption.ready.materials[taker.number].name);
            files.push((name, (FOUND.to_owned() + &file::write(&material)?).into_bytes()));
            slugs.push(material.slug.to_string());
        }
        Ok((files, self.adoption.region_names(takers, &slugs)))
    }

    /// The scene with what was found, to stand beside the report.
    fn after(&self, materials: &[String], head: &str) -> Result<Vec<u8>, Error> {
        let file =
            scene_with_found(&self.adoption.ready.scene, &self.adoption.report.effects, materials);
        self.text(head, &relocate_files(file, self.asked.scene, &self.asked.args.output)?)
    }

    fn text(&self, head: &str, file: &crate::scene::SceneFile) -> Result<Vec<u8>, Error> {
        let unwritable = |error: FormatError| Error::Usage {
            problem: format!("{}: {error}", self.asked.scene.display()),
            way_out: "leave the scene as it is while it is diagnosed".to_owned(),
        };
        Ok((head.to_owned() + &file.write(self.given).map_err(unwritable)?).into_bytes())
    }

    /// The command and the files that it was given.
    fn activity(&self) -> Result<Activity, Error> {
        Ok(activity("diagnose", &self.asked.read())?)
    }

    /// Where the stored numbers come from: files of one name differ by what is in them.
    fn title(&self, activity: &Activity) -> String {
        let file = |input: &Input| {
            format!("{} (BLAKE3 {})", input.name, input.hash.get(..12).unwrap_or_default())
        };
        let files: Vec<String> = activity.inputs.iter().map(file).collect();
        format!("Diagnosis of {}, seed {}", files.join(" with "), self.asked.args.seed)
    }

    /// Sentences on materials that keep what they had.
    fn left_out(&self, takers: &[Recipient]) -> Option<String> {
        let stays = |number: &usize| takers.iter().all(|taker| taker.number != *number);
        let materials = &self.adoption.ready.materials;
        let names: Vec<&str> = (0..materials.len())
            .filter(stays)
            .map(|number| materials[number].name.as_str())
            .collect();
        let is_told = !self.adoption.report.effects.is_empty() && !names.is_empty();
        is_told.then(|| {
            format!("as before, without a law or effects of their own: {}", names.join(", "))
        })
    }

    /// Effects of a material that none takes in.
    fn homeless(&self, takers: &[Recipient]) -> Vec<&'static str> {
        let of_material =
            self.adoption.report.effects.iter().filter(|found| found.level == Level::Material);
        of_material.filter(|_| takers.is_empty()).map(|found| found.name).collect()
    }

    /// A line on what was stored.
    fn stored(&self, context: &Context, homeless: &[&str], db: &Database) -> String {
        match (self.asked.args.add, self.adoption.report.effects.is_empty()) {
            (false, _) => String::new(),
            (true, true) => match context.added.join(", ") {
                none if none.is_empty() => {
                    "nothing was found, on too few looks to be stored\n".to_owned()
                }
                names => format!(
                    "stored in {names} of {} what was tried and not found; they scatter as before\n",
                    db.path().display()
                ),
            },
            (true, false) => {
                let scene = &context.beside;
                let file = db.path().display();
                match context.added.join(", ") {
                    none if none.is_empty()
                        && homeless.len() == self.adoption.report.effects.len() =>
                    {
                        format!("nothing could be stored; {scene} is as the scene was\n")
                    }
                    none if none.is_empty() => match homeless {
                        [] => format!("stored what was found in {scene}\n"),
                        some => format!("stored what was found but {} in {scene}\n", listed(some)),
                    },
                    names => format!(
                        "stored {names} in {file}; {scene} renders what was found\n{}",
                        elsewhere(&context.replaced)
                    ),
                }
            }
        }
    }
}

/// What becomes of other scenes with materials whose revision is no longer the current one.
fn elsewhere(replaced: &[String]) -> String {
    let old: Vec<&str> = replaced.iter().map(String::as_str).collect();
    let bare: Vec<&str> = old.iter().filter_map(|name| name.split('@').next()).collect();
    match old.is_empty() {
        true => String::new(),
        false => format!(
            "scenes that name {} without a revision take the new one from now on; what they had is {}\n",
            listed(&bare),
            listed(&old)
        ),
    }
}

/// The first lines of a scene whose materials are not stored.
fn head(context: &Context) -> String {
    match context.material_files.as_slice() {
        [] => "# The scene as `matdb diagnose` leaves it; it renders as it stands.\n".to_owned(),
        files => {
            let froms: Vec<String> =
                files.iter().map(|file| format!("--from {}", typed(Path::new(file)))).collect();
            format!(
                "# The scene with what `matdb diagnose` found. To render it, add its materials first,\n\
                 # from the folder of this file:\n# matdb add {}\n",
                froms.join(" ")
            )
        }
    }
}
