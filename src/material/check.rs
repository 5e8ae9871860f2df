//! What a material must be to be kept: names, references, ranges and values.

use std::collections::HashSet;

use super::curve::{Censor, Curve, Observation};
use super::error::{MaterialError, dangling, value};
use super::fit::{Covariance, Fit};
use super::instrument::Instrument;
use super::number_check::{MOST, NumberCheck, is_level, is_number};
use super::provenance::{Session, Source};
use super::revision::Material;
use crate::formats::EffectEntry;

/// Most tags of a material. Each takes time when a material is added.
const MOST_TAGS: usize = 1000;

impl Material {
    /// Checks names, references, ranges and values.
    pub fn validate(&self) -> Result<(), MaterialError> {
        self.check_every_text()?;
        if self.tags.len() > MOST_TAGS {
            let problem = format!("{} are given and {MOST_TAGS} are the most", self.tags.len());
            return Err(value("tags", &problem, "keep those by which the material is looked for"));
        }
        self.check_text()?;
        self.check_limits()?;
        unique("source", self.sources.iter().map(|s| s.key.as_str()))?;
        unique("instrument", self.instruments.iter().map(|i| i.key.as_str()))?;
        unique("session", self.sessions.iter().map(|s| s.key.as_str()))?;
        unique("fit or curve", self.renderable().iter().map(String::as_str))?;
        self.status.validate(&self.slug)?;
        self.sources.iter().try_for_each(Source::validate)?;
        self.instruments.iter().try_for_each(Instrument::validate)?;
        self.sessions.iter().try_for_each(Session::validate)?;
        self.check_composition()?;
        self.curves.iter().try_for_each(|curve| self.check_curve(curve))?;
        self.fits.iter().try_for_each(|fit| self.check_fit(fit))?;
        self.check_effects()?;
        self.check_findings()?;
        self.scattering().map(|_| ())
    }

    fn check_text(&self) -> Result<(), MaterialError> {
        let texts = [("name", &self.name), ("class", &self.class), ("licence", &self.licence)];
        for (place, text) in texts {
            if text.trim().is_empty() {
                return Err(value(place, "is empty", "fill it in"));
            }
        }
        if self.unknown.iter().any(|sentence| sentence.trim().is_empty()) {
            return Err(value("unknown", "holds an empty sentence", "fill it in or remove it"));
        }
        if self.finish.as_ref().is_some_and(|finish| finish.trim().is_empty()) {
            return Err(value("finish", "is empty", "fill it in or leave it out"));
        }
        if self.sources.is_empty() {
            return Err(value("material", "has no source", "add a [[source]] table"));
        }
        Ok(())
    }

    fn check_limits(&self) -> Result<(), MaterialError> {
        if !is_range_within(self.frequency_hz, f64::MIN_POSITIVE, MOST) {
            let problem = "must be two positive frequencies, the lower first";
            return Err(value("frequency_ghz", problem, "mend the range"));
        }
        if !is_range_within(self.theta_rad, 0.0, std::f64::consts::FRAC_PI_2) {
            let problem = "must be two angles from 0 to 90, the smaller first";
            return Err(value("theta_deg", problem, "mend the range"));
        }
        Ok(())
    }

    fn check_curve(&self, curve: &Curve) -> Result<(), MaterialError> {
        let place = format!("curve `{}`", curve.name);
        self.check_source(&place, &curve.source)?;
        let instruments = self.instruments.iter().map(|i| &i.key);
        refers(&place, "an instrument", curve.instrument.as_ref(), instruments)?;
        let sessions = self.sessions.iter().map(|s| &s.key);
        refers(&place, "a session", curve.session.as_ref(), sessions)?;
        NumberCheck::new(&place)
            .positive("the divergence of the beam", curve.illumination.beam_rad)?;
        if curve.observations.is_empty() {
            return Err(value(&place, "has no observation", "give it at least one row"));
        }
        let has_thresholds = curve.observations.iter().all(|row| row.threshold_sigma0.is_some());
        if curve.illumination.only_detected && !has_thresholds {
            let problem = "holds only detections, and one of them has no threshold";
            return Err(value(&place, problem, "fill in threshold_db in every row"));
        }
        for (row, observation) in curve.observations.iter().enumerate() {
            observation.validate(&format!("{place}, observation {}", row + 1))?;
        }
        Ok(())
    }

