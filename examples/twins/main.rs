//! Sealed twins: scans with an effect that the scene does not declare, to try a diagnosis on.
//!
//!     cargo run --release --example twins -- --out DIR --seeds 1..5 [--only NAME] [--chirps N] [--independent]
//!         [--shapes usual|other]
//!
//! `DIR/cases/NAME/` is what a user would have: `scene.toml` with its meshes and rays, `material/` to
//! `matdb add --from`, and `cloud.csv`. `DIR/labels/NAME.json` is the truth, in a tree of its own; the
//! names of the cases say nothing. `DIR/labels/out-of-reach-SEED.json` lists which effect could not be
//! made as strong as wanted on which geometry, and how strong it got; the other geometries were tried
//! then, and the same with other base parameters. What fails on all of them is left out.
//!
//! Everything here is synthetic. The effects share no code with the program: it lends only its readers
//! of scenes and meshes, the closest hit of a ray, the constants of the radar, the table values of
//! speckle's spread in dB, and its random numbers.
//!
//! # What is simulated
//!
//! Without an effect a chirp has the mean P = P_t·L·Ω·cos²θ·f(θ) (equation 11) of the one facet that its
//! ray meets, with Ω = λ²/(πw²) of a Gaussian beam and f of equations (12) to (15). The parameters are drawn
//! for every case; the material starts each wrong by up to ±30 %. They are the surface's own: the beam shows
//! its lobe convolved with exp(−s²/δ²)/(πδ²), δ = λ/(2πw₀) for one ray and λ/(2πw) for the rays of a spot.
//! What lies below −77 dBm is not there; the range has a Gaussian error. A chirp that meets nothing stays
//! silent, however high the noise.
//!
//! Speckle is a field that is fixed to the surface. Scatterers lie on the facets, one per (w₀/3)², each with
//! a complex Gaussian amplitude a for every look, by seed and number. A chirp receives
//! √P·Σ a·g·e^{iφ}/√Σ g² with g = √(f·cos²θ)·exp(−2r²/w²) and the beam's own phase φ = 2k(z + r²/(2R_c)) −
//! 2·arctan(z/z_R). Neighbouring chirps therefore share speckle: fields d apart correlate by exp(−d²/w₀²).
//! Scatterers that the radar does not see do not count, and each counts as the range transform with a Hann
//! window shows it in the cell of the echo: what lies two cells c/2B away is not in it. Across a slope the
//! cell is smaller than the spot, and so are the grains. The share δ²/(m² + δ²) of a lobe is coherent and
//! does not speckle. The looks are 4 to 8 phasors, echo and noise, whose powers are averaged; noise is
//! independent per chirp. With `--independent` every chirp draws its speckle anew; names, truths and means of
//! the cases stay the same, so that two studies can be compared case by case.
//!
//! A target that is moved (`pose`, `motion`) has moved its scatterers, to fractions of a wave. Four things
//! are simpler than they are: which scatterers are hidden, and how bright each is, is judged in the middle of
//! the scan; `angle-error` tilts the mean alone; an echo by a second surface speckles with a set of
//! amplitudes of its own, seen by the beam where it first meets the surface, and is not parted from the
//! direct echo in range; a chirp with no scatterer in its beam, at the rim of a target, draws its speckle
//! anew. Gains, compression and drift act on the mean.
//!
//! | effect | what is done | size |
//! |---|---|---|
//! | `subsurface` | σ⁰ + σ_v, that is f + σ_v/(4π cos²θ) | σ_v |
//! | `speckle` | fewer looks; a part of a look has a smaller share in the average | L |
//! | `fov-gain` | −edge_db·(ρ/0.5 m)² dB at distance ρ from the field's centre | edge_db |
//! | `angle-error` | each chirp's normal n + a·u + b·v with Gaussian a, b | their sd |
//! | `finite-spot` | 256 rays over a Gaussian footprint, one in each cell of equal power, powers averaged, misses count as nothing; the grains of the speckle grow with a spot wider than the declared one; the cell is that of most power | diameter at half the intensity |
//! | `noise-floor` | a higher N in the phasors | N |
//! | `covering-layer` | −loss/cos θ dB on one side of a plane that cuts the target | two-way loss |
//! | `anisotropy` | D with slopes m√q along a grain and m/√q across, G1 with m in the radar's azimuth | q |
//! | `thin-film` | a share c of each spot coated: specular × (1 − c + c·R_film(0)/R_bare(0)), diffuse × (1 − c + c·R_film(θ)/R_bare(θ)), R by characteristic matrices at 300 GHz, not averaged over the sweep | c |
//! | `multi-bounce` | 512 rays onward from each hit, half by the cosine and half by the lobe, weighted by their density; f bistatic at both points; the second is seen by the antenna when nothing hides it, with exp(−s²/w²) for a distance s across the beam, at least the −20 dB of its side lobes; range half the whole way, the reported one the mean by power | coupling |
//! | `pose` | the mesh shifted and turned about the middle of the lit points, rays traced against it | shift, with a turn in proportion |
//! | `motion` | the mesh shifted by two slow sines of time | amplitude |
//! | `compression` | P/(1 + (P/P_sat)^p)^(1/p), p = 1 or 2 | 1/P_sat |
//! | `drift` | a slope and a slow wave in dB along the time of the scan | dB |
//! | `correlated-shadowing` | G1 instead of G1² | m of the base law |
//! | `foreign-patch` | a ball's cut through the surface with brighter lobes of another width | dB |
//!
//! With `--shapes other` the same names take other forms, which nature or hardware may give them. They have
//! the same strengths and other keys, so that the cases differ; `pose`, `speckle`, `noise-floor` and what is in
//! no library stay as they are.
//!
//! | effect | with `--shapes other` | size |
//! |---|---|---|
//! | `subsurface` | σ_v·cos θ′·T(θ)²/T(0)²: single scattering below a border that refracts twice, at the angle θ′ inside, of index 1.4 to 2.2; the content varies over the target by 30 % | σ_v at θ = 0 |
//! | `fov-gain` | a quartic loss about a centre beside the field's, along two unequal and turned axes; a tilt; the soft shadow of a frame on one side | dB |
//! | `angle-error` | a waviness of 4 to 12 cm that the mesh does not have, 24 plane waves | sd of the tilt |
//! | `finite-spot` | an evenly lit ellipse with a sharp border, 2 to 3.5 times as long as wide; its speckle is that of a round spot | diameter of the disc of the same area |
//! | `covering-layer` | an outline with 2, 3 and 5 waves around, a thickness with a spread of 30 %, and a refracted way, loss/√(1 − sin²θ/n²) | two-way loss |
//! | `anisotropy` | a share of 0.4 to 0.7 of the facets with slopes m/√q along a grain and m√q across; the others keep m | q |
//! | `thin-film` | a lossy film of 0.4 to 1.2 mm whose thickness varies over the target by 0.04 to 0.1 mm (sd), by Airy's sum | coated share |
//! | `multi-bounce` | paths by a second and by a third surface, both scattering evenly as the diffuse part does head on | gain per further surface |
//! | `motion` | a sway with a pause, one shift of weight, breathing, and turns about two axes | amplitude of the sway |
//! | `compression` | a gain control: dB count 3 to 6 times less above a threshold, with a parabolic knee of 4 to 10 dB and no ceiling | 1/threshold |
//! | `drift` | warming up, exp(−t/τ), a jump, and a smoothed random walk, in dB | dB |
//! | `correlated-shadowing` | G1 to the power 1 + exp(−θ/θ₀), θ₀ of 15° to 35° | m of the base law |
//! | `foreign-patch` | three or four blots that run into each other; the diffuse part is brighter by another factor | dB of the specular part |
//!
//! Not in any library: `mirror-ripple` (gain periodic in the mirror's turn), `standing-wave` (gain
//! periodic in range), `image-azimuth` (cos 2ψ in the image plane), `rope-shadow` (a stripe of loss),
//! `coarse-steps` (powers in steps of dB), `dropouts` (bursts of lost chirps), `ghost-echo` (a share of
//! detections weaker and at a longer range), `log-normal-speckle` (Gaussian in dB, wider than declared: a real texture of the scatterers).
//!
//! # How strong
//!
//! Weak, moderate and strong leave 0.35, 0.9 and 2.2 dB rms when the base law (S = (1 − k)f_λ, m,
//! R = k·r_s, α) is refitted by least squares in dB to the noise-free means above the threshold, at the
//! angles and ranges of the declared geometry. A prediction below the threshold counts as the threshold.
//! Sizes are bisected on every n-th chirp and checked over all, which is what the label gives as
//! `rms_db`; they are within 15 % of the class. Of a pair each effect is calibrated alone.
//!
//! Five have a measure of their own (`own_measure`), and an `rms_db` of 0: `speckle` and
//! `log-normal-speckle` widen the spread in dB by the class in quadrature, `coarse-steps` has steps of
//! √12 times the class, `dropouts` and `ghost-echo` touch 2, 6 and 15 % of the chirps.

