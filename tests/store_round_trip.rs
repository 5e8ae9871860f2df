//! What goes into the database comes out again, bit for bit and in the same order: every built-in
//! material, and materials that proptest makes up within what `Material::validate` allows.

use crate::support::database::{changed, sample};
use matdb::brdf::{
    BlinnPhong, Brdf, CookTorrance, Distribution, Lambert, Mixture, Shadowing, Tabulated,
};
use matdb::formats::EffectEntry;
use matdb::material::{
    Activity, Censor, Citation, Covariance, CrossValidation, Curve, Estimate, Finding,
    FindingVerdict, Fit, FitReport, FixedNumber, Geometry, Goodness, Illumination, Input,
    Instrument, Layer, Lobes, Making, Material, Observation, Origin, Permittivity, Roughness,
    Scale, Session, SessionPose, Slug, Source, SourceKind, Status, builtin,
};
use matdb::measure::statistics::by_angle;
use matdb::radar::Footprint;
use matdb::store::{Addition, Store};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::TestRunner;
use std::cell::RefCell;
use std::f64::consts::FRAC_PI_2;

fn text() -> impl Strategy<Value = String> {
    let any = any::<String>().prop_map(|text| text.replace('\0', ""));
    prop_oneof![any, Just("'\";--\n\u{10ffff}".to_owned())]
}

fn word() -> impl Strategy<Value = String> {
    text().prop_map(|text| format!("x{text}"))
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![f64::MIN_POSITIVE..1e-300, 1e-9f64..1e9, 1e299..1e300, Just(1.0)]
}

fn angle_rad() -> impl Strategy<Value = f64> {
    prop_oneof![0.0..FRAC_PI_2, Just(0.0), Just(-0.0), Just(FRAC_PI_2)]
}

fn fraction() -> impl Strategy<Value = f64> {
    prop_oneof![0.0f64..1.0, Just(0.0), Just(-0.0), Just(1.0), Just(f64::MIN_POSITIVE)]
}

prop_compose! {
    fn source()(
        kind in select(&[
            SourceKind::Measured, SourceKind::Literature, SourceKind::Modelled,
            SourceKind::Synthetic,
        ]),
        title in word(), doi in option::of(text()), url in option::of(text()),
        licence in option::of(text()), note in option::of(text()),
        authors in vec(word(), 0..3), year in option::of(1000u16..=9999),
        [container, volume, pages, publisher] in [(); 4].map(|()| option::of(text())),
        making in option::of(select(&[
            Making::OwnMeasurement, Making::Copied, Making::Digitised, Making::Computed,
        ])),
    ) -> Source {
        let citation = Citation { authors, year, container, volume, pages, publisher };
        Source { key: String::new(), kind, title, doi, url, licence, note, citation, making }
    }
}

prop_compose! {
    fn instrument()(
        name in text(), centre_frequency_hz in positive(), bandwidth_hz in option::of(positive()),
        [polarisation, note, transmit_polarisation, receive_polarisation, calibration_target,
         looks_method] in [(); 6].map(|()| option::of(text())),
        geometry in option::of(select(&[Geometry::Monostatic, Geometry::Bistatic])),
        scale in option::of(select(&[Scale::Absolute, Scale::Relative])),
        [stand_off_m, spot_diameter_m, aperture_m, noise_floor_w, threshold_w, looks]
            in [(); 6].map(|()| option::of(positive())),
        calibration_sd_factor in option::of(1.0f64..1e9),
        false_alarm_probability in option::of(f64::MIN_POSITIVE..0.999),
        range_bins in option::of(1u32..),
    ) -> Instrument {
        Instrument {
            key: String::new(), name, centre_frequency_hz, bandwidth_hz, polarisation, note,
            transmit_polarisation, receive_polarisation, geometry, stand_off_m, spot_diameter_m,
            aperture_m, calibration_target, calibration_sd_factor, scale, noise_floor_w,
            threshold_w, false_alarm_probability, range_bins, looks, looks_method,
        }
    }
}