    fn check_fit(&self, fit: &Fit) -> Result<(), MaterialError> {
        let place = format!("fit `{}`", fit.name);
        fit.model.check_size().map_err(|problem| {
            value(&place, &problem, "write the law with fewer parts, or tabulate it as a [[curve]]")
        })?;
        let known: Vec<String> = fit.model.parameters().into_iter().map(|p| p.path).collect();
        fit.model
            .validate()
            .map_err(|error| MaterialError::Parameter { fit: fit.name.clone(), error })?;
        self.check_source(&place, &fit.source)?;
        refers(&place, "a curve", fit.curve.as_ref(), self.curves.iter().map(|c| &c.name))?;
        for (path, source) in &fit.parameter_sources {
            self.check_source(&format!("{place}, parameter `{path}`"), source)?;
            if !known.contains(path) {
                return Err(dangling(&place, "a parameter", path, known));
            }
        }
        if !fit.parameter_sources.is_sorted_by(|a, b| a.0 < b.0) {
            let problem = "the sources of parameters are not sorted, or one is given twice";
            return Err(value(&place, problem, "give each path once, in alphabetical order"));
        }
        fit.report.as_ref().map_or(Ok(()), |report| report.validate(&place))?;
        fit.covariance.as_ref().map_or(Ok(()), |covariance| covariance.validate(&place, &known))
    }

    /// What can be said of effects without knowing any.
    fn check_effects(&self) -> Result<(), MaterialError> {
        unique("effect", self.effects.iter().map(|effect| effect.name.as_str()))?;
        for EffectEntry { name, source, parameters } in &self.effects {
            self.check_own_source(&format!("effect `{name}`"), source.as_ref())?;
            if let Some((key, number)) = parameters.iter().find(|(_, v)| !is_number(**v)) {
                let place = format!("effect `{name}`");
                let problem = format!("{key} = {number} is not a number within ±1e300");
                return Err(value(&place, &problem, "mend the number"));
            }
        }
        Ok(())
    }

    fn check_composition(&self) -> Result<(), MaterialError> {
        for (index, entry) in self.permittivities.iter().enumerate() {
            let place = format!("permittivity `{}`, entry {}", entry.key, index + 1);
            if entry.key.is_empty() {
                return Err(value(&place, "has an empty name", "name it"));
            }
            entry.validate(&place)?;
            self.check_source(&place, &entry.source)?;
            self.check_own_source(&place, entry.frequency_source.as_ref())?;
            let before = self.permittivities.iter().take(index);
            if before.into_iter().any(|other| entry.is_same_place(other)) {
                let problem = "is given twice at one frequency and temperature";
                return Err(value(&place, problem, "remove one of them"));
            }
        }
        for (index, layer) in self.layers.iter().enumerate() {
            let place = format!("layer {}", index + 1);
            layer.validate(&place, index + 1 == self.layers.len())?;
            let known = self.permittivities.iter().map(|entry| &entry.key);
            refers(&place, "a permittivity", layer.permittivity.as_ref(), known)?;
            self.check_own_source(&place, layer.source.as_ref())?;
        }
        let Some(roughness) = &self.roughness else { return Ok(()) };
        roughness.validate()?;
        self.check_source("roughness", &roughness.source)
    }

    fn check_findings(&self) -> Result<(), MaterialError> {
        for (index, finding) in self.findings.iter().enumerate() {
            let place = format!("finding {}, `{}`", index + 1, finding.effect);
            finding.validate(&place)?;
            self.check_source(&place, &finding.source)?;
            for fit in [&finding.fit_before, &finding.fit_after] {
                refers(&place, "a fit", fit.as_ref(), self.fits.iter().map(|f| &f.name))?;
            }
        }
        Ok(())
    }

    fn check_source(&self, place: &str, key: &String) -> Result<(), MaterialError> {
        self.check_own_source(place, Some(key))
    }

    /// As `check_source`, where a source may be left out.
    fn check_own_source(&self, place: &str, key: Option<&String>) -> Result<(), MaterialError> {
        refers(place, "a source", key, self.sources.iter().map(|s| &s.key))
    }
}

