//! Whether a data set is complete and sound.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::time::{Duration, SystemTime};

use serde::Serialize;

use super::layout::{FOLDERS, SCANS};
use super::plan::Dataset;
use super::scans::{self, Row};
use crate::files::read_whole;

/// Files that are being written are left alone for so long.
const BEING_WRITTEN: Duration = Duration::from_secs(600);
/// Problems that are named one by one.
const MOST_NAMED: usize = 20;

/// What was found of a data set.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DatasetCheck {
    /// Whether all of it is there and sound.
    pub complete: bool,
    /// Shards of the plan.
    pub shards: u32,
    /// Shards that are there as a whole.
    pub done: u32,
    /// Scans that they hold.
    pub scans: u32,
    /// Files of interrupted work that were removed.
    pub swept: u32,
    /// What is wrong or missing, a sentence each; the first twenty.
    pub problems: Vec<String>,
}

impl Dataset {
    /// Reads every file that is there, and removes what interrupted work has left.
    pub fn check(&self) -> DatasetCheck {
        let mut found = DatasetCheck {
            shards: self.plan.shards,
            swept: self.sweep(),
            ..DatasetCheck::default()
        };
        let (mut problems, mut rows) = (Vec::new(), Vec::new());
        for shard in 0..self.plan.shards {
            let name = self.recipe.split_of_shard(shard).shard_name(shard);
            match self.whole(shard) {
                Ok(manifest) => {
                    found.done += 1;
                    found.scans += manifest.scans.len() as u32;
                    rows.extend(manifest.scans.into_iter().map(|scan| (name.clone(), scan)));
                }
                Err(problem) => problems.push(format!("shard {name} {problem}")),
            }
        }
        problems.extend(self.leaks(&rows));
        if found.done == found.shards {
            problems.extend(self.problem_of_table(&rows));
        }
        found.complete = problems.is_empty();
        let more = problems.len().saturating_sub(MOST_NAMED);
        problems.truncate(MOST_NAMED);
        if more > 0 {
            problems.push(format!("{more} more"));
        }
        found.problems = problems;
        found
    }

    /// What is wrong with the table of all scans, by what the shards say.
    fn problem_of_table(&self, rows: &[Row]) -> Option<String> {
        let path = self.folder.join(SCANS);
        if !path.is_file() {
            return Some(format!("{SCANS} is missing"));
        }
        let agrees = read_whole(&path).ok() == scans::table(rows).ok();
        (!agrees).then(|| format!("{SCANS} is not that of the shards' manifests"))
    }

    /// What two splits share and should not, by what the scans themselves say.
    fn leaks(&self, rows: &[Row]) -> Vec<String> {
        let mut of_options: BTreeMap<(&str, &str), BTreeSet<&str>> = BTreeMap::new();
        for choice in self.recipe.spec.choose.iter().filter(|choice| choice.apart) {
            for (_, row) in rows {
                if let Some(option) = row.options.get(&choice.name) {
                    of_options.entry((&choice.name, option)).or_default().insert(&row.split);
                }
            }
        }
        let mut leaks = Vec::new();
        for ((choice, option), splits) in of_options {
            if splits.len() > 1 {
                let splits: Vec<&str> = splits.into_iter().collect();
                leaks.push(format!(
                    "option `{option}` of `{choice}` is in {}",
                    splits.join(" and ")
                ));
            }
        }
        leaks
    }

    /// Removes temporary files that have not changed for a while.
    fn sweep(&self) -> u32 {
        let mut swept = 0;
        let folders =
            FOLDERS.iter().map(|name| self.folder.join(name)).chain([self.folder.clone()]);
        for entry in folders.filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten() {
            let is_temporary = entry.file_name().to_string_lossy().starts_with(".matdb-");
            let changed = entry.metadata().and_then(|found| found.modified()).ok();
            let is_old = changed.is_some_and(|changed| {
                SystemTime::now().duration_since(changed).is_ok_and(|age| age > BEING_WRITTEN)
            });
            if is_temporary && is_old && fs::remove_file(entry.path()).is_ok() {
                swept += 1;
            }
        }
        swept
    }
}
