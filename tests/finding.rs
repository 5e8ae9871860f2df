//! Promise: a material is found by filter, word or curve, what differs between two is shown, and every
//! number leads to its source and every revision to the command that made it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::{self, matdb, refused, root};
use matdb::brdf::Scattering;
use matdb::catalogue::{Diff, references};
use matdb::material::{Material, Observation, SourceKind, builtin};
use matdb::store::{Filter, Store};
use matdb::units::db_from_ratio;
use serde_json::Value;

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = matdb(folder).args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn text(folder: &Path, arguments: &[&str]) -> String {
    let output = matdb(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn built_in() -> Vec<Material> {
    builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect()
}

fn slugs(list: &Value) -> Vec<&str> {
    list.as_array().unwrap().iter().map(|entry| entry["slug"].as_str().unwrap()).collect()
}

/// A copy of a built-in material's folder with one piece of text replaced.
fn variant(folder: &Path, slug: &str, from: &str, to: &str) {
    let own = folder.join(slug);
    fs::create_dir_all(&own).unwrap();
    for file in support::entries(&root().join("materials").join(slug)) {
        fs::copy(root().join("materials").join(slug).join(&file), own.join(&file)).unwrap();
    }
    let text = fs::read_to_string(own.join("material.toml")).unwrap();
    assert!(text.contains(from));
    fs::write(own.join("material.toml"), text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_filter_lets_through_exactly_what_it_says() {
    let mut store = Store::in_memory().unwrap();
    let all = built_in();
    store.add(&all).unwrap();
    let is_fitted = |m: &Material| m.fits.iter().any(|fit| fit.curve.is_some());
    let covers = |m: &Material, hz: f64| m.frequency_hz[0] <= hz && hz <= m.frequency_hz[1];
    type Holds<'a> = Box<dyn Fn(&Material) -> bool + 'a>;
    let any = Filter::default;
    let mut cases: Vec<(Filter, Holds)> = vec![
        (any(), Box::new(|_| true)),
        (Filter { fitted: Some(true), ..any() }, Box::new(is_fitted)),
        (Filter { fitted: Some(false), ..any() }, Box::new(move |m| !is_fitted(m))),
        (Filter { status: Some("withdrawn".to_owned()), ..any() }, Box::new(|_| false)),
        (Filter { tag: Some("no such tag".to_owned()), ..any() }, Box::new(|_| false)),
    ];
    for hz in [1e9, 100e9, 300e9, 5e12] {
        let filter = Filter { frequency_hz: Some(hz), ..any() };
        cases.push((filter, Box::new(move |m| covers(m, hz))));
    }
    for kind in [SourceKind::Measured, SourceKind::Modelled, SourceKind::Synthetic] {
        let filter = Filter { kind: Some(kind), ..any() };
        cases.push((filter, Box::new(move |m| m.render_kind() == Some(kind))));
    }
    for of in &all {
        let filter = Filter { class: Some(of.class.clone()), ..any() };
        cases.push((filter, Box::new(move |m| m.class == of.class)));
        let tag = of.tags.first().unwrap();
        let both = Filter { tag: Some(tag.clone()), class: Some(of.class.clone()), ..any() };
        cases.push((both, Box::new(move |m| m.tags.contains(tag) && m.class == of.class)));
    }
    for (filter, holds) in cases {
        let found: Vec<_> = store.find(&filter).unwrap().into_iter().map(|s| s.slug).collect();
        let expected: Vec<_> = all.iter().filter(|m| holds(m)).map(|m| m.slug.clone()).collect();
        assert_eq!(found, expected, "{filter:?}");
        let unstored: Vec<_> =
            all.iter().filter(|m| filter.lets_through(m)).map(|m| m.slug.clone()).collect();
        assert_eq!(unstored, found, "{filter:?}");
    }
}

/// A built-in material under other names, classes, tags and frequencies.
fn many(number: usize) -> Vec<Material> {
    let first = builtin::get("ptfe").unwrap().unwrap();
    let of = |number: usize| Material {
        slug: format!("sheet-{number:04}").parse().unwrap(),
        name: format!("Sheet no{number}"),
        class: format!("class-{}", number % 7),
        tags: vec![format!("tag-{}", number % 2), format!("rare-{}", number % 400)],
        frequency_hz: if number.is_multiple_of(300) { [1e9, 2e9] } else { [3e9, 400e9] },
        ..first.clone()
    };
    (0..number).map(of).collect()
}

#[test]
fn among_many_a_page_is_the_beginning_of_the_list_and_lines_are_those_of_the_materials() {
    let mut store = Store::in_memory().unwrap();
    let mut all = many(1200);
    store.add(&all).unwrap();
    // Twice in one go, and once more: only the last counts.
    let renamed = |name: &str| Material { name: name.to_owned(), ..all[3].clone() };
    let (second, third) = (renamed("Second"), renamed("Third"));
    store.add([&second, &third]).unwrap();
    all[3] = third;
    assert!(store.damage().unwrap().is_empty());
    assert_eq!(store.summary(&all[3].slug).unwrap().unwrap().revision, 3);
    let classes: BTreeSet<String> = all.iter().map(|m| m.class.clone()).collect();
    assert_eq!(store.classes().unwrap(), classes.into_iter().collect::<Vec<_>>());
    let any = Filter::default;
    let tag = |tag: &str| Filter { tag: Some(tag.to_owned()), ..any() };
    let class = Some("class-3".to_owned());
    let hz = |hz: f64| Filter { frequency_hz: Some(hz), ..any() };
    let kind = all[0].render_kind();
    let cases = [
        any(),
        tag("tag-1"),
        tag("rare-7"),
        Filter { class: class.clone(), ..any() },
        Filter { class: class.clone(), ..tag("tag-1") },
        Filter { class, kind, ..tag("rare-7") },
        hz(1.5e9),
        hz(300e9),
        Filter { kind, status: Some("active".to_owned()), ..hz(300e9) },
        Filter { kind, ..tag("tag-0") },
        Filter { fitted: Some(false), ..any() },
        Filter { fitted: Some(true), ..any() },
    ];
    for filter in cases {
        let Filter { frequency_hz, tag, class, fitted, .. } = &filter;
        let holds = |m: &&Material| {
            frequency_hz.is_none_or(|hz| m.frequency_hz[0] <= hz && hz <= m.frequency_hz[1])
                && tag.as_ref().is_none_or(|tag| m.tags.contains(tag))
                && class.as_ref().is_none_or(|class| m.class == *class)
                && fitted.is_none_or(|fitted| fitted == m.fits.iter().any(|f| f.curve.is_some()))
        };
        let expected: Vec<_> = all.iter().filter(holds).map(|m| m.slug.clone()).collect();
        let found = store.find(&filter).unwrap();
        let slugs: Vec<_> = found.iter().map(|summary| summary.slug.clone()).collect();
        assert_eq!(slugs, expected, "{filter:?}");
        assert_eq!(store.count(&filter, 2000).unwrap(), found.len(), "{filter:?}");
        assert_eq!(store.count(&filter, 1).unwrap(), found.len().min(1), "{filter:?}");
        let page = store.page(&filter, 9).unwrap();
        assert_eq!(page, found[..found.len().min(9)], "{filter:?}");
    }
}

#[test]
fn a_word_that_is_everywhere_fills_a_page_and_hides_no_rare_one() {
    let mut store = Store::in_memory().unwrap();
    store.add(&many(1200)).unwrap();
    let found = |words: &str, most: u32| -> Vec<String> {
        let hits = store.search(words, &Filter::default(), most).unwrap();
        hits.iter().map(|hit| hit.slug.to_string()).collect()
    };
    for words in ["sheet", "shee", "sh", "tag sheet"] {
        let some = found(words, 9);
        let different: std::collections::BTreeSet<_> = some.iter().collect();
        assert_eq!((some.len(), different.len()), (9, 9), "{words}");
        assert_eq!(found(words, u32::MAX).len(), 1200, "{words}");
    }
    assert_eq!(found("sheet no77", 1), ["sheet-0077"]);
    assert_eq!(found("sheet 07", 2), ["sheet-0700", "sheet-0701"]);
    assert_eq!(found("sheet no777", 9), ["sheet-0777"]);
    assert_eq!(found("no777", 9), ["sheet-0777"]);
    assert!(found("sheet zirconia", 9).is_empty());
}

#[test]
fn a_filtered_search_finds_what_both_the_words_and_the_filter_find() {
    let mut store = Store::in_memory().unwrap();
    store.add(&many(1200)).unwrap();
    let tag = |tag: &str| Filter { tag: Some(tag.to_owned()), ..Filter::default() };
    let filters = [
        Filter { frequency_hz: Some(300e9), ..Filter::default() },
        Filter { frequency_hz: Some(1e3), ..Filter::default() },
        Filter { fitted: Some(true), ..Filter::default() },
        Filter { fitted: Some(false), frequency_hz: Some(300e9), ..tag("rare-7") },
        tag("rare-7"),
        tag("nowhere"),
    ];
    // Words of every material and of a few.
    for words in ["sheet", "sh", "tag sheet", "no77", "sheet 07"] {
        let search = |filter: &Filter, most: u32| -> BTreeSet<String> {
            let hits = store.search(words, filter, most).unwrap();
            hits.iter().map(|hit| hit.slug.to_string()).collect()
        };
        let all = search(&Filter::default(), u32::MAX);
        for filter in &filters {
            let matching = store.find(filter).unwrap();
            let matching: BTreeSet<_> = matching.iter().map(|one| one.slug.to_string()).collect();
            let both: BTreeSet<String> = all.intersection(&matching).cloned().collect();
            assert_eq!(search(filter, u32::MAX), both, "{words} {filter:?}");
            assert_eq!(search(filter, 2).len(), both.len().min(2), "{words} {filter:?}");
        }
    }
}

#[test]
fn a_long_list_says_what_it_leaves_out_and_json_leaves_nothing_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add(&many(1200)).unwrap();
    drop(store);
    let list = text(folder.path(), &["list"]);
    assert!(list.contains("sheet-0199") && !list.contains("sheet-0200"), "{list}");
    assert!(list.contains("… and 1 000 more; narrow with --class"), "{list}");
    assert!(text(folder.path(), &["list", "--limit", "3"]).contains("… and 1 197 more"));
    assert!(!text(folder.path(), &["list", "--tag", "rare-7"]).contains("more;"));
    assert_eq!(slugs(&json(folder.path(), &["list"])).len(), 1200);
    assert_eq!(slugs(&json(folder.path(), &["list", "--limit", "5"])).len(), 5);
}

#[test]
fn what_is_found_is_the_current_revision_and_goes_with_its_material() {
    let mut store = Store::in_memory().unwrap();
    let mut paint = builtin::get("mannequin-paint").unwrap().unwrap();
    store.add([&paint]).unwrap();
    paint.name = "Glimmering zirconia".to_owned();
    paint.class = "ceramic".to_owned();
    paint.tags = vec!["kiln".to_owned()];
    store.add([&paint]).unwrap();
    let of = |class: &str| Filter { class: Some(class.to_owned()), ..Filter::default() };
    assert!(store.find(&of("paint")).unwrap().is_empty());
    assert_eq!(store.find(&of("ceramic")).unwrap()[0].revision, 2);
    assert_eq!(store.summary(&paint.slug).unwrap().unwrap().name, paint.name);
    for words in ["zirconia", "ZIRC", "glimmering kil", "mannequin"] {
        let hits = store.search(words, &Filter::default(), 9).unwrap();
        assert_eq!(hits.len(), 1, "{words}");
        assert_eq!((hits[0].revision, hits[0].name.as_str()), (2, "Glimmering zirconia"));
    }
    assert!(store.search("zirconia absent", &Filter::default(), 9).unwrap().is_empty());
    assert!(store.damage().unwrap().is_empty());
    store.remove([&paint.slug]).unwrap();
    assert!(store.search("zirconia", &Filter::default(), 9).unwrap().is_empty());
    assert!(store.list().unwrap().is_empty() && store.summary(&paint.slug).unwrap().is_none());
    assert!(store.damage().unwrap().is_empty());
}

#[test]
fn no_word_of_a_user_is_a_mistake_in_a_query() {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).args(["add", "ptfe"]).assert().success();
    for words in [
        "\"",
        "a\"b",
        "NEAR(",
        "AND OR NOT",
        "name:ptfe",
        "*",
        "ptfe*",
        "^ptfe",
        "-x",
        "(",
        "{a b}: c",
    ] {
        let output = matdb(folder.path()).args(["search", "--", words]).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() || said.contains("there is no word"), "{words}: {said}");
    }
    let long = "x".repeat(10_000);
    let many = vec!["ptfe"; 2000];
    matdb(folder.path()).args(["search", &long]).assert().success();
    matdb(folder.path()).arg("search").args(many).assert().success();
    let said = refused(matdb(folder.path()).args(["search", "--", "!?"]));
    assert!(said.contains("letter or a digit"), "{said}");
}

#[test]
fn words_are_searched_in_what_is_built_in_and_in_the_database_and_labelled() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let of = |list: &Value| -> Vec<(String, String)> {
        let pair =
            |hit: &Value| ["slug", "origin"].map(|key| hit[key].as_str().unwrap().to_owned());
        list.as_array().unwrap().iter().map(pair).map(|[slug, origin]| (slug, origin)).collect()
    };
    let built_in = ("ptfe".to_owned(), "built-in".to_owned());
    assert!(of(&json(folder, &["search", "ptf"])).contains(&built_in));
    assert_eq!(support::entries(folder), Vec::<String>::new(), "searching makes no database");
    matdb(folder).args(["add", "ptfe"]).assert().success();
    let found = of(&json(folder, &["search", "ptf"]));
    assert_eq!(found[0], ("ptfe".to_owned(), "database".to_owned()));
    assert!(!found.contains(&built_in), "once, not twice");
    assert!(text(folder, &["search", "ptf"]).contains("["));
    assert!(text(folder, &["search", "nothing", "has", "this"]).contains("no material"));
}

