//! Sources, instruments and sessions as `material.toml` writes them.

use serde::{Deserialize, Serialize};

use super::temperature::{celsius, kelvin};
use crate::material::instrument::{Geometry, Instrument, Scale};
use crate::material::provenance::{Citation, Making, Session, SessionPose, Source, SourceKind};
use crate::units::{db_from_ratio, dbm_from_watts, ratio_from_db, watts_from_dbm};

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SourceFile {
    key: String,
    kind: SourceKind,
    title: String,
    doi: Option<String>,
    url: Option<String>,
    licence: Option<String>,
    note: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    authors: Vec<String>,
    year: Option<u16>,
    container: Option<String>,
    volume: Option<String>,
    pages: Option<String>,
    publisher: Option<String>,
    making: Option<Making>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InstrumentFile {
    key: String,
    name: String,
    centre_frequency_ghz: f64,
    bandwidth_ghz: Option<f64>,
    polarisation: Option<String>,
    note: Option<String>,
    transmit_polarisation: Option<String>,
    receive_polarisation: Option<String>,
    geometry: Option<Geometry>,
    stand_off_m: Option<f64>,
    spot_diameter_mm: Option<f64>,
    aperture_mm: Option<f64>,
    calibration_target: Option<String>,
    calibration_sd_db: Option<f64>,
    scale: Option<Scale>,
    noise_floor_dbm: Option<f64>,
    threshold_dbm: Option<f64>,
    false_alarm_probability: Option<f64>,
    range_bins: Option<u32>,
    looks: Option<f64>,
    looks_method: Option<String>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SessionFile {
    key: String,
    date: String,
    temperature_c: Option<f64>,
    humidity_percent: Option<f64>,
    cloud_hash: Option<String>,
    mesh_hash: Option<String>,
    registration_rms_mm: Option<f64>,
    normal_sd_deg: Option<f64>,
    footprint_sd_deg: Option<f64>,
    pose: Option<SessionPose>,
    note: Option<String>,
}

impl From<SourceFile> for Source {
    fn from(entry: SourceFile) -> Source {
        let SourceFile { key, kind, title, doi, url, licence, note, making, .. } = entry;
        let SourceFile { authors, year, container, volume, pages, publisher, .. } = entry;
        let citation = Citation { authors, year, container, volume, pages, publisher };
        Source { key, kind, title, doi, url, licence, note, citation, making }
    }
}

impl From<Source> for SourceFile {
    fn from(source: Source) -> SourceFile {
        let Source { key, kind, title, doi, url, licence, note, citation, making } = source;
        let Citation { authors, year, container, volume, pages, publisher } = citation;
        SourceFile {
            key,
            kind,
            title,
            doi,
            url,
            licence,
            note,
            authors,
            year,
            container,
            volume,
            pages,
            publisher,
            making,
        }
    }
}

impl From<InstrumentFile> for Instrument {
    fn from(entry: InstrumentFile) -> Instrument {
        Instrument {
            key: entry.key,
            name: entry.name,
            centre_frequency_hz: entry.centre_frequency_ghz * 1e9,
            bandwidth_hz: entry.bandwidth_ghz.map(|f| f * 1e9),
            polarisation: entry.polarisation,
            note: entry.note,
            transmit_polarisation: entry.transmit_polarisation,
            receive_polarisation: entry.receive_polarisation,
            geometry: entry.geometry,
            stand_off_m: entry.stand_off_m,
            spot_diameter_m: entry.spot_diameter_mm.map(|mm| mm / 1e3),
            aperture_m: entry.aperture_mm.map(|mm| mm / 1e3),
            calibration_target: entry.calibration_target,
            calibration_sd_factor: entry.calibration_sd_db.map(ratio_from_db),
            scale: entry.scale,
            noise_floor_w: entry.noise_floor_dbm.map(watts_from_dbm),
            threshold_w: entry.threshold_dbm.map(watts_from_dbm),
            false_alarm_probability: entry.false_alarm_probability,
            range_bins: entry.range_bins,
            looks: entry.looks,
            looks_method: entry.looks_method,
        }
    }
}

impl From<Instrument> for InstrumentFile {
    fn from(instrument: Instrument) -> InstrumentFile {
        InstrumentFile {
            key: instrument.key,
            name: instrument.name,
            centre_frequency_ghz: instrument.centre_frequency_hz / 1e9,
            bandwidth_ghz: instrument.bandwidth_hz.map(|f| f / 1e9),
            polarisation: instrument.polarisation,
            note: instrument.note,
            transmit_polarisation: instrument.transmit_polarisation,
            receive_polarisation: instrument.receive_polarisation,
            geometry: instrument.geometry,
            stand_off_m: instrument.stand_off_m,
            spot_diameter_mm: instrument.spot_diameter_m.map(|m| m * 1e3),
            aperture_mm: instrument.aperture_m.map(|m| m * 1e3),
            calibration_target: instrument.calibration_target,
            calibration_sd_db: instrument.calibration_sd_factor.map(db_from_ratio),
            scale: instrument.scale,
            noise_floor_dbm: instrument.noise_floor_w.map(dbm_from_watts),
            threshold_dbm: instrument.threshold_w.map(dbm_from_watts),
            false_alarm_probability: instrument.false_alarm_probability,
            range_bins: instrument.range_bins,
            looks: instrument.looks,
            looks_method: instrument.looks_method,
        }
    }
}

impl From<SessionFile> for Session {
    fn from(entry: SessionFile) -> Session {
        let SessionFile { key, date, cloud_hash, mesh_hash, pose, note, .. } = entry;
        Session {
            key,
            date,
            temperature_k: entry.temperature_c.map(kelvin),
            relative_humidity: entry.humidity_percent.map(|percent| percent / 100.0),
            cloud_hash,
            mesh_hash,
            registration_rms_m: entry.registration_rms_mm.map(|mm| mm / 1e3),
            normal_sd_rad: entry.normal_sd_deg.map(f64::to_radians),
            footprint_sd_rad: entry.footprint_sd_deg.map(f64::to_radians),
            pose,
            note,
        }
    }
}

impl From<Session> for SessionFile {
    fn from(session: Session) -> SessionFile {
        let Session { key, date, cloud_hash, mesh_hash, pose, note, .. } = session;
        SessionFile {
            key,
            date,
            temperature_c: session.temperature_k.map(celsius),
            humidity_percent: session.relative_humidity.map(|share| share * 100.0),
            cloud_hash,
            mesh_hash,
            registration_rms_mm: session.registration_rms_m.map(|m| m * 1e3),
            normal_sd_deg: session.normal_sd_rad.map(f64::to_degrees),
            footprint_sd_deg: session.footprint_sd_rad.map(f64::to_degrees),
            pose,
            note,
        }
    }
}