prop_compose! {
    fn session()(
        (month, day) in (1u32..=12, 1u32..=28), temperature_k in option::of(positive()),
        [relative_humidity, registration_rms_m] in [(); 2].map(|()| option::of(fraction())),
        [cloud_hash, mesh_hash] in [(); 2].map(|()| option::of(Just("0a".repeat(32)))),
        [normal_sd_rad, footprint_sd_rad] in [(); 2].map(|()| option::of(angle_rad())),
        shift in option::of([number(), number(), number()]), note in option::of(text()),
    ) -> Session {
        let rotation_rows = [[0.6, -0.8, 0.0], [0.8, 0.6, -0.0], [0.0, 0.0, 1.0]];
        let pose = shift.map(|translation_m| SessionPose { rotation_rows, translation_m });
        Session {
            key: String::new(), date: format!("2026-{month:02}-{day:02}"), temperature_k,
            relative_humidity, cloud_hash, mesh_hash, registration_rms_m, normal_sd_rad,
            footprint_sd_rad, pose, note,
        }
    }
}

prop_compose! {
    fn permittivity()(
        temperature_k in option::of(positive()), real in prop_oneof![-1e12f64..1e12, number().prop_map(f64::sin)],
        imaginary in fraction(),
        [real_sd, imaginary_sd] in [(); 2].map(|()| option::of(fraction())),
    ) -> Permittivity {
        let (key, source) = (String::new(), String::new());
        Permittivity {
            key, frequency_hz: 1.0, temperature_k, real, imaginary, real_sd, imaginary_sd, source,
            frequency_source: None,
        }
    }
}

prop_compose! {
    fn finding()(
        effect in word(), confusable_with in vec(text(), 0..3), p in option::of(fraction()),
        verdict in select(&[
            FindingVerdict::Found, FindingVerdict::NotFound, FindingVerdict::Unexplained,
        ]),
        [gain, placebo_gain, score_difference] in [(); 3].map(|()| option::of(number())),
        [score_difference_sd, size_db, rms_before_db, rms_after_db]
            in [(); 4].map(|()| option::of(fraction())),
    ) -> Finding {
        Finding {
            effect, verdict, fit_before: None, fit_after: None, gain, placebo_gain, p,
            score_difference, score_difference_sd, size_db, rms_before_db, rms_after_db,
            confusable_with, source: String::new(),
        }
    }
}

/// What a material says beside its curves, fits and effects.
#[derive(Clone, Debug)]
struct Rest {
    status: Status,
    finish: Option<String>,
    unknown: Vec<String>,
    roughness: Option<Roughness>,
    layers: Vec<Layer>,
    permittivities: Vec<Permittivity>,
    sessions: Vec<Session>,
    findings: Vec<Finding>,
}

prop_compose! {
    fn rest()(
        reason in word(),
        status in select(&[0, 1, 2]), finish in option::of(word()), unknown in vec(word(), 0..3),
        rough in option::of((fraction(), option::of(positive()), option::of(text()))),
        thicknesses in vec((word(), positive()), 0..3), permittivities in vec(permittivity(), 0..3),
        sessions in vec(session(), 0..3), findings in vec(finding(), 0..3),
    ) -> Rest {
        let by = "other".parse().unwrap();
        let status = [
            Status::Active, Status::Withdrawn { reason: reason.clone() },
            Status::Superseded { by, reason },
        ][status].clone();
        let roughness = rough.map(|(rms_height_m, correlation_length_m, method)| Roughness {
            rms_height_m, correlation_length_m, method, source: String::new(),
        });
        let layer = |(name, thickness_m)| Layer {
            name, thickness_m: Some(thickness_m), permittivity: None, source: None,
        };
        let layers = thicknesses.into_iter().map(layer).collect();
        Rest { status, finish, unknown, roughness, layers, permittivities, sessions, findings }
    }
}

prop_compose! {
    fn observation()(
        theta_i_rad in angle_rad(), theta_r_rad in angle_rad(),
        delta_phi_rad in prop_oneof![-1e300f64..1e300, Just(-0.0)],
        level in positive(), threshold in option::of(positive()),
        censor in select(&[Censor::None, Censor::Left, Censor::Right]),
        theta_sd_rad in option::of(angle_rad()), power_w in option::of(positive()),
        range_m in option::of(prop_oneof![positive(), Just(0.0)]), chirp in option::of(any::<u32>()),
        target_m in option::of([-1e3f64..1e3, -1e3f64..1e3]),
    ) -> Observation {
        let measured = censor == Censor::None;
        Observation {
            theta_i_rad, theta_r_rad, delta_phi_rad, censor,
            sigma0: measured.then_some(level),
            threshold_sigma0: if measured { threshold } else { Some(level) },
            theta_sd_rad, power_w, range_m, chirp, target_m,
        }
    }
}

