//! A spot of finite size: the power of a chirp is the mean over rays through a Gaussian footprint, its
//! range their mean by power. Rays beside the target bring nothing.

use rayon::prelude::*;

use super::meeting::met;
use super::spread::sunflower;
use super::{Arrived, Effect, Knob, Level, Look, Stage, Survey, Surveyed};
use crate::brdf::{Brdf, Scattering};
use crate::frames::{Direction, Ray};

/// The effect `finite-spot`.
pub(super) struct FiniteSpot;

/// Rays that stand for a spot.
const RAYS: usize = 24;

/// Where one ray of a spot meets the target.
#[derive(Clone, Copy)]
struct Beside {
    range_m: f64,
    cos_theta: f64,
    azimuth_rad: f64,
    region: u16,
}

impl Beside {
    fn of(look: &Look) -> Beside {
        let Look { hit, azimuth_rad, region, .. } = *look;
        Beside { range_m: hit.range_m, cos_theta: hit.cos_theta, azimuth_rad, region }
    }

    /// Equation (11) of the base law, W; nothing where the region has no law.
    fn power_w(&self, stage: &Stage, laws: &[Brdf]) -> f64 {
        let retro =
            Direction::from_angles(self.cos_theta.clamp(-1.0, 1.0).acos(), self.azimuth_rad);
        laws.get(usize::from(self.region)).map_or(0.0, |law| {
            stage.link.power_w(self.range_m, self.cos_theta, law.f_per_sr(retro, retro))
        })
    }
}

/// The ray of a look and those of its spot, as far as they meet the target as the scene has it.
type Spot = (Beside, Vec<Beside>);

fn spot(stage: &Stage, look: &Look, diameter_m: f64) -> Option<Spot> {
    let centre = met(stage, look, look.ray)?;
    // The intensity exp(−4 ln 2·r²/D²) has this standard deviation along each direction.
    let sd_rad = diameter_m / centre.hit.range_m / (8.0 * std::f64::consts::LN_2).sqrt();
    let forward = look.ray.direction.xyz();
    let (u, v) = forward.any_orthonormal_pair();
    let beside = |(share, angle_rad): (f64, f64)| {
        let off = sd_rad * (-2.0 * (1.0 - share).ln()).sqrt();
        let aside = off * (angle_rad.cos() * u + angle_rad.sin() * v);
        let direction = Direction::new(forward + aside)?;
        met(stage, look, Ray { origin: look.ray.origin, direction })
    };
    let met = sunflower(RAYS).filter_map(beside).map(|look| Beside::of(&look));
    Some((Beside::of(&centre), met.collect()))
}

/// What a spot changes: the factor on the power and what adds to the range, m.
///
/// Both are of the base law on the target as the scene has it, so that other effects stay as they are.
fn averaged(stage: &Stage, laws: &[Brdf], (centre, beside): &Spot) -> Option<(f64, f64)> {
    let centre_w = centre.power_w(stage, laws);
    let (mut power_w, mut moment) = (0.0, 0.0);
    for ray in beside {
        let one_w = ray.power_w(stage, laws) / RAYS as f64;
        power_w += one_w;
        moment += one_w * ray.range_m;
    }
    let useful = centre_w > 0.0 && power_w > 0.0;
    useful.then(|| (power_w / centre_w, moment / power_w - centre.range_m))
}

impl Effect for FiniteSpot {
    fn name(&self) -> &'static str {
        "finite-spot"
    }

    fn level(&self) -> Level {
        Level::Instrument
    }

    fn knobs(&self) -> &'static [Knob] {
        const KNOBS: [Knob; 1] = [Knob::new("diameter_m", "m", [0.0, 0.1], 0.0, 0.008)];
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "The beam has a width, here its diameter at half the intensity on the target, and averages \
         over what lies in it: curvature, edges, borders between materials."
    }

    fn shows(&self) -> &'static str {
        "Echoes are too weak beside edges, and the lobe is broader where the surface is curved; flat \
         places far from edges are right. A rougher surface or an error of the angle broadens the lobe \
         on flat places too."
    }

    fn starts(&self, stage: &Stage, _looks: &[Look]) -> Vec<Vec<f64>> {
        let nominal_m = stage.radar.spot_diameter_m;
        [0.1, 0.3, 0.75, 1.5].map(|share| vec![(share * nominal_m).clamp(1e-3, 0.1)]).to_vec()
    }

    /// To where the intensity is 12 dB down.
    fn sees_beside_m(&self, values: &[f64]) -> f64 {
        values.first().copied().unwrap_or_default()
    }

    fn surveyed(&self, values: &[f64]) -> Option<Vec<f64>> {
        values.first().filter(|diameter_m| **diameter_m > 0.0).map(|_| values.to_vec())
    }

    fn survey(&self, values: &[f64], stage: &Stage, looks: &[Look]) -> Survey {
        let diameter_m = values.first().copied().unwrap_or(0.0);
        let spots: Vec<Option<Spot>> =
            looks.par_iter().map(|look| spot(stage, look, diameter_m)).collect();
        Box::new(spots)
    }

    fn arrive(&self, _: &[f64], scan: &Surveyed, laws: &[Brdf], arrived: &mut [Option<Arrived>]) {
        let Some(spots) = scan.survey.and_then(|s| s.downcast_ref::<Vec<Option<Spot>>>()) else {
            return;
        };
        spots.par_iter().zip(arrived).for_each(|(spot, one)| {
            let changed = spot.as_ref().and_then(|spot| averaged(scan.stage, laws, spot));
            if let (Some(one), Some((factor, longer_m))) = (one, changed) {
                one.power_w *= factor;
                one.range_m += longer_m;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};
    use crate::scene::solids;

    #[test]
    fn a_plane_stays_as_it_is() {
        let bench = Bench::of(solids::plate(2.0, 2.0));
        for (bare, with) in bench.bare().iter().zip(bench.with(&FiniteSpot, &[0.016])) {
            // Over the spot the angle still changes by 2 mrad, on a lobe of 0.2.
            assert!(db(with.power_w / bare.power_w).abs() < 0.01);
            assert!((with.range_m - bare.range_m).abs() < 1e-4);
        }
    }

    #[test]
    fn half_a_spot_beside_the_edge_is_half_the_power() {
        let bench = Bench::of(solids::plate(0.5, 2.0));
        let edge = bench.looks.iter().position(|look| look.xt_m > 0.2499);
        let edge = edge.expect("the last column of looks is on the edge");
        let ratio = bench.with(&FiniteSpot, &[0.016])[edge].power_w / bench.bare()[edge].power_w;
        // Of 24 rays a few lie on the edge itself.
        assert!((ratio - 0.5).abs() < 0.1, "{ratio}");
    }
}
