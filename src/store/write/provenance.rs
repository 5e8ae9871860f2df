//! Writes composition and provenance of a material.

use rusqlite::{Result, params};

use super::{Rows, json, numbered};
use crate::material::{
    Activity, Citation, Finding, Geometry, Instrument, Layer, Making, Origin, Permittivity,
    Roughness, Scale, Session, Source,
};
use crate::measure::AngleStatistics;

impl Rows<'_> {
    pub(super) fn source(&self, position: u32, source: &Source) -> Result<()> {
        let Source { key, kind, title, doi, url, licence, note, citation, making } = source;
        let Citation { authors, year, container, volume, pages, publisher } = citation;
        self.insert(
            "INSERT INTO source
             (revision_id, position, key, kind, title, doi, url, licence, note,
              authors, year, container, volume, pages, publisher, making)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16)",
            params![
                self.revision_id,
                position,
                key,
                kind.as_str(),
                title,
                doi,
                url,
                licence,
                note,
                json(authors)?,
                year,
                container,
                volume,
                pages,
                publisher,
                making.map(Making::as_str),
            ],
        )
    }

    pub(super) fn instrument(&self, position: u32, instrument: &Instrument) -> Result<()> {
        self.insert(
            "INSERT INTO instrument
             (revision_id, position, key, name, centre_frequency_hz, bandwidth_hz, polarisation,
              note, transmit_polarisation, receive_polarisation, geometry, stand_off_m,
              spot_diameter_m, aperture_m, calibration_target, calibration_sd_factor, scale,
              noise_floor_w, threshold_w, false_alarm_probability, range_bins, looks, looks_method)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17,
              ?18, ?19, ?20, ?21, ?22, ?23)",
            params![
                self.revision_id,
                position,
                instrument.key,
                instrument.name,
                instrument.centre_frequency_hz,
                instrument.bandwidth_hz,
                instrument.polarisation,
                instrument.note,
                instrument.transmit_polarisation,
                instrument.receive_polarisation,
                instrument.geometry.map(Geometry::as_str),
                instrument.stand_off_m,
                instrument.spot_diameter_m,
                instrument.aperture_m,
                instrument.calibration_target,
                instrument.calibration_sd_factor,
                instrument.scale.map(Scale::as_str),
                instrument.noise_floor_w,
                instrument.threshold_w,
                instrument.false_alarm_probability,
                instrument.range_bins,
                instrument.looks,
                instrument.looks_method,
            ],
        )
    }

    pub(super) fn session(&self, position: u32, session: &Session) -> Result<()> {
        self.insert(
            "INSERT INTO session
             (revision_id, position, key, date, temperature_k, relative_humidity, cloud_hash,
              mesh_hash, registration_rms_m, normal_sd_rad, footprint_sd_rad, pose, note)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)",
            params![
                self.revision_id,
                position,
                session.key,
                session.date,
                session.temperature_k,
                session.relative_humidity,
                session.cloud_hash,
                session.mesh_hash,
                session.registration_rms_m,
                session.normal_sd_rad,
                session.footprint_sd_rad,
                session.pose.as_ref().map(json).transpose()?,
                session.note,
            ],
        )
    }

    pub(super) fn permittivity(&self, position: u32, entry: &Permittivity) -> Result<()> {
        self.insert(
            "INSERT INTO permittivity
             (revision_id, position, key, frequency_hz, temperature_k, real, imaginary, real_sd,
              imaginary_sd, source, frequency_source)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)",
            params![
                self.revision_id,
                position,
                entry.key,
                entry.frequency_hz,
                entry.temperature_k,
                entry.real,
                entry.imaginary,
                entry.real_sd,
                entry.imaginary_sd,
                entry.source,
                entry.frequency_source,
            ],
        )
    }

    pub(super) fn layer(&self, position: u32, layer: &Layer) -> Result<()> {
        let Layer { name, thickness_m, permittivity, source } = layer;
        self.insert(
            "INSERT INTO layer (revision_id, position, name, thickness_m, permittivity, source)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
            params![self.revision_id, position, name, thickness_m, permittivity, source],
        )
    }

    pub(super) fn roughness(&self, roughness: &Roughness) -> Result<()> {
        let Roughness { rms_height_m, correlation_length_m, method, source } = roughness;
        self.insert(
            "INSERT INTO roughness
             (revision_id, rms_height_m, correlation_length_m, method, source)
             VALUES (?1, ?2, ?3, ?4, ?5)",
            params![self.revision_id, rms_height_m, correlation_length_m, method, source],
        )
    }

    pub(super) fn finding(&self, position: u32, finding: &Finding) -> Result<()> {
        self.insert(
            "INSERT INTO finding
             (revision_id, position, effect, verdict, fit_before, fit_after, gain, placebo_gain, p,
              score_difference, score_difference_sd, size_db, rms_before_db, rms_after_db,
              confusable_with, source)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16)",
            params![
                self.revision_id,
                position,
                finding.effect,
                finding.verdict.as_str(),
                finding.fit_before,
                finding.fit_after,
                finding.gain,
                finding.placebo_gain,
                finding.p,
                finding.score_difference,
                finding.score_difference_sd,
                finding.size_db,
                finding.rms_before_db,
                finding.rms_after_db,
                json(&finding.confusable_with)?,
                finding.source,
            ],
        )
    }

    pub(super) fn statistics(&self, curve: &str, rows: &[AngleStatistics]) -> Result<()> {
        let mut insert = self.tx.prepare_cached(
            "INSERT INTO curve_statistic
             (revision_id, curve, position, theta_min_rad, theta_max_rad, points, censored_points,
              threshold_sigma0, mean_least, mean_greatest, quantile_05, quantile_50, quantile_95,
              interval_low, interval_high)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15)",
        )?;
        numbered(rows, |position, row| {
            let ([theta_min_rad, theta_max_rad], [mean_least, mean_greatest]) =
                (row.theta_rad, row.mean);
            let [quantile_05, quantile_50, quantile_95] = row.quantiles;
            let values = params![
                self.revision_id,
                curve,
                position,
                theta_min_rad,
                theta_max_rad,
                row.points,
                row.censored_points,
                row.threshold_sigma0,
                mean_least,
                mean_greatest,
                quantile_05,
                quantile_50,
                quantile_95,
                row.interval_95.map(|[low, _]| low),
                row.interval_95.map(|[_, high]| high),
            ];
            insert.execute(values).map(|_| ())
        })
    }

    pub(super) fn activity(&self, activity: &Activity) -> Result<()> {
        self.insert(
            "INSERT INTO activity (revision_id, command) VALUES (?1, ?2)",
            params![self.revision_id, activity.command],
        )?;
        numbered(&activity.inputs, |position, input| {
            self.insert(
                "INSERT INTO activity_input (revision_id, position, name, hash)
                 VALUES (?1, ?2, ?3, ?4)",
                params![self.revision_id, position, input.name, input.hash],
            )
        })?;
        activity.origin.as_ref().map_or(Ok(()), |origin| self.origin(origin))
    }

    fn origin(&self, origin: &Origin) -> Result<()> {
        let Origin {
            title, version, doi, url, revision, added_at, program_version, command, ..
        } = origin;
        self.insert(
            "INSERT INTO origin
             (revision_id, title, version, doi, url, revision, added_at, program_version, command)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
            params![
                self.revision_id,
                title,
                version,
                doi,
                url,
                revision,
                added_at,
                program_version,
                command
            ],
        )?;
        numbered(&origin.authors, |position, author| {
            self.insert(
                "INSERT INTO origin_author (revision_id, position, author) VALUES (?1, ?2, ?3)",
                params![self.revision_id, position, author],
            )
        })
    }
}
