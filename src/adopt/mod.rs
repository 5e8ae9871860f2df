//! What goes back into the database: the law and the effects that a diagnosis found, with the sources and the
//! command that they rest on.

mod earlier;
mod findings;
mod provenance;
mod publication;
mod recipients;
mod request;
mod scene_after;

pub use earlier::{Earlier, check_folder};
pub use provenance::{activity, add_source, free_key, input};
pub use publication::{Publication, Published};
pub use recipients::{
    Adoption, Recipient, check_fit_name, find_recipient, pinned_name, replaced_name,
};
pub use request::{CheckedRequest, CloudRequest, as_answer};
pub use scene_after::{AFTER, MARK, check_beside, name_beside, relocate_files, scene_with_found};
