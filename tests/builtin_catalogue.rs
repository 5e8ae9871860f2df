//! Promise: every built-in material says where each of its numbers comes from and what is not known,
//! claims no measured backscatter, renders within its range, and agrees with its sources.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use matdb::brdf::{Brdf, Fresnel, Parameter, Scattering, VIEWING_RAD};

use crate::support::{matdb, root};
use matdb::catalogue::references;
use matdb::frames::Direction;
use matdb::material::{Fit, Material, Permittivity, Source, SourceKind, builtin};

/// What is rendered is asked for at the radar's frequency.
const RADAR_HZ: f64 = 300e9;
/// f_lambda stands in the files with three digits.
const THREE_DIGITS: f64 = 5e-3;
/// Permittivities have at least four, as in the table that they are held against.
const FOUR_DIGITS: f64 = 5e-4;
/// Bounds what cloth loses; no number of an entry is taken from it.
const BOUND_ONLY: &str = "bjarnason-2004";

fn all() -> Vec<Material> {
    builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect()
}

fn source<'a>(material: &'a Material, key: &str) -> &'a Source {
    material.sources.iter().find(|s| s.key == key).unwrap_or_else(|| panic!("{key}"))
}

/// Key of the source of a parameter.
fn source_of<'a>(fit: &'a Fit, path: &str) -> &'a str {
    let own = fit.parameter_sources.iter().find(|(p, _)| p == path);
    own.map_or(&fit.source, |(_, source)| source)
}

/// Reflectance at normal incidence, 0 to 1.
fn reflectance(entry: &Permittivity) -> f64 {
    let Permittivity { real: eps_real, imaginary: eps_imag, .. } = *entry;
    Fresnel { eps_real, eps_imag, lobe_rad: None }.reflectance(0.0)
}

/// Keys of the sources that some number refers to.
fn used(material: &Material) -> Vec<&String> {
    let fits = material.fits.iter();
    let parameters = fits.clone().flat_map(|f| f.parameter_sources.iter().map(|(_, key)| key));
    let entries = material.permittivities.iter();
    let frequencies = entries.clone().filter_map(|entry| entry.frequency_source.as_ref());
    let permittivities = entries.map(|entry| &entry.source).chain(frequencies);
    let curves = material.curves.iter().map(|curve| &curve.source);
    let roughness = material.roughness.iter().map(|roughness| &roughness.source);
    fits.map(|f| &f.source)
        .chain(parameters)
        .chain(permittivities)
        .chain(curves)
        .chain(roughness)
        .collect()
}

fn near(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * expected.abs()
}

#[test]
fn there_are_at_least_26() {
    assert!(builtin::names().count() >= 26);
}

#[test]
fn each_is_sound_and_renders_a_finite_level_all_over_its_range() {
    for material in all() {
        material.validate().unwrap();
        let scattering = material.scattering().unwrap();
        let [least_rad, most_rad] = material.theta_rad;
        for step in 0..=100 {
            let theta_rad = least_rad + (most_rad - least_rad) * f64::from(step) / 100.0;
            let sigma0 = scattering.sigma0(theta_rad);
            assert!(sigma0 > 0.0 && sigma0.is_finite(), "{} {theta_rad}: {sigma0}", material.slug);
        }
    }
}

/// A facing flat piece returns the reflectance of a smooth surface, and no entry more than it receives. Printed as a
/// table with `--nocapture`.
#[test]
fn a_facing_flat_piece_returns_at_most_what_it_receives() {
    let up = Direction::from_angles(0.0, 0.0);
    // P_r = P·f·4π·δ².
    let share = 4.0 * PI * VIEWING_RAD * VIEWING_RAD;
    let mut smooth = 0;
    for material in all() {
        let law = material.scattering().unwrap();
        let returned = share * law.seen_by(VIEWING_RAD, up, up).f_per_sr;
        println!("| `{}` | {:.1} dB |", material.slug, 10.0 * returned.log10());
        assert!(returned < 1.0, "{} {returned}", material.slug);
        let reflectance = match &law {
            Brdf::Fresnel(mirror) => mirror.reflectance(0.0),
            Brdf::Layered(film) => film.reflectance(0.0),
            _ => continue,
        };
        assert!(near(returned, reflectance, 1e-9), "{} {returned}", material.slug);
        smooth += 1;
    }
    assert!(smooth >= 20, "{smooth}");
}

