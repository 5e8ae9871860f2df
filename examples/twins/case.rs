//! One case from its plan: scene, effects of the wanted strength, cloud, and the label apart.

use std::fs;
use std::io;
use std::path::Path;

use matdb::radar::random::Draws;
use matdb::scene::Scene;
use serde_json::{Value, json};

use super::base::Base;
use super::instrument::{Compression, Drift, FovGain, NoiseFloor, Speckle};
use super::noise::{Grain, observe};
use super::physics::{Acting, Class, Effect, means};
use super::scan::{Stream, World, draws};
use super::scenes::{Declared, Geometry, files};
use super::strength::{material, rms_db, size_of};
use super::surface::{
    Anisotropy, CorrelatedShadowing, CoveringLayer, ForeignPatch, Subsurface, ThinFilm,
};
use super::target::{AngleError, FiniteSpot, Motion, MultiBounce, Pose};
use super::unknowns::{
    CoarseSteps, Dropouts, Ghost, ImageAzimuth, LogNormalSpeckle, MirrorRipple, Rope, StandingWave,
};
use super::write;

/// The names that a library is expected to have.
pub const KNOWN: [&str; 16] = [
    "subsurface",
    "speckle",
    "fov-gain",
    "angle-error",
    "finite-spot",
    "noise-floor",
    "covering-layer",
    "anisotropy",
    "thin-film",
    "multi-bounce",
    "pose",
    "motion",
    "compression",
    "drift",
    "correlated-shadowing",
    "foreign-patch",
];

/// The names that it is not.
pub const UNKNOWN: [&str; 8] = [
    "mirror-ripple",
    "standing-wave",
    "image-azimuth",
    "rope-shadow",
    "coarse-steps",
    "dropouts",
    "ghost-echo",
    "log-normal-speckle",
];

/// The known ones that have another form.
pub const OTHER: [&str; 13] = [
    "subsurface",
    "fov-gain",
    "angle-error",
    "finite-spot",
    "covering-layer",
    "anisotropy",
    "thin-film",
    "multi-bounce",
    "motion",
    "compression",
    "drift",
    "correlated-shadowing",
    "foreign-patch",
];

/// Two effects at once.
pub const PAIRS: [[&str; 2]; 10] = [
    ["fov-gain", "foreign-patch"],
    ["subsurface", "drift"],
    ["angle-error", "covering-layer"],
    ["finite-spot", "fov-gain"],
    ["noise-floor", "drift"],
    ["compression", "foreign-patch"],
    ["anisotropy", "covering-layer"],
    ["motion", "fov-gain"],
    ["speckle", "drift"],
    ["pose", "subsurface"],
];

/// An effect with its size.
type Scaled = (Box<dyn Effect>, f64);

/// Which forms the effects take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Shapes {
    /// Those that a modeller would write down first.
    Usual,
    /// Those of nature and hardware, where `OTHER` has the name.
    Other,
}

/// What a case is to be.
#[derive(Clone, Debug)]
pub struct Plan {
    pub seed: u64,
    /// Tells plans of one seed apart.
    pub number: usize,
    /// Tells tries of one plan apart.
    pub attempt: usize,
    pub effects: Vec<&'static str>,
    pub class: Option<Class>,
    pub geometry: Geometry,
    pub chirps: usize,
    /// Where speckle comes from: two plans that differ in nothing else have the same name and truth.
    pub grain: Grain,
    pub shapes: Shapes,
}

/// What became of a plan.
pub enum Outcome {
    /// The label, with the name of the case.
    Written(Value),
    /// An effect that cannot be as strong as that here, and how strong it gets.
    OutOfReach(Value),
}

