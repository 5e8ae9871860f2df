//! Promise: `view.html` shows the cloud of a rendering, of a diagnosis or of a catalogue in a real browser, from a folder: its points, their
//! columns, thresholds and picked points; it says nothing on the console and asks for nothing else.

use std::fs;
use std::path::Path;

use matdb::adopt::publish;
use matdb::catalogue::About;
use matdb::material::{Material, builtin};
use matdb::store::Store;
use serde_json::{Value, json};

use crate::support::browser::Browser;
use crate::support::{matdb, read_cloud, scene};

const SHOWN: &str = "return window.matdbView.shown()";

/// Opens the page and waits until it is drawn.
fn open(browser: &Browser, path: &Path) {
    browser.open(&format!("file://{}", path.display()));
    browser.script("window.matdbView.ready.then(() => { window.isReady = true })");
    browser.wait("return window.isReady === true");
}

/// Nothing was said, and nothing was asked for but the page.
fn was_quiet(browser: &Browser) {
    assert_eq!(browser.console(), Vec::<String>::new());
    for address in browser.requests() {
        let own = ["file:", "data:", "about:", "chrome:", "chrome-untrusted:", "blob:"];
        assert!(own.iter().any(|start| address.starts_with(start)), "{address} was asked for");
    }
}

/// Sends the scene mouse events: type, pixel, button and the buttons that are down.
const SEND: &str = "const cloud = document.querySelector('#cloud'); \
    const { left, top } = cloud.getBoundingClientRect(); \
    const send = (type, x, y, button, buttons) => cloud.dispatchEvent(new PointerEvent(type, \
    { pointerId: 1, pointerType: 'mouse', clientX: left + x, clientY: top + y, button, buttons }));";

/// A right button whose release went to a menu does not turn the scene.
fn stays_when_a_menu_takes_the_release(browser: &Browser) {
    let moves = "send('pointerdown', 100, 100, 2, 2); send('pointermove', 150, 100, -1, 0); \
                 send('pointermove', 200, 100, -1, 0); return window.matdbView.state().camera";
    assert_eq!(browser.script(&format!("{SEND} {moves}")), Value::Null);
}

/// Graphics memory that the browser takes and gives back holds the scene again: a click finds a point.
fn returns_after_lost_graphics(browser: &Browser, [x, y]: [f64; 2]) {
    let lost = "return !document.querySelector('#lost').hidden";
    browser.script(
        "const graphics = document.querySelector('#cloud').getContext('webgl2'); \
         window.memory = graphics.getExtension('WEBGL_lose_context'); window.memory.loseContext()",
    );
    browser.wait(lost);
    browser.script("window.memory.restoreContext()");
    browser.wait(&lost.replace('!', ""));
    // Not before the next frame.
    browser.wait(&format!(
        "{SEND} window.matdbView.pick(null); send('pointerdown', {x}, {y}, 0, 1); \
         send('pointerup', {x}, {y}, 0, 0); return window.matdbView.state().point !== null"
    ));
}

#[test]
fn a_rendering_is_shown_in_three_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let Some(browser) = Browser::in_three_dimensions(folder.path()) else { return };
    let out = folder.path().join("out");
    let mut render = matdb(folder.path());
    render.arg("render").arg(scene("concealed.toml")).arg("--view").arg("-o").arg(&out);
    render.assert().success();
    let cloud = read_cloud(&out.join("cloud.ply"));
    let powers = &cloud["power_dbm"];
    let page = std::fs::read_to_string(out.join("view.html")).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://"));

    open(&browser, &out.join("view.html"));
    let number = |script: &str| browser.script(script);
    assert_eq!(number(SHOWN), json!(powers.len()));
    // A threshold shows the points above it, and the address keeps it.
    let middle = {
        let mut sorted = powers.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2] + 1e-3
    };
    browser.script("window.matdbView.setColumn('power_dbm')");
    browser.script(&format!("window.matdbView.setThreshold({middle}, Infinity)"));
    let above = powers.iter().filter(|power| **power > middle).count();
    assert_eq!(number(SHOWN), json!(above));
    browser.wait("return location.hash.length > 1");
    browser.reload();
    browser.script("window.matdbView.ready.then(() => { window.isReady = true })");
    browser.wait("return window.isReady === true");
    assert_eq!(number(SHOWN), json!(above));
    // A picked point says what the file has of it, and is drawn where it should be.
    let brightest = (0..powers.len()).max_by(|a, b| powers[*a].total_cmp(&powers[*b])).unwrap();
    browser.script(&format!("window.matdbView.pick({brightest})"));
    let said = browser.text("return document.body.innerText");
    assert!(said.contains("mannequin-paint") && said.contains("skin"), "{said}");
    // Six digits of it, of which three are the same however they are rounded.
    let digits = (10.0 * powers[brightest].abs()).floor() / 10.0;
    assert!(said.contains(&format!("{digits:.1}")), "{digits}: {said}");
    let [x, y] = [0, 1].map(|at| {
        browser
            .script(&format!("return window.matdbView.pixelOf({brightest})[{at}]"))
            .as_f64()
            .unwrap()
    });
    let [wide, high] = ["Width", "Height"].map(|side| {
        let script = format!("return document.querySelector('canvas').client{side}");
        browser.script(&script).as_f64().unwrap()
    });
    assert!((0.0..wide).contains(&x) && (0.0..high).contains(&y), "{x} {y} of {wide} {high}");
    stays_when_a_menu_takes_the_release(&browser);
    returns_after_lost_graphics(&browser, [x, y]);
    was_quiet(&browser);
}

