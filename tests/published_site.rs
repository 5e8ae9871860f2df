//! Promise: a published site stands alone, every link of it leads somewhere, whatever a database says
//! is shown and not run, and the same database gives the same bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::database::{complete, fitted, refitted, sample, with_effects};
use crate::support::{matdb, read_cloud};
use matdb::adopt::publish;
use matdb::catalogue::About;
use matdb::formats::base64::base64;
use matdb::material::{Material, SourceKind, builtin};
use matdb::report::CATALOGUE_VIEW;
use matdb::store::Store;
use sha2::{Digest, Sha256};

const HOSTILE: &str = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&{{7*7}}{% x %}\u{1}\u{1b}[2J\u{202e}abc\u{2028}";

/// A built-in catalogue, a fitted material and one that means harm.
fn materials() -> Vec<Material> {
    let mut all: Vec<Material> =
        builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    all.extend(
        [fitted("fitted"), with_effects("with-effects"), complete("complete")].map(refitted),
    );
    all.push(hostile());
    all
}

/// Every text of it is an attack.
fn hostile() -> Material {
    let mut material = sample("hostile");
    let text = |word: &str| format!("{HOSTILE} {word}");
    material.name = format!("{HOSTILE}{}", "w".repeat(10_000));
    material.class = text("class");
    material.description = format!("{HOSTILE} Not known: {HOSTILE}. שלום עולם.");
    material.licence = text("licence");
    material.tags = vec![text("tag"), "#&=?/".to_owned()];
    for (number, source) in material.sources.iter_mut().enumerate() {
        source.title = text("title");
        source.note = Some(text("note"));
        source.licence = Some(text("source licence"));
        source.doi = (number == 0).then(|| format!("10.1000/{HOSTILE}"));
        source.url = Some("javascript:alert(3)".to_owned());
    }
    material.instruments[0].name = text("instrument");
    material.instruments[0].note = Some(text("instrument note"));
    let renamed = text("scan");
    material.curves[0].name = renamed;
    let key = text("key");
    let old = material.sources[0].key.clone();
    for source in material.sources.iter_mut().filter(|source| source.key == old) {
        source.key = key.clone();
    }
    material.curves[0].source = key.clone();
    for fit in &mut material.fits {
        let sources = std::iter::once(&mut fit.source)
            .chain(fit.parameter_sources.iter_mut().map(|(_, source)| source));
        sources.filter(|source| **source == old).for_each(|source| *source = key.clone());
    }
    material.validate().unwrap();
    material
}

fn about() -> About {
    let text = format!(
        "title = 'Catalogue of {0}'\ndescription = '{0}'\nversion = '1'\nlicence = 'CC0-1.0'\n\
         [[person]]\nfamily = '<b>Roe</b>'\ngiven = 'Ann'\n",
        "<script>alert(0)</script>"
    );
    // A bundle of somebody else may say what the file may not.
    let about = About::parse("about.toml", &text).unwrap();
    About { url: Some("javascript:alert(4)".to_owned()), ..about }
}

/// Path in the site → text.
fn read(folder: &Path) -> BTreeMap<String, String> {
    fn walk(root: &Path, folder: &Path, found: &mut BTreeMap<String, String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(root, &path, found);
            } else if let Ok(text) = fs::read_to_string(&path) {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap();
                found.insert(name.replace('\\', "/"), text);
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(folder, folder, &mut found);
    found
}

struct Site {
    files: BTreeMap<String, String>,
    folder: PathBuf,
    _root: tempfile::TempDir,
}

fn site() -> Site {
    let root = tempfile::tempdir().unwrap();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    store.add(&materials()).unwrap();
    let folder = root.path().join("site");
    publish(&store, &about(), &folder, |_| ()).unwrap();
    Site { files: read(&folder), folder, _root: root }
}

impl Site {
    /// Every page but that in three dimensions, which has a script and a style of its own.
    fn pages(&self) -> impl Iterator<Item = (&String, &String)> {
        self.files.iter().filter(|(path, _)| path.ends_with(".html") && *path != "view.html")
    }
}

/// Tags of a page as (name, attributes by name), the text of attributes read back.
fn tags(html: &str) -> Vec<(String, BTreeMap<String, String>)> {
    let mut found = Vec::new();
    let mut rest = html;
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        let mut quoted = false;
        let end = rest
            .find(|c: char| {
                quoted ^= c == '"';
                c == '>' && !quoted
            })
            .expect("every tag ends");
        found.push(tag(&rest[..end]));
        rest = &rest[end..];
    }
    found
}

fn tag(text: &str) -> (String, BTreeMap<String, String>) {
    let (name, mut rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let mut attributes = BTreeMap::new();
    while !rest.trim().is_empty() {
        rest = rest.trim_start();
        let end = rest.find(|c: char| c == '=' || c.is_whitespace()).unwrap_or(rest.len());
        let key = rest[..end].to_owned();
        rest = &rest[end..];
        let mut value = String::new();
        if let Some(quoted) = rest.strip_prefix("=\"") {
            let close = quoted.find('"').unwrap();
            value = unescaped(&quoted[..close]);
            rest = &quoted[close + 1..];
        }
        attributes.insert(key, value);
    }
    (name.to_owned(), attributes)
}

fn unescaped(text: &str) -> String {
    let signs = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#x27;", "'"), ("&#39;", "'")];
    let text = signs.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
    text.replace("&#x2f;", "/").replace("&amp;", "&")
}

/// The file that an address inside the site leads to.
fn target(page: &str, address: &str) -> String {
    let address = address.split(['#', '?']).next().unwrap();
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in address.split('/') {
        match part {
            ".." => drop(parts.pop().expect("a link stays inside the site")),
            "." | "" => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

#[test]
fn nothing_is_loaded_from_elsewhere_and_nothing_runs_inside_a_page() {
    let site = site();
    assert_eq!(site.pages().count(), materials().len() + 3);
    for (path, html) in site.pages() {
        assert!(
            html.contains("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'")
        );
        for (name, attributes) in tags(html) {
            for (key, value) in &attributes {
                assert!(!key.starts_with("on") && key != "style", "{path}: {name} {key}");
                let loads = key == "src" || (key == "href" && name == "link");
                assert!(!loads || !value.contains(':'), "{path} loads {value}");
            }
            let is_data = attributes.get("type").is_some_and(|t| t == "application/ld+json");
            assert!(name != "script" || is_data || attributes.contains_key("src"), "{path}");
            assert!(
                !["style", "iframe", "object", "embed", "form action"].contains(&name.as_str())
            );
        }
    }
    for (path, text) in site.files.iter().filter(|(path, _)| path.starts_with("assets/")) {
        let calls =
            ["fetch(", "XMLHttpRequest", "@import", "url(", "import(", "innerHTML", "eval("];
        for word in calls {
            assert!(!text.contains(word), "{path} says {word}");
        }
        let outside = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!outside.contains("://"), "{path} names an address");
    }
}

/// The script of the page in three dimensions, and the data that it reads.
fn script_and_data(view: &str) -> (&str, serde_json::Value) {
    let (before, script) = view.split_once("<script type=\"module\">").unwrap();
    let (_, data) = before.split_once("<script type=\"application/json\" id=\"view\">").unwrap();
    let data = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    (script.split_once("</script>").unwrap().0, data)
}

#[test]
fn one_page_shows_every_material_that_can_be_rendered_in_three_dimensions() {
    let site = site();
    let view = &site.files["view.html"];
    let (script, data) = script_and_data(view);
    let hash = Sha256::digest(script);
    let policy = format!(
        "content=\"default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data:;",
        base64(&hash)
    );
    assert!(view.contains(&policy), "it runs its own script only");
    assert!(!view.contains("://") && !view.contains("url(") && !script.contains("import"));
    assert!(
        view.contains("<h1>Materials in three dimensions – Catalogue of &lt;script&gt;alert(0)")
    );
    let names = |list: &serde_json::Value| -> Vec<String> {
        let names = list.as_array().unwrap().iter();
        names.map(|name| name.as_str().unwrap().to_owned()).collect()
    };
    let columns = data["points"]["columns"].as_array().unwrap();
    let shown = names(&columns.iter().find(|one| one["name"] == "material").unwrap()["names"]);
    let mut expected: Vec<String> = materials()
        .into_iter()
        .filter(|material| material.scattering().is_ok())
        .map(|material| material.slug.to_string())
        .collect();
    expected.sort();
    assert_eq!(shown, expected);
    let labels = data["balls"]["labels"].as_array().unwrap();
    assert_eq!(labels.iter().map(|label| label[0].as_str().unwrap()).collect::<Vec<_>>(), expected);
    // Material pages lead to their balls, where the page has one.
    let index = tags(&site.files["index.html"]);
    let leads = |tags: &[(String, BTreeMap<String, String>)], start: &str| {
        tags.iter().any(|(_, keys)| keys.get("href").is_some_and(|href| href.starts_with(start)))
    };
    assert!(leads(&index, "view.html"));
    for material in materials() {
        let slug = material.slug.to_string();
        let page = tags(&site.files[&format!("material/{slug}.html")]);
        assert_eq!(leads(&page, "../view.html#camera="), expected.contains(&slug), "{slug}");
    }
}

#[test]
fn the_page_in_three_dimensions_says_what_it_leaves_out_and_has_the_same_bytes_on_one_thread() {
    let root = tempfile::tempdir().unwrap();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    let paint = builtin::get("mannequin-paint").unwrap().unwrap();
    let numbered = |number: usize| Material {
        slug: format!("m{number:03}").parse().unwrap(),
        ..paint.clone()
    };
    store.add(&(0..103).map(numbered).collect::<Vec<_>>()).unwrap();
    let drawn = (CATALOGUE_VIEW.draw)(&store, &about()).unwrap();
    let page = String::from_utf8(drawn.clone()).unwrap();
    assert!(page.contains("Not shown: 3 further materials. This page holds the first 100."));
    assert_eq!((CATALOGUE_VIEW.places)(&store).unwrap().len(), 100);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = one.install(move || (CATALOGUE_VIEW.draw)(&store, &about()).unwrap());
    assert!(again == drawn);
}

#[test]
fn the_page_of_the_built_in_materials_is_small_and_shows_each() {
    let mut store = Store::in_memory().unwrap();
    let all: Vec<Material> =
        builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    store.add(&all).unwrap();
    let page = (CATALOGUE_VIEW.draw)(&store, &About::default()).unwrap();
    // A page that a phone loads at once.
    const MOST_BYTES: usize = 1_000_000;
    assert!(page.len() < MOST_BYTES, "{} bytes", page.len());
    let places = (CATALOGUE_VIEW.places)(&store).unwrap();
    assert_eq!(places.len(), all.len());
    // Where each is shown depends on its number alone, so that the pages that lead there are the same on every machine.
    let places: BTreeSet<&String> = places.values().collect();
    assert_eq!(places.len(), all.len());
}

#[test]
fn the_front_page_leads_to_the_data_and_to_where_the_catalogue_stands() {
    let root = tempfile::tempdir().unwrap();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    store.add(&materials()).unwrap();
    let about = About { doi: Some("10.5281/zenodo.1".to_owned()), ..about() };
    publish(&store, &about, &root.path().join("site"), |_| ()).unwrap();
    let tags = tags(&read(&root.path().join("site"))["index.html"]);
    let hrefs: Vec<&str> =
        tags.iter().filter_map(|(_, keys)| keys.get("href")).map(String::as_str).collect();
    for there in [
        "catalogue.sqlite",
        "datapackage.json",
        "api/v1/index.json",
        "CITATION.cff",
        "CHANGES.md",
        "https://doi.org/10.5281/zenodo.1",
    ] {
        assert!(hrefs.contains(&there), "{there}: {hrefs:?}");
    }
}

#[test]
fn every_link_leads_somewhere() {
    let site = site();
    for (path, html) in site.pages() {
        let tags = tags(html);
        let ids: Vec<&String> = tags.iter().filter_map(|(_, a)| a.get("id")).collect();
        assert_eq!(ids.len(), ids.iter().collect::<BTreeSet<_>>().len(), "{path}: an id twice");
        for (name, attributes) in &tags {
            for key in ["href", "src"] {
                let Some(address) = attributes.get(key) else { continue };
                match address.split_once(':').map(|(scheme, _)| scheme) {
                    Some("https" | "http") => assert_eq!(name, "a"),
                    _ if address.starts_with('#') => {
                        assert!(ids.iter().any(|id| **id == address[1..]), "{path}: {address}");
                    }
                    _ => {
                        let target = site.folder.join(target(path, address));
                        assert!(target.is_file(), "{path}: {address}");
                    }
                }
            }
            for key in ["aria-labelledby", "aria-describedby", "for"] {
                for id in attributes.get(key).map_or("", String::as_str).split_whitespace() {
                    assert!(ids.iter().any(|known| *known == id), "{path}: {key} {id}");
                }
            }
        }
    }
}

#[test]
fn what_a_database_says_is_shown_and_not_run() {
    let site = site();
    let page = &site.files["material/hostile.html"];
    assert!(page.contains("&lt;script&gt;alert(1)"), "it is shown");
    let control = |c: char| c.is_control() && c != '\n' && c != '\t';
    // Of text, that is; JSON escapes what it holds.
    let is_text = |path: &str| !path.ends_with(".json") && !path.ends_with(".parquet");
    for (path, text) in site.files.iter().filter(|(path, _)| is_text(path)) {
        if !path.ends_with(".csv") {
            assert!(!text.contains(control), "{path} holds a control character");
            // In these two a tag is text between quotes, and no browser opens them as a page.
            let is_record = path.ends_with(".cff") || path.ends_with(".jsonld");
            let tag = text.contains("<script>alert") || text.contains("<img src=x");
            assert!(is_record || !tag, "{path}");
        }
    }
    for (path, html) in site.pages() {
        for (name, attributes) in tags(html) {
            assert!(!["img", "b"].contains(&name.as_str()), "{path}: {name}");
            let href = attributes.get("href").map_or("", String::as_str);
            assert!(!href.starts_with("javascript"), "{path}: {href}");
        }
    }
    for (path, text) in &site.files {
        let Some(call) = ["index/", "data/"].iter().find(|folder| path.starts_with(**folder))
        else {
            continue;
        };
        let name = if *call == "index/" { "matdbIndex(" } else { "matdbMaterial(" };
        let json = text.trim_end().strip_prefix(name).unwrap().strip_suffix(");").unwrap();
        serde_json::from_str::<serde_json::Value>(json).unwrap();
    }
}

#[test]
fn the_same_database_gives_the_same_bytes() {
    let root = tempfile::tempdir().unwrap();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    store.add(&materials()).unwrap();
    let [one, two] = ["one", "b/two"].map(|name| root.path().join(name));
    publish(&store, &about(), &one, |_| ()).unwrap();
    publish(&store, &about(), &two, |_| ()).unwrap();
    publish(&store, &about(), &two, |_| ()).unwrap();
    let [one_files, two_files] = [&one, &two].map(|folder| read(folder));
    assert_eq!(one_files.keys().collect::<Vec<_>>(), two_files.keys().collect::<Vec<_>>());
    for (path, text) in &one_files {
        assert!(*text == two_files[path], "{path} differs");
        assert!(!text.contains(root.path().to_str().unwrap()), "{path} names the machine");
    }
}

#[test]
fn a_page_says_what_is_known_and_how_it_came_to_be() {
    let site = site();
    let page = &site.files["material/fitted.html"];
    for words in [
        "4π·f·cos²θ",
        "1 of them (1.6 %) gave no detection",
        "(1 − k) · f_lambda",
        "k · r_s",
        "only inside S",
        "no: held at this value",
        "The true reflectivity of the paint",
        "@misc{matdb-fitted-1",
        "What this fit cannot promise",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(page.contains("class=\"band") && page.contains("id=\"residuals-0-title\""));
    for path in ["k", "specular.f_lambda", "diffuse.r_s"] {
        let row = page.split(&format!("<code>{path}</code>")).nth(1).unwrap();
        let row = row.split("</tr>").next().unwrap();
        assert!(
            row.contains("is-convention\">convention<") && !row.contains("is-measured"),
            "{row}"
        );
    }
    let kinds = ["measured", "literature", "modelled", "synthetic"];
    for material in materials() {
        let html = &site.files[&format!("material/{}.html", material.slug)];
        let sources = html.split("<table class=\"sources\">").nth(1).unwrap();
        let sources = sources.split("</table>").next().unwrap();
        for kind in kinds {
            let badge = format!("<span class=\"badge is-{kind}\">{kind}</span>");
            let stated = material.sources.iter().filter(|s| s.kind.as_str() == kind).count();
            assert_eq!(sources.matches(&badge).count(), stated, "{} {kind}", material.slug);
        }
        assert!(html.contains(&format!("../api/v1/materials/{}.json", material.slug)));
    }
    assert_eq!(builtin::get("ptfe").unwrap().unwrap().render_kind(), Some(SourceKind::Synthetic));
}

#[test]
fn a_page_says_what_a_material_is_made_of_and_what_was_tried_on_it() {
    let site = site();
    let page = &site.files["material/complete.html"];
    for words in [
        "This entry is superseded.",
        "#q=better%2Dpaint",
        "Finish: <bdi>sprayed</bdi>",
        "20 µm rms, correlated over 300 µm, profilometer",
        "<td>0.1</td><td><bdi>acrylate</bdi></td>",
        "half space",
        "2.62 ± 0.02",
        "<td>22</td>",
        "2026-03-14, at 22 °C, humidity 40 %",
        "threshold −76.99 dBm",
        "looked for, not found",
        "The thickness of the fibre.",
    ] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn what_was_stated_beside_a_curve_is_not_called_a_fit() {
    let mut material = fitted("stated");
    material.fits[0].report = None;
    material.fits[0].estimator = "stated".to_owned();
    let path = material.fits[0].covariance.as_ref().unwrap().parameters[0].clone();
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("a.sqlite")).unwrap();
    store.add([&material]).unwrap();
    publish(&store, &about(), &folder.path().join("site"), |_| ()).unwrap();
    let page = fs::read_to_string(folder.path().join("site/material/stated.html")).unwrap();
    assert!(page.contains("stated beside the curve <bdi>scan</bdi>, not fitted to it"));
    assert!(!page.contains("fitted to the curve"));
    assert_eq!(path, "k");
    let row = page.split("<code>k</code>").nth(1).unwrap().split("</tr>").next().unwrap();
    assert!(row.contains("only inside S and R; this value is a convention"), "{row}");
    let index = fs::read_to_string(folder.path().join("site/index/1.js")).unwrap();
    assert!(index.contains("\"fitted\":false"));
    let list = fs::read_to_string(folder.path().join("site/list/1.html")).unwrap();
    for text in [&page, &index, &list] {
        assert!(text.contains("stated beside modelled data"), "{text}");
        assert!(!text.contains("fitted to modelled data"), "{text}");
    }
}

#[test]
fn a_fit_is_called_one_wherever_its_kind_stands() {
    let site = site();
    for path in ["material/fitted.html", "index/1.js", "list/1.html", "data/fitted.js"] {
        assert!(site.files[path].contains("fitted to modelled data"), "{path}");
    }
    for path in ["material/ptfe.html", "data/ptfe.js"] {
        assert!(!site.files[path].contains("fitted to "), "{path}");
    }
}

/// Power of a ring of the sphere on a material's page, dBm.
fn on_the_sphere(page: &str, angle: &str) -> f64 {
    let title = page.split(&format!("<title>{angle}°: ")).nth(1).expect(angle);
    title.split(" dBm").next().unwrap().replace('−', "-").parse().unwrap()
}

#[test]
fn the_sphere_of_a_page_has_the_powers_that_the_renderer_gives() {
    /// A tenth for the rounding of the page, and as much for chirps beside the axis.
    const POWER_DB: f64 = 0.2;
    let site = site();
    let folder = tempfile::tempdir().unwrap();
    for name in ["mannequin-paint", "ptfe", "cotton", "aluminium"] {
        let page = &site.files[&format!("material/{name}.html")];
        for (angle, tilt_deg) in [("0.9", 0.875), ("13", 13.0), ("31", 31.0)] {
            let scene = format!(
                "name = \"plate\"\n[radar]\nthreshold_dbm = -150\n[radar.scan]\npattern = \"raster\"\nlines = 3\n\
                 chirps_per_line = 3\nwidth_m = 0.004\nheight_m = 0.004\n[[mesh]]\nname = \"plate\"\n\
                 file = \"builtin:plate\"\nsize_m = [0.3, 0.3, 0]\nrotation_deg = [0, {tilt_deg}, 0]\n\
                 translation_m = [0, 1.1, 0]\n[[region]]\nname = \"plate\"\nmaterial = \"{name}\"\n"
            );
            fs::write(folder.path().join("plate.toml"), scene).unwrap();
            matdb(folder.path()).args(["render", "plate.toml", "-o", "out"]).assert().success();
            let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
            let powers = &cloud["power_dbm"];
            let rendered_dbm = powers.iter().sum::<f64>() / powers.len() as f64;
            let drawn_dbm = on_the_sphere(page, angle);
            assert!(
                (drawn_dbm - rendered_dbm).abs() < POWER_DB,
                "{name} at {angle}°: {drawn_dbm}, {rendered_dbm}"
            );
        }
    }
}

#[test]
fn a_page_says_how_to_go_on_with_commands_that_work() {
    let site = site();
    let page = &site.files["material/cotton.html"];
    let shell = page.split("id=\"use-shell\">").nth(1).unwrap().split("</code>").next().unwrap();
    let mut lines = 0;
    for line in shell.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let ["matdb", "--db", "catalogue.sqlite", rest @ ..] = &words[..] else { panic!("{line}") };
        matdb(&site.folder).args(["--db", "catalogue.sqlite"]).args(rest).assert().success();
        lines += 1;
    }
    assert_eq!(lines, 2);
    assert!(page.contains("md.open(&quot;catalogue.sqlite&quot;)[&quot;cotton@1&quot;]"));
}

#[test]
fn a_fit_is_called_one_outside_the_site_too() {
    let mut material = refitted(fitted("fitted"));
    material.sources.iter_mut().for_each(|source| source.kind = SourceKind::Measured);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    let mut store = Store::open(&path).unwrap();
    store.add([&material, &builtin::get("ptfe").unwrap().unwrap()]).unwrap();
    let words = "fitted to measured data".to_owned();
    assert_eq!(material.rendered_words().as_ref(), Some(&words));
    let slugs = [material.slug.clone(), "ptfe".parse().unwrap(), "absent".parse().unwrap()];
    let listed = store.rendered_words(&slugs).unwrap();
    assert_eq!(listed, BTreeMap::from([(material.slug.clone(), Some(words))]));
    publish(&store, &about(), &folder.path().join("site"), |_| ()).unwrap();
    let index = fs::read_to_string(folder.path().join("site/api/v1/index.json")).unwrap();
    let index: serde_json::Value = serde_json::from_str(&index).unwrap();
    let [fit, stated] = [&index["materials"][0], &index["materials"][1]];
    assert_eq!(
        (&fit["render_kind"], &fit["render_words"]),
        (&"measured".into(), &"fitted to measured data".into())
    );
    assert!(stated.get("render_words").is_none(), "{stated}");
    let said = |arguments: &[&str]| {
        let output =
            matdb(folder.path()).args(["--db", "a.sqlite"]).args(arguments).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    // As many angles as a distance needs.
    let curve = "theta_deg,sigma0_db\n0,-3\n5,-5\n10,-8\n15,-11\n20,-13\n25,-15\n30,-17\n";
    fs::write(folder.path().join("probe.csv"), curve).unwrap();
    for arguments in [&["list"][..], &["near", "--curve", "probe.csv", "--limit", "100"]] {
        let said = said(arguments);
        let line = said.lines().find(|line| line.starts_with("fitted ")).unwrap_or(&said);
        assert!(line.contains("fitted to measured data"), "{said}");
    }
    for (format, file) in [("csv", "out.csv"), ("mitsuba", "out.xml")] {
        said(&["export", "fitted", "--as", format, "-o", file]);
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        let words = "the rendered numbers are fitted to measured data;";
        assert!(text.contains(words), "{file}: {text}");
    }
}

#[test]
fn a_comparison_draws_what_scenes_render_and_a_stated_model_as_one() {
    let mut material = fitted("stated");
    material.fits[0].report = None;
    material.fits[0].estimator = "stated".to_owned();
    material.sources.iter_mut().for_each(|source| source.kind = SourceKind::Measured);
    let by_points =
        Material { slug: "points".parse().unwrap(), render: "scan".to_owned(), ..material.clone() };
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("a.sqlite")).unwrap();
    store.add([&material, &by_points]).unwrap();
    publish(&store, &about(), &folder.path().join("site"), |_| ()).unwrap();
    let fit = &material.fits[0].name;
    for (slug, rendered) in [("stated", fit.as_str()), ("points", "scan")] {
        let data = fs::read_to_string(folder.path().join(format!("site/data/{slug}.js"))).unwrap();
        let json = data.split_once('(').unwrap().1.rsplit_once(')').unwrap().0;
        let data: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(data["render"], rendered);
        let line = |name: &str| {
            data["lines"].as_array().unwrap().iter().find(|line| line["name"] == name).cloned()
        };
        let stated = line(fit).unwrap();
        assert_eq!(
            (&stated["kind"], &stated["kind_words"]),
            (&"stated".into(), &"stated beside measured data".into())
        );
        assert!(!line(rendered).unwrap()["pieces"].as_array().unwrap().is_empty(), "{slug}");
        let page = fs::read_to_string(folder.path().join(format!("site/material/{slug}.html")));
        assert_eq!(page.unwrap().contains("between the points"), slug == "points");
    }
    let style = fs::read_to_string(folder.path().join("site/assets/style.css")).unwrap();
    assert!(style.contains(".line.is-stated { stroke-dasharray"));
}

#[test]
fn points_are_in_the_table_for_other_programs() {
    let site = site();
    let mut reader = csv::Reader::from_reader(site.files["material/fitted.csv"].as_bytes());
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|column| column == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 63);
    let number = |row: usize, name: &str| rows[row][column(name)].parse::<f64>().unwrap();
    assert!((number(0, "sigma0_db") - 10.0 * 2.5f64.log10()).abs() < 1e-4);
    assert!((number(1, "theta_deg") - 0.5f64.to_degrees()).abs() < 1e-6);
    assert_eq!((&rows[2][column("sigma0_db")], &rows[2][column("censor")]), ("", "left"));
    assert!((number(0, "power_dbm") + 70.0).abs() < 1e-4);
}

#[test]
fn many_materials_are_read_in_portions() {
    let root = tempfile::tempdir().unwrap();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    let ptfe = builtin::get("ptfe").unwrap().unwrap();
    let numbered =
        |number: usize| Material { slug: format!("m{number:04}").parse().unwrap(), ..ptfe.clone() };
    let all: Vec<Material> = (0..1001).map(numbered).collect();
    store.add(&all).unwrap();
    let folder = root.path().join("site");
    publish(&store, &About::default(), &folder, |_| ()).unwrap();
    let index = fs::read_to_string(folder.join("index.html")).unwrap();
    assert!(index.contains("data-portions=\"3\""));
    let entries = |number: usize| {
        let text = fs::read_to_string(folder.join(format!("index/{number}.js"))).unwrap();
        text.matches("\"slug\":").count()
    };
    assert_eq!([1, 2, 3].map(entries), [500, 500, 1]);
    let last = fs::read_to_string(folder.join("list/3.html")).unwrap();
    assert!(last.contains("m1000.html") && last.contains("href=\"2.html\""));
}

#[test]
fn an_empty_catalogue_says_so() {
    let root = tempfile::tempdir().unwrap();
    let store = Store::open(root.path().join("a.sqlite")).unwrap();
    let folder = root.path().join("site");
    publish(&store, &About::default(), &folder, |_| ()).unwrap();
    let list = fs::read_to_string(folder.join("list/1.html")).unwrap();
    assert!(list.contains("There is no material"));
}
