//! Sionna RT `RadioMaterial` as a few lines of Python (checked with Sionna RT 2.2.0): permittivity,
//! conductivity, scattering coefficient S and one of its three scattering patterns.
//!
//! Sionna's diffuse f is S²·Γ²(θ_i)·f_s/cos θ_o, with Γ² the reflected share of the power (here of
//! unpolarised waves on a half space) and f_s `lambertian`, `directive` or `backscattering` after
//! Degli-Esposti. S and the pattern are fitted in dB over the claimed angles to our backscatter or, of
//! a mixture, to that of its diffuse part, since Sionna adds the mirror's reflection itself; the best
//! of the three is written with its rms error. A smooth surface gets S = 0. σ = ε″·2πf·ε₀.
//!
//! Lost: the shape beyond such a pattern and the width of the mirror's lobe. Sionna models the surface as
//! a slab of a thickness; the mirror's share is √(1 − S²) in amplitude; ε′ below 1 becomes 1.

use std::f64::consts::{PI, TAU};

use super::error::ExchangeError;
use super::export_files::Export;
use super::subject::{Subject, one_line};
use crate::brdf::{Brdf, Directive, Fresnel, Scattering, ScatteringModel};
use crate::frames::Direction;
use crate::units::{db_from_ratio, ratio_from_db};

/// ε₀, F/m (CODATA 2022).
const VACUUM_F_PER_M: f64 = 8.854_187_818_8e-12;
/// Exponents of lobes that are tried; Sionna takes whole ones.
const EXPONENTS: [u32; 12] = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64];
/// Shares of the lobe about the mirror direction that are tried.
const SHARES: [f64; 12] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

/// Writes the snippet.
pub(super) fn write(subject: &Subject, name: &str) -> Result<Export, ExchangeError> {
    const FORMAT: &str = "a Sionna radio material";
    const WAY_OUT: &str = "render another fit or curve";
    let slug = &subject.material.slug;
    let model =
        subject.model().map_err(|error| ExchangeError::unfit(slug, FORMAT, error, WAY_OUT))?;
    let Some(substance) = Substance::find(subject, &model) else {
        let problem = "neither a permittivity nor a reflectivity is known";
        let way_out = "add a [[permittivity]] to the material";
        return Err(ExchangeError::unfit(slug, FORMAT, problem, way_out));
    };
    let angles = subject.echoing_rad(&model);
    let scattered = ScatteredPart::of(&model);
    let best = match scattered {
        // A mirror scatters nothing apart.
        ScatteredPart::Nothing => Best { pattern: Pattern::Lambertian, s: 0.0, rms_db: 0.0 },
        part => best_pattern(&model, part, &substance, &angles).ok_or_else(|| {
            let problem = "nothing is scattered back at any claimed angle";
            ExchangeError::unfit(slug, FORMAT, problem, WAY_OUT)
        })?,
    };
    let misses = match scattered {
        ScatteredPart::Nothing => {
            "a smooth surface: S = 0, and Sionna's mirror reflection is all".to_owned()
        }
        part => format!(
            "the {} pattern misses {} by {:.1} dB rms over the claimed angles",
            best.pattern.name(),
            part.what(),
            best.rms_db
        ),
    };
    let slab = match substance.thickness_m {
        Some(_) => "",
        None => "; Sionna's slab of 0.1 m stands in for a half space",
    };
    let lost = format!("{misses}; {}{slab}", substance.origin);
    let text = snippet(subject, &substance, &best, &lost);
    Ok(Export { files: vec![(name.to_owned(), text.into_bytes())], lost })
}

fn snippet(subject: &Subject, substance: &Substance, best: &Best, lost: &str) -> String {
    let frequency_hz = substance.frequency_hz;
    let conductivity = substance.eps_imag * TAU * frequency_hz * VACUUM_F_PER_M;
    let mut text: String = subject.about().iter().map(|line| format!("# {line}\n")).collect();
    text += &format!("# {}\n", one_line(lost));
    let ghz = frequency_hz / 1e9;
    text += &format!(
        "# conductivity for {ghz} GHz; backscatter fitted as S^2 Gamma^2 f_s / cos theta\n"
    );
    text += "from sionna.rt import RadioMaterial\n\nmaterial = RadioMaterial(\n";
    let mut arguments = vec![("name", serde_json::json!(subject.material.slug).to_string())];
    arguments.extend(substance.thickness_m.map(|thickness_m| ("thickness", python(thickness_m))));
    arguments.extend([
        ("relative_permittivity", python(substance.eps_real.max(1.0))),
        ("conductivity", python(conductivity)),
        ("scattering_coefficient", python(best.s)),
        ("scattering_pattern", format!("\"{}\"", best.pattern.name())),
    ]);
    arguments.extend(best.pattern.arguments());
    for (key, value) in arguments {
        text += &format!("    {key}={value},\n");
    }
    text + ")\n"
}