impl Plan {
    /// Draws and names follow from what the plan is, so that cases do not depend on each other.
    fn key(&self) -> (u64, String) {
        let shapes = match self.shapes {
            Shapes::Usual => "",
            Shapes::Other => "/other",
        };
        let what = format!(
            "{}/{:?}/{:?}/{}/{}{shapes}",
            self.seed, self.effects, self.class, self.number, self.attempt
        );
        let hash = blake3::hash(what.as_bytes());
        let mut seed = [0; 8];
        seed.copy_from_slice(&hash.as_bytes()[..8]);
        (u64::from_le_bytes(seed), format!("case-{}", &hash.to_hex()[20..30]))
    }

    /// Writes `cases/NAME/` and `labels/NAME.json`.
    pub fn run(&self, out: &Path) -> io::Result<Outcome> {
        let (seed, name) = self.key();
        let folder = out.join("cases").join(&name);
        fs::create_dir_all(&folder)?;
        let mut random = draws(seed, 0, Stream::Geometry);
        let mut declared = Declared::draw(self.geometry, self.chirps, &mut random);
        // Only a mirror has a bearing.
        declared.explicit_rays &= !self.effects.contains(&"mirror-ripple");
        for (file, text) in files(&declared, &mut random) {
            fs::write(folder.join(file), text)?;
        }
        let scene = Scene::load(&folder.join("scene.toml")).map_err(io::Error::other)?;
        let world = World::new(&scene, &scene.target.mesh);
        let base = Base::draw(&mut draws(seed, 0, Stream::Base));
        match self.effects(seed, &world, &base) {
            Err(reached) => {
                fs::remove_dir_all(&folder)?;
                Ok(Outcome::OutOfReach(reached))
            }
            Ok(effects) => {
                let mut label = self.write(seed, &folder, &world, &base, &effects)?;
                label["case"] = json!(name);
                label["declared"] = json!(declared);
                let labels = out.join("labels");
                fs::create_dir_all(&labels)?;
                let text = serde_json::to_string_pretty(&label)? + "\n";
                fs::write(labels.join(format!("{name}.json")), text)?;
                Ok(Outcome::Written(label))
            }
        }
    }

    /// The effects with their sizes.
    fn effects(&self, seed: u64, world: &World, base: &Base) -> Result<Vec<Scaled>, Value> {
        let sized = |&name: &&'static str| {
            let effect = make(name, self.shapes, seed, world, base);
            let class = self.class.unwrap_or(Class::Moderate);
            let size =
                size_of(world, seed, base, effect.as_ref(), class).map_err(|reached_db| {
                    json!({
                        "seed": self.seed, "effect": name, "class": class,
                        "geometry": self.geometry, "shapes": self.shapes, "reached_rms_db": reached_db,
                    })
                })?;
            Ok((effect, size))
        };
        self.effects.iter().map(sized).collect()
    }

    /// Cloud and material; returns the label.
    fn write(
        &self,
        seed: u64,
        folder: &Path,
        world: &World,
        base: &Base,
        effects: &[Scaled],
    ) -> io::Result<Value> {
        let acting: Vec<Acting> = effects.iter().map(|(e, size)| (e.as_ref(), *size)).collect();
        let truth = material(base, &acting);
        let means = means(world, seed, &truth, &acting, 1);
        let detections = observe(world, seed, &truth, &means, &acting, self.grain);
        fs::write(folder.join("cloud.csv"), write::cloud(&detections))?;
        let start = truth.misjudged(&mut draws(seed, 0, Stream::Start));
        fs::create_dir_all(folder.join("material"))?;
        fs::write(folder.join("material/material.toml"), write::material(&start))?;
        let labels: Vec<Value> = acting
            .iter()
            .map(|&(effect, size)| {
                json!({
                    "name": effect.name(),
                    "in_library": KNOWN.contains(&effect.name()),
                    "parameters": effect.parameters(size),
                    "rms_db": rms_db(world, seed, base, &[(effect, size)], 1),
                    "own_measure": effect.size_of(Class::Weak, world).is_some(),
                })
            })
            .collect();
        Ok(json!({
            "seed": self.seed,
            "class": self.class,
            "effects": labels,
            "expected_verdict": self.expected(),
            "rms_db": rms_db(world, seed, base, &acting, 1),
            "base": truth,
            "speckle": self.grain,
            "shapes": self.shapes,
            "chirps": world.sights.len(),
            "on_target": world.sights.iter().filter(|sight| sight.look.is_some()).count(),
            "detections": detections.len(),
        }))
    }

    fn expected(&self) -> &'static str {
        if self.effects.is_empty() {
            "no-missing-effect"
        } else if self.effects.iter().all(|name| KNOWN.contains(name)) {
            "explained"
        } else {
            "unexplained"
        }
    }
}