prop_compose! {
    fn tabulated()(
        start in angle_rad(), steps in vec(1e-6f64..0.1, 1..12), levels in vec(1e-9f64..1e9, 12),
    ) -> Brdf {
        let ascend = |angle: &mut f64, step: &f64| { *angle += step; Some(*angle) };
        let angles: Vec<f64> =
            std::iter::once(&0.0).chain(&steps).scan(start * 0.2, ascend).collect();
        let points: Vec<_> = std::iter::zip(angles, levels).collect();
        Brdf::Tabulated(Tabulated::new(&points).unwrap())
    }
}

fn model() -> impl Strategy<Value = Brdf> {
    let cook_torrance = |(f_lambda, m, m_across, ggx, correlated)| {
        let distribution = if ggx { Distribution::Ggx } else { Distribution::Beckmann };
        let shadowing = if correlated { Shadowing::Correlated } else { Shadowing::Separable };
        Brdf::CookTorrance(CookTorrance { f_lambda, m, m_across, distribution, shadowing })
    };
    let leaf = prop_oneof![
        fraction().prop_map(|albedo| Brdf::Lambert(Lambert { albedo })),
        (fraction(), fraction())
            .prop_map(|(r_s, alpha)| Brdf::BlinnPhong(BlinnPhong { r_s, alpha })),
        (fraction(), 0.001f64..2.0, option::of(0.001f64..2.0), any::<bool>(), any::<bool>())
            .prop_map(cook_torrance),
        tabulated(),
    ];
    leaf.prop_recursive(3, 8, 2, |inner| {
        (fraction(), inner.clone(), inner).prop_map(|(k, diffuse, specular)| {
            let (diffuse, specular) = (Box::new(diffuse), Box::new(specular));
            Brdf::Mixture(Mixture { k, diffuse, specular })
        })
    })
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-1e300f64..1e300, -1.0f64..1.0, Just(-0.0), Just(f64::MIN_POSITIVE)]
}

prop_compose! {
    fn held_out()(
        folds in any::<u32>(), blocks in any::<u32>(), block_m in option::of(positive()),
        score in option::of(number()), score_sd in option::of(positive()), rms_db in positive(),
    ) -> CrossValidation {
        let fold_hash = "fedcba9876543210".repeat(4);
        let blocks_of = "squares".to_owned();
        CrossValidation { folds, blocks, blocks_of, block_m, score, score_sd, rms_db, fold_hash }
    }
}

prop_compose! {
    fn report()(
        texts in (text(), text(), option::of(text()), text(), vec(text(), 0..3)),
        named in vec((text(), number(), option::of(positive())), 0..4),
        looks in option::of(positive()), noise_w in fraction(), objective in number(),
        singular_values in vec(number(), 0..4), speckle_db in option::of(number()),
        [rms_db, mean_db, z_mean, z_variance, ks_distance] in [(); 5].map(|()| number()),
        converged in any::<bool>(), counts in any::<[u32; 4]>(), seed in any::<u64>(),
        held_out in option::of(held_out()),
    ) -> FitReport {
        let (method, stop, gauge, version, verdict) = texts;
        let interval = |sd: f64| [-sd, sd];
        let estimates: Vec<Estimate> = named.iter().map(|(name, value, sd)| Estimate {
            name: name.clone(), value: *value, sd: *sd, interval_95: sd.map(interval),
        }).collect();
        let row = |_| named.iter().map(|(_, value, _)| *value).collect();
        let given = named.iter().map(|(name, value, _)| FixedNumber { name: name.clone(), value: *value });
        let [iterations, starts, agreeing_starts, rows] = counts;
        FitReport {
            method, given: given.collect(), looks, noise_w, gauge,
            covariance: estimates.iter().map(row).collect(),
            estimates, singular_values, objective,
            goodness: Goodness {
                rms_db, mean_db, speckle_db, z_mean, z_variance, ks_distance, rows,
            },
            held_out, converged, stop, iterations, starts, agreeing_starts, verdict,
            data_hash: "0123456789abcdef".repeat(4), seed, version,
        }
    }
}

