//! Outlines of the rendered models of all materials, for the search of the nearest one.

use std::collections::BTreeMap;

use rusqlite::{Connection, Result, Row, params, params_from_iter};

use super::filter::{self, Filter};
use super::moment;
use super::stale::check_outlines;
use crate::brdf::{Brdf, Outline};
use crate::material::{Lobes, Slug};
use crate::radar::Footprint;
use crate::store::database::Store;
use crate::store::error::{InFile, StoreError, is_damage};
use crate::store::read::{Rendered, rendered_in};
use crate::store::rows::rows;

/// Outline of the model that scenes render of a material's current revision.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineEntry {
    /// Short name.
    pub slug: String,
    /// Its range of incidence angles, rad: [`Reach::span_rad`](crate::material::Reach::span_rad).
    pub theta_rad: [f64; 2],
    /// Hash of the model; none where there is no model to render.
    pub model_hash: Option<[u8; 16]>,
    /// Its levels; none for a model without an outline.
    pub outline: Option<Outline>,
    /// Form of the footprint of the curve that it is, or that it was fitted to; none where that is not stated.
    pub footprint: Option<Footprint>,
    /// Whose lobes the model has.
    pub lobes: Lobes,
}

const COLUMNS: &str = "slug, theta_min_rad, theta_max_rad, model_hash, levels, footprint, lobes";

impl Store {
    /// Outlines of the materials that match a filter, sorted by name.
    ///
    /// # Errors
    /// When the file cannot be read; where a list or an outline is not that of what is stored, which is compared up to
    /// 8 MiB.
    pub fn outlines(&self, filter: &Filter) -> std::result::Result<Vec<OutlineEntry>, StoreError> {
        let found = || {
            let tx = moment(&self.conn)?;
            check_outlines(&tx, filter)?;
            all(&tx, filter)
        };
        found().in_file(&self.path)
    }
}

fn all(conn: &Connection, filter: &Filter) -> Result<Vec<OutlineEntry>> {
    if *filter == Filter::default() {
        return rows(conn, &format!("SELECT {COLUMNS} FROM outline ORDER BY slug"), [], outlined);
    }
    let (from, values) = filter::from_rarest(conn, filter)?;
    let columns = COLUMNS.replace("slug", "outline.slug");
    let sql = format!(
        "SELECT {columns} FROM (SELECT slug {from}) AS wanted
         CROSS JOIN outline ON outline.slug = wanted.slug"
    );
    let mut found = rows(conn, &sql, params_from_iter(values), outlined)?;
    found.sort_by(|a, b| a.slug.cmp(&b.slug));
    Ok(found)
}

fn outlined(row: &Row) -> Result<OutlineEntry> {
    let levels = row.get_ref(4)?.as_blob_or_null()?;
    Ok(OutlineEntry {
        slug: row.get(0)?,
        theta_rad: [row.get(1)?, row.get(2)?],
        model_hash: row.get(3)?,
        outline: levels.and_then(Outline::from_bytes),
        footprint: row.get(5)?,
        lobes: row.get::<_, Option<Lobes>>(6)?.unwrap_or_default(),
    })
}

/// Writes or replaces the outline of a material that is in the lists.
pub(crate) fn write(conn: &Connection, line: &OutlineEntry) -> Result<()> {
    let sql = "INSERT OR REPLACE INTO outline
               (slug, theta_min_rad, theta_max_rad, model_hash, levels, footprint, lobes)
               VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let [theta_min_rad, theta_max_rad] = line.theta_rad;
    let levels = line.outline.as_ref().map(Outline::to_bytes);
    let values = params![
        line.slug,
        theta_min_rad,
        theta_max_rad,
        line.model_hash,
        levels,
        line.footprint.map(Footprint::as_str),
        Some(line.lobes).filter(|lobes| !lobes.is_of_both()).map(Lobes::as_str),
    ];
    conn.prepare_cached(sql)?.execute(values).map(|_| ())
}

/// The outline of a material of which this is rendered.
pub(crate) fn line(slug: &Slug, rendered: &Rendered) -> OutlineEntry {
    let model = rendered.model.as_ref();
    OutlineEntry {
        slug: slug.to_string(),
        theta_rad: rendered.theta_rad,
        model_hash: model.and_then(model_hash),
        outline: model.and_then(Outline::new),
        footprint: rendered.footprint,
        lobes: rendered.lobes,
    }
}

fn model_hash(model: &Brdf) -> Option<[u8; 16]> {
    let hash = blake3::hash(&serde_json::to_vec(model).ok()?);
    hash.as_bytes().first_chunk().copied()
}

/// Writes the outlines of all materials, for a file from an older program.
pub(crate) fn fill(conn: &Connection) -> Result<()> {
    each(conn, |line| write(conn, &line)).map(|_| ())
}

/// Outlines that are not those of what is stored.
pub(super) struct Stale {
    /// Materials with another outline than that of their rendered model.
    pub changed: Vec<String>,
    /// Materials whose rendered model cannot be read.
    pub unreadable: Vec<Slug>,
}

/// Compares the outlines with the rendered models.
pub(super) fn stale(conn: &Connection) -> Result<Stale> {
    let mut kept: BTreeMap<String, OutlineEntry> =
        all(conn, &Filter::default())?.into_iter().map(|line| (line.slug.clone(), line)).collect();
    let mut changed = Vec::new();
    let unreadable = each(conn, |line| {
        if !kept.remove(&line.slug).is_some_and(|kept| is_same(&kept, &line)) {
            changed.push(line.slug);
        }
        Ok(())
    })?;
    kept.retain(|slug, _| !unreadable.iter().any(|other| other.as_str() == slug));
    changed.extend(kept.into_keys());
    Ok(Stale { changed, unreadable })
}

fn is_same(kept: &OutlineEntry, made: &OutlineEntry) -> bool {
    let levels = match (&kept.outline, &made.outline) {
        (Some(kept), Some(made)) => kept.is_like(made),
        (kept, made) => kept == made,
    };
    levels
        && (kept.theta_rad, kept.model_hash) == (made.theta_rad, made.model_hash)
        && (kept.footprint, kept.lobes) == (made.footprint, made.lobes)
}

/// Gives `take` the outline that each material should have. Returns the materials that cannot be read: they must not
/// make the whole file unreadable.
fn each(conn: &Connection, mut take: impl FnMut(OutlineEntry) -> Result<()>) -> Result<Vec<Slug>> {
    let slugs: Vec<Slug> = rows(conn, "SELECT slug FROM material", [], |row| row.get(0))?;
    let mut unreadable = Vec::new();
    for slug in slugs {
        match rendered_in(conn, &slug) {
            Err(error) if is_damage(&error) => unreadable.push(slug),
            found => match found? {
                Some(rendered) => take(line(&slug, &rendered))?,
                None => unreadable.push(slug),
            },
        }
    }
    Ok(unreadable)
}
