//! Sionna RT `RadioMaterial` as a few lines of Python (checked with Sionna RT 2.2.0): permittivity,
//! conductivity, scattering coefficient S and one of its three scattering patterns.
//!
//! Sionna's diffuse f is S²·Γ²(θ_i)·f_s/cos θ_o, with Γ² the reflected share of the power (here of
//! unpolarised waves on a half space) and f_s `lambertian`, `directive` or `backscattering` after
//! Degli-Esposti. S and the pattern are fitted in dB over the claimed angles to our backscatter or, of
//! a mixture, to that of its diffuse part, since Sionna adds the mirror's reflection itself; the best
//! of the three is written and its rms error said. A smooth surface gets S = 0. σ = ε″·2πf·ε₀.
//!
//! Lost: the shape beyond such a pattern and the width of the mirror's lobe. Sionna takes the surface
//! for a slab of a thickness; the mirror's share is √(1 − S²) in amplitude; ε′ below 1 becomes 1.

use std::f64::consts::{PI, TAU};

use super::error::ExchangeError;
use super::exported::Exported;
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
pub(super) fn write(subject: &Subject, name: &str) -> Result<Exported, ExchangeError> {
    let unfit = |problem: String, way_out: &str| ExchangeError::Unfit {
        slug: subject.material.slug.to_string(),
        format: "a Sionna radio material",
        problem,
        way_out: way_out.to_owned(),
    };
    let model =
        subject.model().map_err(|error| unfit(error.to_string(), "render another fit or curve"))?;
    let Some(substance) = Substance::find(subject, &model) else {
        let problem = "neither a permittivity nor a reflectivity is known".to_owned();
        return Err(unfit(problem, "add a [[permittivity]] to the material"));
    };
    let angles = subject.echoing_rad(&model);
    let scattered = Scattered::of(&model);
    let best = match scattered {
        // A mirror scatters nothing apart.
        Scattered::Nothing => Best { pattern: Pattern::Lambertian, s: 0.0, rms_db: 0.0 },
        part => best_pattern(&model, part, &substance, &angles).ok_or_else(|| {
            let problem = "nothing is scattered back at any claimed angle".to_owned();
            unfit(problem, "render another fit or curve")
        })?,
    };
    let misses = match scattered {
        Scattered::Nothing => {
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
    Ok(Exported { files: vec![(name.to_owned(), text.into_bytes())], lost })
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
    let quoted = serde_json::json!(subject.material.slug).to_string();
    let mut line = |key: &str, value: String| text += &format!("    {key}={value},\n");
    line("name", quoted);
    if let Some(thickness_m) = substance.thickness_m {
        line("thickness", python(thickness_m));
    }
    line("relative_permittivity", python(substance.eps_real.max(1.0)));
    line("conductivity", python(conductivity));
    line("scattering_coefficient", python(best.s));
    line("scattering_pattern", format!("\"{}\"", best.pattern.name()));
    for (key, value) in best.pattern.arguments() {
        line(key, value);
    }
    text + ")\n"
}

/// Which part of a model Sionna's diffuse scattering stands for; it adds the mirror's itself.
#[derive(Clone, Copy)]
enum Scattered {
    /// A mirror leaves none.
    Nothing,
    /// Facets apart from a diffuse part are the mirror.
    DiffusePart,
    All,
}

impl Scattered {
    fn of(model: &Brdf) -> Scattered {
        match model {
            model if model.is_smooth() => Scattered::Nothing,
            Brdf::Mixture(mixture) if mixture.k > 0.0 => Scattered::DiffusePart,
            _ => Scattered::All,
        }
    }

    fn what(self) -> &'static str {
        match self {
            Scattered::DiffusePart => "the diffuse part of the backscatter",
            _ => "the backscatter",
        }
    }

    /// What of the backscatter it is, 1/sr.
    fn retro_per_sr(self, model: &Brdf, theta_rad: f64) -> f64 {
        let i = Direction::from_angles(theta_rad, 0.0);
        match self {
            Scattered::Nothing => 0.0,
            Scattered::DiffusePart => model.f_per_sr(i, i) * (1.0 - model.specular_share(i, i)),
            Scattered::All => model.f_per_sr(i, i),
        }
    }
}

/// A number that Python reads as a float.
fn python(value: f64) -> String {
    format!("{value:?}")
}

/// What the surface reflects like.
struct Substance {
    eps_real: f64,
    eps_imag: f64,
    frequency_hz: f64,
    thickness_m: Option<f64>,
    /// Where it is from, and what is wrong with it, in a clause.
    origin: String,
}

impl Substance {
    fn find(subject: &Subject, model: &Brdf) -> Option<Substance> {
        let middle_hz = subject.frequency_hz();
        let away = |hz: f64| (hz - middle_hz).abs();
        let known = subject.permittivities();
        let nearest = known
            .iter()
            .flatten()
            .min_by(|a, b| away(a.frequency_hz).total_cmp(&away(b.frequency_hz)));
        let thickness_m = subject.material.layers.first().and_then(|layer| layer.thickness_m);
        let substance = |[eps_real, eps_imag]: [f64; 2], frequency_hz, origin: String| Substance {
            eps_real,
            eps_imag,
            frequency_hz,
            thickness_m,
            origin,
        };
        let below_one = |eps_real: f64| match eps_real < 1.0 {
            true => format!("; its real part {eps_real:.3} became 1"),
            false => String::new(),
        };
        if let Some(entry) = nearest {
            let (key, real, ghz) = (&entry.key, entry.real, entry.frequency_hz / 1e9);
            let origin = format!("the permittivity is `{key}` at {ghz:.3} GHz{}", below_one(real));
            return Some(substance([real, entry.imaginary], entry.frequency_hz, origin));
        }
        if let Some(eps) = model.permittivity() {
            let origin = format!("the permittivity is the model's{}", below_one(eps[0]));
            return Some(substance(eps, middle_hz, origin));
        }
        let reflectivity = model.f_lambda().filter(|share| *share < 1.0 - 1e-9)?;
        let root = reflectivity.sqrt();
        let index = (1.0 + root) / (1.0 - root);
        let why = known.err().unwrap_or("no permittivity of the surface is known");
        let origin = format!(
            "{why}: a real one of {:.3} with the same normal reflectance, \
             {reflectivity:.4}, stands in",
            index * index
        );
        Some(substance([index * index, 0.0], middle_hz, origin))
    }
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
                let with = |lambda| Pattern::Backscattering { alpha_r, alpha_i, lambda };
                all.extend(SHARES.map(with));
            }
        }
        all
    }

    /// f_s/cos θ in backscatter, 1/sr; `norms_sr` holds F of each exponent at this angle.
    fn f_per_sr(self, cos: f64, norms_sr: &[(u32, f64)]) -> f64 {
        let norm_sr = |alpha: u32| {
            norms_sr.iter().find(|(known, _)| *known == alpha).map_or(f64::NAN, |(_, norm)| *norm)
        };
        // The mirror direction lies 2θ from the way back: (1 + cos 2θ)/2 = cos²θ.
        let mirror = |alpha: u32| cos.powf(2.0 * f64::from(alpha));
        match self {
            Pattern::Lambertian => 1.0 / PI,
            Pattern::Directive { alpha_r } => mirror(alpha_r) / (norm_sr(alpha_r) * cos),
            Pattern::Backscattering { alpha_r, alpha_i, lambda } => {
                let lobes = lambda * mirror(alpha_r) + (1.0 - lambda);
                let norm_sr = lambda * norm_sr(alpha_r) + (1.0 - lambda) * norm_sr(alpha_i);
                lobes / (norm_sr * cos)
            }
        }
    }
}

