//! `matdb near`.

use std::path::PathBuf;

use super::cloud::ColumnArgs;
use super::console::Console;
use super::list::{FilterArgs, frequency};
use super::summary::table;
use crate::catalogue::{Distance, Rank};
use crate::error::Error;
use crate::files::read_small;
use crate::measure::Curve;
use crate::report::{Neighbour, NeighbourReport, NeighbourSearch};
use crate::setup::Database;
use crate::store::Store;
use crate::units::{range, shown};

/// Find the materials nearest to a measured curve
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb near --curve curve.csv --measured-at 300   a curve of 300 GHz
  matdb near --curve curve.csv --shape             without a calibrated level
  matdb near --material my-paint --frequency 300   among what holds at 300 GHz

The distance is the rms difference in dB between the curve's mean at each angle and what scenes render of \
a material, at common angles within that material's range. Where the curve is below the threshold, only a \
material above it differs. Materials with too few common angles are left out.")]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub(super) struct Args {
    /// A curve's CSV file, as `matdb measure` writes it
    #[arg(long, value_name = "FILE", group = "what")]
    curve: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnArgs,
    /// The longest curve of this material, NAME or NAME@REVISION
    #[arg(long, value_name = "NAME", group = "what")]
    material: Option<String>,
    /// Frequency at which the curve was measured [default: that of the material's instrument]
    #[arg(long, value_name = "GHZ", value_parser = frequency, allow_negative_numbers = true)]
    measured_at: Option<f64>,
    /// Rank by shape, for a curve of unknown level
    #[arg(long)]
    shape: bool,
    /// How many to show at most
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    limit: u32,
    #[command(flatten)]
    filter: FilterArgs,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let (search, notices) = search(args, store.as_ref())?;
    notices.iter().for_each(|notice| console.notice(notice));
    let rank = if args.shape { Rank::Shape } else { Rank::Level };
    if search.illumination.relative && !args.shape {
        return Err(Error::usage(
            "the levels of the curve are relative",
            "rank by shape (--shape)",
        ));
    }
    let report = search.run(store.as_ref(), &args.filter.filter(), rank, args.limit as usize)?;
    report.notices.iter().for_each(|notice| console.notice(notice));
    console.result(&text(&report, args), &report)
}

/// The curve that is asked about, and what a person should know of its file.
fn search(args: &Args, store: Option<&Store>) -> Result<(NeighbourSearch, Vec<String>), Error> {
    let frequency_hz = args.measured_at.map(|ghz| ghz * 1e9);
    let Some(path) = &args.curve else {
        let name = args.material.as_deref().unwrap_or_default();
        return Ok((NeighbourSearch::of_material(name, frequency_hz, store)?, Vec::new()));
    };
    let (curve, notices) = Curve::read_as(&read_small(path)?, &args.columns.names())
        .map_err(|error| Error::CurveFile { file: path.clone(), error })?;
    let Curve { observations, illumination } = curve;
    Ok((NeighbourSearch { observations, illumination, frequency_hz, own: None }, notices))
}

fn text(record: &NeighbourReport, args: &Args) -> String {
    let mut text = match record.materials.as_slice() {
        [] if record.left_out == 0 => {
            return "no material meets the conditions; leave one of them out\n".to_owned();
        }
        [] => "no material has enough angles in common with the curve\n".to_owned(),
        found => table(
            &[
                "material",
                "rev",
                "kind",
                "GHz",
                "rms dB",
                "shape dB",
                "offset dB",
                "angles",
                "notes",
            ],
            found.iter().map(|near| row(near, record)),
        ),
    };
    let by = if args.shape { "shape, its level left open" } else { "level and shape" };
    text += &format!("ranked by {by}, at {} angles of the curve\n", record.angles);
    text += &match record.measured_at_ghz {
        Some(ghz) => format!("the curve is of {} GHz\n", shown(ghz)),
        None => {
            "the frequency of the curve is not stated: give it by --measured-at GHZ\n".to_owned()
        }
    };
    text += &match record.noise_db {
        Some(noise) => format!("its repeats scatter: chance alone makes {noise:.1} dB\n"),
        None => "without repeats at an angle the share of chance is not known\n".to_owned(),
    };
    if record.left_out > 0 {
        text += &format!("left out for too little in common: {}\n", record.left_out);
    }
    text
}

fn row(near: &Neighbour, record: &NeighbourReport) -> [String; 9] {
    let angles = record.angles;
    let Distance { rms_db, rms_shape_db, offset_db, common_angles, above_bound, silent, .. } =
        near.distance;
    let mut notes = Vec::new();
    if let Some(outside_ghz) = near.frequency_outside_ghz.filter(|ghz| *ghz > 0.0) {
        notes.push(format!("{} GHz outside its range", shown(outside_ghz)));
    }
    if above_bound > 0 {
        notes.push(format!("above the threshold at {above_bound}"));
    }
    if silent > 0 {
        notes.push(format!("no echo at {silent}: at least so far"));
    }
    if let (Some(own), Some(theirs)) = (record.footprint, near.footprint)
        && own != theirs
    {
        notes.push(format!("converted to footprint {}", own.as_str()));
    }
    if near.is_relative {
        notes.push("its level is relative: only its shape counts".to_owned());
    }
    if near.status != "active" {
        notes.push(near.status.clone());
    }
    [
        near.slug.to_string(),
        near.revision.map_or("built in".to_owned(), |revision| revision.to_string()),
        near.kind_words.clone().unwrap_or_else(|| near.kind.to_owned()),
        range(near.frequency_ghz),
        format!("{rms_db:.1}"),
        format!("{rms_shape_db:.1}"),
        format!("{offset_db:+.1}"),
        format!("{common_angles} of {angles}"),
        notes.join("; "),
    ]
}
