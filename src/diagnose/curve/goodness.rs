//! Whether a model leaves more than the noise.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::points::Points;
use super::report::CurveUnknown;
use super::select::{Selection, State};

/// Name of structure of unknown origin.
const UNKNOWN: &str = "unknown";
/// Least structure beside a known noise, in standard deviations of that noise: as much as the noise itself.
const LEAST_OF_NOISE: f64 = 1.0;

/// Least size that counts, dB: what is small beside a noise that is known may still be beyond it.
pub(super) fn least_size_db(selection: &Selection) -> f64 {
    let Selection { points, settings, .. } = *selection;
    let noise_db = if points.has_known_noise() { points.noise.sd_db } else { f64::INFINITY };
    settings.least_size_db.min(LEAST_OF_NOISE * noise_db)
}

/// Probability by chance of a residual as large as that of a model; none where the noise is unknown.
pub(super) fn goodness(points: &Points, state: &State) -> Option<f64> {
    let (square_db2, spare) = scatter_db2(points, state);
    let ratio = square_db2 / points.noise.sd_db.powi(2);
    let freedom = points.noise.freedom;
    if !points.has_known_noise() {
        return None;
    }
    let chance = if freedom.is_finite() {
        FisherSnedecor::new(spare, freedom).ok().map(|f| f.sf(ratio))
    } else {
        ChiSquared::new(spare).ok().map(|chi| chi.sf(spare * ratio))
    };
    Some(chance.unwrap_or(1.0))
}

/// Mean square residual of the detections, per degree of freedom, dB², and that number.
fn scatter_db2(points: &Points, State { model, fitted, .. }: &State) -> (f64, f64) {
    let residual_db = points.detected_residuals_db(&model.levels_db(&fitted.at, &points.points));
    let square_db2: f64 = residual_db.iter().map(|residual_db| residual_db.powi(2)).sum();
    let spare = residual_db.len().saturating_sub(model.unknowns()).max(1) as f64;
    (square_db2 / spare, spare)
}

/// More scatter than the noise has.
pub(super) fn scattered(selection: &Selection, state: &State) -> Option<CurveUnknown> {
    let Selection { points, settings, .. } = *selection;
    let p_value = goodness(points, state)?;
    let (square_db2, _) = scatter_db2(points, state);
    let strength_db = (square_db2 - points.noise.sd_db.powi(2)).max(0.0).sqrt();
    let is_found = p_value <= settings.family_error && strength_db >= least_size_db(selection);
    is_found.then(|| unknown("scatter", strength_db, p_value))
}

/// Structure without a curve through it.
pub(super) fn unknown(covariate: &'static str, strength_db: f64, p_value: f64) -> CurveUnknown {
    CurveUnknown {
        name: UNKNOWN,
        covariate,
        at_deg: Vec::new(),
        strength_db,
        held_out_gain: None,
        held_out_se: None,
        held_out_rmse_db: None,
        p_value,
    }
}