struct Best {
    pattern: Pattern,
    /// S.
    s: f64,
    rms_db: f64,
}

/// The pattern and S nearest to the model's backscatter, in dB.
fn best_pattern(
    model: &Brdf,
    part: Scattered,
    substance: &Substance,
    angles: &[f64],
) -> Option<Best> {
    let [eps_real, eps_imag] = [substance.eps_real, substance.eps_imag];
    let mirror = Fresnel { eps_real, eps_imag, lobe_rad: 0.02 };
    let norms = |angle: f64| {
        EXPONENTS.map(|alpha| {
            // A lone lobe back is 1/(F·cos θ).
            let alpha_i = f64::from(alpha);
            let lobe = Directive { s: 1.0, alpha_r: 1.0, lambda: 0.0, alpha_i };
            (alpha, 1.0 / (lobe.retro_per_sr(angle) * angle.cos()))
        })
    };
    let rows: Vec<_> = angles
        .iter()
        .filter(|angle| part.retro_per_sr(model, **angle) > 0.0)
        .map(|&angle| {
            let wanted = part.retro_per_sr(model, angle) / mirror.reflectance(angle);
            (angle.cos(), norms(angle), db_from_ratio(wanted))
        })
        .collect();
    let fitted = |pattern: Pattern| {
        let differences: Vec<f64> = rows
            .iter()
            .map(|(cos, norms, db)| db - db_from_ratio(pattern.f_per_sr(*cos, norms)))
            .collect();
        let count = differences.len() as f64;
        // S² cannot pass 1.
        let level_db = (differences.iter().sum::<f64>() / count).min(0.0);
        let squares: f64 = differences.iter().map(|db| (db - level_db).powi(2)).sum();
        Best { pattern, s: ratio_from_db(level_db).sqrt(), rms_db: (squares / count).sqrt() }
    };
    let all = Pattern::all().into_iter().map(fitted).filter(|best| best.rms_db.is_finite());
    all.min_by(|a, b| a.rms_db.total_cmp(&b.rms_db))
}