#[test]
fn list_takes_filters() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matdb(folder).args(["add", "--all"]).assert().success();
    let paint = json(folder, &["list", "--class", "paint", "--frequency", "300"]);
    assert_eq!(slugs(&paint), ["mannequin-paint", "painted-metal"]);
    assert_eq!(slugs(&json(folder, &["list", "--kind", "measured"])), Vec::<&str>::new());
    assert!(text(folder, &["list", "--fitted", "--kind", "measured"]).contains("no such material"));
    for wrong in [
        ["--frequency", "0"],
        ["--frequency", "-1"],
        ["--frequency", "inf"],
        ["--frequency", "NaN"],
        ["--kind", "guessed"],
    ] {
        let output = matdb(folder).arg("list").args(wrong).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8(output.stderr).unwrap();
        let way_out = ["give a frequency in GHz above 0", "possible values"];
        assert!(way_out.iter().any(|way_out| said.contains(way_out)), "{said}");
    }
}

#[test]
fn a_class_that_nobody_has_is_answered_with_those_there_are() {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).args(["add", "ptfe"]).assert().success();
    let said = text(folder.path(), &["list", "--class", "nix"]);
    assert!(
        said.contains("no class is called `nix`, there are: ") && said.contains("textile"),
        "{said}"
    );
    let said = text(folder.path(), &["list", "--tag", "nix"]);
    assert!(
        said.contains("no tag is called `nix`, there are: ") && said.contains("composite"),
        "{said}"
    );
    let known = text(folder.path(), &["list", "--tag", "polymer", "--class", "metal"]);
    assert!(known.contains("no such material") && !known.contains("is called"), "{known}");
    let said = refused(matdb(folder.path()).args([
        "withdraw",
        "ptfe",
        "--reason",
        "dented",
        "--superseded-by",
        "ptfe-2",
    ]));
    assert!(said.contains("`ptfe-2`") && said.contains("add that one first"), "{said}");
}

