//! The data of a material on the page of comparisons.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::curve::{line_word, marks, word};
use super::entry::{kind_of, status_of};
use super::levels::{Levels, TABLE_DEG, range_deg, tenth};
use crate::formats::words::shortened;
use crate::material::{Curve, Material, SourceKind};

/// Lines, points and a few levels, in ° and dB.
pub(super) fn data(material: &Material) -> Value {
    let rendered = material.scattering().ok();
    let levels = rendered.as_ref().map(|model| Levels::rendered(material, model));
    let mut lines = Vec::new();
    for fit in &material.fits {
        let levels = Levels::stated(material, &fit.model);
        lines.push(line(&fit.name, line_word(material, fit), material.kind_words(fit), &levels));
    }
    let drawn = material.curves.iter().find(|curve| curve.name == material.render);
    if let (Some(drawn), Some(levels)) = (drawn, &levels) {
        lines.push(line(&drawn.name, word(kind_of(material, &drawn.source)), None, levels));
    }
    let table =
        TABLE_DEG.map(|deg| levels.as_ref().map_or(String::new(), |levels| levels.text(deg)));
    json!({
        "slug": material.slug,
        "name": shortened(&material.name, 200),
        "kind": material.render_kind().map_or("unknown", SourceKind::as_str),
        "kind_words": material.rendered_words(),
        "status": status_of(material),
        "render": shortened(&material.render, 200),
        "ghz": material.frequency_hz.map(|hz| hz / 1e9),
        "deg": range_deg(material),
        "lines": lines,
        "curves": material.curves.iter().map(|c| curve(material, c)).collect::<Vec<_>>(),
        "table": { "deg": TABLE_DEG, "level": table },
    })
}

/// A line; `kind` chooses its style.
fn line(name: &str, kind: &str, kind_words: Option<String>, levels: &Levels) -> Value {
    json!({
        "name": shortened(name, 200),
        "kind": kind,
        "kind_words": kind_words,
        "pieces": levels.line(),
    })
}

fn curve(material: &Material, curve: &Curve) -> Value {
    let [seen, below, above] = marks(&curve.observations).map(|(_, points)| thinned(&points));
    json!({
        "name": shortened(&curve.name, 200),
        "kind": kind_of(material, &curve.source).map_or("unknown", SourceKind::as_str),
        "seen": seen, "below": below, "above": above,
    })
}

/// Points on a grid of half a degree and half a decibel, each once: finer than several materials on
/// one plot can show.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let half = |value: f64| (value * 2.0).round() as i64;
    let cells: BTreeSet<(i64, i64)> =
        points.iter().filter(|p| p.1.is_finite()).map(|p| (half(p.0), half(p.1))).collect();
    cells.into_iter().map(|(x, y)| (tenth(x as f64 / 2.0), tenth(y as f64 / 2.0))).collect()
}
