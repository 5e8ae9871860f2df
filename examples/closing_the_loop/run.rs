//! The program on every case, as a user would run it. Labels are not looked at here.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::Failure;
use super::report::Run;

/// What is kept of a run beside its report.
#[derive(Serialize, Deserialize)]
struct Kept {
    seconds: f64,
    jobs: usize,
    /// Of the program's file.
    program: String,
    /// What the program said if there is no report.
    message: Option<String>,
}

/// The program and how to run it.
pub struct Runner {
    matdb: PathBuf,
    program: String,
    jobs: usize,
    keep: PathBuf,
}

const REPORT: &str = "report.json";
const RUN: &str = "run.json";

impl Runner {
    pub fn new(matdb: &Path, jobs: usize, keep: &Path) -> Result<Runner, Failure> {
        let bytes = fs::read(matdb).map_err(|error| {
            format!("{}: {error}; build it by `cargo build --release`", matdb.display())
        })?;
        let program = blake3::hash(&bytes).to_hex()[..12].to_owned();
        Ok(Runner { matdb: matdb.canonicalize()?, program, jobs, keep: keep.to_owned() })
    }

    /// Runs every case of a folder that has not run yet, and gives all of them with their names.
    pub fn run(&self, cases: &Path) -> Result<Vec<(String, Run)>, Failure> {
        let cases = folders(&cases.join("cases"))?;
        let (next, runs) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || {
            while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                let run = self.case(case);
                if let Ok(mut runs) = runs.lock() {
                    let (done, of) = (runs.len() + 1, cases.len());
                    let said = run.as_ref().map_or("failed".into(), Run::said);
                    eprintln!("{done} of {of} {} {said}", name(case));
                    runs.push((name(case), run));
                }
            }
        };
        std::thread::scope(|scope| {
            (0..self.jobs).for_each(|_| drop(scope.spawn(work)));
        });
        let runs = runs.into_inner().map_err(|_| "a case panicked")?;
        let mut runs = runs
            .into_iter()
            .map(|(case, run)| Ok((case, run?)))
            .collect::<Result<Vec<_>, Failure>>()?;
        runs.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(runs)
    }

    fn case(&self, case: &Path) -> Result<Run, Failure> {
        let cloud = ["cloud.csv", "cloud.ply"].map(|name| case.join(name));
        let cloud = cloud.iter().find(|path| path.exists());
        let cloud = cloud.ok_or_else(|| format!("{}: there is no cloud", case.display()))?;
        let keep = self.keep.join(format!("{}-{}", name(case), key(case, cloud)?));
        if let Some(run) = self.kept(&keep) {
            return Ok(run);
        }
        let scratch = tempfile::tempdir()?;
        let (db, out) = (scratch.path().join("case.sqlite"), scratch.path().join("out"));
        let begun = Instant::now();
        let mut message = self.matdb(&db, "add", &["--from".as_ref(), material(case).as_ref()])?;
        if message.is_none() {
            let scene = case.join("scene.toml");
            let options = [
                cloud.as_os_str(),
                "--scene".as_ref(),
                scene.as_ref(),
                "-o".as_ref(),
                out.as_ref(),
            ];
            message = self.matdb(&db, "diagnose", &options)?;
        }
        let seconds = begun.elapsed().as_secs_f64();
        fs::create_dir_all(&keep)?;
        match fs::copy(out.join(REPORT), keep.join(REPORT)) {
            // It can tell nothing, and says so in a report.
            Ok(_) => message = None,
            Err(_) if message.is_none() => message = Some("no report was written".into()),
            Err(_) => {}
        }
        let one = Kept { seconds, jobs: self.jobs, program: self.program.clone(), message };
        fs::write(keep.join(RUN), serde_json::to_string(&one)?)?;
        read(&keep).ok_or_else(|| format!("{} cannot be read", keep.display()).into())
    }

    /// A run of this very program that gave a report; one that failed is tried again.
    fn kept(&self, folder: &Path) -> Option<Run> {
        read(folder).filter(|run| run.report.is_ok() && run.program == self.program)
    }

    /// What it said when the status was not 0.
    fn matdb(
        &self,
        db: &Path,
        command: &str,
        options: &[&std::ffi::OsStr],
    ) -> Result<Option<String>, Failure> {
        let mut matdb = Command::new(&self.matdb);
        matdb.env_remove("MATDB").arg("--db").arg(db).arg(command).args(options);
        if self.jobs > 1 {
            matdb.env("RAYON_NUM_THREADS", "1");
        }
        let output = matdb.output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
        Ok((!output.status.success()).then(|| last.trim().to_owned()))
    }
}

fn material(case: &Path) -> PathBuf {
    case.join("material").join("material.toml")
}

/// Tells cases of one name apart, and a case from what it was before.
fn key(case: &Path, cloud: &Path) -> Result<String, Failure> {
    let mut hash = blake3::Hasher::new();
    for file in [cloud, &case.join("scene.toml"), &material(case)] {
        hash.update(&fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?);
    }
    Ok(hash.finalize().to_hex()[..8].to_owned())
}

fn read(folder: &Path) -> Option<Run> {
    let kept: Kept = serde_json::from_str(&fs::read_to_string(folder.join(RUN)).ok()?).ok()?;
    let Kept { seconds, jobs, program, message } = kept;
    let report = match message {
        Some(message) => Err(message),
        None => serde_json::from_str(&fs::read_to_string(folder.join(REPORT)).ok()?)
            .map_err(|error| format!("the report is not read: {error}")),
    };
    Some(Run { seconds, jobs, program, report })
}

fn name(case: &Path) -> String {
    case.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn folders(cases: &Path) -> Result<Vec<PathBuf>, Failure> {
    let entries = fs::read_dir(cases).map_err(|error| format!("{}: {error}", cases.display()))?;
    let mut found = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, Failure>>()?;
    found.retain(|path| path.join("scene.toml").exists());
    found.sort();
    if found.is_empty() {
        Err(format!("{}: there are no cases", cases.display()).into())
    } else {
        Ok(found)
    }
}
