//! Every effect, one file each.

use super::effect::Effect;

/// Declares the file of every effect and lists them all, in the order in which they act.
macro_rules! library {
    ($($file:ident::$effect:ident),+ $(,)?) => {
        $(pub(super) mod $file;)+

        /// Every effect, in the order in which they act on a chirp.
        pub fn library() -> [&'static dyn Effect; [$(stringify!($file)),+].len()] {
            [$(&$file::$effect),+]
        }
    };
}

// `cargo fmt` does not follow modules in a macro: `rustfmt src/effects/library/*.rs` does them.
library! {
    pose::Pose,
    motion::Motion,
    subsurface::Subsurface,
    thin_film::ThinFilm,
    anisotropy::Anisotropy,
    correlated_shadowing::CorrelatedShadowing,
    covering_layer::CoveringLayer,
    foreign_patch::ForeignPatch,
    fov_gain::FovGain,
    drift::Drift,
    finite_spot::FiniteSpot,
    multi_bounce::MultiBounce,
    compression::Compression,
    angle_error::AngleError,
    speckle::Speckle,
    noise_floor::NoiseFloor,
}

/// The effect of that name; `None` when the library has none.
///
/// ```
/// assert_eq!(matdb::effects::find("drift").unwrap().name(), "drift");
/// assert!(matdb::effects::find("witchcraft").is_none());
/// ```
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    library().into_iter().find(|effect| effect.name() == name)
}

/// Place of an effect in the order in which effects act.
pub(crate) fn rank(name: &str) -> usize {
    library().iter().take_while(|effect| effect.name() != name).count()
}
