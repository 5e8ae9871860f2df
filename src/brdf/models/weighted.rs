//! Weighted parts that add up in power, for models that are made of others.

use num_complex::Complex;

use crate::brdf::backscatter::Term;
use crate::brdf::lobe::Lobe;
use crate::brdf::scattering::{NarrowLobe, Scattering, Seen};
use crate::brdf::slopes::VIEWING_RAD;
use crate::frames::{Direction, Surface};

/// JSON Schema of a part.
pub(super) const PART_SCHEMA: &str = r##"{"$ref": "#/$defs/model"}"##;

/// What is seen of the parts together.
pub(super) fn combined<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
    of_part: impl Fn(&P) -> Seen,
) -> Seen {
    let mut all = Seen::default();
    for (weight, part) in parts {
        let seen = of_part(part);
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

/// The amplitudes of the facets of the part that mirrors most.
pub(super) fn facet_amplitudes<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
    i: Direction<Surface>,
    o: Direction<Surface>,
) -> [Complex<f64>; 2] {
    let mut most = (0.0, [Complex::from(-1.0); 2]);
    for (weight, part) in parts {
        let seen = part.seen_by(VIEWING_RAD, i, o);
        let mirrored = weight * seen.f_per_sr * seen.specular_share;
        if mirrored > most.0 {
            most = (mirrored, part.facet_amplitudes(i, o));
        }
    }
    most.1
}

/// The narrow lobes of the parts.
pub(super) fn narrow_lobes<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
    i: Direction<Surface>,
) -> Vec<NarrowLobe> {
    let lobes = parts.flat_map(|(weight, part)| {
        let weighted = move |lobe: NarrowLobe| NarrowLobe { share: weight * lobe.share, ..lobe };
        part.narrow_lobes(i).into_iter().map(weighted)
    });
    lobes.collect()
}

/// The lobes of the parts; `None` when one of them has no such sum.
pub(super) fn lobes<'a, P: Scattering + 'a>(
    parts: impl Iterator<Item = (f64, &'a P)>,
) -> Option<Vec<Lobe>> {
    let mut all = Vec::new();
    for (weight, part) in parts {
        all.extend(part.lobes()?.into_iter().map(|lobe| lobe.weighted(weight)));
    }
    Some(all)
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
