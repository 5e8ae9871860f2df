//! Weighted parts that add up in power, for models that are made of others.

use crate::brdf::backscatter::Term;
use crate::brdf::scattering::Scattering;
use crate::frames::{Direction, Surface};

/// JSON Schema of a part.
pub(super) const PART_SCHEMA: &str = r##"{"$ref": "#/$defs/model"}"##;

/// f of the parts together, 1/sr, as a beam sees it, and its specular share.
pub(super) fn seen_by<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
    beam_rad: f64,
    i: Direction<Surface>,
    o: Direction<Surface>,
) -> (f64, f64) {
    let (mut all, mut specular) = (0.0, 0.0);
    for (weight, part) in parts {
        let (f, share) = part.seen_by(beam_rad, i, o);
        all += weight * f;
        specular += weight * f * share;
    }
    (all, if all > 0.0 { specular / all } else { 0.0 })
}

/// The closed forms of the parts in backscatter; `None` when one of them has none.
pub(super) fn backscatter<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
) -> Option<Vec<Term>> {
    let mut all = Vec::new();
    for (weight, part) in parts {
        for term in part.backscatter()? {
            all.push(Term { level_per_sr: weight * term.level_per_sr, ..term });
        }
    }
    Some(all)
}
