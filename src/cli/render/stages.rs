//! Progress and wall-clock time of the stages of a rendering.

use std::sync::Mutex;
use std::time::Instant;

use indicatif::ProgressBar;

use crate::cli::console::Console;
use crate::report::{RenderProgress, RenderStage};

/// Stages of a command, of which the last one is running.
pub(super) struct Stages<'a> {
    console: &'a Console,
    start: Instant,
    running: Mutex<RunningStage>,
}

/// The stage that is running, and those before it with their times in ms.
struct RunningStage {
    stage: &'static str,
    since: Instant,
    bar: Option<ProgressBar>,
    ended: Vec<(&'static str, f64)>,
}

impl<'a> Stages<'a> {
    /// Begins the first stage.
    pub fn start(stage: &'static str, console: &'a Console) -> Stages<'a> {
        let start = Instant::now();
        let running = RunningStage { stage, since: start, bar: None, ended: Vec::new() };
        Stages { console, start, running: Mutex::new(running) }
    }

    /// Ends the running stage, which `-v` shows, and begins the next, with a bar over this many chirps.
    pub fn begin(&self, stage: &'static str, bar: Option<(&'static str, usize)>) {
        let Ok(mut running) = self.running.lock() else { return };
        running.end(self.console);
        running.stage = stage;
        running.bar = bar.map(|(what, chirps)| self.console.progress(what, chirps));
        running.since = Instant::now();
    }

    /// Shows how far a rendering has come; `chirps` are all that are traced, and all that are received.
    pub fn show(&self, progress: RenderProgress, chirps: [usize; 2]) {
        let stage = match progress {
            RenderProgress::Begin(stage) => stage,
            RenderProgress::Chirps(done) => return self.advance(done),
        };
        match stage {
            RenderStage::Trace => self.begin("trace", Some(("tracing", chirps[0]))),
            RenderStage::Power => self.begin("power", Some(("receiving", chirps[1]))),
            RenderStage::Image => self.begin("image", None),
            RenderStage::Encode => self.begin("encode", None),
        }
    }

    fn advance(&self, chirps: usize) {
        let Ok(running) = self.running.lock() else { return };
        running.bar.iter().for_each(|bar| bar.inc(chirps as u64));
    }

    /// Ends the last stage; all stages with their times in ms, and the time of all, s.
    pub fn end(self) -> (Vec<(&'static str, f64)>, f64) {
        let Ok(mut running) = self.running.into_inner() else { return (Vec::new(), 0.0) };
        running.end(self.console);
        (running.ended, self.start.elapsed().as_secs_f64())
    }
}

impl RunningStage {
    fn end(&mut self, console: &Console) {
        let ms = self.since.elapsed().as_secs_f64() * 1e3;
        self.bar.take().iter().for_each(ProgressBar::finish_and_clear);
        console.detail(&format!("{:>8} {ms:8.1} ms", self.stage));
        self.ended.push((self.stage, ms));
    }
}
