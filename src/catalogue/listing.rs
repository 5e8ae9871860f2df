//! The files in a published folder.

use std::fs;
use std::io;
use std::path::Path;

use super::layout::KEPT;

/// Every file below a folder but those in [`KEPT`], sorted: its path relative to the folder, the parts joined by `/`,
/// and whether it is a plain file. Links are not followed.
pub(super) fn files(root: &Path) -> io::Result<Vec<(String, bool)>> {
    let mut found = Vec::new();
    let mut folders = vec![(root.to_owned(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if KEPT.contains(&path.as_str()) {
                continue;
            }
            let kind = entry.file_type()?;
            if kind.is_dir() {
                folders.push((entry.path(), format!("{path}/")));
            } else {
                found.push((path, kind.is_file()));
            }
        }
    }
    found.sort();
    Ok(found)
}
