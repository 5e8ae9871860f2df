//! The evidence for a term.

use serde::Serialize;

/// A term in one round.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RankedTerm {
    /// Scattering model to which it was added: "declared", or the name of another.
    pub law: &'static str,
    /// Round, from 1.
    pub round: usize,
    /// The term.
    pub name: &'static str,
    /// Number of its parameters.
    pub numbers: usize,
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// Gain in ln p of held-out angles and its standard error; none off the short list.
    pub held_out: Option<[f64; 2]>,
    /// Root mean square change of the levels, dB.
    pub size_db: f64,
    /// Whether its fit converged.
    pub converged: bool,
    /// Whether it was added, and has a name.
    pub accepted: bool,
}

/// Why a term was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveEvidence {
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// Gain in ln p of held-out angles.
    pub held_out_gain: f64,
    /// Its standard error over runs of angles.
    pub held_out_se: f64,
    /// Root mean square change of the levels, dB.
    pub size_db: f64,
}
