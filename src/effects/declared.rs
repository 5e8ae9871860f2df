//! The effects that a scene, its radar and its materials declare.

use super::effect::{About, Effect};
use super::entry::EffectList;
use super::library::rank;
use super::model::Model;
use super::receiver::Receiver;
use super::shot::{Shot, Stage};
use crate::brdf::Brdf;

/// All effects of a scene.
#[derive(Clone, Default)]
pub struct SceneEffects {
    everywhere: EffectList,
    on_regions: Vec<(OnRegions, Vec<f64>)>,
}

impl SceneEffects {
    /// Adds effects that act on every shot.
    pub fn add(&mut self, effects: EffectList) {
        self.everywhere.extend(effects);
    }

    /// Adds the effects of a material. They act on the regions for which `is_of_it` is true.
    pub fn add_to_regions(&mut self, effects: EffectList, is_of_it: &[bool]) {
        for (effect, values) in effects {
            self.on_regions.push((OnRegions { effect, is_of_it: is_of_it.to_vec() }, values));
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.everywhere.is_empty() && self.on_regions.is_empty()
    }

    /// The scattering models of the regions with all of these effects.
    pub fn model(&self, laws: Vec<Brdf>, receiver: Receiver) -> Model<'_> {
        let everywhere = self.everywhere.iter().map(|(e, v)| (*e as &dyn Effect, v.clone()));
        let on_regions = self.on_regions.iter().map(|(e, v)| (e as &dyn Effect, v.clone()));
        let mut effects: Vec<_> = everywhere.chain(on_regions).collect();
        effects.sort_by_key(|(effect, _)| rank(effect.name()));
        Model { laws, receiver, effects, level: 1.0 }
    }
}

/// An effect of a material, restricted to the regions of that material.
#[derive(Clone)]
struct OnRegions {
    effect: &'static dyn Effect,
    is_of_it: Vec<bool>,
}

impl OnRegions {
    fn acts_on(&self, shot: &Shot) -> bool {
        self.is_of_it.get(usize::from(shot.region)).copied().unwrap_or(false)
    }
}

impl Effect for OnRegions {
    fn about(&self) -> &About {
        self.effect.about()
    }

    fn starts(&self, stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        self.effect.starts(stage, shots)
    }

    fn scatter(
        &self,
        values: &[f64],
        stage: &Stage,
        law: &Brdf,
        shot: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        if self.acts_on(shot) {
            self.effect.scatter(values, stage, law, shot, f_per_sr)
        } else {
            f_per_sr
        }
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        if self.acts_on(shot) { self.effect.gain(values, stage, shot) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::effects::{Level, library};

    #[test]
    fn a_materials_effect_acts_on_its_own_regions_as_it_would_everywhere() {
        let bench = Bench::sphere();
        for effect in library().into_iter().filter(|e| e.level() == Level::Material) {
            let values = effect.starts(&bench.stage(), &bench.shots).remove(0);
            for (is_of_it, expected) in [(true, bench.with(effect, &values)), (false, bench.bare())]
            {
                let on = OnRegions { effect, is_of_it: vec![is_of_it] };
                assert_eq!(bench.with(&on, &values), expected, "{}", effect.name());
            }
        }
    }
}
