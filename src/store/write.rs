//! Writes plain types as rows.

mod provenance;

use rusqlite::types::Value;
use rusqlite::{
    Connection, Error, OptionalExtension, Params, Result, Transaction, params, params_from_iter,
};
use serde::Serialize;

use super::error::is_damage;
use super::find::outline::{self, OutlineEntry};
use super::pages::check_pages;
use super::record::{self, Part};
use super::results::{Addition, Removal};
use super::rows::rows;
use super::tables::{MAKING, follows_from_content, own_tables};
use super::{law, read};
use crate::formats::EffectEntry;
use crate::material::{Activity, Covariance, Curve, Fit, Illumination, Material, Slug};
use crate::measure::statistics::by_angle;
use crate::radar::Footprint;

/// Number of materials whose rows in lists and searches are written together.
const AT_ONCE: usize = 500;

/// Adds materials within one transaction.
/// Writes the rows in lists and searches for many materials together: SQLite writes the full-text index at the end of
/// every statement, which for one material takes longer than all its other rows.
pub(super) struct MaterialWriter<'a> {
    tx: &'a Transaction<'a>,
    /// Row numbers of the materials that wait for their rows in lists and searches.
    waiting: Vec<i64>,
    /// Their outlines.
    outlines: Vec<OutlineEntry>,
}

impl<'a> MaterialWriter<'a> {
    pub fn new(tx: &'a Transaction<'a>) -> MaterialWriter<'a> {
        MaterialWriter { tx, waiting: Vec::new(), outlines: Vec::new() }
    }

    /// Adds a material, or a revision of it, with its activity, and reads it back.
    /// Does not add the content of the current revision again. Rewrites rows where they are damaged, those of an earlier
    /// revision, too: the stored hash shows that they had this content. A damaged record gets this activity.
    pub fn add(&mut self, material: &Material, activity: Option<&Activity>) -> Result<Addition> {
        let tx = self.tx;
        let content_hash = material.content_hash();
        let (added, material_id) = match current(tx, &material.slug)? {
            Some(current) if is_intact(tx, material, &current, &content_hash)? => {
                return Ok(Addition::Unchanged(current.number));
            }
            Some(Current { material_id, number, content_hash: Some((revision_id, stored)) })
                if stored == content_hash
                    && record::has_its_number(tx, revision_id, &material.slug, number)? =>
            {
                restore_record(tx, revision_id, (&material.slug, number), activity)?;
                rewrite(tx, revision_id, material)?;
                (Addition::Repaired(number), material_id)
            }
            Some(current) => {
                if let Some(number) = repaired_earlier(tx, material, &content_hash, activity)? {
                    return Ok(Addition::Repaired(number));
                }
                let number = next_number(tx, &current)?;
                let made = revision(tx, material, number, &content_hash, activity)?;
                (Addition::Revision(number), made)
            }
            None => (Addition::New, revision(tx, material, 1, &content_hash, activity)?),
        };
        read_back(tx, material, &content_hash)?;
        self.queue(material_id, material)?;
        Ok(added)
    }

    /// Queues a material for lists and searches.
    pub fn queue(&mut self, material_id: i64, material: &Material) -> Result<()> {
        self.waiting.push(material_id);
        let rendered = read::Rendered {
            model: material.scattering().ok(),
            theta_rad: material.reach().span_rad(),
            footprint: material.rendered_curve().and_then(|curve| curve.illumination.footprint),
            lobes: material.rendered_lobes(),
        };
        self.outlines.push(outline::line(&material.slug, &rendered));
        if self.waiting.len() >= AT_ONCE {
            self.write_lists()?;
        }
        Ok(())
    }

    /// Writes the remaining rows of lists and searches.
    pub fn finish(mut self) -> Result<()> {
        self.write_lists()
    }

    /// Rewrites the rows of the queued materials in lists and searches.
    fn write_lists(&mut self) -> Result<()> {
        // Rows are replaced and not removed first: what others have made may refer to them.
        const STEPS: [&str; 6] = [
            "DELETE FROM entry WHERE material_id IN (SELECT value FROM json_each(?1))
             AND slug NOT IN (SELECT slug FROM material WHERE id = material_id)",
            "DELETE FROM entry_tag WHERE slug IN (
                 SELECT slug FROM material WHERE id IN (SELECT value FROM json_each(?1)))",
            "DELETE FROM search WHERE rowid IN (SELECT value FROM json_each(?1))",
            "INSERT INTO entry SELECT * FROM entry_made
             WHERE material_id IN (SELECT value FROM json_each(?1))
             ON CONFLICT (slug) DO UPDATE SET
                 material_id = excluded.material_id, revision = excluded.revision,
                 name = excluded.name, class = excluded.class, status = excluded.status,
                 kind = excluded.kind, frequency_min_hz = excluded.frequency_min_hz,
                 frequency_max_hz = excluded.frequency_max_hz, curves = excluded.curves,
                 observations = excluded.observations, fits = excluded.fits,
                 fitted = excluded.fitted",
            // Through its view SQLite would read all materials.
            "INSERT OR IGNORE INTO entry_tag
             SELECT slug, value FROM material
             JOIN revision ON material_id = material.id AND number = current_revision
             JOIN json_each(tags)
             WHERE material.id IN (SELECT value FROM json_each(?1))",
            "INSERT INTO search
             (rowid, slug, name, class, tags, description, finish, unknown, sources)
             SELECT * FROM search_made WHERE id IN (SELECT value FROM json_each(?1))",
        ];
        if self.waiting.is_empty() {
            return Ok(());
        }
        let waiting = json(&std::mem::take(&mut self.waiting))?;
        STEPS
            .iter()
            .try_for_each(|sql| self.tx.prepare_cached(sql)?.execute([&waiting]).map(|_| ()))?;
        self.outlines.drain(..).try_for_each(|line| outline::write(self.tx, &line))
    }
}

