//! Facet slopes that differ along and across a grain: m·√q along it and m/√q across. The grain may turn over the target, as
//! that of wood or of a cloth that is laid over it.

use crate::brdf::{Brdf, CookTorrance, Scattering};
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::lobes::rescaled;
use crate::effects::shot::{Shot, Stage};
use crate::frames::Direction;

pub(crate) struct Anisotropy;

/// Roughness that a lobe can have.
const M_RANGE: [f64; 2] = [1e-3, 2.0];

/// The lobe with its slopes stretched along the grain; the integral of D is kept.
fn stretched(lobe: &CookTorrance, ratio: f64) -> CookTorrance {
    let [least, most] = M_RANGE;
    let root = ratio.max(1e-6).sqrt();
    let across = lobe.m_across.unwrap_or(lobe.m) / root;
    CookTorrance {
        m: (lobe.m * root).clamp(least, most),
        m_across: Some(across.clamp(least, most)),
        ..*lobe
    }
}

const ABOUT: About = About {
    name: "anisotropy",
    level: Level::Material,
    description: "The surface is woven, brushed or machined: rougher along one direction than across it, by \
         this ratio of the slopes; that direction is turned by turn_deg from the grain of its region, and \
         by turn_by_x_deg_per_m and turn_by_y_deg_per_m more for each metre of x_t and y_t.",
    signature: "At one angle of incidence the residual goes up and down twice in a full turn of the azimuth \
         about the normal. Spread over all azimuths it looks like a lobe of another width or an error \
         of the angle, which have no direction; a tilted pose has one, but goes up and down once.",
    parameters: &[
        EffectParameter::new("ratio", "1", [0.1, 10.0], 1.0, 0.1),
        EffectParameter::new("turn_deg", "deg", [-90.0, 90.0], 0.0, 10.0),
        EffectParameter::new("turn_by_x_deg_per_m", "deg/m", [-400.0, 400.0], 0.0, 40.0),
        EffectParameter::new("turn_by_y_deg_per_m", "deg/m", [-400.0, 400.0], 0.0, 40.0),
    ],
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for Anisotropy {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let starts = [[1.2, 0.0], [1.2, 45.0], [1.2, -45.0], [1.0 / 1.2, 0.0]];
        starts.map(|[ratio, turn_deg]| vec![ratio, turn_deg, 0.0, 0.0]).to_vec()
    }

    /// A grain of one direction, and one that turns.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0, 1], &[0, 1, 2, 3]]
    }

    fn scatter(&self, values: &[f64], _: &Stage, law: &Brdf, shot: &Shot, f_per_sr: f64) -> f64 {
        let &[ratio, turn_deg, by_x, by_y] = values else { return f_per_sr };
        if ratio == 1.0 {
            return f_per_sr;
        }
        let theta_rad = shot.hit.theta_rad();
        let retro = shot.to_radar();
        let turn_deg = turn_deg + by_x * shot.xt_m + by_y * shot.yt_m;
        let turned = Direction::from_angles(theta_rad, shot.azimuth_rad - turn_deg.to_radians());
        rescaled(law, retro, f_per_sr, &|lobe| stretched(lobe, ratio).f_per_sr(turned, turned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, lobe};
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    #[test]
    fn the_lobe_widens_along_the_grain_and_narrows_across() {
        let bench = Bench::plate();
        let law = Brdf::CookTorrance(lobe());
        let found = |azimuth_rad: f64, turn_deg: f64| {
            let mut shot = Shot { azimuth_rad, ..bench.shots[0] };
            shot.hit.cos_theta = 0.3f64.cos();
            let f = law.retro_per_sr(0.3);
            Anisotropy.scatter(&[1.5, turn_deg, 0.0, 0.0], &bench.stage(), &law, &shot, f) / f
        };
        assert!(found(0.0, 0.0) > 1.5);
        assert!(found(FRAC_PI_2, 0.0) < 0.7);
        assert!((found(FRAC_PI_2, 90.0) / found(0.0, 0.0) - 1.0).abs() < 1e-9);
        // A grain that has turned by a right angle at a place.
        let mut shot = Shot { azimuth_rad: 0.0, xt_m: 0.2, yt_m: -0.1, ..bench.shots[0] };
        shot.hit.cos_theta = 0.3f64.cos();
        let f = law.retro_per_sr(0.3);
        let there = Anisotropy.scatter(&[1.5, 0.0, 300.0, -300.0], &bench.stage(), &law, &shot, f);
        assert!((there / f / found(0.0, 90.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_slope_law_stays_normalised() {
        let stretched = stretched(&lobe(), 2.0);
        let m = [stretched.m, stretched.m_across.unwrap()];
        assert!((m[0] / m[1] - 2.0).abs() < 1e-12);
        let (thetas, turns) = (1000, 100);
        let (width, turn) = (PI / 2.0 / f64::from(thetas), TAU / f64::from(turns));
        let mut area = 0.0;
        for t in 0..thetas {
            let theta = (f64::from(t) + 0.5) * width;
            for a in 0..turns {
                let h = Direction::from_angles(theta, (f64::from(a) + 0.5) * turn);
                let d = stretched.distribution.d_anisotropic_per_sr(h, m);
                area += d * theta.cos() * theta.sin() * width * turn;
            }
        }
        // The midpoint rule at this width is good to some 1e-5.
        assert!((area - 1.0).abs() < 1e-3, "{area}");
    }
}
