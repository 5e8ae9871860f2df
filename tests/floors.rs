//! Promise: the order of the `pub mod` lines in `lib.rs` is the architecture. A module uses only
//! modules declared above it, so that every arrow points down. No files of a folder go in a circle, few closures have
//! names, and benches and examples call the library: the program is started only where the process is what is judged.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{entries, root};

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Modules in the order of `lib.rs`.
fn floors() -> Vec<String> {
    let lib = fs::read_to_string(source().join("lib.rs")).unwrap();
    lib.lines()
        .filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    files_of(folder, "rs", files);
}

/// Adds the files below a folder whose names end in `.extension`.
fn files_of(folder: &Path, extension: &str, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_of(&path, extension, files);
        } else if path.extension().is_some_and(|e| e == extension) {
            files.push(path);
        }
    }
}

/// Modules that a line of code reaches by `crate::`, also inside braces.
fn reached(code: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    code.split("crate::")
        .skip(1)
        .flat_map(|rest| match rest.strip_prefix('{') {
            Some(list) => {
                let list = list.split(';').next().unwrap_or("");
                list.split(',').map(|item| word(item.trim())).collect()
            }
            None => vec![word(rest)],
        })
        .collect()
}

/// The code of a file without comments and without its tests, which may look anywhere.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or("").to_owned();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn upward_arrows(floors: &[String], floor: usize, code: &str) -> Vec<String> {
    reached(code)
        .into_iter()
        .filter(|module| floors.iter().position(|f| f == module).is_some_and(|f| f > floor))
        .collect()
}

#[test]
fn every_arrow_points_down() {
    let floors = floors();
    assert!(floors.len() > 5, "lib.rs lists its modules as `pub mod name;` lines");
    for (number, floor) in floors.iter().enumerate() {
        let mut files = Vec::new();
        match source().join(floor) {
            folder if folder.is_dir() => rust_files(&folder, &mut files),
            _ => files.push(source().join(format!("{floor}.rs"))),
        }
        for file in files {
            let up = upward_arrows(&floors, number, &code(&file));
            assert!(up.is_empty(), "{} reaches up to {up:?}", file.display());
        }
    }
}

#[test]
fn every_module_stands_in_the_order() {
    let floors = floors();
    for entry in fs::read_dir(source()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if name != "lib" && name != "main" {
            assert!(floors.contains(&name), "{name} is not among the floors of lib.rs");
        }
    }
}

#[test]
fn an_upward_arrow_is_seen() {
    let floors = ["units", "radar", "render"].map(str::to_owned);
    assert_eq!(upward_arrows(&floors, 1, "use crate::render::Scan;"), ["render"]);
    assert_eq!(upward_arrows(&floors, 0, "use crate::{units::x, radar};"), ["radar"]);
    assert!(upward_arrows(&floors, 2, "use crate::radar::Link;").is_empty());
}

#[test]
fn no_path_climbs_two_modules() {
    // `super::super` could reach a floor without naming it.
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    for file in files {
        assert!(!code(&file).contains("super::super"), "{}", file.display());
    }
}

#[test]
fn sql_stays_in_the_store() {
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    for file in files.iter().filter(|f| !f.starts_with(source().join("store"))) {
        assert!(!code(file).contains("rusqlite"), "{} speaks SQL", file.display());
    }
}

/// A file of `src/` as a module: the parts of its path, and its code.
struct Module {
    path: Vec<String>,
    code: String,
}

/// Every module but `lib.rs` and `main.rs`.
fn modules() -> Vec<Module> {
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    files.sort();
    let mut modules = Vec::new();
    for file in files {
        let inside = file.strip_prefix(source()).unwrap().with_extension("");
        let mut path: Vec<String> =
            inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if path.last().is_some_and(|last| last == "mod") {
            path.pop();
        }
        let is_of_tests = path.iter().any(|part| part == "tests" || part == "testing");
        if !is_of_tests && path != ["lib"] && path != ["main"] {
            modules.push(Module { path, code: code(&file) });
        }
    }
    modules
}

fn is_of_a_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Paths that a text holds, with those in braces written out: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn paths(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(start) = rest.find(is_of_a_name) {
        rest = &rest[start..];
        let end = path_end(rest);
        let text = &rest[..end];
        if text.contains("::") {
            written_out(&[], text, &mut found);
        }
        rest = &rest[end..];
    }
    found
}

/// Length of the path that a text begins with, its braces included.
fn path_end(text: &str) -> usize {
    let mut at = 0;
    loop {
        at += text[at..].find(|c| !is_of_a_name(c)).unwrap_or(text.len() - at);
        match text[at..].strip_prefix("::") {
            Some(list) if list.starts_with('{') => return at + 2 + brace_end(list),
            Some(next) if next.starts_with(is_of_a_name) => at += 2,
            _ => return at,
        }
    }
}

/// Length of a text in braces, with which `text` begins.
fn brace_end(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    text.len()
}

