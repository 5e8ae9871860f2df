//! The permittivity of a material over frequency, as a plot draws it.

use crate::formats::figure::{Ink, Plot, Series, Style};
use crate::formats::words::as_typed;
use crate::material::{Material, Permittivity};

/// Fewest frequencies that are drawn.
const FEWEST: usize = 3;
/// Standard deviations to each side that hold 95 %.
const NORMAL_95: f64 = 1.96;

/// ε′ and ε″ of one substance at one temperature, over frequency.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// The substance, and the temperature where one is stated.
    pub name: String,
    /// The lowest and the highest frequency, GHz.
    pub range_ghz: (f64, f64),
    /// Key of the source of its first number.
    pub source: String,
    /// The curves of ε′ and ε″ over GHz, each after its 95 % band where standard deviations are stated.
    pub series: Vec<Series>,
}

impl Spectrum {
    /// The plot of some spectra.
    pub fn plot<'a>(title: &'a str, subtitle: &'a str, spectra: &[Spectrum]) -> Plot<'a> {
        Plot {
            title,
            subtitle,
            x_label: "frequency, GHz",
            y_label: "relative permittivity ε′ − jε″",
            y_range: y_range(spectra),
            series: spectra.iter().flat_map(|one| one.series.clone()).collect(),
            ..Plot::default()
        }
    }
}

/// Around everything that is drawn, and zero.
fn y_range(spectra: &[Spectrum]) -> Option<(f64, f64)> {
    let drawn = spectra.iter().flat_map(|one| &one.series).flat_map(|series| &series.points);
    let values = drawn.map(|point| point.1);
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), y| (low.min(y), high.max(y)));
    (low < high).then_some((1.04 * low, 1.04 * high))
}

/// The spectra of a material: of each substance and temperature with at least three frequencies, in the order of the
/// material.
pub fn spectra(material: &Material) -> Vec<Spectrum> {
    let is_same =
        |a: &Permittivity, b: &Permittivity| (&a.key, a.temperature_k) == (&b.key, b.temperature_k);
    let all = &material.permittivities;
    let mut spectra = Vec::new();
    for (number, first) in all.iter().enumerate() {
        let mut rows: Vec<_> = all.iter().filter(|other| is_same(first, other)).collect();
        let is_new = !all[..number].iter().any(|other| is_same(first, other));
        if is_new && rows.len() >= FEWEST {
            rows.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
            spectra.push(spectrum(first, &rows, spectra.len()));
        }
    }
    spectra
}

/// The spectrum of these rows, lowest frequency first; `number` is its place among those of the material.
fn spectrum(first: &Permittivity, rows: &[&Permittivity], number: usize) -> Spectrum {
    let celsius = first.temperature_k.map(|k| format!(" at {} °C", as_typed(k - 273.15)));
    let name = first.key.clone() + &celsius.unwrap_or_default();
    let ghz = |row: &&Permittivity| row.frequency_hz / 1e9;
    let range_ghz = (rows.first().map_or(0.0, ghz), rows.last().map_or(0.0, ghz));
    let mut series = Vec::new();
    for (place, (part, pick)) in PARTS.into_iter().enumerate() {
        let ink = Ink::Own(PARTS.len() * number + place);
        let name = format!("{part} of {name}");
        let points: Vec<_> = rows.iter().map(|row| (ghz(row), pick(row).0)).collect();
        let known = rows.iter().filter_map(|row| {
            let (value, sd) = pick(row);
            sd.map(|sd| (ghz(row), value, NORMAL_95 * sd))
        });
        let known: Vec<(f64, f64, f64)> = known.collect();
        if known.len() >= 2 {
            // Along the lower end and back along the upper one. Neither part is negative in what does not amplify.
            let low = known.iter().map(|(x, y, room)| (*x, (y - room).max(y.min(0.0))));
            let high = known.iter().rev().map(|(x, y, room)| (*x, y + room));
            let points = low.chain(high).collect();
            series.push(Series { name: name.clone(), style: Style::Band, ink, points });
        }
        series.push(Series { name, style: Style::Curve, ink, points });
    }
    Spectrum { name, range_ghz, source: first.source.clone(), series }
}

/// A part of a permittivity with its standard deviation.
type Pick = fn(&Permittivity) -> (f64, Option<f64>);

const PARTS: [(&str, Pick); 2] =
    [("ε′", |row| (row.real, row.real_sd)), ("ε″", |row| (row.imaginary, row.imaginary_sd))];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;

    #[test]
    fn a_spectrum_has_its_two_parts_with_bands_where_deviations_are_stated() {
        let pvdf = builtin::get("pvdf").unwrap().unwrap();
        let [one] = &spectra(&pvdf)[..] else { panic!("one substance over frequency") };
        assert_eq!((one.name.as_str(), one.range_ghz), ("pvdf", (150.0, 1000.0)));
        let styles: Vec<Style> = one.series.iter().map(|series| series.style).collect();
        assert_eq!(styles, [Style::Band, Style::Curve, Style::Band, Style::Curve]);
        let [band, curve, ..] = &one.series[..] else { panic!() };
        let at = curve.points.iter().position(|point| point.0 == 300.0).unwrap();
        let row = pvdf.permittivities.iter().find(|row| row.frequency_hz == 300e9).unwrap();
        let reach = NORMAL_95 * row.real_sd.unwrap();
        assert_eq!(curve.points[at].1, row.real);
        assert_eq!(band.points[at], (300.0, row.real - reach));
        assert_eq!(band.points[band.points.len() - 1 - at], (300.0, row.real + reach));
    }

    #[test]
    fn two_frequencies_are_no_spectrum() {
        let ptfe = builtin::get("ptfe").unwrap().unwrap();
        assert!(spectra(&ptfe).is_empty());
        let mut pvdf = builtin::get("pvdf").unwrap().unwrap();
        pvdf.permittivities.truncate(2);
        assert!(spectra(&pvdf).is_empty());
    }
}
