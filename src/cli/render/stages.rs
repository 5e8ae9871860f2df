//! Wall-clock time of the stages of a command.

use std::time::Instant;

use crate::cli::console::Console;

/// Stages that have ended, with their times in ms.
pub(super) struct Stages {
    start: Instant,
    since: Instant,
    ended: Vec<(&'static str, f64)>,
}

impl Stages {
    pub fn start() -> Stages {
        let now = Instant::now();
        Stages { start: now, since: now, ended: Vec::new() }
    }

    /// Ends the current stage, which `-v` shows, and begins the next.
    pub fn end(&mut self, stage: &'static str, console: &Console) {
        let ms = self.since.elapsed().as_secs_f64() * 1e3;
        console.detail(&format!("{stage:>8} {ms:8.1} ms"));
        self.ended.push((stage, ms));
        self.since = Instant::now();
    }

    pub fn ended(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.ended.iter().copied()
    }

    pub fn total_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
