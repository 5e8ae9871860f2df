//! Loading a scene: its file, its chirps and its target.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::SceneError;
use super::file::SceneFile;
use super::read::{read_regular, read_text};
use super::receivers;
use super::target::{GivenMeshes, Target};
use crate::material::Material;
use crate::radar::{Chirps, Radar};

/// A scene, ready to be rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The scene file, its title and pixel filled in.
    pub file: SceneFile,
    /// One ray per chirp.
    pub chirps: Chirps,
    /// What stands in front of it.
    pub target: Target,
    /// Materials that are in no database.
    pub given: GivenMaterials,
}

/// Materials by the names that regions give them, before any database is asked.
pub type GivenMaterials = BTreeMap<String, Material>;

impl Scene {
    /// The instrument.
    pub fn radar(&self) -> &Radar {
        &self.file.radar
    }

    /// Side of an image pixel, m.
    pub fn pixel_m(&self) -> f64 {
        pixel_m(&self.file)
    }

    /// Reads a scene file and every mesh it names.
    pub fn load(path: &Path) -> Result<Scene, SceneError> {
        let text = read_text(path)?;
        let at = |error| SceneError::Format { file: path.to_owned(), error };
        Scene::resolve(SceneFile::parse(&text).map_err(at)?, path)
    }

    /// Loads what a scene file describes; relative paths start from the folder of `path`.
    pub fn resolve(file: SceneFile, path: &Path) -> Result<Scene, SceneError> {
        Scene::resolve_given(file, path, &GivenMeshes::new())
    }

    /// As [`Scene::resolve`]; the file of a mesh may be `given:NAME`, with that name in `given`.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub fn resolve_given(
        file: SceneFile,
        path: &Path,
        given: &GivenMeshes,
    ) -> Result<Scene, SceneError> {
        let load = |file: &SceneFile| Target::load(file, path, given);
        Scene::resolve_with(file, path, load, read_beside(path))
    }

    /// As [`Scene::resolve_given`], of a file that differs from that of this scene. Meshes are loaded only where the file
    /// says other things of meshes or regions. Given materials are kept.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub fn replace(
        &self,
        file: SceneFile,
        path: &Path,
        given: &GivenMeshes,
    ) -> Result<Scene, SceneError> {
        let load = |file: &SceneFile| {
            if file.mesh == self.file.mesh && file.region == self.file.region {
                return Ok(self.target.clone());
            }
            Target::load(file, path, given)
        };
        let scene = Scene::resolve_with(file, path, load, read_beside(path))?;
        Ok(Scene { given: self.given.clone(), ..scene })
    }

    /// As [`Scene::resolve`]; `load` gives its target and `read_csv` the bytes of its file of rays.
    pub(crate) fn resolve_with(
        mut file: SceneFile,
        path: &Path,
        load: impl Fn(&SceneFile) -> Result<Target, SceneError>,
        read_csv: impl Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Scene, SceneError> {
        let at = |error| SceneError::Radar { file: path.to_owned(), error };
        file.radar.validate().map_err(at)?;
        let chirps = Chirps::draw(&file.radar, read_csv).map_err(at)?;
        let pixel_m = pixel_m(&file);
        if file.name.chars().count() > 200 {
            let (place, problem) = ("name".to_owned(), "is longer than 200 characters".to_owned());
            let way_out = "shorten it; it is the title of figures".to_owned();
            return Err(SceneError::Value { file: path.to_owned(), place, problem, way_out });
        }
        check_spot(&file, chirps.rays.len(), path)?;
        check_transmission(&file, path)?;
        receivers::check(&file, path)?;
        check_pixel(pixel_m, &file.radar, &chirps, path)?;
        file.image.pixel_m = Some(pixel_m);
        if file.name.is_empty() {
            file.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        let target = load(&file)?;
        Ok(Scene { file, chirps, target, given: GivenMaterials::new() })
    }
}

/// Reads files beside a scene.
fn read_beside(path: &Path) -> impl Fn(&str) -> Result<Vec<u8>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    move |name| read_regular(&folder.join(name)).map_err(|error| error.to_string())
}