prop_compose! {
    fn fit()(
        model in model(), estimator in text(), own_source in vec(any::<bool>(), 16),
        scale in option::of(vec(-1e3f64..1e3, 16)), report in option::of(report()),
        is_of_surface in any::<bool>(),
    ) -> Fit {
        let mut paths: Vec<String> = model.parameters().into_iter().map(|p| p.path).collect();
        let covariance = scale.filter(|_| !paths.is_empty()).map(|scale| covariance(&paths, &scale));
        paths.sort();
        let own = std::iter::zip(paths, own_source).filter(|(_, own)| *own);
        let parameter_sources = own.map(|(path, _)| (path, String::new())).collect();
        let (name, curve, source) = (String::new(), None, String::new());
        let lobes = if is_of_surface { Lobes::Surface } else { Lobes::RadarAndSurface };
        Fit { name, model, estimator, curve, source, lobes, parameter_sources, covariance, report }
    }
}

/// A sound matrix over some of the parameters, last first.
fn covariance(paths: &[String], scale: &[f64]) -> Covariance {
    let parameters: Vec<String> = paths[paths.len() / 2..].iter().rev().cloned().collect();
    let scale = &scale[..parameters.len()];
    let row = |a: &f64| scale.iter().map(|b| a * b).collect();
    Covariance { matrix: scale.iter().map(row).collect(), parameters }
}

fn curve() -> impl Strategy<Value = Curve> {
    let footprint = option::of(select(vec![Footprint::Paper, Footprint::Projected]));
    let illumination = (footprint, option::of(1e-4f64..0.5)).prop_map(|(footprint, beam_rad)| {
        Illumination { footprint, beam_rad, ..Illumination::default() }
    });
    (vec(observation(), 1..20), illumination).prop_map(|(observations, illumination)| {
        let (name, source) = (String::new(), String::new());
        Curve { name, source, instrument: None, session: None, illumination, observations }
    })
}

prop_compose! {
    fn effect()(numbers in btree_map(word(), number(), 0..4)) -> EffectEntry {
        EffectEntry { name: String::new(), source: None, parameters: numbers }
    }
}

prop_compose! {
    pub(crate) fn material()(
        texts in (word(), word(), text(), word(), vec(text(), 0..4)),
        frequency_hz in [positive(), positive()], theta_rad in [angle_rad(), angle_rad()],
        sources in vec(source(), 1..4), instruments in vec(instrument(), 0..3),
        curves in vec(curve(), 0..4), fits in vec(fit(), 1..4), effects in vec(effect(), 0..3),
        key in text(), pick in any::<usize>(), rest in rest(),
    ) -> Material {
        let Rest { status, finish, unknown, roughness, layers, .. } = rest;
        let Rest { permittivities, sessions, findings, .. } = rest;
        let (name, class, description, licence, tags) = texts;
        let slug = "made-up".parse().unwrap();
        let mut material = Material {
            slug, name, class, description, licence, tags,
            frequency_hz: ascending(frequency_hz), theta_rad: ascending(theta_rad),
            render: String::new(), sources, instruments, curves, fits, effects, status, finish,
            unknown, roughness, layers, permittivities, sessions, findings,
        };
        connect(&mut material, &key, pick);
        material
    }
}

