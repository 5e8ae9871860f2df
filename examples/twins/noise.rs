//! From the mean of a chirp to what the radar reports: speckle by random phasors, thermal noise in
//! complex amplitude, the threshold, and a Gaussian range error.

use glam::DVec3;
use matdb::radar::random::Draws;

use super::physics::{Acting, Fluctuation, Report};
use super::scan::{Stream, World, draws};
use super::strength::thermal_w;

/// One row of a cloud.
#[derive(Clone, Copy, Debug)]
pub struct Detection {
    pub chirp: u32,
    pub point: DVec3,
    pub range_m: f64,
    pub power_dbm: f64,
}

/// What is detected of the means of all chirps.
pub fn observe(
    world: &World,
    seed: u64,
    means: &[Option<Report>],
    acting: &[Acting],
) -> Vec<Detection> {
    let noise_w = thermal_w(world, acting);
    let declared = Fluctuation::Looks(world.looks);
    let law =
        acting.iter().find_map(|(effect, size)| effect.fluctuation(*size)).unwrap_or(declared);
    let detect = |(sight, mean): (&super::scan::Sight, &Option<Report>)| {
        let mean = (*mean)?;
        let power_w = fluctuating_w(mean.power_w, noise_w, law, seed, sight.chirp);
        let error_m = world.range_sd_m * draws(seed, sight.chirp, Stream::Range).gaussian();
        let mut report = Report { range_m: mean.range_m + error_m, power_w };
        if report.power_w < world.threshold_w {
            return None;
        }
        for (effect, size) in acting {
            report = effect.reported(*size, sight.chirp, report)?;
        }
        let at = sight.ray.origin.xyz + report.range_m * sight.ray.direction.xyz();
        let power_dbm = 10.0 * (1e3 * report.power_w).log10();
        (report.power_w >= world.threshold_w).then_some(Detection {
            chirp: world.numbers[sight.chirp],
            point: at,
            range_m: report.range_m,
            power_dbm,
        })
    };
    std::iter::zip(&world.sights, means).filter_map(detect).collect()
}

fn fluctuating_w(mean_w: f64, noise_w: f64, law: Fluctuation, seed: u64, chirp: usize) -> f64 {
    let mut speckle = draws(seed, chirp, Stream::Speckle);
    let mut thermal = draws(seed, chirp, Stream::Thermal);
    match law {
        Fluctuation::Looks(looks) if looks.fract() == 0.0 => {
            phasors_w(mean_w, noise_w, looks as u32, [&mut speckle, &mut thermal])
        }
        // Echo and noise are Gaussian phasors both; a part of a look has no phasor of its own.
        Fluctuation::Looks(looks) => (mean_w + noise_w) * speckle.gamma(looks),
        Fluctuation::LogNormal { sd_db } => {
            let sd = sd_db * std::f64::consts::LN_10 / 10.0;
            let factor = (sd * speckle.gaussian() - 0.5 * sd * sd).exp();
            mean_w * factor + noise_w * thermal.complex_gaussian().norm_sqr()
        }
    }
}

/// The mean intensity of several looks, each a random phasor in complex noise.
fn phasors_w(mean_w: f64, noise_w: f64, looks: u32, [speckle, thermal]: [&mut Draws; 2]) -> f64 {
    let look = |_| {
        let echo = speckle.complex_gaussian() * mean_w.sqrt();
        (echo + thermal.complex_gaussian() * noise_w.sqrt()).norm_sqr()
    };
    (0..looks).map(look).sum::<f64>() / f64::from(looks)
}
