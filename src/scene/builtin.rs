//! Scenes that are part of the program: the three calibration targets in front of the paper's radar.

/// Names and texts.
pub const SCENES: [(&str, &str); 3] = [
    ("calibration-plate", include_str!("../../scenes/calibration-plate.toml")),
    ("calibration-sphere", include_str!("../../scenes/calibration-sphere.toml")),
    ("calibration-trihedral", include_str!("../../scenes/calibration-trihedral.toml")),
];

/// The text of a scene by its name, without `builtin:`.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_built_in_scene_is_a_calibration_target() {
        for (name, text) in SCENES {
            let path = format!("builtin:{name}");
            let scene = Scene::load(Path::new(&path)).unwrap();
            scene.reference_target(Path::new(&path)).unwrap();
            assert!(text.contains("system_loss_db"), "{name} says what is calibrated");
        }
    }
}
