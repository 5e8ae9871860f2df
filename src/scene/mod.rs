//! What the radar looks at.

pub mod mannequin;
pub mod solids;
