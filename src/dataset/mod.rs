//! Labelled data sets: many scans of a scene in which something varies, for whoever trains a recognition.
//!
//! A [plan](Dataset::make_plan) has the specification, the scene, its meshes and its materials, so that its folder is all that
//! [`run`](Dataset::run) needs. A scan depends on the plan and its own number, and on nothing else: the same bytes for any number
//! of threads, machines and interruptions. Shards are the unit of work; each is there as a whole or not at all.
//!
//! The order of the modules: what is drawn, where it is put, what is labelled, what is written.

mod archive;
mod boxes;
mod card;
mod check;
mod croissant;
mod draw;
mod effect;
mod images;
mod labels;
mod layout;
mod place;
mod plan;
mod points;
mod posterior;
mod publish;
mod recipe;
mod run;
mod scan;
mod scans;
mod shard;
mod spec;
mod split;
mod streams;
mod table;

pub use check::DatasetCheck;
pub use labels::Classes;
pub use plan::{Dataset, Input, Plan, PlannedSplit};
pub use publish::DatasetPublication;
pub use run::{DatasetProgress, DatasetRun};
pub use spec::{Choice, ChoiceOption, EffectDraw, Numbers, Placing, Posterior, Spec, Variation};