/// Takes a step of a migration for every revision but those on damaged pages. A step that meets damage is undone alone,
/// so that the rest of the file can be read.
fn each_revision(tx: &Transaction, torn: &[i64], step: impl Fn(i64) -> Result<()>) -> Result<()> {
    let revisions: Vec<i64> =
        rows(tx, "SELECT id FROM revision NOT INDEXED", [], |row| row.get(0))?;
    for revision_id in revisions.into_iter().filter(|id| !torn.contains(id)) {
        tx.execute_batch("SAVEPOINT revision")?;
        match step(revision_id) {
            Ok(()) => tx.execute_batch("RELEASE revision")?,
            Err(error) if is_damage(&error) => {
                tx.execute_batch("ROLLBACK TO revision; RELEASE revision")?;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Brings the fits that an older program stored to schema 11: the values of their parameters in `fit_parameter` alone,
/// their numbers in `fit_number`.
pub(super) fn bring_fits_to_one_value(tx: &Transaction, torn: &[i64]) -> Result<()> {
    each_revision(tx, torn, |revision_id| bring_to_one_value(tx, revision_id))
}

fn bring_to_one_value(tx: &Transaction, revision_id: i64) -> Result<()> {
    law::remove_copies(tx, revision_id)?;
    let fits = match read::fits(tx, revision_id) {
        // What was brought to one value is sound; the numbers need all fits.
        Err(error) if is_damage(&error) => return Ok(()),
        fits => fits?,
    };
    fits.iter().try_for_each(|fit| Rows { tx, revision_id }.numbers(fit))
}

/// Computes the statistics of curves that an older program did not store.
pub(super) fn fill_statistics(tx: &Transaction, torn: &[i64]) -> Result<()> {
    let is_filled = "SELECT EXISTS (SELECT 1 FROM curve_statistic WHERE revision_id = ?1)";
    each_revision(tx, torn, |revision_id| {
        if tx.prepare_cached(is_filled)?.query_row([revision_id], |row| row.get(0))? {
            return Ok(());
        }
        read::curves(tx, revision_id, None)?.iter().try_for_each(|curve| {
            Rows { tx, revision_id }.statistics(&curve.name, &by_angle(&curve.observations))
        })
    })
}

/// Removes materials with all their rows, all or none.
pub(super) fn remove(conn: &mut Connection, slugs: &[&Slug]) -> Result<Vec<Option<Removal>>> {
    let tx = conn.transaction()?;
    check_pages(&tx)?;
    let removed = slugs.iter().map(|slug| remove_one(&tx, slug)).collect::<Result<_>>()?;
    tx.commit()?;
    Ok(removed)
}

fn remove_one(tx: &Transaction, slug: &Slug) -> Result<Option<Removal>> {
    // Without an index, a damaged material can be removed, too.
    let sql = "SELECT id FROM material NOT INDEXED WHERE slug = ?1";
    let found = tx.query_row(sql, [slug.as_str()], |row| row.get::<_, i64>(0)).optional()?;
    // Where its own row is lost, a list has its number.
    let listed = "SELECT material_id FROM entry WHERE slug = ?1";
    let listed = tx.query_row(listed, [slug.as_str()], |row| row.get::<_, i64>(0)).optional()?;
    let Some(material_id) = found.or(listed) else { return Ok(None) };
    let has_another_name = "SELECT EXISTS (SELECT 1 FROM material NOT INDEXED WHERE id = ?1)";
    if found.is_none() && tx.query_row(has_another_name, [material_id], |row| row.get(0))? {
        return Err(read::damaged(format!("the list calls another material `{slug}`")));
    }
    let count = "SELECT count(*) FROM revision NOT INDEXED WHERE material_id = ?1";
    let revisions = tx.query_row(count, [material_id], |row| row.get(0))?;
    tx.execute("DELETE FROM material WHERE id = ?1", [material_id])?;
    if found.is_none() {
        tx.execute("DELETE FROM entry WHERE slug = ?1", [slug.as_str()])?;
        tx.execute(
            "DELETE FROM revision WHERE material_id = ?1
             AND material_id NOT IN (SELECT id FROM material)",
            [material_id],
        )?;
    }
    Ok(Some(Removal { revisions }))
}

/// The current revision of a material.
struct Current {
    material_id: i64,
    number: u32,
    /// Number of its row, and [`Material::content_hash`] when it was added; none where it is missing.
    content_hash: Option<(i64, String)>,
}

fn current(tx: &Transaction, slug: &Slug) -> Result<Option<Current>> {
    let sql = "SELECT material.id, current_revision, revision.id, content_hash FROM material
               LEFT JOIN revision ON material_id = material.id AND number = current_revision
               WHERE slug = ?1";
    tx.prepare_cached(sql)?
        .query_row([slug.as_str()], |row| {
            Ok(Current {
                material_id: row.get(0)?,
                number: row.get(1)?,
                content_hash: Option::zip(row.get(2)?, row.get(3)?),
            })
        })
        .optional()
}

/// Whether the current revision has the content of a material, its hash, and its record.
fn is_intact(tx: &Transaction, material: &Material, current: &Current, hash: &str) -> Result<bool> {
    let Some((id, stored)) = &current.content_hash else { return Ok(false) };
    Ok(stored == hash
        && record::changed(tx, *id, &material.slug, current.number)?.is_empty()
        && read_back(tx, material, hash).is_ok())
}

/// Rewrites an earlier revision that has the hash of a material and is damaged, and returns its number.
fn repaired_earlier(
    tx: &Transaction,
    material: &Material,
    hash: &str,
    activity: Option<&Activity>,
) -> Result<Option<u32>> {
    let slug = &material.slug;
    let of_content =
        read::revision_rows(tx, slug)?.into_iter().filter(|row| row.content_hash == hash);
    for row in of_content {
        let changed = record::changed(tx, row.id, slug, row.number)?;
        let is_sound = match read::get_in(tx, slug, Some(row.number)) {
            Err(error) if !is_damage(&error) => return Err(error),
            stored => stored.is_ok_and(|stored| {
                stored.is_some_and(|stored| stored.material.content_hash() == hash)
            }),
        };
        if changed.contains(&Part::Number) || changed.is_empty() && is_sound {
            continue;
        }
        restore_record(tx, row.id, (slug, row.number), activity)?;
        rewrite(tx, row.id, material)?;
        return Ok(Some(row.number));
    }
    Ok(None)
}

/// Replaces the damaged parts of a record: the command and the origin by those of `by`, the date by
/// that of now, not above those of later revisions, and the program by this one. Returns the parts.
///
/// Fails where the revision has another name or number than was stored: then it must not be taken for what it is
/// called.
pub(super) fn restore_record(
    tx: &Transaction,
    revision_id: i64,
    (slug, number): (&Slug, u32),
    by: Option<&Activity>,
) -> Result<Vec<Part>> {
    let changed = record::changed(tx, revision_id, slug, number)?;
    if changed.contains(&Part::Number) {
        return Err(read::damaged("it has another name or number than was stored".to_owned()));
    }
    if changed.is_empty() {
        return Ok(changed);
    }
    let made = if changed.contains(&Part::Command) {
        by.map(|by| (by.command.clone(), by.inputs.clone()))
    } else {
        read::command(tx, revision_id)?
    };
    let from = if changed.contains(&Part::Origin) {
        by.and_then(|by| by.origin.clone())
    } else {
        read::origin(tx, revision_id)?
    };
    for table in MAKING.iter().rev() {
        tx.execute(&format!("DELETE FROM {table} WHERE revision_id = ?1"), [revision_id])?;
    }
    // What has an origin was imported.
    let made = made.or_else(|| from.is_some().then(|| ("import".to_owned(), Vec::new())));
    if let Some((command, inputs)) = made {
        Rows { tx, revision_id }.activity(&Activity { command, inputs, origin: from })?;
    }
    if changed.contains(&Part::Date) {
        // No revision is older than an earlier one.
        let sql = format!(
            "UPDATE revision SET program_version = ?2, added_at = min({NOW}, coalesce((
                 SELECT min(added_at) FROM revision AS later
                 WHERE later.material_id = revision.material_id AND later.number > revision.number
             ), {NOW})) WHERE id = ?1"
        );
        tx.execute(&sql, params![revision_id, env!("CARGO_PKG_VERSION")])?;
    }
    record::write(tx, revision_id)?;
    Ok(changed)
}

/// One more than the greatest revision number of a material.
fn next_number(tx: &Transaction, current: &Current) -> Result<u32> {
    let sql = "SELECT coalesce(max(number), 0) FROM revision NOT INDEXED WHERE material_id = ?1";
    let greatest: u32 = tx.query_row(sql, [current.material_id], |row| row.get(0))?;
    let last = greatest.max(current.number);
    last.checked_add(1).ok_or_else(|| read::damaged(format!("no number follows revision {last}")))
}

/// Reads a material back and fails where it differs from what was written.
fn read_back(tx: &Transaction, material: &Material, content_hash: &str) -> Result<()> {
    let slug = &material.slug;
    let problem = match read::get_in(tx, slug, None) {
        Ok(Some(back)) if back.material.content_hash() == content_hash => return Ok(()),
        Ok(Some(_)) => format!("`{slug}` was read back with another content"),
        Ok(None) => format!("`{slug}` was not there when it was read back"),
        // The rest of the file was damaged before.
        Err(error) if is_damage(&error) => return Err(error),
        Err(error) => format!("`{slug}` could not be read back: {error}"),
    };
    Err(Error::ToSqlConversionFailure(problem.into()))
}

/// Rewrites the rows of a revision. Its activity, date and program version stay.
pub(super) fn rewrite(tx: &Transaction, revision_id: i64, material: &Material) -> Result<()> {
    tx.pragma_update(None, "defer_foreign_keys", true)?;
    for table in own_tables(tx)?.iter().filter(|table| follows_from_content(table)) {
        let sql = format!("DELETE FROM \"{}\" WHERE revision_id = ?1", table.name);
        tx.execute(&sql, [revision_id])?;
    }
    let values = std::iter::repeat_n("?", CONTENT.split(',').count());
    let values = values.collect::<Vec<_>>().join(", ");
    let update = format!("UPDATE revision SET ({CONTENT}) = ({values}) WHERE id = {revision_id}");
    tx.execute(&update, params_from_iter(content(material)?))?;
    Rows { tx, revision_id }.material(material)
}

/// Writes a material into an empty database, without lists and searches.
pub(super) fn write_alone(tx: &Transaction, material: &Material) -> Result<()> {
    revision(tx, material, 1, &material.content_hash(), None).map(|_| ())
}

/// Columns of `revision` that follow from the content.
const CONTENT: &str = "name, class, description, licence, tags, frequency_min_hz, frequency_max_hz, \
     theta_min_rad, theta_max_rad, render, status, status_reason, superseded_by, finish, unknown";

/// Their values.
fn content(material: &Material) -> Result<[Value; 15]> {
    let ([frequency_min_hz, frequency_max_hz], [theta_min_rad, theta_max_rad]) =
        (material.frequency_hz, material.theta_rad);
    let status = &material.status;
    Ok([
        material.name.clone().into(),
        material.class.clone().into(),
        material.description.clone().into(),
        material.licence.clone().into(),
        json(&material.tags)?.into(),
        frequency_min_hz.into(),
        frequency_max_hz.into(),
        theta_min_rad.into(),
        theta_max_rad.into(),
        material.render.clone().into(),
        status.as_str().to_owned().into(),
        status.reason().map(str::to_owned).into(),
        status.superseded_by().map(Slug::to_string).into(),
        material.finish.clone().into(),
        json(&material.unknown)?.into(),
    ])
}

/// The date in SQL: UTC, ISO 8601, to the second, of a year of four digits.
const NOW: &str = "coalesce(strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), '9999-12-31T23:59:59Z')";

/// Writes a revision and makes it the current one. Returns the row number of the material.
fn revision(
    tx: &Transaction,
    material: &Material,
    number: u32,
    hash: &str,
    activity: Option<&Activity>,
) -> Result<i64> {
    let upsert = "INSERT INTO material (slug, current_revision) VALUES (?1, ?2)
                  ON CONFLICT (slug) DO UPDATE SET current_revision = excluded.current_revision
                  RETURNING id";
    let material_id: i64 = tx
        .prepare_cached(upsert)?
        .query_row(params![material.slug.as_str(), number], |row| row.get(0))?;
    // A lost revision has left rows under its number. A clock may be wrong: no revision is older than an earlier one.
    let insert = format!(
        "INSERT INTO revision ({CONTENT}, material_id, number, content_hash, program_version, id, added_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 1 + max(
             coalesce((SELECT max(id) FROM revision), 0),
             coalesce((SELECT max(revision_id) FROM record), 0)), max({NOW},
             coalesce((SELECT max(added_at) FROM revision WHERE material_id = ?), '')))"
    );
    let own: [Value; 5] = [
        material_id.into(),
        number.into(),
        hash.to_owned().into(),
        env!("CARGO_PKG_VERSION").to_owned().into(),
        material_id.into(),
    ];
    let values = content(material)?.into_iter().chain(own);
    let revision_id = tx.prepare_cached(&insert)?.insert(params_from_iter(values))?;
    let rows = Rows { tx, revision_id };
    rows.material(material)?;
    activity.map_or(Ok(()), |activity| rows.activity(activity))?;
    record::write(tx, revision_id)?;
    Ok(material_id)
}

