//! From the mean of a chirp to what the radar reports: speckle, thermal noise in complex amplitude, the
//! threshold, and a Gaussian range error.

use glam::DVec3;
use matdb::radar::random::Draws;
use num_complex::Complex;
use rayon::prelude::*;

use super::base::Base;
use super::field::{Field, Sum};
use super::physics::{Acting, Echo, Fluctuation, Report};
use super::scan::{Sight, Stream, World, draws};
use super::strength::thermal_w;

/// One row of a cloud.
#[derive(Clone, Copy, Debug)]
pub struct Detection {
    pub chirp: u32,
    pub point: DVec3,
    pub range_m: f64,
    pub power_dbm: f64,
}

/// Where the speckle of a chirp comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grain {
    /// From scatterers on the surface, which neighbouring chirps share.
    Field,
    /// Drawn anew for every chirp.
    Independent,
}

/// What is detected of the means of all chirps.
pub fn observe(
    world: &World,
    seed: u64,
    base: &Base,
    means: &[Option<Echo>],
    acting: &[Acting],
    grain: Grain,
) -> Vec<Detection> {
    let speckle = Speckle::new(world, seed, base, means, acting, grain);
    let detect = |(sight, mean): (&Sight, &Option<Echo>)| {
        let mean = (*mean)?;
        let power_w = speckle.received_w(sight, &mean);
        let error_m = world.range_sd_m * draws(seed, sight.chirp, Stream::Range).gaussian();
        let mut report = Report { range_m: mean.report.range_m + error_m, power_w };
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
    world.sights.par_iter().zip(means).filter_map(detect).collect()
}

/// How the echoes of a scan fluctuate.
struct Speckle<'a> {
    seed: u64,
    law: Fluctuation,
    noise_w: f64,
    /// The scatterers; `None` for draws anew.
    field: Option<Field<'a>>,
    /// Share of each look in a reading.
    shares: Vec<f64>,
    /// Sets of amplitudes per chirp: one per look, and as many again where echoes come by a second surface.
    sets: usize,
}

impl<'a> Speckle<'a> {
    fn new(
        world: &'a World<'a>,
        seed: u64,
        base: &Base,
        means: &[Option<Echo>],
        acting: &'a [Acting<'a>],
        grain: Grain,
    ) -> Speckle<'a> {
        let declared = Fluctuation::Looks(world.looks);
        let law =
            acting.iter().find_map(|(effect, size)| effect.fluctuation(*size)).unwrap_or(declared);
        let shares = match law {
            Fluctuation::Looks(looks) => shares(looks),
            Fluctuation::LogNormal { .. } => vec![1.0],
        };
        let bounces = means.iter().flatten().any(|echo| echo.bounced > 0.0);
        let sets = if bounces { 2 * shares.len() } else { shares.len() };
        let field = (grain == Grain::Field).then(|| Field::new(world, seed, base, acting, sets));
        Speckle { seed, law, noise_w: thermal_w(world, acting), field, shares, sets }
    }

    /// Power of a reading, W.
    fn received_w(&self, sight: &Sight, echo: &Echo) -> f64 {
        let mut random = draws(self.seed, sight.chirp, Stream::Speckle);
        let mut thermal = draws(self.seed, sight.chirp, Stream::Thermal);
        let mean_w = echo.report.power_w;
        match self.law {
            // Echo and noise are Gaussian phasors both; a part of a look has no phasor of its own.
            Fluctuation::Looks(looks) if self.field.is_none() && looks.fract() != 0.0 => {
                (mean_w + self.noise_w) * random.gamma(looks)
            }
            Fluctuation::Looks(_) => {
                let sum = self.sum(sight, echo, &mut random);
                self.looks_w(sight, echo, &sum.amplitudes, &mut thermal)
            }
            Fluctuation::LogNormal { sd_db } => {
                let sd = sd_db * std::f64::consts::LN_10 / 10.0;
                let texture = self.sum(sight, echo, &mut random).texture;
                let factor = (sd * texture - 0.5 * sd * sd).exp();
                mean_w * factor + self.noise_w * thermal.complex_gaussian().norm_sqr()
            }
        }
    }

    /// From the scatterers in the beam; drawn anew where there are none.
    fn sum(&self, sight: &Sight, echo: &Echo, random: &mut Draws) -> Sum {
        let field = self.field.as_ref().and_then(|field| field.sum(sight, echo.cell_m));
        field.unwrap_or_else(|| match self.law {
            Fluctuation::Looks(_) => {
                let amplitudes = (0..self.sets).map(|_| random.complex_gaussian()).collect();
                Sum { amplitudes, texture: 0.0 }
            }
            Fluctuation::LogNormal { .. } => {
                Sum { amplitudes: Vec::new(), texture: random.gaussian() }
            }
        })
    }

    /// The mean intensity of several looks, each a phasor in complex noise.
    fn looks_w(
        &self,
        sight: &Sight,
        echo: &Echo,
        amplitudes: &[Complex<f64>],
        thermal: &mut Draws,
    ) -> f64 {
        let mean_w = echo.report.power_w;
        let phase_rad =
            self.field.as_ref().map_or(0.0, |field| field.mirror_phase_rad(sight, echo.cell_m));
        let mirrored = Complex::from_polar((mean_w * echo.mirrored).sqrt(), phase_rad);
        let direct_w = mean_w * (1.0 - echo.mirrored - echo.bounced).max(0.0);
        let (direct, bounced) = amplitudes.split_at(self.shares.len());
        let mut power_w = 0.0;
        for (look, share) in self.shares.iter().enumerate() {
            let mut sum = mirrored + direct[look] * direct_w.sqrt();
            if let Some(amplitude) = bounced.get(look) {
                sum += amplitude * (mean_w * echo.bounced).sqrt();
            }
            sum += thermal.complex_gaussian() * self.noise_w.sqrt();
            power_w += share * sum.norm_sqr();
        }
        power_w
    }
}

/// Shares of whole looks that together fluctuate as this many do, at least one: all alike but the last, with
/// squares that sum up to 1/looks.
pub fn shares(looks: f64) -> Vec<f64> {
    let looks = looks.max(1.0);
    let full = looks.ceil() - 1.0;
    if full < 1.0 {
        return vec![1.0];
    }
    let both = full * (full + 1.0);
    let root = (full * full - both * (1.0 - 1.0 / looks)).max(0.0).sqrt();
    let share = (full + root) / both;
    let mut shares = vec![share; full as usize];
    shares.push(1.0 - full * share);
    shares
}
