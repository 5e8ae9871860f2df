//! What a person should not overlook in a publication.

use super::about::About;
use super::licence::named_licences;
use super::publish::PublishSummary;
use super::tables::HAS_PARQUET;
use crate::material::form::licence_doubt;

impl PublishSummary {
    /// Sentences about what a person should not overlook in a publication that was described so.
    pub fn notices(&self, about: &About) -> Vec<String> {
        let mut notices = Vec::from_iter(about.licence.as_deref().and_then(licence_doubt));
        if !HAS_PARQUET {
            notices.push(
                "without Parquet tables; `cargo install --path . --features parquet` writes them, too"
                    .to_owned(),
            );
        }
        if let ([_, ..], Some(declared)) = (self.undeclared_licences.as_slice(), &about.licence) {
            notices.push(format!(
                "the catalogue is declared to be under {declared}, but materials in it are under {}; name these, \
                 too, in `licence` of --about FILE",
                named_licences(&self.undeclared_licences)
            ));
        }
        if self.is_without_zenodo {
            notices.push(
                "without .zenodo.json: Zenodo takes one licence of SPDX's list, and CC0 for what names none; \
                 choose the licence there by hand"
                    .to_owned(),
            );
        }
        if let (true, Some(version)) = (self.is_version_reused, &about.version) {
            notices.push(format!(
                "version {version} stood there with other data; give this one another `version` in --about FILE"
            ));
        }
        if !about.has_authors() {
            notices.push(
                "no author is named; add a [[person]] or an [[institute]] in --about FILE"
                    .to_owned(),
            );
        }
        notices
    }
}
