//! Promise: the completion script of a shell proposes commands, flags and the materials of the database in use.

use std::path::Path;
use std::process::Command;

use crate::support::matdb;

/// What a shell proposes after `line`, with the program on its path; nothing where the shell is not installed.
fn proposed(shell: &str, script: &str, line: &str, folder: &Path) -> Option<Vec<String>> {
    if Command::new(shell).arg("--version").output().is_err() {
        eprintln!("skipped: there is no {shell}");
        return None;
    }
    let program = assert_cmd::cargo::cargo_bin("matdb");
    let path = format!("{}:/usr/local/bin:/usr/bin:/bin", program.parent()?.display());
    let done = Command::new(shell)
        .args(["-c", script, shell, line])
        .current_dir(folder)
        .env("PATH", path)
        .env("HOME", folder)
        .env_remove("MATDB")
        .output()
        .unwrap();
    let said = String::from_utf8(done.stdout).unwrap();
    Some(said.lines().map(|line| line.split('\t').next().unwrap_or("").to_owned()).collect())
}

/// Calls what the script registered, as bash does at a tab: with the words as bash parts them.
const BASH: &str = r#"
eval "$(matdb completions bash)"
line=${1//=/ = }
read -ra COMP_WORDS <<<"$line"
[[ $line == *' ' ]] && COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) COMP_TYPE=9
function_of=$(complete -p matdb); function_of=${function_of##*-F }; function_of=${function_of%% *}
"$function_of" matdb "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}" 2>/dev/null
printf '%s\n' "${COMPREPLY[@]}"
"#;

const FISH: &str = r#"
matdb completions fish | source
complete --do-complete $argv[2]
"#;

#[test]
fn shells_propose_the_materials_of_the_database_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let add = |database: &str, name: &str| {
        std::fs::write(folder.path().join("scan.csv"), "theta_deg,sigma0_db\n0,5\n20,-10\n")
            .unwrap();
        let words = [
            "add",
            "--from",
            "scan.csv",
            "--class",
            "paint",
            "--kind",
            "synthetic",
            "--source",
            "A test",
            "--licence",
        ];
        let own = ["CC0-1.0", "--frequency", "300", "--name", name, "--db", database];
        matdb(folder.path()).args(words).args(own).assert().success();
    };
    add("matdb.sqlite", "my-paint");
    add("other.sqlite", "my-cloth");
    for (shell, script) in [("bash", BASH), ("fish", FISH)] {
        for (line, expected) in [
            ("matdb sho", vec!["show"]),
            ("matdb show my", vec!["my-paint"]),
            ("matdb show mannequin-p", vec!["mannequin-paint"]),
            ("matdb diff my-paint my", vec!["my-paint"]),
            ("matdb --db other.sqlite show my", vec!["my-cloth"]),
            ("matdb near --material my-", vec!["my-paint"]),
            ("matdb withdraw my-paint --superseded-by pt", vec!["ptfe"]),
            // What can only be a stored material, and what can only be a built-in one.
            ("matdb rm ", vec!["my-paint"]),
            ("matdb add my", vec![]),
            ("matdb add mannequin-p", vec!["mannequin-paint"]),
            ("matdb --db nowhere.sqlite show pt", vec!["ptfe"]),
            ("matdb fit sc", vec!["scan.csv"]),
        ] {
            let Some(mut found) = proposed(shell, script, line, folder.path()) else { break };
            found.retain(|word| !word.is_empty() && !word.starts_with('-'));
            assert_eq!(found, expected, "{shell}: {line}");
        }
    }
    // Bash parts words at `=`.
    if let Some(found) = proposed("bash", BASH, "matdb --db=other.sqlite show my", folder.path()) {
        assert_eq!(found, ["my-cloth"]);
    }
}