#[test]
fn a_withdrawn_material_stays_with_its_reason_and_is_found_by_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let withdraw = |more: &[&str]| {
        let mut command = matdb(folder);
        command.args(["withdraw", "ptfe", "--reason", "The trihedral was dented."]).args(more);
        command
    };
    assert!(refused(&mut withdraw(&[])).contains("`ptfe` is not in"));
    assert!(support::entries(folder).is_empty());
    matdb(folder).args(["add", "ptfe", "hdpe"]).assert().success();
    assert!(refused(&mut withdraw(&["--superseded-by", "hdp"])).contains("did you mean `hdpe`?"));
    withdraw(&[]).assert().success();
    assert_eq!(slugs(&json(folder, &["list", "--status", "withdrawn"])), ["ptfe"]);
    for command in [&["show", "ptfe"][..], &["cite", "ptfe"], &["cite", "ptfe", "--bibtex"]] {
        let said = text(folder, command);
        assert!(said.contains("withdrawn: The trihedral was dented."), "{command:?}: {said}");
    }
    assert!(text(folder, &["list"]).contains("synthetic, withdrawn"));
    assert!(text(folder, &["search", "ptfe"]).contains("revision 2, withdrawn"));
    assert_eq!(json(folder, &["search", "ptfe"])[0]["status"], "withdrawn");
    let csl = json(folder, &["cite", "ptfe"])["csl"][0]["note"].clone();
    assert_eq!(csl, "withdrawn: The trihedral was dented.");
    let export = ["export", "ptfe", "--as", "csv", "-o", "ptfe.csv"];
    let output = matdb(folder).args(export).output().unwrap();
    assert!(String::from_utf8_lossy(&output.stderr).contains("`ptfe` is withdrawn: The trihedral"));
    assert!(!text(folder, &["list"]).contains("active"));
    withdraw(&["--superseded-by", "hdpe"]).assert().success();
    let said = text(folder, &["show", "ptfe"]);
    assert!(said.contains("superseded: The trihedral was dented.; use hdpe"), "{said}");
    let history = json(folder, &["history", "ptfe"]);
    assert_eq!(history[2]["activity"]["command"], "withdraw");
    let said = refused(matdb(folder).args(["withdraw", "hdpe", "--reason", " "]));
    assert!(said.contains("--reason is empty; say in a sentence why"), "{said}");
}

