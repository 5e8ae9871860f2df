//! The effects that a scene, its radar and its materials declare, each where it acts.

use super::entry::{Chosen, rank};
use super::{Effect, EffectParameter, Level, Model, Receiver, Shot, Stage};
use crate::brdf::Brdf;
use crate::radar::Radar;
use crate::units::watts_from_dbm;

/// All effects of a scene.
#[derive(Clone, Default)]
pub struct SceneEffects {
    everywhere: Chosen,
    on_regions: Vec<(OnRegions, Vec<f64>)>,
}

impl SceneEffects {
    /// Adds effects that act on every look.
    pub fn add(&mut self, effects: Chosen) {
        self.everywhere.extend(effects);
    }

    /// Adds the effects of a material, which act where `is_of_it` of the region is true.
    pub fn add_to_regions(&mut self, effects: Chosen, is_of_it: &[bool]) {
        let on = |(effect, values)| (OnRegions { effect, is_of_it: is_of_it.to_vec() }, values);
        self.on_regions.extend(effects.into_iter().map(on));
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.everywhere.is_empty() && self.on_regions.is_empty()
    }

    /// The base laws of the regions with all of these effects.
    pub fn model(&self, laws: Vec<Brdf>, receiver: Receiver) -> Model<'_> {
        let everywhere = self.everywhere.iter().map(|(e, v)| (*e as &dyn Effect, v.clone()));
        let on_regions = self.on_regions.iter().map(|(e, v)| (e as &dyn Effect, v.clone()));
        let mut effects: Vec<_> = everywhere.chain(on_regions).collect();
        effects.sort_by_key(|(effect, _)| rank(effect.name()));
        Model { laws, receiver, effects }
    }
}

impl Receiver {
    /// The law that a radar declares: its speckle, infinitely many looks where it has none, and the
    /// thermal noise of its `[radar.noise]`.
    pub fn declared(radar: &Radar) -> Receiver {
        Receiver {
            looks: radar.speckle.map_or(f64::INFINITY, |speckle| speckle.looks),
            noise_w: radar.noise.map_or(0.0, |noise| watts_from_dbm(noise.level_dbm)),
            ..Receiver::LINEAR
        }
    }
}

/// An effect of a material: it changes how the regions of that material scatter, and nothing else.
#[derive(Clone)]
struct OnRegions {
    effect: &'static dyn Effect,
    is_of_it: Vec<bool>,
}

impl OnRegions {
    fn acts_on(&self, look: &Shot) -> bool {
        self.is_of_it.get(usize::from(look.region)).copied().unwrap_or(false)
    }
}

impl Effect for OnRegions {
    fn name(&self) -> &'static str {
        self.effect.name()
    }

    fn level(&self) -> Level {
        self.effect.level()
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        self.effect.parameters()
    }

    fn description(&self) -> &'static str {
        self.effect.description()
    }

    fn signature(&self) -> &'static str {
        self.effect.signature()
    }

    fn starts(&self, stage: &Stage, looks: &[Shot]) -> Vec<Vec<f64>> {
        self.effect.starts(stage, looks)
    }

    fn scatter(
        &self,
        values: &[f64],
        stage: &Stage,
        law: &Brdf,
        look: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        match self.acts_on(look) {
            true => self.effect.scatter(values, stage, law, look, f_per_sr),
            false => f_per_sr,
        }
    }

    fn gain(&self, values: &[f64], stage: &Stage, look: &Shot) -> f64 {
        if self.acts_on(look) { self.effect.gain(values, stage, look) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::library;
    use crate::effects::testing::Bench;

    #[test]
    fn a_materials_effect_acts_on_its_own_regions_as_it_would_everywhere() {
        let bench = Bench::sphere();
        for effect in library().into_iter().filter(|e| e.level() == Level::Material) {
            let values = effect.starts(&bench.stage(), &bench.looks).remove(0);
            for (is_of_it, expected) in [(true, bench.with(effect, &values)), (false, bench.bare())]
            {
                let on = OnRegions { effect, is_of_it: vec![is_of_it] };
                assert_eq!(bench.with(&on, &values), expected, "{}", effect.name());
            }
        }
    }
}
