//! A material of a function σ⁰(θ): a curve of samples that is as good as the function.

use super::curve::{Curve, Illumination, Observation};
use super::error::{MaterialError, value};
use super::provenance::{Citation, Source, SourceKind};
use super::revision::Material;
use super::slug::Slug;
use super::status::Status;
use crate::brdf::Brdf;
use crate::units::ratio_from_db;

/// A material whose curve was sampled from a function.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledMaterial {
    /// The material. It renders the curve.
    pub material: Material,
    /// Largest difference between function and curve, dB, midway between samples up to 89°.
    pub error_db: f64,
    /// Where it is, degrees.
    pub error_at_deg: f64,
}

/// Name of the curve and of its source.
const NAME: &str = "function";
/// Number of intervals of the coarsest samples, and of the finest.
const INTERVALS: [usize; 2] = [1 << 10, 1 << 14];
/// A difference that ends the refinement, dB.
const GOOD_DB: f64 = 0.01;
/// The last sample, degrees: at 90 no fit takes a point.
const LAST_DEG: f64 = 89.99;
/// Beyond this angle, degrees, levels fall so steeply that a difference says nothing.
const JUDGED_DEG: f64 = 89.0;

impl SampledMaterial {
    /// Samples a function that gives σ⁰, dB, of angles of incidence, degrees. The samples lie denser towards 0, where lobes
    /// are narrow, and are doubled until the curve between them is within 0.01 dB of the function, up to 16 385. From the
    /// angle on from which the function is −∞ or NaN, nothing comes back.
    ///
    /// # Errors
    /// Those of the function; fewer levels than angles; a level that is not finite and no end; no level at all.
    pub fn new<E: From<MaterialError>>(
        slug: Slug,
        mut sigma0_db: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    ) -> Result<SampledMaterial, E> {
        let [mut intervals, most] = INTERVALS;
        let mut angles_deg: Vec<f64> = (0..=intervals).map(|k| angle_deg(k, intervals)).collect();
        let mut levels_db = levels(&mut sigma0_db, &angles_deg)?;
        loop {
            let middles_deg: Vec<f64> =
                (0..intervals).map(|k| angle_deg(2 * k + 1, 2 * intervals)).collect();
            let middles_db = levels(&mut sigma0_db, &middles_deg)?;
            let curve = curve(&angles_deg, &levels_db)?;
            let law = curve.tabulated()?;
            let (mut error_db, mut error_at_deg) = (0.0, 0.0);
            for (k, (&angle_deg, &level_db)) in middles_deg.iter().zip(&middles_db).enumerate() {
                // In the interval in which the silence begins only its place is off.
                if angle_deg > JUDGED_DEG || !level_db.is_finite() || !levels_db[k + 1].is_finite()
                {
                    continue;
                }
                let difference_db = (law.sigma0_db(angle_deg.to_radians()) - level_db).abs();
                if difference_db > error_db {
                    (error_db, error_at_deg) = (difference_db, angle_deg);
                }
            }
            if error_db <= GOOD_DB || intervals == most {
                let material = material(slug, curve);
                return Ok(SampledMaterial { material, error_db, error_at_deg });
            }
            angles_deg = woven(&angles_deg, &middles_deg);
            levels_db = woven(&levels_db, &middles_db);
            intervals *= 2;
        }
    }
}

/// The law of a function that gives σ⁰, dB, of angles of incidence, degrees, as fine as the coarsest samples.
///
/// # Errors
/// As [`SampledMaterial::new`].
pub(crate) fn sampled_law(
    mut sigma0_db: impl FnMut(&[f64]) -> Vec<f64>,
) -> Result<Brdf, MaterialError> {
    let angles_deg: Vec<f64> = (0..=INTERVALS[0]).map(|k| angle_deg(k, INTERVALS[0])).collect();
    let levels_db = levels(&mut |angles_deg: &[f64]| Ok(sigma0_db(angles_deg)), &angles_deg)?;
    curve(&angles_deg, &levels_db)?.tabulated().map(Brdf::Tabulated)
}

/// The angle of a sample, degrees.
fn angle_deg(k: usize, intervals: usize) -> f64 {
    LAST_DEG * (k as f64 / intervals as f64).powi(2)
}

/// Values with others between them.
fn woven(values: &[f64], between: &[f64]) -> Vec<f64> {
    let pairs = values.iter().zip(between).flat_map(|(value, next)| [*value, *next]);
    pairs.chain(values.last().copied()).collect()
}

/// The levels of a function at some angles, one for each.
fn levels<E: From<MaterialError>>(
    sigma0_db: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    angles_deg: &[f64],
) -> Result<Vec<f64>, E> {
    let levels_db = sigma0_db(angles_deg)?;
    if levels_db.len() != angles_deg.len() {
        let problem = format!("gives {} levels for {} angles", levels_db.len(), angles_deg.len());
        return Err(value(NAME, &problem, "give a level for every angle").into());
    }
    Ok(levels_db)
}

