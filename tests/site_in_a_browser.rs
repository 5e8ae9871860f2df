//! Promise: in a real browser, from a folder and from a web server, a published site can be searched,
//! filtered, compared and downloaded from, by mouse and by keyboard alone; it says nothing on the
//! console and asks nobody else for anything.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::support::browser::{Browser, ENTER, SPACE, TAB};
use crate::support::database::{fitted, refitted, sample};
use crate::support::server::serve;
use matdb::adopt::publish;
use matdb::catalogue::About;
use matdb::material::{Material, SourceKind, builtin};
use matdb::store::Store;
use serde_json::json;

const COUNT: &str = "return document.getElementById('count').textContent";
const NAMES: &str =
    "return [...document.querySelectorAll('#results h2')].map(e => e.textContent).join('|')";

/// Some of the built-in materials, so that a person could count what the tests count.
const BUILT_IN: [&str; 6] =
    ["aluminium", "cotton", "glass", "human-skin", "mannequin-paint", "ptfe"];

/// A site of built-in materials, one measured and fitted, and one that means harm.
struct Site {
    folder: PathBuf,
    root: tempfile::TempDir,
}

/// Names a publication of all built-in materials to look at instead of one made here.
const EXAMPLE: &str = "MATDB_EXAMPLE_SITE";

/// All built-in materials, as the example catalogue has them.
fn example() -> Site {
    let root = tempfile::tempdir().unwrap();
    if let Some(folder) = std::env::var_os(EXAMPLE) {
        let folder =
            std::fs::canonicalize(&folder).expect("the folder that MATDB_EXAMPLE_SITE names");
        return Site { folder, root };
    }
    let materials: Vec<Material> =
        builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    store.add(&materials).unwrap();
    let folder = root.path().join("site");
    publish(&store, &About::default(), &folder, |_| ()).unwrap();
    Site { folder, root }
}

fn site() -> Site {
    let root = tempfile::tempdir().unwrap();
    let mut materials: Vec<Material> =
        BUILT_IN.iter().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    let mut measured = refitted(fitted("measured-plate"));
    measured.name = "Plate on the bench".to_owned();
    let source = measured.curves[0].source.clone();
    let source = measured.sources.iter_mut().find(|known| known.key == source).unwrap();
    source.kind = SourceKind::Measured;
    let mut hostile = sample("hostile");
    hostile.name =
        "<script>window.hurt = 1</script><img src=x onerror=\"window.hurt = 2\">".to_owned();
    hostile.class = "<b>class</b>".to_owned();
    hostile.tags = vec!["\"><script>window.hurt = 3</script>".to_owned()];
    hostile.description = "</script><script>window.hurt = 4</script>\u{202e}".to_owned();
    materials.extend([measured, hostile]);
    let mut store = Store::open(root.path().join("a.sqlite")).unwrap();
    store.add(&materials).unwrap();
    let folder = root.path().join("a site");
    publish(&store, &About::default(), &folder, |_| ()).unwrap();
    Site { folder, root }
}

impl Site {
    fn address(&self, page: &str) -> String {
        format!("file://{}/{page}", self.folder.display()).replace(' ', "%20")
    }

    fn browser(&self) -> Option<Browser> {
        Browser::start(self.root.path())
    }
}

/// The index with all its parts read.
fn open_index(browser: &Browser, address: &str) {
    browser.open(address);
    browser.wait("return /^\\d+ materials$/.test(document.getElementById('count').textContent)");
}

/// Nothing was said, and nothing was asked for but the site.
fn was_quiet(browser: &Browser, root: &str) {
    assert_eq!(browser.console(), Vec::<String>::new());
    for address in browser.requests() {
        // The browser's own first page is none of ours.
        let own = [root, "data:", "about:", "chrome:", "chrome-untrusted:"];
        assert!(own.iter().any(|start| address.starts_with(start)), "{address} was asked for");
    }
}

fn type_into(browser: &Browser, selector: &str, text: &str) {
    browser.click(selector);
    browser.press(text);
}

fn choose(browser: &Browser, id: &str, value: &str) {
    browser.script(&format!(
        "const s = document.getElementById('{id}'); s.value = {}; \
         s.dispatchEvent(new Event('input', {{ bubbles: true }}))",
        json!(value)
    ));
}