fn written_out(before: &[String], text: &str, found: &mut Vec<Vec<String>>) {
    let mut path = before.to_vec();
    let mut rest = text.trim();
    while let Some((name, next)) = rest.split_once("::") {
        path.push(name.trim().to_owned());
        rest = next;
        if rest.starts_with('{') {
            let list = &rest[1..brace_end(rest) - 1];
            let (mut depth, mut start) = (0, 0);
            for (at, c) in list.char_indices().chain([(list.len(), ',')]) {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        written_out(&path, &list[start..at], found);
                        start = at + 1;
                    }
                    _ => {}
                }
            }
            return;
        }
    }
    let name: String = rest.split_whitespace().next().unwrap_or_default().to_owned();
    if !name.is_empty() {
        path.push(name);
        found.push(path);
    }
}

/// The module of a path as seen from `from`, and what of the path is left.
fn resolved(
    modules: &[Module],
    from: &[String],
    path: &[String],
) -> Option<(Vec<String>, Vec<String>)> {
    let is_module = |path: &[String]| modules.iter().any(|module| module.path == path);
    let (mut at, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "super" => (from[..from.len() - 1].to_vec(), &path[1..]),
        "self" => (from.to_vec(), &path[1..]),
        child => {
            let child = [from, &[child.to_owned()]].concat();
            is_module(&child).then_some((child, &path[1..]))?
        }
    };
    while let Some((next, after)) = rest.split_first() {
        let deeper = [at.as_slice(), std::slice::from_ref(next)].concat();
        if !is_module(&deeper) {
            break;
        }
        (at, rest) = (deeper, after);
    }
    Some((at, rest.to_vec()))
}

/// Where names come from that a module only passes on: `use child::Name`, public or not.
fn passed_on(modules: &[Module], module: &Module, name: &str) -> Option<Vec<String>> {
    let uses = module.code.split("use ").skip(1).filter_map(|text| text.split_once(';'));
    for (tree, _) in uses {
        for path in paths(tree) {
            if path.last().is_some_and(|last| last == name)
                && let Some((of, rest)) = resolved(modules, &module.path, &path)
                && of != module.path
                && !of.is_empty()
                && rest.len() <= 1
            {
                return Some(of);
            }
        }
    }
    None
}

/// The code without what only declares children and shows their names to others; names that the code itself
/// uses are no mere show.
fn without_its_face(code: &str) -> String {
    let mut rest = code;
    let mut kept = String::new();
    let mut shown = String::new();
    while let Some(start) = rest.find("pub") {
        let (before, declaration) = rest.split_at(start);
        kept.push_str(before);
        let is_use = ["pub use ", "pub(crate) use ", "pub(super) use "]
            .iter()
            .any(|begin| declaration.starts_with(begin));
        let end = if is_use { declaration.find(';').unwrap_or(0) + 1 } else { 3 };
        if is_use {
            shown.push_str(&declaration[..end])
        } else {
            kept.push_str(&declaration[..3])
        }
        rest = &declaration[end..];
    }
    kept.push_str(rest);
    let words: std::collections::HashSet<&str> = kept.split(|c| !is_of_a_name(c)).collect();
    let used: Vec<String> = paths(&shown)
        .iter()
        .filter(|path| path.last().is_some_and(|name| words.contains(name.as_str())))
        .map(|path| format!("use {};\n", path.join("::")))
        .collect();
    used.concat() + &kept
}

/// Modules through which a name is passed on at most.
const DEEPEST: usize = 4;

/// Arrows between files of one floor, by their positions in `modules`.
fn arrows(modules: &[Module]) -> Vec<Vec<usize>> {
    let position = |path: &[String]| modules.iter().position(|module| module.path == path);
    let mut arrows = Vec::new();
    for module in modules {
        let mut to = Vec::new();
        for path in paths(&without_its_face(&module.code)) {
            let Some((mut of, rest)) = resolved(modules, &module.path, &path) else { continue };
            // A name that is only passed on counts as its own module's.
            for _ in 0..DEEPEST {
                let at = position(&of).zip(rest.first());
                let behind = at.and_then(|(at, name)| passed_on(modules, &modules[at], name));
                let Some(behind) = behind else { break };
                of = behind;
            }
            to.extend(position(&of).filter(|_| of != module.path && of[0] == module.path[0]));
        }
        to.sort();
        to.dedup();
        arrows.push(to);
    }
    arrows
}

/// Whether `end` can be reached from `start` by at least one arrow.
fn reaches(arrows: &[Vec<usize>], start: usize, end: usize) -> bool {
    let mut seen = vec![false; arrows.len()];
    let mut waiting = arrows[start].clone();
    while let Some(at) = waiting.pop() {
        if at == end {
            return true;
        }
        if !std::mem::replace(&mut seen[at], true) {
            waiting.extend(&arrows[at]);
        }
    }
    false
}

