//! Materials and their laws.

use std::path::Path;

use matdb::adopt::admission;
use matdb::brdf::{Brdf, Scattering};
use matdb::catalogue::exchange::{Details, Foreign, Format, Subject, export};
use matdb::catalogue::{Diff, references};
use matdb::frames::Direction;
use matdb::material::file::parse;
use matdb::material::{Material, builtin};
use matdb::store::{Addition, Store};

use super::curves::{exported_and_read, same_points, stated};

const CURVE: &str = include_str!("../../materials/cotton/backscatter.csv");

thread_local! {
    static EMPTY: std::cell::RefCell<Store> =
        std::cell::RefCell::new(Store::in_memory().expect("a database in memory"));
}

/// A material file that is accepted can be used: see [`is_usable`].
pub fn material(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(material) = parse("material.toml", text, |_| Ok(CURVE.as_bytes().to_vec())) {
        is_usable(&material);
    }
}

/// A law as the database keeps it, as JSON: what is in range has finite values and survives the database.
pub fn law(bytes: &[u8]) {
    let Ok(law) = serde_json::from_slice::<Brdf>(bytes) else { return };
    let text = serde_json::to_vec(&law).expect("a law can be written");
    let again: Result<Brdf, _> = serde_json::from_slice(&text);
    if law.check_size().is_err() || law.validate().is_err() {
        return;
    }
    assert_eq!(again.expect("a law that was written can be read"), law);
    let up_to_grazing =
        (0..9).map(|tens| Direction::from_angles(f64::from(10 * tens).to_radians(), 0.3));
    let outwards = Direction::from_angles(0.7, 2.0);
    for inwards in up_to_grazing {
        for towards in [inwards, outwards] {
            let f_per_sr = law.f_per_sr(inwards, towards);
            assert!(f_per_sr.is_finite() && f_per_sr >= 0.0, "{f_per_sr} 1/sr of {law:?}");
            let seen = law.seen_by(0.0117, inwards, towards);
            assert!(seen.f_per_sr.is_finite() && seen.f_per_sr >= 0.0, "{seen:?} of {law:?}");
        }
    }
    let mut material = builtin::get("mannequin-paint").expect("a built-in").expect("a material");
    let rendered = material.render.clone();
    for fit in material.fits.iter_mut().filter(|fit| fit.name == rendered) {
        (fit.model, fit.covariance, fit.report) = (law.clone(), None, None);
        fit.parameter_sources.clear();
    }
    if material.validate().is_ok() {
        is_kept(&material);
    }
}

/// A universal BRDF file: what is accepted can be exported again, with the same points.
pub fn universal_brdf(bytes: &[u8]) {
    let Details { slug, class, .. } = stated();
    let little = Details { slug, class, ..Details::default() };
    for given in [little, stated()] {
        let read = Foreign::UniversalBrdf.read("curve.brdf", bytes, &given);
        let Ok((material, _)) = read else { continue };
        let (format, foreign) = (Format::UniversalBrdf, Foreign::UniversalBrdf);
        same_points(&material, &exported_and_read(&material, format, foreign, &given));
        is_usable(&material);
    }
}

/// A page of optical constants, which is YAML: a smooth half space that can be used.
pub fn optical_constants(bytes: &[u8]) {
    if let Ok((material, _)) = Foreign::OpticalConstants.read("page.yml", bytes, &stated()) {
        for entry in &material.permittivities {
            assert!(entry.real.is_finite() && entry.imaginary.is_finite(), "{entry:?}");
        }
        is_usable(&material);
    }
}

/// It can be rendered, stored and exported, and differs in nothing from itself.
pub fn is_usable(material: &Material) {
    let law = material.scattering().expect("what was accepted can be rendered");
    for theta_rad in material.theta_rad.into_iter().filter(|theta_rad| *theta_rad < 1.55) {
        let sigma0 = law.sigma0(theta_rad);
        assert!(sigma0.is_finite() && sigma0 >= 0.0, "{sigma0} at {theta_rad} rad");
    }
    let _ = admission::doubts(material);
    let _ = admission::check(material, Path::new("material.toml"));
    assert!(!references(material).is_empty());
    assert!(Diff::new(material, material).is_empty());
    let subject = Subject { material, revision: None, added_at: None, origin: None, curve: None };
    let mut formats = vec![Format::Csv, Format::UniversalBrdf, Format::OpenMaterial];
    // These two search for the nearest of their own laws, which takes a hundred times as long.
    if material.content_hash().starts_with('0') {
        formats.extend([Format::Mitsuba, Format::Sionna]);
    }
    for format in formats {
        if let Ok(exported) = export(&subject, format, "material") {
            assert!(!exported.files.is_empty(), "{format:?}");
        }
    }
    is_kept(material);
}

/// A database gives it back as it is.
fn is_kept(material: &Material) {
    EMPTY.with_borrow_mut(|store| {
        assert_eq!(
            store.add([material]).expect("what was accepted can be stored"),
            [Addition::New]
        );
        let stored = store.get(&material.slug, None).expect("what was stored can be read");
        assert_eq!(&stored.expect("what was stored is there").material, material);
        assert_eq!(store.damage().expect("a database that can be read"), [""; 0]);
        store.remove([&material.slug]).expect("what is there can be removed");
    });
}