#[test]
fn a_catalogue_leads_from_a_material_to_its_ball() {
    let folder = tempfile::tempdir().unwrap();
    let Some(browser) = Browser::in_three_dimensions(folder.path()) else { return };
    let mut store = Store::in_memory().unwrap();
    let names = ["aluminium", "cotton", "mannequin-paint"];
    let materials: Vec<Material> =
        names.iter().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    store.add(&materials).unwrap();
    let site = folder.path().join("site");
    publish(&store, &About::default(), &site, |_| ()).unwrap();
    browser.open(&format!("file://{}", site.join("material/cotton.html").display()));
    browser.click(".actions a[href^='../view.html']");
    browser.wait("return !!window.matdbView");
    browser.script("window.matdbView.ready.then(() => { window.isReady = true })");
    browser.wait("return window.isReady === true");
    // The camera looks at the ball whose name is cotton's.
    let camera = browser.script("return window.matdbView.state().camera");
    let page = fs::read_to_string(site.join("view.html")).unwrap();
    let data = page.split_once("id=\"view\">").unwrap().1.split_once("</script>").unwrap().0;
    let data: Value = serde_json::from_str(data).unwrap();
    let labels = data["balls"]["labels"].as_array().unwrap();
    let label = &labels.iter().find(|label| label[0] == "cotton").unwrap()[1];
    let off = |at: usize| camera[3 + at].as_f64().unwrap() - label[at].as_f64().unwrap();
    assert!(off(0).abs() < 1e-3 && (0.0..0.1).contains(&off(1)), "{camera} {label}");
    was_quiet(&browser);
    browser.click("nav a[href='index.html']");
    browser.wait("return document.querySelectorAll('#results h2').length === 3");
}

/// The whole residual map before and after, on a screen of 1280 × 800.
fn the_first_screen_shows_the_map(browser: &Browser, report: &Path) {
    let screen = json!({ "width": 1280, "height": 800, "deviceScaleFactor": 1, "mobile": false });
    browser.cdp("Emulation.setDeviceMetricsOverride", &screen);
    browser.open(&format!("file://{}", report.display()));
    let maps = browser.script(
        "return [...document.querySelector('figure').querySelectorAll('svg')].map(e => { \
         const b = e.getBoundingClientRect(); return [b.top, b.bottom, b.left, b.right]; })",
    );
    let maps = maps.as_array().unwrap();
    assert_eq!(maps.len(), 2, "{maps:?}");
    for place in maps.iter().flat_map(|one| one.as_array().unwrap()) {
        assert!((0.0..=1280.0).contains(&place.as_f64().unwrap()), "{maps:?}");
    }
    assert!(maps.iter().all(|one| one[1].as_f64() <= Some(800.0)), "{maps:?}");
    browser.cdp("Emulation.clearDeviceMetricsOverride", &json!({}));
}

#[test]
fn a_diagnosis_shows_residuals_and_where_its_effects_act() {
    let folder = tempfile::tempdir().unwrap();
    let Some(browser) = Browser::in_three_dimensions(folder.path()) else { return };
    let (out, why) = (folder.path().join("out"), folder.path().join("why"));
    matdb(folder.path())
        .arg("render")
        .arg(scene("concealed.toml"))
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    let mut diagnose = matdb(folder.path());
    let quick = ["--no-controls", "--effects", "foreign-patch", "--scene"];
    diagnose.arg("diagnose").arg(out.join("cloud.ply")).args(quick);
    diagnose.arg(scene("bench.toml")).arg("-o").arg(&why).assert().success();
    let page = std::fs::read_to_string(why.join("report.html")).unwrap();
    assert!(page.contains("href=\"view.html\""));
    the_first_screen_shows_the_map(&browser, &why.join("report.html"));

    open(&browser, &why.join("view.html"));
    let detected = std::fs::read_to_string(why.join("residuals.csv")).unwrap();
    let detected =
        detected.lines().skip(1).filter(|line| line.split(',').nth(1) != Some("")).count();
    assert_eq!(browser.script(SHOWN), json!(detected));
    let said = browser.text("return document.body.innerText");
    assert!(said.contains("foreign-patch: outline"), "{said}");
    for (part, words) in [
        ("#column", "predicted power with the effects, dBm"),
        ("#column", "material"),
        ("#image-note", "Observed − predicted power with the effects, from"),
    ] {
        let said = browser.text(&format!("return document.querySelector('{part}').textContent"));
        assert!(said.contains(words), "{words}: {said}");
    }
    let state: Value = browser.script("return window.matdbView.state()");
    assert!(state.to_string().contains("residual_after_db"), "{state}");
    was_quiet(&browser);

    // A pose that was found draws the mesh where it places the target, until it is switched off; it dims no points at first.
    let page = std::fs::read_to_string(why.join("view.html")).unwrap();
    let moved = json!({
        "label": "pose: target",
        "lines_m": { "f32": "" },
        "ends": [],
        "motion": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.2, 0, 0, 1],
    });
    let shapes = "\"shapes\":[";
    assert_eq!(page.matches(shapes).count(), 1);
    let page = page.replace(shapes, &format!("{shapes}{moved},"));
    std::fs::write(folder.path().join("moved.html"), page).unwrap();
    open(&browser, &folder.path().join("moved.html"));
    let said = browser.text("return document.querySelector('#shapes').innerText");
    assert!(said.contains("pose: target") && said.contains("foreign-patch: outline"), "{said}");
    assert_eq!(browser.script("return window.matdbView.state().dim"), json!(false));
    browser.script("document.querySelector('#shapes input').click()");
    assert_eq!(browser.script("return window.matdbView.state().shapesOff"), json!([0]));
    was_quiet(&browser);
}
