//! `matdb measure`.

use std::path::PathBuf;

use super::cloud::{CloudArgs, ColumnArgs, start};
use super::console::Console;
use super::curves::{Circumstances, OWN, kind_of};
use super::summary::grouped;
use crate::adopt::{MeasurementStorage, StoredMeasurement};
use crate::error::Error;
use crate::files::write_all;
use crate::material::SourceKind;
use crate::measure::freedom::Freedom;
use crate::measure::{Curve, Metric, Reduction, Registration, Start};
use crate::report::{MeasurementReport, MeasurementRequest};
use crate::scene::Scene;
use crate::setup::Database;

/// Register a measured cloud to its scene and reduce it to a curve
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb measure out/cloud.ply --scene scenes/mannequin.toml -o measured
  matdb measure cloud.csv --scene scene.toml --pose 0.03,0,-0.01,0,5,0 --region body -o measured
  matdb measure cloud.xyz --unit mm --scene scene.toml --pose auto -o measured
  matdb measure cloud.ply --scene scene.toml -o measured --save my-paint --kind measured \\
    --source 'Our bench, 2026' --licence CC-BY-4.0 \\
    --instrument 'Our radar' --frequency 300 --threshold -77 --date 2026-03-14

Then: matdb fit measured/curve.csv, or matdb fit my-paint --save")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// The scene that was measured: its mesh, its radar and its scan
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Rough pose of the target: X,Y,Z[,RX,RY,RZ] in m and degrees after the scene's own, `auto`, or a
    /// pose.json [default: the scene's own]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    pose: Option<String>,
    /// Use the found pose even where the points agree with the given one
    #[arg(long)]
    refine: bool,
    /// Take the given pose as it is: nothing is registered
    #[arg(long, conflicts_with = "refine")]
    keep_pose: bool,
    /// What the registration minimises
    #[arg(long, default_value = "along-ray")]
    metric: MetricFlag,
    /// Only this region of the scene
    #[arg(long, value_name = "NAME")]
    region: Option<String>,
    /// Leave out what is nearer than this to an edge or another region, m [default: a spot]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    edge_margin: Option<f64>,
    /// The target is the facets of the mesh, as in a rendered cloud: their normals have no error
    #[arg(long)]
    exact_mesh: bool,
    /// Also store the curve as a new revision of this material, which must exist
    #[arg(long, value_name = "MATERIAL")]
    save: Option<String>,
    /// Name of the stored curve
    #[arg(long, value_name = "NAME", default_value = "measured")]
    curve: String,
    /// Origin of the cloud
    #[arg(long, value_parser = kind_of(OWN))]
    kind: Option<SourceKind>,
    /// Who measured or made the cloud, when and how
    #[arg(long, value_name = "TITLE")]
    source: Option<String>,
    /// Day of the measurement, YYYY-MM-DD: with it pose, registration and the cloud's hash are stored as a session
    #[arg(long, value_name = "DAY", requires = "save")]
    date: Option<String>,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    circumstances: Circumstances,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum MetricFlag {
    /// Gaps along the measured rays
    AlongRay,
    /// Distances to the planes of nearest neighbours
    PointToPlane,
    /// The paper's: distances to nearest neighbours
    PointToPoint,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let scene = Scene::load(&args.scene)?;
    // A registration takes a while: what prevents the storing of its curve is reported before.
    let storage = storage(args);
    if let Some(storage) = &storage {
        storage.check(db.read()?.as_ref())?;
    }
    let cloud = args.cloud.read(&args.columns, scene.radar())?;
    let request = MeasurementRequest {
        cloud_file: &args.cloud.cloud,
        cloud: &cloud,
        scene_file: &args.scene,
        scene: &scene,
        reduction: reduction(args)?,
        registration: registration(args)?,
        region: args.region.as_deref(),
    };
    let activity = console.activity("registering");
    let measured = request.run()?;
    activity.end();
    // Refused before anything is written, stored after it.
    if let Some(storage) = &storage {
        let doubts = storage.admit(&measured, db.read()?.as_ref())?;
        doubts.iter().for_each(|doubt| console.notice(doubt));
    }
    write_all(&args.output, &measured.files)?;
    let stored = storage.map(|storage| storage.save(&measured, db)).transpose()?;
    let of_stored = stored.iter().flat_map(|stored| &stored.notices);
    of_stored.chain(&measured.notices).for_each(|notice| console.notice(notice));
    console.result(&text(args, &measured, stored.as_ref()), &measured.record)
}

