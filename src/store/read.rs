//! Reads rows as plain types.

mod provenance;

pub(super) use provenance::{command, origin, statistics};

use rusqlite::ffi;
use rusqlite::types::Type;
use rusqlite::{Connection, Error, OptionalExtension, Result, Row, params};

use super::law;
use super::results::{RevisionSummary, StoredRevision};
use super::rows::{json, moment, optional_json, rows};
use crate::brdf::Brdf;
use crate::formats::EffectEntry;
use crate::material::{
    Covariance, Curve, Fit, Illumination, Lobes, Material, Observation, Origin, Reach, Slug, Status,
};
use crate::radar::Footprint;

/// Numbers of the revisions of a material, ascending.
pub(super) fn revision_numbers(conn: &Connection, slug: &Slug) -> Result<Vec<u32>> {
    let sql = "SELECT number FROM material JOIN revision ON material_id = material.id
               WHERE slug = ?1 ORDER BY number";
    let _moment = moment(conn)?;
    let numbers: Vec<u32> = rows(conn, sql, [slug.as_str()], |row| row.get(0))?;
    if numbers.is_empty() {
        check_absent(conn, slug)?;
    }
    Ok(numbers)
}

/// Every revision of a material with the number of its row, oldest first, within a transaction.
pub(super) fn history(conn: &Connection, slug: &Slug) -> Result<Vec<(i64, RevisionSummary)>> {
    let sql = "SELECT number, revision.added_at, revision.program_version, origin.revision_id, origin.title,
                   revision.id
               FROM material JOIN revision ON material_id = material.id
               LEFT JOIN origin ON origin.revision_id = revision.id
               WHERE slug = ?1 ORDER BY number";
    let found: Vec<(i64, RevisionSummary)> = rows(conn, sql, [slug.as_str()], |row| {
        let (of, title): (Option<i64>, Option<String>) = (row.get(3)?, row.get(4)?);
        let origin = of.map(|_| Origin { title, ..Origin::default() }.title().to_owned());
        let summary = RevisionSummary {
            origin,
            revision: row.get(0)?,
            added_at: row.get(1)?,
            program_version: row.get(2)?,
        };
        Ok((row.get(5)?, summary))
    })?;
    match current_revision(conn, slug)? {
        Some(current) if !found.iter().any(|(_, summary)| summary.revision == current) => {
            Err(missing(slug, current))
        }
        _ => Ok(found),
    }
}

/// Names of all materials, sorted.
pub(super) fn names(conn: &Connection) -> Result<Vec<String>> {
    // A damaged name need not be text.
    let sql = "SELECT CAST(slug AS BLOB) FROM material NOT INDEXED ORDER BY slug";
    rows(conn, sql, [], |row| Ok(String::from_utf8_lossy(&row.get::<_, Vec<u8>>(0)?).into_owned()))
}

/// Number of all revisions.
pub(super) fn revision_count(conn: &Connection) -> Result<usize> {
    conn.query_row("SELECT count(*) FROM revision", [], |row| row.get::<_, u32>(0))
        .map(|count| count as usize)
}

/// Number of the current revision of a material. Scans the table, so that a damaged index cannot hide it. `None` when
/// the material does not exist. Fails where a list has a material that has lost its row.
pub(super) fn current_revision(conn: &Connection, slug: &Slug) -> Result<Option<u32>> {
    let found = conn
        .prepare_cached("SELECT current_revision FROM material NOT INDEXED WHERE slug = ?1")?
        .query_row([slug.as_str()], |row| row.get(0))
        .optional()?;
    if found.is_none()
        && conn.prepare_cached("SELECT 1 FROM entry WHERE slug = ?1")?.exists([slug.as_str()])?
    {
        return Err(damaged(format!("`{slug}` is in the lists, but its own row is not there")));
    }
    Ok(found)
}

/// A row of a revision.
pub(super) struct RevisionRow {
    pub id: i64,
    pub number: u32,
    pub content_hash: String,
}

/// The rows of the revisions of a material, by number.
pub(super) fn revision_rows(conn: &Connection, slug: &Slug) -> Result<Vec<RevisionRow>> {
    let sql = "SELECT revision.id, number, content_hash FROM revision
               JOIN material ON material.id = material_id WHERE slug = ?1 ORDER BY number";
    rows(conn, sql, [slug.as_str()], |row| {
        Ok(RevisionRow { id: row.get(0)?, number: row.get(1)?, content_hash: row.get(2)? })
    })
}

