//! `matdb compare`.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::cloud::{CloudArgs, pose};
use super::console::Console;
use super::summary::grouped;
use crate::error::Error;
use crate::files::write_all;
use crate::formats::figure::{Figure, Plot, Scale, Series, Style, beside};
use crate::frames::Point;
use crate::geometry::Raster;
use crate::measure::compare::{Agreement, Line, difference, measured_scan, power_along};
use crate::render::{Observer, Scan, shade, trace_placed};
use crate::scene::Scene;
use crate::setup::Database;
use crate::setup::ReadyScene;

/// Compare a measured cloud with the rendered scene: images side by side, a line scan, the error
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb compare cloud.ply --scene scenes/mannequin.toml -o compared
  matdb compare cloud.ply --scene scene.toml --pose measured/pose.json --line y=1.1,width=0.02 -o compared
  matdb compare cloud.ply --scene scene.toml --fit mixture-mse -o by-mse      what another fit makes of it")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    /// The scene that was measured, with the materials to judge
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Where the target stood: the pose.json of `matdb measure`, or X,Y,Z[,RX,RY,RZ]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    pose: Option<String>,
    /// Render this fit of the scene's materials instead of what they render
    #[arg(long, value_name = "NAME")]
    fit: Option<String>,
    /// Stripe of the line scan in the global frame
    #[arg(long, value_name = "y=M,width=M", default_value = "y=1.1,width=0.02")]
    line: String,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let line = line(&args.line)?;
    let mut scene = Scene::load(&args.scene)?;
    // The mean: a draw of speckle would add its own error, or hide that of the measurement.
    let radar = &mut scene.file.radar;
    (radar.receiver, radar.speckle, radar.noise) = (None, None, None);
    let moved = pose(args.pose.as_deref())?;
    let vertices = scene.target.mesh.vertices.iter_mut();
    vertices.for_each(|vertex| *vertex = (moved * Point::from(*vertex)).xyz);
    let cloud = args.cloud.read(scene.radar())?;
    let mut ready = ReadyScene::new(scene, &args.scene, db.read()?.as_ref())?;
    if let Some(name) = &args.fit {
        ready.choose_fit(name)?;
    }
    let simulated = simulate(&ready)?;
    let notices = [cloud.notices.clone(), ready.notices()].concat();
    let scene = &ready.scene;
    let measured = measured_scan(scene.radar(), &scene.chirps, &cloud);
    let images = [ready.image(&measured), ready.image(&simulated)];
    let (error, agreement) = difference(&images[0], &images[1]);
    if agreement.both == 0 {
        return Err(Error::Usage {
            problem: format!("no pixel of `{}` has power in both images", args.scene.display()),
            way_out: "check the frame of the cloud, or register it with `matdb measure`".to_owned(),
        });
    }
    let record = record(args, &agreement, &notices);
    let mut json = serde_json::to_vec_pretty(&record)?;
    json.push(b'\n');
    let line_scan = line_scan(&scene.file.name, line, &measured, &simulated);
    let files = [
        ("images.png", side_by_side(&scene.file.name, &images, &error, &agreement)?),
        ("line.svg", line_scan.svg()?.into_bytes()),
        ("line.png", line_scan.png()?),
        ("error.json", json),
    ];
    write_all(&args.output, &files)?;
    notices.iter().for_each(|notice| console.notice(notice));
    console.result(&text(args, &agreement), &record)
}

fn line(text: &str) -> Result<Line, Error> {
    let (mut y_m, mut width_m) = (None, None);
    let mut understood = true;
    for part in text.split(',') {
        let number = |value: &str| value.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let slot = match part.split_once('=').map(|(key, value)| (key.trim(), number(value))) {
            Some(("y", Some(value))) => y_m.replace(value),
            Some(("width", Some(value))) if value > 0.0 => width_m.replace(value),
            _ => Some(f64::NAN),
        };
        understood &= slot.is_none();
    }
    match (y_m, understood) {
        (Some(y_m), true) => Ok(Line { y_m, width_m: width_m.unwrap_or(0.02) }),
        _ => Err(Error::Usage {
            problem: format!("--line {text} is no line"),
            way_out: "write it as --line y=1.1,width=0.02".to_owned(),
        }),
    }
}

/// The scan of the scene as it is rendered.
fn simulate(ready: &ReadyScene) -> Result<Scan, Error> {
    let at = |error| ready.render_error("", error);
    let assembly = ready.assemble();
    let setup = assembly.setup();
    let footprints = trace_placed(&setup, ready.scene.file.spot.rays, &|_| {}).map_err(at)?;
    shade(&setup, &footprints, Observer::Radar, &|_| {}).map_err(at)
}

fn side_by_side(
    title: &str,
    images: &[Raster; 2],
    error: &Raster,
    agreement: &Agreement,
) -> Result<Vec<u8>, Error> {
    let powers = || images.iter().filter_map(|image| image.channel("power_dbm")).flatten();
    let low = powers().copied().fold(f32::INFINITY, f32::min);
    let high = powers().copied().fold(f32::NEG_INFINITY, f32::max);
    // One scale for both; a single power still needs a scale.
    let range = Some((f64::from(low), f64::from(high).max(f64::from(low) + 1.0)));
    let power = |raster, subtitle| Figure {
        raster,
        channel: "power_dbm",
        title,
        subtitle,
        colour_label: "received power, dBm",
        range,
        scale: Scale::Sequential,
        gaps: "no detection",
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
    };
    let subtitle = format!(
        "simulated less measured: mean {:.2} dB, rms {:.2} dB",
        agreement.bias_db, agreement.rmse_db
    );
    let error = Figure {
        channel: "difference_db",
        colour_label: "difference, dB",
        range: Some((-5.0, 5.0)),
        scale: Scale::Diverging,
        ..power(error, &subtitle)
    };
    Ok(beside(&[power(&images[0], "measured"), power(&images[1], "simulated"), error])?)
}

fn line_scan<'a>(title: &'a str, line: Line, measured: &Scan, simulated: &Scan) -> Plot<'a> {
    let series = |name: &str, scan: &Scan| Series {
        name: format!("{name}, y = {} ± {} m", line.y_m, 0.5 * line.width_m),
        style: Style::Points,
        points: power_along(scan, line),
    };
    let empty = power_along(measured, line).is_empty() && power_along(simulated, line).is_empty();
    Plot {
        title,
        subtitle: if empty { "line scan: no detection lies on it" } else { "line scan" },
        x_label: "x, m",
        y_label: "received power, dBm",
        x_range: Some((-0.3, 0.3)).filter(|_| empty),
        y_range: Some((-100.0, 0.0)).filter(|_| empty),
        equal: false,
        series: vec![series("measured", measured), series("simulated", simulated)],
    }
}

fn record(args: &Args, agreement: &Agreement, notices: &[String]) -> Value {
    json!({
        "schema": 1,
        "cloud": args.cloud.cloud.display().to_string(),
        "scene": args.scene.display().to_string(),
        "pixels": agreement,
        "notices": notices,
    })
}

fn text(args: &Args, agreement: &Agreement) -> String {
    format!(
        "simulated less measured over {} pixels: mean {:.2} dB, rms {:.2} dB, median size {:.2} dB\n\
         {} pixels are in the measurement alone, {} in the simulation alone\n\
         wrote images.png, line.png, line.svg and error.json to {}\n",
        grouped(agreement.both),
        agreement.bias_db,
        agreement.rmse_db,
        agreement.median_size_db,
        grouped(agreement.only_measured),
        grouped(agreement.only_simulated),
        args.output.display()
    )
}
