//! A scene to be rendered, and the files of its rendering.

use std::path::Path;

use super::beat::BeatShape;
use super::files::{Content, is_of_a_rendering};
use super::record::ScanRecord;
use crate::error::Error;
use crate::formats::exr::Packing;
use crate::geometry::Raster;
use crate::geometry::raster::joined;
use crate::render::RenderError;
use crate::report::json::json_file;
use crate::setup::{ReadyScene, View};
use crate::trace::{Gpu, GpuError, Tracer};

/// A scene to be rendered, and what its files hold.
#[derive(Clone, Copy)]
pub struct RenderRequest<'a> {
    /// The scene.
    pub ready: &'a ReadyScene,
    /// How its rays are traced.
    pub tracer: Tracer<'a>,
    /// A graphics processor that traces them instead.
    pub gpu: Option<&'a Gpu>,
    /// Whether the clouds hold every hit, not only those at or above the threshold.
    pub all_hits: bool,
    /// The shape of the sampled beat signals, where there are to be files of them.
    pub beat: Option<BeatShape>,
    /// How the EXR images are packed.
    pub packing: Packing,
    /// Whether there is a page for each antenna that shows its cloud in three dimensions.
    pub view: bool,
    /// Whether there is a file for each antenna that other programs show in three dimensions.
    pub glb: bool,
    /// Whether images end a spot beyond what any antenna detected.
    pub crop: bool,
}

/// A stage of a rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderStage {
    /// The closest intersection of every ray.
    Trace,
    /// The received power of every chirp at every antenna.
    Power,
    /// The image of every antenna.
    Image,
    /// The bytes of the files.
    Encode,
}

/// How far a rendering has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderProgress {
    /// This stage begins, and the one before it has ended.
    Begin(RenderStage),
    /// The running stage has done this many more chirps.
    Chirps(usize),
}

/// The files of a rendering, what they record, and what they were made of.
pub struct RenderFiles<'a> {
    /// What each antenna received, the radar first, then the same of the cross-polar channel.
    pub views: Vec<View<'a>>,
    /// The image of each view.
    pub images: Vec<Raster>,
    /// What `scan.json` holds.
    pub record: ScanRecord<'a>,
    /// Names and bytes: `power.exr`, `power.png` and `cloud.ply` of every antenna, `scan.json`, and the beat signals,
    /// the pages `view.html` and the files `cloud.glb` that were asked for.
    pub files: Vec<(String, Vec<u8>)>,
}

impl RenderFiles<'_> {
    /// Files in a folder that are named as those of a rendering and that this one does not write: mostly of a receiver, a
    /// polarisation or a beat signal that an earlier one had.
    pub fn left_behind(&self, folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().into_iter().flatten().flatten();
        let mut names: Vec<String> = entries
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| is_of_a_rendering(name))
            .filter(|name| self.files.iter().all(|(written, _)| written != name))
            .collect();
        names.sort_unstable();
        names
    }
}

impl<'a> RenderRequest<'a> {
    /// The usual files of a scene: detections, without beat signals.
    pub fn new(ready: &'a ReadyScene) -> RenderRequest<'a> {
        let (tracer, packing) = (Tracer::Automatic, Packing::Zip16);
        RenderRequest {
            ready,
            tracer,
            gpu: None,
            all_hits: false,
            beat: None,
            packing,
            view: false,
            glb: false,
            crop: false,
        }
    }

    /// Renders the scene and encodes its files; `progress` hears of every stage and of the chirps that are done.
    ///
    /// # Errors
    /// What the tracer or the renderer refuses; a picture that is too large.
    pub fn render(
        &self,
        progress: &(dyn Fn(RenderProgress) + Sync),
    ) -> Result<RenderFiles<'a>, Error> {
        let RenderRequest { ready, all_hits, .. } = *self;
        progress(RenderProgress::Begin(RenderStage::Trace));
        let assembly = ready.assemble();
        let failed = |error: GpuError| ready.render_error("", RenderError::Tracer(error.into()));
        let gpu_mesh = self.gpu.map(|gpu| gpu.hold(assembly.bvh())).transpose().map_err(failed)?;
        let mut setup = assembly.setup();
        setup.geometry.tracer = gpu_mesh.as_ref().map_or(self.tracer, Tracer::Gpu);
        let done = |chirps| progress(RenderProgress::Chirps(chirps));
        let footprints = assembly.trace(&setup, &done)?;

        progress(RenderProgress::Begin(RenderStage::Power));
        let mut views = assembly.views(&setup, &footprints, &done)?;
        let crossed = assembly.cross_polar_views(&setup, &footprints, &done)?;

        progress(RenderProgress::Begin(RenderStage::Image));
        let mut images: Vec<Raster> = views.iter().map(|view| ready.image(&view.scan)).collect();
        let mut crossed_images: Vec<Raster> =
            crossed.iter().map(|view| ready.image(&view.scan)).collect();
        if self.crop {
            let margin_m = ready.scene.radar().spot_fwhm_m();
            crop(images.iter_mut().chain(&mut crossed_images), margin_m);
        }

        progress(RenderProgress::Begin(RenderStage::Encode));
        let validity = ready.validity(&setup, &footprints);
        let mut record =
            ScanRecord::new(ready, assembly.model(), &views, &crossed, &images, validity, all_hits);
        record.rays_ended = footprints.ended;
        let content = Content { all_hits, packing: self.packing, view: self.view, glb: self.glb };
        let mut files = content.encode(ready, &views, &images, &record)?;
        files.extend(content.encode(ready, &crossed, &crossed_images, &record)?);
        files.push(("scan.json".to_owned(), json_file(&record)?));
        if let Some(shape) = self.beat {
            for view in &views {
                files.push(shape.encode(ready, &setup, &footprints, view)?);
            }
        }
        views.extend(crossed);
        images.extend(crossed_images);
        Ok(RenderFiles { views, images, record, files })
    }
}

/// Cuts images of one size to what is detected in any of them, and a margin around it.
fn crop<'a>(images: impl Iterator<Item = &'a mut Raster>, margin_m: f64) {
    let images: Vec<&mut Raster> = images.collect();
    let filled = images.iter().filter_map(|image| image.filled("power_dbm")).reduce(joined);
    let Some(filled) = filled else { return };
    for image in images {
        let margin = (margin_m / image.pixel_m).ceil() as usize;
        let [rows, columns] = filled.clone();
        let wider = [(rows, image.height), (columns, image.width)].map(|(filled, most)| {
            filled.start.saturating_sub(margin)..(filled.end + margin).min(most)
        });
        *image = image.part(wider);
    }
}
