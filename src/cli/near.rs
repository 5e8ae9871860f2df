//! `matdb near`.

use std::path::PathBuf;

use serde::Serialize;

use super::console::Console;
use super::list::{Wanted, frequency};
use super::summary::table;
use crate::catalogue::{Distance, Nearest, Probe, Rank};
use crate::error::Error;
use crate::files::read_small;
use crate::material::{Observation, Slug};
use crate::measure::Curve;
use crate::setup::Database;
use crate::setup::{MaterialRevision, find_material, store_of_not_added};
use crate::store::Store;
use crate::units::{range, rounded, shown};

/// Find the known materials that a measured curve is nearest to
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb near --curve curve.csv --measured-at 300   and how far from 300 GHz materials are described
  matdb near --curve curve.csv --shape             the level of the curve is not known
  matdb near --material my-paint --frequency 300   among what holds at 300 GHz

The distance is the root mean square difference in dB between the curve's mean at each angle and what
scenes render of a material, at angles within that material's range. Below the threshold only a
material that lies above it differs. Materials with fewer than 3 angles with an echo, or half of the
curve's angles, in common are left out. Of a material that is not described at the frequency of the
curve the notes say how far away that is; the distance does not count it.")]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub(super) struct Args {
    /// A curve, as `matdb measure` writes it: theta_deg and sigma0_db, others if there are
    #[arg(long, value_name = "FILE", group = "what")]
    curve: Option<PathBuf>,
    /// The longest curve of this material, NAME or NAME@REVISION
    #[arg(long, value_name = "NAME", group = "what")]
    material: Option<String>,
    /// Frequency at which the curve was measured [default: that of the material's instrument]
    #[arg(long, value_name = "GHZ", value_parser = frequency, allow_negative_numbers = true)]
    measured_at: Option<f64>,
    /// Rank by shape: the level of the curve is not known
    #[arg(long)]
    shape: bool,
    /// How many to show at most
    #[arg(long, default_value_t = 10, value_name = "N")]
    limit: usize,
    #[command(flatten)]
    filter: Wanted,
}

/// A material and how far it is.
#[derive(Serialize)]
struct Near {
    slug: Slug,
    name: String,
    /// None for a built-in one that is not in the database.
    revision: Option<u32>,
    /// Of the data behind what scenes render.
    kind: &'static str,
    /// Of a model that goes with a curve, which nobody measured itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind_words: Option<String>,
    status: String,
    /// For which its numbers are claimed.
    frequency_ghz: [f64; 2],
    /// How far the curve's frequency lies outside of these, 0 within; none where nobody says it.
    frequency_outside_ghz: Option<f64>,
    #[serde(flatten)]
    distance: Distance,
}

#[derive(Serialize)]
struct Record {
    /// At which the curve was measured; none where nobody says.
    measured_at_ghz: Option<f64>,
    angles: usize,
    /// What chance alone makes of the distance to the true material, dB.
    noise_db: Option<f64>,
    /// Number of materials with too little in common.
    left_out: usize,
    materials: Vec<Near>,
}

/// The curve that is asked about.
struct Asked {
    observations: Vec<Observation>,
    frequency_hz: Option<f64>,
    /// The material that the curve is of, if its current revision.
    own: Option<Slug>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let asked = asked(args, store.as_ref())?;
    let Some(probe) = Probe::new(&asked.observations) else {
        return Err(Error::Usage {
            problem: "the curve has no backscatter that was detected, or a point above the \
                      instrument's range"
                .to_owned(),
            way_out: "give a curve with detections below that range".to_owned(),
        });
    };
    let missing = store_of_not_added(store.as_ref())?;
    let mut record = Record {
        measured_at_ghz: asked.frequency_hz.map(|hz| rounded(hz / 1e9)),
        angles: probe.angles(),
        noise_db: probe.noise_db(),
        left_out: 0,
        materials: Vec::new(),
    };
    let rank = if args.shape { Rank::Shape } else { Rank::Level };
    for (store, is_stored) in [(store.as_ref(), true), (Some(&missing), false)] {
        let Some(store) = store else { continue };
        let Nearest { found, left_out } =
            probe.nearest(store, &args.filter.filter(), rank, args.limit.saturating_add(1))?;
        record.left_out += left_out;
        // That a material is nearest to itself tells nobody anything.
        for (slug, distance) in
            found.into_iter().filter(|(slug, _)| asked.own.as_ref() != Some(slug))
        {
            record.materials.extend(near(store, &slug, &asked, is_stored, distance)?);
        }
    }
    let far = |near: &Near| near.distance.rank_db(rank);
    record.materials.sort_by(|a, b| far(a).total_cmp(&far(b)).then_with(|| a.slug.cmp(&b.slug)));
    record.materials.truncate(args.limit);
    console.result(&text(&record, args), &record)
}

