//! From names to values that the renderer takes: a material by `NAME` or `NAME@REVISION`, from a database or
//! from those that are built in, and a scene with the materials, laws and effects of its regions.
//!
//! ```
//! use matdb::setup::ReadyScene;
//!
//! let ready = ReadyScene::open("scenes/mannequin.toml".as_ref(), None)?;
//! let assembly = ready.assemble();
//! let setup = assembly.setup();
//! let footprints = assembly.trace(&setup, &|_| {})?;
//! let scan = assembly.shade(&setup, &footprints, &|_| {})?;
//! assert!(scan.detections().count() > 0);
//! # Ok::<(), matdb::error::Error>(())
//! ```

mod cloud;
mod database;
mod materials;
mod new_files;
mod new_material;
mod new_scene;
mod scene;
mod validity;
mod view;

pub use cloud::{absolute, pose_of_numbers, read_cloud, read_pose};
pub use database::{Database, USUAL_DATABASE};
pub use materials::{
    MaterialRevision, builtin_not_added, find_material, later_status_warning, status_warning,
    store_of_not_added, unknown_material,
};
pub use new_files::write_new;
pub use new_material::{MATERIAL_TEMPLATE, new_material};
pub use new_scene::{MadeScene, NewScene};
pub use scene::{Assembly, ReadyScene, SceneMaterial, resolve_effects};
pub use validity::{ValidityWarning, unmet_conditions, unmet_sentence};
pub use view::{View, antenna};
