//! A scan as each antenna of a scene receives it: the radar itself, and every receiver apart from it.

use glam::DVec3;

use super::scene::Assembly;
use crate::effects::Antenna;
use crate::error::Error;
use crate::frames::Point;
use crate::radar::polarisation::Receive;
use crate::radar::{Channel, Radar};
use crate::render::{Footprints, Observer, Scan, Setup, shade, shade_each, trace_placed};
use crate::scene::file::ReceiverEntry;

/// What one antenna received.
pub struct View<'a> {
    /// The receiver; none for the radar itself.
    pub receiver: Option<&'a ReceiverEntry>,
    /// The antenna as the renderer takes it.
    pub observer: Observer,
    /// The polarisation that it receives.
    pub channel: Channel,
    /// Its echoes.
    pub scan: Scan,
}

impl View<'_> {
    /// Name of a file: `power.png` for the radar, `power-NAME.png` for a receiver, with `cross-` in front for
    /// the cross-polar channel.
    pub fn file_name(&self, stem: &str, extension: &str) -> String {
        let channel = match self.channel {
            Channel::CoPolar => "",
            Channel::CrossPolar => "cross-",
        };
        match self.receiver {
            None => format!("{channel}{stem}.{extension}"),
            Some(receiver) => format!("{channel}{stem}-{}.{extension}", receiver.name),
        }
    }
}

/// The antenna of a receiver: with the area that it states, or else that of the radar.
pub fn antenna(receiver: &ReceiverEntry, radar: &Radar) -> Antenna {
    Antenna {
        position: Point::from(DVec3::from_array(receiver.position_m)),
        aperture_m2: receiver.aperture_m2.or(radar.aperture_m2),
    }
}

impl<'a> Assembly<'a> {
    /// Where the rays of the scan meet the target; `advance` hears of chirps as they are done.
    ///
    /// # Errors
    /// What the renderer refuses, with the scene's file.
    pub fn trace(
        &self,
        setup: &Setup,
        advance: &(dyn Fn(usize) + Sync),
    ) -> Result<Footprints, Error> {
        let ready = self.ready();
        trace_placed(setup, ready.scene.file.spot.rays, advance)
            .map_err(|error| ready.render_error("", error))
    }

    /// What the radar receives; `advance` hears of chirps as they are done.
    ///
    /// # Errors
    /// What the renderer refuses, with the scene's file.
    pub fn shade(
        &self,
        setup: &Setup,
        footprints: &Footprints,
        advance: &(dyn Fn(usize) + Sync),
    ) -> Result<Scan, Error> {
        shade(setup, footprints, Observer::Radar, advance)
            .map_err(|error| self.ready().render_error("", error))
    }

    /// The views of the cross-polar channel, in the order of [`views`](Self::views); none if the radar does not
    /// receive it.
    ///
    /// # Errors
    /// What the renderer refuses, with the scene's file and the receiver that it is about.
    pub fn cross_polar_views(
        &self,
        setup: &Setup,
        footprints: &Footprints,
        advance: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<View<'a>>, Error> {
        match self.ready().scene.radar().polarisation.receive {
            Receive::CoPolar => Ok(Vec::new()),
            Receive::Both => {
                self.views(&Setup { channel: Channel::CrossPolar, ..*setup }, footprints, advance)
            }
        }
    }

    /// The radar's own view first, then those of the receivers; `advance` hears of chirps as they are done.
    ///
    /// # Errors
    /// What the renderer refuses, with the scene's file and the receiver that it is about.
    pub fn views(
        &self,
        setup: &Setup,
        footprints: &Footprints,
        advance: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<View<'a>>, Error> {
        let ready = self.ready();
        let receivers = &ready.scene.file.receiver;
        let antennas = receivers.iter().map(|receiver| antenna(receiver, ready.scene.radar()));
        let apart = (1u32..).zip(antennas).map(|(number, Antenna { position, aperture_m2 })| {
            Observer::Receiver { number, position, aperture_m2 }
        });
        let observers: Vec<Observer> = std::iter::once(Observer::Radar).chain(apart).collect();
        let scans = shade_each(setup, footprints, &observers, advance);
        let scans = scans.map_err(|(place, error)| {
            let receiver = place.checked_sub(1).map(|number| &receivers[number].name);
            let about = receiver.map_or(String::new(), |name| format!("receiver `{name}`: "));
            ready.render_error(&about, error)
        })?;
        let receivers = std::iter::once(None).chain(receivers.iter().map(Some));
        let views = receivers.zip(observers).zip(scans);
        let channel = setup.channel;
        Ok(views
            .map(|((receiver, observer), scan)| View { receiver, observer, channel, scan })
            .collect())
    }
}
