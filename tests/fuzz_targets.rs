//! Promise: every target of the fuzzer keeps what it promises on each file of its corpus, and every target has a corpus.

use std::fs;

use crate::support::{entries, root};

#[path = "../fuzz/src/lib.rs"]
mod targets;

#[test]
fn every_target_has_a_corpus_and_every_corpus_a_target() {
    for (name, _) in targets::TARGETS {
        let folder = root().join("fuzz/corpus").join(name);
        assert!(entries(&folder).len() > 1, "{name} has fewer than two files to start from");
    }
    for name in entries(&root().join("fuzz/corpus")) {
        assert!(targets::target(&name).is_some(), "fuzz/corpus/{name} is of no target");
    }
}

#[test]
fn every_file_of_a_corpus_keeps_the_promise_of_its_target() {
    for (name, run) in targets::TARGETS {
        let folder = root().join("fuzz/corpus").join(name);
        for file in entries(&folder) {
            println!("fuzz/corpus/{name}/{file}");
            run(&fs::read(folder.join(file)).unwrap());
        }
    }
}