/// The greatest number of a revision of a material below this one.
pub(super) fn revision_before(conn: &Connection, slug: &Slug, number: u32) -> Result<Option<u32>> {
    let sql = "SELECT max(number) FROM revision JOIN material ON material.id = material_id
               WHERE slug = ?1 AND number < ?2";
    conn.query_row(sql, params![slug.as_str(), number], |row| row.get(0))
}

/// Which of these materials the database has, in its lists alone too, by one scan of the table.
pub(super) fn present(conn: &Connection, slugs: &[Slug]) -> Result<Vec<Slug>> {
    let wanted = serde_json::json!(slugs).to_string();
    let sql =
        "SELECT slug FROM material NOT INDEXED WHERE slug IN (SELECT value FROM json_each(?1))
               UNION SELECT slug FROM entry WHERE slug IN (SELECT value FROM json_each(?1))
               ORDER BY slug";
    rows(conn, sql, [wanted], |row| row.get(0))
}

/// Fails when a material exists of which an index has found nothing.
pub(super) fn check_absent(conn: &Connection, slug: &Slug) -> Result<()> {
    match current_revision(conn, slug)? {
        None => Ok(()),
        Some(number) => Err(missing(slug, number)),
    }
}

/// The error for a missing revision that must exist.
fn missing(slug: &Slug, number: u32) -> Error {
    damaged(format!("`{slug}` is there, but its revision {number} is not"))
}

/// The error for a file that contradicts itself.
pub(super) fn damaged(problem: String) -> Error {
    Error::SqliteFailure(ffi::Error::new(ffi::SQLITE_CORRUPT), Some(problem))
}

/// The licences of the current revisions, each once, sorted.
pub(super) fn licences(conn: &Connection) -> Result<Vec<String>> {
    let sql = "SELECT DISTINCT licence FROM material
               JOIN revision ON material_id = material.id AND number = current_revision
               ORDER BY licence";
    rows(conn, sql, [], |row| row.get(0))
}

/// Reads one revision of a material, or the current one, within a transaction. Its record is not compared.
pub(super) fn get_in(
    conn: &Connection,
    slug: &Slug,
    number: Option<u32>,
) -> Result<Option<StoredRevision>> {
    Ok(found(conn, slug, number)?.map(|(_, stored)| stored))
}

/// As [`get_in`], with the number of its row.
pub(super) fn found(
    conn: &Connection,
    slug: &Slug,
    number: Option<u32>,
) -> Result<Option<(i64, StoredRevision)>> {
    let Some((revision_id, mut stored)) = revision(conn, slug, number)? else {
        // The current revision must exist. A number before it may be missing.
        return match current_revision(conn, slug)? {
            Some(current) if number.is_none_or(|wanted| wanted == current) => {
                Err(missing(slug, current))
            }
            _ => Ok(None),
        };
    };
    let material = &mut stored.material;
    material.sources = provenance::sources(conn, revision_id)?;
    material.instruments = provenance::instruments(conn, revision_id)?;
    material.curves = curves(conn, revision_id, None)?;
    material.fits = fits(conn, revision_id)?;
    material.effects = effects(conn, revision_id)?;
    provenance::fill(material, conn, revision_id)?;
    stored.activity = provenance::activity(conn, revision_id)?;
    Ok(Some((revision_id, stored)))
}

/// What scenes render of a material's current revision.
#[derive(Clone, Debug)]
pub(super) struct Rendered {
    /// The model; none where the rendered curve cannot be interpolated.
    pub model: Option<Brdf>,
    /// Its range of incidence, rad.
    pub theta_rad: [f64; 2],
    /// Form of the footprint of the curve that it is, or that it was fitted to.
    pub footprint: Option<Footprint>,
    /// Whose lobes the model has.
    pub lobes: Lobes,
}

/// The model that scenes render of the current revision, and its range of angles, rad.
pub(super) fn rendered(conn: &Connection, slug: &Slug) -> Result<Option<(Brdf, [f64; 2])>> {
    let _moment = moment(conn)?;
    let found = rendered_in(conn, slug)?;
    if found.is_none() {
        check_absent(conn, slug)?;
    }
    Ok(found.and_then(|found| Some((found.model?, found.theta_rad))))
}

