//! How far the surface of a target tilts within the spot of a beam, from what the rays of a scan met.
//!
//! A single ray knows the normal of one facet. Two rays that meet one surface about a spot's radius apart say how
//! far the normal turns in between. The target plane is divided into cells, one hit of each cell is taken, and is
//! compared with those of the cells to the right and above.

use glam::{DVec2, DVec3};

use super::spot::Footprints;
use crate::radar::Beam;
use crate::trace::{Hit, LocalFrame, ScanGeometry};

/// Steepest slope of a surface across the beam; beyond it two hits lie on both sides of an edge.
const STEEPEST: f64 = 2.0;

/// Cells are at least this many mean spacings of the scan wide, so that neighbours have hits.
const SPACINGS_PER_CELL: f64 = 2.0;

/// How a surface lies within a spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotTilt {
    /// Angle between its normals one radius w of the spot apart, rad.
    pub tilt_rad: f64,
    /// Divergence δ of the beam there, rad.
    pub beam_rad: f64,
}

/// Region and cell of the target plane.
type Cell = (u16, i32, i32);

/// Where the first ray of a chirp meets the target.
#[derive(Clone, Copy)]
struct Place<'a> {
    chirp: usize,
    /// Where the chirp looks, in the target plane, m.
    aim_m: DVec2,
    hit: &'a Hit,
}

/// Tilts of the surface within spots all over the target, for each region; none where a region has no two
/// neighbouring hits.
///
/// Tilts across an edge in depth are left out; across a crease of the surface they are large, but few.
pub fn spot_tilts(geometry: &ScanGeometry, footprints: &Footprints) -> Vec<Vec<SpotTilt>> {
    let side_m = cell_m(geometry);
    let mut places = Vec::new();
    let frames = geometry.radar.frames();
    let aims = geometry.chirps.target_points_m(&frames).enumerate();
    for ((chirp, aim_m), hits) in aims.zip(footprints.hits.chunks(footprints.rays_per_chirp)) {
        let Some(hit) = hits.first().and_then(Option::as_ref) else { continue };
        let [column, row] = (aim_m / side_m).floor().to_array().map(|number| number as i32);
        let region = geometry.region_of_facet[hit.facet as usize];
        places.push(((region, column, row), Place { chirp, aim_m, hit }));
    }
    // Sorted, not hashed: the order does not depend on the run.
    places.sort_unstable_by_key(|(cell, place)| (*cell, place.chirp));
    places.dedup_by_key(|(cell, _)| *cell);

    let beam = Beam::new(geometry.radar);
    let regions = geometry.region_of_facet.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let mut tilts = vec![Vec::new(); regions];
    for ((region, column, row), here) in &places {
        for neighbour in [(*region, column + 1, *row), (*region, *column, row + 1)] {
            let there = places.binary_search_by_key(&neighbour, |(cell, _): &(Cell, Place)| *cell);
            let Ok(there) = there else { continue };
            tilts[usize::from(*region)].extend(tilt(geometry, &beam, here, &places[there].1));
        }
    }
    tilts
}

/// Side of the cells, m: a radius of the spot, or more for a scan that steps farther.
fn cell_m(geometry: &ScanGeometry) -> f64 {
    let [width_m, height_m] = geometry.chirps.field(&geometry.radar.frames()).sides_m();
    let chirps = geometry.chirps.rays.len() as f64;
    // Of a scan over an area, and of one along a line.
    let spacing_m = (width_m * height_m / chirps).sqrt().max(width_m.max(height_m) / chirps);
    geometry.radar.waist_m().max(SPACINGS_PER_CELL * spacing_m)
}

/// The tilt between two hits; `None` where an edge in depth lies between them.
fn tilt(geometry: &ScanGeometry, beam: &Beam, here: &Place, there: &Place) -> Option<SpotTilt> {
    let apart_m = here.hit.point.distance_m(there.hit.point);
    let deeper_m = (here.hit.range_m - there.hit.range_m).abs();
    if apart_m == 0.0 || deeper_m > STEEPEST * here.aim_m.distance(there.aim_m) {
        return None;
    }
    let angle_rad = normal(geometry, here).angle_between(normal(geometry, there));
    let beam = beam.along(&geometry.chirps.rays[here.chirp]);
    let radius_m = beam.section(here.hit.range_m).radius_m;
    Some(SpotTilt { tilt_rad: angle_rad * radius_m / apart_m, beam_rad: beam.divergence_rad() })
}

/// The normal on the side of the radar.
fn normal(geometry: &ScanGeometry, place: &Place) -> DVec3 {
    let to_source = -geometry.chirps.rays[place.chirp].direction.xyz();
    LocalFrame::at_hit(geometry.bvh.mesh(), place.hit, to_source, DVec3::X).normal()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::radar::{Chirps, Radar};
    use crate::render::trace;
    use crate::scene::solids;
    use crate::trace::Bvh;

    /// Tilts of a mesh that stands in the middle of the field of view, smallest first.
    fn tilts(mut mesh: Mesh) -> Vec<f64> {
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let (bvh, regions) = (Bvh::new(&mesh), vec![0; mesh.facets.len()]);
        let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &regions);
        let footprints = trace(&geometry, 1, &|_| {}).unwrap();
        let mut found: Vec<f64> =
            spot_tilts(&geometry, &footprints)[0].iter().map(|tilt| tilt.tilt_rad).collect();
        found.sort_by(f64::total_cmp);
        found
    }

    #[test]
    fn a_ball_tilts_by_the_spot_s_radius_over_its_own() {
        for radius_m in [0.08, 0.15] {
            let found = tilts(solids::icosphere(radius_m, 6));
            let radius_of_spot_m = Radar::default().waist_m();
            let median = found[found.len() / 2];
            assert!(found.len() > 50, "{}", found.len());
            // At the focus the spot is as wide as the waist, 0.1 m off the centre 2 % wider.
            let expected = radius_of_spot_m / radius_m;
            assert!((median / expected - 1.0).abs() < 0.06, "{radius_m} m: {median} {expected}");
        }
    }

    #[test]
    fn a_plate_does_not_tilt_and_a_corner_does_only_along_its_fold() {
        assert!(tilts(solids::plate(0.3, 0.3)).iter().all(|tilt| *tilt < 1e-7));
        // A corner of two plates, a right angle open towards the radar.
        let mut corner = Mesh::default();
        for side in [-1.0, 1.0] {
            let mut wing = solids::plate(0.2, 0.2);
            for vertex in &mut wing.vertices {
                let along_m = vertex.x + 0.1;
                (vertex.x, vertex.z) = (side * along_m * 0.5f64.sqrt(), along_m * 0.5f64.sqrt());
            }
            corner.append(&wing).unwrap();
        }
        let found = tilts(corner);
        let folded = found.iter().filter(|tilt| **tilt > 1e-7).count();
        assert!(folded > 0 && folded * 6 < found.len(), "{folded} of {}", found.len());
    }
}
