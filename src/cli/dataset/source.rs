//! What a data set is planned from.

use std::path::PathBuf;

/// A specification and the folder for what is made of it.
#[derive(Debug, clap::Args)]
pub(super) struct Source {
    /// The specification
    pub spec: PathBuf,
    /// Folder of the data set; created if needed
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,
}
