//! Scattering models by name, with values from which a search starts.

use crate::brdf::Brdf;

/// The names of [`model`], sorted.
pub fn model_names() -> impl Iterator<Item = &'static str> {
    let mut names: Vec<&str> = starts().map(|(name, _)| name).collect();
    names.sort_unstable();
    names.into_iter()
}

/// A model by its name, with values to start from; `None` for a name that is not in
/// [`model_names`]. `mixture` is the paper's: Cook–Torrance over Blinn–Phong, five parameters.
pub fn model(name: &str) -> Option<Brdf> {
    let (_, json) = starts().find(|(known, _)| *known == name)?;
    serde_json::from_str(json).ok()
}

/// Name and JSON of every model to start from.
fn starts() -> impl Iterator<Item = (&'static str, &'static str)> {
    Brdf::KINDS.iter().flat_map(|kind| kind.starts).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Scattering;

    #[test]
    fn every_model_starts_within_its_ranges_and_has_something_to_find() {
        assert!(model_names().is_sorted_by(|a, b| a < b));
        for name in model_names() {
            let model = model(name).unwrap();
            assert_eq!(model.validate(), Ok(()), "{name}");
            assert!(!model.parameters().is_empty() && model.sigma0(0.1) > 0.0, "{name}");
        }
        assert!(model("mixtur").is_none());
    }
}
