//! Mitsuba 3 BSDF as XML (checked with Mitsuba 3.9.1): `diffuse`, `conductor`, `roughconductor`, `blendbsdf`.
//!
//! Mitsuba's α is our m for both laws of slopes (√2 times the rms slope for Beckmann's), its G is
//! Smith's G1(i)·G1(o), α_u lies along x, and its `eval` is f·cos θ_o. Polarisation is ignored: `eta` and
//! `k` are the parts of √ε, and a reflectivity f_λ becomes the real index with the same normal
//! reflectance, `eta` = (1 + √f_λ)/(1 − √f_λ), so that Fresnel stands in for Schlick: backscatter, where
//! facets are seen along their normals, is the same. `conductor` is a smooth mirror, a delta as here. Both it and
//! `roughconductor` are used for dielectrics, too:
//! nothing is seen through a material that is a half space.
//!
//! Models without a counterpart (Blinn–Phong, curves, Kirchhoff, lobes, layers, sums, correlated
//! shadowing) become the blend of `diffuse` and `roughconductor` whose backscatter is nearest to theirs
//! in dB over the claimed angles, and the export reports the difference. Lost: effects, uncertainty, frequency.

use std::f64::consts::{PI, SQRT_2};

use num_complex::Complex;

use super::error::ExchangeError;
use super::export_files::Export;
use super::subject::{Subject, one_line};
use crate::brdf::{
    Brdf, CookTorrance, Distribution, Fresnel, Lambert, Mixture, Scattering, Shadowing,
};
use crate::units::db_from_ratio;

/// Writes the BSDF.
pub(super) fn write(subject: &Subject, name: &str) -> Result<Export, ExchangeError> {
    const FORMAT: &str = "a Mitsuba BSDF";
    const WAY_OUT: &str = "render another fit or curve";
    let slug = &subject.material.slug;
    let model =
        subject.model().map_err(|error| ExchangeError::unfit(slug, FORMAT, error, WAY_OUT))?;
    let angles = subject.echoing_rad(&model);
    if angles.is_empty() {
        let problem = "nothing comes back at any claimed angle";
        return Err(ExchangeError::unfit(slug, FORMAT, problem, WAY_OUT));
    }
    let near = counterpart(&model, &angles);
    let mut lost = vec!["the file holds what scenes render, as backscatter".to_owned()];
    if !subject.material.effects.is_empty() {
        lost.push("effects have no counterpart".to_owned());
    }
    let Miss { rms_db, worst_db, .. } = miss(&model, &near, &angles);
    if worst_db >= 0.05 {
        lost.push(format!(
            "parts of the model have no counterpart: their stand-ins miss its backscatter by {rms_db:.1} \
             dB rms, {worst_db:.1} dB at most, over the claimed angles"
        ));
    }
    let schlick_db = schlick_miss_db(&near);
    if schlick_db >= 0.05 {
        lost.push(format!(
            "Fresnel stands in for Schlick, the same in backscatter, up to {schlick_db:.1} dB off at \
             a facet's angle of up to 60°"
        ));
    }
    let lost = lost.join("; ");
    let mut text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n".to_owned();
    for line in subject.about().iter().chain([&one_line(&lost)]) {
        text += &format!("<!-- {} -->\n", comment(line));
    }
    let id = format!("version=\"3.0.0\" id=\"{}\"", subject.material.slug);
    bsdf(&near, &id, 0, &mut text);
    Ok(Export { files: vec![(name.to_owned(), text.into_bytes())], lost })
}

/// The text as it may stand in a comment of XML; the second pass is for three in a row.
fn comment(line: &str) -> String {
    line.replace("--", "- -").replace("--", "- -")
}

/// A parameter in Mitsuba's XML: its tag, name and value.
type Value = (&'static str, &'static str, String);

