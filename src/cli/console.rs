//! What a command says, and to whom: results to standard output, the rest to standard error.

use std::io::{self, BufWriter, ErrorKind, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::error::Error;
use crate::files::{FilesError, WayOut};
use crate::material::is_turning;

/// How much a command says.
pub(super) struct Console {
    pub json: bool,
    pub quiet: bool,
    pub verbose: bool,
}

impl Console {
    /// The result of a command: `text` for a person, `value` for a script.
    pub fn result(&self, text: &str, value: &impl Serialize) -> Result<(), Error> {
        if self.json {
            // Piece by piece: the text of a large list is several times the list.
            return written(|out| {
                serde_json::to_writer_pretty(&mut *out, value)?;
                out.write_all(b"\n")
            });
        }
        if self.quiet { Ok(()) } else { write_out(&harmless(text)) }
    }

    /// Something a person should know, though it is no error.
    pub fn notice(&self, text: &str) {
        if !self.quiet {
            say(&format!("note: {}", readable(text)));
        }
    }

    /// Something only the curious want to know.
    pub fn detail(&self, text: &str) {
        if self.verbose && !self.quiet {
            say(text);
        }
    }

    /// A sign of life for work without known steps.
    pub fn activity(&self, what: &'static str) -> Activity {
        let bar = self.progress(what, 0);
        let style = ProgressStyle::with_template("{spinner} {elapsed} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_spinner());
        bar.set_style(style);
        bar.enable_steady_tick(Duration::from_millis(100));
        bar.set_message(what);
        let has_lines = !self.quiet && !io::stderr().is_terminal();
        let lines = has_lines.then(|| Lines::begin(what, Duration::from_secs(10), say));
        Activity { what, bar, lines }
    }

    /// A progress bar over `total` steps; invisible when standard error is no terminal.
    pub fn progress(&self, what: &'static str, total: usize) -> ProgressBar {
        let target =
            if self.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let style = ProgressStyle::with_template("{msg} {bar:32} {human_pos}/{human_len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::with_draw_target(Some(total as u64), target)
            .with_style(style)
            .with_message(what)
    }
}

/// Work that says what it does: on a terminal in a line that changes, elsewhere in a line every ten seconds.
pub(super) struct Activity {
    what: &'static str,
    bar: ProgressBar,
    /// None on a terminal.
    lines: Option<Lines>,
}

impl Activity {
    /// Says what it does now.
    pub fn now(&self, step: &str) {
        let text = format!("{}: {}", self.what, readable(step));
        if let Some(lines) = &self.lines {
            lines.next.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&text);
        }
        self.bar.set_message(text);
    }

    /// Takes the line off a terminal, and writes no more of them elsewhere.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}

/// Lines that are written while it lives.
struct Lines {
    /// What the next line says.
    next: Arc<Mutex<String>>,
    /// The thread that writes ends when this is gone.
    _alive: Sender<()>,
}

impl Lines {
    /// Writes a line after each `interval`; none where no thread can be had.
    fn begin(first: &str, interval: Duration, write: impl Fn(&str) + Send + 'static) -> Lines {
        let next = Arc::new(Mutex::new(first.to_owned()));
        let (alive, ended) = mpsc::channel();
        let shown = Arc::clone(&next);
        drop(thread::Builder::new().spawn(move || {
            while ended.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                let line = shown.lock().unwrap_or_else(PoisonError::into_inner).clone();
                write(&line);
            }
        }));
        Lines { next, _alive: alive }
    }
}

/// The text without control characters, which a file could use to write over the terminal, and without
/// those that turn the direction of a line.
fn harmless(text: &str) -> String {
    text.chars().filter(|c| (!c.is_control() || *c == '\n') && !is_turning(*c)).collect()
}

/// Writes a line to standard error. That it cannot be written must not end the work.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// A message as it may be shown: without control characters and those that turn a line, and with words cut
/// that are longer than any name or path is.
///
/// ```
/// let message = format!("no material `{}`", "a".repeat(10_000));
/// assert!(matdb::cli::readable(&message).ends_with("aaa… (10002 letters)"));
/// ```
pub fn readable(text: &str) -> String {
    harmless(text).split_inclusive(char::is_whitespace).map(cut_long_word).collect()
}

/// A word with the white space behind it, cut where it is longer than any name or path is.
fn cut_long_word(word: &str) -> String {
    const LONGEST: usize = 1000;
    const SHOWN: usize = 80;
    match word.chars().count() {
        0..=LONGEST => word.to_owned(),
        letters => {
            let rest = &word[word.trim_end().len()..];
            let start: String = word.chars().take(SHOWN).collect();
            format!("{start}… ({} letters){rest}", letters - rest.chars().count())
        }
    }
}

/// Writes to standard output; a reader that has left, as `head` does, is no error.
pub(super) fn write_out(text: &str) -> Result<(), Error> {
    written(|out| out.write_all(text.as_bytes()))
}

fn written(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    let mut out = BufWriter::new(io::stdout().lock());
    match write(&mut out).and_then(|()| out.flush()) {
        Err(reason) if reason.kind() != ErrorKind::BrokenPipe => Err(FilesError {
            verb: "write",
            path: PathBuf::from("standard output"),
            reason,
            way_out: WayOut::Words("make room or redirect it elsewhere"),
        }
        .into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_what_is_done_until_it_ends() {
        let (written, read) = mpsc::channel();
        let lines = Lines::begin("fitting", Duration::from_millis(1), move |line| {
            drop(written.send(line.to_owned()));
        });
        assert_eq!(read.recv().unwrap(), "fitting");
        "fitting: again".clone_into(&mut lines.next.lock().unwrap());
        assert!(read.iter().any(|line| line == "fitting: again"));
        drop(lines);
        // The last lines, and then the end of the thread.
        assert!(read.iter().all(|line| line == "fitting: again"));
    }
}
