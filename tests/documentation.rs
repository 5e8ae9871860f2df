//! Promise: every command of the README runs as it stands there, and every example file in the docs
//! is accepted.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::{entries, matdb, root};
use matdb::brdf::Scattering;

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap()
}

/// Code blocks of one language.
fn blocks<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    text.split("```")
        .skip(1)
        .step_by(2)
        .filter_map(|block| block.strip_prefix(language)?.strip_prefix('\n'))
        .collect()
}

/// Arguments for the program of every README line that runs it, without comments.
fn commands() -> Vec<Vec<String>> {
    let readme = read("README.md");
    let lines = blocks(&readme, "sh").into_iter().flat_map(str::lines);
    lines
        .filter_map(|line| {
            let line = line.split(" #").next().unwrap_or("").trim();
            line.strip_prefix("matdb ").or(line.strip_prefix("cargo run --release -- "))
        })
        .map(|arguments| arguments.split_whitespace().map(str::to_owned).collect())
        .collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for name in entries(from) {
        match from.join(&name) {
            folder if folder.is_dir() => copy(&folder, &to.join(&name)),
            file => drop(fs::copy(file, to.join(&name)).unwrap()),
        }
    }
}

#[test]
fn every_command_of_the_readme_runs() {
    let folder = tempfile::tempdir().unwrap();
    copy(&root().join("scenes"), &folder.path().join("scenes"));
    let commands = commands();
    assert_eq!(commands.len(), 6, "one to start with and five to go on with: {commands:?}");
    let page = read(MODEL_THAT_MISSES);
    let mut outputs = outputs(&page);
    for arguments in commands {
        let output = matdb(folder.path()).args(&arguments).assert().success().get_output().clone();
        if let Some((_, lines)) = outputs.remove_entry(&format!("matdb {}", arguments.join(" "))) {
            assert_printed(&output.stdout, &lines);
        }
    }
    // The tutorial's own test runs what starts from the scan of another program.
    outputs.retain(|command, _| !command.contains("tests/fixtures"));
    assert!(
        outputs.is_empty(),
        "{MODEL_THAT_MISSES} shows what the README does not run: {outputs:?}"
    );
    for (report, verdict, names) in
        [("nothing", "no-missing-effect", vec![]), ("why", "explained", vec!["foreign-patch"])]
    {
        let text = fs::read(folder.path().join(format!("out/{report}/report.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_slice(&text).unwrap();
        assert_eq!(report["verdict"], verdict);
        let effects = report["effects"].as_array().unwrap();
        assert_eq!(effects.iter().map(|e| e["name"].as_str().unwrap()).collect::<Vec<_>>(), names);
    }
    assert!(folder.path().join("site/SHA256SUMS").exists());
    let made = fs::read(folder.path().join("out/power.png")).unwrap();
    assert!(
        made == fs::read(root().join("docs/mannequin.png")).unwrap(),
        "the README's picture is not what its first command makes; copy out/power.png over it"
    );
}

#[test]
fn the_picture_of_concealed_plates_is_what_its_scene_makes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenes/concealed-object.toml");
    matdb(folder.path()).args(["render", "-q", "-o", "out"]).arg(scene).assert().success();
    let made = fs::read(folder.path().join("out/power.png")).unwrap();
    assert!(
        made == fs::read(root().join("docs/concealed-object.png")).unwrap(),
        "the picture is not what the scene makes; copy out/power.png over it"
    );
}

#[test]
fn a_curve_gets_from_csv_to_a_folder_for_a_web_server_as_the_docs_say() {
    let folder = tempfile::tempdir().unwrap();
    let page = read("docs/publishing.md");
    let (_, own) = page.split_once("## Your own curve").unwrap();
    fs::write(folder.path().join("scan.csv"), blocks(own, "csv")[0]).unwrap();
    let lines = blocks(own, "sh")[0].lines().filter(|line| !line.starts_with("rsync "));
    run_shell(folder.path(), &lines.collect::<Vec<_>>().join("\n")).success();
    let listed = fs::read_dir(folder.path().join("own-site/material")).unwrap().count();
    assert_eq!(listed, 2, "its page and its table, and no other material");
}

/// Runs lines of a shell in `folder`, where `matdb` is the program under test.
fn run_shell(folder: &Path, script: &str) -> assert_cmd::assert::Assert {
    let program = assert_cmd::cargo::cargo_bin("matdb");
    assert_cmd::Command::new("sh")
        .args(["-euc", script])
        .current_dir(folder)
        .env(
            "PATH",
            format!("{}:/usr/local/bin:/usr/bin:/bin", program.parent().unwrap().display()),
        )
        .env_remove("MATDB")
        .assert()
}

/// A folder with what the documentation uses of a clone.
fn clone() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for part in ["scenes", "examples/lab", "tests/fixtures/mitsuba"] {
        copy(&root().join(part), &folder.path().join(part));
    }
    folder
}

#[test]
fn a_laboratory_publishes_its_own_curve_as_the_readme_says() {
    let folder = clone();
    let (readme, page) = (read("README.md"), read("docs/publishing.md"));
    assert_eq!(blocks(&page, "csv")[0], read("examples/lab/scan.csv"));
    assert_eq!(blocks(&page, "toml")[0], read("examples/lab/about.toml"));
    run_shell(folder.path(), blocks(&readme, "bash")[0]).success();
    let front = fs::read_to_string(folder.path().join("own-site/index.html")).unwrap();
    for name in ["Ann Roe", "Terahertz Laboratory at Example University"] {
        assert!(front.contains(name), "{name}");
    }
}

#[test]
fn the_readme_names_the_test_command_and_files_that_exist() {
    let readme = read("README.md");
    assert!(
        blocks(&readme, "sh")
            .iter()
            .any(|block| block.lines().any(|l| l.starts_with("cargo test")))
    );
    for link in readme.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(link.starts_with("https://") || root().join(link).exists(), "{link}");
    }
}