pub mod base;
pub mod beam;
pub mod case;
pub mod field;
pub mod instrument;
pub mod noise;
pub mod other_instrument;
pub mod other_surface;
pub mod other_target;
pub mod physics;
pub mod refit;
pub mod scan;
pub mod scatterers;
pub mod scenes;
pub mod strength;
pub mod surface;
pub mod target;
pub mod unknowns;
pub mod waves;
pub mod write;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;

use case::{KNOWN, Outcome, PAIRS, Plan, Shapes, UNKNOWN};
use noise::Grain;
use physics::Class;
use scenes::Geometry;

/// Write scans with an effect that their scene does not declare
#[derive(Parser)]
struct Args {
    /// Folder to write into
    #[arg(long)]
    out: PathBuf,
    /// Seeds, the last one left out: 1..5
    #[arg(long, value_parser = seeds)]
    seeds: std::ops::Range<u64>,
    /// Only cases with this effect, or `nothing`, or `pairs`
    #[arg(long)]
    only: Option<String>,
    /// Chirps per scan
    #[arg(long, default_value_t = 18_529, value_parser = clap::value_parser!(u32).range(500..=200_000))]
    chirps: u32,
    /// Draw speckle anew for every chirp instead of from scatterers on the surface
    #[arg(long)]
    independent: bool,
    /// Forms of the effects: those of the first table of this example's page, or of the second
    #[arg(long, value_enum, default_value_t = Shapes::Usual)]
    shapes: Shapes,
}

