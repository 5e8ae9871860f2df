//! Layers, permittivities and roughness as `material.toml` writes them.

use serde::{Deserialize, Serialize};

use super::temperature::{celsius, kelvin};
use crate::material::composition::{Layer, Permittivity, Roughness};

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LayerFile {
    name: String,
    thickness_mm: Option<f64>,
    permittivity: Option<String>,
    source: Option<String>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PermittivityFile {
    key: String,
    frequency_ghz: f64,
    temperature_c: Option<f64>,
    real: f64,
    imaginary: f64,
    real_sd: Option<f64>,
    imaginary_sd: Option<f64>,
    source: String,
    frequency_source: Option<String>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RoughnessFile {
    rms_height_um: f64,
    correlation_length_um: Option<f64>,
    method: Option<String>,
    source: String,
}

impl From<LayerFile> for Layer {
    fn from(entry: LayerFile) -> Layer {
        let LayerFile { name, thickness_mm, permittivity, source } = entry;
        Layer { name, thickness_m: thickness_mm.map(|mm| mm / 1e3), permittivity, source }
    }
}

impl From<Layer> for LayerFile {
    fn from(layer: Layer) -> LayerFile {
        let Layer { name, thickness_m, permittivity, source } = layer;
        LayerFile { name, thickness_mm: thickness_m.map(|m| m * 1e3), permittivity, source }
    }
}

impl From<PermittivityFile> for Permittivity {
    fn from(entry: PermittivityFile) -> Permittivity {
        let PermittivityFile { key, real, imaginary, real_sd, imaginary_sd, source, .. } = entry;
        Permittivity {
            key,
            frequency_hz: entry.frequency_ghz * 1e9,
            temperature_k: entry.temperature_c.map(kelvin),
            real,
            imaginary,
            real_sd,
            imaginary_sd,
            source,
            frequency_source: entry.frequency_source,
        }
    }
}

impl From<Permittivity> for PermittivityFile {
    fn from(entry: Permittivity) -> PermittivityFile {
        let Permittivity { key, real, imaginary, real_sd, imaginary_sd, source, .. } = entry;
        PermittivityFile {
            key,
            frequency_ghz: entry.frequency_hz / 1e9,
            temperature_c: entry.temperature_k.map(celsius),
            real,
            imaginary,
            real_sd,
            imaginary_sd,
            source,
            frequency_source: entry.frequency_source,
        }
    }
}

impl From<RoughnessFile> for Roughness {
    fn from(entry: RoughnessFile) -> Roughness {
        let RoughnessFile { rms_height_um, correlation_length_um, method, source } = entry;
        Roughness {
            rms_height_m: rms_height_um / 1e6,
            correlation_length_m: correlation_length_um.map(|um| um / 1e6),
            method,
            source,
        }
    }
}

impl From<Roughness> for RoughnessFile {
    fn from(roughness: Roughness) -> RoughnessFile {
        let Roughness { rms_height_m, correlation_length_m, method, source } = roughness;
        RoughnessFile {
            rms_height_um: rms_height_m * 1e6,
            correlation_length_um: correlation_length_m.map(|m| m * 1e6),
            method,
            source,
        }
    }
}
