//! `view.html` of a catalogue: a ball of every material, one next to the other, as one radar sees them.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::around::{instrument, plane_image};
use super::page::{Balls, Curve, Numbers, PlaneImage, Points, Surface, Values, ViewPage};
use crate::catalogue::{About, CatalogueError, CatalogueView};
use crate::effects::{Level, resolve};
use crate::error::Error;
use crate::formats::figure::Scale;
use crate::formats::words::{counted, fixed, listed, shortened};
use crate::frames::{Point, target_z_m};
use crate::geometry::Mesh;
use crate::material::{Material, Slug};
use crate::radar::scan::Raster;
use crate::radar::{Chirps, Pattern, Radar};
use crate::render::{Echo, Truth};
use crate::scene::file::{MeshEntry, RegionEntry};
use crate::scene::{GivenMeshes, Scene, SceneFile, solids::icosphere};
use crate::setup::ReadyScene;
use crate::store::Store;
use crate::units::dbm_from_watts;

/// Balls of one page. With more it would be slow to load.
const MOST_BALLS: usize = 100;
/// Radius of a ball, m.
const RADIUS_M: f64 = 0.055;
/// From one chirp to the next in the target plane, m.
const STEP_M: f64 = 0.006;
/// Chirps from one ball to the next: an odd number, so that one meets the middle of each.
const STEPS_PER_BALL: usize = 21;
const PITCH_M: f64 = STEP_M * STEPS_PER_BALL as f64;
/// Below the preset's threshold, so that weak surfaces are seen, too, dBm.
const FAINTEST_DBM: f64 = -110.0;
/// What rounding may add to an angle that an entry claims, rad.
const ROUNDING_RAD: f64 = 1e-7;
/// How finely the ball is drawn; it is rendered from [`half_ball`].
const DRAWN_SUBDIVISIONS: u32 = 2;
/// How far below its middle the name of a ball stands, m.
const LABEL_BELOW_M: f64 = RADIUS_M + 0.008;
/// Room for the name, m.
const LABEL_ROOM_M: f64 = 0.95 * PITCH_M;
/// What the scene is called in an error.
const NAME: &str = "view.html";

/// The page of all materials of a database. All balls have the same size, range and beam, so that levels compare.
pub const CATALOGUE_VIEW: CatalogueView = CatalogueView { draw, places };

/// Draws the page.
fn draw(store: &Store, about: &About) -> Result<Vec<u8>, CatalogueError> {
    Chosen::of(store).and_then(|chosen| page(&chosen, about)).map_err(failed)
}

/// Where it shows each material.
fn places(store: &Store) -> Result<BTreeMap<Slug, String>, CatalogueError> {
    let shown = Chosen::of(store).map_err(failed)?.materials;
    let centres = Grid::new(shown.len()).centres.into_iter();
    Ok(shown.into_iter().map(|one| one.slug).zip(centres.map(address)).collect())
}

fn failed(error: Error) -> CatalogueError {
    CatalogueError::View(Box::new(error))
}

/// The materials that a page shows, and the others.
#[derive(Default)]
struct Chosen {
    materials: Vec<Material>,
    /// Names, and why they cannot be rendered.
    left_out: Vec<(Slug, String)>,
    /// How many follow for which the page has no room.
    further: usize,
}

impl Chosen {
    fn of(store: &Store) -> Result<Chosen, Error> {
        let mut chosen = Chosen::default();
        for summary in store.list()? {
            if chosen.materials.len() == MOST_BALLS {
                chosen.further += 1;
                continue;
            }
            let Some(stored) = store.get(&summary.slug, None)? else { continue };
            match obstacle(&stored.material) {
                None => chosen.materials.push(stored.material),
                Some(obstacle) => chosen.left_out.push((summary.slug, obstacle)),
            }
        }
        Ok(chosen)
    }

    /// What the page is, and what it leaves out.
    fn notes(&self) -> Vec<String> {
        let mut notes = vec![format!(
            "Every ball is a material, {:.0} mm wide and in the middle of the same beam. Each point is one ray of the \
             preset radar, with the mean power; the glint of a narrow lobe has the level of a flat surface. Points \
             below {} dBm are left out, and those at angles that an entry does not claim.",
            2e3 * RADIUS_M,
            fixed(FAINTEST_DBM, 0)
        )];
        if !self.left_out.is_empty() {
            let names: Vec<&str> = self.left_out.iter().map(|(slug, _)| slug.as_str()).collect();
            notes.push(format!("Not shown, as they cannot be rendered: {}.", listed(&names)));
        }
        if self.further > 0 {
            let further = counted(self.further, "further material");
            notes.push(format!("Not shown: {further}. This page holds the first {MOST_BALLS}."));
        }
        notes
    }
}

