//! A program that is timed in turns with others: it reads its input, says `ready`, and answers every line
//! on stdin with one of JSON. `benches/rivals/programs.py` is the other side.

use std::error::Error;
use std::time::Instant;

use serde_json::Value;

pub type Answer<T> = Result<T, Box<dyn Error>>;

/// Makes the calling thread one of the pool's, as that of the others' programs is one of theirs; to be called first.
///
/// Linux may put a thread that has slept behind the one that wakes it: of two that wake each other in a row, both then
/// share a core for milliseconds, which is longer than a scan takes.
pub fn join_pool() -> Answer<()> {
    Ok(rayon::ThreadPoolBuilder::new().use_current_thread().build_global()?)
}

pub fn serve(mut turn: impl FnMut() -> Answer<Value>) -> Answer<()> {
    println!("ready");
    for line in std::io::stdin().lines() {
        line?;
        println!("{}", turn()?);
    }
    Ok(())
}

/// Milliseconds of a call, and what it returned.
pub fn timed<T>(call: impl FnOnce() -> T) -> (f64, T) {
    let began = Instant::now();
    let answer = call();
    (1e3 * began.elapsed().as_secs_f64(), answer)
}