#[test]
fn none_claims_measured_backscatter_and_each_says_what_is_not_known() {
    for material in all() {
        let slug = &material.slug;
        assert!(material.instruments.is_empty() && material.sessions.is_empty(), "{slug}");
        assert!(material.unknown[0].starts_with("The backscatter itself"), "{slug}");
        for curve in &material.curves {
            assert_eq!(source(&material, &curve.source).kind, SourceKind::Synthetic, "{slug}");
        }
        let chosen = |p: &&Parameter| {
            let name = p.path.rsplit('.').next().unwrap_or_default();
            ["k", "m", "r_s", "alpha", "lobe_rad", "albedo"].contains(&name)
        };
        for fit in &material.fits {
            assert_ne!(source(&material, &fit.source).kind, SourceKind::Measured, "{slug}");
            for parameter in fit.model.parameters().iter().filter(chosen) {
                let kind = source(&material, source_of(fit, &parameter.path)).kind;
                assert_eq!(kind, SourceKind::Synthetic, "{slug} {}", parameter.path);
            }
        }
    }
}

#[test]
fn one_permittivity_was_measured_at_300_ghz_with_deviations() {
    let is_measured = |material: &&Material| {
        material.sources.iter().any(|source| source.kind == SourceKind::Measured)
    };
    let all = all();
    let measured: Vec<&Material> = all.iter().filter(is_measured).collect();
    let [pvdf] = measured[..] else { panic!("{} materials", measured.len()) };
    assert_eq!(pvdf.slug.as_str(), "pvdf");
    for entry in pvdf.permittivities.iter().filter(|entry| entry.key == "pvdf") {
        assert_eq!(source(pvdf, &entry.source).kind, SourceKind::Measured);
        // What a sheet of a polymer can have, and what the traces can tell.
        assert!((2.3..2.7).contains(&entry.real) && (0.0..0.2).contains(&entry.imaginary));
        assert!((0.05..0.15).contains(&entry.real_sd.unwrap()));
        assert!((0.0..0.06).contains(&entry.imaginary_sd.unwrap()));
    }
    assert!(pvdf.permittivities.iter().any(|entry| entry.frequency_hz == 300e9));
}

