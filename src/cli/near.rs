//! `matdb near`.

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;

use super::console::Console;
use super::database::Database;
use super::list::Wanted;
use super::materials::{find, not_added};
use super::summary::table;
use crate::brdf::Brdf;
use crate::catalogue::{Distance, Probe};
use crate::error::Error;
use crate::material::{Observation, Slug};
use crate::measure::Curve;
use crate::store::{Store, Summary};

/// Find the known materials that a measured curve is nearest to
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb near --curve measured/curve.csv
  matdb near --curve curve.csv --shape             the level of the curve is not known
  matdb near --material my-paint --frequency 300   among what holds at 300 GHz

The distance is the root mean square difference in dB between the curve's mean at each angle and what
scenes render of a material, at angles within that material's range. Below the threshold only a
material that lies above it differs. Materials with fewer than 3 angles, or half of the curve's, in
common are left out.")]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub(super) struct Args {
    /// A curve, as `matdb measure` writes it: theta_deg and sigma0_db, others if there are
    #[arg(long, value_name = "FILE", group = "what")]
    curve: Option<PathBuf>,
    /// The longest curve of this material, NAME or NAME@REVISION
    #[arg(long, value_name = "NAME", group = "what")]
    material: Option<String>,
    /// Rank by shape: the level of the curve is not known
    #[arg(long)]
    shape: bool,
    /// How many to show at most
    #[arg(long, default_value_t = 10, value_name = "N")]
    limit: usize,
    #[command(flatten)]
    filter: Wanted,
}

/// Materials that are compared at once.
const AT_ONCE: usize = 1000;

/// A material and how far it is.
#[derive(Serialize)]
struct Near {
    slug: Slug,
    name: String,
    /// None for a built-in one that is not in the database.
    revision: Option<u32>,
    kind: &'static str,
    status: String,
    #[serde(flatten)]
    distance: Distance,
}

#[derive(Serialize)]
struct Record {
    angles: usize,
    /// What chance alone makes of the distance to the true material, dB.
    noise_db: Option<f64>,
    /// Number of materials with too little in common.
    left_out: usize,
    materials: Vec<Near>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let Some(probe) = Probe::new(&observations(args, store.as_ref())?) else {
        return Err(Error::Usage {
            problem: "the curve has no backscatter that was detected, or a point above the \
                      instrument's range"
                .to_owned(),
            way_out: "give a curve with detections below that range".to_owned(),
        });
    };
    let missing = not_added(store.as_ref())?;
    let mut record = Record {
        angles: probe.angles(),
        noise_db: probe.noise_db(),
        left_out: 0,
        materials: Vec::new(),
    };
    for (store, is_stored) in [(store.as_ref(), true), (Some(&missing), false)] {
        let Some(store) = store else { continue };
        for some in store.find(&args.filter.filter())?.chunks(AT_ONCE) {
            for (summary, distance) in some.iter().zip(distances(store, &probe, some)?) {
                match distance {
                    Some(distance) => record.materials.push(near(summary, is_stored, distance)),
                    None => record.left_out += 1,
                }
            }
            keep_best(&mut record.materials, args);
        }
    }
    console.result(&text(&record, args), &record)
}

/// The distance to each of these, `None` for too little in common.
fn distances(
    store: &Store,
    probe: &Probe,
    some: &[Summary],
) -> Result<Vec<Option<Distance>>, Error> {
    let models: Result<Vec<_>, _> = some.iter().map(|s| store.rendered(&s.slug)).collect();
    let distance = |model: &Option<(Brdf, [f64; 2])>| {
        let (model, theta_rad) = model.as_ref()?;
        probe.distance(model, *theta_rad)
    };
    Ok(models?.par_iter().map(distance).collect())
}

fn near(summary: &Summary, is_stored: bool, distance: Distance) -> Near {
    Near {
        slug: summary.slug.clone(),
        name: summary.name.clone(),
        revision: is_stored.then_some(summary.revision),
        kind: summary.render_kind.as_str(),
        status: summary.status.clone(),
        distance,
    }
}

/// Sorts and cuts the list.
fn keep_best(list: &mut Vec<Near>, args: &Args) {
    let far = |near: &Near| match args.shape {
        true => near.distance.rms_shape_db,
        false => near.distance.rms_db,
    };
    list.sort_by(|a, b| far(a).total_cmp(&far(b)).then_with(|| a.slug.cmp(&b.slug)));
    list.truncate(args.limit);
}

fn observations(args: &Args, store: Option<&Store>) -> Result<Vec<Observation>, Error> {
    if let Some(path) = &args.curve {
        let bytes = std::fs::read(path).map_err(|reason| Error::Io {
            verb: "read",
            path: path.clone(),
            reason,
            way_out: "check the path",
        })?;
        let refused = |error| Error::CurveFile { file: path.clone(), error };
        return Ok(Curve::read(&bytes).map_err(refused)?.observations());
    }
    let name = args.material.as_deref().unwrap_or_default();
    let curves = find(store, name, "")?.material.curves;
    match curves.into_iter().rev().max_by_key(|curve| curve.observations.len()) {
        Some(curve) => Ok(curve.observations),
        None => Err(Error::Usage {
            problem: format!("`{name}` has no curve"),
            way_out: "give one with --curve FILE".to_owned(),
        }),
    }
}

fn text(record: &Record, args: &Args) -> String {
    let mut text = match record.materials.as_slice() {
        [] => "no material has enough angles in common with the curve\n".to_owned(),
        found => table(
            &["material", "rev", "kind", "rms dB", "shape dB", "offset dB", "angles", "notes"],
            found.iter().map(|near| row(near, record.angles)),
        ),
    };
    let by = if args.shape { "shape, its level left open" } else { "level and shape" };
    text += &format!("ranked by {by}, at {} angles of the curve\n", record.angles);
    text += &match record.noise_db {
        Some(noise) => format!("its repeats scatter: chance alone makes {noise:.1} dB\n"),
        None => "without repeats at an angle nobody knows what chance makes of it\n".to_owned(),
    };
    if record.left_out > 0 {
        text += &format!("left out for too little in common: {}\n", record.left_out);
    }
    text
}

fn row(near: &Near, angles: usize) -> [String; 8] {
    let Distance { rms_db, rms_shape_db, offset_db, common_angles, above_bound, silent, .. } =
        near.distance;
    let mut notes = Vec::new();
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
        near.kind.to_owned(),
        format!("{rms_db:.1}"),
        format!("{rms_shape_db:.1}"),
        format!("{offset_db:+.1}"),
        format!("{common_angles} of {angles}"),
        notes.join("; "),
    ]
}
