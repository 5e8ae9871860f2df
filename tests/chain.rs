//! Promise: whatever `add` accepts can be shown, withdrawn and removed. It is drawn, exported with finite numbers and rendered, or
//! refused in one sentence. Where `check` finds it sound it is published, verified and imported with the same hash. Each
//! takes less than a minute.
//!
//! The materials are those that proptest makes up for `store_round_trip.rs`. `MATDB_TEST_MANY_CHAINS=1` draws three hundred.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::store_round_trip::material;
use crate::support::matdb;
use matdb::material::{Material, Status};
use matdb::store::{Addition, Store};
use proptest::prelude::any;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Formats of `export`.
const FORMATS: [&str; 6] =
    ["csv", "parquet", "universal-brdf", "open-material", "mitsuba", "sionna"];
/// Time that a command may take, s, on a machine that does other things beside it.
const MOST_S: u64 = 60;

const SCENE: &str = "name = \"plate\"\nseed = 1\n[radar.scan]\npattern = \"raster\"\nlines = 4\n\
    chirps_per_line = 4\n[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\nsize_m = [1, 1, 0]\n\
    translation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\nmaterial = \"made-up\"\n";

/// Runs a command that must succeed, or refuse in one sentence where `may_refuse`. Whether it succeeded.
fn run(folder: &Path, arguments: &[&str], may_refuse: bool) -> bool {
    let mut command = matdb(folder);
    let output = command.timeout(Duration::from_secs(MOST_S)).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => true,
        Some(1) if may_refuse => {
            let errors = said.lines().filter(|line| line.starts_with("error: ")).count();
            assert_eq!(errors, 1, "{arguments:?}: {said}");
            false
        }
        code => panic!("{arguments:?}: {code:?}: {said}"),
    }
}

/// No cell or word of a text is an infinity or no number.
fn is_finite(text: &str) -> bool {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    words
        .map(str::to_ascii_lowercase)
        .all(|word| !["inf", "infinity", "nan"].contains(&word.as_str()))
}

/// What each step that may refuse has come to.
fn follow(material: &Material) -> Vec<(&'static str, bool)> {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut store = Store::open(folder.join("matdb.sqlite")).unwrap();
    assert_eq!(store.add([material]).unwrap(), [Addition::New]);
    drop(store);
    for arguments in [
        &["show", "made-up"][..],
        &["show", "made-up", "--json"],
        &["list"],
        &["search", "made"],
        &["history", "made-up"],
        &["cite", "made-up"],
    ] {
        run(folder, arguments, false);
    }
    // A curve of two levels cannot be drawn, a fit that was not made here cannot be made again.
    let mut done = vec![("plot", run(folder, &["plot", "made-up", "-o", "made-up.svg"], true))];
    for format in FORMATS {
        let file = format!("export.{format}");
        let is_written = run(folder, &["export", "made-up", "--as", format, "-o", &file], true);
        done.push((format, is_written));
        if is_written {
            for name in
                crate::support::entries(folder).iter().filter(|name| name.starts_with("export."))
            {
                let text =
                    String::from_utf8_lossy(&fs::read(folder.join(name)).unwrap()).into_owned();
                assert!(format == "parquet" || is_finite(&text), "{name}:\n{text}");
                fs::remove_file(folder.join(name)).unwrap();
            }
        }
    }
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    fs::write(folder.join("about.toml"), "licence = 'CC-BY-4.0'\n").unwrap();
    done.push(("render", run(folder, &["render", "scene.toml", "-o", "out"], true)));
    let is_sound = run(folder, &["check"], true);
    done.push(("check", is_sound));
    if is_sound {
        run(folder, &["publish", "site", "--about", "about.toml"], false);
        run(folder, &["verify", "site"], false);
        run(folder, &["--db", "other.sqlite", "import", "site"], false);
        let other = Store::open_existing(folder.join("other.sqlite")).unwrap().unwrap();
        let imported = other.get(&material.slug, None).unwrap().unwrap();
        assert_eq!(imported.content_hash, material.content_hash());
    } else {
        run(folder, &["publish", "site", "--about", "about.toml"], true);
    }
    if matches!(material.status, Status::Active) {
        run(folder, &["withdraw", "made-up", "--reason", "it was made up"], false);
    }
    run(folder, &["rm", "made-up"], false);
    assert!(
        Store::open_existing(folder.join("matdb.sqlite"))
            .unwrap()
            .unwrap()
            .list()
            .unwrap()
            .is_empty()
    );
    done
}

#[test]
fn what_is_accepted_goes_the_whole_way() {
    let is_long = std::env::var_os("MATDB_TEST_MANY_CHAINS").is_some();
    let config = Config {
        cases: if is_long { 300 } else { 12 },
        max_shrink_iters: if is_long { 200 } else { 20 },
        failure_persistence: None,
        ..Config::default()
    };
    let counts = RefCell::new(BTreeMap::new());
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let done = runner.run(&(material(), any::<bool>()), |(mut material, has_reports)| {
        // A report of a fit that was not made here is refused by `publish`.
        if !has_reports {
            material.fits.iter_mut().for_each(|fit| fit.report = None);
            material.frequency_hz = [250e9, 350e9];
            material.status = Status::Active;
        }
        // Names of effects are checked where a file comes in: by `add --from` and `import`.
        material.effects.truncate(1);
        for effect in &mut material.effects {
            effect.name = "correlated-shadowing".to_owned();
            effect.parameters = [("share".to_owned(), 0.5)].into();
        }
        for (step, is_done) in follow(&material) {
            *counts.borrow_mut().entry(step).or_insert(0) += usize::from(is_done);
        }
        Ok(())
    });
    done.unwrap();
    // No step refuses them all.
    let counts = counts.into_inner();
    let is_built = |step: &str| step != "parquet" || cfg!(feature = "parquet");
    assert!(counts.iter().all(|(step, count)| *count > 0 || !is_built(step)), "{counts:?}");
}
