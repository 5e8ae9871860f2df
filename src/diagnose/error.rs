//! Why a scan cannot be diagnosed.

use thiserror::Error;

use super::settings::{LEAST_BLOCKS, LEAST_DETECTIONS};
use crate::fit::FitError;
use crate::radar::RadarError;
use crate::render::RenderError;
use crate::units::dbm_from_watts;

/// Why a diagnosis has no answer.
#[derive(Debug, Error)]
pub enum DiagnoseError {
    /// The scan cannot be traced, for example because no chirp meets the target.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Settings of the range receiver that are out of range.
    #[error(transparent)]
    Radar(#[from] RadarError),
    /// A scattering model cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The points cannot be assigned to chirps.
    #[error(
        "the cloud has no chirp numbers and the rays of the scan do not start from one point; export \
         the cloud with a column `chirp`"
    )]
    Unnumbered,
    /// The points lie on the rays of other chirps.
    #[error(
        "most points of the cloud lie on the rays of the chirps numbered {} {} than they state; number \
         them as the scene's scan does, from its first chirp on, or leave the column `chirp` out",
        .off.unsigned_abs(),
        if *.off > 0 { "lower" } else { "higher" }
    )]
    Misnumbered {
        /// By how much their numbers are too high.
        off: i64,
    },
    /// The chirp numbers are not those of the scan.
    #[error(
        "by their chirp numbers {matched} of the cloud's {points} points lie on the target, and by their \
         directions {placed}: the numbers are not those of the scene's scan; leave the column `chirp` out"
    )]
    Strange {
        /// Points on the target when chirps are found by direction.
        placed: usize,
        /// Points on the target when chirps are found by number.
        matched: usize,
        /// Points.
        points: usize,
    },
    /// Chirps have several detections each.
    #[error(
        "{second} of the cloud's {points} points belong to chirps that already have a point on the target; \
         keep one point of each chirp"
    )]
    Repeated {
        /// Points of chirps that already have one.
        second: usize,
        /// Points.
        points: usize,
    },
    /// The cloud is of another target, or elsewhere.
    #[error(
        "{matched} of the cloud's {points} points lie where the scan meets the mesh; check the scene, \
         its pose and the frame and unit of the cloud, or register it with `matdb measure`"
    )]
    Elsewhere {
        /// Points on the mesh.
        matched: usize,
        /// Points.
        points: usize,
    },
    /// Detections that the declared threshold rules out.
    #[error(
        "{below} of {detected} detections are weaker than the threshold of {:.2} dBm that the \
         scene declares; correct `threshold_dbm` under [radar], or the powers of the cloud",
        dbm_from_watts(*threshold_w)
    )]
    Threshold {
        /// Detections below the threshold.
        below: usize,
        /// Detections.
        detected: usize,
        /// Declared threshold, W.
        threshold_w: f64,
    },
    /// Even with all effects found the model is far off.
    #[error(
        "even with the effects that fit best the residual is {rmse_db:.1} dB rms, and a correct model leaves \
         {noise_floor_db:.1} dB: the target may be another one; check mesh, pose and radar of the scene, or \
         register the cloud with `matdb measure`"
    )]
    FarOff {
        /// Rms residual on held-out patches, dB.
        rmse_db: f64,
        /// Rms residual of a correct model, dB.
        noise_floor_db: f64,
    },
    /// The scenes of several clouds have other meshes.
    #[error(
        "the mesh of cloud {cloud} is not that of the first, moved as a whole: only clouds of one rigid target are \
         diagnosed together; use the same meshes in the same order, or diagnose this cloud alone"
    )]
    OtherTarget {
        /// Number of the cloud, from 1.
        cloud: usize,
    },
    /// The scenes of several clouds have other receivers.
    #[error(
        "cloud {cloud} has other values of [radar.noise], [radar.speckle], `threshold_dbm` or an effect on them than the \
         first: only clouds whose receivers are alike are diagnosed together; diagnose this cloud alone"
    )]
    OtherReceiver {
        /// Number of the cloud, from 1.
        cloud: usize,
    },
    /// Several clouds contradict each other.
    #[error("{sentence}")]
    Contradiction {
        /// Which does, in what, and the way out.
        sentence: String,
    },
    /// Effects over time, and a scan without times.
    #[error(
        "the scan of the scene has no times, and {effects} cannot be identified without them; give its chirps a \
         column `time_s`"
    )]
    Untimed {
        /// Their names.
        effects: String,
    },
    /// Effects on what comes straight back, and a cloud of an antenna apart from the radar's.
    #[error(
        "{effects}: that changes what comes straight back to the radar, and the cloud is that of another antenna; diagnose the \
         radar's own cloud for it"
    )]
    OtherAntenna {
        /// Their names.
        effects: String,
    },
    /// Effects on speckle and noise, and a scene with a range receiver, which averages whole beat signals.
    #[error(
        "{effects}: a range receiver has its own speckle and noise; change `looks` under [radar.speckle] or `noise_figure_db` \
         under [radar.receiver] instead"
    )]
    RangeReceiver {
        /// Their names.
        effects: String,
    },
    /// Effects that move the target, and a scene with second-order paths.
    #[error(
        "{effects}: that moves the target, and [bounce] follows paths on it where the scene has it; remove [bounce], or do not \
         ask for {effects}"
    )]
    Bounce {
        /// Their names.
        effects: String,
    },
    /// Effects that follow rays to the first surface, and a scene with regions that let them pass on.
    #[error(
        "{effects}: that follows rays to the first surface, and regions of the scene let them pass on; remove `transmits` and \
         `thickness_m` of the regions, or do not ask for {effects}"
    )]
    Sheets {
        /// Their names.
        effects: String,
    },
    /// Effects that move the target, and a scene without a range error.
    #[error(
        "the scene states no error of ranges, and {effects} cannot be identified from powers alone; give \
         `range_sd_m` under [radar.noise], which takes the place of [radar.receiver]"
    )]
    Unranged {
        /// Their names.
        effects: String,
    },
    /// The refitted model is far off in many places.
    #[error(
        "the refitted model is far off at {wild} of {shots} chirps: target or power balance may be \
         different ones; check mesh, pose and radar of the scene, or register the cloud with `matdb measure`"
    )]
    Unlike {
        /// Chirps beyond 4.5 standard deviations.
        wild: usize,
        /// Chirps that meet the target.
        shots: usize,
    },
    /// The base was found at a better place after each of [`most_starts`](super::Diagnosis::most_starts) starts, the last
    /// time by more than [`least_gain`](super::Diagnosis::least_gain): what an effect gains over it is not known.
    #[error(
        "the search failed: from each new start the scattering models fit better, the last time by \
         {gain:.1} in ln p; give the materials laws nearer to the data, such as one fitted to a curve of this cloud \
         by `matdb measure` and `matdb fit`"
    )]
    SearchFailed {
        /// Gain in ln likelihood of the last start.
        gain: f64,
    },
    /// Too few detections.
    #[error(
        "{detected} detections on the target cannot distinguish effects; {LEAST_DETECTIONS} are needed, \
         so check scene and threshold, or scan more"
    )]
    TooFew {
        /// Detections.
        detected: usize,
    },
    /// The scanned part of the target is too small for held-out patches.
    #[error(
        "the chirps on the target fill {blocks} patches and {LEAST_BLOCKS} are needed; scan a larger part of \
         the target, or a larger target"
    )]
    TooSmall {
        /// Patches.
        blocks: usize,
    },
    /// The number of observations differs from that of the chirps on the target.
    #[error(
        "{observations} observations do not match {shots} chirps on the target; match the cloud again"
    )]
    Unmatched {
        /// Observations.
        observations: usize,
        /// Chirps on the target.
        shots: usize,
    },
    /// A number of looks without a speckle distribution.
    #[error("{looks} looks of speckle give no likelihood; declare between 0.1 and 10000")]
    Looks {
        /// Declared number of looks.
        looks: f64,
    },
}
