//! A scene to begin with, from a measured cloud and the mesh of its target.

use std::collections::HashSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::error::Error;
use crate::formats::words::significant;
use crate::frames::{Global, Point};
use crate::material::Scale;
use crate::measure::{Cloud, median_point, radar_place};
use crate::scene::{GivenMeshes, Scene, SceneError, SceneFile, Target};
use crate::units::dbm_from_watts;

/// What a scene is made of.
#[derive(Clone, Copy, Debug)]
pub struct NewScene<'a> {
    /// The file of the cloud, for the scene's comments.
    pub cloud_file: &'a Path,
    /// The cloud.
    pub cloud: &'a Cloud,
    /// A mesh file, or `builtin:NAME`.
    pub mesh: &'a str,
    /// The scene file to be.
    pub scene_file: &'a Path,
    /// Where the radar stood; `None` to find it from the ranges.
    pub radar_at: Option<Point<Global>>,
    /// The middle of the field of view; `None` for the middle of the points.
    pub look_at: Option<Point<Global>>,
    /// Centre frequency, GHz.
    pub frequency_ghz: f64,
}

/// A scene that loads.
#[derive(Clone, Debug, PartialEq)]
pub struct MadeScene {
    /// Names and bytes of the scene and of its rays, for the scene's folder.
    pub files: Vec<(String, Vec<u8>)>,
    /// Where the radar stood.
    pub radar_at: Point<Global>,
    /// How that is known.
    pub how: String,
    /// What a person should know.
    pub notices: Vec<String>,
}

/// Ranges and distances that differ by more are of another place, m.
const MISMATCH_M: f64 = 0.02;
/// A scatter of ranges that the user should know of, m: a radar of the preset's bandwidth has a third of it.
const SCATTERED_M: f64 = 0.005;
/// Farther apart, cloud and mesh need a rough pose, m: what a registration follows.
const FAR_M: f64 = 0.2;