/// Files of one floor that reach themselves, those of one circle together.
fn circles(modules: &[Module]) -> Vec<Vec<String>> {
    let arrows = arrows(modules);
    let mut circles = Vec::new();
    let mut seen = vec![false; modules.len()];
    for start in 0..modules.len() {
        if seen[start] || !reaches(&arrows, start, start) {
            continue;
        }
        let mut circle = Vec::new();
        for other in start..modules.len() {
            if reaches(&arrows, start, other) && reaches(&arrows, other, start) {
                seen[other] = true;
                let to: Vec<String> =
                    arrows[other].iter().map(|&to| modules[to].path.join("/")).collect();
                circle.push(format!("{} -> {}", modules[other].path.join("/"), to.join(", ")));
            }
        }
        circles.push(circle);
    }
    circles
}

#[test]
fn no_files_of_a_folder_go_in_a_circle() {
    let circles = circles(&modules());
    let told: Vec<String> = circles.iter().map(|circle| circle.join("\n  ")).collect();
    assert!(circles.is_empty(), "{} circles:\n  {}", circles.len(), told.join("\n\n  "));
}

/// Closures with a name for each thousand lines of code.
const MOST_NAMED_CLOSURES: f64 = 5.0;

/// Whether a line names a closure, which may begin on the next line.
fn is_named_closure(line: &str, next: &str) -> bool {
    let Some(rest) = line.trim_start().strip_prefix("let ") else { return false };
    let rest = rest.strip_prefix("mut ").unwrap_or(rest);
    let Some((name, value)) = rest.split_once('=') else { return false };
    let value = if value.is_empty() { next } else { value };
    let value = value.trim_start();
    let value = value.strip_prefix("move ").unwrap_or(value);
    name.trim().chars().all(is_of_a_name) && value.starts_with('|')
}

#[test]
fn a_closure_on_the_next_line_has_a_name() {
    assert!(is_named_closure("let twice = |x: f64| 2.0 * x;", ""));
    assert!(is_named_closure("    let mut twice =", "        move |x: f64| 2.0 * x;"));
    assert!(!is_named_closure("let twice =", "    list.map(|x| 2.0 * x);"));
}

#[test]
fn few_closures_have_names() {
    let modules = modules();
    let (mut lines, mut closures) = (0, std::collections::BTreeMap::<&str, usize>::new());
    for module in &modules {
        let code: Vec<&str> = module.code.lines().filter(|line| !line.trim().is_empty()).collect();
        lines += code.len();
        let next = code.iter().skip(1).chain([&""]);
        let named = code.iter().zip(next).filter(|(line, next)| is_named_closure(line, next));
        *closures.entry(&module.path[0]).or_default() += named.count();
    }
    let count: usize = closures.values().sum();
    let per_thousand = count as f64 * 1e3 / lines as f64;
    assert!(
        per_thousand <= MOST_NAMED_CLOSURES,
        "{count} named closures in {lines} lines are {per_thousand:.1} per thousand: {closures:?}"
    );
}

/// Benches and examples that start the program, each because the process itself is measured or judged.
const STARTERS: [&str; 5] = [
    // Time of a data set that the program makes, beside another program that makes one.
    "benches/rivals/datasets.py",
    // Time and memory of the whole program, from its start to its end.
    "benches/rivals/profiling.py",
    "benches/rivals/rendering.py",
    // Start-up and peak memory of commands.
    "benches/store.rs",
    // The blind study: the program as a user runs it.
    "examples/closing_the_loop/run.rs",
];

/// Whether a file starts a program: in Rust any, in another language `matdb` by the path of its binary.
fn is_starter(path: &Path) -> bool {
    let is_rust = path.extension().is_some_and(|e| e == "rs");
    let signs: &[&str] = if is_rust {
        &["Command::new", "cargo_bin"]
    } else {
        &["/ \"matdb\"", "/matdb\"", "/matdb "]
    };
    fs::read_to_string(path).is_ok_and(|text| signs.iter().any(|sign| text.contains(sign)))
}

#[test]
fn benches_and_examples_call_the_library() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["benches", "examples"] {
        for extension in ["rs", "py", "sh"] {
            files_of(&root.join(folder), extension, &mut files);
        }
    }
    let mut starters = Vec::new();
    for file in files.iter().filter(|file| is_starter(file)) {
        starters.push(file.strip_prefix(root).unwrap().to_string_lossy().into_owned());
    }
    starters.sort();
    assert_eq!(starters, STARTERS);
}

#[test]
fn every_file_of_tests_is_run() {
    let listed = std::fs::read_to_string(root().join("tests/promises.rs")).unwrap();
    for file in entries(&root().join("tests")) {
        let Some(name) = file.strip_suffix(".rs") else { continue };
        let is_program = ["promises", "store_all_or_nothing"].contains(&name);
        assert!(
            is_program || listed.contains(&format!("\nmod {name};\n")),
            "{file} is not in promises.rs"
        );
    }
}