impl Observation {
    fn validate(&self, place: &str) -> Result<(), MaterialError> {
        let quarter = 0.0..=std::f64::consts::FRAC_PI_2;
        if !quarter.contains(&self.theta_i_rad) || !quarter.contains(&self.theta_r_rad) {
            return Err(value(place, "the angle is not within 0–90°", "mend the angle"));
        }
        if !is_number(self.delta_phi_rad) {
            return Err(value(place, "the azimuth is not finite", "mend the angle"));
        }
        let mut levels = [self.sigma0, self.threshold_sigma0].into_iter().flatten();
        if levels.any(|level| !is_level(level)) {
            return Err(value(
                place,
                "σ⁰ is not a positive number up to 1e300",
                "give a finite level in dB",
            ));
        }
        self.check_circumstances(place)?;
        match (self.censor, self.sigma0, self.threshold_sigma0) {
            (Censor::None, None, _) => {
                Err(value(place, "has neither a value nor a censor code", "fill in one of them"))
            }
            (Censor::Left | Censor::Right, Some(_), _) => {
                Err(value(place, "is censored and has a value", "leave one of them out"))
            }
            (Censor::Left | Censor::Right, None, None) => {
                Err(value(place, "is censored without a threshold", "fill in threshold_db"))
            }
            _ => Ok(()),
        }
    }

    fn check_circumstances(&self, place: &str) -> Result<(), MaterialError> {
        let quarter = 0.0..=std::f64::consts::FRAC_PI_2;
        if self.theta_sd_rad.is_some_and(|sd| !quarter.contains(&sd)) {
            let problem = "the angle's deviation is not within 0–90°";
            return Err(value(place, problem, "mend it or leave it out"));
        }
        if self.power_w.is_some_and(|power_w| !is_level(power_w)) {
            let problem = "the power is not positive, or beyond 1e300 W";
            return Err(value(place, problem, "give a finite level in dBm"));
        }
        if self.range_m.is_some_and(|range_m| !(range_m >= 0.0 && is_number(range_m))) {
            return Err(value(
                place,
                "the range is negative or not finite",
                "mend it or leave it out",
            ));
        }
        if self.target_m.is_some_and(|place_m| !place_m.into_iter().all(is_number)) {
            return Err(value(place, "the place is not finite", "mend it or leave it out"));
        }
        Ok(())
    }
}

impl Covariance {
    fn validate(&self, place: &str, known: &[String]) -> Result<(), MaterialError> {
        let n = self.parameters.len();
        let place = format!("{place}, covariance");
        if n == 0 {
            return Err(value(&place, "names no parameter", "name some or leave it out"));
        }
        if let Some(stranger) = self.parameters.iter().find(|p| !known.contains(p)) {
            let problem = format!("`{stranger}` is not a parameter of the model");
            return Err(value(
                &place,
                &problem,
                &format!("the parameters are {}", known.join(", ")),
            ));
        }
        unique("covariance parameter", self.parameters.iter().map(String::as_str))?;
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            let problem = format!("the matrix is not {n} × {n}");
            return Err(value(&place, &problem, "give a row and a column per parameter"));
        }
        if self.is_sound() {
            return Ok(());
        }
        let problem = "the matrix is not a covariance";
        Err(value(&place, problem, "it must be symmetric and positive definite"))
    }
}

/// Whether a range ascends within limits.
fn is_range_within([low, high]: [f64; 2], least: f64, most: f64) -> bool {
    low >= least && high <= most && low <= high
}

/// Refuses a name that is empty or given twice.
fn unique<'a>(
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), MaterialError> {
    let mut seen = HashSet::new();
    for name in names {
        if name.is_empty() {
            return Err(value(what, "has an empty name", "name it"));
        }
        if !seen.insert(name) {
            return Err(MaterialError::Twice { what, name: name.to_owned() });
        }
    }
    Ok(())
}

/// Refuses a name that is given and stands for nothing.
fn refers<'a>(
    place: &str,
    what: &'static str,
    name: Option<&String>,
    known: impl Iterator<Item = &'a String> + Clone,
) -> Result<(), MaterialError> {
    let Some(stranger) = name.filter(|name| !known.clone().any(|key| key == *name)) else {
        return Ok(());
    };
    let mut names: Vec<String> = known.cloned().collect();
    names.dedup();
    Err(dangling(place, what, stranger, names))
}
