//! A spot of finite size: the power of a chirp is the mean over rays through a Gaussian footprint, its
//! range their mean by power. Rays beside the target bring nothing.

use rayon::prelude::*;

use super::meeting::{base_power_w, met};
use super::spread::sunflower;
use super::{Arrived, Effect, Knob, Level, Look, Stage};
use crate::brdf::Brdf;
use crate::frames::{Direction, Ray};

/// The effect `finite-spot`.
pub(super) struct FiniteSpot;

/// Rays that stand for a spot.
const RAYS: usize = 24;

/// What the spot changes at a look: the factor on its power and what adds to its range, m.
///
/// Both are of the base law on the target as the scene has it, so that other effects stay as they are.
fn averaged(stage: &Stage, laws: &[Brdf], look: &Look, diameter_m: f64) -> Option<(f64, f64)> {
    let centre = met(stage, look, look.ray)?;
    let centre_w = base_power_w(stage, laws, &centre);
    // The intensity exp(−4 ln 2·r²/D²) has this standard deviation along each direction.
    let sd_rad = diameter_m / centre.hit.range_m / (8.0 * std::f64::consts::LN_2).sqrt();
    let forward = look.ray.direction.xyz();
    let (u, v) = forward.any_orthonormal_pair();
    let (mut power_w, mut moment) = (0.0, 0.0);
    for (share, angle_rad) in sunflower(RAYS) {
        let off = sd_rad * (-2.0 * (1.0 - share).ln()).sqrt();
        let aside = off * (angle_rad.cos() * u + angle_rad.sin() * v);
        let Some(direction) = Direction::new(forward + aside) else { continue };
        if let Some(beside) = met(stage, look, Ray { origin: look.ray.origin, direction }) {
            let one_w = base_power_w(stage, laws, &beside) / RAYS as f64;
            power_w += one_w;
            moment += one_w * beside.hit.range_m;
        }
    }
    let useful = centre_w > 0.0 && power_w > 0.0;
    useful.then(|| (power_w / centre_w, moment / power_w - centre.hit.range_m))
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
        [0.75, 1.5].map(|share| vec![(share * nominal_m).clamp(1e-3, 0.1)]).to_vec()
    }

    fn arrive(
        &self,
        values: &[f64],
        stage: &Stage,
        laws: &[Brdf],
        looks: &[Look],
        arrived: &mut [Arrived],
    ) {
        let &[diameter_m] = values else { return };
        if diameter_m == 0.0 {
            return;
        }
        looks.par_iter().zip(arrived).for_each(|(look, one)| {
            if let Some((factor, longer_m)) = averaged(stage, laws, look, diameter_m) {
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