/// Writes the element of a model and those of its parts.
fn bsdf(model: &Brdf, attributes: &str, depth: usize, text: &mut String) {
    let (kind, values): (&str, Vec<Value>) = match model {
        Brdf::Lambert(Lambert { albedo }) => {
            ("diffuse", vec![("spectrum", "reflectance", albedo.to_string())])
        }
        Brdf::CookTorrance(facets) => ("roughconductor", facet_values(facets)),
        Brdf::Fresnel(mirror) => match mirror.lobe_rad {
            None => ("conductor", mirror_index(mirror).to_vec()),
            Some(lobe_rad) => ("roughconductor", mirror_values(mirror, lobe_rad)),
        },
        // Mitsuba's weight is that of the second part.
        Brdf::Mixture(mixture) => ("blendbsdf", vec![("float", "weight", mixture.k.to_string())]),
        // `counterpart` returns no other model.
        _ => return,
    };
    let indent = "    ".repeat(depth);
    let space = if attributes.is_empty() { "" } else { " " };
    *text += &format!("{indent}<bsdf type=\"{kind}\"{space}{attributes}>\n");
    for (tag, name, value) in values {
        *text += &format!("{indent}    <{tag} name=\"{name}\" value=\"{value}\"/>\n");
    }
    if let Brdf::Mixture(Mixture { diffuse, specular, .. }) = model {
        bsdf(specular, "", depth + 1, text);
        bsdf(diffuse, "", depth + 1, text);
    }
    *text += &format!("{indent}</bsdf>\n");
}

fn facet_values(facets: &CookTorrance) -> Vec<Value> {
    let mut values = vec![("string", "distribution", law(facets.distribution).to_owned())];
    match facets.m_across {
        None => values.push(("float", "alpha", facets.m.to_string())),
        Some(m_across) => values.extend([
            ("float", "alpha_u", facets.m.to_string()),
            ("float", "alpha_v", m_across.to_string()),
        ]),
    }
    match index(facets.f_lambda) {
        Some(n) => values.extend(index_values(Complex::from(n))),
        None => values.push(("string", "material", "none".to_owned())),
    }
    values
}

fn mirror_values(mirror: &Fresnel, lobe_rad: f64) -> Vec<Value> {
    let mut values = vec![
        ("string", "distribution", "beckmann".to_owned()),
        ("float", "alpha", lobe_rad.to_string()),
    ];
    values.extend(mirror_index(mirror));
    values
}

fn mirror_index(mirror: &Fresnel) -> [Value; 2] {
    index_values(Complex::new(mirror.eps_real, mirror.eps_imag).sqrt())
}

fn law(distribution: Distribution) -> &'static str {
    match distribution {
        Distribution::Beckmann => "beckmann",
        Distribution::Ggx => "ggx",
    }
}

/// The real index with this normal reflectance; none where all is reflected.
fn index(reflectivity: f64) -> Option<f64> {
    let root = reflectivity.sqrt();
    (root < 1.0 - 1e-9).then(|| (1.0 + root) / (1.0 - root))
}

fn index_values(index: Complex<f64>) -> [Value; 2] {
    [("spectrum", "eta", index.re.to_string()), ("spectrum", "k", index.im.to_string())]
}

/// The nearest model that Mitsuba has: made of Lambert, Cook–Torrance, Fresnel and mixtures of them.
fn counterpart(model: &Brdf, angles: &[f64]) -> Brdf {
    match model {
        Brdf::Lambert(_) | Brdf::Fresnel(_) => model.clone(),
        Brdf::CookTorrance(facets) if facets.shadowing == Shadowing::Separable => model.clone(),
        Brdf::BlinnPhong(lobe) if lobe.alpha == 0.0 => Brdf::Lambert(Lambert { albedo: lobe.r_s }),
        Brdf::KirchhoffGo(slopes) => Brdf::Fresnel(Fresnel {
            eps_real: slopes.eps_real,
            eps_imag: slopes.eps_imag,
            lobe_rad: Some(SQRT_2 * slopes.rms_slope),
        }),
        Brdf::Mixture(Mixture { k, diffuse, specular }) => Brdf::Mixture(Mixture {
            k: *k,
            diffuse: Box::new(counterpart(diffuse, angles)),
            specular: Box::new(counterpart(specular, angles)),
        }),
        model => nearest_blend(model, angles),
    }
}

