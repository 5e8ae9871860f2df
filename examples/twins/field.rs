//! Speckle as a field that is fixed to the surface: what a chirp receives is the sum over the scatterers in
//! its beam, with the beam's own amplitude and phase.

use std::f64::consts::PI;

use glam::DVec3;
use num_complex::Complex;

use super::base::Base;
use super::beam::{Beam, radius_m};
use super::physics::{Acting, into_target, spot_diameter_m};
use super::scan::{Sight, World};
use super::scatterers::Scatterers;

/// Scatterers per waist and direction: a spot then holds some 60.
const PER_WAIST: f64 = 3.0;
/// Beyond so many radii w the amplitude is below 1.2 % of that on the axis, and adds 1e-4 of the power.
const REACH: f64 = 1.5;

/// The scatterers of a target and the radar that looks at them.
pub struct Field<'a> {
    world: &'a World<'a>,
    acting: &'a [Acting<'a>],
    scatterers: Scatterers,
    sets: usize,
}

/// What the scatterers in one beam add up to.
#[derive(Clone, Debug)]
pub struct Sum {
    /// One per set, E|z|² = 1.
    pub amplitudes: Vec<Complex<f64>>,
    /// The same of real amplitudes without a phase: a Gaussian of variance 1.
    pub texture: f64,
}

impl<'a> Field<'a> {
    /// So many independent sets of amplitudes on the scatterers of a surface.
    pub fn new(
        world: &'a World<'a>,
        seed: u64,
        base: &Base,
        acting: &'a [Acting<'a>],
        sets: usize,
    ) -> Field<'a> {
        let waist_m = world.waist.central_m();
        let widest_m = spot_diameter_m(acting).map_or(waist_m, |d| waist_m.max(radius_m(d)));
        let spacing_m = widest_m / PER_WAIST;
        let scatterers = Scatterers::new(world, seed, base, acting, spacing_m, sets);
        Field { world, acting, scatterers, sets }
    }

    /// What a chirp receives from the range cell about `range_m`. A scatterer counts as the range
    /// transform shows it there: whole at this range, not at all from two cells c/2B on. `None` where no
    /// scatterer is in the beam.
    pub fn sum(&self, sight: &Sight, range_m: f64) -> Option<Sum> {
        let beam = self.beam(sight);
        let [origin, axis] = into_target(self.acting, sight);
        let middle = origin + range_m * axis;
        let radius_m = REACH * beam.radius_m2(range_m).sqrt();
        let depth_m = HANN_ZERO * self.world.range_cell_m;
        let mut amplitudes = vec![Complex::ZERO; self.sets];
        let (mut texture, mut power) = (0.0, 0.0);
        for index in self.scatterers.near(middle, radius_m.hypot(depth_m)) {
            let scatterer = self.scatterers.seen[index];
            let Some(echo) = self.echo(&beam, range_m, scatterer.point - origin, axis, radius_m)
            else {
                continue;
            };
            let gain = scatterer.brightness * echo.share;
            power += gain * gain;
            let turned = Complex::from_polar(gain, echo.phase_rad);
            let set = self.scatterers.amplitudes(index);
            std::iter::zip(&mut amplitudes, set).for_each(|(sum, a)| *sum += a * turned);
            texture += gain * std::f64::consts::SQRT_2 * set[0].re;
        }
        if power <= 0.0 {
            return None;
        }
        let whole = power.sqrt();
        amplitudes.iter_mut().for_each(|sum| *sum /= whole);
        Some(Sum { amplitudes, texture: texture / whole })
    }

    /// Phase, rad, of what a mirror on the axis at a range returns.
    pub fn mirror_phase_rad(&self, sight: &Sight, range_m: f64) -> f64 {
        self.beam(sight).phase_rad(range_m, range_m)
    }

    /// The beam of a chirp, as wide as the effects make it.
    fn beam(&self, sight: &Sight) -> Beam {
        let beam = self.world.waist.towards(sight.place_m);
        spot_diameter_m(self.acting).map_or(beam, |diameter_m| beam.at_least(diameter_m))
    }

    fn echo(
        &self,
        beam: &Beam,
        range_m: f64,
        from_antenna: DVec3,
        axis: DVec3,
        radius_m: f64,
    ) -> Option<Seen> {
        let along_m = from_antenna.dot(axis);
        let off_m2 = from_antenna.length_squared() - along_m * along_m;
        let off_m2 = off_m2.max(0.0);
        if off_m2 > radius_m * radius_m {
            return None;
        }
        let way_m = beam.way_m(along_m, off_m2);
        let cells = (way_m - range_m) / self.world.range_cell_m;
        let share = hann_response(cells) * beam.share(along_m, off_m2);
        (share != 0.0).then(|| Seen { share, phase_rad: beam.phase_rad(along_m, way_m) })
    }
}

/// How a chirp sees one scatterer.
struct Seen {
    share: f64,
    phase_rad: f64,
}

/// First zero of the Hann window's transform, in cells c/2B.
const HANN_ZERO: f64 = 2.0;

/// Fourier transform of the Hann window over its peak, so many cells beside it: sinc x/(1 − x²), and 0
/// instead of side lobes below −31 dB.
fn hann_response(cells: f64) -> f64 {
    const NEAR: f64 = 1e-6;
    let x = cells.abs();
    if x >= HANN_ZERO {
        0.0
    } else if x < NEAR {
        1.0
    } else if (x - 1.0).abs() < NEAR {
        0.5
    } else {
        (PI * x).sin() / (PI * x * (1.0 - x * x))
    }
}