/// What scenes render of the current revision, within a transaction.
pub(super) fn rendered_in(conn: &Connection, slug: &Slug) -> Result<Option<Rendered>> {
    // A fit without a curve joins nothing: no curve has the name of a fit.
    let sql = "
        SELECT revision.id, render, theta_min_rad, theta_max_rad, model, footprint, lobes
        FROM material JOIN revision ON material_id = material.id AND number = current_revision
        LEFT JOIN fit ON fit.revision_id = revision.id AND fit.name = render
        LEFT JOIN fit_lobes ON fit_lobes.revision_id = revision.id AND fit_lobes.fit = render
        LEFT JOIN curve_illumination AS lit
            ON lit.revision_id = revision.id AND lit.curve = coalesce(fit.curve, render)
        WHERE slug = ?1";
    let found = conn
        .prepare_cached(sql)?
        .query_row([slug.as_str()], |row| {
            let (revision_id, render): (i64, String) = (row.get(0)?, row.get(1)?);
            let rendered = Rendered {
                model: None,
                theta_rad: [row.get(2)?, row.get(3)?],
                footprint: row.get(5)?,
                lobes: row.get::<_, Option<Lobes>>(6)?.unwrap_or_default(),
            };
            Ok((revision_id, render, row.get::<_, Option<String>>(4)?, rendered))
        })
        .optional()?;
    let Some((revision_id, render, structure, rendered)) = found else { return Ok(None) };
    if let Some(structure) = structure {
        let (model, _) = law::read(conn, revision_id, &render, &structure)?;
        return Ok(Some(Rendered { model: Some(model), ..rendered }));
    }
    let curve = curves(conn, revision_id, Some(&render))?.pop();
    let model = curve.as_ref().and_then(|curve| curve.tabulated().ok()).map(Brdf::Tabulated);
    let theta_rad = Reach::new(rendered.theta_rad, curve.as_ref()).span_rad();
    Ok(Some(Rendered { model, theta_rad, ..rendered }))
}

/// A revision's own row, or that of the current one, and its number in the file.
fn revision(
    conn: &Connection,
    slug: &Slug,
    number: Option<u32>,
) -> Result<Option<(i64, StoredRevision)>> {
    let sql = "
        SELECT slug, name, class, description, licence, tags, frequency_min_hz, frequency_max_hz,
            theta_min_rad, theta_max_rad, render, number, content_hash, added_at, program_version,
            revision.id, status, status_reason, superseded_by, finish, unknown,
            (SELECT max(number) FROM revision WHERE material_id = material.id)
        FROM material JOIN revision ON material_id = material.id
        WHERE slug = ?1 AND number = coalesce(?2, current_revision)";
    conn.prepare_cached(sql)?
        .query_row(params![slug.as_str(), number], |row| {
            let (current, latest): (u32, u32) = (row.get(11)?, row.get(21)?);
            match number {
                None if current != latest => {
                    Err(damaged(not_latest(slug.as_str(), current, latest)))
                }
                _ => Ok((row.get(15)?, stored(row)?)),
            }
        })
        .optional()
}

/// The problem of a current revision that has later ones: those may withdraw the material.
pub(super) fn not_latest(slug: &str, current: u32, latest: u32) -> String {
    format!("`{slug}` has revision {current} as its current one, and a revision {latest}")
}

/// A revision by its own row, without the rows of other tables.
fn stored(row: &Row) -> Result<StoredRevision> {
    let material = Material {
        slug: row.get(0)?,
        name: row.get(1)?,
        class: row.get(2)?,
        description: row.get(3)?,
        licence: row.get(4)?,
        tags: json(row, 5)?,
        frequency_hz: [row.get(6)?, row.get(7)?],
        theta_rad: [row.get(8)?, row.get(9)?],
        render: row.get(10)?,
        sources: Vec::new(),
        instruments: Vec::new(),
        curves: Vec::new(),
        fits: Vec::new(),
        effects: Vec::new(),
        status: status(row, 16)?,
        finish: row.get(19)?,
        unknown: json(row, 20)?,
        roughness: None,
        layers: Vec::new(),
        permittivities: Vec::new(),
        sessions: Vec::new(),
        findings: Vec::new(),
    };
    Ok(StoredRevision {
        material,
        revision: row.get(11)?,
        content_hash: row.get(12)?,
        added_at: row.get(13)?,
        program_version: row.get(14)?,
        activity: None,
    })
}

/// Reads a status from three columns: word, reason, successor.
fn status(row: &Row, column: usize) -> Result<Status> {
    let word: String = row.get(column)?;
    let (reason, by) = (row.get(column + 1)?, row.get(column + 2)?);
    match (word.as_str(), reason, by) {
        ("active", None, None) => Ok(Status::Active),
        ("superseded", Some(reason), Some(by)) => Ok(Status::Superseded { by, reason }),
        ("withdrawn", Some(reason), None) => Ok(Status::Withdrawn { reason }),
        _ => {
            let problem = format!("the status `{word}` does not match its reason and successor");
            Err(Error::FromSqlConversionFailure(column, Type::Text, problem.into()))
        }
    }
}

