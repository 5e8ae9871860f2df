//! `matdb radar`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::console::Console;
use crate::error::Error;
use crate::files::write_all;
use crate::formats::figure::{Figure, Plot, Scale, Series, Style};
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::radar::scan::PATTERN_RANGE_M;
use crate::radar::{Beam, Chirps, F5, Field, Radar};
use crate::scene::{SceneError, SceneFile, read_regular, read_text};

/// Show a radar: its scan, its spot and the polynomial of equation (1)
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb radar upm-300ghz -o radar
  matdb radar scenes/mannequin.toml -o radar --json

Writes scan.csv, scan.png and scan.svg (where each chirp looks), spot.csv and spot.png (how wide the
spot is), and f5.toml (the coefficients, to be pasted into a scene).")]
pub(super) struct Args {
    /// A preset's name or a scene file
    radar: String,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let (radar, chirps) = load(&args.radar)?;
    let domain = radar.f5_domain(&chirps.mirror);
    let f5 = radar.f5(domain)?;
    let error = f5.error(&radar.mirror(), domain)?;
    let field = chirps.field(&radar.frames());
    let spot = spot_raster(&radar, field);
    let scan = scan_plot(&radar, &chirps, field);
    let files = [
        ("scan.csv", scan_csv(&radar, &chirps).into_bytes()),
        ("scan.png", scan.png()?),
        ("scan.svg", scan.svg()?.into_bytes()),
        ("spot.csv", spot_csv(&spot).into_bytes()),
        ("spot.png", spot_figure(&spot, &radar).png()?),
        ("f5.toml", f5_toml(&f5).into_bytes()),
    ];
    write_all(&args.output, &files)?;
    chirps.notices.iter().for_each(|notice| console.notice(notice));
    let names = files.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let [width_m, height_m] = field.sides_m();
    let text = format!(
        "{}: {} chirps over {width_m:.3} m × {height_m:.3} m at 8 m\n\
         f5 is off the exact mirror by {:.2e} mm at worst, {:.2e} mm rms, for R from {} to {} m\n\
         wrote {names} to {}\n",
        radar.preset,
        chirps.rays.len(),
        error.worst_mm,
        error.rms_mm,
        domain.range_m[0],
        domain.range_m[1],
        args.output.display()
    );
    let value = json!({
        "radar": radar, "chirps": chirps.rays.len(), "field_m": [field.min_m, field.max_m],
        "f5_error": error, "output": args.output.to_string_lossy(),
    });
    console.result(&text, &value)
}

/// The radar of a preset or a scene file, and its chirps.
fn load(wanted: &str) -> Result<(Radar, Chirps), Error> {
    let path = Path::new(wanted);
    let radar = match wanted.ends_with(".toml") {
        true => {
            SceneFile::parse(&read_text(path)?)
                .map_err(|error| SceneError::Format { file: path.to_owned(), error })?
                .radar
        }
        false => Radar { preset: wanted.to_owned(), ..Radar::default() },
    };
    radar.validate()?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let read_csv = |name: &str| read_regular(&folder.join(name)).map_err(|e| e.to_string());
    let chirps = Chirps::draw(&radar, read_csv)?;
    Ok((radar, chirps))
}

fn scan_csv(radar: &Radar, chirps: &Chirps) -> String {
    let mut text = "chirp,time_s,gamma_rad,phi_rad,xt_m,yt_m,ox_m,oy_m,oz_m,dx,dy,dz\n".to_owned();
    for (row, at) in chirps.target_points_m(&radar.frames()).enumerate() {
        let (xt_m, yt_m) = (at.x, at.y);
        let (ray, number, time_s) = (chirps.rays[row], chirps.number[row], chirps.time_s[row]);
        let mirror = chirps.mirror.get(row);
        let angles = mirror.map_or(",".to_owned(), |m| format!("{},{}", m.gamma_rad, m.phi_rad));
        let (o, d) = (ray.origin.xyz, ray.direction.xyz());
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{number},{time_s},{angles},{xt_m},{yt_m},{},{},{},{},{},{}",
            o.x, o.y, o.z, d.x, d.y, d.z
        );
    }
    text
}

