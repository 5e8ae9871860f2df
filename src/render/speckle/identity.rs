//! What makes a surface's scatterers its own: the scan's seed, and the surface as it stands.

use crate::frames::{Global, Point};
use crate::radar::Channel;
use crate::radar::random::{Draws, Key, Purpose};
use crate::render::setup::Setup;

/// Names the scatterers of a scene. The same meshes in the same place have the same ones; moving one changes all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    /// The seed of everything that is fixed to the target.
    pub seed: u64,
    /// What else tells fields apart.
    pub surface: u64,
}

impl Identity {
    /// The identity of a setup's mesh with its vertices where `seen` has them, by frequency, channel and whatever
    /// `words` tells apart.
    pub fn of<Frame>(
        setup: &Setup,
        seen: impl Fn(Point<Global>) -> Point<Frame>,
        words: [u64; 2],
    ) -> Identity {
        let frequency = setup.geometry.radar.centre_frequency_ghz.to_bits();
        let cross_polar = u64::from(setup.channel == Channel::CrossPolar);
        let mut hasher = blake3::Hasher::new();
        for word in [frequency, cross_polar, words[0], words[1]] {
            hasher.update(&word.to_le_bytes());
        }
        let mut bytes = Vec::with_capacity(24 * setup.geometry.bvh.mesh().vertices.len());
        for &vertex in &setup.geometry.bvh.mesh().vertices {
            let vertex = seen(Point::from(vertex)).xyz;
            bytes.extend(vertex.to_array().iter().flat_map(|coordinate| coordinate.to_le_bytes()));
        }
        hasher.update(&bytes);
        let mut first = [0; 8];
        first.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
        Identity { seed: setup.seed, surface: u64::from_le_bytes(first) }
    }

    /// Draws for a place of a grid and a look.
    pub fn draws(self, purpose: Purpose, [x, y]: [i64; 2], look: usize) -> Draws {
        // 24 bits hold any grid that fits into memory.
        let word = |at: i64| (at as u64) & 0xFF_FFFF;
        let sub_ray = word(x) | word(y) << 24 | (look as u64) << 48;
        Key { seed: self.seed, chirp: self.surface, sub_ray, purpose }.draws()
    }
}