/// A curve of a built-in material, so many dB higher, as a file.
fn curve(folder: &Path, slug: &str, offset_db: f64) -> String {
    let scattering = builtin::get(slug).unwrap().unwrap().scattering().unwrap();
    let row = |deg: u32| {
        let level_db = db_from_ratio(scattering.sigma0(f64::from(deg).to_radians())) + offset_db;
        format!("{deg},{level_db:.6}\n")
    };
    let text: String = (2..40).step_by(4).map(row).collect();
    fs::write(folder.join("curve.csv"), "theta_deg,sigma0_db\n".to_owned() + &text).unwrap();
    "curve.csv".to_owned()
}

#[test]
fn a_curve_is_nearest_to_what_made_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let file = curve(folder, "human-skin", 0.0);
    let near = json(folder, &["near", "--curve", &file]);
    let first = &near["materials"][0];
    assert_eq!((&first["slug"], &first["revision"]), (&"human-skin".into(), &Value::Null));
    assert!(first["rms_db"].as_f64().unwrap() < 1e-3 && near["noise_db"].is_null());
    matdb(folder).args(["add", "human-skin"]).assert().success();
    let file = curve(folder, "human-skin", 9.0);
    let near = json(folder, &["near", "--curve", &file, "--shape"]);
    let first = &near["materials"][0];
    assert_eq!((&first["slug"], &first["revision"]), (&"human-skin".into(), &1.into()));
    assert!((first["rms_db"].as_f64().unwrap() - 9.0).abs() < 1e-3);
    assert!((first["offset_db"].as_f64().unwrap() - 9.0).abs() < 1e-3);
    assert!(first["rms_shape_db"].as_f64().unwrap() < 1e-3);
    let distances = near["materials"].as_array().unwrap().iter();
    let distances: Vec<f64> = distances.map(|m| m["rms_shape_db"].as_f64().unwrap()).collect();
    assert!(distances.is_sorted() && distances.len() > 2);
    assert!(text(folder, &["near", "--curve", &file]).contains("without repeats"));
    fs::write(folder.join("silent.csv"), "theta_deg,sigma0_db,censored\n5,-20,1\n").unwrap();
    let said = refused(matdb(folder).args(["near", "--curve", "silent.csv"]));
    assert!(said.contains("detected"), "{said}");
    refused(matdb(folder).args(["near", "--material", "ptfe"]));
}