fn ascending([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// Names everything and lets it refer to one another, to different things as `pick` differs.
fn connect(material: &mut Material, key: &str, mut pick: usize) {
    // Not in alphabetical order, so that an order by name would show.
    let name = |what: &str, index: usize| format!("{}{what}{key}", 9 - index);
    let mut choose = |what: &str, count: usize| {
        pick = pick.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        (count > 0).then(|| name(what, (pick >> 33) % count))
    };
    let counts = [material.sources.len(), material.instruments.len(), material.curves.len()];
    let (sessions, fits) = (material.sessions.len(), material.fits.len());
    for (index, source) in material.sources.iter_mut().enumerate() {
        source.key = name("source", index);
    }
    for (index, instrument) in material.instruments.iter_mut().enumerate() {
        instrument.key = name("instrument", index);
    }
    for (index, curve) in material.curves.iter_mut().enumerate() {
        curve.name = name("curve", index);
        curve.source = choose("source", counts[0]).unwrap();
        curve.instrument = choose("instrument", counts[1]);
        curve.session = choose("session", sessions);
    }
    for (index, session) in material.sessions.iter_mut().enumerate() {
        session.key = name("session", index);
    }
    for (index, entry) in material.permittivities.iter_mut().enumerate() {
        // The first two are of one substance.
        entry.key = name("permittivity", index.max(1));
        entry.frequency_hz = 1e9 * (index + 1) as f64;
        entry.source = choose("source", counts[0]).unwrap();
        entry.frequency_source = choose("source", index.min(1) * counts[0]);
    }
    for layer in &mut material.layers {
        layer.source = choose("source", counts[0]);
        layer.permittivity = material.permittivities.first().map(|entry| entry.key.clone());
    }
    if let Some(last) = material.layers.last_mut() {
        last.thickness_m = None;
    }
    if let Some(roughness) = &mut material.roughness {
        roughness.source = choose("source", counts[0]).unwrap();
    }
    for finding in &mut material.findings {
        finding.fit_after = choose("fit", fits);
        finding.source = choose("source", counts[0]).unwrap();
    }
    for (index, fit) in material.fits.iter_mut().enumerate() {
        fit.name = name("fit", index);
        fit.source = choose("source", counts[0]).unwrap();
        fit.curve = choose("curve", counts[2]);
        for (_, source) in &mut fit.parameter_sources {
            *source = choose("source", counts[0]).unwrap();
        }
    }
    for (index, effect) in material.effects.iter_mut().enumerate() {
        effect.name = name("effect", index);
        effect.source = choose("source", index.min(1) * counts[0]);
    }
    material.render = choose("fit", material.fits.len()).unwrap();
}

fn same(store: &Store, material: &Material) {
    let stored = store.get(&material.slug, None).unwrap().unwrap();
    assert_eq!(stored.material, *material);
    assert_eq!(stored.content_hash, material.content_hash());
    assert_eq!(stored.material.content_hash(), stored.content_hash);
}

#[test]
fn every_built_in_material_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("materials.sqlite");
    let materials: Vec<_> = builtin::names().map(|n| builtin::get(n).unwrap().unwrap()).collect();
    let mut store = Store::open(&path).unwrap();
    for material in &materials {
        assert_eq!(store.add([material]).unwrap(), [Addition::New]);
        same(&store, material);
    }
    drop(store);
    for store in [Store::open_existing(&path).unwrap().unwrap(), Store::open(&path).unwrap()] {
        materials.iter().for_each(|material| same(&store, material));
        for (summary, material) in std::iter::zip(store.list().unwrap(), &materials) {
            let points: usize = material.curves.iter().map(|c| c.observations.len()).sum();
            assert_eq!((&summary.slug, &summary.name), (&material.slug, &material.name));
            assert_eq!(Some(summary.render_kind), material.render_kind());
            assert_eq!((summary.revision, summary.observations as usize), (1, points));
            assert_eq!(summary.fits as usize, material.fits.len());
        }
    }
}

#[test]
fn every_material_that_is_valid_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let store = RefCell::new(Store::open(folder.path().join("materials.sqlite")).unwrap());
    let check = |material: Material| {
        material.validate().unwrap();
        let mut store = store.borrow_mut();
        store.remove([&material.slug]).unwrap();
        assert_eq!(store.add([&material]).unwrap(), [Addition::New]);
        same(&store, &material);
        assert_eq!(store.add([&material]).unwrap(), [Addition::Unchanged(1)]);
        Ok(())
    };
    TestRunner::default().run(&material(), check).unwrap();
}

