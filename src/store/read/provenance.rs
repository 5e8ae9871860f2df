//! Reads composition and provenance of a material.

use rusqlite::{Connection, OptionalExtension, Result, params};

use crate::material::{
    Activity, Citation, Finding, Input, Instrument, Layer, Material, Origin, Permittivity,
    Roughness, Session, Slug, Source,
};
use crate::measure::AngleStatistics;
use crate::store::rows::{json, optional_json, rows};

/// Fills in the rows of a revision other than sources, instruments, curves, fits and effects.
pub(super) fn fill(material: &mut Material, conn: &Connection, revision_id: i64) -> Result<()> {
    material.sessions = sessions(conn, revision_id)?;
    material.permittivities = permittivities(conn, revision_id)?;
    material.layers = layers(conn, revision_id)?;
    material.roughness = roughness(conn, revision_id)?;
    material.findings = findings(conn, revision_id)?;
    Ok(())
}

pub(super) fn sources(conn: &Connection, revision_id: i64) -> Result<Vec<Source>> {
    let sql = "SELECT key, kind, title, doi, url, licence, note,
                authors, year, container, volume, pages, publisher, making
               FROM source WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Source {
            key: row.get(0)?,
            kind: row.get(1)?,
            title: row.get(2)?,
            doi: row.get(3)?,
            url: row.get(4)?,
            licence: row.get(5)?,
            note: row.get(6)?,
            citation: Citation {
                authors: json(row, 7)?,
                year: row.get(8)?,
                container: row.get(9)?,
                volume: row.get(10)?,
                pages: row.get(11)?,
                publisher: row.get(12)?,
            },
            making: row.get(13)?,
        })
    })
}

pub(super) fn instruments(conn: &Connection, revision_id: i64) -> Result<Vec<Instrument>> {
    let sql = "SELECT key, name, centre_frequency_hz, bandwidth_hz, polarisation, note,
                transmit_polarisation, receive_polarisation, geometry, stand_off_m, spot_diameter_m,
                aperture_m, calibration_target, calibration_sd_factor, scale, noise_floor_w,
                threshold_w, false_alarm_probability, range_bins, looks, looks_method
               FROM instrument WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Instrument {
            key: row.get(0)?,
            name: row.get(1)?,
            centre_frequency_hz: row.get(2)?,
            bandwidth_hz: row.get(3)?,
            polarisation: row.get(4)?,
            note: row.get(5)?,
            transmit_polarisation: row.get(6)?,
            receive_polarisation: row.get(7)?,
            geometry: row.get(8)?,
            stand_off_m: row.get(9)?,
            spot_diameter_m: row.get(10)?,
            aperture_m: row.get(11)?,
            calibration_target: row.get(12)?,
            calibration_sd_factor: row.get(13)?,
            scale: row.get(14)?,
            noise_floor_w: row.get(15)?,
            threshold_w: row.get(16)?,
            false_alarm_probability: row.get(17)?,
            range_bins: row.get(18)?,
            looks: row.get(19)?,
            looks_method: row.get(20)?,
        })
    })
}

fn sessions(conn: &Connection, revision_id: i64) -> Result<Vec<Session>> {
    let sql = "SELECT key, date, temperature_k, relative_humidity, cloud_hash, mesh_hash,
                registration_rms_m, normal_sd_rad, footprint_sd_rad, pose, note
               FROM session WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Session {
            key: row.get(0)?,
            date: row.get(1)?,
            temperature_k: row.get(2)?,
            relative_humidity: row.get(3)?,
            cloud_hash: row.get(4)?,
            mesh_hash: row.get(5)?,
            registration_rms_m: row.get(6)?,
            normal_sd_rad: row.get(7)?,
            footprint_sd_rad: row.get(8)?,
            pose: optional_json(row, 9)?,
            note: row.get(10)?,
        })
    })
}

fn permittivities(conn: &Connection, revision_id: i64) -> Result<Vec<Permittivity>> {
    let sql =
        "SELECT key, frequency_hz, temperature_k, real, imaginary, real_sd, imaginary_sd, source,
                   frequency_source
               FROM permittivity WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Permittivity {
            key: row.get(0)?,
            frequency_hz: row.get(1)?,
            temperature_k: row.get(2)?,
            real: row.get(3)?,
            imaginary: row.get(4)?,
            real_sd: row.get(5)?,
            imaginary_sd: row.get(6)?,
            source: row.get(7)?,
            frequency_source: row.get(8)?,
        })
    })
}

fn layers(conn: &Connection, revision_id: i64) -> Result<Vec<Layer>> {
    let sql = "SELECT name, thickness_m, permittivity, source FROM layer
               WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Layer {
            name: row.get(0)?,
            thickness_m: row.get(1)?,
            permittivity: row.get(2)?,
            source: row.get(3)?,
        })
    })
}

