//! Weighted parts that add up in power, for models that are made of others.

use crate::brdf::backscatter::Term;
use crate::brdf::scattering::{Scattering, Seen};
use crate::frames::{Direction, Surface};

/// JSON Schema of a part.
pub(super) const PART_SCHEMA: &str = r##"{"$ref": "#/$defs/model"}"##;

/// What a beam sees of the parts together.
pub(super) fn seen_by<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
    beam_rad: f64,
    i: Direction<Surface>,
    o: Direction<Surface>,
) -> Seen {
    let mut all = Seen::default();
    for (weight, part) in parts {
        let seen = part.seen_by(beam_rad, i, o);
        let f_per_sr = weight * seen.f_per_sr;
        all.f_per_sr += f_per_sr;
        all.specular_share += f_per_sr * seen.specular_share;
        all.coherent_share += f_per_sr * seen.coherent_share;
    }
    if all.f_per_sr > 0.0 {
        all.specular_share /= all.f_per_sr;
        all.coherent_share /= all.f_per_sr;
    }
    all
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
