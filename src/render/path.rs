//! A path from the radar to an antenna, and the sum over several.

use std::f64::consts::TAU;

use num_complex::Complex;

use crate::brdf::Seen;
use crate::radar::Detection;
use crate::trace::Hit;

/// A path from the radar to the antenna.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Half of the path's length, with what sheets on it seem to add, m.
    pub range_m: f64,
    /// Mean power that arrives, W, as the share of one ray of the spot.
    pub power_w: f64,
    /// Intersection with the first surface that scatters on the path.
    pub hit: Hit,
    /// Number of sheets that the radar's ray passes before the first surface.
    pub sheets: u8,
    /// Share of the power, 0 to 1, that all sheets on the path let through.
    pub passed_share: f64,
    /// What sheets on the path seem to add to its range, m.
    pub delay_m: f64,
    /// Numbers of the smooth pieces of the target that the path meets, the smaller one first: there and back on the way round
    /// two mirrors is one wave.
    pub pieces: [u32; 2],
    /// Number of surfaces on the path, 1 or 2.
    pub surfaces: u8,
    /// Azimuth of the source about the normal of the first surface, from its grain, rad.
    pub azimuth_rad: f64,
    /// Share of the power that is specular at every surface of the path, 0 to 1.
    pub specular_share: f64,
    /// Share of the power, 0 to 1, that comes back in one phase from the whole spot and does not speckle.
    pub coherent_share: f64,
}

/// The paths of one echo, added up over all that is known of their phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arrival {
    /// Mean power over the phases of what speckles, and the mean range. Waves add up as amplitudes.
    pub mean: Detection,
    /// Power of the part that speckles, W.
    pub incoherent_w: f64,
    /// Amplitude of the rest, √W, with the phase of a beat over that of an echo from the mean range.
    pub coherent: Complex<f64>,
}

impl Arrival {
    /// An echo of a mean power and range of which one piece returns `coherent_w` in phase.
    pub fn of_one_piece(mean: Detection, coherent_w: f64) -> Arrival {
        let coherent = Complex::from(coherent_w.max(0.0).sqrt());
        Arrival { mean, incoherent_w: (mean.power_w - coherent_w).max(0.0), coherent }
    }

    /// The sum of some paths. The coherent parts of the rays on one smooth piece are one wave, from their mean range.
    pub fn of(paths: &[Path], wavelength_m: f64) -> Arrival {
        let mut mean = sum(paths);
        if let [path] = paths {
            return Arrival::of_one_piece(mean, path.power_w * path.coherent_share);
        }
        let waves = waves_by_surfaces(paths);
        if let [] | [_] = waves[..] {
            let coherent_w = waves.first().map_or(0.0, |(_, wave)| wave.power_w);
            return Arrival::of_one_piece(mean, coherent_w);
        }
        // Between sheets waves go to and fro, which no path follows: there powers add, so that no more returns than was sent.
        let mut layers: Vec<(u8, Complex<f64>)> = Vec::new();
        for ((_, _, sheets), wave) in &waves {
            let phase_rad = 2.0 * TAU / wavelength_m * (wave.range_m - mean.range_m);
            let amplitude = Complex::from_polar(wave.power_w.sqrt(), phase_rad);
            match layers.iter_mut().find(|(other, _)| other == sheets) {
                Some((_, sum)) => *sum += amplitude,
                None => layers.push((*sheets, amplitude)),
            }
        }
        let coherent: Complex<f64> = layers.iter().map(|(_, amplitude)| amplitude).sum();
        let of_layers_w: f64 = layers.iter().map(|(_, amplitude)| amplitude.norm_sqr()).sum();
        let coherent_w: f64 = waves.iter().map(|(_, wave)| wave.power_w).sum();
        let incoherent_w = (mean.power_w - coherent_w).max(0.0);
        mean.power_w = of_layers_w + incoherent_w;
        Arrival { mean, incoherent_w, coherent }
    }

    /// Amplitude of the mean power, √W, where nothing else is known of its phase.
    pub fn steady(&self) -> Complex<f64> {
        Complex::from(self.mean.power_w.sqrt())
    }
}

/// The waves of some paths: the coherent parts of those by way of the same smooth pieces, with their mean range.
pub(super) fn waves(paths: &[Path]) -> Vec<Detection> {
    waves_by_surfaces(paths).into_iter().map(|(_, wave)| wave).collect()
}

fn waves_by_surfaces(paths: &[Path]) -> Vec<(Surfaces, Detection)> {
    let mut pieces: Vec<(Surfaces, Detection)> = Vec::new();
    for path in paths {
        let power_w = path.power_w * path.coherent_share;
        if power_w == 0.0 {
            continue;
        }
        let place = pieces.iter().position(|(surfaces, _)| *surfaces == path.surfaces());
        let place = place.unwrap_or_else(|| {
            pieces.push((path.surfaces(), Detection { range_m: 0.0, power_w: 0.0 }));
            pieces.len() - 1
        });
        let wave = &mut pieces[place].1;
        wave.power_w += power_w;
        // The mean by small steps keeps the precision of a range.
        wave.range_m += (path.range_m - wave.range_m) * (power_w / wave.power_w);
    }
    pieces
}

/// The surfaces that a path goes by, as far as they tell waves apart.
type Surfaces = ([u32; 2], u8, u8);

impl Path {
    /// The way to a hit on a smooth piece and straight back, through nothing.
    pub fn single(hit: Hit, power_w: f64, seen: Seen, piece: u32) -> Path {
        Path {
            range_m: hit.range_m,
            power_w,
            hit,
            sheets: 0,
            passed_share: 1.0,
            delay_m: 0.0,
            pieces: [piece; 2],
            surfaces: 1,
            azimuth_rad: 0.0,
            specular_share: seen.specular_share,
            coherent_share: seen.coherent_share,
        }
    }

    fn surfaces(&self) -> Surfaces {
        (self.pieces, self.surfaces, self.sheets)
    }
}

/// Total power, and the mean range weighted by power; without power, the plain mean of the ranges.
pub(super) fn sum(paths: &[Path]) -> Detection {
    let power_w: f64 = paths.iter().map(|path| path.power_w).sum();
    let range_m = if power_w > 0.0 {
        paths.iter().map(|path| path.range_m * path.power_w).sum::<f64>() / power_w
    } else {
        paths.iter().map(|path| path.range_m).sum::<f64>() / paths.len() as f64
    };
    Detection { range_m, power_w }
}
