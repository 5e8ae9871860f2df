//! How far the surface of a target tilts within the spot of a beam, from what the rays of a scan met.
//!
//! A single ray knows the normal of one facet. Two rays that meet one surface about a spot's radius apart say how
//! far the normal turns in between. The target plane is divided into cells, one hit of each cell is taken, and is
//! compared with those of the cells to the right and above.

use glam::{DVec2, DVec3};

use super::edges::{Frame, is_across, spacing_m};
use super::spot::Footprints;
use crate::radar::Beam;
use crate::trace::{Hit, LocalFrame, ScanGeometry};

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
    let frames = geometry.radar.frames();
    let hits = footprints.hits.chunks(footprints.rays_per_chirp).map(|hits| hits[0].as_ref());
    let aims = geometry.chirps.target_points_m(&frames);
    let looks: Vec<(DVec2, Option<f64>)> =
        aims.zip(&footprints.axis_range_m).map(|(aim_m, range_m)| (aim_m, *range_m)).collect();

    // The first hit of each cell.
    let side_m = geometry.radar.waist_m().max(SPACINGS_PER_CELL * spacing_m(&looks));
    let frame = Frame::around(looks.iter().map(|look| look.0), side_m);
    let mut places: Vec<Option<Place>> = vec![None; frame.columns * frame.rows];
    for ((chirp, &(aim_m, _)), hit) in looks.iter().enumerate().zip(hits) {
        if let (Some(cell), Some(hit)) = (frame.number_at(aim_m), hit) {
            places[cell].get_or_insert(Place { chirp, aim_m, hit });
        }
    }

    let spots = Spots { geometry, beam: Beam::new(geometry.radar) };
    let regions = geometry.region_of_facet.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let mut tilts = vec![Vec::new(); regions];
    for column in 0..frame.columns as i32 {
        for row in 0..frame.rows as i32 {
            let place_at = |column, row| frame.number(column, row).and_then(|cell| places[cell]);
            let Some(here) = place_at(column, row) else { continue };
            for there in [place_at(column + 1, row), place_at(column, row + 1)] {
                let tilt = there.and_then(|there| spots.tilt(&here, &there));
                tilts[spots.region(&here)].extend(tilt);
            }
        }
    }
    tilts
}

/// The target under the spots of a beam.
struct Spots<'a> {
    geometry: &'a ScanGeometry<'a>,
    beam: Beam,
}

impl Spots<'_> {
    /// The tilt between two hits; `None` where another region begins or an edge in depth lies between them.
    fn tilt(&self, here: &Place, there: &Place) -> Option<SpotTilt> {
        let radar = self.geometry.radar;
        let [look, other] = [here, there].map(|place| (place.aim_m, Some(place.hit.range_m)));
        let apart_m = here.hit.point.distance_m(there.hit.point);
        if self.region(here) != self.region(there)
            || is_across(look, other, radar.spot_fwhm_m())
            || apart_m == 0.0
        {
            return None;
        }
        let angle_rad = self.normal(here).angle_between(self.normal(there));
        let beam = self.beam.along(&self.geometry.chirps.rays[here.chirp]);
        let radius_m = beam.section(here.hit.range_m).radius_m;
        let tilt_rad = angle_rad * radius_m / apart_m;
        Some(SpotTilt { tilt_rad, beam_rad: beam.divergence_rad() })
    }

    fn region(&self, place: &Place) -> usize {
        usize::from(self.geometry.region_of_facet[place.hit.facet as usize])
    }

    /// The normal on the side of the radar.
    fn normal(&self, place: &Place) -> DVec3 {
        let to_source = -self.geometry.chirps.rays[place.chirp].direction.xyz();
        LocalFrame::at_hit(self.geometry.bvh.mesh(), place.hit, to_source, DVec3::X).normal()
    }
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
