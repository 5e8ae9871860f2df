//! All promises of the program, a module each: one program compiles and links far faster than sixty, and what they share is
//! compiled once. `cargo test --test promises sheets::` runs the promise of `sheets.rs`.
//!
//! Apart from it stands `store_all_or_nothing/`, which puts hooks on every connection of its process to the database.

mod air;
mod any_pose;
mod bad_input;
mod bare_program;
mod book;
mod builtin_catalogue;
mod calibrate_command;
mod chain;
mod changed_keys;
mod check_command;
mod closed_forms;
mod closest_hits;
mod closing_the_loop;
mod completions;
mod damaged_pages;
#[cfg(feature = "parquet")]
mod data_sets;
mod database;
mod diagnose_add;
mod diagnose_command;
mod diagnose_curve_command;
mod documentation;
mod energy;
mod exchange;
mod finding;
mod fit_command;
mod fitting_page;
mod floors;
mod foreign_files;
mod fuzz_targets;
#[cfg(feature = "gpu")]
mod gpu_batch;
#[cfg(feature = "gpu")]
mod gpu_tracer;
mod hostile_files;
mod hostile_text;
mod illumination;
mod import_command;
mod instrument;
mod killed;
mod levels_page;
mod mannequin_asset;
mod material_values;
mod measure_command;
mod nearest;
mod one_beam;
mod orthogonal_distance;
mod other_code;
mod outside_the_range;
mod peer_files;
mod performance_page;
mod polarisation;
mod power_from_scan_json;
mod publish_command;
#[cfg(feature = "parquet")]
mod publish_parquet;
mod published_site;
mod radar_command;
mod real_curves;
mod rendered_effects;
mod same_bytes;
mod shared_meshes;
mod sheets;
mod site_in_a_browser;
mod speckle;
mod store_concurrent;
mod store_damage;
mod store_refuses;
mod store_round_trip;
mod store_schema;
mod store_values;
mod supply_chain;
mod support;
mod twins;
mod twins_speckle;
mod validation;
mod validity;
mod view_in_a_browser;
