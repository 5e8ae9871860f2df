//! Makes the shards of a data set that are missing.

use std::panic::resume_unwind;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;

use rayon::ThreadPoolBuilder;
use serde::{Deserialize, Serialize};

use super::layout;
use super::plan::Dataset;
use super::scan::ScanRow;
use super::scans;
use super::shard::{ShardFiles, write_inside};
use crate::error::Error;
use crate::files::read_whole;

/// How far the making of a data set has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetProgress {
    /// Scans that were made by this call.
    pub done: u32,
    /// Scans that this call has to make.
    pub of: u32,
}

/// What a call has made.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DatasetRun {
    /// Shards that were made.
    pub shards: u32,
    /// Scans that were made.
    pub scans: u32,
    /// Shards that are still missing, of the whole data set.
    pub missing: u32,
}

/// What a shard says of itself, in the file that is written last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    /// The plan's.
    pub id: String,
    pub shard: u32,
    pub split: String,
    pub files: Vec<ShardFile>,
    pub scans: Vec<ScanRow>,
    /// BLAKE3 of all of the above: what was changed by hand is not believed.
    pub seal: String,
}

impl Manifest {
    /// The text of a file with its seal.
    fn sealed(mut self) -> Result<Vec<u8>, Error> {
        self.seal = String::new();
        self.seal = blake3::hash(&self.text()?).to_hex().to_string();
        self.text()
    }

    fn text(&self) -> Result<Vec<u8>, Error> {
        serde_json::to_vec(self).map_err(|error| {
            Error::usage(format!("a manifest cannot be written: {error}"), "report this")
        })
    }
}

/// A file of a shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShardFile {
    pub file: String,
    pub bytes: u64,
    pub blake3: String,
}

impl Dataset {
    /// Makes what is missing of the whole data set, or of one of several equal parts (from 0), on all cores; `progress` hears
    /// of every scan. A shard is there as a whole or not at all.
    ///
    /// # Errors
    /// A part that there is not, a machine that gives other bytes than the one that planned, a disk that is too small, and a scan
    /// that cannot be made. Shards that are done stay.
    pub fn run(
        &self,
        part: Option<[u32; 2]>,
        progress: &(dyn Fn(DatasetProgress) + Sync),
    ) -> Result<DatasetRun, Error> {
        let wanted = self.wanted(part)?;
        let pending: Vec<u32> =
            wanted.into_iter().filter(|&shard| self.whole(shard).is_err()).collect();
        let of: u32 = pending.iter().map(|&shard| self.scans_of(shard).len() as u32).sum();
        let mut made = DatasetRun::default();
        if !pending.is_empty() {
            self.check_disk(of)?;
            self.check_first_scan()?;
            progress(DatasetProgress { done: 0, of });
            self.make_all(&pending, of, progress)?;
            (made.shards, made.scans) = (pending.len() as u32, of);
        }
        made.missing =
            (0..self.plan.shards).filter(|&shard| self.manifest(shard).is_err()).count() as u32;
        if made.missing == 0 {
            self.finish()?;
        }
        Ok(made)
    }

    /// The shards that are not there as a whole.
    pub fn missing(&self) -> Vec<u32> {
        (0..self.plan.shards).filter(|&shard| self.whole(shard).is_err()).collect()
    }

    /// The shards of a part.
    fn wanted(&self, part: Option<[u32; 2]>) -> Result<Vec<u32>, Error> {
        let all = 0..self.plan.shards;
        let Some([number, parts]) = part else { return Ok(all.collect()) };
        if number >= parts {
            return Err(Error::usage(
                format!("there is no part {number}/{parts}"),
                "give K/N with K from 0 to N - 1",
            ));
        }
        Ok(all.filter(|shard| shard % parts == number).collect())
    }

    /// The scans of a shard, by their numbers among all.
    fn scans_of(&self, shard: u32) -> std::ops::Range<u32> {
        self.recipe.split_of_shard(shard).scans_of(&self.recipe.spec, shard)
    }

