//! Materials and files for the tests of the store.

use std::fs;
use std::path::Path;
use std::process::Command;

use matdb::formats::EffectEntry;
use matdb::material::{
    Censor, Citation, Covariance, CrossValidation, Curve, Estimate, Finding, FindingVerdict,
    FitReport, FixedNumber, Geometry, Goodness, Illumination, Instrument, Layer, Lobes, Making,
    Material, Observation, Permittivity, Roughness, Scale, Session, SessionPose, Status, file,
};
use matdb::radar::Footprint;
use matdb::store::Store;

/// A built-in material as the first schema's file holds it, whatever became of it since.
pub fn as_first_stored(slug: &str) -> Material {
    let path = super::root().join("tests/fixtures").join(slug).join("material.toml");
    let text = fs::read_to_string(path).unwrap();
    file::parse("material.toml", &text, |_| Err(String::new())).unwrap()
}

/// A small material with a row in every table.
pub fn sample(slug: &str) -> Material {
    let mut material = as_first_stored("mannequin-paint");
    material.slug = slug.parse().unwrap();
    let source = material.sources[0].key.clone();
    material.instruments = vec![Instrument {
        key: "bench".to_owned(),
        name: "Bench".to_owned(),
        centre_frequency_hz: 300e9,
        bandwidth_hz: Some(20e9),
        polarisation: Some("VV".to_owned()),
        ..Instrument::default()
    }];
    let observations = vec![
        observation(0.0, Some(2.5), Censor::None),
        observation(0.5, Some(0.1), Censor::None),
        observation(1.0, None, Censor::Left),
    ];
    let instrument = Some("bench".to_owned());
    let name = "scan".to_owned();
    let (session, illumination) = (None, Illumination::default());
    material.curves = vec![Curve { name, source, instrument, session, illumination, observations }];
    let path = material.fits[0].model.parameters()[0].path.clone();
    material.fits[0].covariance =
        Some(Covariance { parameters: vec![path], matrix: vec![vec![0.01]] });
    material
}

/// The sample with a fit that was made of its curve, and with all that a point can say.
pub fn fitted(slug: &str) -> Material {
    let mut material = sample(slug);
    for (chirp, observation) in (0u32..).zip(&mut material.curves[0].observations) {
        observation.theta_sd_rad = Some(0.01);
        observation.power_w = Some(1e-10);
        observation.range_m = Some(8.0);
        observation.chirp = Some(chirp);
    }
    material.fits[0].curve = Some("scan".to_owned());
    material.fits[0].report = Some(report());
    material.fits[0].estimator = report().method;
    material
}

/// The fitted sample with effects of its own.
pub fn with_effects(slug: &str) -> Material {
    let effect = |name: &str, parameters: &[(&str, f64)]| EffectEntry {
        name: name.to_owned(),
        source: None,
        parameters: parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
    };
    let film = effect("thin-film", &[("coverage", 0.3), ("thickness_m", 4.5e-4)]);
    Material { effects: vec![film, effect("subsurface", &[])], ..fitted(slug) }
}

