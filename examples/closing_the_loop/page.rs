//! The page: a summary, and a section for every set of cases.

use super::score::Case;
use super::section;
use super::target::{Target, targets};

/// A folder of cases with everything that is known of it.
pub struct Set {
    pub title: String,
    /// The command that made the cases.
    pub made_by: Option<String>,
    pub cases: Vec<Case>,
    /// Cases that have no label, and labels that have no case.
    pub unmatched: [usize; 2],
}

/// The command that writes the page.
pub const COMMAND: &str = "cargo run --release --example closing_the_loop -- --cases DIR \
                           --matdb target/release/matdb -o docs/closing-the-loop.md";

/// The whole page.
pub fn page(sets: &[Set], tuned_on: Option<&str>) -> String {
    let mut page = format!(
        "# Closing the loop\n\n\
         This study measures how often `matdb diagnose` names the effect that a model lacks. Scans with a known truth \
         are simulated, and the program runs on each as a user would: `matdb add --from material/material.toml`, then \
         `matdb diagnose`. The truths are opened and counted after all reports exist. All data are synthetic.\n\n\
         Generated, after `cargo build --release`, with a `--cases` per set, by\n\n\
         ```sh\n{COMMAND}\n```\n\n\
         ## Summary\n\n"
    );
    let all: Vec<Vec<Target>> = sets.iter().map(|set| targets(&set.cases)).collect();
    for (set, targets) in sets.iter().zip(&all) {
        page += &in_words(set, targets);
    }
    page += &beside(sets, &all);
    page += &match tuned_on {
        Some(cases) => format!("\nSettings of the diagnosis were tuned on: {cases}.\n"),
        None => {
            "\nThe cases on which the settings of the diagnosis were tuned are not stated.\n".into()
        }
    };
    page += LEGEND;
    for set in sets {
        page += &section::section(set);
    }
    page
}

/// What a reader in a hurry wants to know.
fn in_words(set: &Set, targets: &[Target]) -> String {
    let told: Vec<&Target> = targets.iter().filter(|target| target.met.is_some()).collect();
    let missed: Vec<String> = told
        .iter()
        .filter(|target| target.met == Some(false))
        .map(|target| format!("{}, {} instead of {}", target.what, target.reached, target.aim))
        .collect();
    let wrong = set.cases.iter().filter(|case| case.missed()).count();
    let missed_text = if missed.is_empty() {
        "None was missed.".to_owned()
    } else {
        format!("Missed: {}.", missed.join("; "))
    };
    format!(
        "**{}**: {} of {} cases came out as they should, and {} of the {} targets that they can judge are met. \
         {missed_text}\n\n",
        set.title,
        set.cases.len() - wrong,
        set.cases.len(),
        told.len() - missed.len(),
        told.len(),
    )
}

fn beside(sets: &[Set], all: &[Vec<Target>]) -> String {
    let titles: Vec<String> = sets.iter().map(|set| set.title.clone()).collect();
    let mut head = vec!["what".to_owned(), "target".to_owned()];
    head.extend(titles);
    let rows = (0..all.first().map_or(0, Vec::len)).map(|row| {
        let first = &all[0][row];
        let mut cells = vec![first.what.to_owned(), first.aim.to_owned()];
        cells.extend(all.iter().map(|targets| targets[row].cell()));
        cells
    });
    table(&head, rows)
}

/// A Markdown table of numbers: the first column to the left, the others to the right.
pub fn table<S: AsRef<str>>(head: &[S], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    aligned(head, "--:|", rows)
}

/// A Markdown table of words, all to the left.
pub fn listing<S: AsRef<str>>(head: &[S], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    aligned(head, "---|", rows)
}

fn aligned<S: AsRef<str>>(
    head: &[S],
    others: &str,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let escape = |cell: &String| cell.replace('|', "\\|").replace('\n', " ");
    let mut text = line(head.iter().map(AsRef::as_ref).collect());
    text += &format!("|---|{}\n", others.repeat(head.len() - 1));
    for row in rows {
        let row: Vec<String> = row.iter().map(escape).collect();
        text += &line(row.iter().map(String::as_str).collect());
    }
    text
}

const LEGEND: &str = "
## How it is counted

- *Weak, moderate, strong*: what the refitted base model leaves without the effect: 0.35, 0.9 and 2.2 dB rms, or as much of the effect's
  own measure. Where a label states the size that was reached, that size counts.
- *Right name first*: the first effect of the report is the true one. *Exactly*: it is the only one.
- *Or in its class*: the first name comes with others that predict the data as well, and the true one is among them. A target counts
  this only where no data of this kind could distinguish the two; these cases are listed, with the reason.
- *Above*, *below*: bounds of the true share with 95 % confidence (Clopper and Pearson).
- *Extra names*: names that are not true, except a wrong first name, which is a miss already. *All wrong names* includes it.
- *False alarm*: any name, or any verdict but `no-missing-effect`, where nothing is missing.
- *No answer*: `cannot-tell`, or a command that failed. It counts as a miss, and as a false alarm where nothing is missing.
- *Error*: root mean square of observed − expected power over held-out detections. *Noise floor*: the error of a correct model.
- *Explained share*: share of the squared error before, beyond the floor, that the named effects remove.
- *Gain*: in ln likelihood, in the first round; ≈ marks a gain from a sample of the chirps.
- *Reason* of a miss: follows by rule from the report, from the round in which a wrong effect was added, else from the last. Effects
  with their own measure have an rms of 0.
";
