//! What a reduction leaves out.

/// Detections and silent chirps that did not become rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exclusions {
    /// Detections whose ray misses the target.
    pub missed: usize,
    /// Detections farther from the surface than five times the registration's range error.
    pub off_surface: usize,
    /// Detections of another region.
    pub other_region: usize,
    /// Detections near a silhouette, a step or another region.
    pub near_edge: usize,
    /// Silent chirps near one of these.
    pub silent_near_edge: usize,
    /// Detections and silent chirps whose facet is uncertain within the errors of the pose; for an exact
    /// mesh only.
    pub unsure_of_facet: usize,
}
