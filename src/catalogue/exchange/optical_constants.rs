//! Optical constants, pages of refractiveindex.info's database (YAML; checked with the database of
//! 2026-06-14, commit ff11b58).
//!
//! A page gives n and k against the wavelength in µm, as tables or n as a dispersion formula. They
//! become the permittivities ε = (n − jk)² at the tabulated frequencies around the one that is asked
//! for, and a smooth half space of the nearest. Nothing is read beyond the table: how far the nearest
//! frequency lies is kept as something that is not known. n is interpolated over the wavelength only
//! where it is tabulated apart from k. Lost: frequencies further away than a third, the conditions
//! other than the temperature, HTML.

use super::detail::Detail;
use super::details::{Details, file_name, missing};
use super::dispersion::{Formula, formula};
use super::error::ExchangeError;
use super::page::{Block, Page, parse};
use crate::brdf::{Brdf, Fresnel};
use crate::formats::FormatError;
use crate::material::{
    Citation, Fit, Lobes, Making, Material, Permittivity, Slug, Source, SourceKind, Status,
};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// Key of the source of n and k.
const OPTICAL_CONSTANTS: &str = "optical-constants";
/// Frequency that is wanted by default, Hz.
const USUAL_HZ: f64 = 300e9;
/// Half width of the band of frequencies that are kept, over the wanted frequency.
const REACH: f64 = 1.0 / 3.0;

/// n and k at a frequency.
#[derive(Clone, Copy, Debug)]
struct Constants {
    frequency_hz: f64,
    n: f64,
    k: f64,
}

impl Constants {
    /// Real and imaginary part of ε = (n − jk)² = ε′ − jε″.
    fn permittivity(&self) -> [f64; 2] {
        [self.n * self.n - self.k * self.k, 2.0 * self.n * self.k]
    }
}

/// Makes a material of a page.
pub(super) fn read(file: &str, bytes: &[u8], given: &Details) -> Result<Material, ExchangeError> {
    let page = text(bytes).and_then(parse);
    let page = page.map_err(|error| ExchangeError::in_file(file, error))?;
    let known = page.is_cc0.then(|| "CC0-1.0".to_owned());
    let licence = given.licence.clone().or(known);
    let details = [
        (given.slug.is_some(), Detail::Name),
        (given.class.is_some(), Detail::Class),
        (licence.is_some(), Detail::Licence),
    ];
    let (Some(slug), Some(class), Some(licence)) =
        (given.slug.clone(), given.class.clone(), licence)
    else {
        return Err(missing(file, &details));
    };
    let wanted_hz = given.frequency_hz.unwrap_or(USUAL_HZ);
    let constants = constants(&page).map_err(|error| ExchangeError::in_file(file, error))?;
    let (nearest, constants) = around(file, constants, wanted_hz)?;
    let entry = Entry { slug, class, licence, wanted_hz, nearest, constants };
    Ok(material(file, &page, given, entry))
}

fn text(bytes: &[u8]) -> Result<&str, FormatError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let place = format!("byte {}", error.valid_up_to());
        FormatError::at(place, "not UTF-8", "save the file as UTF-8")
    })
}

/// The constants at every tabulated wavelength where both are known.
fn constants(page: &Page) -> Result<Vec<Constants>, FormatError> {
    let (mut indices, mut losses) = (Vec::new(), Vec::new());
    for block in &page.data {
        match block.kind {
            "tabulated nk" => {
                indices.push(Curve::Table(column(block, 1, 3)?));
                losses.push(column(block, 2, 3)?);
            }
            "tabulated n" => indices.push(Curve::Table(column(block, 1, 2)?)),
            "tabulated k" => losses.push(column(block, 1, 2)?),
            kind => indices.push(Curve::Formula(formula(block, kind)?)),
        }
    }
    let (Ok([index]), Ok([loss])) =
        (<[Curve; 1]>::try_from(indices), <[Vec<[f64; 2]>; 1]>::try_from(losses))
    else {
        return Err(FormatError::at(
            "DATA",
            "must give n once and k once, since a permittivity needs both",
            "name a page with both, or write a material.toml with a [[permittivity]]",
        ));
    };
    let mut constants = Vec::new();
    for [wavelength_um, k] in loss {
        if let Some(n) = index.at(wavelength_um) {
            let frequency_hz = SPEED_OF_LIGHT_M_PER_S / (wavelength_um * 1e-6);
            constants.push(Constants { frequency_hz, n, k });
        }
    }
    Ok(constants)
}