/// How the curve is to be stored, where it is.
fn storage(args: &Args) -> Option<MeasurementStorage<'_>> {
    Some(MeasurementStorage {
        material: args.save.clone()?,
        curve: args.curve.clone(),
        origin: args.circumstances.origin(args.kind, args.source.as_ref()),
        date: args.date.clone(),
        cloud: &args.cloud.cloud,
        scene: &args.scene,
    })
}

fn registration(args: &Args) -> Result<Registration, Error> {
    let start = start(args.pose.as_deref())?;
    if args.keep_pose && start == Start::Automatic {
        return Err(Error::usage(
            "--keep-pose has no pose to keep",
            "give --pose X,Y,Z[,RX,RY,RZ], or leave out --pose auto",
        ));
    }
    let registration = match args.metric {
        MetricFlag::AlongRay => Registration::default(),
        MetricFlag::PointToPlane => {
            Registration { metric: Metric::PointToPlane, ..Registration::default() }
        }
        MetricFlag::PointToPoint => Registration::paper(),
    };
    Ok(Registration { start, keep_given: !args.refine, keep: args.keep_pose, ..registration })
}

fn reduction(args: &Args) -> Result<Reduction, Error> {
    let (edge_margin_m, exact_mesh) = (args.edge_margin, args.exact_mesh);
    match edge_margin_m {
        Some(margin_m) if !(0.0..=1.0).contains(&margin_m) => Err(Error::usage(
            format!("--edge-margin {margin_m} is not a margin"),
            "give metres from 0 to 1",
        )),
        _ => Ok(Reduction { edge_margin_m, exact_mesh, ..Reduction::default() }),
    }
}

fn text(args: &Args, measured: &MeasurementReport, stored: Option<&StoredMeasurement>) -> String {
    let MeasurementReport { registered, reduced, .. } = measured;
    let middle = registered.pivot;
    let shift_mm = 1e3 * (middle.xyz - (registered.pose.inverse() * middle).xyz);
    let sd: [f64; 6] = std::array::from_fn(|axis| registered.told_covariance[axis][axis].sqrt());
    let [shift_sd_m, turn_sd_rad] =
        [&sd[..3], &sd[3..]].map(|sd| sd.iter().copied().fold(0.0, f64::max));
    let (curve, left_out) = (&reduced.curve, reduced.left_out);
    let detected = curve.detected().count();
    let free: Vec<String> = registered.free.iter().map(Freedom::to_string).collect();
    let held = if free.is_empty() {
        String::new()
    } else {
        format!("the points do not determine: {}\n", free.join("; "))
    };
    let kept = if args.keep_pose {
        "the given pose is kept\n"
    } else if registered.kept {
        "the points agree with the given pose, which is kept; --refine uses the found one\n"
    } else {
        ""
    };
    let known = if args.keep_pose {
        String::new()
    } else {
        let (shift_sd_mm, turn_sd_deg) = (1e3 * shift_sd_m, turn_sd_rad.to_degrees());
        format!(", known to {shift_sd_mm:.2} mm and {turn_sd_deg:.3}° (1 sd)")
    };
    let saved =
        stored.map_or(String::new(), |StoredMeasurement { material, revision, curve, .. }| {
            format!("stored the curve as `{curve}` in {material}@{revision}\n")
        });
    format!(
        "{kept}{held}pose: {} of {} points on the surface, rms {:.2} mm{known}\n\
         shift of the middle of the points: {:.2}, {:.2}, {:.2} mm\n\
         curve: {} detections and {} censored chirps from {:.1}° to {:.1}°\n\
         reduced with {}; {}\n\
         left out: {} near an edge or another region, {} off the surface or beside it, {} whose facet is uncertain\n\
         wrote pose.json, curve.csv and curve.svg to {}\n{saved}",
        grouped(registered.inliers),
        grouped(registered.points),
        1e3 * registered.rms_m,
        shift_mm.x,
        shift_mm.y,
        shift_mm.z,
        grouped(detected),
        grouped(curve.observations.len() - detected),
        angles_deg(curve).fold(f64::INFINITY, f64::min),
        angles_deg(curve).fold(0.0, f64::max),
        curve.illumination.footprint_words(),
        curve.illumination.beam_words(),
        grouped(left_out.near_edge + left_out.silent_near_edge),
        grouped(left_out.missed + left_out.off_surface),
        grouped(left_out.unsure_of_facet),
        args.output.display()
    )
}

fn angles_deg(curve: &Curve) -> impl Iterator<Item = f64> + '_ {
    curve.observations.iter().map(|row| row.theta_i_rad.to_degrees())
}