fn search_and_filter(browser: &Browser, root: &str) {
    open_index(browser, &format!("{root}/index.html"));
    assert_eq!(browser.text(COUNT), "8 materials");
    type_into(browser, "#q", "polymer ptfe");
    browser.wait("return document.getElementById('count').textContent === '1 of 8 materials'");
    assert_eq!(browser.text(NAMES), "PTFE, machined block");
    assert!(browser.text("return location.hash").contains("q=polymer"));
    browser.reload();
    browser.wait("return document.getElementById('count').textContent === '1 of 8 materials'");
    browser.click("button[type=reset]");
    browser.wait("return document.getElementById('count').textContent === '8 materials'");
    choose(browser, "measured", "yes");
    browser.wait("return document.getElementById('count').textContent === '1 of 8 materials'");
    assert_eq!(browser.text(NAMES), "Plate on the bench");
    let badge = "return document.querySelector('#results .badge').textContent";
    assert_eq!(browser.text(badge), "fitted to measured data");
    choose(browser, "fitted", "yes");
    browser.wait("return document.getElementById('count').textContent === '1 of 8 materials'");
    assert_eq!(browser.text(NAMES), "Plate on the bench");
    choose(browser, "fitted", "no");
    browser.wait("return /^0 of 8/.test(document.getElementById('count').textContent)");
    browser.click("button[type=reset]");
    browser.wait("return document.getElementById('count').textContent === '8 materials'");
    choose(browser, "class", "metal");
    browser.wait("return document.querySelectorAll('#results > li').length === 1");
    choose(browser, "class", "");
    type_into(browser, "#ghz", "12");
    browser.wait("return /^0 of 8/.test(document.getElementById('count').textContent)");
    browser.press("x");
    browser.wait("return document.getElementById('ghz-wrong').textContent.includes('12x')");
    was_quiet(browser, root);
}

fn compare(browser: &Browser, root: &str) {
    open_index(browser, &format!("{root}/index.html"));
    browser.click("input[value=ptfe]");
    browser.click("input[value=measured-plate]");
    assert_eq!(
        browser.text("return document.getElementById('compare').textContent"),
        "Compare 2 chosen"
    );
    browser.click("#compare");
    browser.wait("return document.querySelectorAll('#values thead th').length === 3");
    let count = |selector: &str| {
        browser.script(&format!("return document.querySelectorAll('{selector}').length"))
    };
    assert_eq!(count("#plot svg[role=img] > title"), json!(1));
    assert_eq!((count("#plot path.mark"), count("#plot path.dots")), (json!(1), json!(1)));
    assert!(count("#plot path.line").as_u64() >= Some(2));
    for place in ["#chosen li", "#values thead th"] {
        let badge =
            format!("return document.querySelector('{place}:last-child .badge').textContent");
        assert_eq!(browser.text(&badge), "fitted to measured data", "{place}");
    }
    type_into(browser, "#add", "glass");
    browser.wait("return !!document.querySelector('#matches [data-slug=glass]')");
    browser.click("#matches [data-slug=glass]");
    browser.wait("return document.querySelectorAll('#values thead th').length === 4");
    assert_eq!(browser.text("return location.hash"), "#m=ptfe,measured-plate,glass");
    browser.click("#chosen li:first-child button");
    browser.wait("return document.querySelectorAll('#values thead th').length === 3");
    was_quiet(browser, root);
    browser.open(&format!("{root}/compare.html#m=nothing-here,glass,../../x,%3Cb%3E"));
    browser.wait("return document.querySelectorAll('#values thead th').length === 2");
    assert!(
        browser
            .text("return document.getElementById('chosen').textContent")
            .contains("no material nothing-here")
    );
    browser.console();
}

fn downloads(site: &Site, browser: &Browser, root: &str) {
    browser.open(&format!("{root}/material/measured-plate.html"));
    browser.click("#downloads a[href$='.csv']");
    let wanted = std::fs::read(site.folder.join("material/measured-plate.csv")).unwrap();
    arrives(&site.root.path().join("measured-plate.csv"), &wanted);
    browser.open(&format!("{root}/material/measured-plate.html"));
    browser.click("#downloads a[href$='.json']");
    let path = "api/v1/materials/measured-plate.json";
    let wanted = std::fs::read(site.folder.join(path)).unwrap();
    if root.starts_with("http") {
        arrives(&site.root.path().join("measured-plate.json"), &wanted);
    } else {
        // From a folder a browser shows it instead.
        browser.wait("return location.pathname.endsWith('.json') || document.title.length > 0");
    }
    was_quiet(browser, root);
}