/// Which part of a model Sionna's diffuse scattering stands for; it adds the mirror's itself.
#[derive(Clone, Copy)]
enum ScatteredPart {
    /// A mirror leaves none.
    Nothing,
    /// Facets apart from a diffuse part are the mirror.
    DiffusePart,
    All,
}

impl ScatteredPart {
    fn of(model: &Brdf) -> ScatteredPart {
        match model {
            model if model.is_smooth() => ScatteredPart::Nothing,
            Brdf::Mixture(mixture) if mixture.k > 0.0 => ScatteredPart::DiffusePart,
            _ => ScatteredPart::All,
        }
    }

    fn what(self) -> &'static str {
        match self {
            ScatteredPart::DiffusePart => "the diffuse part of the backscatter",
            _ => "the backscatter",
        }
    }

    /// This part of the backscatter, 1/sr.
    fn retro_per_sr(self, model: &Brdf, theta_rad: f64) -> f64 {
        let i = Direction::from_angles(theta_rad, 0.0);
        match self {
            ScatteredPart::Nothing => 0.0,
            ScatteredPart::DiffusePart => model.f_per_sr(i, i) * (1.0 - model.specular_share(i, i)),
            ScatteredPart::All => model.f_per_sr(i, i),
        }
    }
}

/// A number that Python reads as a float.
fn python(value: f64) -> String {
    format!("{value:?}")
}

/// The permittivity of the surface.
struct Substance {
    eps_real: f64,
    eps_imag: f64,
    frequency_hz: f64,
    thickness_m: Option<f64>,
    /// Where it comes from, and how it was changed, in a clause.
    origin: String,
}

impl Substance {
    fn find(subject: &Subject, model: &Brdf) -> Option<Substance> {
        let middle_hz = subject.frequency_hz();
        let known = subject.permittivities();
        let nearest = known
            .iter()
            .flatten()
            .map(|entry| ((entry.frequency_hz - middle_hz).abs(), entry))
            .min_by(|(a, _), (b, _)| a.total_cmp(b));
        let thickness_m = subject.material.layers.first().and_then(|layer| layer.thickness_m);
        if let Some((_, entry)) = nearest {
            let (key, real, frequency_hz) = (&entry.key, entry.real, entry.frequency_hz);
            let ghz = frequency_hz / 1e9;
            let origin = format!("the permittivity is `{key}` at {ghz:.3} GHz{}", below_one(real));
            let eps_imag = entry.imaginary;
            return Some(Substance { eps_real: real, eps_imag, frequency_hz, thickness_m, origin });
        }
        let frequency_hz = middle_hz;
        if let Some(eps) = model.permittivity() {
            let origin = format!("the permittivity is the model's{}", below_one(eps[0]));
            let [eps_real, eps_imag] = eps;
            return Some(Substance { eps_real, eps_imag, frequency_hz, thickness_m, origin });
        }
        let reflectivity = model.f_lambda().filter(|share| *share < 1.0 - 1e-9)?;
        let root = reflectivity.sqrt();
        let index = (1.0 + root) / (1.0 - root);
        let (eps_real, eps_imag) = (index * index, 0.0);
        let why = known.err().unwrap_or("no permittivity of the surface is known");
        let origin = format!(
            "{why}: a real one of {:.3} with the same normal reflectance, \
             {reflectivity:.4}, stands in",
            eps_real
        );
        Some(Substance { eps_real, eps_imag, frequency_hz, thickness_m, origin })
    }
}

/// That a real part below 1 was replaced, which Sionna does not take.
fn below_one(eps_real: f64) -> String {
    if eps_real < 1.0 {
        return format!("; its real part {eps_real:.3} became 1");
    }
    String::new()
}

/// Sionna's scattering patterns.
#[derive(Clone, Copy)]
enum Pattern {
    Lambertian,
    Directive { alpha_r: u32 },
    Backscattering { alpha_r: u32, alpha_i: u32, lambda: f64 },
}