/// Why a material cannot be rendered; none if it can.
fn obstacle(material: &Material) -> Option<String> {
    let law = material.scattering().err().map(|error| error.to_string());
    law.or_else(|| Some(resolve(&material.effects, Level::Material).err()?.to_string()))
}

/// Where the balls are.
struct Grid {
    radar: Radar,
    centres: Vec<DVec3>,
}

impl Grid {
    /// As nearly a square as so many balls make, row by row from the top left.
    fn new(balls: usize) -> Grid {
        let columns = (1..balls).find(|side| side * side >= balls).unwrap_or(1);
        let rows = balls.div_ceil(columns).max(1);
        let [width_m, height_m] = [columns, rows].map(|balls| balls as f64 * PITCH_M);
        let mut radar = Radar {
            threshold_dbm: FAINTEST_DBM,
            scan: Pattern::Raster(Raster {
                lines: rows * STEPS_PER_BALL,
                chirps_per_line: columns * STEPS_PER_BALL,
                width_m,
                height_m,
            }),
            ..Radar::default()
        };
        // The same beam for all.
        radar.beam.edge_growth = 1.0;
        let centres = (0..balls).map(|ball| {
            let [column, row] = [ball % columns, ball / columns].map(|place| place as f64 + 0.5);
            aim(&radar, column * PITCH_M - 0.5 * width_m, 0.5 * height_m - row * PITCH_M)
        });
        let centres = centres.collect();
        Grid { radar, centres }
    }

    /// A scene of balls of these materials.
    fn scene(&self, materials: &[Material]) -> Result<Scene, Error> {
        let radar_at = self.radar.frames().origin().xyz;
        let mut file = SceneFile { radar: self.radar.clone(), ..SceneFile::default() };
        let mut meshes = GivenMeshes::new();
        for (material, centre) in materials.iter().zip(&self.centres) {
            let name = material.slug.to_string();
            file.mesh.push(MeshEntry::of_file(&name, &format!("given:{name}")));
            file.region.push(region_entry(&name));
            meshes.insert(name, half_ball(*centre, radar_at));
        }
        let mut scene = Scene::resolve_given(file, Path::new(NAME), &meshes)?;
        for material in materials {
            scene.given.insert(material.slug.to_string(), material.clone());
        }
        Ok(scene)
    }

    /// The balls as they are drawn.
    fn mesh(&self) -> Option<Surface> {
        let ball = icosphere(RADIUS_M, DRAWN_SUBDIVISIONS);
        let mut mesh = Mesh::default();
        for (number, centre) in (0u32..).zip(&self.centres) {
            let before = number * ball.vertices.len() as u32;
            mesh.vertices.extend(ball.vertices.iter().map(|vertex| *vertex + *centre));
            mesh.facets.extend(ball.facets.iter().map(|facet| facet.map(|at| before + at)));
        }
        Surface::of(&mesh)
    }
}

/// Where a chirp of a pattern through a point of the target plane aims at, at the range of the pattern.
fn aim(radar: &Radar, xt_m: f64, yt_m: f64) -> DVec3 {
    let frames = radar.frames();
    let zt_m = target_z_m(xt_m, yt_m, frames.pattern_range_m, frames.reflector_centre);
    (frames.global_from_target * Point::new(xt_m, yt_m, zt_m.unwrap_or_default())).xyz
}

/// All of the mesh of this name, of the material of this name.
fn region_entry(name: &str) -> RegionEntry {
    RegionEntry {
        name: name.to_owned(),
        material: name.to_owned(),
        thickness_m: None,
        transmits: false,
        grain: None,
        depolarised_share: 0.0,
        mesh: Some(name.to_owned()),
        facets: BTreeMap::new(),
        within_box: None,
        sphere: None,
        half_space: None,
    }
}

/// Parts of a ball with rings of one width, from an angle, ° from where it faces the radar, to another, and how many:
/// narrow where lobes are.
const RINGS_DEG: [([f64; 2], usize); 3] =
    [([0.125, 3.0], 12), ([3.0, 12.0], 9), ([12.0, 90.0], 26)];