/// The sample with effects and with everything else that a material can say.
pub fn complete(slug: &str) -> Material {
    let mut material = with_effects(slug);
    let source = material.sources[0].key.clone();
    material.sources[0].citation = Citation {
        authors: vec!["Doe, Jane".to_owned(), "Some Institute".to_owned()],
        year: Some(2026),
        container: Some("J. Samples".to_owned()),
        volume: Some("12".to_owned()),
        pages: Some("1-9".to_owned()),
        publisher: Some("A Press".to_owned()),
    };
    material.sources[0].making = Some(Making::Digitised);
    material.instruments[0] = Instrument {
        transmit_polarisation: Some("V".to_owned()),
        receive_polarisation: Some("H".to_owned()),
        geometry: Some(Geometry::Monostatic),
        stand_off_m: Some(8.0),
        spot_diameter_m: Some(0.016),
        aperture_m: Some(0.5),
        calibration_target: Some("trihedral of 30 mm".to_owned()),
        calibration_sd_factor: Some(1.25),
        scale: Some(Scale::Absolute),
        noise_floor_w: Some(1e-12),
        threshold_w: Some(2e-11),
        false_alarm_probability: Some(1e-4),
        range_bins: Some(512),
        looks: Some(1.5),
        looks_method: Some("counted".to_owned()),
        ..material.instruments[0].clone()
    };
    material.sessions = vec![Session {
        key: "spring".to_owned(),
        date: "2026-03-14".to_owned(),
        temperature_k: Some(295.15),
        relative_humidity: Some(0.4),
        cloud_hash: Some("0c".repeat(32)),
        mesh_hash: Some("0d".repeat(32)),
        registration_rms_m: Some(7e-4),
        normal_sd_rad: Some(0.01),
        footprint_sd_rad: Some(0.02),
        pose: Some(SessionPose {
            rotation_rows: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            translation_m: [0.1, -0.2, 8.0],
        }),
        note: Some("door closed".to_owned()),
    }];
    material.curves[0].session = Some("spring".to_owned());
    let permittivity = |frequency_hz: f64, temperature_k: Option<f64>| Permittivity {
        key: "acrylate".to_owned(),
        frequency_hz,
        temperature_k,
        real: 2.62,
        imaginary: 0.0987,
        real_sd: Some(0.02),
        imaginary_sd: None,
        source: source.clone(),
        frequency_source: None,
    };
    material.permittivities =
        vec![permittivity(300e9, Some(295.15)), permittivity(310e9, Some(295.15))];
    let layer = |name: &str, thickness_m: Option<f64>, key: Option<&str>| Layer {
        name: name.to_owned(),
        thickness_m,
        permittivity: key.map(str::to_owned),
        source: None,
    };
    material.layers =
        vec![layer("paint", Some(1e-4), Some("acrylate")), layer("glass fibre", None, None)];
    material.roughness = Some(Roughness {
        rms_height_m: 2e-5,
        correlation_length_m: Some(3e-4),
        method: Some("profilometer".to_owned()),
        source: source.clone(),
    });
    material.finish = Some("sprayed".to_owned());
    material.unknown = vec!["The thickness of the fibre.".to_owned()];
    material.status = Status::Superseded {
        by: "better-paint".parse().unwrap(),
        reason: "more angles".to_owned(),
    };
    let fit = material.fits[0].name.clone();
    let found = Finding {
        effect: "thin-film".to_owned(),
        verdict: FindingVerdict::Found,
        fit_before: Some(fit.clone()),
        fit_after: Some(fit),
        gain: Some(12.5),
        placebo_gain: Some(3.0),
        p: Some(0.001),
        score_difference: Some(9.0),
        score_difference_sd: Some(2.0),
        size_db: Some(1.5),
        rms_before_db: Some(6.1),
        rms_after_db: Some(5.7),
        confusable_with: vec!["fov-gain".to_owned()],
        source,
    };
    let absent = Finding {
        effect: "drift".to_owned(),
        verdict: FindingVerdict::NotFound,
        fit_before: None,
        fit_after: None,
        gain: Some(-0.5),
        placebo_gain: None,
        p: None,
        score_difference: None,
        score_difference_sd: None,
        size_db: None,
        rms_before_db: None,
        rms_after_db: None,
        confusable_with: Vec::new(),
        source: found.source.clone(),
    };
    material.findings = vec![found, absent];
    material
}

/// The same with a source for each number that may name its own.
pub fn attributed(slug: &str) -> Material {
    let mut material = complete(slug);
    let source = Some(material.sources[0].key.clone());
    material.layers[0].source.clone_from(&source);
    material.effects[0].source.clone_from(&source);
    material.permittivities[0].frequency_source = source;
    material
}

/// The same with the places of its points, and a fit that was tried on points held out.
pub fn placed(slug: &str) -> Material {
    let mut material = attributed(slug);
    for observation in &mut material.curves[0].observations {
        observation.target_m = Some([-0.125, 0.5]);
    }
    material.fits[0].report.as_mut().unwrap().held_out = Some(CrossValidation {
        folds: 5,
        blocks: 20,
        blocks_of: "squares".to_owned(),
        block_m: Some(0.05),
        score: Some(-1.5),
        score_sd: Some(0.01),
        rms_db: 5.75,
        fold_hash: "fedcba9876543210".repeat(4),
    });
    material
}

/// The same with the beam of its curve, and a fit of the surface's own lobes.
pub fn lit(slug: &str) -> Material {
    let mut material = placed(slug);
    material.curves[0].illumination = Illumination {
        footprint: Some(Footprint::Projected),
        beam_rad: Some(0.0117),
        ..Illumination::default()
    };
    material.fits[0].lobes = Lobes::Surface;
    material
}

/// The same with levels up to a common factor.
pub fn relative(slug: &str) -> Material {
    let mut material = lit(slug);
    material.curves[0].illumination.relative = true;
    material
}

/// The same with its model stated beside the curve, as nobody made that fit, so that everything in it holds.
pub fn sound(slug: &str) -> Material {
    let mut material = with_effects(slug);
    material.fits[0].report = None;
    material.fits[0].estimator = "stated".to_owned();
    material
}

