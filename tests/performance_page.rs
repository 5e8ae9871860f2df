//! Promise: `docs/performance.md` is what its scripts make of the stored results, and they count right.
//! Nothing is measured here. Without a `python3` there is nothing to ask.

use std::fs;
use std::process::{Command, Output};

use crate::support::root;

/// What the scripts answer; `None` where there is no Python.
fn python(arguments: &[&str]) -> Option<Output> {
    let mut command = Command::new("python3");
    command.args(["-B"]).args(arguments).current_dir(root().join("benches/rivals"));
    match command.output() {
        Ok(output) => Some(output),
        Err(reason) => {
            eprintln!("skipped: python3: {reason}");
            None
        }
    }
}

#[test]
fn the_page_is_what_the_stored_results_say() {
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("performance.md");
    let made_at = made.to_str().unwrap();
    let Some(output) = python(&["performance.py", "--page-only", "--page", made_at]) else {
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(
        fs::read(made).unwrap() == fs::read(root().join("docs/performance.md")).unwrap(),
        "write the page again: python3 benches/rivals/performance.py --page-only"
    );
}

#[test]
fn the_page_counts_right() {
    let Some(output) = python(&["-m", "unittest", "test_page"]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