/// Facets around a ring, of each kind.
const AROUND: u32 = 40;

/// The half of a ball that faces a radar, in rings about its nearest point: a whole ball of facets of one size would
/// need a million to show a mirror's glint. The innermost ring is flat.
fn half_ball(centre: DVec3, radar: DVec3) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, (radar - centre).normalize());
    let mut angles_deg = vec![RINGS_DEG[0].0[0]];
    for ([from, to], rings) in RINGS_DEG {
        angles_deg.extend((1..=rings).map(|n| from + (to - from) * n as f64 / rings as f64));
    }
    let mut mesh = Mesh::default();
    for theta_deg in &angles_deg {
        let (sin_theta, cos_theta) = theta_deg.to_radians().sin_cos();
        for step in 0..AROUND {
            let (sin, cos) = (f64::from(step) / f64::from(AROUND) * TAU).sin_cos();
            let outwards = DVec3::new(sin_theta * cos, sin_theta * sin, cos_theta);
            mesh.vertices.push(centre + RADIUS_M * (turn * outwards));
        }
    }
    mesh.facets.extend((1..AROUND - 1).map(|step| [0, step, step + 1]));
    for ring in 1..angles_deg.len() as u32 {
        let (inner, outer) = ((ring - 1) * AROUND, ring * AROUND);
        for step in 0..AROUND {
            let next = (step + 1) % AROUND;
            mesh.facets.push([inner + step, outer + step, outer + next]);
            mesh.facets.push([inner + step, outer + next, inner + next]);
        }
    }
    mesh
}

/// What a radar sees of the balls.
#[derive(Default)]
struct Rendered {
    points: Points,
    image: Option<PlaneImage>,
    notices: Vec<String>,
}

impl Rendered {
    fn new(scene: Scene, names: &[&str]) -> Result<Rendered, Error> {
        let ready = ReadyScene::new(scene, Path::new(NAME), None)?;
        let assembly = ready.assemble();
        let setup = assembly.setup();
        let footprints = assembly.trace(&setup, &|_| ())?;
        let mut scan = assembly.shade(&setup, &footprints, &|_| ())?;
        scan.echoes.retain(|echo| is_claimed(&ready, echo));
        let echoes: Vec<&Echo> = scan.detections().collect();
        let colours = (Scale::Sequential, None);
        let image = ready.image(&scan);
        let image = plane_image(&image, "power_dbm", colours, "Received power".to_owned())?;
        let mut notices = ready.notices();
        // What has a way out is about balls, which a note says of all of them.
        let validity = ready.validity(&setup, &footprints);
        let validity = validity.iter().filter(|warning| warning.way_out.is_none());
        notices.extend(validity.map(ToString::to_string));
        Ok(Rendered { points: points(&echoes, names), image: Some(image), notices })
    }
}

/// Whether the material of an echo makes a claim at its angle.
fn is_claimed(ready: &ReadyScene, echo: &Echo) -> bool {
    echo.truth.is_some_and(|truth| {
        let material = ready.material_of_region[usize::from(truth.region)];
        let reach = ready.materials[usize::from(material)].found.material.reach();
        reach.outside_rad(truth.hit.theta_rad()) <= ROUNDING_RAD
    })
}

fn region_of(echo: &Echo) -> Option<usize> {
    echo.truth.map(|truth| usize::from(truth.region))
}

fn points(echoes: &[&Echo], names: &[&str]) -> Points {
    let numbers = |name: &str, value: &dyn Fn(&Echo) -> f64| {
        Values::numbers(name, echoes.iter().map(|echo| value(echo)))
    };
    let known = |name: &str, value: &dyn Fn(&Truth) -> f64| {
        numbers(name, &|echo| echo.truth.as_ref().map_or(f64::NAN, value))
    };
    let regions = echoes.iter().map(|echo| region_of(echo));
    Points {
        count: echoes.len(),
        position_m: Numbers::places(echoes.iter().map(|echo| echo.point.xyz)),
        columns: vec![
            numbers("power_dbm", &|echo| dbm_from_watts(echo.power_w)),
            Values::named("material", names, "not known", regions),
            known("incidence_deg", &|truth| truth.hit.theta_rad().to_degrees()),
            known("specular_share", &|truth| truth.specular_share),
            numbers("range_m", &|echo| echo.range_m),
            numbers("xt_m", &|echo| echo.xt_m),
            numbers("yt_m", &|echo| echo.yt_m),
        ],
    }
}

