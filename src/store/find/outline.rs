//! Outlines of the rendered models of all materials, for the search of the nearest one.

use std::collections::BTreeMap;

use rusqlite::{Connection, Result, Row, params, params_from_iter};

use super::filter::{self, Filter};
use crate::brdf::{Brdf, Outline};
use crate::material::{Lobes, Slug};
use crate::radar::Footprint;
use crate::store::error::is_damage;
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
    /// Whether the material is damaged; this is what was stored.
    pub is_damaged: bool,
}

const COLUMNS: &str = "slug, theta_min_rad, theta_max_rad, model_hash, levels, footprint, lobes";

/// Outlines of the materials that match a filter, sorted by name.
pub(super) fn all(conn: &Connection, filter: &Filter) -> Result<Vec<OutlineEntry>> {
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
        is_damaged: false,
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
        is_damaged: false,
    }
}

fn model_hash(model: &Brdf) -> Option<[u8; 16]> {
    let hash = blake3::hash(&serde_json::to_vec(model).ok()?);
    hash.as_bytes().first_chunk().copied()
}

/// Writes the outlines of all materials, for a file from an older program. Those of which the current revision is on
/// damaged pages, `torn`, get none.
pub(crate) fn fill(conn: &Connection, torn: &[i64]) -> Result<()> {
    let sql = "SELECT slug FROM material JOIN revision NOT INDEXED
               ON material_id = material.id AND number = current_revision
               WHERE revision.id IN (SELECT value FROM json_each(?1))";
    let torn = serde_json::json!(torn).to_string();
    let torn: Vec<Slug> = rows(conn, sql, [torn], |row| row.get(0))?;
    each(conn, &torn, |line| write(conn, &line)).map(|_| ())
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
    let unreadable = each(conn, &[], |line| {
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

/// Gives `take` the outline that each material should have, without those of `torn`. Returns the materials that cannot
/// be read: they must not make the whole file unreadable.
fn each(
    conn: &Connection,
    torn: &[Slug],
    mut take: impl FnMut(OutlineEntry) -> Result<()>,
) -> Result<Vec<Slug>> {
    let named: Vec<String> = rows(conn, "SELECT slug FROM material", [], |row| row.get(0))?;
    // A damaged name is found where it is read.
    let slugs = named.iter().filter_map(|name| name.parse::<Slug>().ok());
    let slugs = slugs.filter(|slug| !torn.contains(slug));
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
