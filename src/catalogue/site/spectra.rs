//! The permittivity over frequency, drawn for a page.

use serde::Serialize;

use super::curve::{Sample, class_of, ink, word};
use super::entry::kind_of;
use crate::catalogue::spectrum::{Spectrum, spectra};
use crate::formats::figure::{Inline, Series, Style};
use crate::formats::words::digits;
use crate::material::Material;

/// One substance at one temperature.
#[derive(Debug, Serialize)]
pub(super) struct SpectrumView {
    svg: String,
    samples: Vec<Sample>,
}

/// The spectra of a material for its page.
pub(super) fn view(material: &Material) -> Vec<SpectrumView> {
    let spectra = spectra(material).into_iter().enumerate();
    spectra.filter_map(|(number, spectrum)| drawn(material, number, spectrum)).collect()
}

/// None when there is nothing finite to draw.
fn drawn(material: &Material, number: usize, spectrum: Spectrum) -> Option<SpectrumView> {
    let kind = kind_of(material, &spectrum.source);
    let (mut classes, mut samples) = (Vec::new(), Vec::new());
    for series in &spectrum.series {
        let class = format!("{} {}", ink(samples.len()), class_of(kind));
        classes.push(class.clone());
        if series.style == Style::Curve {
            let is_band = |other: &Series| other.style == Style::Band && other.name == series.name;
            let has_band = spectrum.series.iter().any(is_band);
            let note = if has_band { "with its 95 % band" } else { "" };
            let name = series.name.clone();
            samples.push(Sample {
                name,
                kind: word(kind),
                kind_words: None,
                shape: "line",
                class,
                note,
            });
        }
    }
    let (low, high) = spectrum.range_ghz;
    let title = format!("Relative permittivity of {} over frequency", spectrum.name);
    let [low_ghz, high_ghz] = [low, high].map(digits);
    let page = Inline {
        id: &format!("spectrum-{number}"),
        description: &format!(
            "ε′ and ε″ from {low_ghz} to {high_ghz} GHz. The table holds the same numbers."
        ),
        claimed: spectrum.range_ghz,
        classes: &classes,
    };
    let svg = Spectrum::plot(&title, "", &[spectrum]).inline_svg(&page).ok()?;
    Some(SpectrumView { svg, samples })
}
