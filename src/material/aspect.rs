//! From where a point of a curve was lit and seen.

use std::cmp::Ordering;
use std::f64::consts::PI;

use crate::brdf::Scattering;
use crate::frames::{Direction, Surface};

/// From where a surface is lit and seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aspect {
    /// Angle of incidence, rad.
    pub theta_i_rad: f64,
    /// Angle of reflection, rad.
    pub theta_r_rad: f64,
    /// Azimuth between the two, rad: 0 back where the light came from, π on the mirror's side.
    pub delta_phi_rad: f64,
}

impl Aspect {
    /// Backscatter at this incidence, rad.
    pub fn retro(theta_rad: f64) -> Aspect {
        Aspect { theta_i_rad: theta_rad, theta_r_rad: theta_rad, delta_phi_rad: 0.0 }
    }

    /// In the plane of incidence, rad; the angle of the receiver is positive on the mirror's side.
    pub fn in_plane(theta_i_rad: f64, theta_s_rad: f64) -> Aspect {
        let delta_phi_rad = if theta_s_rad > 0.0 { PI } else { 0.0 };
        Aspect { theta_i_rad, theta_r_rad: theta_s_rad.abs(), delta_phi_rad }
    }

    /// Angle of the receiver in the plane of incidence, rad, positive on the mirror's side; `None` out of the plane.
    pub fn theta_s_rad(self) -> Option<f64> {
        const SAME_RAD: f64 = 1e-9;
        let turned = self.delta_phi_rad.rem_euclid(2.0 * PI);
        if self.theta_r_rad == 0.0 || turned.min(2.0 * PI - turned) < SAME_RAD {
            Some(-self.theta_r_rad)
        } else {
            ((turned - PI).abs() < SAME_RAD).then_some(self.theta_r_rad)
        }
    }

    /// By incidence, then by azimuth, then by the angle of the receiver: next to each other are those that see nearly the
    /// same.
    pub fn in_order(&self, other: &Aspect) -> Ordering {
        let [own, theirs] =
            [self, other].map(|of| [of.theta_i_rad, of.delta_phi_rad, of.theta_r_rad]);
        let pairs = std::iter::zip(own, theirs);
        pairs.map(|(a, b)| a.total_cmp(&b)).fold(Ordering::Equal, Ordering::then)
    }

    /// Whether source and receiver are in the same direction.
    pub fn is_retro(self) -> bool {
        self.theta_i_rad == self.theta_r_rad && self.delta_phi_rad == 0.0
    }

    /// Towards the source and towards the receiver.
    pub fn directions(self) -> [Direction<Surface>; 2] {
        let Aspect { theta_i_rad, theta_r_rad, delta_phi_rad } = self;
        [
            Direction::from_angles(theta_i_rad, 0.0),
            Direction::from_angles(theta_r_rad, delta_phi_rad),
        ]
    }

    /// σ⁰ over f, sr: 4π·cos θ_i·cos θ_r, in backscatter that of equation (10).
    pub fn sigma0_per_f(self) -> f64 {
        4.0 * PI * self.theta_i_rad.cos() * self.theta_r_rad.cos()
    }

    /// σ⁰ of a law in this aspect.
    pub fn sigma0(self, law: &dyn Scattering) -> f64 {
        if self.is_retro() {
            return law.sigma0(self.theta_i_rad);
        }
        let [i, o] = self.directions();
        self.sigma0_per_f() * law.f_per_sr(i, o)
    }

    /// Angle between the normal and the middle of the two directions, rad: the tilt of a facet that mirrors one into the
    /// other, in backscatter the incidence.
    pub fn half_angle_rad(self) -> f64 {
        if self.is_retro() {
            return self.theta_i_rad;
        }
        let Aspect { theta_i_rad, theta_r_rad, delta_phi_rad } = self;
        let along = theta_i_rad.sin() + theta_r_rad.sin() * delta_phi_rad.cos();
        let aside = theta_r_rad.sin() * delta_phi_rad.sin();
        along.hypot(aside).atan2(theta_i_rad.cos() + theta_r_rad.cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, Lambert};

    #[test]
    fn the_middle_of_two_directions_is_the_tilt_of_a_mirror() {
        let middle_deg = |i: f64, r: f64, phi: f64| {
            let [theta_i_rad, theta_r_rad, delta_phi_rad] = [i, r, phi].map(f64::to_radians);
            Aspect { theta_i_rad, theta_r_rad, delta_phi_rad }.half_angle_rad().to_degrees()
        };
        assert!(middle_deg(40.0, 40.0, 180.0).abs() < 1e-9, "the mirror");
        assert!((middle_deg(40.0, 40.0, 0.0) - 40.0).abs() < 1e-9, "backscatter");
        assert!((middle_deg(30.0, 50.0, 180.0) - 10.0).abs() < 1e-9);
        assert!((middle_deg(30.0, 50.0, 0.0) - 40.0).abs() < 1e-9);
        // Out of the plane: h is along (1, 1, 2) for directions of 45 degrees a right angle of azimuth apart.
        let expected_deg = 0.5f64.sqrt().atan().to_degrees();
        assert!((middle_deg(45.0, 45.0, 90.0) - expected_deg).abs() < 1e-9, "{expected_deg}");
    }

    #[test]
    fn only_the_plane_of_incidence_has_an_angle_of_the_receiver() {
        for theta_s_rad in [0.3, -0.3] {
            assert_eq!(Aspect::in_plane(0.5, theta_s_rad).theta_s_rad(), Some(theta_s_rad));
        }
        let of = |theta_r_rad: f64, delta_phi_rad: f64| {
            Aspect { theta_i_rad: 0.5, theta_r_rad, delta_phi_rad }.theta_s_rad()
        };
        assert_eq!(of(0.3, -PI), Some(0.3));
        assert_eq!(of(0.3, 0.2), None);
        assert_eq!(of(0.0, 0.2), Some(-0.0));
    }

    #[test]
    fn sigma0_is_f_times_both_cosines() {
        let law = Brdf::Lambert(Lambert { albedo: 0.5 });
        let aspect = Aspect { theta_i_rad: 0.3, theta_r_rad: 1.0, delta_phi_rad: PI };
        let expected = 4.0 * 0.5 * 0.3f64.cos() * 1.0f64.cos();
        assert!((aspect.sigma0(&law) - expected).abs() < 1e-12);
        assert_eq!(Aspect::retro(0.3).sigma0(&law), law.sigma0(0.3));
    }
}
