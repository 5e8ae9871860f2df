//! The files of a shard.

use super::archive::archive;
use super::images::Members;
use super::points;
use super::scan::MadeScan;
use super::table;
use crate::error::Error;

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
        let groups = scans.iter().map(|scan| scan.points.clone());
        let points = table::write("points", &points::columns(), groups)?;
        let members: Vec<(String, Members)> =
            scans.iter().map(|scan| (scan.record.key.clone(), scan.images.clone())).collect();
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
