//! Where a scene uses a scattering model, or a single ray for a spot, outside of what its derivation allows.

use std::fmt;

use serde::Serialize;

use super::scene::{ReadyScene, SceneMaterial};
use crate::brdf::{Bound, Brdf, Condition, Scattering, ScatteringModel, ThroughBeam};
use crate::effects::Setting;
use crate::formats::words::significant;
use crate::frames::Direction;
use crate::material::Material;
use crate::radar::Beam;
use crate::render::{Footprints, Setup, SpotTilt, facet_steps, spot_tilts};

/// Source of the limit of single rays.
const ONE_RAY: &str = "docs/scattering-models.md, Validity";

/// Source of the limit of facets.
const FACETS: &str = "docs/scattering-models.md, Validity";
/// Drop of an echo over the width of a lobe from which on the lobe decides the level, 1 dB: a weak one under a broad
/// lobe does not.
const DECIDES: f64 = 0.794;

/// Width of a lobe over the beam's up to which facets are judged, m ≤ √3·δ. A wider lobe is met by several facets of a
/// spot, whose mean is right: of normals a whole lobe apart it is wrong by 2·exp(−π²), below 0.001 dB.
const MIRROR_LIKE: f64 = 2.0;

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
    pub way_out: Option<String>,
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
        let consequence = self.way_out.as_deref().unwrap_or("what it returns is extrapolated");
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
        warnings.extend(self.coarse_facets(setup));
        warnings
    }

    /// That the facets of regions turn by more than half of a lobe from one to the next.
    fn coarse_facets(&self, setup: &Setup) -> Vec<ValidityWarning> {
        let radar = self.scene.radar();
        let beam_rad = Beam::new(radar).towards(0.0, 0.0).divergence_rad();
        let lobes = self.materials.iter().map(|used| deciding_lobe_rad(&used.scattering, beam_rad));
        let lobes: Vec<Option<f64>> = lobes.collect();
        let lobe_of = |region: usize| lobes[usize::from(self.material_of_region[region])];
        let steps =
            facet_steps(setup.geometry.bvh.mesh(), setup.geometry.region_of_facet, |region| {
                lobe_of(region).is_some()
            });
        let mut warnings = Vec::new();
        for (number, used) in self.materials.iter().enumerate() {
            let Some(lobe_rad) = lobes[number] else { continue };
            let of_regions = self.regions_of(number).filter_map(|region| {
                let step_rad = steps.get(region).copied().flatten()?;
                Some((region, step_rad)).filter(|(_, step_rad)| *step_rad > 0.5 * lobe_rad)
            });
            let coarse: Vec<(usize, f64)> = of_regions.collect();
            let Some(step_rad) = coarse.iter().map(|(_, rad)| *rad).max_by(f64::total_cmp) else {
                continue;
            };
            warnings.push(ValidityWarning {
                material: used.name.clone(),
                regions: coarse.iter().map(|(region, _)| self.region_name(*region)).collect(),
                condition: Condition {
                    model: "a mesh of facets",
                    quantity: "a step between the normals of neighbours",
                    unit: "deg",
                    value: step_rad.to_degrees(),
                    bound: Bound::AtMost,
                    limit: 0.5 * lobe_rad.to_degrees(),
                    source: FACETS,
                },
                way_out: Some(finer(lobe_rad)),
            });
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
        let mut regions = Vec::new();
        let mut worst: Option<Condition> = None;
        for region in self.regions_of(number) {
            let tilts = tilts.get(region).map_or(&[][..], Vec::as_slice);
            let Some(condition) = flatness(tilts, &used.scattering).filter(|one| !one.is_met())
            else {
                continue;
            };
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
            way_out: Some("set rays = 16 under [spot]".to_owned()),
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

/// What to do about facets that step over a lobe.
fn finer(lobe_rad: f64) -> String {
    format!(
        "the lobe that the beam sees is {} deg wide, and the level of glints depends on how the facets lie: give a finer \
         mesh (builtin:sphere-cap in place of builtin:sphere), or a rougher material",
        significant(lobe_rad.to_degrees(), 3)
    )
}

/// Width of the narrowest lobe of a law as a beam sees it, rad, where it is hardly wider than the beam and the echo
/// falls with it.
fn deciding_lobe_rad(law: &Brdf, beam_rad: f64) -> Option<f64> {
    let lobe_rad = law.lobe_rad(beam_rad)?;
    let seen = ThroughBeam { law, beam_rad };
    let [facing, tilted] = [0.0, lobe_rad].map(|theta_rad| {
        let i = Direction::from_angles(theta_rad, 0.0);
        seen.f_per_sr(i, i)
    });
    (lobe_rad <= MIRROR_LIKE * beam_rad && tilted < DECIDES * facing).then_some(lobe_rad)
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
fn flatness(tilts: &[SpotTilt], scattering: &Brdf) -> Option<Condition> {
    let mut tilts = tilts.to_vec();
    tilts.sort_by(|a, b| a.tilt_rad.total_cmp(&b.tilt_rad));
    let upper_quartile = tilts.get(3 * tilts.len().saturating_sub(1) / 4)?;
    Some(Condition {
        model: "one ray per spot",
        quantity: "a tilt over one radius of the spot",
        unit: "rad",
        value: upper_quartile.tilt_rad,
        bound: Bound::AtMost,
        limit: scattering.lobe_rad(upper_quartile.beam_rad)?,
        source: ONE_RAY,
    })
}