/// A place to a tenth of a millimetre.
fn rounded(place: DVec3) -> [f64; 3] {
    // Without the sign of a zero.
    place.to_array().map(|at| (1e4 * at).round() / 1e4 + 0.0)
}

/// What stands behind `#` in the address for a view of one ball from the side.
fn address(centre: DVec3) -> String {
    /// Angles of the camera about the ball and of its field of view, rad, and its distance, m.
    const YAW_PITCH_DISTANCE: &str = "0.5,0.3,0.45";
    const FIELD_OF_VIEW: &str = "0.6";
    let [x, y, z] = rounded(centre);
    format!("camera=[{YAW_PITCH_DISTANCE},{x},{y},{z},{FIELD_OF_VIEW}]")
}

/// Renders the balls and makes the page.
fn page(chosen: &Chosen, about: &About) -> Result<Vec<u8>, Error> {
    let Chosen { materials, left_out, .. } = chosen;
    let grid = Grid::new(materials.len());
    let names: Vec<&str> = materials.iter().map(|one| one.slug.as_str()).collect();
    let Rendered { points, image, notices } = if names.is_empty() {
        Rendered::default()
    } else {
        Rendered::new(grid.scene(materials)?, &names)?
    };
    let obstacles = left_out.iter().map(|(slug, obstacle)| format!("`{slug}`: {obstacle}"));
    let labels = std::iter::zip(&names, &grid.centres).map(|(name, centre)| {
        ((*name).to_owned(), rounded(*centre - LABEL_BELOW_M * DVec3::Y), LABEL_ROOM_M)
    });
    let page = ViewPage {
        title: &format!("Materials in three dimensions – {}", shortened(&about.title, 80)),
        kind: "Rendered cloud",
        notes: chosen.notes(),
        points,
        mesh: grid.mesh(),
        radar: instrument(&grid.radar, &Chirps::default()),
        image,
        shapes: Vec::new(),
        curve: Curve { x: "incidence_deg", y: "power_dbm" },
        balls: Some(Balls {
            labels: labels.collect(),
            notices: obstacles.chain(notices).collect(),
        }),
    };
    page.bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;

    /// Balls on the page of the built-in materials, about.
    const BALLS: usize = 40;

    #[test]
    fn a_chirp_meets_every_ball_face_on_so_that_equal_mirrors_have_equal_levels() {
        let steel = builtin::get("steel").unwrap().unwrap();
        let numbered = |number: usize| Material {
            slug: format!("steel-{number}").parse().unwrap(),
            ..steel.clone()
        };
        let materials: Vec<Material> = (0..BALLS).map(numbered).collect();
        let scene = Grid::new(BALLS).scene(&materials).unwrap();
        let ready = ReadyScene::new(scene, Path::new(NAME), None).unwrap();
        let assembly = ready.assemble();
        let setup = assembly.setup();
        let footprints = assembly.trace(&setup, &|_| ()).unwrap();
        let scan = assembly.shade(&setup, &footprints, &|_| ()).unwrap();
        let mut peaks_dbm = vec![f64::NEG_INFINITY; BALLS];
        for echo in scan.detections() {
            let region = region_of(echo).unwrap();
            peaks_dbm[region] = peaks_dbm[region].max(dbm_from_watts(echo.power_w));
        }
        // All that was sent, less what the system loses: a mirror that faces the radar.
        let radar = ready.scene.radar();
        let most_dbm = radar.transmit_power_dbm - radar.system_loss_db;
        // Of steel's reflection, and of a ball that stands nearer than the focus.
        const NEAR_DB: f64 = 0.1;
        for peak_dbm in peaks_dbm {
            assert!((peak_dbm - most_dbm).abs() < NEAR_DB, "{peak_dbm} dBm, {most_dbm} dBm");
        }
    }

    #[test]
    fn balls_stand_in_rows_that_make_a_square_and_do_not_touch() {
        for balls in [0, 1, 2, 40, MOST_BALLS] {
            let centres = Grid::new(balls).centres;
            assert_eq!(centres.len(), balls);
            for (number, one) in centres.iter().enumerate() {
                let others = centres[number + 1..].iter();
                assert!(others.clone().all(|other| one.distance(*other) > 2.0 * RADIUS_M));
            }
        }
    }
}
