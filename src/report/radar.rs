//! A radar: its scan, its spot and the polynomial of equation (1), as files.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};

use crate::error::Error;
use crate::formats::figure::{Figure, Ink, Plot, Scale, Series, Style};
use crate::formats::words::significant;
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::radar::f5::{Domain, F5Deviation};
use crate::radar::{Beam, Chirps, F5, Field, Radar};
use crate::scene::{Scene, SceneError, SceneFile, read_regular, read_text};

/// A radar with its scan and its polynomial.
pub struct RadarReport {
    /// The instrument.
    pub radar: Radar,
    /// The rays of its scan.
    pub chirps: Chirps,
    /// What the scan covers at the range of the pattern.
    pub field: Field,
    /// Where the polynomial holds.
    pub domain: Domain,
    /// The polynomial of equation (1).
    pub f5: F5,
    /// How far it is from the exact mirror, mm.
    pub f5_error: F5Deviation,
}

impl RadarReport {
    /// The radar of a preset, by its name, or of a scene file (`.toml`).
    ///
    /// # Errors
    /// An unknown preset, a scene file that cannot be read, a radar that cannot exist.
    pub fn open(wanted: &str) -> Result<RadarReport, Error> {
        let (radar, chirps) = load(wanted)?;
        RadarReport::new(radar, chirps)
    }

    /// The radar of a scene.
    ///
    /// # Errors
    /// A mirror that no polynomial follows.
    pub fn of_scene(scene: &Scene) -> Result<RadarReport, Error> {
        RadarReport::new(scene.radar().clone(), scene.chirps.clone())
    }

    fn new(radar: Radar, chirps: Chirps) -> Result<RadarReport, Error> {
        let domain = radar.f5_domain(&chirps.mirror);
        let f5 = radar.f5(domain)?;
        let f5_error = f5.error(&radar.mirror(), domain)?;
        let field = chirps.field(&radar.frames());
        Ok(RadarReport { radar, chirps, field, domain, f5, f5_error })
    }

    /// Its numbers, as `matdb radar --json` prints them.
    pub fn record(&self) -> Value {
        let RadarReport { radar, chirps, field, f5_error, .. } = self;
        json!({
            "radar": radar, "chirps": chirps.rays.len(), "field_m": [field.min_m, field.max_m],
            "f5_error": f5_error,
        })
    }

    /// Names and bytes of `scan.csv`, `scan.png`, `scan.svg`, `spot.csv`, `spot.png` and `f5.toml`.
    ///
    /// # Errors
    /// A picture that is too large.
    pub fn files(&self) -> Result<Vec<(&'static str, Vec<u8>)>, Error> {
        let RadarReport { radar, chirps, field, .. } = self;
        let spot = spot_raster(radar, *field);
        let [scan_title, spot_title] = ["Scan", "Spot"]
            .map(|what| format!("{what} at {} m", significant(radar.frames().pattern_range_m, 3)));
        let scan = scan_plot(radar, chirps, *field, &scan_title);
        Ok(vec![
            ("scan.csv", scan_csv(radar, chirps).into_bytes()),
            ("scan.png", scan.png()?),
            ("scan.svg", scan.svg()?.into_bytes()),
            ("spot.csv", spot_csv(&spot).into_bytes()),
            ("spot.png", spot_figure(&spot, radar, &spot_title).png()?),
            ("f5.toml", f5_toml(&self.f5).into_bytes()),
        ])
    }
}

/// The radar of a preset or a scene file, and its chirps.
fn load(wanted: &str) -> Result<(Radar, Chirps), Error> {
    let path = Path::new(wanted);
    let radar = if wanted.ends_with(".toml") {
        SceneFile::parse(&read_text(path)?)
            .map_err(|error| SceneError::Format { file: path.to_owned(), error })?
            .radar
    } else {
        Radar { preset: wanted.to_owned(), ..Radar::default() }
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

fn scan_plot<'a>(radar: &'a Radar, chirps: &Chirps, field: Field, title: &'a str) -> Plot<'a> {
    let points = chirps.target_points_m(&radar.frames()).map(|p| (p.x, p.y)).collect();
    let [x_range, y_range] =
        [0, 1].map(|axis| Some((field.min_m[axis] - 0.02, field.max_m[axis] + 0.02)));
    Plot {
        title,
        subtitle: &radar.preset,
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
        x_range,
        y_range,
        equal: true,
        series: vec![Series {
            name: String::new(),
            style: Style::Points,
            ink: Ink::Own(0),
            points,
        }],
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
    let range_m = radar.frames().pattern_range_m;
    let pixels =
        (0..raster.height).flat_map(|row| (0..raster.width).map(move |column| (row, column)));
    let values = pixels
        .map(|(row, column)| {
            let diameter_m =
                beam.towards(raster.x_m(column), raster.y_m(row)).section(range_m).fwhm_m();
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

fn spot_figure<'a>(spot: &'a Raster, radar: &'a Radar, title: &'a str) -> Figure<'a> {
    Figure {
        raster: spot,
        channel: "spot_mm",
        title,
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
