//! Commands that a person can type again.

use std::path::Path;

/// A path as a shell takes it.
///
/// ```
/// use matdb::report::shell_word;
/// assert_eq!(shell_word("out/a-1.ply".as_ref()), "out/a-1.ply");
/// assert_eq!(shell_word("it's;rm".as_ref()), r"'it'\''s;rm'");
/// ```
pub fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    if text.chars().all(|c| c.is_alphanumeric() || "_-./+,:@%=".contains(c)) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