impl Pattern {
    fn name(self) -> &'static str {
        match self {
            Pattern::Lambertian => "lambertian",
            Pattern::Directive { .. } => "directive",
            Pattern::Backscattering { .. } => "backscattering",
        }
    }

    fn arguments(self) -> Vec<(&'static str, String)> {
        match self {
            Pattern::Lambertian => Vec::new(),
            Pattern::Directive { alpha_r } => vec![("alpha_r", alpha_r.to_string())],
            Pattern::Backscattering { alpha_r, alpha_i, lambda } => vec![
                ("alpha_r", alpha_r.to_string()),
                ("alpha_i", alpha_i.to_string()),
                ("lambda_", python(lambda)),
            ],
        }
    }

    fn all() -> Vec<Pattern> {
        let mut all = vec![Pattern::Lambertian];
        all.extend(EXPONENTS.map(|alpha_r| Pattern::Directive { alpha_r }));
        for alpha_r in EXPONENTS {
            for alpha_i in EXPONENTS {
                all.extend(SHARES.map(|lambda| Pattern::Backscattering {
                    alpha_r,
                    alpha_i,
                    lambda,
                }));
            }
        }
        all
    }

    /// f_s/cos θ in backscatter, 1/sr; `norms_sr` holds F of each exponent at this angle.
    fn f_per_sr(self, cos: f64, norms_sr: &[(u32, f64)]) -> f64 {
        // The mirror direction lies 2θ from the way back: (1 + cos 2θ)/2 = cos²θ.
        let mirror = |alpha: u32| cos.powf(2.0 * f64::from(alpha));
        match self {
            Pattern::Lambertian => 1.0 / PI,
            Pattern::Directive { alpha_r } => mirror(alpha_r) / (norm_sr(norms_sr, alpha_r) * cos),
            Pattern::Backscattering { alpha_r, alpha_i, lambda } => {
                let lobes = lambda * mirror(alpha_r) + (1.0 - lambda);
                let norm_sr = lambda * norm_sr(norms_sr, alpha_r)
                    + (1.0 - lambda) * norm_sr(norms_sr, alpha_i);
                lobes / (norm_sr * cos)
            }
        }
    }
}

/// F of an exponent among those of [`norms_sr`].
fn norm_sr(norms_sr: &[(u32, f64)], alpha: u32) -> f64 {
    norms_sr.iter().find(|(known, _)| *known == alpha).map_or(f64::NAN, |(_, norm)| *norm)
}

/// F of each exponent at an angle, sr: a lone lobe towards the source has f = 1/(F·cos θ) in backscatter.
fn norms_sr(angle: f64) -> [(u32, f64); EXPONENTS.len()] {
    EXPONENTS.map(|alpha| {
        let alpha_i = f64::from(alpha);
        let lobe = Directive { s: 1.0, alpha_r: 1.0, lambda: 0.0, alpha_i };
        (alpha, 1.0 / (lobe.retro_per_sr(angle) * angle.cos()))
    })
}

/// A fitted pattern.
struct Best {
    pattern: Pattern,
    /// S.
    s: f64,
    rms_db: f64,
}

/// The pattern and S nearest to the model's backscatter, in dB.
fn best_pattern(
    model: &Brdf,
    part: ScatteredPart,
    substance: &Substance,
    angles: &[f64],
) -> Option<Best> {
    let [eps_real, eps_imag] = [substance.eps_real, substance.eps_imag];
    let mirror = Fresnel { eps_real, eps_imag, lobe_rad: None };
    let mut targets = Vec::with_capacity(angles.len());
    for &angle in angles {
        let wanted_per_sr = part.retro_per_sr(model, angle);
        if wanted_per_sr > 0.0 {
            let level_db = db_from_ratio(wanted_per_sr / mirror.reflectance(angle));
            targets.push(Target { cos: angle.cos(), norms_sr: norms_sr(angle), level_db });
        }
    }
    let all = Pattern::all().into_iter().map(|pattern| Best::fit(pattern, &targets));
    all.filter(|best| best.rms_db.is_finite()).min_by(|a, b| a.rms_db.total_cmp(&b.rms_db))
}

/// The level that a pattern should have at an angle.
struct Target {
    /// Cosine of the angle.
    cos: f64,
    norms_sr: [(u32, f64); EXPONENTS.len()],
    /// f/Γ², dB.
    level_db: f64,
}

impl Best {
    /// The pattern with the S of least squares in dB.
    fn fit(pattern: Pattern, targets: &[Target]) -> Best {
        let differences = targets.iter().map(|Target { cos, norms_sr, level_db }| {
            level_db - db_from_ratio(pattern.f_per_sr(*cos, norms_sr))
        });
        let differences: Vec<f64> = differences.collect();
        let count = differences.len() as f64;
        // S² cannot exceed 1.
        let level_db = (differences.iter().sum::<f64>() / count).min(0.0);
        let squares: f64 = differences.iter().map(|db| (db - level_db).powi(2)).sum();
        Best { pattern, s: ratio_from_db(level_db).sqrt(), rms_db: (squares / count).sqrt() }
    }
}