fn roughness(conn: &Connection, revision_id: i64) -> Result<Option<Roughness>> {
    let sql = "SELECT rms_height_m, correlation_length_m, method, source FROM roughness
               WHERE revision_id = ?1";
    let found = rows(conn, sql, [revision_id], |row| {
        Ok(Roughness {
            rms_height_m: row.get(0)?,
            correlation_length_m: row.get(1)?,
            method: row.get(2)?,
            source: row.get(3)?,
        })
    });
    Ok(found?.pop())
}

fn findings(conn: &Connection, revision_id: i64) -> Result<Vec<Finding>> {
    let sql = "SELECT effect, verdict, fit_before, fit_after, gain, placebo_gain, p,
                score_difference, score_difference_sd, size_db, rms_before_db, rms_after_db,
                confusable_with, source
               FROM finding WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| {
        Ok(Finding {
            effect: row.get(0)?,
            verdict: row.get(1)?,
            fit_before: row.get(2)?,
            fit_after: row.get(3)?,
            gain: row.get(4)?,
            placebo_gain: row.get(5)?,
            p: row.get(6)?,
            score_difference: row.get(7)?,
            score_difference_sd: row.get(8)?,
            size_db: row.get(9)?,
            rms_before_db: row.get(10)?,
            rms_after_db: row.get(11)?,
            confusable_with: json(row, 12)?,
            source: row.get(13)?,
        })
    })
}

/// The command that made a revision, with its inputs and origin.
pub(super) fn activity(conn: &Connection, revision_id: i64) -> Result<Option<Activity>> {
    let Some((command, inputs)) = command(conn, revision_id)? else { return Ok(None) };
    Ok(Some(Activity { command, inputs, origin: origin(conn, revision_id)? }))
}

/// The command that made a revision, with its inputs.
pub(in crate::store) fn command(
    conn: &Connection,
    revision_id: i64,
) -> Result<Option<(String, Vec<Input>)>> {
    let sql = "SELECT command FROM activity WHERE revision_id = ?1";
    let command =
        conn.prepare_cached(sql)?.query_row([revision_id], |row| row.get(0)).optional()?;
    let Some(command) = command else { return Ok(None) };
    let sql = "SELECT name, hash FROM activity_input WHERE revision_id = ?1 ORDER BY position";
    let inputs =
        rows(conn, sql, [revision_id], |row| Ok(Input { name: row.get(0)?, hash: row.get(1)? }))?;
    Ok(Some((command, inputs)))
}

/// The catalogue from which a revision was imported.
pub(in crate::store) fn origin(conn: &Connection, revision_id: i64) -> Result<Option<Origin>> {
    let sql = "SELECT title, version, doi, url, revision, added_at, program_version, command
               FROM origin WHERE revision_id = ?1";
    let found = rows(conn, sql, [revision_id], |row| {
        Ok(Origin {
            authors: origin_authors(conn, revision_id)?,
            title: row.get(0)?,
            version: row.get(1)?,
            doi: row.get(2)?,
            url: row.get(3)?,
            revision: row.get(4)?,
            added_at: row.get(5)?,
            program_version: row.get(6)?,
            command: row.get(7)?,
        })
    });
    Ok(found?.pop())
}

fn origin_authors(conn: &Connection, revision_id: i64) -> Result<Vec<String>> {
    let sql = "SELECT author FROM origin_author WHERE revision_id = ?1 ORDER BY position";
    rows(conn, sql, [revision_id], |row| row.get(0))
}

/// Statistics of a curve of a revision, or of the current one.
pub(in crate::store) fn statistics(
    conn: &Connection,
    slug: &Slug,
    revision: Option<u32>,
    curve: &str,
) -> Result<Vec<AngleStatistics>> {
    let sql = "
        SELECT curve_statistic.theta_min_rad, curve_statistic.theta_max_rad, points,
            censored_points, threshold_sigma0, mean_least, mean_greatest, quantile_05, quantile_50,
            quantile_95, interval_low, interval_high
        FROM material JOIN revision ON material_id = material.id
        JOIN curve_statistic ON revision_id = revision.id
        WHERE slug = ?1 AND number = coalesce(?2, current_revision) AND curve = ?3
        ORDER BY position";
    rows(conn, sql, params![slug.as_str(), revision, curve], |row| {
        let interval: [Option<f64>; 2] = [row.get(10)?, row.get(11)?];
        Ok(AngleStatistics {
            theta_rad: [row.get(0)?, row.get(1)?],
            points: row.get(2)?,
            censored_points: row.get(3)?,
            threshold_sigma0: row.get(4)?,
            mean: [row.get(5)?, row.get(6)?],
            quantiles: [row.get(7)?, row.get(8)?, row.get(9)?],
            interval_95: interval[0].zip(interval[1]).map(|(low, high)| [low, high]),
        })
    })
}
