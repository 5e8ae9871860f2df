//! Names of the files of a data set.

/// The plan: what was found out before the first scan.
pub(super) const PLAN: &str = "plan.toml";
/// The specification, as it was written.
pub(super) const SPEC: &str = "spec.toml";
/// The folder of what a data set is made of.
pub(super) const INPUTS: &str = "inputs";
/// The scene, as it was written.
pub(super) const SCENE: &str = "inputs/scene.toml";
/// The materials of its regions.
pub(super) const MATERIALS: &str = "inputs/materials.json";
/// The table of all scans.
pub(super) const SCANS: &str = "scans.parquet";
/// Folders of what shards write.
pub(super) const FOLDERS: [&str; 3] = ["points", "images", "manifests"];

/// The table of a shard's points.
pub(super) fn points(shard: &str) -> String {
    format!("points/{shard}.parquet")
}

/// The archive of a shard's images.
pub(super) fn images(shard: &str) -> String {
    format!("images/{shard}.tar")
}

/// What a shard says of itself.
pub(super) fn manifest(shard: &str) -> String {
    format!("manifests/{shard}.json")
}