#[test]
fn a_difference_names_the_field_with_its_unit_and_a_history_who_made_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matdb(folder).args(["add", "ptfe"]).assert().success();
    variant(folder, "ptfe", "m = 0.05", "m = 0.06");
    matdb(folder).args(["add", "--from", "ptfe"]).assert().success();
    let diff = json(folder, &["diff", "ptfe@1", "ptfe@2"]);
    let fields = diff["fields"].as_array().unwrap();
    assert_eq!(fields.len(), 1, "{diff}");
    assert!(fields[0]["path"].as_str().unwrap().ends_with("specular.m"), "{diff}");
    assert_eq!((&fields[0]["before"], &fields[0]["after"]), (&0.05.into(), &0.06.into()));
    assert!(diff["rendered"]["rms_db"].as_f64().unwrap() > 0.1);
    assert!(text(folder, &["diff", "ptfe", "ptfe@2"]).contains("the same"));
    let history = json(folder, &["history", "ptfe"]);
    assert_eq!(history[0]["activity"]["command"], "add");
    let bytes = fs::read(folder.join("ptfe/material.toml")).unwrap();
    let input = &history[1]["activity"]["inputs"][0];
    assert_eq!(input["name"], "material.toml");
    assert_eq!(input["hash"], blake3::hash(&bytes).to_hex().as_str());
    assert!(history[1]["changed"].as_str().unwrap().contains("fits"), "{history}");
    let said = refused(matdb(folder).args(["history", "glass"]));
    assert!(said.contains("built in"), "{said}");
    refused(matdb(folder).args(["history", "ptfe@1"]));
    refused(matdb(folder).args(["history", "nothing-like-it"]));
}