fn scan_plot<'a>(radar: &'a Radar, chirps: &Chirps, field: Field) -> Plot<'a> {
    let points = chirps.target_points_m(&radar.frames()).map(|p| (p.x, p.y)).collect();
    let around = |axis: usize| (field.min_m[axis] - 0.02, field.max_m[axis] + 0.02);
    Plot {
        title: "Scan at 8 m",
        subtitle: &radar.preset,
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
        x_range: Some(around(0)),
        y_range: Some(around(1)),
        equal: true,
        series: vec![Series { name: String::new(), style: Style::Points, points }],
    }
}

/// Spot diameter over the field of view at the pattern's range, in mm.
fn spot_raster(radar: &Radar, field: Field) -> Raster {
    const LONGER_SIDE: f64 = 180.0;
    let [width_m, height_m] = field.sides_m();
    let pixel_m = width_m.max(height_m).max(1e-6) / LONGER_SIDE;
    let count = |side_m: f64| (side_m / pixel_m).ceil().max(1.0) as usize;
    let mut raster = Raster {
        width: count(width_m),
        height: count(height_m),
        x_min_m: field.min_m[0],
        y_min_m: field.min_m[1],
        pixel_m,
        channels: Vec::new(),
    };
    let beam = Beam::new(radar);
    let pixels =
        (0..raster.height).flat_map(|row| (0..raster.width).map(move |column| (row, column)));
    let values = pixels
        .map(|(row, column)| {
            let diameter_m = beam.diameter_m(raster.x_m(column), raster.y_m(row), PATTERN_RANGE_M);
            (1e3 * diameter_m) as f32
        })
        .collect();
    raster.channels.push(Channel { name: "spot_mm".to_owned(), values });
    raster
}

fn spot_csv(spot: &Raster) -> String {
    let mut text = "xt_m,yt_m,spot_mm\n".to_owned();
    for (index, value) in spot.channels.iter().flat_map(|c| &c.values).enumerate() {
        let (row, column) = (index / spot.width, index % spot.width);
        let _ = writeln!(text, "{:.5},{:.5},{value}", spot.x_m(column), spot.y_m(row));
    }
    text
}

fn spot_figure<'a>(spot: &'a Raster, radar: &'a Radar) -> Figure<'a> {
    Figure {
        raster: spot,
        channel: "spot_mm",
        title: "Spot at 8 m",
        subtitle: &radar.preset,
        colour_label: "diameter at half intensity, mm",
        range: None,
        scale: Scale::Sequential,
        gaps: "nothing here",
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
    }
}

/// The polynomial as the table of a scene file.
fn f5_toml(f5: &F5) -> String {
    let terms: Vec<String> = f5
        .terms
        .iter()
        .map(|t| {
            format!(
                "  {{ gamma = {}, cos_phi = {}, sin_phi = {}, range = {} }},\n",
                t.gamma, t.cos_phi, t.sin_phi, t.range
            )
        })
        .collect();
    format!(
        "# Equation (1): x_t and y_t are sums of coefficients times\n\
         # (γ/gamma_scale_rad)^gamma · cos(φ)^cos_phi · sin(φ)^sin_phi · ((R − range_centre_m)/range_scale_m)^range\n\
         [radar.f5]\ngamma_scale_rad = {:?}\nrange_centre_m = {:?}\nrange_scale_m = {:?}\n\
         terms = [\n{}]\nx_m = {:?}\ny_m = {:?}\n",
        f5.gamma_scale_rad,
        f5.range_centre_m,
        f5.range_scale_m,
        terms.concat(),
        f5.x_m,
        f5.y_m
    )
}
