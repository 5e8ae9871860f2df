//! The answer when data allow none: why, and what would help.

use serde::Serialize;

use super::json::json_file;
use super::templates::page;
use crate::diagnose::curve::CurveDiagnoseError;
use crate::diagnose::{DiagnoseError, SCHEMA};
use crate::error::Error;

/// What `report.json` holds instead of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CannotTell {
    /// Version of the schema.
    schema: u32,
    /// Always `cannot-tell`.
    verdict: &'static str,
    /// Why.
    pub reason: String,
    /// Which data or declaration would help.
    pub would_help: String,
    /// Always empty.
    effects: [(); 0],
}

/// The page that says so.
#[derive(Serialize)]
struct Page<'a> {
    title: &'static str,
    /// What was diagnosed.
    subject: &'a str,
    reason: &'a str,
    would_help: &'a str,
}

impl CannotTell {
    /// Why a cloud cannot be diagnosed.
    pub fn of_cloud(error: &DiagnoseError) -> CannotTell {
        CannotTell::new(error.to_string(), would_help(error).to_owned())
    }

    /// Why a curve cannot be diagnosed.
    pub fn of_curve(error: &CurveDiagnoseError) -> CannotTell {
        CannotTell::new(error.to_string(), would_help_curve(error).to_owned())
    }

    fn new(reason: String, would_help: String) -> CannotTell {
        CannotTell { schema: SCHEMA, verdict: "cannot-tell", reason, would_help, effects: [] }
    }

    /// `report.html` and `report.json`; `subject` names what was diagnosed.
    ///
    /// # Errors
    /// None that data could cause.
    pub fn files(&self, subject: &str) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let CannotTell { reason, would_help, .. } = self;
        let html =
            page("cannot_tell.html", &Page { title: "Cannot tell", subject, reason, would_help })?;
        Ok(vec![("report.html".to_owned(), html), ("report.json".to_owned(), json_file(self)?)])
    }
}

fn would_help(error: &DiagnoseError) -> &'static str {
    match error {
        DiagnoseError::TooFew { .. } => {
            "More detections: a scan with more chirps, a lower threshold, or a target that fills more \
             of the field of view. If many points of the cloud were set aside, check that cloud and \
             scene are in one frame; `matdb measure` finds the pose."
        }
        DiagnoseError::TooSmall { .. } => {
            "A scan that meets more of the target, or a target that fills more of the field of view: \
             held-out patches need room."
        }
        DiagnoseError::Unnumbered => {
            "The chirp number of every point, as column `chirp`: without it the chirps without a \
             detection are not known."
        }
        DiagnoseError::Unmatched { .. } => "A cloud of the very scan that the scene describes.",
        DiagnoseError::Looks { .. } => {
            "The looks of speckle that the radar averages, as `looks` under [radar.speckle] in the scene."
        }
        DiagnoseError::Render(_) => {
            "A scene whose target the scan meets: check its place, its unit of length and the scan."
        }
        DiagnoseError::Misnumbered { .. } | DiagnoseError::Strange { .. } => {
            "Chirp numbers as the scan of the scene has them; without the column `chirp` the points are \
             given to their chirps by direction."
        }
        DiagnoseError::SearchFailed { .. } => {
            "Scattering models to start from that are nearer to the data."
        }
        DiagnoseError::Threshold { .. } => {
            "The power below which the radar reports nothing, as `threshold_dbm` under [radar] in the \
             scene, and powers in dBm at the receiver."
        }
        DiagnoseError::Repeated { .. } => "One detection of each chirp, such as the strongest.",
        DiagnoseError::Contradiction { .. } => "A diagnosis of each cloud alone.",
        DiagnoseError::OtherTarget { .. } => "Scenes of the same meshes, each where it stood.",
        DiagnoseError::OtherReceiver { .. } => {
            "Clouds of receivers of the same noise, speckle and threshold."
        }
        DiagnoseError::Untimed { .. } => {
            "The time of every chirp, as column `time_s` of the file under [radar.scan]."
        }
        DiagnoseError::OtherAntenna { .. } => "The cloud of the radar's own antenna.",
        DiagnoseError::RangeReceiver { .. } | DiagnoseError::Radar(_) => {
            "A scene whose [radar.receiver] is the one that measured."
        }
        DiagnoseError::Bounce { .. } => "A scene without [bounce].",
        DiagnoseError::Sheets { .. } => "A scene whose regions let nothing pass.",
        DiagnoseError::Unranged { .. } => {
            "Ranges, and their standard deviation as `range_sd_m` under [radar.noise] in the scene."
        }
        DiagnoseError::Elsewhere { .. }
        | DiagnoseError::Unlike { .. }
        | DiagnoseError::FarOff { .. } => {
            "The scene that was measured, with all of the target where it stood: `matdb measure` finds the \
             pose, and a mesh that lacks parts of the target leaves their detections without a place."
        }
        DiagnoseError::Fit(_) => {
            "Materials of the scene with another law, which `matdb fit` writes, to begin from."
        }
    }
}

fn would_help_curve(error: &CurveDiagnoseError) -> &'static str {
    match error {
        CurveDiagnoseError::TooFew { .. } | CurveDiagnoseError::TooShort { .. } => {
            "More angles, or the same ones at more angles of incidence: runs of neighbouring angles are \
             held out together, and several of them are needed."
        }
        CurveDiagnoseError::Noise { .. } | CurveDiagnoseError::Noiseless => {
            "The scatter of a level, in dB: stated, from repeats, or from neighbouring angles, of which every incidence \
             has three or more."
        }
        CurveDiagnoseError::Contradiction { .. } => {
            "Repeats under the same conditions: a calibration of their common level, or one of them alone."
        }
        CurveDiagnoseError::Fit(_) => "Another law to begin from.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_record_says_why_and_what_would_help() {
        let answer = CannotTell::of_cloud(&DiagnoseError::TooFew { detected: 12 });
        let json = serde_json::to_value(&answer).unwrap();
        assert_eq!(json["verdict"], "cannot-tell");
        assert_eq!(json["schema"], 3);
        assert_eq!(json["effects"], serde_json::json!([]));
        assert!(json["reason"].as_str().unwrap().contains("12 detections"));
        assert!(json["would_help"].as_str().unwrap().contains("threshold"));
    }
}
