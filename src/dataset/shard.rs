//! The files of a shard.

use std::fs::create_dir_all;
use std::path::Path;

use super::archive::archive;
use super::images::Members;
use super::points;
use super::scan::MadeScan;
use super::table;
use crate::error::Error;
use crate::files::{FilesError, write_all};

/// The bytes of a shard's files.
pub(super) struct ShardFiles {
    pub points: Vec<u8>,
    pub images: Option<Vec<u8>>,
}

impl ShardFiles {
    /// Encodes some scans.
    ///
    /// # Errors
    /// What cannot be encoded.
    pub fn new(scans: &[MadeScan]) -> Result<ShardFiles, Error> {
        let groups = scans.iter().map(|scan| &scan.points[..]);
        let points = table::write("points", &points::columns(), groups)?;
        let members: Vec<(&str, &Members)> =
            scans.iter().map(|scan| (scan.record.key.as_str(), &scan.images)).collect();
        let has_images = members.iter().any(|(_, members)| !members.is_empty());
        let images = has_images.then(|| archive(&members)).transpose()?;
        Ok(ShardFiles { points, images })
    }

    /// The hash of all of it.
    pub fn blake3(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.points);
        self.images.iter().for_each(|images| _ = hasher.update(images));
        hasher.finalize().to_hex().to_string()
    }

    /// Number of bytes.
    pub fn bytes(&self) -> u64 {
        (self.points.len() + self.images.as_ref().map_or(0, Vec::len)) as u64
    }
}

/// Writes files by their paths in a folder, which may have folders in it: all of them, or none.
pub(super) fn write_inside(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
    for (path, _) in files {
        let inner = folder.join(path);
        let inner = inner.parent().unwrap_or(folder);
        create_dir_all(inner)
            .map_err(|reason| FilesError::unwritable("create the folder", inner, reason))?;
    }
    Ok(write_all(folder, files)?)
}
