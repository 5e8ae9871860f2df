//! What a person should not overlook in a rendering.

use super::counts::{Counts, PowerRange, RegionRecord};
use super::record::{MaterialRecord, ReceiverRecord, ScanRecord};
use crate::radar::Radar;
use crate::scene::MeshReport;
use crate::units::{range, rounded};

impl ScanRecord<'_> {
    /// Sentences about what a person should not overlook.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = self.ready.scene.chirps.notices.clone();
        notices.extend(self.outside_theta());
        for MeshReport { name, degenerate_facets, .. } in self.meshes {
            if *degenerate_facets > 0 {
                notices.push(format!(
                    "facets of mesh `{name}` without an area, skipped: {degenerate_facets}"
                ));
            }
        }
        notices.extend(self.unfollowed());
        notices.extend(silent(self.radar, "", self.counts, self.threshold_dbm));
        for ReceiverRecord { name, counts, threshold_dbm, .. } in &self.receivers {
            let antenna = format!(" at receiver `{name}`");
            notices.extend(silent(self.radar, &antenna, *counts, *threshold_dbm));
        }
        for RegionRecord { name, facets, .. } in &self.regions {
            if *facets == 0 {
                notices.push(format!("later regions took all facets of region `{name}`"));
            }
        }
        notices.extend(self.ended());
        notices.extend(outside_image(self.counts));
        notices.extend(self.power_dbm.and_then(|power_dbm| too_strong(self.radar, power_dbm)));
        notices.extend(self.ready.notices());
        notices.extend(self.validity.iter().map(ToString::to_string));
        notices
    }

    /// Rays that could have passed further sheets.
    fn ended(&self) -> Option<String> {
        let most = self.ready.scene.file.transmission.sheets;
        (self.rays_ended > 0).then(|| {
            format!(
                "{} rays end at a sheet, since they have passed {most}; a larger transmission.sheets shows what lies \
                 behind",
                self.rays_ended
            )
        })
    }

    /// Corners, which return over three surfaces.
    fn unfollowed(&self) -> Vec<String> {
        let corners = self.meshes.iter().filter(|mesh| mesh.file == "builtin:trihedral");
        let tell = |mesh: &MeshReport| {
            format!(
                "mesh `{}` returns over three surfaces, and a rendering follows two at most: its echo is missing here; \
                 `matdb calibrate` knows it in closed form",
                mesh.name
            )
        };
        corners.map(tell).collect()
    }

    /// Detections at angles for which their material makes no claim.
    fn outside_theta(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for (material, used) in std::iter::zip(&self.materials, &self.ready.materials) {
            let MaterialRecord { name, detections_outside_theta, theta_outside_deg, .. } = material;
            if *detections_outside_theta > 0 {
                let span_rad = used.found.material.reach().span_rad();
                notices.push(format!(
                    "{detections_outside_theta} detections on `{name}` lie outside the {}° for which it is described, \
                     by up to {theta_outside_deg:.1}°",
                    range(span_rad.map(|rad| rounded(rad.to_degrees())))
                ));
            }
        }
        notices
    }
}

/// That an antenna detects nothing.
fn silent(radar: &Radar, antenna: &str, counts: Counts, threshold_dbm: f64) -> Option<String> {
    if counts.detections > 0 {
        return None;
    }
    let gate = radar.receiver.and_then(|receiver| receiver.gate_m);
    let gate = gate.map_or(String::new(), |[near_m, far_m]| {
        format!(" within the gate of {near_m} to {far_m} m")
    });
    Some(format!("nothing{antenna} reaches the threshold of {threshold_dbm:.1} dBm{gate}"))
}

fn outside_image(counts: Counts) -> Option<String> {
    let Counts { detections, outside_image, .. } = counts;
    (outside_image > 0).then(|| {
        format!(
            "{outside_image} of {detections} detections lie beside the image, which covers what \
             the scan sees at 8 m"
        )
    })
}

/// What rounding and the search for a peak may add to a mirror that returns all, dB.
const SLACK_DB: f64 = 0.05;

/// That the radar receives more than P_t·L, which is what a facing mirror returns.
fn too_strong(radar: &Radar, power_dbm: PowerRange) -> Option<String> {
    let PowerRange { strongest, .. } = power_dbm;
    let most_dbm = radar.transmit_power_dbm - radar.system_loss_db;
    (strongest > most_dbm + SLACK_DB).then(|| {
        format!(
            "the strongest detection, {strongest:.1} dBm, exceeds the {most_dbm:.1} dBm that were sent less system_loss_db; \
             a law returns too much, speckle or noise adds, or aperture_m2 is larger than the beam's"
        )
    })
}