const MODEL_THAT_MISSES: &str = "docs/why-does-my-model-miss.md";

/// The lines that a page says its commands print, by the last command before them. Times and hashes differ.
fn outputs(page: &str) -> BTreeMap<String, Vec<String>> {
    let mut blocks: Vec<&str> = page.split("```").skip(1).step_by(2).collect();
    blocks.retain(|block| !block.starts_with("python\n"));
    let mut outputs = BTreeMap::new();
    for pair in blocks.windows(2) {
        let command = pair[0].strip_prefix("sh\n").and_then(|block| block.lines().last());
        if let Some((command, text)) = command.zip(pair[1].strip_prefix("text\n")) {
            let lasting = text.lines().filter(|line| !line.starts_with("wrote "));
            outputs.insert(command.to_owned(), lasting.map(str::to_owned).collect());
        }
    }
    outputs
}

/// The commands of a tutorial, and the lines that it says they print. Times and hashes differ.
fn tutorial(page: &str) -> (String, Vec<String>) {
    let text = read(page);
    let script = blocks(&text, "sh").concat();
    let lines = blocks(&text, "text").into_iter().flat_map(str::lines);
    let lasting = lines.filter(|line| !line.starts_with("wrote "));
    (script, lasting.map(str::to_owned).collect())
}

fn assert_printed(printed: &[u8], lines: &[String]) {
    let printed = String::from_utf8_lossy(printed);
    for line in lines {
        assert!(printed.contains(line.as_str()), "`{line}` is not in\n{printed}");
    }
}

#[test]
fn the_tutorial_of_a_first_image_runs() {
    let folder = clone();
    let page = "docs/first-image.md";
    fs::write(folder.path().join("first.toml"), blocks(&read(page), "toml")[0]).unwrap();
    let (script, lines) = tutorial(page);
    let output = run_shell(folder.path(), &script).success().get_output().clone();
    assert_printed(&output.stdout, &lines);
    for (made, shown) in [("out/power.png", "mannequin"), ("first/power.png", "first-image")] {
        let shown = root().join(format!("docs/{shown}.png"));
        assert!(fs::read(folder.path().join(made)).unwrap() == fs::read(shown).unwrap(), "{made}");
    }
}

#[test]
fn the_tutorial_from_a_cloud_to_a_material_runs() {
    if std::process::Command::new("python3").arg("--version").output().is_err() {
        return eprintln!("skipped: there is no python3");
    }
    let folder = clone();
    let (script, lines) = tutorial("docs/own-cloud.md");
    let output = run_shell(folder.path(), &script).success().get_output().clone();
    assert_printed(&output.stdout, &lines);
}