#[test]
fn a_fit_that_is_new_is_told_by_its_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matdb(folder).args(["add", "cotton"]).assert().success();
    let fit = ["fit", "cotton", "--model", "lambert", "--save", "--looks", "4"];
    matdb(folder).args(fit).assert().success();
    let told = text(folder, &["diff", "cotton@1", "cotton@2"]);
    assert!(told.contains("fits.lambert-censored.model.albedo"), "{told}");
    assert!(!told.contains("report") && told.lines().count() < 15, "{told}");
    let all = text(folder, &["diff", "cotton@1", "cotton@2", "--all"]);
    assert!(all.contains("report") && all.contains("covariance") && !all.contains("inf"), "{all}");
}

#[test]
fn curves_differ_by_their_levels_at_common_angles() {
    let before = builtin::get("cotton").unwrap().unwrap();
    let mut after = before.clone();
    for point in &mut after.curves[0].observations {
        point.sigma0 = point.sigma0.map(|sigma0| 2.0 * sigma0);
    }
    after.curves[0].observations.remove(0);
    after.frequency_hz[1] = 2.0 * before.frequency_hz[1];
    let diff = Diff::new(&before, &after);
    let levels = diff.curves[0].levels.unwrap();
    let two_db = 10.0 * 2f64.log10();
    assert!((levels.mean_db - two_db).abs() < 1e-9 && (levels.rms_db - two_db).abs() < 1e-9);
    let points = before.curves[0].observations.len();
    assert_eq!(diff.curves[0].points, [Some(points), Some(points - 1)]);
    let field = diff.fields.iter().find(|f| f.path.starts_with("frequency_hz")).unwrap();
    assert!(field.after().ends_with(" GHz") && field.unit.as_deref() == Some("Hz"));
    assert!(Diff::new(&before, &before).is_empty());
    assert!(diff.curves[0].limits.is_none());
}

