//! Files on the disk: a set of files or a folder that is written whole or not at all, and small files read whole.

mod error;
mod new_folder;
mod path;
mod read;
mod set;

pub use error::{FilesError, WayOut};
pub use new_folder::{FolderContent, NewFolder, replacement_obstacle};
pub use path::folder_of;
pub(crate) use read::{LARGEST_FILE_BYTES, check_size};
pub use read::{LARGEST_SMALL_FILE_BYTES, read_small, read_whole};
pub use set::{FolderFiles, Placement, write_all};
