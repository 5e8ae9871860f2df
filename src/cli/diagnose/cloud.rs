//! `matdb diagnose CLOUD --scene SCENE`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::args::Args;
use super::refusal::write_refusal;
use crate::adopt::{
    CheckedRequest, CloudRequest, Earlier, Publication, PublicationResult, as_answer, name_beside,
    program, scene_of_each,
};
use crate::cli::cloud::{CloudArgs, ColumnArgs};
use crate::cli::console::Console;
use crate::cli::effects::chosen;
use crate::diagnose::{DiagnoseError, Report};
use crate::error::Error;
use crate::files::{FilesError, Placement, WayOut, write_all};
use crate::formats::words::listed;
use crate::report::{CannotTell, shell_word};
use crate::setup::Database;

/// The folder of a scene, and the files for it.
type Beside<'a> = (&'a Path, Vec<(String, Vec<u8>)>);

/// Diagnoses a cloud, or several of one target together, and writes the answer.
pub(super) fn run(
    cloud: &CloudArgs,
    args: &Args,
    db: &Database,
    console: &Console,
) -> Result<(), Error> {
    let scenes: Vec<&Path> = args.scene.iter().map(PathBuf::as_path).collect();
    let scenes = scene_of_each(&scenes, 1 + args.further.len())?;
    let further = args.further.iter().map(|path| path.as_path());
    let further: Vec<(&Path, &Path)> = further.zip(scenes.iter().skip(1).copied()).collect();
    let effects = if args.effects.is_empty() { Vec::new() } else { chosen(&args.effects)? };
    let request = CloudRequest {
        cloud: &cloud.cloud,
        scene: scenes[0],
        further: &further,
        receiver: args.receiver.as_deref(),
        effects: &effects,
        own_effects: &[],
        material: args.material.as_deref(),
        seed: args.seed,
        controls: !args.no_controls,
        folder: &args.output,
        add: args.add,
    };
    let checked = match request.check(db.read()?.as_ref()) {
        Ok(checked) => checked,
        Err(error) => return refuse(as_answer(error)?, &request, console),
    };
    let notices = checked.notices();
    match diagnose(cloud, &args.columns, &checked, &notices, console) {
        Ok(report) => publish(&checked, &report, &notices, db, console),
        Err(error) => refuse(as_answer(error)?, &request, console),
    }
}

/// Reads the clouds and diagnoses them, with a sign of life.
fn diagnose(
    cloud: &CloudArgs,
    columns: &ColumnArgs,
    checked: &CheckedRequest,
    notices: &[String],
    console: &Console,
) -> Result<Report, Error> {
    for notice in checked.choice.notices() {
        console.notice(&notice);
    }
    let clouds = checked.read_clouds(|path, radar| cloud.read_another(path, columns, radar))?;
    for notice in clouds.iter().flat_map(|cloud| &cloud.notices).chain(notices) {
        console.notice(notice);
    }
    let activity = console.activity("diagnosing");
    let report = checked.diagnose(&clouds, &|step| activity.now(step));
    activity.end();
    Ok(report?)
}

/// Writes everything, stores it if that was asked for, and says what matters.
fn publish(
    checked: &CheckedRequest,
    report: &Report,
    notices: &[String],
    db: &Database,
    console: &Console,
) -> Result<(), Error> {
    let request = &checked.request;
    let command = command(db, std::env::args_os().skip(1).collect());
    let publication = Publication::new(checked, report, notices, [program(db), command]);
    let earlier = Earlier::in_folder(request.folder, &request.inputs());
    let contradiction = publication.report().contradiction();
    let is_stored = request.add && contradiction.is_none();
    let published =
        if is_stored { store(&publication, request, db) } else { write(&publication, request) };
    let published = published.map_err(|error| keep_answer(&publication, request, error))?;
    for notice in earlier.remove_all_but(&published.files) {
        console.notice(&notice);
    }
    for notice in publication.notices() {
        console.notice(&notice);
    }
    let names: Vec<String> = published.files.iter().map(|(name, _)| name.clone()).collect();
    let mut text = publication.report().text(&names, request.folder);
    if is_stored {
        text += &stored(&publication, &published, request, db.path());
    }
    console.result(&text, &publication.report().record())?;
    match contradiction {
        Some(sentence) => Err(DiagnoseError::Contradiction { sentence }.into()),
        None => Ok(()),
    }
}

/// Writes the report of a diagnosis.
fn write(publication: &Publication, request: &CloudRequest) -> Result<PublicationResult, Error> {
    let files = publication.files()?;
    write_all(request.folder, &files)?;
    Ok(PublicationResult { files, ..PublicationResult::default() })
}