/// Curves of a revision, or the one of this name.
pub(super) fn curves(
    conn: &Connection,
    revision_id: i64,
    only: Option<&str>,
) -> Result<Vec<Curve>> {
    let sql = "
        SELECT name, source, instrument, session, footprint, beam_rad, coalesce(relative, 0),
            coalesce(only_detected, 0)
        FROM curve
        LEFT JOIN curve_session
            ON curve_session.revision_id = curve.revision_id AND curve_session.curve = name
        LEFT JOIN curve_illumination AS lit
            ON lit.revision_id = curve.revision_id AND lit.curve = name
        LEFT JOIN curve_levels AS levels
            ON levels.revision_id = curve.revision_id AND levels.curve = name
        WHERE curve.revision_id = ?1 AND name = coalesce(?2, name) ORDER BY position";
    rows(conn, sql, params![revision_id, only], |row| {
        let name: String = row.get(0)?;
        let observations = observations(conn, revision_id, &name)?;
        Ok(Curve {
            name,
            source: row.get(1)?,
            instrument: row.get(2)?,
            session: row.get(3)?,
            illumination: Illumination {
                footprint: row.get(4)?,
                beam_rad: row.get(5)?,
                relative: row.get(6)?,
                only_detected: row.get(7)?,
            },
            observations,
        })
    })
}

fn observations(conn: &Connection, revision_id: i64, curve: &str) -> Result<Vec<Observation>> {
    let sql = "SELECT theta_i_rad, theta_r_rad, delta_phi_rad, sigma0, censor, threshold_sigma0,
             theta_sd_rad, power_w, range_m, chirp, xt_m, yt_m
         FROM observation WHERE revision_id = ?1 AND curve = ?2 ORDER BY position";
    rows(conn, sql, params![revision_id, curve], |row| {
        Ok(Observation {
            theta_i_rad: row.get(0)?,
            theta_r_rad: row.get(1)?,
            delta_phi_rad: row.get(2)?,
            sigma0: row.get(3)?,
            censor: row.get(4)?,
            threshold_sigma0: row.get(5)?,
            theta_sd_rad: row.get(6)?,
            power_w: row.get(7)?,
            range_m: row.get(8)?,
            chirp: row.get(9)?,
            target_m: Option::zip(row.get(10)?, row.get(11)?).map(|(xt_m, yt_m)| [xt_m, yt_m]),
        })
    })
}

pub(super) fn fits(conn: &Connection, revision_id: i64) -> Result<Vec<Fit>> {
    let sql = "SELECT name, model, estimator, curve, source, report, lobes FROM fit
               LEFT JOIN fit_lobes ON fit_lobes.revision_id = fit.revision_id AND fit = name
               WHERE fit.revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        let name: String = row.get(0)?;
        let structure: String = row.get(1)?;
        let (model, parameter_sources) = law::read(conn, revision_id, &name, &structure)?;
        let covariance = covariance(conn, revision_id, &name)?;
        Ok(Fit {
            name,
            model,
            estimator: row.get(2)?,
            curve: row.get(3)?,
            source: row.get(4)?,
            lobes: row.get::<_, Option<Lobes>>(6)?.unwrap_or_default(),
            parameter_sources,
            covariance,
            report: optional_json(row, 5)?,
        })
    })
}

fn covariance(conn: &Connection, revision_id: i64, fit: &str) -> Result<Option<Covariance>> {
    let sql = "SELECT column_path, covariance FROM fit_covariance
               WHERE revision_id = ?1 AND fit = ?2 ORDER BY position";
    let pairs: Vec<(String, f64)> =
        rows(conn, sql, params![revision_id, fit], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let (mut paths, values): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
    paths.truncate(values.len().isqrt());
    let matrix = values.chunks(paths.len().max(1)).map(<[f64]>::to_vec).collect();
    Ok((!paths.is_empty()).then_some(Covariance { parameters: paths, matrix }))
}

fn effects(conn: &Connection, revision_id: i64) -> Result<Vec<EffectEntry>> {
    let sql = "SELECT name, source FROM effect WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        let (name, source): (String, _) = (row.get(0)?, row.get(1)?);
        let sql = "SELECT name, value FROM effect_parameter WHERE revision_id = ?1 AND effect = ?2";
        let parameters: Vec<(String, f64)> =
            rows(conn, sql, params![revision_id, name], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(EffectEntry { name, source, parameters: parameters.into_iter().collect() })
    })
}