    /// Makes some shards, each on a thread of its own while there are enough.
    fn make_all(
        &self,
        pending: &[u32],
        of: u32,
        progress: &(dyn Fn(DatasetProgress) + Sync),
    ) -> Result<(), Error> {
        let threads = rayon::current_num_threads().max(1);
        let workers = threads.min(pending.len());
        let (next, done) = (AtomicU32::new(0), AtomicU32::new(0));
        let (stop, first_error) = (AtomicBool::new(false), Mutex::new(None));
        let work = || {
            // A pool of its own keeps one scan from taking up another while it waits.
            let pool = ThreadPoolBuilder::new().num_threads(threads / workers).build();
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed) as usize;
                let Some(&shard) = pending.get(place).filter(|_| !stop.load(Ordering::Relaxed))
                else {
                    return;
                };
                let hear = || {
                    let done = 1 + done.fetch_add(1, Ordering::Relaxed);
                    progress(DatasetProgress { done, of });
                };
                let made = match &pool {
                    Ok(pool) => pool.install(|| self.make_shard(shard, &stop, &hear)),
                    Err(_) => self.make_shard(shard, &stop, &hear),
                };
                if let Err(error) = made {
                    stop.store(true, Ordering::Relaxed);
                    let mut first =
                        first_error.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    first.get_or_insert(error);
                }
            }
        };
        let unwound = thread::scope(|scope| {
            let workers: Vec<_> = (0..workers)
                .map(|_| {
                    scope.spawn(|| {
                        let worked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
                        worked.inspect_err(|_| stop.store(true, Ordering::Relaxed)).err()
                    })
                })
                .collect();
            let ended = workers.into_iter().filter_map(|worker| worker.join().unwrap_or_else(Some));
            ended.reduce(|first, _| first)
        });
        if let Some(payload) = unwound {
            resume_unwind(payload);
        }
        let first = first_error.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        first.map_or(Ok(()), Err)
    }

    /// Makes a shard and writes its files: all of them, or none.
    fn make_shard(&self, shard: u32, stop: &AtomicBool, hear: &dyn Fn()) -> Result<(), Error> {
        let mut made = Vec::new();
        for scan in self.scans_of(shard) {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            made.push(self.recipe.make(scan)?);
            hear();
        }
        let split = self.recipe.split_of_shard(shard);
        let name = split.shard_name(shard);
        let ShardFiles { points, images } = ShardFiles::new(&made)?;
        let mut files = vec![(layout::points(&name), points)];
        files.extend(images.map(|images| (layout::images(&name), images)));
        let described = files.iter().map(|(file, bytes)| ShardFile {
            file: file.clone(),
            bytes: bytes.len() as u64,
            blake3: blake3::hash(bytes).to_hex().to_string(),
        });
        let manifest = Manifest {
            id: self.plan.id.clone(),
            shard,
            split: split.name.clone(),
            files: described.collect(),
            scans: made.into_iter().map(|scan| scan.record).collect(),
            seal: String::new(),
        };
        let text = manifest.sealed()?;
        self.write(&files)?;
        self.write(&[(layout::manifest(&name), text)])
    }

    /// Writes files, by their paths in the folder: all of them, or none.
    pub(super) fn write(&self, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
        write_inside(&self.folder, files)
    }

    /// What a shard says of itself.
    pub(super) fn manifest(&self, shard: u32) -> Result<Manifest, String> {
        let name = self.recipe.split_of_shard(shard).shard_name(shard);
        let path = self.folder.join(layout::manifest(&name));
        if !path.exists() {
            return Err("is missing".to_owned());
        }
        let bytes = read_whole(&path).map_err(|error| error.to_string())?;
        let manifest: Manifest = serde_json::from_slice(&bytes)
            .map_err(|error| format!("has a manifest that cannot be read: {error}"))?;
        if manifest.id != self.plan.id || manifest.shard != shard {
            return Err("is of another plan".to_owned());
        }
        if manifest.clone().sealed().ok() != Some(bytes) {
            return Err("has a manifest that was changed".to_owned());
        }
        let split = &self.recipe.split_of_shard(shard).name;
        let mut files = vec![layout::points(&name)];
        files.extend(self.recipe.spec.images.then(|| layout::images(&name)));
        let of_scans = self.scans_of(shard).map(|scan| (scan, self.recipe.key(scan)));
        let agrees = manifest.files.iter().map(|one| &one.file).eq(&files)
            && manifest.scans.iter().map(|row| (row.scan, row.key.clone())).eq(of_scans)
            && manifest.scans.iter().all(|row| row.split == *split)
            && manifest.split == *split;
        if !agrees {
            return Err("has a manifest of other files or scans".to_owned());
        }
        Ok(manifest)
    }

    /// What a shard says of itself, if all of its files are there and sound; else what is wrong.
    pub(super) fn whole(&self, shard: u32) -> Result<Manifest, String> {
        let manifest = self.manifest(shard)?;
        let is_damaged =
            |one: &&ShardFile| hash_of(&self.folder.join(&one.file)).as_ref() != Some(&one.blake3);
        match manifest.files.iter().find(is_damaged) {
            Some(one) => Err(format!("has {}, which is missing or damaged", one.file)),
            None => Ok(manifest),
        }
    }

    /// The names of all shards, each with the rows of its scans.
    pub(super) fn rows(&self) -> Result<Vec<(String, Vec<ScanRow>)>, Error> {
        let rows = (0..self.plan.shards).map(|shard| {
            let name = self.recipe.split_of_shard(shard).shard_name(shard);
            match self.manifest(shard) {
                Ok(manifest) => Ok((name, manifest.scans)),
                Err(problem) => {
                    Err(Error::usage(format!("the shard {name} {problem}"), "run it again"))
                }
            }
        });
        rows.collect()
    }

    /// Refuses a disk that cannot hold more scans.
    fn check_disk(&self, scans: u32) -> Result<(), Error> {
        let needed = u64::from(scans).saturating_mul(self.plan.bytes_per_scan);
        match free_bytes(&self.folder) {
            Some(free) if free < needed => Err(Error::usage(
                format!(
                    "{} more scans take {} MB, and the disk of {} has {} MB",
                    scans,
                    needed.div_ceil(1_000_000),
                    self.folder.display(),
                    free / 1_000_000
                ),
                "make room, or make the data set elsewhere",
            )),
            _ => Ok(()),
        }
    }

    /// Refuses a machine on which the first scan has other bytes.
    fn check_first_scan(&self) -> Result<(), Error> {
        let first = ShardFiles::new(&[self.recipe.make(0)?])?;
        if first.blake3() == self.plan.first_scan {
            return Ok(());
        }
        Err(Error::usage(
            "the first scan has other bytes here than where the data set was planned",
            "make all of it with one build of the program, or plan it anew here",
        ))
    }

    /// Writes the table of all scans, once all are there.
    fn finish(&self) -> Result<(), Error> {
        let rows = self
            .rows()?
            .into_iter()
            .flat_map(|(shard, rows)| rows.into_iter().map(move |row| (shard.clone(), row)));
        let rows: Vec<scans::Row> = rows.collect();
        self.write(&[(layout::SCANS.to_owned(), scans::table(&rows)?)])
    }
}

/// The BLAKE3 of a file; none of one that cannot be read.
fn hash_of(path: &Path) -> Option<String> {
    // Anything else might have no end.
    path.metadata().ok().filter(std::fs::Metadata::is_file)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path).ok()?).ok()?;
    Some(hasher.finalize().to_hex().to_string())
}

/// Free bytes on the disk of a folder, where the system says.
fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(target_os = "linux")]
    {
        let found = rustix::fs::statvfs(folder).ok()?;
        Some(found.f_bavail.saturating_mul(found.f_frsize))
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = folder;
        None
    }
}
