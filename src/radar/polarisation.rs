//! What the antennas send and receive: a linear polarisation and the one across it.
//!
//! Along a direction d of propagation the vertical is v = normalised(y_g − (y_g·d)·d), with y_g the
//! global frame's upward axis, and the horizontal is h = d × v. The paper does not say how its radar is
//! polarised; vertical in both directions is assumed.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::error::Check;

/// The polarisation that is sent, and those that are received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Polarisation {
    /// The field that is sent. Vertical: assumed.
    pub transmit: Linear,
    /// Angle by which the antenna is turned about its axis, from v towards h, degrees, −180 to 180. 0: assumed.
    pub turn_deg: f64,
    /// What is received. The polarisation that was sent: assumed.
    pub receive: Receive,
}

/// A linear polarisation of an antenna that is not turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Linear {
    /// Along v.
    #[default]
    Vertical,
    /// Along h.
    Horizontal,
}

/// What the antennas receive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Receive {
    /// The polarisation that was sent.
    #[default]
    CoPolar,
    /// That, and the one across it, in files of their own.
    Both,
}

/// One of the two polarisations that an antenna receives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// The polarisation that was sent.
    #[default]
    CoPolar,
    /// The one across it.
    CrossPolar,
}

impl Polarisation {
    /// The direction of the field that is sent along `direction`, a unit vector.
    pub fn field(&self, direction: DVec3) -> DVec3 {
        let [vertical, horizontal] = basis(direction);
        let angle_rad = self.turn_deg.to_radians()
            + match self.transmit {
                Linear::Vertical => 0.0,
                Linear::Horizontal => std::f64::consts::FRAC_PI_2,
            };
        let (sin, cos) = angle_rad.sin_cos();
        cos * vertical + sin * horizontal
    }

    /// The direction of the field that a channel receives of a wave that comes back along `direction`, a unit
    /// vector from the antenna. It is that of the field which the channel would send (backscatter alignment).
    pub fn received(&self, direction: DVec3, channel: Channel) -> DVec3 {
        let sent = self.field(direction);
        match channel {
            Channel::CoPolar => sent,
            Channel::CrossPolar => direction.cross(sent),
        }
    }

    pub(super) fn checks(&self) -> Vec<Check> {
        vec![("polarisation.turn_deg", self.turn_deg, (-180.0, 180.0))]
    }
}

/// Vertical and horizontal of a wave along `direction`, a unit vector. Straight up or down, v is along z.
fn basis(direction: DVec3) -> [DVec3; 2] {
    let upwards = DVec3::Y - DVec3::Y.dot(direction) * direction;
    let vertical = upwards.try_normalize().unwrap_or(DVec3::Z);
    [vertical, direction.cross(vertical)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_lie_across_the_direction_and_across_each_other() {
        for direction in [DVec3::NEG_Z, DVec3::new(0.3, -0.5, 0.2).normalize(), DVec3::Y] {
            for turn_deg in [0.0, 30.0, -170.0] {
                let antenna = Polarisation { turn_deg, ..Polarisation::default() };
                let [co, cross] = [Channel::CoPolar, Channel::CrossPolar]
                    .map(|channel| antenna.received(direction, channel));
                let largest = [co.dot(direction), cross.dot(direction), co.dot(cross)]
                    .into_iter()
                    .fold(0.0, |largest: f64, product| largest.max(product.abs()));
                assert!(largest < 1e-15 && (co.length() - 1.0).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_radar_that_looks_ahead_sends_upwards_and_a_turned_one_sideways() {
        let ahead = DVec3::NEG_Z;
        assert_eq!(Polarisation::default().field(ahead), DVec3::Y);
        let horizontal = Polarisation { transmit: Linear::Horizontal, ..Polarisation::default() };
        let turned = Polarisation { turn_deg: 90.0, ..Polarisation::default() };
        assert!((horizontal.field(ahead) - turned.field(ahead)).length() < 1e-15);
        assert!((horizontal.field(ahead) - ahead.cross(DVec3::Y)).length() < 1e-15);
    }
}
