//! `matdb publish`.

use std::io;
use std::path::{Path, PathBuf};

use super::console::Console;
use super::summary::counted;
use crate::adopt::publish;
use crate::catalogue::About;
use crate::error::Error;
use crate::files::{FilesError, WayOut, read_small};
use crate::setup::Database;

/// Publish the database as a catalogue: a static site and open formats
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb publish site                           every material of the database
  matdb publish site --about about.toml        with your title, names, licence and address

Fits of current revisions are made again: nothing is published that `matdb verify` would refuse.")]
pub(super) struct Args {
    /// Folder to write; an earlier publication there is replaced
    folder: PathBuf,
    /// TOML file about the catalogue: title, licence, people [default: those of the publication there,
    /// and the licence that all materials share]
    #[arg(long, value_name = "FILE")]
    about: Option<PathBuf>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let about = match &args.about {
        Some(path) => about(path)?,
        None => About::of_publication(&args.folder).unwrap_or_default(),
    };
    let Some(store) = db.read()? else {
        return Err(Error::usage(
            format!("there is no database {}", db.path().display()),
            "`matdb add --all` makes one of the built-in materials",
        ));
    };
    let published = publish(&store, &about, &args.folder, |_| ())?;
    if args.about.is_none() && about != About::default() {
        console.notice(&format!(
            "title, people, licence and the like are those of the publication there, `{}`; --about FILE \
             gives others",
            about.title
        ));
    }
    published.notices(&about).iter().for_each(|notice| console.notice(notice));
    let text = format!(
        "published {} in {}: {}\n",
        counted(published.materials, "material"),
        counted(published.files, "file"),
        args.folder.display()
    );
    console.result(&text, &published)
}

fn about(path: &Path) -> Result<About, Error> {
    let text = read_small(path).and_then(|bytes| {
        String::from_utf8(bytes)
            .map_err(|error| FilesError::unreadable(path, io::Error::other(error.utf8_error())))
    });
    let text = text.map_err(|error| FilesError {
        way_out: WayOut::Words("check the path of --about"),
        ..error
    })?;
    Ok(About::parse(&path.display().to_string(), &text)?)
}