fn near(
    store: &Store,
    slug: &Slug,
    asked: &Asked,
    is_stored: bool,
    distance: Distance,
) -> Result<Option<Near>, Error> {
    let (Some(summary), Some(stored)) = (store.summary(slug)?, store.get(slug, None)?) else {
        return Ok(None);
    };
    let material = stored.material;
    let outside_ghz = |hz| rounded(material.frequency_outside_hz(hz) / 1e9);
    Ok(Some(Near {
        slug: summary.slug,
        name: summary.name,
        revision: is_stored.then_some(summary.revision),
        kind: summary.render_kind.as_str(),
        kind_words: material.rendered_words(),
        status: summary.status,
        frequency_ghz: material.frequency_hz.map(|hz| rounded(hz / 1e9)),
        frequency_outside_ghz: asked.frequency_hz.map(outside_ghz),
        distance,
    }))
}

fn asked(args: &Args, store: Option<&Store>) -> Result<Asked, Error> {
    let stated_hz = args.measured_at.map(|ghz| ghz * 1e9);
    if let Some(path) = &args.curve {
        let bytes = read_small(path)?;
        let refused = |error| Error::CurveFile { file: path.clone(), error };
        let observations = Curve::read(&bytes).map_err(refused)?.observations;
        return Ok(Asked { observations, frequency_hz: stated_hz, own: None });
    }
    let name = args.material.as_deref().unwrap_or_default();
    let MaterialRevision { material, revision } = find_material(store, name, "")?;
    let current = store.map(|store| store.summary(&material.slug)).transpose()?.flatten();
    let is_current = current.map(|current| current.revision) == revision;
    let longest = material.curves.into_iter().rev().max_by_key(|curve| curve.observations.len());
    let Some(curve) = longest else {
        return Err(Error::Usage {
            problem: format!("`{name}` has no curve"),
            way_out: "give one with --curve FILE".to_owned(),
        });
    };
    let its_own = |key: &String| material.instruments.iter().find(|own| own.key == *key);
    let instrument = curve.instrument.as_ref().and_then(its_own);
    let frequency_hz = stated_hz.or(instrument.map(|own| own.centre_frequency_hz));
    Ok(Asked {
        observations: curve.observations,
        frequency_hz,
        own: is_current.then_some(material.slug),
    })
}

fn text(record: &Record, args: &Args) -> String {
    let mut text = match record.materials.as_slice() {
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
            found.iter().map(|near| row(near, record.angles)),
        ),
    };
    let by = if args.shape { "shape, its level left open" } else { "level and shape" };
    text += &format!("ranked by {by}, at {} angles of the curve\n", record.angles);
    text += &match record.measured_at_ghz {
        Some(ghz) => format!("the curve is of {} GHz\n", shown(ghz)),
        None => "nobody says at which frequency the curve was measured: --measured-at GHZ does\n"
            .to_owned(),
    };
    text += &match record.noise_db {
        Some(noise) => format!("its repeats scatter: chance alone makes {noise:.1} dB\n"),
        None => "without repeats at an angle nobody knows what chance makes of it\n".to_owned(),
    };
    if record.left_out > 0 {
        text += &format!("left out for too little in common: {}\n", record.left_out);
    }
    text
}

fn row(near: &Near, angles: usize) -> [String; 9] {
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