/// The constants within reach of a frequency, and the nearest of them.
fn around(
    file: &str,
    mut all: Vec<Constants>,
    wanted_hz: f64,
) -> Result<(Constants, Vec<Constants>), ExchangeError> {
    all.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    let away = |c: &Constants| (c.frequency_hz - wanted_hz).abs();
    let nearest = all.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)));
    let Some(nearest) = nearest else {
        let problem = "n and k are nowhere known together";
        let error = FormatError::at("DATA", problem, "name a page with both");
        return Err(ExchangeError::in_file(file, error));
    };
    if away(&nearest) > REACH * wanted_hz {
        let (file, nearest_hz) = (file.to_owned(), nearest.frequency_hz);
        return Err(ExchangeError::FarFrequency { file, wanted_hz, nearest_hz });
    }
    all.retain(|c| away(c) <= REACH * wanted_hz);
    Ok((nearest, all))
}

/// n against the wavelength.
enum Curve {
    /// Wavelength in µm, ascending, and value.
    Table(Vec<[f64; 2]>),
    Formula(Formula),
}

impl Curve {
    /// The value at a wavelength in µm; none outside.
    fn at(&self, wavelength_um: f64) -> Option<f64> {
        match self {
            Curve::Formula(formula) => formula.at(wavelength_um),
            Curve::Table(rows) => {
                let right = rows.partition_point(|row| row[0] < wavelength_um);
                let next = rows.get(right)?;
                if next[0] == wavelength_um {
                    return Some(next[1]);
                }
                let before = rows.get(right.checked_sub(1)?)?;
                let share = (wavelength_um - before[0]) / (next[0] - before[0]);
                Some(before[1] + share * (next[1] - before[1]))
            }
        }
    }
}

/// A column of a table against the wavelength, sorted by it.
fn column(block: &Block, column: usize, width: usize) -> Result<Vec<[f64; 2]>, FormatError> {
    let mut rows = Vec::new();
    for (line, row) in &block.rows {
        let place = || format!("line {line}");
        let (Some(&wavelength_um), Some(&value), true) =
            (row.first(), row.get(column), row.len() == width)
        else {
            let problem = format!("{} numbers in a row of `{}`", row.len(), block.kind);
            return Err(FormatError::at(place(), problem, format!("give {width}")));
        };
        if wavelength_um <= 0.0 || value < 0.0 {
            let problem = "a wavelength must be above 0, n and k must not be below";
            return Err(FormatError::at(place(), problem, "mend the row"));
        }
        rows.push([wavelength_um, value]);
    }
    if rows.is_empty() {
        let place = format!("line {}", block.line);
        let problem = format!("`{}` has no rows", block.kind);
        return Err(FormatError::at(place, problem, "add `data: |` with a row per wavelength"));
    }
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(rows)
}

/// What the file and the person state about an entry.
struct Entry {
    slug: Slug,
    class: String,
    licence: String,
    wanted_hz: f64,
    nearest: Constants,
    constants: Vec<Constants>,
}