fn curve(angles_deg: &[f64], levels_db: &[f64]) -> Result<Curve, MaterialError> {
    let mut observations: Vec<Observation> = Vec::new();
    let mut silent_from_deg = None;
    for (&angle_deg, &level_db) in angles_deg.iter().zip(levels_db) {
        let sigma0 = ratio_from_db(level_db);
        if level_db.is_nan() || sigma0 == 0.0 {
            silent_from_deg = silent_from_deg.or(Some(angle_deg));
            continue;
        }
        if let Some(from_deg) = silent_from_deg {
            let problem = format!(
                "gives no level at {from_deg:.4}°, and {level_db} dB at {angle_deg:.4}° again"
            );
            return Err(value(
                NAME,
                &problem,
                "give a level up to the angle from which on there is none",
            ));
        }
        if !sigma0.is_finite() {
            let problem = format!("gives {level_db} dB at {angle_deg:.4}°");
            return Err(value(NAME, &problem, "give finite levels in dB"));
        }
        observations.push(Observation::backscatter(angle_deg.to_radians(), Some(sigma0), None));
    }
    if let (Some(from_deg), Some(last)) = (silent_from_deg, observations.last()) {
        let silent = Observation::backscatter(from_deg.to_radians(), None, last.sigma0);
        observations.push(silent);
    }
    Ok(Curve {
        name: NAME.to_owned(),
        source: NAME.to_owned(),
        instrument: None,
        session: None,
        illumination: Illumination::default(),
        observations,
    })
}

fn material(slug: Slug, curve: Curve) -> Material {
    let source = Source {
        key: NAME.to_owned(),
        kind: SourceKind::Synthetic,
        title: "A function of a program".to_owned(),
        doi: None,
        url: None,
        licence: None,
        note: None,
        citation: Citation::default(),
        making: None,
    };
    Material {
        name: slug.to_string(),
        slug,
        class: "sample".to_owned(),
        description: "A function of a program, sampled.".to_owned(),
        licence: "LicenseRef-unstated".to_owned(),
        tags: Vec::new(),
        frequency_hz: [1.0, 1e15],
        theta_rad: [0.0, std::f64::consts::FRAC_PI_2],
        render: NAME.to_owned(),
        sources: vec![source],
        instruments: Vec::new(),
        curves: vec![curve],
        fits: Vec::new(),
        effects: Vec::new(),
        status: Status::default(),
        finish: None,
        unknown: Vec::new(),
        roughness: None,
        layers: Vec::new(),
        permittivities: Vec::new(),
        sessions: Vec::new(),
        findings: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Lambert, Scattering};
    use crate::units::db_from_ratio;

    fn sample(sigma0_db: impl Fn(f64) -> f64) -> Result<SampledMaterial, MaterialError> {
        let slug = "mine".parse().unwrap();
        SampledMaterial::new(slug, |angles| Ok(angles.iter().map(|one| sigma0_db(*one)).collect()))
    }

    #[test]
    fn a_sampled_law_is_the_law_to_a_hundredth_of_a_decibel() {
        let laws = [
            Brdf::Lambert(Lambert { albedo: 0.3 }),
            serde_json::from_str(r#"{"model": "cook-torrance", "f_lambda": 0.05, "m": 0.02}"#)
                .unwrap(),
        ];
        for law in laws {
            let sigma0_db = |deg: f64| db_from_ratio(law.sigma0(deg.to_radians()));
            let sampled = sample(sigma0_db).unwrap();
            assert!(sampled.error_db <= GOOD_DB, "{}", sampled.error_db);
            sampled.material.validate().unwrap();
            let alone = sampled.material.with_law_alone().unwrap();
            let text = crate::material::file::write(&alone).unwrap();
            let read = crate::material::file::parse("mine", &text, |_| Err(String::new())).unwrap();
            assert_eq!(read.scattering().unwrap(), sampled.material.scattering().unwrap());
            let own = sampled.material.scattering().unwrap();
            // Angles that were no samples.
            for k in 0..3000 {
                let theta_rad = (0.0297 * f64::from(k)).to_radians().min(1.55);
                let (here, there) = (law.sigma0(theta_rad), own.sigma0(theta_rad));
                if there > 1e-30 {
                    assert!(db_from_ratio(here / there).abs() < 2.0 * GOOD_DB, "{theta_rad}");
                }
            }
        }
    }

    #[test]
    fn a_step_is_reported_and_silence_is_silent() {
        let step = sample(|deg| if deg < 30.0 { 0.0 } else { -10.0 }).unwrap();
        assert!(step.error_db > 1.0 && (step.error_at_deg - 30.0).abs() < 0.1);
        let silent = sample(|deg| if deg < 50.0 { -deg } else { f64::NEG_INFINITY }).unwrap();
        assert!(silent.error_db <= GOOD_DB);
        let law = silent.material.scattering().unwrap();
        assert_eq!(law.sigma0(51f64.to_radians()), 0.0);
        assert!((db_from_ratio(law.sigma0(40f64.to_radians())) + 40.0).abs() < 0.01);
    }

    #[test]
    fn what_is_no_curve_is_refused_with_its_angle() {
        let refused = |sigma0_db: fn(f64) -> f64| sample(sigma0_db).unwrap_err().to_string();
        assert!(refused(|_| f64::INFINITY).contains("inf dB at 0.0000°"));
        assert!(
            refused(|deg| if (20.0..30.0).contains(&deg) { f64::NAN } else { 0.0 })
                .contains("again")
        );
        assert!(refused(|_| f64::NAN).contains("at least two"), "{}", refused(|_| f64::NAN));
        let slug = "mine".parse().unwrap();
        let short = SampledMaterial::new(slug, |_| Ok::<_, MaterialError>(vec![0.0]));
        assert!(short.unwrap_err().to_string().contains("1 levels for 1025 angles"));
    }
}