fn seeds(text: &str) -> Result<std::ops::Range<u64>, String> {
    let (from, to) = text.split_once("..").ok_or("give two numbers, as in 1..5")?;
    let number = |text: &str| text.parse::<u64>().map_err(|error| error.to_string());
    Ok(number(from)?..number(to)?)
}

/// Complete data sets per seed.
const COMPLETE: usize = 5;

/// All cases of a seed: every effect in every class, the pairs, and nothing missing. Geometries take
/// turns from seed to seed.
pub fn plans(seed: u64, chirps: usize, grain: Grain, shapes: Shapes) -> Vec<Plan> {
    let mut plans = Vec::new();
    let mut add = |effects: &[&'static str], class: Option<Class>| {
        let number = plans.len();
        let turn = (seed as usize).wrapping_add(number + number / 4) % Geometry::ALL.len();
        let geometry = Geometry::ALL[turn];
        let effects = effects.to_vec();
        let attempt = 0;
        plans.push(Plan { seed, number, attempt, effects, class, geometry, chirps, grain, shapes });
    };
    for name in KNOWN.iter().chain(&UNKNOWN) {
        Class::ALL.iter().for_each(|&class| add(&[name], Some(class)));
    }
    for (number, pair) in PAIRS.iter().enumerate() {
        let class = [Class::Moderate, Class::Strong][(seed as usize + number) % 2];
        add(pair, Some(class));
    }
    (0..COMPLETE).for_each(|_| add(&[], None));
    plans
}

/// Base laws that are tried for an effect that does not get strong enough.
const ATTEMPTS: usize = 4;

/// Runs a plan on its geometry, or on the first other one on which it can be had.
fn run(plan: &Plan, out: &Path, missed: &mut Vec<serde_json::Value>) -> Result<(), Box<dyn Error>> {
    let first = Geometry::ALL.iter().position(|g| *g == plan.geometry).unwrap_or(0);
    for attempt in 0..ATTEMPTS * Geometry::ALL.len() {
        let geometry = Geometry::ALL[(first + attempt) % Geometry::ALL.len()];
        let plan = Plan { geometry, attempt, ..plan.clone() };
        let begun = Instant::now();
        match plan.run(out)? {
            Outcome::Written(label) => {
                println!(
                    "{} seed {} {} {:?} {geometry:?}: {:.3} dB, {} of {} detected, {:.1} s",
                    label["case"].as_str().unwrap_or(""),
                    plan.seed,
                    if plan.effects.is_empty() { "nothing".into() } else { plan.effects.join("+") },
                    plan.class,
                    label["rms_db"].as_f64().unwrap_or(f64::NAN),
                    label["detections"],
                    label["on_target"],
                    begun.elapsed().as_secs_f64()
                );
                return Ok(());
            }
            Outcome::OutOfReach(reached) => {
                missed.push(reached);
            }
        }
    }
    println!("seed {} {} {:?}: out of reach", plan.seed, plan.effects.join("+"), plan.class);
    Ok(())
}

fn wanted(plan: &Plan, only: Option<&str>) -> bool {
    match only {
        None => true,
        Some("nothing") => plan.effects.is_empty(),
        Some("pairs") => plan.effects.len() == 2,
        Some(name) => plan.effects.len() == 1 && plan.effects.contains(&name),
    }
}

#[allow(dead_code)] // The test that includes this file calls the parts.
fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let grain = if args.independent { Grain::Independent } else { Grain::Field };
    for seed in args.seeds.clone() {
        let mut missed = Vec::new();
        let mut plans = plans(seed, args.chirps as usize, grain, args.shapes);
        plans.retain(|plan| wanted(plan, args.only.as_deref()));
        if plans.is_empty() {
            return Err("no case has such a name; give an effect, `pairs` or `nothing`".into());
        }
        for plan in &plans {
            run(plan, &args.out, &mut missed)?;
        }
        let labels = args.out.join("labels");
        std::fs::create_dir_all(&labels)?;
        let text = serde_json::to_string_pretty(&missed)?;
        std::fs::write(labels.join(format!("out-of-reach-{seed}.json")), text + "\n")?;
    }
    Ok(())
}
