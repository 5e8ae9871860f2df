//! A base law with any number of effects, and what it predicts of a scan.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::{Arrived, Effect, Look, Receiver, Stage, Survey, Surveyed};
use crate::brdf::{Brdf, Scattering};
use crate::frames::Direction;

/// The base law and the effects that were added to it, each with its values.
#[derive(Clone)]
pub struct Model<'a> {
    /// Scattering of each region.
    pub laws: Vec<Brdf>,
    /// Law of the receiver without effects.
    pub receiver: Receiver,
    /// The effects, in the order in which they act.
    pub effects: Vec<(&'a dyn Effect, Vec<f64>)>,
}

/// What a model predicts.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Mean power and range of every look, without thermal noise; `None` where the ray misses.
    pub arrived: Vec<Option<Arrived>>,
    /// d ln(mean power)/dθ of every look, 1/rad, for tilts that vary at random; 0 where none do.
    pub slope_per_rad: Vec<f64>,
    /// The law about the mean.
    pub receiver: Receiver,
}

/// Surveys that were made for one list of looks, for as long as their values come again.
#[derive(Default)]
pub struct Surveys(Mutex<Vec<(Key, Arc<Survey>)>>);

/// Name of an effect and the values that its survey depends on.
type Key = (&'static str, Vec<f64>);

/// Surveys that are kept: those of a difference quotient, of its middle, and of the next.
const KEPT: usize = 6;

impl Surveys {
    fn of(
        &self,
        effect: &dyn Effect,
        values: &[f64],
        stage: &Stage,
        looks: &[Look],
    ) -> Option<Arc<Survey>> {
        let key = (effect.name(), effect.surveyed(values)?);
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = kept.iter().position(|(other, _)| *other == key) {
            let found = kept.remove(at);
            kept.push(found.clone());
            return Some(found.1);
        }
        let made = Arc::new(effect.survey(values, stage, looks));
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push((key, made.clone()));
        Some(made)
    }
}

impl Model<'_> {
    /// What arrives of every look.
    pub fn predict(&self, stage: &Stage, looks: &[Look]) -> Prediction {
        self.predict_with(stage, looks, &Surveys::default())
    }

    /// The same with surveys of these very looks that may have been made before.
    pub fn predict_with(&self, stage: &Stage, looks: &[Look], surveys: &Surveys) -> Prediction {
        let placed: Vec<Option<Look>> =
            looks.par_iter().map(|look| self.placed(stage, *look)).collect();
        let mut arrived: Vec<Option<Arrived>> =
            placed.par_iter().map(|look| Some(self.arrived(stage, look.as_ref()?))).collect();
        self.arrive(stage, looks, surveys, &mut arrived);
        let receiver = self.received();
        // Twice the work of the powers themselves, and of use only where tilts vary.
        let slope = |look: &Option<Look>| match look {
            Some(look) if receiver.tilt_sd_rad > 0.0 => self.slope_per_rad(stage, look),
            _ => 0.0,
        };
        Prediction { slope_per_rad: placed.par_iter().map(slope).collect(), arrived, receiver }
    }

    /// Where a look meets the target, as the effects place it; `None` where its ray misses.
    pub(crate) fn placed(&self, stage: &Stage, look: Look) -> Option<Look> {
        let mut effects = self.effects.iter();
        effects.try_fold(look, |look, (effect, values)| effect.place(values, stage, look))
    }

    /// What arrives of one look by itself.
    pub(crate) fn arrived(&self, stage: &Stage, look: &Look) -> Arrived {
        Arrived { power_w: self.power_w(stage, look), range_m: look.hit.range_m }
    }

    /// What the effects make of all that arrives together.
    pub(crate) fn arrive(
        &self,
        stage: &Stage,
        looks: &[Look],
        surveys: &Surveys,
        arrived: &mut [Option<Arrived>],
    ) {
        for (effect, values) in &self.effects {
            let survey = surveys.of(*effect, values, stage, looks);
            let scan = Surveyed { stage, looks, survey: survey.as_deref() };
            effect.arrive(values, &scan, &self.laws, arrived);
        }
    }

    /// The receiver's law with the effects.
    pub(crate) fn received(&self) -> Receiver {
        let receive =
            |receiver, (effect, values): &(&dyn Effect, Vec<f64>)| effect.receive(values, receiver);
        self.effects.iter().fold(self.receiver, receive)
    }

    /// Equation (11) with every effect on the surface and the gain.
    fn power_w(&self, stage: &Stage, look: &Look) -> f64 {
        let Some(law) = self.laws.get(usize::from(look.region)) else { return 0.0 };
        let retro = Direction::from_angles(look.hit.theta_rad(), look.azimuth_rad);
        let f_per_sr =
            self.effects.iter().fold(law.f_per_sr(retro, retro), |f, (effect, values)| {
                effect.scatter(values, stage, law, look, f)
            });
        let gain: f64 =
            self.effects.iter().map(|(effect, values)| effect.gain(values, stage, look)).product();
        gain * stage.link.power_w(look.hit.range_m, look.hit.cos_theta, f_per_sr)
    }

    fn slope_per_rad(&self, stage: &Stage, look: &Look) -> f64 {
        const STEP_RAD: f64 = 1e-3;
        let at = |theta_rad: f64| {
            let mut look = *look;
            look.hit.cos_theta = theta_rad.cos();
            self.power_w(stage, &look).max(f64::MIN_POSITIVE).ln()
        };
        let theta_rad =
            look.hit.theta_rad().clamp(STEP_RAD, std::f64::consts::FRAC_PI_2 - 2.0 * STEP_RAD);
        (at(theta_rad + STEP_RAD) - at(theta_rad - STEP_RAD)) / (2.0 * STEP_RAD)
    }
}
