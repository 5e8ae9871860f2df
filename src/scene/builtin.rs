//! Scenes that are part of the program: three calibration targets in front of the paper's radar, and mannequins.

use std::path::Path;

/// Names and texts.
pub const SCENES: [(&str, &str); 7] = [
    ("bench", include_str!("../../scenes/bench.toml")),
    ("calibration-plate", include_str!("../../scenes/calibration-plate.toml")),
    ("calibration-sphere", include_str!("../../scenes/calibration-sphere.toml")),
    ("calibration-trihedral", include_str!("../../scenes/calibration-trihedral.toml")),
    ("concealed", include_str!("../../scenes/concealed.toml")),
    ("concealed-object", include_str!("../../scenes/concealed-object.toml")),
    ("mannequin", include_str!("../../scenes/mannequin.toml")),
];

/// The text of a scene by its name, without `builtin:`.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The name of the built-in scene that a path means, `builtin:NAME`, whether or not there is one.
pub fn name(path: &Path) -> Option<&str> {
    path.to_str()?.strip_prefix("builtin:")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_built_in_scene_loads_and_those_for_calibration_are_targets() {
        let mut targets = 0;
        for (name, text) in SCENES {
            let path = format!("builtin:{name}");
            let scene = Scene::load(Path::new(&path)).unwrap();
            if name.starts_with("calibration-") {
                scene.reference_target(Path::new(&path)).unwrap();
                assert!(text.contains("system_loss_db"), "{name} says what is calibrated");
                targets += 1;
            }
        }
        assert_eq!(targets, 3);
    }
}
