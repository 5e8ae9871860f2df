//! A scan as each antenna sees it.

use crate::cli::console::Console;
use crate::frames::Point;
use crate::geometry::Raster;
use crate::render::{Footprints, Observer, RenderError, Scan, Setup, power_image, shade};
use crate::scene::Scene;
use crate::scene::file::ReceiverEntry;

/// What one antenna got.
pub(super) struct View<'a> {
    /// The receiver; none for the radar itself.
    pub receiver: Option<&'a ReceiverEntry>,
    pub observer: Observer,
    pub scan: Scan,
}

impl View<'_> {
    /// A file's name: `power.png` for the radar, `power-NAME.png` for a receiver.
    pub fn file(&self, stem: &str, extension: &str) -> String {
        match self.receiver {
            None => format!("{stem}.{extension}"),
            Some(receiver) => format!("{stem}-{}.{extension}", receiver.name),
        }
    }

    pub fn image(&self, scene: &Scene, material_of_region: &[u16]) -> Raster {
        let radar = scene.radar();
        let field = scene.chirps.field(&radar.frames());
        let spot_m = radar.spot_diameter_m;
        power_image(&self.scan, field, spot_m, material_of_region, scene.pixel_m())
    }
}

/// The radar's own view first, then those of the receivers; an error comes with the receiver it is
/// about.
pub(super) fn all<'a>(
    setup: &Setup,
    footprints: &Footprints,
    scene: &'a Scene,
    console: &Console,
) -> Result<Vec<View<'a>>, (String, RenderError)> {
    let receivers = &scene.file.receiver;
    let bar = console.progress("receiving", (1 + receivers.len()) * scene.chirps.rays.len());
    let view = |receiver: Option<(usize, &'a ReceiverEntry)>| {
        let observer = receiver.map_or(Observer::Radar, |(number, entry)| Observer::Receiver {
            number: number as u32 + 1,
            position: Point::from(glam::DVec3::from_array(entry.position_m)),
            aperture_m2: entry.aperture_m2.unwrap_or(scene.radar().aperture_m2),
        });
        let antenna =
            receiver.map_or(String::new(), |(_, entry)| format!("receiver `{}`: ", entry.name));
        let scan = shade(setup, footprints, observer, &|chirps| bar.inc(chirps as u64))
            .map_err(|error| (antenna, error))?;
        Ok(View { receiver: receiver.map(|(_, entry)| entry), observer, scan })
    };
    let views =
        std::iter::once(None).chain(receivers.iter().enumerate().map(Some)).map(view).collect();
    bar.finish_and_clear();
    views
}
