//! Promise: every crate of which this program is built is under a licence that `deny.toml` allows, from the registry that it names,
//! and none that it bans.

use std::process::Command;

use toml::Table;

use crate::support::root;

/// Whether one way to read an SPDX expression has allowed licences alone.
fn is_allowed(expression: &str, allowed: &[&str]) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let (is_allowed, rest) = either(&words, allowed);
    assert!(rest.is_empty(), "{expression} is not understood");
    is_allowed
}

fn either<'a>(words: &'a [&'a str], allowed: &[&str]) -> (bool, &'a [&'a str]) {
    let (mut holds, mut rest) = both(words, allowed);
    while let Some(("OR", after)) = rest.split_first().map(|(word, after)| (*word, after)) {
        let (other, after) = both(after, allowed);
        (holds, rest) = (holds | other, after);
    }
    (holds, rest)
}

fn both<'a>(words: &'a [&'a str], allowed: &[&str]) -> (bool, &'a [&'a str]) {
    let (mut holds, mut rest) = one(words, allowed);
    while let Some(("AND", after)) = rest.split_first().map(|(word, after)| (*word, after)) {
        let (other, after) = one(after, allowed);
        (holds, rest) = (holds & other, after);
    }
    (holds, rest)
}

fn one<'a>(words: &'a [&'a str], allowed: &[&str]) -> (bool, &'a [&'a str]) {
    match words {
        ["(", inside @ ..] => {
            let (holds, rest) = either(inside, allowed);
            assert_eq!(rest.first(), Some(&")"), "a parenthesis is open");
            (holds, &rest[1..])
        }
        // An exception only adds rights.
        [licence, "WITH", _, rest @ ..] | [licence, rest @ ..] => (allowed.contains(licence), rest),
        [] => panic!("the expression ends early"),
    }
}

#[test]
fn licences_sources_and_bans_are_those_of_the_list() {
    let rules: Table = std::fs::read_to_string(root().join("deny.toml")).unwrap().parse().unwrap();
    let list = |table: &str, key: &str| -> Vec<&str> {
        rules[table][key].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect()
    };
    let (licences, banned) = (list("licenses", "allow"), list("bans", "deny"));
    assert_eq!(list("sources", "allow-registry"), ["https://github.com/rust-lang/crates.io-index"]);
    // What this test was built of is there without a network.
    let host = Command::new("rustc").arg("-vV").output().unwrap();
    let host = String::from_utf8(host.stdout).unwrap();
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).unwrap();
    let features: Vec<&str> =
        [("gpu", cfg!(feature = "gpu")), ("parquet", cfg!(feature = "parquet"))]
            .into_iter()
            .filter_map(|(name, is_on)| is_on.then_some(name))
            .collect();
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--package", "matdb", "--target", host, "--prefix", "none"])
        .args(["--format", "{p}\t{l}", "--features", &features.join(",")])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let tree = String::from_utf8(tree.stdout).unwrap();
    let mut packages = 0;
    for (package, licence) in tree.lines().filter_map(|line| line.split_once('\t')) {
        packages += 1;
        // A crate of which nothing more is said comes from the usual registry; the other way to say it is a place.
        let (name, rest) = package.split_once(' ').unwrap();
        let place = rest.split_once(" (").map(|(_, place)| place.trim_end_matches(')'));
        let is_own = name == "matdb" && place.is_some_and(|place| root().ends_with(place));
        let is_macro = place == Some("proc-macro");
        assert!(place.is_none() || is_own || is_macro, "{package} is of another registry");
        let licence = licence.trim_end_matches(" (*)");
        assert!(is_allowed(licence, &licences), "{name} is under `{licence}`");
        assert!(!banned.contains(&name), "{name} is banned");
    }
    assert!(packages > 100, "{packages} packages");
}

#[test]
fn an_expression_is_read_as_spdx_has_it() {
    let allowed = ["MIT", "Zlib"];
    for good in ["MIT", "MIT/GPL-3.0", "GPL-3.0 OR (MIT AND Zlib)", "MIT WITH LLVM-exception"] {
        assert!(is_allowed(good, &allowed), "{good}");
    }
    for bad in ["GPL-3.0", "MIT AND GPL-3.0", "(MIT OR Zlib) AND GPL-3.0"] {
        assert!(!is_allowed(bad, &allowed), "{bad}");
    }
}