/// A spot needs a ray, and all rays together must fit into memory and patience.
fn check_spot(file: &SceneFile, chirps: usize, path: &Path) -> Result<(), SceneError> {
    const MOST_RAYS_PER_CHIRP: usize = 10_000;
    const MOST_RAYS: usize = 50_000_000;
    /// Each is kept while its chirp is received.
    const MOST_PATHS_PER_CHIRP: usize = 100_000;
    let refuse = |place: &str, problem: String, way_out: &str| SceneError::Value {
        file: path.to_owned(),
        place: place.to_owned(),
        problem,
        way_out: way_out.to_owned(),
    };
    let rays = file.spot.rays;
    let possible = 1..=MOST_RAYS_PER_CHIRP;
    if !possible.contains(&rays) || rays.saturating_mul(chirps) > MOST_RAYS {
        let problem = format!("{rays} rays for each of {chirps} chirps");
        return Err(refuse(
            "spot.rays",
            problem,
            "give 1 to 10 000 rays, at most 50 million in all",
        ));
    }
    let Some(bounce) = file.bounce else { return Ok(()) };
    let paths = rays.saturating_mul(bounce.rays);
    if !possible.contains(&bounce.rays) || paths > MOST_PATHS_PER_CHIRP {
        let problem = format!("{} directions from each of {rays} points of a spot", bounce.rays);
        let way_out = "give 1 to 10 000, and no more than 100 000 with spot.rays together";
        return Err(refuse("bounce.rays", problem, way_out));
    }
    if !(-200.0..=0.0).contains(&bounce.outside_spot_db) {
        let problem = format!("{} dB is not a loss", bounce.outside_spot_db);
        return Err(refuse("bounce.outside_spot_db", problem, "give a value from -200 to 0"));
    }
    Ok(())
}

/// Every sheet costs a ray and an echo.
fn check_transmission(file: &SceneFile, path: &Path) -> Result<(), SceneError> {
    let sheets = file.transmission.sheets;
    if (1..=16).contains(&sheets) {
        return Ok(());
    }
    Err(SceneError::Value {
        file: path.to_owned(),
        place: "transmission.sheets".to_owned(),
        problem: format!("{sheets} sheets on the way of a ray"),
        way_out: "give 1 to 16; without a region that transmits, leave the table out".to_owned(),
    })
}

/// The given pixel, or a quarter of the spot, m.
fn pixel_m(file: &SceneFile) -> f64 {
    file.image.pixel_m.unwrap_or(file.radar.spot_fwhm_m() / 4.0)
}

/// A pixel shows nothing below a hundredth of the spot, and an image must fit a page and memory.
fn check_pixel(
    pixel_m: f64,
    radar: &Radar,
    chirps: &Chirps,
    file: &Path,
) -> Result<(), SceneError> {
    const LONGEST_SIDE: f64 = 10_000.0;
    const MOST_PIXELS: f64 = 16e6;
    let spot_m = radar.spot_fwhm_m();
    let sides_m = chirps.field(&radar.frames()).sides_m();
    let [columns, rows] = sides_m.map(|side_m| ((side_m + spot_m) / pixel_m).ceil());
    let fits = columns.max(rows) <= LONGEST_SIDE && columns * rows <= MOST_PIXELS;
    // Coarser pixels would leave gaps: a spot could lie between all pixel centres.
    let coarsest_m = spot_m / std::f64::consts::SQRT_2;
    if pixel_m >= spot_m / 100.0 && pixel_m <= coarsest_m && fits {
        return Ok(());
    }
    Err(SceneError::Value {
        file: file.to_owned(),
        place: "image.pixel_m".to_owned(),
        problem: format!(
            "{pixel_m} m is not between a hundredth and 0.7 of the spot, or gives more than 10 000 \
             pixels on a side or 16 million in all"
        ),
        way_out: format!("a quarter of the spot is {} m", spot_m / 4.0),
    })
}