/// Writes the rows that belong to one revision.
struct Rows<'a> {
    tx: &'a Transaction<'a>,
    revision_id: i64,
}

impl Rows<'_> {
    fn material(&self, material: &Material) -> Result<()> {
        numbered(&material.sources, |position, source| self.source(position, source))?;
        numbered(&material.instruments, |position, entry| self.instrument(position, entry))?;
        numbered(&material.sessions, |position, session| self.session(position, session))?;
        numbered(&material.permittivities, |place, entry| self.permittivity(place, entry))?;
        numbered(&material.layers, |position, layer| self.layer(position, layer))?;
        material.roughness.as_ref().map_or(Ok(()), |roughness| self.roughness(roughness))?;
        numbered(&material.curves, |position, curve| self.curve(position, curve))?;
        numbered(&material.fits, |position, fit| self.fit(position, fit))?;
        numbered(&material.effects, |position, effect| self.effect(position, effect))?;
        numbered(&material.findings, |position, finding| self.finding(position, finding))
    }

    fn insert(&self, sql: &str, values: impl Params) -> Result<()> {
        self.tx.prepare_cached(sql)?.execute(values).map(|_| ())
    }

    fn curve(&self, position: u32, curve: &Curve) -> Result<()> {
        let Curve { name, source, instrument, session, illumination, observations } = curve;
        self.insert(
            "INSERT INTO curve (revision_id, position, name, source, instrument)
             VALUES (?1, ?2, ?3, ?4, ?5)",
            params![self.revision_id, position, name, source, instrument],
        )?;
        if let Some(session) = session {
            self.insert(
                "INSERT INTO curve_session (revision_id, curve, session) VALUES (?1, ?2, ?3)",
                params![self.revision_id, name, session],
            )?;
        }
        let Illumination { footprint, beam_rad, relative, only_detected } = illumination;
        if footprint.is_some() || beam_rad.is_some() {
            self.insert(
                "INSERT INTO curve_illumination (revision_id, curve, footprint, beam_rad)
                 VALUES (?1, ?2, ?3, ?4)",
                params![self.revision_id, name, footprint.map(Footprint::as_str), beam_rad],
            )?;
        }
        if *relative || *only_detected {
            self.insert(
                "INSERT INTO curve_levels (revision_id, curve, relative, only_detected)
                 VALUES (?1, ?2, ?3, ?4)",
                params![self.revision_id, name, relative, only_detected],
            )?;
        }
        let mut insert = self.tx.prepare_cached(
            "INSERT INTO observation
             (revision_id, curve, position, theta_i_rad, theta_r_rad, delta_phi_rad, sigma0, censor,
              threshold_sigma0, theta_sd_rad, power_w, range_m, chirp, xt_m, yt_m)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15)",
        )?;
        numbered(observations, |position, o| {
            let [theta_i_rad, theta_r_rad, delta_phi_rad] =
                [o.theta_i_rad, o.theta_r_rad, o.delta_phi_rad];
            let values = params![
                self.revision_id,
                name,
                position,
                theta_i_rad,
                theta_r_rad,
                delta_phi_rad,
                o.sigma0,
                o.censor.as_str(),
                o.threshold_sigma0,
                o.theta_sd_rad,
                o.power_w,
                o.range_m,
                o.chirp,
                o.target_m.map(|[xt_m, _]| xt_m),
                o.target_m.map(|[_, yt_m]| yt_m)
            ];
            insert.execute(values).map(|_| ())
        })?;
        self.statistics(name, &by_angle(observations))
    }

    fn fit(&self, position: u32, fit: &Fit) -> Result<()> {
        let Fit { name, model, estimator, curve, source, .. } = fit;
        let (model, report) = (law::structure(model)?, fit.report.as_ref().map(json).transpose()?);
        self.insert(
            "INSERT INTO fit (revision_id, position, name, model, estimator, curve, source, report)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![self.revision_id, position, name, model, estimator, curve, source, report],
        )?;
        if !fit.lobes.is_of_both() {
            self.insert(
                "INSERT INTO fit_lobes (revision_id, fit, lobes) VALUES (?1, ?2, ?3)",
                params![self.revision_id, name, fit.lobes.as_str()],
            )?;
        }
        self.parameters(fit)?;
        self.numbers(fit)?;
        fit.covariance.as_ref().map_or(Ok(()), |covariance| self.covariance(name, covariance))
    }

    fn parameters(&self, fit: &Fit) -> Result<()> {
        numbered(&fit.model.parameters(), |position, parameter| {
            let path = &parameter.path;
            let sd = fit.covariance.as_ref().and_then(|c| c.standard_deviation(path));
            let own = fit.parameter_sources.iter().find(|(of, _)| of == path);
            let source = own.map(|(_, source)| source);
            self.insert(
                "INSERT INTO fit_parameter
                 (revision_id, fit, position, path, value, unit, sd, source)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                params![
                    self.revision_id,
                    fit.name,
                    position,
                    path,
                    parameter.value,
                    parameter.unit,
                    sd,
                    source
                ],
            )
        })
    }

    /// Writes where each number of a fit comes from.
    fn numbers(&self, fit: &Fit) -> Result<()> {
        numbered(&fit.numbers(), |position, number| {
            let estimate = number.estimate.map(|place| format!("$.estimates[{place}]"));
            self.insert(
                "INSERT INTO fit_number
                 (revision_id, fit, position, name, estimate, chosen_by, at_bound)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                params![
                    self.revision_id,
                    fit.name,
                    position,
                    number.name,
                    estimate,
                    number.chosen_by.as_str(),
                    number.is_at_bound,
                ],
            )
        })
    }

    fn effect(&self, position: u32, effect: &EffectEntry) -> Result<()> {
        let EffectEntry { name, source, parameters } = effect;
        self.insert(
            "INSERT INTO effect (revision_id, position, name, source) VALUES (?1, ?2, ?3, ?4)",
            params![self.revision_id, position, name, source],
        )?;
        parameters.iter().try_for_each(|(parameter, value)| {
            self.insert(
                "INSERT INTO effect_parameter (revision_id, effect, name, value)
                 VALUES (?1, ?2, ?3, ?4)",
                params![self.revision_id, name, parameter, value],
            )
        })
    }

    fn covariance(&self, fit: &str, covariance: &Covariance) -> Result<()> {
        let Covariance { parameters, matrix } = covariance;
        let pairs = std::iter::zip(parameters, matrix).flat_map(|(row, values)| {
            std::iter::zip(parameters, values).map(move |(column, value)| (row, column, value))
        });
        for (position, (row, column, value)) in (0u32..).zip(pairs) {
            self.insert(
                "INSERT INTO fit_covariance
                 (revision_id, fit, position, row_path, column_path, covariance)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                params![self.revision_id, fit, position, row, column, value],
            )?;
        }
        Ok(())
    }
}

/// Writes items in their order, each with its position from 0.
fn numbered<T>(items: &[T], mut write: impl FnMut(u32, &T) -> Result<()>) -> Result<()> {
    (0..).zip(items).try_for_each(|(position, item)| write(position, item))
}

fn json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|error| Error::ToSqlConversionFailure(error.into()))
}
