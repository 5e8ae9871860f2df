//! The images of a scan, as members of an archive: what was measured, what is there, and boxes.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::labels::{Labels, Sight};
use crate::error::Error;
use crate::formats::exr;
use crate::formats::grey_png::grey_png;
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::setup::ReadyScene;

/// A part of an image that shows one instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct InstanceBox {
    /// Number of its mesh, from 1.
    pub instance: u16,
    /// Its name.
    pub name: String,
    /// Whether it is looked for.
    pub threat: bool,
    /// Column and row of the first pixel, then width and height, in pixels; none where no pixel shows it.
    pub bbox: Option<[u32; 4]>,
    /// Pixels that show it.
    pub pixels: u32,
    /// Chirps whose axis hits it.
    pub chirps: u32,
    /// Least and largest coordinates of its mesh in the global frame, m.
    pub min_m: [f64; 3],
    pub max_m: [f64; 3],
}

/// What an image shows where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ImageRecord {
    pub width: u32,
    pub height: u32,
    pub pixel_m: f64,
    /// Left and lower edge in the target plane, m.
    pub x_min_m: f64,
    pub y_min_m: f64,
    pub boxes: Vec<InstanceBox>,
}

/// Name without key, and bytes of the members of a scan.
pub(super) type Members = Vec<(String, Vec<u8>)>;

/// The members of a scan. `measured` are the images of all views, with their names' endings.
///
/// # Errors
/// An image that cannot be encoded.
pub(super) fn members(
    ready: &ReadyScene,
    measured: &[(String, Raster)],
    sights: &[Option<Sight>],
    labels: &Labels,
) -> Result<(Members, ImageRecord), Error> {
    let mut members = Vec::new();
    for (ending, image) in measured {
        for (name, channels) in [
            ("power", &["power_dbm", "real_sqrt_w", "imaginary_sqrt_w"][..]),
            ("range", &["range_m"][..]),
        ] {
            let part = only(image, channels);
            members.push((format!("{name}{ending}.exr"), exr::write(&part, &[])?));
        }
    }
    let Some((_, image)) = measured.first() else {
        return Err(Error::usage("a scan has no view", "report this"));
    };
    let shown = nearest_sights(ready, image, sights);
    let truth = Raster {
        channels: vec![
            Channel {
                name: "depth_m".to_owned(),
                values: pixels(&shown, |sight| sight.hit.range_m),
            },
            Channel {
                name: "incidence_deg".to_owned(),
                values: pixels(&shown, |sight| sight.hit.theta_rad().to_degrees()),
            },
        ],
        ..only(image, &[])
    };
    members.push(("truth.exr".to_owned(), exr::write(&truth, &[])?));
    let size = [image.width as u32, image.height as u32];
    let instances = numbers(&shown, |sight| sight.instance);
    let material = numbers(&shown, |sight| sight.material.saturating_add(1));
    for (name, values) in [("instance", &instances), ("material", &material)] {
        members.push((format!("{name}.png"), grey_png(size, values)?));
    }
    let record = ImageRecord {
        width: size[0],
        height: size[1],
        pixel_m: image.pixel_m,
        x_min_m: image.x_min_m,
        y_min_m: image.y_min_m,
        boxes: boxes(ready, size, &instances, sights, labels),
    };
    let text = serde_json::to_vec(&record).unwrap_or_default();
    members.push(("json".to_owned(), text));
    Ok((members, record))
}

/// A channel of what pixels show; NaN where they show nothing.
fn pixels(shown: &[Option<&Sight>], value: fn(&Sight) -> f64) -> Vec<f32> {
    shown.iter().map(|sight| sight.map_or(f32::NAN, |sight| value(sight) as f32)).collect()
}

/// A number of what pixels show; 0 where they show nothing.
fn numbers(shown: &[Option<&Sight>], value: fn(&Sight) -> u16) -> Vec<u16> {
    shown.iter().map(|sight| sight.map_or(0, value)).collect()
}

/// Some channels of an image.
fn only(image: &Raster, names: &[&str]) -> Raster {
    let Raster { width, height, x_min_m, y_min_m, pixel_m, .. } = *image;
    let channels = image.channels.iter().filter(|channel| names.contains(&channel.name.as_str()));
    Raster { width, height, x_min_m, y_min_m, pixel_m, channels: channels.cloned().collect() }
}

/// What each pixel shows: what lies along the axis of the nearest chirp whose spot covers it.
fn nearest_sights<'a>(
    ready: &ReadyScene,
    image: &Raster,
    sights: &'a [Option<Sight>],
) -> Vec<Option<&'a Sight>> {
    let radar = ready.scene.radar();
    let radius_m = 0.5 * radar.spot_fwhm_m();
    let mut nearest = vec![(f64::INFINITY, None); image.width * image.height];
    let frames = radar.frames();
    let aims = ready.scene.chirps.target_points_m(&frames);
    for (aim, sight) in aims.zip(sights) {
        let place = aim.to_array();
        let span = image.span_near(place, radius_m);
        for (pixel, distance_m) in image.pixels_near(place, radius_m, span) {
            if distance_m < nearest[pixel].0 {
                nearest[pixel] = (distance_m, sight.as_ref());
            }
        }
    }
    nearest.into_iter().map(|(_, sight)| sight).collect()
}

/// A box for every instance.
fn boxes(
    ready: &ReadyScene,
    [width, _]: [u32; 2],
    instances: &[u16],
    sights: &[Option<Sight>],
    labels: &Labels,
) -> Vec<InstanceBox> {
    // Columns and rows from and to, and pixels.
    let mut shown: BTreeMap<u16, ([u32; 4], u32)> = BTreeMap::new();
    for (place, &instance) in (0u32..).zip(instances) {
        let (column, row) = (place % width, place / width);
        let (ends, pixels) = shown.entry(instance).or_insert(([column, row, column, row], 0));
        *ends = [ends[0].min(column), ends[1].min(row), ends[2].max(column), ends[3].max(row)];
        *pixels += 1;
    }
    let target = &ready.scene.target;
    let mut boxes = Vec::new();
    for (instance, mesh) in (1u16..).zip(&target.meshes) {
        let facets = &target.mesh.facets[mesh.first_facet..mesh.first_facet + mesh.facets];
        let corners = facets.iter().flatten().map(|vertex| target.mesh.vertices[*vertex as usize]);
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) =
            corners.fold(none, |(min, max), corner| (min.min(corner), max.max(corner)));
        let bbox = shown.get(&instance).map(|([left, top, right, bottom], _)| {
            [*left, *top, right - left + 1, bottom - top + 1]
        });
        boxes.push(InstanceBox {
            instance,
            name: mesh.name.clone(),
            threat: labels.is_object(instance),
            bbox,
            pixels: shown.get(&instance).map_or(0, |(_, pixels)| *pixels),
            chirps: sights.iter().flatten().filter(|sight| sight.instance == instance).count()
                as u32,
            min_m: min.to_array(),
            max_m: max.to_array(),
        });
    }
    boxes
}