#[test]
fn revisions_are_kept_and_removed_together() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("materials.sqlite")).unwrap();
    let first = builtin::get("cotton").unwrap().unwrap();
    let mut second = first.clone();
    second.curves[0].observations[3].sigma0 = Some(0.25);
    assert_eq!(store.add([&first]).unwrap(), [Addition::New]);
    assert_eq!(store.add([&second]).unwrap(), [Addition::Revision(2)]);
    assert_eq!(store.add([&second]).unwrap(), [Addition::Unchanged(2)]);
    assert_eq!(store.add([&first]).unwrap(), [Addition::Revision(3)]);
    for (revision, material) in [(1, &first), (2, &second), (3, &first)] {
        let stored = store.get(&first.slug, Some(revision)).unwrap().unwrap();
        assert_eq!((stored.revision, &stored.material), (revision, material));
        assert_eq!(stored.program_version, env!("CARGO_PKG_VERSION"));
    }
    assert_eq!(store.get(&first.slug, None).unwrap().unwrap().revision, 3);
    assert!(store.get(&first.slug, Some(4)).unwrap().is_none());
    assert_eq!(store.remove([&first.slug]).unwrap()[0].unwrap().revisions, 3);
    assert!(store.remove([&first.slug]).unwrap()[0].is_none());
    assert!(store.list().unwrap().is_empty());
    assert_eq!(store.add([&second]).unwrap(), [Addition::New]);
}

#[test]
fn an_unsound_material_is_refused_before_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("materials.sqlite")).unwrap();
    let mut material = builtin::get("cotton").unwrap().unwrap();
    material.curves[0].observations[0].theta_i_rad = f64::NAN;
    let message = store.add([&material]).unwrap_err().to_string();
    assert!(message.starts_with("material `cotton`: curve `backscatter`, observation 1"));
    assert!(store.list().unwrap().is_empty());
    assert!(store.get(&"cotton".parse::<Slug>().unwrap(), None).unwrap().is_none());
}

#[test]
fn a_revision_knows_which_command_made_it_of_what() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("materials.sqlite");
    let mut store = Store::open(&path).unwrap();
    let first = builtin::get("cotton").unwrap().unwrap();
    store.add([&first]).unwrap();
    let input = |name: &str| Input { name: name.to_owned(), hash: "0e".repeat(32) };
    let origin = Origin {
        authors: vec!["Roe, Ann".to_owned(), "Doe, Jane".to_owned()],
        title: Some("Cloths of another laboratory".to_owned()),
        doi: Some("10.1234/cloths".to_owned()),
        revision: 7,
        added_at: "2025-01-31T12:00:00Z".to_owned(),
        program_version: "0.0.1".to_owned(),
        ..Origin::default()
    };
    let inputs = vec![input("b.csv"), input("a.csv")];
    let activity = Activity { command: "import".to_owned(), inputs, origin: Some(origin) };
    store.record(activity.clone());
    let second = Material { finish: Some("washed".to_owned()), ..first.clone() };
    assert_eq!(store.add([&second]).unwrap(), [Addition::Revision(2)]);
    // It says nothing of the material, so it makes no revision.
    store.record(Activity::default());
    assert_eq!(store.add([&second]).unwrap(), [Addition::Unchanged(2)]);
    let of = |number| store.get(&first.slug, Some(number)).unwrap().unwrap().activity;
    assert_eq!((of(1), of(2)), (None, Some(activity)));
}

#[test]
fn statistics_of_a_curve_are_stored_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("materials.sqlite")).unwrap();
    let mut cotton = builtin::get("cotton").unwrap().unwrap();
    let once = cotton.curves[0].observations.clone();
    // Nine times each angle: points enough for intervals.
    cotton.curves[0].observations = (0..9).flat_map(|_| once.clone()).collect();
    store.add([&cotton]).unwrap();
    let stored = store.statistics(&cotton.slug, None, "backscatter").unwrap();
    assert_eq!(stored, by_angle(&cotton.curves[0].observations));
    assert_eq!(stored.len(), once.len());
    assert!(stored.iter().all(|row| row.points == 9 && row.interval_95.is_some()));
    assert!(store.statistics(&cotton.slug, Some(2), "backscatter").unwrap().is_empty());
    assert!(store.statistics(&cotton.slug, None, "other").unwrap().is_empty());
}

#[test]
fn no_revision_is_older_than_the_one_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let mut store = Store::open(&path).unwrap();
    store.add([&sample("paint")]).unwrap();
    // Written by a machine whose clock was ahead.
    let ahead = "9998-12-31T23:59:59Z";
    let conn = rusqlite::Connection::open(&path).unwrap();
    conn.execute("UPDATE revision SET added_at = ?", [ahead]).unwrap();
    store.add([&changed("paint")]).unwrap();
    let later = "SELECT added_at FROM revision WHERE number = 2";
    assert_eq!(conn.query_row(later, [], |row| row.get::<_, String>(0)).unwrap(), ahead);
}