/// A material with sixty more points and the fit that the program makes of them, so that anybody can verify it.
pub fn refitted(mut material: Material) -> Material {
    let points = (3..63).map(|chirp: u32| {
        let theta_rad = 0.02 * f64::from(chirp - 3);
        let mean = 4.0 * (-(theta_rad / 0.07).powi(2)).exp() + 0.02 * theta_rad.cos().powi(3);
        let scatter = 0.4 + 0.1 * f64::from((chirp * 7) % 13);
        Observation {
            theta_sd_rad: Some(0.01),
            power_w: Some(1e-10),
            range_m: Some(8.0),
            chirp: Some(chirp),
            ..observation(theta_rad, Some(mean * scatter), Censor::None)
        }
    });
    material.curves[0].observations.extend(points);
    let curve = matdb::measure::Curve::of_material(&material.curves[0]).unwrap();
    let fixed = vec![("diffuse.alpha".to_owned(), 3.0)];
    let fit = matdb::fit::Fit { fixed, looks: Some(1.0), starts: 1, ..matdb::fit::Fit::default() };
    let found = fit.run(&material.fits[0].model, &curve).unwrap();
    let stored = &material.fits[0];
    let sources = stored.parameter_sources.clone();
    material.fits[0] = found.stored(&stored.name, &material.curves[0].name, &stored.source);
    material.fits[0].parameter_sources = sources;
    material
}

fn report() -> FitReport {
    let estimate = |name: &str, sd: Option<f64>| Estimate {
        name: name.to_owned(),
        value: 0.25,
        sd,
        interval_95: sd.map(|sd| [0.25 - 2.0 * sd, 0.25 + 2.0 * sd]),
    };
    FitReport {
        method: "censored".to_owned(),
        given: vec![FixedNumber { name: "diffuse.alpha".to_owned(), value: 3.0 }],
        looks: Some(1.5),
        noise_w: 1e-12,
        gauge: Some("k = 0.1 was chosen".to_owned()),
        estimates: vec![estimate("S", Some(0.01)), estimate("R", None)],
        covariance: vec![vec![1e-4, 0.0], vec![0.0, 0.0]],
        singular_values: vec![1.2, 1e-7],
        objective: -123.456,
        goodness: Goodness {
            rms_db: 5.6,
            mean_db: -2.5,
            speckle_db: Some(5.57),
            z_mean: 0.01,
            z_variance: 1.1,
            ks_distance: 0.1,
            rows: 3,
        },
        held_out: None,
        converged: true,
        stop: "stationary".to_owned(),
        iterations: 12,
        starts: 4,
        agreeing_starts: 3,
        verdict: vec!["the data say nothing of R".to_owned()],
        data_hash: "0123456789abcdef".repeat(4),
        seed: u64::MAX,
        version: "0.1.0".to_owned(),
    }
}

/// A backscatter point with a detection limit.
pub fn observation(theta_rad: f64, sigma0: Option<f64>, censor: Censor) -> Observation {
    Observation { censor, ..Observation::backscatter(theta_rad, sigma0, Some(1e-3)) }
}

/// The sample after somebody has changed it.
pub fn changed(slug: &str) -> Material {
    change(sample(slug))
}

/// A material of this file after somebody has changed it.
pub fn change(mut material: Material) -> Material {
    material.curves[0].observations[1].sigma0 = Some(0.2);
    material
}

/// Every revision of every material in a database, in order; empty when there is none.
pub fn contents(path: &Path) -> Vec<Material> {
    let Some(store) = Store::open_existing(path).unwrap() else { return Vec::new() };
    let revisions = store.list().unwrap().into_iter().flat_map(|summary| {
        let store = &store;
        (1..=summary.revision).map(move |number| store.get(&summary.slug, Some(number)))
    });
    revisions.map(|stored| stored.unwrap().unwrap().material).collect()
}

/// A database's own check of its pages, indexes and references.
pub fn is_sound(path: &Path) -> bool {
    let conn = rusqlite::Connection::open(path).unwrap();
    let said: String = conn.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
    let mut dangling = conn.prepare("PRAGMA foreign_key_check").unwrap();
    said == "ok" && !dangling.exists([]).unwrap()
}

/// This test program again, to run one test on a file in a process of its own.
pub fn child(test: &str, path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--nocapture"]).env("MATDB_TEST_FILE", path);
    command
}

/// The file that a child process was given; `None` in the parent.
pub fn given() -> Option<std::path::PathBuf> {
    std::env::var_os("MATDB_TEST_FILE").map(Into::into)
}

/// Names and bytes of the files in a folder.
pub fn bytes(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| (entry.file_name(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}