fn material(file: &str, page: &Page, given: &Details, entry: Entry) -> Material {
    let Entry { slug, class, licence, wanted_hz, nearest, constants } = entry;
    let [eps_real, eps_imag] = nearest.permittivity();
    let permittivities = constants.iter().map(|at| {
        let [real, imaginary] = at.permittivity();
        Permittivity {
            frequency_source: None,
            key: slug.to_string(),
            frequency_hz: at.frequency_hz,
            temperature_k: page.temperature_k,
            real,
            imaginary,
            real_sd: None,
            imaginary_sd: None,
            source: OPTICAL_CONSTANTS.to_owned(),
        }
    });
    let (wanted_ghz, near_ghz) = (wanted_hz / 1e9, nearest.frequency_hz / 1e9);
    let distance = format!(
        "The permittivity at {wanted_ghz} GHz itself: the nearest tabulated frequency is \
         {near_ghz:.6} GHz, {:.6} GHz away, and is rendered as it is.",
        (near_ghz - wanted_ghz).abs()
    );
    let comments = plain(&page.comments);
    Material {
        name: given.name.clone().unwrap_or_else(|| slug.to_string()),
        class,
        description: format!("A smooth half space by its optical constants. {comments}")
            .trim()
            .to_owned(),
        licence: licence.clone(),
        tags: vec!["optical constants".to_owned()],
        frequency_hz: [nearest.frequency_hz; 2],
        // A mirror returns an echo only near normal incidence.
        theta_rad: [0.0, 5f64.to_radians()],
        render: "half-space".to_owned(),
        sources: vec![
            optical_source(file, page, given, licence),
            source(
                "half-space",
                SourceKind::Modelled,
                "Fresnel's reflectance of a smooth half space",
            ),
        ],
        instruments: Vec::new(),
        curves: Vec::new(),
        fits: vec![Fit {
            name: "half-space".to_owned(),
            model: Brdf::Fresnel(Fresnel { eps_real, eps_imag, lobe_rad: None }),
            estimator: "stated".to_owned(),
            curve: None,
            source: "half-space".to_owned(),
            lobes: Lobes::RadarAndSurface,
            parameter_sources: vec![
                ("eps_imag".to_owned(), OPTICAL_CONSTANTS.to_owned()),
                ("eps_real".to_owned(), OPTICAL_CONSTANTS.to_owned()),
            ],
            covariance: None,
            report: None,
        }],
        effects: Vec::new(),
        status: Status::Active,
        finish: None,
        unknown: vec![
            distance,
            "How rough the surface is, and what lies behind it: a smooth half space is meant."
                .to_owned(),
        ],
        roughness: None,
        layers: Vec::new(),
        permittivities: permittivities.collect(),
        sessions: Vec::new(),
        findings: Vec::new(),
        slug,
    }
}

fn optical_source(file: &str, page: &Page, given: &Details, licence: String) -> Source {
    let name = file_name(file);
    let references = plain(&page.references);
    let title = match (&given.source, references.is_empty()) {
        (Some(title), _) => title.clone(),
        (None, false) => references,
        (None, true) => format!("refractiveindex.info database, {name}, which names no reference"),
    };
    Source {
        doi: doi(&page.references),
        licence: Some(licence),
        note: Some(format!(
            "n and k of {name} of the refractiveindex.info database, against the wavelength in µm; \
             here the frequency is c/λ and the permittivity (n - jk)². {}",
            plain(&page.comments)
        )),
        making: Some(Making::Copied),
        ..source(OPTICAL_CONSTANTS, given.kind.unwrap_or(SourceKind::Literature), &title)
    }
}

fn source(key: &str, kind: SourceKind, title: &str) -> Source {
    Source {
        key: key.to_owned(),
        kind,
        title: title.to_owned(),
        doi: None,
        url: None,
        licence: None,
        note: None,
        citation: Citation::default(),
        making: None,
    }
}

/// The first DOI that a link names.
fn doi(html: &str) -> Option<String> {
    let (_, rest) = html.split_once("doi.org/")?;
    let doi: String =
        rest.chars().take_while(|c| !c.is_whitespace() && !"\"'<>".contains(*c)).collect();
    (doi.starts_with("10.") && doi.contains('/')).then_some(doi)
}

/// The text of a bit of HTML.
fn plain(html: &str) -> String {
    let mut text = String::new();
    let mut rest = html;
    while let Some((before, after)) = rest.split_once('<') {
        text += before;
        let is_tag = after.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/');
        match after.split_once('>').filter(|_| is_tag) {
            Some((tag, after)) => {
                text += if tag.starts_with("br") { " " } else { "" };
                rest = after;
            }
            None => {
                text.push('<');
                rest = after;
            }
        }
    }
    text += rest;
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
