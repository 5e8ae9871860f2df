//! `view.html`: a cloud in three dimensions, with its target, its radar and its image, in one page that asks for no other
//! file.

mod around;
mod catalogue;
mod diagnosis;
mod labels;
mod page;
mod rendering;

pub use catalogue::CATALOGUE_VIEW;
pub(super) use diagnosis::diagnosis_page;
pub use rendering::rendering_page;