/// What the README runs as well is run and compared with the page by the README's test.
#[test]
fn the_tutorial_of_a_model_that_misses_runs() {
    let folder = clone();
    let (script, _) = tutorial(MODEL_THAT_MISSES);
    let readme = read("README.md");
    let is_new = |line: &&str| !line.contains("diagnose") || !readme.contains(&format!("{line} "));
    let script: Vec<&str> = script.lines().filter(is_new).collect();
    assert_eq!(script.len(), 9, "{script:?}");
    let output = run_shell(folder.path(), &script.join("\n")).success().get_output().clone();
    assert_printed(&output.stdout, &["nothing is missing".to_owned()]);
    // With `--add` a diagnosis finds the same as without.
    let page = read(MODEL_THAT_MISSES);
    let mut checked = 0;
    for (command, lines) in outputs(&page) {
        let before_folder = command.split(" -o ").next().unwrap_or(&command);
        let is_same = |line: &&str| {
            **line == command || line.starts_with(before_folder) && line.ends_with(" --add")
        };
        if script.iter().any(is_same) {
            assert_printed(&output.stdout, &lines);
            checked += 1;
        }
    }
    assert_eq!(checked, 3, "{script:?}");
}

#[test]
fn the_radar_of_the_docs_is_accepted() {
    let folder = clone();
    let page = "docs/place-your-radar.md";
    let scene = read(page);
    fs::write(folder.path().join("mine.toml"), blocks(&scene, "toml")[0]).unwrap();
    let (script, lines) = tutorial(page);
    let output = run_shell(folder.path(), &script).success().get_output().clone();
    assert_printed(&output.stdout, &lines);
    // The other blocks are changes to a scene: the side view, and rays from a file.
    let target = "[[mesh]]\nname = \"body\"\nfile = \"builtin:mannequin\"\n\
                  [[region]]\nname = \"paint\"\nmaterial = \"mannequin-paint\"\n";
    fs::write(folder.path().join("rays.csv"), blocks(&scene, "csv")[0]).unwrap();
    for (place, change) in blocks(&scene, "toml").into_iter().enumerate().skip(1) {
        let file = folder.path().join("changed.toml");
        fs::write(file, format!("{change}{target}")).unwrap();
        let out = format!("out-{place}");
        matdb(folder.path()).args(["render", "changed.toml", "-o", &out]).assert().success();
    }
}

/// Every key of the radar stands in its reference page.
#[test]
fn the_reference_of_the_radar_names_every_key() {
    let page = read("docs/radar-keys.md");
    let radar = matdb::radar::Radar {
        receiver: Some(Default::default()),
        speckle: Some(Default::default()),
        noise: Some(Default::default()),
        ..Default::default()
    };
    let radar = serde_json::to_value(radar).unwrap();
    let mut tables = vec![radar];
    while let Some(table) = tables.pop() {
        for (key, value) in table.as_object().unwrap() {
            assert!(
                page.contains(&format!("`{key}`")) || page.contains(&format!(".{key}]")),
                "{key}"
            );
            tables.extend(value.is_object().then(|| value.clone()));
        }
    }
}

#[test]
fn the_scene_of_the_docs_is_accepted() {
    let text = read("docs/scenes.md");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), blocks(&text, "toml")[0]).unwrap();
    matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert().success();
}

#[test]
fn the_way_from_a_cloud_to_a_material_runs() {
    let text = read("docs/measuring.md");
    let folder = tempfile::tempdir().unwrap();
    copy(&root().join("scenes"), &folder.path().join("scenes"));
    let commands = blocks(&text, "sh")[0].lines().map(|line| line.split(" #").next().unwrap_or(""));
    let mut run = 0;
    for command in commands {
        let arguments = command.trim().strip_prefix("matdb ").unwrap();
        // The one argument with a blank is quoted.
        let arguments = arguments.replace("'rendered bench'", "rendered-bench");
        matdb(folder.path()).args(arguments.split_whitespace()).assert().success();
        run += 1;
    }
    assert_eq!(run, 6);
    assert!(folder.path().join("compared/images.png").exists());
}

#[test]
fn the_diagnosis_of_a_curve_runs_on_the_columns_of_the_docs() {
    let text = read("docs/diagnosing-a-curve.md");
    let folder = tempfile::tempdir().unwrap();
    let mut table = blocks(&text, "csv")[0].lines().next().unwrap().to_owned() + "\n";
    for (incidence_deg, receiver_deg) in (-25..=25).flat_map(|k| [(20, 3 * k), (50, 3 * k)]) {
        let apart = f64::from(receiver_deg - incidence_deg) / 20.0;
        let brdf_per_sr = 0.01 + 0.1 * (-apart * apart).exp();
        table += &format!("{incidence_deg},{receiver_deg},{brdf_per_sr}\n");
    }
    fs::write(folder.path().join("coating.csv"), table).unwrap();
    let lines = blocks(&text, "sh").into_iter().flat_map(str::lines);
    let commands: Vec<&str> = lines.filter(|line| line.contains("--curve")).collect();
    assert_eq!(commands.len(), 2);
    for command in commands {
        let arguments = command.split(" #").next().unwrap_or("").trim();
        let arguments = arguments.strip_prefix("matdb ").unwrap();
        matdb(folder.path()).args(arguments.split_whitespace()).assert().success();
    }
}