fn arrives(path: &Path, wanted: &[u8]) {
    let start = Instant::now();
    while !std::fs::read(path).is_ok_and(|bytes| bytes == wanted) {
        assert!(start.elapsed() < Duration::from_secs(20), "{} never arrives", path.display());
        std::thread::sleep(Duration::from_millis(50));
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn from_a_folder() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    let root = site.address("").trim_end_matches('/').to_owned();
    search_and_filter(&browser, &root);
    compare(&browser, &root);
    downloads(&site, &browser, &root);
}

#[test]
fn from_a_web_server() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    let root = serve(&site.folder);
    search_and_filter(&browser, &root);
    compare(&browser, &root);
    downloads(&site, &browser, &root);
}

#[test]
fn by_keyboard_alone() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    open_index(&browser, &site.address("index.html"));
    browser.press(TAB);
    assert_eq!(browser.text("return document.activeElement.className"), "skip");
    browser.press(ENTER);
    assert_eq!(browser.text("return document.activeElement.id"), "main");
    browser.tab_to("#q");
    browser.press("tissue");
    browser.wait("return document.querySelectorAll('#results > li').length === 1");
    browser.tab_to("#results input");
    browser.press(SPACE);
    browser.wait("return document.getElementById('compare').textContent === 'Compare 1 chosen'");
    open_index(&browser, &site.address("index.html"));
    browser.tab_to("#q");
    browser.press("ptfe");
    browser.wait("return document.querySelectorAll('#results > li').length === 1");
    browser.tab_to("#results a");
    browser.press(ENTER);
    browser.wait("return location.pathname.endsWith('/material/ptfe.html')");
    browser.tab_to("a[href='../compare.html#m=ptfe']");
    browser.press(ENTER);
    browser.wait("return document.querySelectorAll('#values thead th').length === 2");
    browser.tab_to("#add");
    browser.press("alu");
    browser.wait("return document.querySelectorAll('#matches button').length === 1");
    browser.tab_to("#matches button");
    browser.press(ENTER);
    browser.wait("return document.querySelectorAll('#values thead th').length === 3");
    browser.tab_to("#values");
    was_quiet(&browser, &site.address(""));
}

#[test]
fn hostile_text_is_shown_and_not_run() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    for page in ["index.html", "material/hostile.html", "list/1.html", "compare.html#m=hostile"] {
        browser.open(&site.address(page));
        browser.wait("return document.body.innerText.includes('<script>window.hurt = 1</script>')");
        assert!(browser.script("return window.hurt ?? null").is_null(), "{page}");
        let tags = "return document.querySelectorAll('img, main b, main script').length";
        assert_eq!(browser.script(tags), json!(0), "{page}");
    }
    was_quiet(&browser, &site.address(""));
}

#[test]
fn nothing_is_wider_than_a_small_phone() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    let metrics = json!({ "width": 320, "height": 640, "deviceScaleFactor": 1, "mobile": true });
    browser.cdp("Emulation.setDeviceMetricsOverride", &metrics);
    for page in [
        "index.html",
        "material/measured-plate.html",
        "material/hostile.html",
        "list/1.html",
        "compare.html#m=ptfe,hostile",
    ] {
        browser.open(&site.address(page));
        browser.wait("return document.readyState === 'complete'");
        std::thread::sleep(Duration::from_millis(200));
        let width = browser.script("return document.documentElement.scrollWidth");
        assert!(width.as_u64() <= Some(320), "{page} is {width} px wide");
    }
}

/// Width and height of a screen.
fn screen(browser: &Browser, width: u32, height: u32) {
    let metrics =
        json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
    browser.cdp("Emulation.setDeviceMetricsOverride", &metrics);
}

#[test]
fn a_plot_says_its_values_to_the_pointer_and_to_the_arrow_keys() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    browser.open(&site.address("material/ptfe.html"));
    let table = "return [...document.querySelectorAll('table')].find(t => t.caption.textContent.startsWith('Levels')).rows[1].cells[1].textContent";
    let (facing, said) =
        (browser.text(table), "return document.querySelector('.readout').textContent");
    browser.tab_to("svg.plot");
    browser.press("\u{e014}");
    let first = browser.text(said);
    assert!(
        first.starts_with("0.0°") && first.ends_with(&facing),
        "{first}, and {facing} in the table"
    );
    browser.press("\u{e014}\u{e014}");
    assert_ne!(browser.text(said), first);
    browser.script(
        "const svg = document.querySelector('svg.plot'), box = svg.getBoundingClientRect(); \
         svg.dispatchEvent(new PointerEvent('pointermove', { clientX: box.left + box.width / 2, \
         clientY: box.top + box.height / 2 }))",
    );
    let middle = browser.text(said);
    assert!(middle.contains("stated −") && !middle.starts_with("0.0°"), "{middle}");
    // A detection near the pointer is named with its place.
    browser.open(&site.address("material/cotton.html"));
    browser.script(
        "const dots = document.querySelector('svg.plot .dots'); \
         const [, x, y] = dots.getAttribute('d').match(/M([\\d.]+) ([\\d.]+)/).map(Number); \
         const at = new DOMPoint(x, y).matrixTransform(dots.getScreenCTM()); \
         dots.ownerSVGElement.dispatchEvent(new PointerEvent('pointermove', { clientX: at.x, clientY: at.y }))",
    );
    let near = browser.text(said);
    assert!(near.contains("backscatter, point at 0.0°: −5.8"), "{near}");
    was_quiet(&browser, &site.address(""));
}

