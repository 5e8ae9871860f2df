//! Files of several scans in one archive, as WebDataset takes them: members of a scan follow each other and have its key.

use std::borrow::Borrow;
use std::io;

use super::images::Members;
use crate::error::Error;

/// An archive of the members of some scans. The same members give the same bytes.
///
/// # Errors
/// A name that no archive takes.
pub(super) fn archive(scans: &[(&str, impl Borrow<Members>)]) -> Result<Vec<u8>, Error> {
    write(scans).map_err(|reason| {
        Error::usage(
            format!("the files of some scans could not be put into an archive: {reason}"),
            "report this",
        )
    })
}

fn write(scans: &[(&str, impl Borrow<Members>)]) -> io::Result<Vec<u8>> {
    let mut archive = tar::Builder::new(Vec::new());
    for (key, members) in scans {
        for (name, bytes) in members.borrow() {
            let mut header = tar::Header::new_ustar();
            header.set_size(bytes.len() as u64);
            header.set_mode(0o644);
            header.set_mtime(0);
            archive.append_data(&mut header, format!("{key}.{name}"), &bytes[..])?;
        }
    }
    archive.into_inner()
}