#[test]
fn each_number_has_a_source_that_can_be_found_and_that_show_prints() {
    let folder = tempfile::tempdir().unwrap();
    for material in all() {
        let output = matdb(folder.path()).args(["show", material.slug.as_str()]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        for s in &material.sources {
            assert!(text.contains(&format!(
                "source {} ({}): {}",
                s.key,
                s.kind.as_str(),
                s.titled()
            )));
            let found = s.doi.is_some() || s.url.is_some() || s.citation.publisher.is_some();
            assert!(found || s.kind != SourceKind::Literature, "{} {}", material.slug, s.key);
            assert!(
                s.kind != SourceKind::Literature || s.citation.year.is_some() || s.url.is_some()
            );
        }
        let says = |start: &str, key: &str| {
            let mut lines = text.lines().filter(|line| line.starts_with(start));
            assert!(lines.any(|line| line.ends_with(key)), "{}: {start} {key}", material.slug);
        };
        for entry in &material.permittivities {
            source(&material, &entry.source);
            says(&entry.key, &entry.source);
        }
        if let Some(roughness) = &material.roughness {
            assert_eq!(source(&material, &roughness.source).kind, SourceKind::Literature);
            says("roughness: ", &roughness.source);
        }
        for fit in &material.fits {
            for Parameter { path, .. } in fit.model.parameters() {
                source(&material, source_of(fit, &path));
                says(&path, source_of(fit, &path));
            }
        }
        for key in material.sources.iter().map(|s| &s.key).filter(|key| *key != BOUND_ONLY) {
            assert!(used(&material).contains(&key), "{} {key}", material.slug);
        }
    }
}

/// The number before a unit in a sentence.
fn number_before(text: &str, unit: &str) -> f64 {
    let before = text.split(unit).next().unwrap().trim_end();
    before.rsplit(' ').next().unwrap().parse().unwrap()
}

#[test]
fn a_stated_depth_is_that_of_the_permittivity_at_its_frequency() {
    let mut judged = 0;
    for material in all() {
        for sentence in material.unknown.iter().filter(|s| s.contains("falls to 1/e in")) {
            let said = sentence.split("falls to 1/e in").nth(1).unwrap();
            let depth_mm = number_before(said, " mm at");
            let frequency_hz = 1e9 * number_before(said, " GHz");
            let entry = &material.permittivities[0];
            assert!(near(frequency_hz, entry.frequency_hz, 1e-9), "{}", material.slug);
            let (real, imaginary) = (entry.real, entry.imaginary);
            // Of n + iκ = √(ε′ + iε″) the power falls with 2·κ·ω/c.
            let kappa = (0.5 * (real.hypot(imaginary) - real)).sqrt();
            let expected_mm = 1e3 * 299_792_458.0 / (4.0 * PI * frequency_hz * kappa);
            // Two digits are stated.
            assert!(near(depth_mm, expected_mm, 0.05), "{}: {expected_mm}", material.slug);
            judged += 1;
        }
    }
    assert!(judged >= 20);
}

#[test]
fn cite_names_no_source_that_does_not_state_the_number() {
    for material in all() {
        for reference in references(&material) {
            let note =
                reference.source.as_ref().and_then(|s| s.note.as_deref()).unwrap_or_default();
            let is_frequency = |place: &String| place.ends_with(", frequency_hz");
            let states_none = note.contains("frequency not stated");
            assert!(
                !(states_none && reference.numbers.iter().any(is_frequency)),
                "{}: {note}",
                material.slug
            );
            let key = reference.source.as_ref().map(|s| s.key.as_str());
            let layers = reference.numbers.iter().filter(|place| place.starts_with("layer "));
            for place in layers {
                let mut layers = material.layers.iter();
                let layer = layers.find(|layer| place.contains(&layer.name)).unwrap();
                assert_eq!(layer.source.as_deref(), key, "{}: {place}", material.slug);
            }
        }
    }
    for slug in ["alumina", "macor"] {
        let material = builtin::get(slug).unwrap().unwrap();
        let chosen = references(&material)
            .into_iter()
            .find(|r| r.source.as_ref().is_some_and(|s| s.kind == SourceKind::Synthetic));
        let frequency = format!("permittivity {slug} at 300 GHz, frequency_hz");
        assert!(chosen.unwrap().numbers.contains(&frequency));
    }
}

#[test]
fn what_is_rendered_reflects_as_the_stated_permittivity_does() {
    let mut judged = 0;
    for material in all() {
        let entries = &material.permittivities;
        for fit in &material.fits {
            let parameters = fit.model.parameters();
            let value = |name: &str| {
                let ends = |p: &&Parameter| p.path.rsplit('.').next() == Some(name);
                parameters.iter().find(ends).map(|p| p.value)
            };
            // The nearest to the radar's frequency, and of those the first, is what scenes render.
            let distance = |e: &&Permittivity| (e.frequency_hz - RADAR_HZ).abs();
            let nearest = entries.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let rendered = nearest.filter(|_| fit.name == material.render);
            let beyond_hz = rendered.map_or(0.0, |e| material.frequency_outside_hz(e.frequency_hz));
            assert!(beyond_hz < 1e9, "{} renders what it does not claim", material.slug);
            let allowed: Vec<&Permittivity> =
                rendered.map_or(entries.iter().collect(), |entry| vec![entry]);
            if let Some(f_lambda) = value("f_lambda") {
                let agrees = |e: &&Permittivity| near(f_lambda, reflectance(e), THREE_DIGITS);
                assert!(
                    allowed.iter().copied().any(|e| agrees(&e)),
                    "{} {f_lambda}",
                    material.slug
                );
                judged += 1;
            }
            if let (Some(real), Some(imaginary)) = (value("eps_real"), value("eps_imag")) {
                let agrees = |e: &&Permittivity| e.real == real && e.imaginary == imaginary;
                assert!(allowed.iter().copied().any(|e| agrees(&e)), "{} {real}", material.slug);
                judged += 1;
            }
        }
    }
    assert!(judged >= 26, "{judged}");
}

#[test]
fn what_lies_outside_of_a_source_is_not_claimed() {
    let mut outside = 0;
    for material in all() {
        let beyond_hz = material.frequency_outside_hz(RADAR_HZ);
        let stated = material.permittivities.iter();
        assert!(
            stated.clone().count() == 0
                || stated.clone().any(|e| material.frequency_outside_hz(e.frequency_hz) < 1e9),
            "{}: no permittivity within its range",
            material.slug
        );
        if beyond_hz > 0.0 {
            outside += 1;
            let says =
                |u: &String| u.starts_with("The permittivity at 300") || u.starts_with("Below");
            assert!(material.unknown.iter().any(says), "{}", material.slug);
        }
    }
    assert!(outside >= 8, "{outside}");
}

/// Against the table of optical constants, where somebody has put it beside this crate.
#[test]
fn permittivities_are_those_of_the_optical_constants_that_they_were_taken_from() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data/thz-optical-constants/summary_300GHz.csv");
    let Ok(bytes) = std::fs::read(path) else {
        println!("skipped: there is no shared/data/thz-optical-constants/summary_300GHz.csv");
        return;
    };
    let mut rows = BTreeMap::new();
    let text = String::from_utf8(bytes).unwrap();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |cell: usize| cells[cell].parse::<f64>().unwrap();
        rows.insert(cells[0], [number(3), number(4)]);
    }
    for (slug, key, row) in [
        ("water-25c", "water-25c", "water-liquid-25C-segelstein"),
        ("water-19c", "water-19c", "water-liquid-19C-afsar"),
        ("ice", "ice", "ice-minus7C-warren"),
        ("borosilicate-glass", "borosilicate-glass", "borosilicate-crown-glass-k108"),
        ("kapton", "kapton", "kapton-hn"),
        ("acrylate-resist", "acrylate-resist", "acrylate-resist-ip-s-cured"),
        ("mannequin-paint", "acrylate", "acrylate-resist-ip-s-cured"),
        ("aluminium", "aluminium", "aluminium-hagemann"),
        ("painted-metal", "aluminium", "aluminium-hagemann"),
        ("alumina-film", "alumina-film", "alumina-ald-film"),
        ("calcium-fluoride", "calcium-fluoride", "calcium-fluoride-300K"),
        ("barium-fluoride", "barium-fluoride", "barium-fluoride-300K"),
    ] {
        let material = builtin::get(slug).unwrap().unwrap();
        let entry = material.permittivities.iter().find(|e| e.key == key).unwrap();
        for (found, expected) in [(entry.real, rows[row][0]), (entry.imaginary, rows[row][1])] {
            assert!(near(found, expected, FOUR_DIGITS), "{slug}: {found} {expected}");
        }
    }
}

