//! Models by the names that people call them by, with values to start a search from.
//!
//! The values are guesses of the right order for dry solids near 300 GHz and claim nothing.

use crate::brdf::Brdf;

const MODELS: [(&str, &str); 10] = [
    ("blinn-phong", r#"{"model": "blinn-phong", "r_s": 0.05, "alpha": 3}"#),
    ("cook-torrance", r#"{"model": "cook-torrance", "f_lambda": 0.05, "m": 0.1}"#),
    (
        "cook-torrance-ggx",
        r#"{"model": "cook-torrance", "distribution": "ggx", "f_lambda": 0.05, "m": 0.1}"#,
    ),
    ("directive", r#"{"model": "directive", "s": 0.3, "alpha_r": 4, "lambda": 0.5, "alpha_i": 4}"#),
    ("fresnel", r#"{"model": "fresnel", "eps_real": 3}"#),
    (
        "kirchhoff",
        r#"{"model": "kirchhoff", "rms_height_m": 5e-5, "correlation_length_m": 5e-4, "eps_real": 3}"#,
    ),
    ("kirchhoff-go", r#"{"model": "kirchhoff-go", "rms_slope": 0.2, "eps_real": 3}"#),
    ("lambert", r#"{"model": "lambert", "albedo": 0.1}"#),
    (
        "mixture",
        r#"{"model": "mixture", "k": 0.1,
        "specular": {"model": "cook-torrance", "f_lambda": 0.05, "m": 0.1},
        "diffuse": {"model": "blinn-phong", "r_s": 0.04, "alpha": 3}}"#,
    ),
    (
        "mixture-ggx",
        r#"{"model": "mixture", "k": 0.1,
        "specular": {"model": "cook-torrance", "distribution": "ggx", "f_lambda": 0.05, "m": 0.1},
        "diffuse": {"model": "blinn-phong", "r_s": 0.04, "alpha": 3}}"#,
    ),
];

/// Names that [`model`] knows, sorted.
pub fn model_names() -> impl Iterator<Item = &'static str> {
    MODELS.iter().map(|(name, _)| *name)
}

/// A model by its name, with values to start from; `None` for a name that is not in
/// [`model_names`]. `mixture` is the paper's: Cook–Torrance over Blinn–Phong, five parameters.
pub fn model(name: &str) -> Option<Brdf> {
    let (_, text) = MODELS.iter().find(|(known, _)| *known == name)?;
    serde_json::from_str(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Scattering;

    #[test]
    fn every_model_starts_within_its_ranges_and_has_something_to_find() {
        assert!(MODELS.is_sorted_by(|a, b| a.0 < b.0));
        for name in model_names() {
            let model = model(name).unwrap();
            assert_eq!(model.validate(), Ok(()), "{name}");
            assert!(!model.parameters().is_empty() && model.sigma0(0.1) > 0.0, "{name}");
        }
        assert!(model("mixtur").is_none());
    }
}
