//! Long work without the interpreter's lock, which Ctrl-C ends.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::own::refuse_inside;

/// How long a signal may wait.
const PATIENCE: Duration = Duration::from_millis(50);

/// Set when the work is to end.
#[derive(Clone)]
pub(crate) struct Stop(Arc<AtomicBool>);

/// What unwinds the threads of work that was stopped.
struct Stopped;

impl Stop {
    /// Ends the work that calls this if it was stopped. Long work calls it from its reports of progress, on any thread.
    pub(crate) fn check(&self) {
        if self.0.load(Ordering::Relaxed) {
            // Without the hook of panics, which would print a message.
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// Does work on another thread while this one looks for signals. Where the work calls a function of the program and that
/// fails, it unwinds with the error.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> T + Send,
) -> PyResult<T> {
    refuse_inside()?;
    let stop = Stop(Arc::new(AtomicBool::new(false)));
    let mut signal = None;
    let done = py.detach(|| {
        thread::scope(|scope| {
            let (sender, receiver) = channel();
            let stop = &stop;
            scope.spawn(move || {
                // Nothing of the work is used after it has ended early.
                let done = catch_unwind(AssertUnwindSafe(|| work(stop)));
                let _ = sender.send(done);
            });
            loop {
                match receiver.recv_timeout(PATIENCE) {
                    Ok(done) => return done,
                    Err(RecvTimeoutError::Disconnected) => return Err(Box::new(Stopped) as _),
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(raised) = Python::attach(|py| py.check_signals()) {
                            stop.0.store(true, Ordering::Relaxed);
                            signal = Some(raised);
                        }
                    }
                }
            }
        })
    });
    match (done, signal) {
        (Ok(done), None) => Ok(done),
        // One that came too late to stop the work must not be lost.
        (Ok(_), Some(raised)) => Err(raised),
        (Err(payload), Some(raised)) if payload.is::<Stopped>() || payload.is::<PyErr>() => {
            Err(raised)
        }
        // A function of the program that failed inside the work.
        (Err(payload), _) => match payload.downcast::<PyErr>() {
            Ok(raised) => Err(*raised),
            Err(payload) => resume_unwind(payload),
        },
    }
}
