//! `--tracer`: how the rays of the scan are traced.

use crate::cli::console::Console;
use crate::trace::{Gpu, GpuError, Tracer};

/// Ways to trace the rays of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Rays {
    /// Rays of one origin as points of a picture; nothing is built
    Pinhole,
    /// A hierarchy of boxes, for any rays
    Bvh,
    /// Every facet for every ray
    Brute,
    /// The hierarchy on a graphics processor with a Vulkan driver; in programs built with `--features gpu`
    Gpu,
}

/// The graphics processor, if it is wanted and there is one.
pub(super) fn gpu(wanted: Option<Rays>, console: &Console) -> Result<Option<Gpu>, GpuError> {
    if wanted != Some(Rays::Gpu) {
        return Ok(None);
    }
    match Gpu::new() {
        Ok(gpu) => {
            console.notice(&format!("tracing on {}", gpu.adapter()));
            Ok(Some(gpu))
        }
        Err(none @ GpuError::NoAdapter { .. }) => {
            console.notice(&format!("{none}; tracing on the processor instead"));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

impl Rays {
    /// The tracer of this name; without a graphics processor that the program chooses.
    pub fn tracer(self) -> Tracer<'static> {
        match self {
            Rays::Pinhole => Tracer::Pinhole,
            Rays::Bvh => Tracer::Bvh,
            Rays::Brute => Tracer::Brute,
            Rays::Gpu => Tracer::Automatic,
        }
    }
}
