//! The known materials that a measured curve is nearest to, in a database and among those that are built in.

use serde::Serialize;

use crate::catalogue::{Distance, Nearest, Probe, Rank};
use crate::error::Error;
use crate::formats::words::listed;
use crate::material::{Illumination, Observation, Slug};
use crate::radar::Footprint;
use crate::setup::{MaterialRevision, find_material, store_of_not_added};
use crate::store::{Filter, Store};
use crate::units::rounded;

/// A curve whose neighbours are wanted.
#[derive(Clone, Debug)]
pub struct NeighbourSearch {
    /// Its points.
    pub observations: Vec<Observation>,
    /// How its target was lit, as far as it is stated.
    pub illumination: Illumination,
    /// Frequency at which it was measured, Hz; `None` where it is not stated.
    pub frequency_hz: Option<f64>,
    /// The material that the curve is of, which is left out, if it is the current revision.
    pub own: Option<Slug>,
}

/// A material and how far it is.
#[derive(Clone, Debug, Serialize)]
pub struct Neighbour {
    /// Its short name.
    pub slug: Slug,
    /// Its full name.
    pub name: String,
    /// None for a built-in one that is not in the database.
    pub revision: Option<u32>,
    /// Of the data behind what scenes render.
    pub kind: &'static str,
    /// Of a model that goes with a curve, which nobody measured itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind_words: Option<String>,
    /// Whether it may still be used: `active`, `superseded`, `withdrawn`.
    pub status: String,
    /// For which its numbers are claimed.
    pub frequency_ghz: [f64; 2],
    /// How far the curve's frequency lies outside of these, 0 within; none where it is not stated.
    pub frequency_outside_ghz: Option<f64>,
    /// Whether what scenes render of it is a curve or belongs to one.
    #[serde(skip)]
    pub is_of_a_curve: bool,
    /// Whether the levels of that curve are relative, so that only its shape can be compared.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_relative: bool,
    /// Form of the footprint of that curve; none where it is not stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub footprint: Option<Footprint>,
    /// How far it is.
    #[serde(flatten)]
    pub distance: Distance,
}

/// The neighbours of a curve, nearest first.
#[derive(Clone, Debug, Serialize)]
pub struct NeighbourReport {
    /// At which the curve was measured; none where it is not stated.
    pub measured_at_ghz: Option<f64>,
    /// Form of the footprint with which the curve was reduced; none where it is not stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub footprint: Option<Footprint>,
    /// What a person should not overlook.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
    /// Number of the curve's angles.
    pub angles: usize,
    /// The distance to the true material that chance alone makes, dB.
    pub noise_db: Option<f64>,
    /// Number of materials with too little in common.
    pub left_out: usize,
    /// The nearest materials.
    pub materials: Vec<Neighbour>,
}

impl NeighbourSearch {
    /// The longest curve of a material, `NAME` or `NAME@REVISION`; `measured_at_hz` is stated instead of the frequency
    /// of its instrument.
    ///
    /// # Errors
    /// A material that is not known, or has no curve.
    pub fn of_material(
        name: &str,
        measured_at_hz: Option<f64>,
        store: Option<&Store>,
    ) -> Result<NeighbourSearch, Error> {
        let MaterialRevision { material, revision } = find_material(store, name, "")?;
        let current = store.map(|store| store.summary(&material.slug)).transpose()?.flatten();
        let is_current = current.map(|current| current.revision) == revision;
        let Some(curve) = material.longest_curve() else {
            return Err(Error::NoCurve { material: name.to_owned() });
        };
        let instrument =
            material.instruments.iter().find(|own| Some(&own.key) == curve.instrument.as_ref());
        Ok(NeighbourSearch {
            observations: curve.observations.clone(),
            illumination: curve.illumination,
            frequency_hz: measured_at_hz
                .or(instrument.map(|own| own.centre_frequency_hz))
                .or(Some(material.frequency_hz[0]).filter(|hz| *hz == material.frequency_hz[1])),
            own: is_current.then(|| material.slug.clone()),
        })
    }