#[test]
fn the_film_is_rendered_as_thick_as_its_layer_is() {
    let kapton = builtin::get("kapton").unwrap().unwrap();
    let Brdf::Layered(model) = kapton.scattering().unwrap() else { panic!("no layers") };
    let [film, air] = &kapton.layers[..] else { panic!("{:?}", kapton.layers) };
    assert!(near(model.layers[0].thickness_m, film.thickness_m.unwrap(), 1e-12));
    assert_eq!((air.thickness_m, model.eps_real), (None, 1.0));
    let entry = &kapton.permittivities[0];
    let layer = model.layers[0];
    assert_eq!((layer.eps_real, layer.eps_imag), (entry.real, entry.imaginary));
}

/// The docs' table says for each how it is kept: kind, what is rendered, the claimed range.
#[test]
fn the_table_of_the_docs_is_the_catalogue() {
    let docs = std::fs::read_to_string(root().join("docs/built-in-materials.md")).unwrap();
    let rows: Vec<&str> = docs.lines().filter(|line| line.starts_with("| `")).collect();
    let made: Vec<String> = all().iter().map(row).collect();
    let first = rows.iter().position(|row| row.starts_with("| `acrylate-resist`")).unwrap_or(0);
    let kept = &rows[first..(first + made.len()).min(rows.len())];
    assert!(kept == made, "the table should be\n{}", made.join("\n"));
}

fn row(material: &Material) -> String {
    let model = serde_json::to_value(material.scattering().unwrap()).unwrap();
    let model = model["model"].as_str().unwrap().to_owned();
    let kind = material.render_kind().unwrap().as_str();
    let ghz = matdb::units::range(material.frequency_hz.map(|f| f / 1e9));
    let known = material.sources.iter().filter_map(|s| match s.kind {
        SourceKind::Literature => Some(s.key.clone()),
        SourceKind::Measured => Some(format!("{} (measured)", s.key)),
        _ => None,
    });
    let keys: Vec<String> = known.collect();
    let keys = if keys.is_empty() { "nothing".to_owned() } else { keys.join(", ") };
    format!("| `{}` | {model} | {kind} | {ghz} | {keys} |", material.slug)
}
