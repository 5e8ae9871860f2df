//! Why a graphics processor does not trace.

use thiserror::Error;

/// Why a graphics processor does not trace.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum GpuError {
    /// The program was built without it.
    #[error(
        "this matdb was built without the tracer `gpu`; build it with `--features gpu`, or leave the choice to \
         the program"
    )]
    NotBuilt,
    /// No driver, or none that can compute.
    #[error("the tracer `gpu` finds no adapter with a Vulkan driver: {reason}")]
    NoAdapter {
        /// What the search says.
        reason: String,
    },
    /// The mesh and its hierarchy are larger than the device takes.
    #[error(
        "the mesh takes {needed} bytes in one buffer of `{adapter}`, which has room for {most}; use the tracer `bvh`"
    )]
    TooLarge {
        /// The device.
        adapter: String,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that it has.
        most: u64,
    },
    /// More materials, or more rays in a spot, than the device takes.
    #[error(
        "the materials and spots of the scans take {needed} bytes in one buffer of `{adapter}`, which has room for \
         {most}; give fewer scans at once"
    )]
    TooMany {
        /// The device.
        adapter: String,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that it has.
        most: u64,
    },
    /// The device's memory is in use.
    #[error("`{adapter}` has no memory left for {needed} bytes; use the tracer `bvh`")]
    Full {
        /// The device.
        adapter: String,
        /// Bytes that were asked for.
        needed: u64,
    },
    /// It stopped.
    #[error("`{adapter}` stopped working: {reason}; try again, or use the tracer `bvh`")]
    Lost {
        /// The device.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// It holds another mesh.
    #[error("the tracer `gpu` holds another mesh than the one that is traced; hold this one")]
    OtherMesh,
}