/// The blend of a diffuse part and facets, of one level, whose backscatter is nearest in dB.
fn nearest_blend(model: &Brdf, angles: &[f64]) -> Brdf {
    let (roughness_steps, share_steps) = (60, 50);
    let mut best: Option<(f64, Brdf)> = None;
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for step in 0..=roughness_steps {
            // 0.01 to 1, evenly in the logarithm.
            let m = 10f64.powf(2.0 * f64::from(step) / f64::from(roughness_steps) - 2.0);
            let shadowing = Shadowing::Separable;
            let facets = CookTorrance { f_lambda: 1.0, m, m_across: None, distribution, shadowing };
            for step in 0..=share_steps {
                // The facets' share from 1 down to 1e-5 evenly in the logarithm, and none.
                let facets_share = match step {
                    step if step == share_steps => 0.0,
                    step => 10f64.powf(-5.0 * f64::from(step) / f64::from(share_steps - 1)),
                };
                let mean_db = miss(&blend(1.0, facets, facets_share), model, angles).mean_db;
                let level = 10f64.powf(mean_db / 10.0).min(1.0);
                let candidate = blend(level, facets, facets_share);
                let rms_db = miss(model, &candidate, angles).rms_db;
                if best.as_ref().is_none_or(|(least, _)| rms_db < *least) {
                    best = Some((rms_db, candidate));
                }
            }
        }
    }
    best.map_or_else(|| model.clone(), |(_, blend)| blend)
}

/// A diffuse part and facets of one level, with this share of facets.
fn blend(level: f64, facets: CookTorrance, facets_share: f64) -> Brdf {
    Brdf::Mixture(Mixture {
        k: 1.0 - facets_share,
        diffuse: Box::new(Brdf::Lambert(Lambert { albedo: level })),
        specular: Box::new(Brdf::CookTorrance(CookTorrance { f_lambda: level, ..facets })),
    })
}

/// By how much a model's backscatter differs from another's.
struct Miss {
    mean_db: f64,
    rms_db: f64,
    worst_db: f64,
}

fn miss(model: &Brdf, other: &Brdf, angles: &[f64]) -> Miss {
    let (mut sum, mut squares, mut worst_db, mut count) = (0.0, 0.0, 0.0f64, 0.0);
    for &angle in angles {
        // A part of a mixture may be silent where the whole is not.
        let (a, b) = (model.retro_per_sr(angle), other.retro_per_sr(angle));
        let db = db_from_ratio(b.max(1e-30) / a.max(1e-30));
        (sum, squares, count) = (sum + db, squares + db * db, count + 1.0);
        worst_db = worst_db.max(db.abs());
    }
    Miss { mean_db: sum / count, rms_db: f64::sqrt(squares / count), worst_db }
}

/// The largest difference between Schlick's F and Fresnel's for the index that replaces it, at facets' angles to 60°,
/// dB.
fn schlick_miss_db(model: &Brdf) -> f64 {
    match model {
        Brdf::CookTorrance(facets) => {
            let Some(n) = index(facets.f_lambda) else { return 0.0 };
            let mirror = Fresnel { eps_real: n * n, eps_imag: 0.0, lobe_rad: None };
            let mut worst_db = 0.0f64;
            for degree in 0..=60 {
                let psi = f64::from(degree) * PI / 180.0;
                let f = facets.f_lambda + (1.0 - facets.f_lambda) * (1.0 - psi.cos()).powi(5);
                let db = db_from_ratio(mirror.reflectance(psi) / f).abs();
                worst_db = if db.is_finite() { worst_db.max(db) } else { worst_db };
            }
            worst_db
        }
        Brdf::Mixture(mixture) => {
            schlick_miss_db(&mixture.diffuse).max(schlick_miss_db(&mixture.specular))
        }
        _ => 0.0,
    }
}
