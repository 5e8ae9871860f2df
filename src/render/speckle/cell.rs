//! The part of a chirp's echo that an amplitude belongs to.

/// An echo in range.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Cell {
    /// Number of sheets in front of it.
    pub sheets: u8,
    /// Half of its path's length, with what sheets on it seem to add, m: the amplitude's phase is counted from there.
    pub range_m: f64,
    /// What sheets seem to add to the range, m.
    pub delay_m: f64,
    /// Ranges, m, between which it ends where other echoes begin.
    pub gate_m: [f64; 2],
}

/// The ranges, m, of a whole chirp.
pub(in crate::render) const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
