//! What goes back into the database: materials of files, measured curves, fits, and the law and the effects that a
//! diagnosis found; each with its sources and with the command and the files that made it. Also catalogues of others
//! and for others, and what keeps a database sound: its check, withdrawals and removals.

mod earlier;
pub mod admission;
mod catalogue_import;
mod catalogue_publication;
mod curve;
mod database_check;
mod findings;
mod fit_request;
mod fit_storage;
mod fit_subject;
mod fitted_material;
mod material_files;
mod measurement;
mod provenance;
mod publication;
mod recipients;
mod removal;
mod request;
mod scene_after;
mod withdrawal;

pub use catalogue_import::CatalogueImport;
pub use catalogue_publication::{publish, verify};
pub use curve::{AddedCurve, CurveOrigin, add_curve, check_frequency_and_threshold};
pub use database_check::{CheckProgress, CheckReport, DatabaseCheck};
pub use earlier::{Earlier, check_folder};
pub use fit_request::{CheckedFit, FitMethod, FitOutcome, FitRequest, FitStart};
pub use fit_storage::{FitStorage, NewFit, StoredFit};
pub use fit_subject::FitSubject;
pub use fitted_material::FittedMaterial;
pub use material_files::{AddedMaterial, NewMaterials, foreign_format};
pub use measurement::{MeasurementStorage, StoredMeasurement};
pub use provenance::{activity, add_source, input};
pub use publication::{Publication, PublicationResult, program};
pub use recipients::{
    Adoption, Recipient, check_recipients, find_recipient, pinned_name, replaced_name,
};
pub use removal::{Removal, remove_materials};
pub use request::{CheckedRequest, CloudRequest, LoadedScene, as_answer, scene_of_each};
pub use scene_after::{
    AFTER, MARK, check_beside, moved_scene, name_beside, relocate_files, scene_with_found,
};
pub use withdrawal::Withdrawal;
