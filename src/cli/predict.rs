//! `matdb predict`.

use std::path::PathBuf;

use super::console::Console;
use super::summary::table;
use crate::error::Error;
use crate::files::{folder_of, write_all};
use crate::report::{PredictedLevel, Prediction, angles_deg, drawn_words};
use crate::setup::{Database, MaterialRevision, find_material, later_status_warning};
use crate::units::{range, shown};

/// Predict what a material returns at stated angles, with the 95 % band of its fit
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb predict mannequin-paint --angles 0:80:5
  matdb predict my-paint@2 --angles 10,20,30 -o levels.csv

The band holds the uncertainty of the fitted numbers, not that of the form of the law. Angles outside \
those that the material is described for are marked.")]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    material: String,
    /// FIRST:LAST:STEP or a list, degrees from 0 to below 90
    #[arg(long, value_name = "ANGLES", value_parser = Angles::parse, allow_hyphen_values = true)]
    angles: Angles,
    /// Write the levels as CSV, too
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Angles of incidence, °. A type of its own, since clap reads a list as several values.
#[derive(Clone, Debug)]
struct Angles(Vec<f64>);

impl Angles {
    fn parse(text: &str) -> Result<Angles, String> {
        angles_deg(text).map(Angles)
    }
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let MaterialRevision { material, revision } =
        find_material(store.as_ref(), &args.material, "")?;
    let later = later_status_warning(store.as_ref(), &material.slug, revision)?;
    let notices = [later, material.relative_words(), drawn_words(&material)?];
    notices.iter().flatten().for_each(|notice| console.notice(notice));
    let prediction = Prediction::new(&material, revision, &args.angles.0)?;
    let mut text = text(&prediction);
    if let Some(path) = &args.output {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        write_all(folder_of(path), &[(&name, csv(&prediction).into_bytes())])?;
        text += &format!("wrote {}\n", path.display());
    }
    console.result(&text, &prediction)
}

fn text(prediction: &Prediction) -> String {
    let Prediction { material, law, kind, frequency_ghz, no_band, levels, .. } = prediction;
    let rows = levels.iter().map(row);
    let mut text = table(&["incidence", "sigma0 dB", "95 % band", ""], rows);
    text += &format!("{material}, {law}: {kind}, {} GHz\n", range(*frequency_ghz));
    if let Some(reason) = no_band {
        text += &format!("no band: {reason}\n");
    }
    text
}

fn row(level: &PredictedLevel) -> [String; 4] {
    let PredictedLevel { theta_deg, sigma0_db, below_db, band_db, outside_deg } = *level;
    let sigma0 = match (sigma0_db, below_db) {
        (Some(db), _) => format!("{db:.2}"),
        (None, Some(db)) => format!("< {db:.2}"),
        (None, None) => "nothing".to_owned(),
    };
    let band = band_db.map_or(String::new(), |[low, high]| format!("{low:.2} to {high:.2}"));
    let outside = match outside_deg {
        0.0 => String::new(),
        outside => format!("{}° outside the range", shown(outside)),
    };
    [format!("{}°", shown(theta_deg)), sigma0, band, outside]
}

/// The levels as CSV.
fn csv(prediction: &Prediction) -> String {
    let mut text = "theta_deg,sigma0_db,below_db,low_db,high_db,outside_deg\n".to_owned();
    for level in &prediction.levels {
        let [low, high] = [0, 1].map(|end| cell(level.band_db.map(|band| band[end])));
        let (sigma0, below) = (cell(level.sigma0_db), cell(level.below_db));
        let (theta_deg, outside_deg) = (level.theta_deg, level.outside_deg);
        text += &format!("{theta_deg},{sigma0},{below},{low},{high},{outside_deg}\n");
    }
    text
}

fn cell(number: Option<f64>) -> String {
    number.map_or(String::new(), |db| format!("{db:.4}"))
}
