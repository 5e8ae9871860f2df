//! Errors of tracing on a graphics processor.

use thiserror::Error;

/// Why a graphics processor cannot trace.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum GpuError {
    /// The program was built without the feature `gpu`.
    #[error(
        "this matdb was built without the tracer `gpu`; build it with `--features gpu`, or leave the choice to \
         the program"
    )]
    NotBuilt,
    /// There is no driver that can compute.
    #[error("the tracer `gpu` finds no adapter with a Vulkan driver: {reason}")]
    NoAdapter {
        /// The message of the search.
        reason: String,
    },
    /// The mesh or its hierarchy exceeds the device's largest buffer.
    #[error(
        "the mesh takes {needed} bytes in one buffer of `{adapter}`, which has room for {most}; use the tracer `bvh`"
    )]
    TooLarge {
        /// The device.
        adapter: String,
        /// Bytes needed.
        needed: u64,
        /// Bytes of the largest buffer.
        most: u64,
    },
    /// The materials or the rays of a spot exceed the device's largest buffer.
    #[error(
        "the materials and spots of the scans take {needed} bytes in one buffer of `{adapter}`, which has room for \
         {most}; give fewer scans at once"
    )]
    TooMany {
        /// The device.
        adapter: String,
        /// Bytes needed.
        needed: u64,
        /// Bytes of the largest buffer.
        most: u64,
    },
    /// The device has no free memory.
    #[error("`{adapter}` has no memory left for {needed} bytes; use the tracer `bvh`")]
    Full {
        /// The device.
        adapter: String,
        /// Bytes requested.
        needed: u64,
    },
    /// The device stopped working.
    #[error("`{adapter}` stopped working: {reason}; try again, or use the tracer `bvh`")]
    Lost {
        /// The device.
        adapter: String,
        /// The message of the driver.
        reason: String,
    },
    /// The device holds another mesh.
    #[error("the tracer `gpu` holds another mesh than the one that is traced; hold this one")]
    OtherMesh,
}
