//! Plain types to rows.

mod provenance;

use rusqlite::{Connection, Error, OptionalExtension, Params, Result, Transaction, params};
use serde::Serialize;

use super::find::outline;
use super::{Added, Outlined, Removed, read};
use crate::formats::EffectEntry;
use crate::material::{Activity, Covariance, Curve, Fit, Material, Slug};
use crate::measure::statistics::by_angle;

/// Materials of which lines are made at once.
const AT_ONCE: usize = 500;

/// Materials on their way into the file, within one transaction.
///
/// What they are found by is made of many at once: SQLite writes the full-text index out at the end of
/// every statement, which for one material takes longer than all its other rows.
pub(super) struct Adding<'a> {
    tx: &'a Transaction<'a>,
    /// Numbers of materials whose lines are still to be made.
    waiting: Vec<i64>,
    /// What they render.
    outlines: Vec<Outlined>,
}

impl<'a> Adding<'a> {
    pub fn new(tx: &'a Transaction<'a>) -> Adding<'a> {
        Adding { tx, waiting: Vec::new(), outlines: Vec::new() }
    }

    /// Adds a material, or a revision to it, with what made it.
    pub fn add(&mut self, material: &Material, activity: Option<&Activity>) -> Result<Added> {
        let tx = self.tx;
        let content_hash = material.content_hash();
        let (added, number) = match current(tx, &material.slug)? {
            Some((number, stored)) if stored == content_hash => {
                return Ok(Added::Unchanged(number));
            }
            Some((number, _)) => (Added::Revision(number + 1), number + 1),
            None => (Added::New, 1),
        };
        let (material_id, revision_id) = revision(tx, material, number, &content_hash)?;
        let rows = Rows { tx, revision_id };
        rows.material(material)?;
        activity.map_or(Ok(()), |activity| rows.activity(activity))?;
        self.waiting.push(material_id);
        let model = material.scattering().ok();
        self.outlines.push(outline::line(
            &material.slug,
            model.as_ref(),
            material.reach().span_rad(),
        ));
        if self.waiting.len() >= AT_ONCE {
            self.lines()?;
        }
        Ok(added)
    }

    /// Makes what is still missing.
    pub fn finish(mut self) -> Result<()> {
        self.lines()
    }

    /// Makes what materials are found by anew of their current revisions.
    fn lines(&mut self) -> Result<()> {
        const STEPS: [&str; 5] = [
            "DELETE FROM entry WHERE material_id IN (SELECT value FROM json_each(?1))",
            "DELETE FROM search WHERE rowid IN (SELECT value FROM json_each(?1))",
            "INSERT INTO entry SELECT * FROM entry_made
             WHERE material_id IN (SELECT value FROM json_each(?1))",
            // Through its view SQLite would look at all materials.
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

/// Writes what the fits that an older program stored say of their numbers.
pub(super) fn fill_estimates(tx: &Transaction) -> Result<()> {
    let sql = "SELECT DISTINCT revision_id FROM fit WHERE report IS NOT NULL";
    let revisions: Vec<i64> = read::rows(tx, sql, [], |row| row.get(0))?;
    revisions.into_iter().try_for_each(|revision_id| match read::fits(tx, revision_id) {
        // What cannot be read must not keep the rest of the file from being read.
        Err(Error::FromSqlConversionFailure(..)) => Ok(()),
        fits => fits?.iter().try_for_each(|fit| Rows { tx, revision_id }.estimates(fit)),
    })
}

/// Removes materials and all that hangs on them, all or none.
pub(super) fn remove(conn: &mut Connection, slugs: &[&Slug]) -> Result<Vec<Option<Removed>>> {
    let tx = conn.transaction()?;
    let removed = slugs.iter().map(|slug| remove_one(&tx, slug)).collect::<Result<_>>()?;
    tx.commit()?;
    Ok(removed)
}

fn remove_one(tx: &Transaction, slug: &Slug) -> Result<Option<Removed>> {
    let count = "SELECT count(*) FROM revision JOIN material ON material.id = material_id
                 WHERE slug = ?1";
    let revisions = tx.query_row(count, [slug.as_str()], |row| row.get(0))?;
    let found = tx.execute("DELETE FROM material WHERE slug = ?1", [slug.as_str()])?;
    Ok((found > 0).then_some(Removed { revisions }))
}

/// Number and content hash of the current revision.
fn current(tx: &Transaction, slug: &Slug) -> Result<Option<(u32, String)>> {
    let sql = "SELECT number, content_hash FROM material
               JOIN revision ON material_id = material.id AND number = current_revision
               WHERE slug = ?1";
    tx.prepare_cached(sql)?
        .query_row([slug.as_str()], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()
}

/// Writes a revision's own row and makes it the current one; gives the numbers of material and revision.
fn revision(tx: &Transaction, material: &Material, number: u32, hash: &str) -> Result<(i64, i64)> {
    let upsert = "INSERT INTO material (slug, current_revision) VALUES (?1, ?2)
                  ON CONFLICT (slug) DO UPDATE SET current_revision = excluded.current_revision
                  RETURNING id";
    let material_id: i64 = tx
        .prepare_cached(upsert)?
        .query_row(params![material.slug.as_str(), number], |row| row.get(0))?;
    let ([frequency_min_hz, frequency_max_hz], [theta_min_rad, theta_max_rad]) =
        (material.frequency_hz, material.theta_rad);
    let insert = "INSERT INTO revision
        (material_id, number, content_hash, name, class, description, licence, tags,
         frequency_min_hz, frequency_max_hz, theta_min_rad, theta_max_rad, render,
         added_at, program_version, status, status_reason, superseded_by, finish, unknown)
        VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13,
         strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), ?14, ?15, ?16, ?17, ?18, ?19)";
    let revision_id = tx.prepare_cached(insert)?.insert(params![
        material_id,
        number,
        hash,
        material.name,
        material.class,
        material.description,
        material.licence,
        json(&material.tags)?,
        frequency_min_hz,
        frequency_max_hz,
        theta_min_rad,
        theta_max_rad,
        material.render,
        env!("CARGO_PKG_VERSION"),
        material.status.as_str(),
        material.status.reason(),
        material.status.superseded_by().map(Slug::as_str),
        material.finish,
        json(&material.unknown)?,
    ])?;
    Ok((material_id, revision_id))
}

/// Writes what hangs on one revision.
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
        let Curve { name, source, instrument, session, observations } = curve;
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
        let (model, report) = (json(model)?, fit.report.as_ref().map(json).transpose()?);
        self.insert(
            "INSERT INTO fit (revision_id, position, name, model, estimator, curve, source, report)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![self.revision_id, position, name, model, estimator, curve, source, report],
        )?;
        self.parameters(fit)?;
        self.estimates(fit)?;
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

    /// What the fit says of each number.
    fn estimates(&self, fit: &Fit) -> Result<()> {
        numbered(&fit.numbers(), |position, told| {
            self.insert(
                "INSERT INTO fit_estimate
                 (revision_id, fit, position, name, value, unit, sd, low_95, high_95, chosen_by, at_bound,
                  identified)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
                params![
                    self.revision_id,
                    fit.name,
                    position,
                    told.name,
                    told.value,
                    told.unit,
                    told.sd,
                    told.interval_95.map(|[low, _]| low),
                    told.interval_95.map(|[_, high]| high),
                    told.chosen_by.as_str(),
                    told.is_at_bound,
                    told.is_identified(),
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