    /// The nearest materials of `store`, as far as `filter` lets them through, and of those that are built in; at most
    /// `limit`.
    ///
    /// # Errors
    /// A curve of which nothing was detected; a database that cannot be read.
    pub fn run(
        &self,
        store: Option<&Store>,
        filter: &Filter,
        rank: Rank,
        limit: usize,
    ) -> Result<NeighbourReport, Error> {
        let Some(probe) = Probe::new(&self.observations) else {
            return Err(Error::usage(
                "nothing of the curve was detected, or a point lies above the instrument's range",
                "give a curve with detections below that range",
            ));
        };
        let probe = probe.lit(self.illumination);
        let built_in = store_of_not_added(store)?;
        let mut report = NeighbourReport {
            footprint: self.illumination.footprint,
            notices: Vec::new(),
            measured_at_ghz: self.frequency_hz.map(|hz| rounded(hz / 1e9)),
            angles: probe.angles(),
            noise_db: probe.noise_db(),
            left_out: 0,
            materials: Vec::new(),
        };
        for (store, is_stored) in [(store, true), (Some(&built_in), false)] {
            let Some(store) = store else { continue };
            // One more than wanted: the material itself is left out.
            let Nearest { found, left_out, damaged } =
                probe.nearest(store, filter, rank, limit.saturating_add(1))?;
            report.left_out += left_out;
            report.notices.extend(damaged.iter().map(|slug| {
                format!("`{slug}` is damaged and is left out; `matdb check` lists all damage")
            }));
            for (slug, distance) in found {
                if self.own.as_ref() != Some(&slug) {
                    report.materials.extend(self.neighbour(store, &slug, is_stored, distance)?);
                }
            }
        }
        report.materials.sort_by(|a, b| {
            let distance = a.distance.rank_db(rank).total_cmp(&b.distance.rank_db(rank));
            distance.then_with(|| a.slug.cmp(&b.slug))
        });
        report.materials.truncate(limit);
        report.notices.extend(self.one_sided(&report.materials));
        if self.illumination.only_detected {
            let notice = "the curve holds only detections: where few chirps passed the threshold, its levels are too high";
            report.notices.push(notice.to_owned());
        }
        if probe.has_pairs() {
            let notice = "where source and receiver were in two directions the curve is compared with what scenes render \
                          there: of a material that is known from backscatter alone, that is extrapolated";
            report.notices.push(notice.to_owned());
        }
        Ok(report)
    }

    /// That the footprint is stated of only one of the two sides that are compared.
    fn one_sided(&self, found: &[Neighbour]) -> Option<String> {
        let is_stated = self.illumination.footprint.is_some();
        let others = found.iter().filter(|near| near.is_of_a_curve);
        let others = others.filter(|near| near.footprint.is_some() != is_stated);
        let names: Vec<String> = others.map(|near| near.slug.to_string()).collect();
        let (own, theirs) =
            if is_stated { ("states", "no curve of") } else { ("does not state", "the curve of") };
        (!names.is_empty()).then(|| {
            format!(
                "the curve {own} the footprint with which it was reduced, {theirs} {} does: these levels are \
                 compared as they are, which is worth 3 dB at 60°",
                listed(&names)
            )
        })
    }

    fn neighbour(
        &self,
        store: &Store,
        slug: &Slug,
        is_stored: bool,
        distance: Distance,
    ) -> Result<Option<Neighbour>, Error> {
        let (Some(summary), Some(stored)) = (store.summary(slug)?, store.get(slug, None)?) else {
            return Ok(None);
        };
        let material = stored.material;
        let curve = material.rendered_curve();
        let outside_hz = self.frequency_hz.map(|hz| material.frequency_outside_hz(hz));
        Ok(Some(Neighbour {
            slug: summary.slug,
            name: summary.name,
            revision: is_stored.then_some(summary.revision),
            kind: summary.render_kind.as_str(),
            kind_words: material.rendered_words(),
            status: summary.status,
            frequency_ghz: material.frequency_hz.map(|hz| rounded(hz / 1e9)),
            frequency_outside_ghz: outside_hz.map(|hz| rounded(hz / 1e9)),
            is_of_a_curve: curve.is_some(),
            is_relative: curve.is_some_and(|curve| curve.illumination.relative),
            footprint: curve.and_then(|curve| curve.illumination.footprint),
            distance,
        }))
    }
}
