//! The nearest of many materials: in outline all of them, in full only those that may be among the best.
//!
//! The outline of a material gives a lower bound of its distance. Materials are compared in the order of these
//! bounds, until the next bound exceeds the worst distance that is still wanted; equal models are compared once.
//! The result equals that of comparing every material.

use std::collections::HashMap;

use rayon::prelude::*;

use super::near::{Distance, Probe, Rank};
use crate::material::{Lobes, Slug};
use crate::radar::Footprint;
use crate::store::{Filter, OutlineEntry, Store, StoreError};

/// The materials that a curve is nearest to.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The nearest first; of equally near ones the first by name.
    pub found: Vec<(Slug, Distance)>,
    /// How many have too little in common with the curve, or are damaged.
    pub left_out: usize,
    /// Names of the damaged ones.
    pub damaged: Vec<String>,
}

impl Probe {
    /// The `most` nearest materials among those that a filter lets through.
    ///
    /// # Errors
    /// When the database cannot be read.
    pub fn nearest(
        &self,
        store: &Store,
        filter: &Filter,
        rank: Rank,
        most: usize,
    ) -> Result<Nearest, StoreError> {
        let lines = store.outlines(filter)?;
        let mut candidates: Vec<(f64, usize)> = lines
            .par_iter()
            .enumerate()
            .filter_map(|(place, line)| Some((self.least_db(line, rank)?, place)))
            .collect();
        let mut left_out = lines.len() - candidates.len();
        candidates.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best = Best { rank, most, found: Vec::new() };
        let mut known = HashMap::new();
        for (least_db, place) in candidates {
            if least_db > best.worst_db() {
                break;
            }
            let Some(line) = lines.get(place) else { continue };
            match self.in_full(store, line, &mut known)? {
                Some(distance) => best.take(place, distance),
                None => left_out += 1,
            }
        }
        let mut found = Vec::with_capacity(best.found.len());
        for (place, distance) in best.found {
            let slug = lines.get(place).and_then(|line| line.slug.parse::<Slug>().ok());
            found.extend(slug.map(|slug| (slug, distance)));
        }
        let damaged = lines.into_iter().filter(|line| line.is_damaged).map(|line| line.slug);
        Ok(Nearest { found, left_out, damaged: damaged.collect() })
    }

    /// A lower bound of the distance to a material, dB; none where the two cannot be compared.
    fn least_db(&self, line: &OutlineEntry, rank: Rank) -> Option<f64> {
        match (&line.model_hash, &line.outline) {
            (None, _) => None,
            _ if line.is_damaged => None,
            // An outline is that of the surface and not of what a beam sees.
            _ if self.widens(line.lobes) => Some(f64::NEG_INFINITY),
            (_, None) => Some(f64::NEG_INFINITY),
            (_, Some(outline)) => self.at_least(outline, line.theta_rad, line.footprint, rank),
        }
    }

    /// The distance to a material, computed once for all materials of equal model and range.
    fn in_full(
        &self,
        store: &Store,
        line: &OutlineEntry,
        known: &mut HashMap<Likeness, Option<Distance>>,
    ) -> Result<Option<Distance>, StoreError> {
        let OutlineEntry { model_hash, theta_rad, footprint, lobes, .. } = *line;
        let likeness = (model_hash, theta_rad.map(f64::to_bits), footprint, lobes);
        if let Some(distance) = known.get(&likeness) {
            return Ok(*distance);
        }
        let Ok(slug) = line.slug.parse() else { return Ok(None) };
        let rendered = store.rendered(&slug)?;
        let distance = rendered
            .and_then(|(law, theta_rad)| self.distance_of(&law, theta_rad, footprint, lobes));
        known.insert(likeness, distance);
        Ok(distance)
    }
}

/// Equal exactly for materials of equal model, range, footprint and lobes.
type Likeness = (Option<[u8; 16]>, [u64; 2], Option<Footprint>, Lobes);

/// The nearest so far, with their places in the order of names.
struct Best {
    rank: Rank,
    most: usize,
    found: Vec<(usize, Distance)>,
}

impl Best {
    /// What is farther than this is not among the best, dB.
    fn worst_db(&self) -> f64 {
        match self.found.last() {
            _ if self.found.len() < self.most => f64::INFINITY,
            Some((_, distance)) => distance.rank_db(self.rank),
            None => f64::NEG_INFINITY,
        }
    }

    fn take(&mut self, place: usize, distance: Distance) {
        let new_db = distance.rank_db(self.rank);
        let at = self.found.partition_point(|(other, known)| {
            known.rank_db(self.rank).total_cmp(&new_db).then(other.cmp(&place)).is_lt()
        });
        if at < self.most {
            self.found.insert(at, (place, distance));
            self.found.truncate(self.most);
        }
    }
}
