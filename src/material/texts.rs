//! Every text of a material with its place, and how long one may be.

use super::bidirectional::turns_the_line;
use super::error::{MaterialError, value};
use super::report::FitReport;
use super::revision::Material;

/// Longest text, bytes: some twenty pages. Whoever reads a material holds all its texts at once.
pub const LONGEST_TEXT_BYTES: usize = 64 << 10;

impl Material {
    /// Refuses a text that is longer than [`LONGEST_TEXT_BYTES`], and one with a NUL, at which SQLite's functions end a text.
    pub(super) fn check_every_text(&self) -> Result<(), MaterialError> {
        let (mut found, mut ended) = (None, None);
        self.texts(&mut |place, text| {
            if text.len() > LONGEST_TEXT_BYTES && found.is_none() {
                found = Some((place.to_owned(), text.len()));
            }
            if text.contains('\0') && ended.is_none() {
                ended = Some(place.to_owned());
            }
        });
        if let Some(place) = ended {
            return Err(value(&place, "the text holds a NUL character", "remove it"));
        }
        let Some((place, bytes)) = found else { return Ok(()) };
        let problem = format!(
            "the text has {} KiB and {} KiB are the most",
            bytes.div_ceil(1 << 10),
            LONGEST_TEXT_BYTES >> 10
        );
        Err(value(&place, &problem, "shorten it, or publish it elsewhere and give its address"))
    }

    /// Names of all kinds with their places: what a person reads in one line.
    pub fn names(&self, take: &mut dyn FnMut(&str, &str)) {
        take("name", &self.name);
        take("class", &self.class);
        self.tags.iter().for_each(|tag| take("tags", tag));
        for source in &self.sources {
            take("a key of a source", &source.key);
            take("title of a source", &source.title);
            source.citation.authors.iter().for_each(|author| take("authors", author));
        }
        for instrument in &self.instruments {
            take("a key of an instrument", &instrument.key);
            take("name of an instrument", &instrument.name);
        }
        self.sessions.iter().for_each(|session| take("a key of a session", &session.key));
        self.permittivities.iter().for_each(|entry| take("a key of a permittivity", &entry.key));
        self.layers.iter().for_each(|layer| take("name of a layer", &layer.name));
        self.curves.iter().for_each(|curve| take("name of a curve", &curve.name));
        self.fits.iter().for_each(|fit| take("name of a fit", &fit.name));
        self.effects.iter().for_each(|effect| take("name of an effect", &effect.name));
        self.findings.iter().for_each(|finding| take("effect of a finding", &finding.effect));
    }

    /// A sentence on the first name that hides its true order of characters.
    pub fn misleading_name(&self) -> Option<String> {
        let mut found = None;
        self.names(&mut |place, name| {
            if turns_the_line(name) && found.is_none() {
                found = Some(format!("{place}: it holds a character that turns the line round"));
            }
        });
        found
    }

    fn texts(&self, take: &mut dyn FnMut(&str, &str)) {
        self.names(take);
        take("description", &self.description);
        take("licence", &self.licence);
        take("render", &self.render);
        take("status", self.status.reason().unwrap_or_default());
        take("finish", self.finish.as_deref().unwrap_or_default());
        self.unknown.iter().for_each(|sentence| take("unknown", sentence));
        if let Some(method) =
            self.roughness.as_ref().and_then(|roughness| roughness.method.as_ref())
        {
            take("roughness: method", method);
        }
        self.source_texts(take);
        self.instrument_texts(take);
        self.sessions.iter().filter_map(|session| session.note.as_ref()).for_each(|note| {
            take("note of a session", note);
        });
        for fit in &self.fits {
            take(&format!("fit `{:.40}`: estimator", fit.name), &fit.estimator);
            if let Some(report) = &fit.report {
                report.texts(&format!("fit `{:.40}`: report", fit.name), take);
            }
        }
        for finding in &self.findings {
            finding.confusable_with.iter().for_each(|other| take("confusable_with", other));
        }
    }

    fn source_texts(&self, take: &mut dyn FnMut(&str, &str)) {
        for source in &self.sources {
            let citation = &source.citation;
            for (what, text) in [
                ("doi", source.doi.as_ref()),
                ("url", source.url.as_ref()),
                ("licence", source.licence.as_ref()),
                ("note", source.note.as_ref()),
                ("container", citation.container.as_ref()),
                ("volume", citation.volume.as_ref()),
                ("pages", citation.pages.as_ref()),
                ("publisher", citation.publisher.as_ref()),
            ] {
                let Some(text) = text else { continue };
                take(&format!("source `{:.40}`: {what}", source.key), text);
            }
        }
    }

    fn instrument_texts(&self, take: &mut dyn FnMut(&str, &str)) {
        for instrument in &self.instruments {
            for (what, text) in [
                ("polarisation", &instrument.polarisation),
                ("note", &instrument.note),
                ("transmit_polarisation", &instrument.transmit_polarisation),
                ("receive_polarisation", &instrument.receive_polarisation),
                ("calibration_target", &instrument.calibration_target),
                ("looks_method", &instrument.looks_method),
            ] {
                let Some(text) = text else { continue };
                take(&format!("instrument `{:.40}`: {what}", instrument.key), text);
            }
        }
    }
}

impl FitReport {
    fn texts(&self, place: &str, take: &mut dyn FnMut(&str, &str)) {
        let own = [&self.method, &self.stop, &self.version].into_iter().chain(&self.gauge);
        let names = self.estimates.iter().map(|estimate| &estimate.name);
        let given = self.given.iter().map(|given| &given.name);
        let own = own.chain(self.held_out.iter().map(|held| &held.blocks_of));
        own.chain(&self.verdict).chain(names).chain(given).for_each(|text| take(place, text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;

    #[test]
    fn a_text_that_is_too_long_is_refused_with_its_place() {
        let material = builtin::get("cotton").unwrap().unwrap();
        let long = || "x".repeat(LONGEST_TEXT_BYTES + 1);
        let mut just = material.clone();
        just.description = "x".repeat(LONGEST_TEXT_BYTES);
        assert_eq!(just.validate(), Ok(()));
        type Spoil = fn(&mut Material, String);
        let spoils: [(Spoil, &str); 6] = [
            (|m, long| m.name = long, "name"),
            (|m, long| m.description = long, "description"),
            (|m, long| m.tags.push(long), "tags"),
            (|m, long| m.unknown.push(long), "unknown"),
            (|m, long| m.sources[0].note = Some(long), "note"),
            (|m, long| m.instruments[0].note = Some(long), "note"),
        ];
        for (spoil, place) in spoils {
            let mut spoilt = material.clone();
            if spoilt.instruments.is_empty() {
                spoilt.instruments.push(crate::material::Instrument {
                    key: "bench".to_owned(),
                    centre_frequency_hz: 3e11,
                    ..Default::default()
                });
            }
            spoil(&mut spoilt, long());
            let said = spoilt.validate().unwrap_err().to_string();
            assert!(said.contains(place) && said.contains("64 KiB are the most"), "{said}");
            assert!(said.contains("shorten it") && said.len() < 300, "{said}");
        }
    }
}