/// An effect with its own random constants.
pub fn make(name: &str, shapes: Shapes, seed: u64, world: &World, base: &Base) -> Box<dyn Effect> {
    let number = KNOWN.iter().chain(&UNKNOWN).position(|known| *known == name).unwrap_or(0);
    let random = &mut draws(seed, number, Stream::Effect);
    if shapes == Shapes::Other && OTHER.contains(&name) {
        return make_other(name, seed, random, world, base);
    }
    match name {
        "subsurface" => Box::new(Subsurface),
        "speckle" => Box::new(Speckle),
        "fov-gain" => Box::new(FovGain),
        "angle-error" => Box::new(AngleError { seed }),
        "finite-spot" => Box::new(FiniteSpot),
        "noise-floor" => Box::new(NoiseFloor),
        "covering-layer" => Box::new(CoveringLayer::new(random, world)),
        "anisotropy" => Box::new(Anisotropy::new(random)),
        "thin-film" => Box::new(ThinFilm::new(random, base)),
        "multi-bounce" => Box::new(MultiBounce::new(world, seed, base)),
        "pose" => Box::new(Pose::new(random, world)),
        "motion" => Box::new(Motion::new(random)),
        "compression" => Box::new(Compression::new(random)),
        "drift" => Box::new(Drift::new(random)),
        "correlated-shadowing" => Box::new(CorrelatedShadowing),
        "foreign-patch" => Box::new(ForeignPatch::new(random, world)),
        "mirror-ripple" => Box::new(MirrorRipple::new(random)),
        "standing-wave" => Box::new(StandingWave::new(random)),
        "image-azimuth" => Box::new(ImageAzimuth::new(random)),
        "rope-shadow" => Box::new(Rope::new(random)),
        "coarse-steps" => Box::new(CoarseSteps),
        "dropouts" => Box::new(Dropouts { seed }),
        "ghost-echo" => Box::new(Ghost::new(random, seed)),
        "log-normal-speckle" => Box::new(LogNormalSpeckle),
        _ => unreachable!("every planned effect has a maker"),
    }
}

/// The same in another form.
fn make_other(
    name: &str,
    seed: u64,
    random: &mut Draws,
    world: &World,
    base: &Base,
) -> Box<dyn Effect> {
    use super::{other_instrument as instrument, other_surface as surface, other_target as target};
    match name {
        "subsurface" => Box::new(surface::Subsurface::new(random)),
        "fov-gain" => Box::new(instrument::FovGain::new(random)),
        "angle-error" => Box::new(target::AngleError::new(random)),
        "finite-spot" => Box::new(target::FiniteSpot::new(random)),
        "covering-layer" => Box::new(surface::CoveringLayer::new(random, world)),
        "anisotropy" => Box::new(surface::Anisotropy::new(random)),
        "thin-film" => Box::new(surface::ThinFilm::new(random, base)),
        "multi-bounce" => Box::new(target::MultiBounce::new(world, seed, base)),
        "motion" => Box::new(target::Motion::new(random, world)),
        "compression" => Box::new(instrument::Compression::new(random)),
        "drift" => Box::new(instrument::Drift::new(random)),
        "correlated-shadowing" => Box::new(surface::CorrelatedShadowing::new(random)),
        "foreign-patch" => Box::new(surface::ForeignPatch::new(random, world)),
        _ => unreachable!("`OTHER` lists the names"),
    }
}