#[test]
fn curves_differ_by_their_detection_limits() {
    let mut before = builtin::get("cotton").unwrap().unwrap();
    let mut after = before.clone();
    let level = |point: &mut Observation, factor: f64| {
        point.threshold_sigma0 = Some(factor * point.sigma0.unwrap_or(1.0))
    };
    before.curves[0].observations.iter_mut().for_each(|point| level(point, 0.01));
    after.curves[0].observations.iter_mut().for_each(|point| level(point, 0.1));
    let diff = Diff::new(&before, &after);
    assert!((diff.curves[0].limits.unwrap().mean_db - 10.0).abs() < 1e-9);
    assert!(diff.line().contains("limits 10.0 dB rms"), "{}", diff.line());
}

/// Paths of all numbers of a material, by going through its JSON.
fn numbers(value: &Value) -> usize {
    match value {
        Value::Number(_) => 1,
        Value::Array(items) => items.iter().map(numbers).sum(),
        Value::Object(fields) => fields.values().map(numbers).sum(),
        _ => 0,
    }
}

#[test]
fn every_built_in_number_has_a_source_that_cite_prints() {
    let folder = tempfile::tempdir().unwrap();
    for material in built_in() {
        let slug = material.slug.as_str();
        let said = text(folder.path(), &["cite", slug]);
        for reference in references(&material) {
            let Some(source) = &reference.source else {
                // Only what the entry claims of itself: where its numbers hold.
                for place in &reference.numbers {
                    let is_claim =
                        place.starts_with("frequency_hz") || place.starts_with("theta_rad");
                    assert!(is_claim, "{slug}: {place} has no source");
                }
                continue;
            };
            assert!(said.contains(&source.title), "{slug}: {}", source.title);
            assert!(source.title.len() > 5);
            reference.numbers.iter().for_each(|place| assert!(said.contains(place), "{place}"));
        }
        // Nothing with a number in it is left out.
        let whole = serde_json::to_value(&material).unwrap();
        let all: Vec<String> =
            references(&material).into_iter().flat_map(|reference| reference.numbers).collect();
        for (field, value) in whole.as_object().unwrap() {
            let word = match field.as_str() {
                "sources" => continue,
                "curves" => "curve ",
                "fits" => "fit ",
                "permittivities" => "permittivity ",
                "layers" => "layer ",
                other => other,
            };
            let is_there = all.iter().any(|place| place.starts_with(word));
            assert_eq!(numbers(value) > 0, is_there, "{slug}: {field}");
        }
        for fit in &material.fits {
            for parameter in fit.model.parameters() {
                let place = format!("fit {}, {}", fit.name, parameter.path);
                let own = fit.parameter_sources.iter().find(|(path, _)| *path == parameter.path);
                let key = own.map_or(&fit.source, |(_, key)| key);
                let of = references(&material).into_iter().find(|r| r.numbers.contains(&place));
                let of = of.unwrap_or_else(|| panic!("{slug}: {place} is not cited"));
                assert_eq!(&of.source.unwrap().key, key, "{slug}: {place}");
            }
        }
    }
}

#[test]
fn citations_are_bibtex_and_csl() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matdb(folder).args(["add", "ptfe"]).assert().success();
    let bibtex = text(folder, &["cite", "ptfe@1", "--bibtex"]);
    let open = bibtex.matches('{').count() - bibtex.matches("\\{").count();
    let close = bibtex.matches('}').count() - bibtex.matches("\\}").count();
    let sources = builtin::get("ptfe").unwrap().unwrap().sources.len();
    assert_eq!((open, bibtex.matches("\n}\n").count()), (close, sources + 1));
    let csl: Value = serde_json::from_str(&text(folder, &["cite", "ptfe", "--csl"])).unwrap();
    let csl = csl.as_array().unwrap();
    assert_eq!(csl.len(), sources + 1);
    for item in csl {
        for key in ["id", "type", "title"] {
            assert!(item[key].is_string(), "{item}");
        }
    }
    assert!(csl[0]["title"].as_str().unwrap().contains("revision 1"));
    assert_eq!(json(folder, &["cite", "ptfe"])["csl"], Value::Array(csl.clone()));
}
