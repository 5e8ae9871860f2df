//! A measured cloud and the rendered scene: images side by side, a line scan, and how far they agree.

use std::path::Path;

use serde_json::{Value, json};

use super::json::json_file;
use crate::error::Error;
use crate::formats::figure::{Figure, Ink, Plot, Scale, Series, Style, beside};
use crate::geometry::Raster;
use crate::measure::Cloud;
use crate::measure::compare::{Agreement, Line, difference, measured_scan, power_along};
use crate::render::Scan;
use crate::setup::ReadyScene;
use crate::units::dbm_from_watts;

/// A measured and a rendered scan of one scene.
pub struct Comparison {
    /// The scene's name.
    pub title: String,
    /// The measured echoes.
    pub measured: Scan,
    /// The rendered echoes.
    pub simulated: Scan,
    /// The measured image, then the rendered one, on one grid.
    pub images: [Raster; 2],
    /// Rendered less measured power, dB.
    pub error: Raster,
    /// How far they agree.
    pub agreement: Agreement,
}

impl Comparison {
    /// Renders a scene and compares it with a cloud that was measured of it.
    ///
    /// # Errors
    /// What the renderer refuses; images without a pixel that has power in both.
    pub fn new(ready: &ReadyScene, cloud: &Cloud) -> Result<Comparison, Error> {
        let scene = &ready.scene;
        let simulated = simulate(ready)?;
        let measured = measured_scan(scene.radar(), &scene.chirps, cloud);
        let images = [ready.image(&measured), ready.image(&simulated)];
        let (error, agreement) = difference(&images[0], &images[1]);
        if agreement.both == 0 {
            return Err(Error::usage(
                format!("no pixel of `{}` has power in both images", ready.path.display()),
                "check the frame of the cloud, or register it with `matdb measure`",
            ));
        }
        let title = scene.file.name.clone();
        Ok(Comparison { title, measured, simulated, images, error, agreement })
    }

    /// What `error.json` holds: how far both agree, and what a person should not overlook.
    pub fn record(&self, cloud: &Path, scene: &Path, notices: &[String]) -> Value {
        json!({
            "schema": 1,
            "cloud": cloud.display().to_string(),
            "scene": scene.display().to_string(),
            "pixels": self.agreement,
            "notices": notices,
        })
    }

    /// Names and bytes: both images, the line scan, and the record.
    ///
    /// # Errors
    /// A picture that is too large.
    pub fn files(&self, line: Line, record: &Value) -> Result<[(&'static str, Vec<u8>); 4], Error> {
        let line_plot = self.line_plot(line);
        Ok([
            ("images.png", self.images_png()?),
            ("line.svg", line_plot.svg()?.into_bytes()),
            ("line.png", line_plot.png()?),
            ("error.json", json_file(record)?),
        ])
    }

    /// Both images on one scale, and their difference, as a PNG.
    ///
    /// # Errors
    /// A picture that is too large.
    pub fn images_png(&self) -> Result<Vec<u8>, Error> {
        let subtitle = format!(
            "simulated less measured: mean {:.2} dB, rms {:.2} dB",
            self.agreement.bias_db, self.agreement.rmse_db
        );
        let error = Figure {
            channel: "difference_db",
            colour_label: "difference, dB",
            range: Some((-5.0, 5.0)),
            scale: Scale::Diverging,
            ..self.power_figure(&self.error, &subtitle)
        };
        let measured = self.power_figure(&self.images[0], "measured");
        let simulated = self.power_figure(&self.images[1], "simulated");
        Ok(beside(&[measured, simulated, error])?)
    }

    /// The powers of both along a stripe of the global frame.
    pub fn line_plot(&self, line: Line) -> Plot<'_> {
        let scans = [
            ("measured", Ink::Detections, &self.measured),
            ("simulated", Ink::Before, &self.simulated),
        ];
        let series = scans.map(|(name, ink, scan)| Series {
            name: format!("{name}, y = {} ± {} m", line.y_m, 0.5 * line.width_m),
            style: Style::Points,
            ink,
            points: power_along(scan, line)
                .into_iter()
                .map(|(x_m, power_w)| (x_m, dbm_from_watts(power_w)))
                .collect(),
        });
        let is_empty = series.iter().all(|series| series.points.is_empty());
        Plot {
            title: &self.title,
            subtitle: if is_empty { "line scan: no detection lies on it" } else { "line scan" },
            x_label: "x, m",
            y_label: "received power, dBm",
            x_range: Some((-0.3, 0.3)).filter(|_| is_empty),
            y_range: Some((-100.0, 0.0)).filter(|_| is_empty),
            equal: false,
            series: series.into(),
        }
    }

    fn power_figure<'a>(&'a self, raster: &'a Raster, subtitle: &'a str) -> Figure<'a> {
        Figure {
            raster,
            channel: "power_dbm",
            title: &self.title,
            subtitle,
            colour_label: "received power, dBm",
            range: Some(self.power_range_dbm()),
            scale: Scale::Sequential,
            gaps: "no detection",
            x_label: "x in the target plane, m",
            y_label: "y in the target plane, m",
        }
    }

    /// The least and the greatest power of both images, at least 1 dB apart: a single power needs a scale, too.
    fn power_range_dbm(&self) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for image in &self.images {
            for &power_dbm in image.channel("power_dbm").unwrap_or_default() {
                low = low.min(power_dbm);
                high = high.max(power_dbm);
            }
        }
        (f64::from(low), f64::from(high).max(f64::from(low) + 1.0))
    }
}

/// The radar's scan of a scene.
fn simulate(ready: &ReadyScene) -> Result<Scan, Error> {
    let assembly = ready.assemble();
    let setup = assembly.setup();
    let footprints = assembly.trace(&setup, &|_| {})?;
    assembly.shade(&setup, &footprints, &|_| {})
}