/// Writes the report of a diagnosis, and stores what was found.
fn store(
    publication: &Publication,
    request: &CloudRequest,
    db: &Database,
) -> Result<PublicationResult, Error> {
    let mut store = db.write()?;
    let (published, written) = publication.store(&mut store, |files, beside| {
        let mut folders = vec![(request.folder, files)];
        folders.extend(beside.iter().map(|(folder, files)| (*folder, &files[..])));
        Placement::new(&folders).map_err(|error| beside.iter().fold(error, of_scene).into())
    })?;
    written.keep();
    Ok(published)
}

/// Writes as much of an answer as can be written that could not be stored or drawn.
fn keep_answer(publication: &Publication, request: &CloudRequest, error: Error) -> Error {
    let is_kept = |files: Vec<(String, Vec<u8>)>| write_all(request.folder, &files).is_ok();
    if publication.files().is_ok_and(is_kept) || publication.report().tables().is_ok_and(is_kept) {
        let report = request.folder.join("report.json");
        return Error::Unstored { error: Box::new(error), report };
    }
    error
}

/// The error of a file; one next to the scene is not in the folder that a person can choose.
fn of_scene(error: FilesError, (folder, files): &Beside) -> FilesError {
    let is_beside = files.iter().any(|(name, _)| error.path == folder.join(name));
    match error.way_out {
        WayOut::OtherFolder if is_beside || error.path == *folder => FilesError {
            way_out: WayOut::Words("make room there, or diagnose a copy of the scene elsewhere"),
            ..error
        },
        _ => error,
    }
}

/// Writes why nothing can be said; the error is the way out.
fn refuse(error: DiagnoseError, request: &CloudRequest, console: &Console) -> Result<(), Error> {
    let answer = CannotTell::of_cloud(&error);
    let names: Vec<String> =
        request.inputs().iter().map(|path| path.display().to_string()).collect();
    let subject = names.join(" with ");
    write_refusal(&answer, &subject, request.folder, &request.inputs(), console)?;
    Err(error.into())
}

/// A line on what was stored.
fn stored(
    publication: &Publication,
    published: &PublicationResult,
    request: &CloudRequest,
    db: &Path,
) -> String {
    let (db, materials) = (db.display(), published.stored.join(", "));
    let found = publication.report().record().report.effects.len();
    if found == 0 && materials.is_empty() {
        return "nothing was found, on too few chirps to be stored\n".to_owned();
    }
    if found == 0 {
        return format!(
            "stored in {materials} of {db} what was tried and not found; they scatter as before\n"
        );
    }
    let scene = shell_word(&request.scene.with_file_name(name_beside(request.scene)));
    let unstored = publication.unstored();
    if !materials.is_empty() {
        let others = other_scenes(&published.replaced);
        format!("stored {materials} in {db}; {scene} renders what was found\n{others}")
    } else if unstored.len() == found {
        format!("nothing could be stored; {scene} is as the scene was\n")
    } else if unstored.is_empty() {
        format!("stored what was found in {scene}\n")
    } else {
        format!("stored what was found but {} in {scene}\n", listed(&unstored))
    }
}

/// What changes for other scenes with materials whose revision is no longer the current one.
fn other_scenes(replaced: &[String]) -> String {
    if replaced.is_empty() {
        return String::new();
    }
    let names: Vec<&str> = replaced.iter().filter_map(|name| name.split('@').next()).collect();
    format!(
        "scenes that name {} without a revision take the new one from now on; what they had is {}\n",
        listed(&names),
        listed(replaced)
    )
}

/// The program with these arguments, as a shell takes it, and with its database, which a variable may have named.
fn command(db: &Database, arguments: Vec<OsString>) -> String {
    let is_named = arguments.iter().any(|one| one.to_string_lossy().starts_with("--db"));
    let mut command = if is_named { "matdb".to_owned() } else { program(db) };
    for argument in arguments {
        command += " ";
        command += &shell_word(Path::new(&argument));
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_can_be_typed_again() {
        let db = Database::new(Some(Path::new("a.sqlite")));
        let typed_again =
            |arguments: &[&str]| command(&db, arguments.iter().map(Into::into).collect());
        assert_eq!(typed_again(&["a b", "-o"]), "matdb --db a.sqlite 'a b' -o");
        assert_eq!(typed_again(&["--db=a.sqlite", "x"]), "matdb --db=a.sqlite x");
    }
}
