//! What goes back into the database: the law and the effects that a diagnosis found, with the sources and the
//! command that they rest on.

mod findings;
mod provenance;
mod recipients;
mod scene_after;

pub use provenance::{activity, add_source, free_key, input};
pub use recipients::{
    Adoption, Recipient, check_fit_name, find_recipient, pinned_name, replaced_name,
};
pub use scene_after::{AFTER, MARK, check_beside, name_beside, relocate_files, scene_with_found};