#[test]
fn the_first_screen_of_a_comparison_shows_the_plot_with_the_names_at_its_curves() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    screen(&browser, 1280, 800);
    browser.open(&site.address("compare.html#m=ptfe,glass,cotton,aluminium"));
    browser.wait("return document.querySelectorAll('#plot .name').length === 4");
    let bottom = "return document.querySelector('#plot svg').getBoundingClientRect().bottom";
    let bottom = browser.script(bottom).as_f64().unwrap();
    assert!(bottom <= 800.0, "the plot ends at {bottom} px");
    for (width, height) in [(1280, 800), (390, 844)] {
        screen(&browser, width, height);
        browser.reload();
        browser.wait("return document.querySelectorAll('#plot .name').length === 4");
        // Names neither touch each other nor any curve, and none is cut off by the edge.
        let free = browser.script(
            "const box = e => e.getBoundingClientRect(), svg = document.querySelector('#plot svg'); \
             const names = [...svg.querySelectorAll('.name')].map(box).sort((a, b) => a.top - b.top); \
             const right = Math.max(...[...svg.querySelectorAll('.line, .dots, .mark')].map(e => box(e).right)); \
             return names.every((b, i) => b.left > right && b.right <= box(svg).right + 1 && b.width > 20 \
             && (i === 0 || b.top >= names[i - 1].top + 0.6 * b.height))",
        );
        assert_eq!(free, json!(true), "{width} px");
        let ticks = browser.script("return document.querySelectorAll('#plot .tick').length");
        assert!(ticks.as_u64() >= Some(8), "{ticks}");
    }
}

#[test]
fn a_phone_shows_that_a_table_goes_on() {
    let site = site();
    let Some(browser) = site.browser() else { return };
    screen(&browser, 390, 844);
    browser.open(&site.address("material/measured-plate.html"));
    let wide = "return [...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth + 8).length";
    assert!(browser.script(wide).as_u64() > Some(0), "no table is wider than the phone");
    // Two covers that move with the table over two shadows that stay.
    let attached =
        "return getComputedStyle(document.querySelector('.scroll')).backgroundAttachment";
    assert_eq!(browser.text(attached), "local, local, scroll, scroll");
    let hidden = "return [...document.querySelectorAll('.scroll td, .scroll th, .scroll table')].filter(e => \
                  !/rgba\\(0, 0, 0, 0\\)/.test(getComputedStyle(e).backgroundColor)).length";
    assert_eq!(browser.script(hidden), json!(0), "no cell hides the shadows");
}

#[test]
fn every_page_of_the_example_catalogue_works_and_is_quiet() {
    let site = example();
    let Some(browser) = site.browser() else { return };
    let root = site.address("").trim_end_matches('/').to_owned();
    let names: Vec<&str> = builtin::names().collect();
    open_index(&browser, &format!("{root}/index.html"));
    assert_eq!(browser.text(COUNT), format!("{} materials", names.len()));
    type_into(&browser, "#q", "ptfe");
    browser.wait("return / of \\d+ materials$/.test(document.getElementById('count').textContent)");
    assert!(browser.text(NAMES).contains("PTFE"), "{}", browser.text(NAMES));
    for name in &names {
        browser.open(&format!("{root}/material/{name}.html"));
        browser.wait("return document.querySelectorAll('main svg path.line').length > 0");
        let cited = "return document.getElementById('cite').textContent";
        assert!(browser.text(cited).contains(name), "{name} does not say how to cite it");
    }
    open_index(&browser, &format!("{root}/index.html"));
    browser.click("input[value=ptfe]");
    browser.click("input[value=glass]");
    browser.click("#compare");
    browser.wait("return document.querySelectorAll('#values thead th').length === 3");
    browser.open(&format!("{root}/material/ptfe.html"));
    browser.click("#downloads a[href$='.csv']");
    let wanted = std::fs::read(site.folder.join("material/ptfe.csv")).unwrap();
    arrives(&site.root.path().join("ptfe.csv"), &wanted);
    was_quiet(&browser, &root);
}
