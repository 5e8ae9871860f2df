//! What an antenna's channel receives of the power by way of some surfaces.
//!
//! The specular part keeps the polarisation that facets and sheets give it. The diffuse part is co-polar, and what is
//! depolarised adds to it.

use glam::DVec3;

use super::light::Place;
use super::setup::Setup;
use super::sheet::{Passage, passed_share};
use crate::frames::{Direction, Surface as Local};
use crate::radar::Channel;
use crate::radar::jones::Field;

/// What a channel of the antenna receives of the power on a path.
pub(super) struct Polarised {
    /// Share of the power.
    pub share: f64,
    /// Share that the sheets on the path let through.
    pub passed: f64,
}

/// A path by way of some places to an antenna.
pub(super) struct Journey<'a> {
    pub setup: &'a Setup<'a>,
    /// Whether the antenna is the radar's own.
    pub is_monostatic: bool,
    pub places: &'a [&'a Place<'a>],
    /// Direction from the last place to the antenna.
    pub exit: Direction<Local>,
    /// The ways to, between and from the places.
    pub ways: &'a [Passage],
}

impl Journey<'_> {
    /// What the channel receives of a path with this specular share.
    pub fn polarised_share(&self, specular_share: f64) -> Polarised {
        let Journey { setup, places, ways, .. } = *self;
        let channel = setup.channel;
        let is_straight_back = self.is_monostatic && places.len() == 1;
        let is_free = ways.iter().all(|way| way.sheets == 0);
        let depolarised = match channel {
            Channel::CoPolar => 0.0,
            Channel::CrossPolar => {
                let shares = places.iter().map(|place| place.surface.depolarised_share);
                let largest = shares.fold(0.0, f64::max);
                largest / (1.0 - largest)
            }
        };
        // Straight back a facet, and a diffuse surface, keep the field.
        if is_straight_back && is_free {
            let kept = if channel == Channel::CoPolar { 1.0 } else { 0.0 };
            return Polarised { share: kept + (1.0 - specular_share) * depolarised, passed: 1.0 };
        }
        let Some((first, last)) = places.first().zip(places.last()) else {
            return Polarised { share: 0.0, passed: 1.0 };
        };
        let antenna = setup.geometry.radar.polarisation;
        let sent = antenna.field(-first.frame.world(first.source.xyz()));
        let received = antenna.received(-last.frame.world(self.exit.xyz()), channel);
        let passed = passed_share(sent, received, ways);
        let depolarised = depolarised * passed;
        if is_straight_back {
            let field = ways.iter().fold(Field::linear(sent), |field, way| way.pass(field));
            let kept = field.power_along(received);
            let passed = if channel == Channel::CoPolar { kept } else { passed };
            return Polarised { share: kept + (1.0 - specular_share) * depolarised, passed };
        }
        let specular = if specular_share > 0.0 {
            self.specular_field(sent).power_along(received)
        } else {
            0.0
        };
        let diffuse = if channel == Channel::CoPolar { passed } else { depolarised };
        Polarised { share: specular_share * specular + (1.0 - specular_share) * diffuse, passed }
    }

    /// The field of the specular path, of unit power where it was sent along `sent`.
    fn specular_field(&self, sent: DVec3) -> Field {
        let Journey { places, ways, .. } = *self;
        let mut field = Field::linear(sent);
        for (number, (place, way)) in places.iter().zip(ways).enumerate() {
            let exit = match places.get(number + 1) {
                Some(next) => place.frame.local(-next.frame.world(next.source.xyz())),
                None => self.exit,
            };
            let amplitudes = place.surface.scattering.facet_amplitudes(place.source, exit);
            let [from, to] =
                [-place.source.xyz(), exit.xyz()].map(|local| place.frame.world(local));
            field = way.pass(field).reflected(from, to, amplitudes);
        }
        ways.last().map_or(field, |way| way.pass(field))
    }
}
