//! Where a scene uses a scattering model, or a single ray for a spot, outside of what its derivation allows.

use std::fmt;

use serde::Serialize;

use super::scene::{ReadyScene, SceneMaterial};
use crate::brdf::{Bound, Brdf, Condition, ScatteringModel};
use crate::effects::Setting;
use crate::formats::words::significant;
use crate::material::Material;
use crate::render::{Footprints, Setup, SpotTilt, spot_tilts};

/// Source of the limit of single rays.
const ONE_RAY: &str = "docs/scattering-models.md, Validity";

/// A condition that a material of a scene does not meet.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValidityWarning {
    /// The material, as the scene names it.
    pub material: String,
    /// The regions that it is about.
    pub regions: Vec<String>,
    /// What is not met.
    #[serde(flatten)]
    pub condition: Condition,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub way_out: Option<&'static str>,
}

/// The conditions of a model, each once, that a surface does not meet at a wavelength, m; `material` is what is known
/// of the surface besides.
pub fn unmet_conditions(
    model: &Brdf,
    wavelength_m: f64,
    material: Option<&Material>,
) -> Vec<Condition> {
    let roughness = material.and_then(|material| material.roughness.as_ref());
    let rms_height_m = roughness.map(|roughness| roughness.rms_height_m);
    let mut unmet = Vec::new();
    for condition in model.conditions(wavelength_m, rms_height_m) {
        if !condition.is_met() && !unmet.contains(&condition) {
            unmet.push(condition);
        }
    }
    unmet
}

/// A sentence on a condition that is not met.
pub fn unmet_sentence(condition: &Condition) -> String {
    let Condition { model, quantity, unit, value, bound, limit, source } = condition;
    let side = match bound {
        Bound::AtLeast => "at least",
        Bound::AtMost => "at most",
    };
    let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
    let [value, limit] = [*value, *limit].map(|number| significant(number, 3) + &unit);
    format!("{model} holds for {quantity} of {side} {limit}, here it is {value} ({source})")
}

impl fmt::Display for ValidityWarning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let regions = self.regions.join("`, `");
        let sentence = unmet_sentence(&self.condition);
        let consequence = self.way_out.unwrap_or("what it returns is extrapolated");
        write!(f, "`{}` on `{regions}`: {sentence}; {consequence}", self.material)
    }
}

impl ReadyScene {
    /// The conditions that this scene does not meet: those of the models of its materials, and, with one ray
    /// for each spot, that the surface is flat within it.
    pub fn validity(&self, setup: &Setup, footprints: &Footprints) -> Vec<ValidityWarning> {
        let mut warnings = Vec::new();
        let wavelength_m = self.scene.radar().wavelength_m();
        for (number, used) in self.materials.iter().enumerate() {
            let unmet =
                unmet_conditions(&used.scattering, wavelength_m, Some(&used.found.material));
            warnings.extend(unmet.into_iter().map(|condition| ValidityWarning {
                material: used.name.clone(),
                regions: self.regions_of(number).map(|region| self.region_name(region)).collect(),
                condition,
                way_out: None,
            }));
        }
        if footprints.rays_per_chirp == 1 && !has_spot_effect(setup) {
            let tilts = spot_tilts(&setup.geometry, footprints);
            for (number, used) in self.materials.iter().enumerate() {
                warnings.extend(self.curved_within_spot(number, used, &tilts));
            }
        }
        warnings
    }

    /// That regions of a material are curved within the spot; the worst of them gives the numbers.
    fn curved_within_spot(
        &self,
        number: usize,
        used: &SceneMaterial,
        tilts: &[Vec<SpotTilt>],
    ) -> Option<ValidityWarning> {
        let lobe_rad = used.scattering.lobe_rad()?;
        let mut regions = Vec::new();
        let mut worst: Option<Condition> = None;
        for region in self.regions_of(number) {
            let Some(condition) = tilts.get(region).and_then(|tilts| flatness(tilts, lobe_rad))
            else {
                continue;
            };
            if condition.is_met() {
                continue;
            }
            regions.push(self.region_name(region));
            if worst
                .is_none_or(|worst| condition.value * worst.limit > worst.value * condition.limit)
            {
                worst = Some(condition);
            }
        }
        Some(ValidityWarning {
            material: used.name.clone(),
            regions,
            condition: worst?,
            way_out: Some("set rays = 16 under [spot]"),
        })
    }

    fn regions_of(&self, material: usize) -> impl Iterator<Item = usize> {
        let materials = self.material_of_region.iter().enumerate();
        materials.filter(move |(_, of)| usize::from(**of) == material).map(|(region, _)| region)
    }

    fn region_name(&self, region: usize) -> String {
        self.scene.target.regions[region].name.clone()
    }
}

/// Whether an effect averages over the spot in place of several rays.
fn has_spot_effect(setup: &Setup) -> bool {
    let mut effects = setup.effects.iter().flat_map(|model| &model.effects);
    effects.any(|(effect, _)| {
        effect.about().conflicts.iter().any(|conflict| conflict.with == Setting::SeveralRays)
    })
}

/// The condition that a surface tilts over a radius of the spot by no more than half the width of its lobe as the
/// beam sees it, m_eff² = m² + δ². A quarter of the surface may: creases and small parts count little.
///
/// A surface of the curvature H answers a spot of the radius w by a lobe of m_eff² + (w·H/2)², which a single ray does
/// not see: with w·H = m_eff its peak on a ball is 10·lg(5/4) = 1 dB too strong.
fn flatness(tilts: &[SpotTilt], lobe_rad: f64) -> Option<Condition> {
    let mut tilts: Vec<(f64, f64)> =
        tilts.iter().map(|tilt| (tilt.tilt_rad, lobe_rad.hypot(tilt.beam_rad))).collect();
    tilts.sort_by(|a, b| (a.0 * b.1).total_cmp(&(b.0 * a.1)));
    let (value, limit) = *tilts.get(3 * tilts.len().saturating_sub(1) / 4)?;
    Some(Condition {
        model: "one ray per spot",
        quantity: "a tilt over one radius of the spot",
        unit: "rad",
        value,
        bound: Bound::AtMost,
        limit,
        source: ONE_RAY,
    })
}