#[test]
fn the_material_of_the_docs_is_accepted() {
    let text = read("docs/materials.md");
    assert_eq!(blocks(&text, "toml")[0], read("src/setup/material-template.toml"));
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("material.toml"), blocks(&text, "toml")[0]).unwrap();
    fs::write(folder.path().join("scan.csv"), blocks(&text, "csv")[0]).unwrap();
    matdb(folder.path()).args(["add", "--from", "."]).assert().success();
    matdb(folder.path()).args(["show", "my-paint@1"]).assert().success();
}

#[test]
fn the_way_to_a_catalogue_runs() {
    let text = read("docs/publishing.md");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("about.toml"), blocks(&text, "toml")[0]).unwrap();
    for command in blocks(&text, "sh")[1].lines() {
        let arguments = command.split(" #").next().unwrap_or("").trim();
        let arguments = arguments.strip_prefix("matdb ").unwrap();
        matdb(folder.path()).args(arguments.split_whitespace()).assert().success();
    }
    let index = fs::read_to_string(folder.path().join("site/index.html")).unwrap();
    assert!(index.contains("Paints and cloth at 300 GHz") && index.contains("Ann Roe"));
}

/// A date ends a line early.
#[test]
fn the_way_from_the_lab_to_a_doi_runs() {
    let folder = tempfile::tempdir().unwrap();
    let page = "docs/lab-to-doi.md";
    let text = read(page);
    let csv = blocks(&text, "csv")[0];
    fs::write(folder.path().join("scan.csv"), csv).unwrap();
    fs::write(folder.path().join("about.toml"), blocks(&text, "toml")[0]).unwrap();
    let (script, lines) = tutorial(page);
    let output = run_shell(folder.path(), &script).success().get_output().clone();
    let lines: Vec<String> = lines.iter().map(|line| line.trim_end_matches('…').into()).collect();
    assert_printed(&output.stdout, &lines);
    // What scenes render before the fit, and what the law is held against, are readings of the file.
    for reading in ["0,1.3,", "20,-21.6,", "40,-28.4,", "60,,left,-34.0"] {
        assert!(csv.lines().any(|line| line.starts_with(reading)), "{reading}");
    }
    let changes = fs::read_to_string(folder.path().join("paint-catalogue/CHANGES.md")).unwrap();
    assert!(changes.contains("withdrawn: The plate was bent."), "{changes}");
}

#[test]
fn every_command_has_help_with_an_example() {
    let folder = tempfile::tempdir().unwrap();
    for command in [
        "render",
        "radar",
        "calibrate",
        "measure",
        "compare",
        "diagnose",
        "effects",
        "add",
        "list",
        "show",
        "check",
        "plot",
        "predict",
        "fit",
        "rm",
        "export",
        "completions",
        "man",
    ] {
        let output = matdb(folder.path()).args(["help", command]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains("Example") && text.contains(&format!("matdb {command}")), "{text}");
    }
}

#[test]
fn every_command_has_a_man_page() {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["man", "-o", "man1", "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let files = said["files"].as_array().unwrap();
    assert_eq!(files.len(), entries(&folder.path().join("man1")).len());
    assert!(files.len() > 25 && files.contains(&"matdb.1".into()), "{said}");
    let page = std::fs::read_to_string(folder.path().join("man1/matdb-render.1")).unwrap();
    assert!(page.contains("matdb\\-render") && page.contains("uncompressed"), "{page}");
}

#[test]
fn the_built_in_table_of_the_docs_is_complete() {
    let text = read("docs/built-in-materials.md");
    for name in matdb::material::builtin::names() {
        assert!(text.contains(&format!("| `{name}` |")), "{name}");
        let material = matdb::material::builtin::get(name).unwrap().unwrap();
        assert!(material.scattering().unwrap().sigma0(0.0) > 0.0);
    }
}
