//! The answer that nothing can be said.

use std::path::Path;

use crate::adopt::Earlier;
use crate::cli::console::Console;
use crate::error::Error;
use crate::files::write_all;
use crate::report::CannotTell;

/// Writes why nothing can be said of `subject`; `inputs` are the files that were read.
pub(super) fn write_refusal(
    answer: &CannotTell,
    subject: &str,
    folder: &Path,
    inputs: &[&Path],
    console: &Console,
) -> Result<(), Error> {
    let files = answer.files(subject)?;
    let earlier = Earlier::in_folder(folder, inputs);
    write_all(folder, &files)?;
    for notice in earlier.remove_all_but(&files) {
        console.notice(&notice);
    }
    if console.json { console.result("", answer) } else { Ok(()) }
}