impl NewScene<'_> {
    /// Writes the scene, and loads it to see that it can be.
    ///
    /// # Errors
    /// A place of the radar that is not known or contradicts the ranges; a mesh that cannot be read; a frequency that no
    /// radar has.
    pub fn make(&self) -> Result<MadeScene, Error> {
        let (radar_at, how, scattered) = self.place()?;
        let points: Vec<DVec3> = self.cloud.points().iter().map(|p| p.point.xyz).collect();
        let middle = Point::from(median_point(&points));
        let look_at = self.look_at.unwrap_or(middle);
        let stem = self.scene_file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let rays_name = format!("{stem}-rays.csv");
        let text = self.text(&stem, radar_at, &how, look_at, &rays_name);
        let rays = self.rays(radar_at)?;
        let name = self.scene_file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files = vec![(name, text.into_bytes()), (rays_name, rays.into_bytes())];
        let scene = self.load(&files)?;
        let far = far_away(radar_at.distance_m(middle));
        let notices = [scattered, far].into_iter().flatten();
        let notices = notices.chain(off_the_mesh(&scene, middle)).collect();
        Ok(MadeScene { files, radar_at, how, notices })
    }

    /// Where the radar stood, how that is known, and what makes it doubtful.
    fn place(&self) -> Result<(Point<Global>, String, Option<String>), Error> {
        let cloud = self.cloud_file.display();
        let Some(at) = self.radar_at else {
            return match radar_place(self.cloud) {
                Ok(place) => {
                    let rms_mm = significant(1e3 * place.rms_m, 2);
                    let scattered = (place.rms_m > SCATTERED_M).then(|| {
                        format!(
                            "the ranges scatter by {rms_mm} mm about the distances to that place: if the radar is more precise, they \
                             are not one-way ranges in metres, or of another place; --radar-at states it"
                        )
                    });
                    let how = format!("found from the ranges, {rms_mm} mm rms");
                    Ok((place.position, how, scattered))
                }
                Err(error) => Err(Error::usage(
                    format!("{cloud}: {error}"),
                    "say where the radar stood, as in --radar-at 0,1.2,3",
                )),
            };
        };
        let mut off_m: Vec<f64> = self
            .cloud
            .points()
            .iter()
            .filter_map(|point| Some((at.distance_m(point.point) - point.range_m?).abs()))
            .collect();
        off_m.sort_by(f64::total_cmp);
        match off_m.get(off_m.len() / 2) {
            Some(typical_m) if *typical_m > MISMATCH_M => Err(Error::usage(
                format!(
                    "{cloud}: its ranges differ from the distances to --radar-at by {:.0} mm",
                    1e3 * typical_m
                ),
                "check both, or leave --radar-at out to find the place from the ranges",
            )),
            _ => Ok((at, "as given".to_owned(), None)),
        }
    }

    /// One ray to each point: `chirp,ox_m,oy_m,oz_m,dx,dy,dz`.
    fn rays(&self, radar_at: Point<Global>) -> Result<String, Error> {
        let mut text = "chirp,ox_m,oy_m,oz_m,dx,dy,dz\n".to_owned();
        let points = self.cloud.points();
        let taken: HashSet<u32> = points.iter().filter_map(|point| point.chirp).collect();
        let mut free = (0..).filter(|number| !taken.contains(number));
        let [ox, oy, oz] = radar_at.xyz.to_array();
        for (place, point) in points.iter().enumerate() {
            let chirp = point.chirp.or_else(|| free.next()).unwrap_or_default();
            let direction = radar_at.towards(point.point).ok_or_else(|| {
                let problem = format!("point {place} lies where the radar stood");
                Error::usage(problem, "leave the point out, or check --radar-at")
            })?;
            let [dx, dy, dz] = direction.xyz().to_array();
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{chirp},{ox},{oy},{oz},{dx},{dy},{dz}");
        }
        Ok(text)
    }

    /// The scene file.
    fn text(
        &self,
        stem: &str,
        radar_at: Point<Global>,
        how: &str,
        look_at: Point<Global>,
        rays: &str,
    ) -> String {
        let range_m = significant(radar_at.distance_m(look_at), 4);
        let [position, looks_at] = [radar_at, look_at].map(|point| {
            let [x, y, z] = point.xyz.to_array().map(|metres| significant(metres, 7));
            format!("[{x}, {y}, {z}]")
        });
        let threshold = match self.cloud.scale {
            Scale::Absolute => {
                let weakest_dbm = dbm_from_watts(
                    self.cloud.points().iter().map(|p| p.power_w).fold(f64::INFINITY, f64::min),
                );
                format!(
                    "threshold_dbm = {}              # what the radar detects at least: the weakest point has {} dBm",
                    significant((10.0 * weakest_dbm).floor() / 10.0, 6),
                    significant(weakest_dbm, 5)
                )
            }
            Scale::Relative => {
                "# threshold_dbm = -77              # of no use with relative powers".to_owned()
            }
        };
        let middle = if self.look_at.is_some() {
            "the middle of the field of view, as given"
        } else {
            "the middle of the points; the spot is narrowest where the radar looked"
        };
        format!(
            "# The scene of {cloud}, written by `matdb new scene`. Change what your radar has otherwise; the book's page on\n\
             # the radar table has every key.\n\
             \n\
             name = {name}\n\
             \n\
             [radar]\n\
             centre_frequency_ghz = {frequency}\n\
             # bandwidth_ghz = 27\n\
             # transmit_power_dbm = 7           # power and loss set the level of a curve; `matdb calibrate` finds the loss\n\
             # system_loss_db = 12.5\n\
             {threshold}\n\
             # spot_diameter_m = 0.016          # of the beam where it is focused, full width at half maximum\n\
             position_m = {position}  # where the rays start: {how}\n\
             look_at_m = {looks_at}   # {middle}\n\
             # up = [0, 1, 0]                   # which way is up in the image\n\
             \n\
             [radar.beam]\n\
             focus_m = {range_m}                    # where the spot is smallest: levels depend on it\n\
             edge_growth = 1.5                  # the spot half a metre from the middle over that in it; 1 where it does not grow\n\
             \n\
             [radar.scan]\n\
             pattern = \"rays\"\n\
             file = {rays}\n\
             complete = false                   # only detected chirps are in it; true once every chirp is, silent ones too\n\
             \n\
             [spot]\n\
             rays = 16                          # the echoes of a radar are of whole spots\n\
             \n\
             [[mesh]]\n\
             name = \"target\"\n\
             file = {mesh}\n\
             # scale = 0.001                    # for a mesh in millimetres; of builtin: ones the size is size_m\n\
             # rotation_deg = [0, 0, 0]\n\
             # translation_m = [0, 0, 0]\n\
             \n\
             [[region]]\n\
             name = \"all\"\n\
             material = \"mannequin-paint\"       # stands in until you have your own\n",
            cloud = one_line(&self.cloud_file.display().to_string()),
            name = quoted(stem),
            frequency = self.frequency_ghz,
            rays = quoted(rays),
            mesh = quoted(&self.mesh_of_scene().display().to_string()),
        )
    }

    /// The mesh as the scene names it: a path from here means another one in another folder.
    fn mesh_of_scene(&self) -> PathBuf {
        let path = Path::new(self.mesh);
        let is_beside = self.scene_file.parent().is_none_or(|folder| folder.as_os_str().is_empty());
        if self.mesh.starts_with("builtin:") || is_beside {
            return path.to_owned();
        }
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
    }

    /// The scene as these files will have it.
    fn load(&self, files: &[(String, Vec<u8>)]) -> Result<Scene, Error> {
        let text = String::from_utf8_lossy(&files[0].1);
        let mut file = SceneFile::parse(&text)
            .map_err(|error| SceneError::Format { file: self.scene_file.to_owned(), error })?;
        for mesh in file.mesh.iter_mut().filter(|mesh| mesh.is_in_a_file()) {
            let path = std::path::absolute(&mesh.file);
            mesh.file = path.map_or(mesh.file.clone(), |path| path.display().to_string());
        }
        let rays = files.get(1).map(|(_, bytes)| bytes.clone()).unwrap_or_default();
        let load = |file: &SceneFile| Target::load(file, self.scene_file, &GivenMeshes::new());
        Ok(Scene::resolve_with(file, self.scene_file, load, |_| Ok(rays.clone()))?)
    }
}

/// A sentence on a radar that stands farther from its points than radars of this kind look.
fn far_away(range_m: f64) -> Option<String> {
    /// Largest range of such a radar, m.
    const FAR_RADAR_M: f64 = 100.0;
    (range_m > FAR_RADAR_M).then(|| {
        format!(
            "the radar stood {} m from the points: are --radar-at and the cloud in metres?",
            significant(range_m, 4)
        )
    })
}

/// A sentence on a cloud, of this middle, that is not where the mesh is.
fn off_the_mesh(scene: &Scene, middle: Point<Global>) -> Option<String> {
    let vertices = &scene.target.mesh.vertices;
    let least = vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let most = vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    // To the box around the mesh, which the middle of the points is near where the target stands as it was measured.
    let beside = middle.xyz - middle.xyz.clamp(least, most);
    (beside.length() > FAR_M).then(|| {
        let shift = middle.xyz - 0.5 * (least + most);
        let [x, y, z] = shift.to_array().map(|metres| significant(metres, 3));
        format!(
            "the middle of the points is {} m beside the mesh: is its unit metres (scale), and its frame that of the cloud? \
             A rough pose for `matdb measure` is --pose {x},{y},{z}",
            significant(beside.length(), 2)
        )
    })
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}
