//! Where numbers come from: sources, sessions of measurement, and the commands that made a revision.

use serde::{Deserialize, Serialize};

use super::bidirectional::turns_the_line;
use super::error::{MaterialError, value};
use super::form::{is_date, is_hash};
use super::number_check::{NumberCheck, is_number};

/// Where numbers come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Key within the material.
    pub key: String,
    /// How the numbers came to be.
    pub kind: SourceKind,
    /// Citation or, for our own numbers, how they were made.
    pub title: String,
    /// Digital object identifier, without a resolver in front.
    pub doi: Option<String>,
    /// Address, where there is no DOI.
    pub url: Option<String>,
    /// SPDX identifier of the licence of the source's data.
    pub licence: Option<String>,
    /// What was taken and how it was turned into our numbers.
    pub note: Option<String>,
    /// What a list of references needs beyond the title.
    #[serde(default, skip_serializing_if = "Citation::is_empty")]
    pub citation: Citation,
    /// How the numbers got from there to here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub making: Option<Making>,
}

/// What a list of references needs beyond a title, a DOI and an address.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Citation {
    /// Authors, each as `Family, Given`; an organisation as it writes itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub authors: Vec<String>,
    /// Year of publication, 1000 to 9999.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub year: Option<u16>,
    /// Journal, book, conference or archive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub container: Option<String>,
    /// Volume of the container.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<String>,
    /// Pages or article number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pages: Option<String>,
    /// Publisher or institution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub publisher: Option<String>,
}

/// How numbers came to be. The four are never mixed up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceKind {
    /// Somebody measured this.
    Measured,
    /// A publication states it.
    Literature,
    /// A physical model computed it from other numbers.
    Modelled,
    /// Chosen to render something plausible; not measured.
    Synthetic,
}

impl SourceKind {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            SourceKind::Measured => "measured",
            SourceKind::Literature => "literature",
            SourceKind::Modelled => "modelled",
            SourceKind::Synthetic => "synthetic",
        }
    }

    /// What to say of a model that belongs to a curve of this kind, fitted to it or not.
    pub fn words_beside(self, is_fitted: bool) -> String {
        let how = if is_fitted { "fitted to" } else { "stated beside" };
        format!("{how} {} data", self.as_str())
    }
}

/// How numbers got from their source into a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Making {
    /// Whoever made this entry measured them.
    OwnMeasurement,
    /// Copied from a data file, a table or a text.
    Copied,
    /// Read off a printed figure.
    Digitised,
    /// Computed from what the source states.
    Computed,
}

impl Making {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Making::OwnMeasurement => "own-measurement",
            Making::Copied => "copied",
            Making::Digitised => "digitised",
            Making::Computed => "computed",
        }
    }
}

/// One sitting in which curves were measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Key within the material.
    pub key: String,
    /// Day, ISO 8601: `2026-03-14`.
    pub date: String,
    /// Temperature of the air, K, above 0.
    pub temperature_k: Option<f64>,
    /// Relative humidity of the air, 0 to 1.
    pub relative_humidity: Option<f64>,
    /// BLAKE3 of the measured cloud's file, hexadecimal.
    pub cloud_hash: Option<String>,
    /// BLAKE3 of the mesh's file, hexadecimal.
    pub mesh_hash: Option<String>,
    /// Root mean square of what the registration of cloud to mesh left over, m, 0 or more.
    pub registration_rms_m: Option<f64>,
    /// Standard deviation of a normal by the error of measurement, rad, 0 to π/2.
    pub normal_sd_rad: Option<f64>,
    /// Standard deviation of the normals within one footprint, rad, 0 to π/2.
    pub footprint_sd_rad: Option<f64>,
    /// Where the mesh stood in the radar's frame.
    pub pose: Option<SessionPose>,
    /// Anything else that a reader must know.
    pub note: Option<String>,
}

/// A rotation and a shift: x → rotation·x + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionPose {
    /// Rows of the rotation matrix.
    pub rotation_rows: [[f64; 3]; 3],
    /// Shift along x, y and z, m.
    pub translation_m: [f64; 3],
}

/// Which command made a revision, and of what.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Activity {
    /// Name of the command, such as `fit`.
    pub command: String,
    /// The files that it read.
    pub inputs: Vec<Input>,
    /// Somebody else's catalogue that the revision was taken from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

/// Title of a catalogue that was given none.
pub const USUAL_TITLE: &str = "Materials for 300 GHz imaging radar";

/// Somebody else's catalogue that a revision was taken from, and what it was there.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Origin {
    /// Who answers for the catalogue, as `Family, Given`; none where it names nobody, and of what was imported
    /// before they were noted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub authors: Vec<String>,
    /// Title of the catalogue; none of a database by itself.
    pub title: Option<String>,
    /// Its version, as people who cite it read it.
    pub version: Option<String>,
    /// Its DOI, without a resolver in front.
    pub doi: Option<String>,
    /// Its address.
    pub url: Option<String>,
    /// Number of the revision there, from 1.
    pub revision: u32,
    /// When it was added there: UTC, ISO 8601, to the second.
    pub added_at: String,
    /// Version of the program that added it there.
    pub program_version: String,
    /// Which command made it there; none where that was not recorded.
    pub command: Option<String>,
}

/// A file that a command read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Name of the file, without its folder.
    pub name: String,
    /// BLAKE3 of its bytes, hexadecimal.
    pub hash: String,
}

impl Origin {
    /// The catalogue with those who answer for it.
    pub fn credit(&self) -> String {
        match self.authors.as_slice() {
            [] => self.catalogue(),
            authors => format!("{}: {}", authors.join("; "), self.catalogue()),
        }
    }

    /// The catalogue as people cite it: title, version and where it is.
    pub fn catalogue(&self) -> String {
        let version = self.version.as_ref().map(|version| format!("version {version}"));
        let doi = self.doi.as_ref().map(|doi| format!("https://doi.org/{doi}"));
        let parts = [Some(self.title().to_owned()), version, doi.or(self.url.clone())];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// A sentence on the first of its names that hides its true order of characters.
    pub fn misleading_name(&self) -> Option<String> {
        let names = self.authors.iter().chain(&self.title).chain(&self.version);
        names.into_iter().any(|name| turns_the_line(name)).then(|| {
            "its catalogue or an author of that: the name holds a character that turns the line round".to_owned()
        })
    }

    /// Whether nothing identifies the catalogue: it names no author and has no title of its own.
    pub fn is_anonymous(&self) -> bool {
        let has_own_title = self.title.as_ref().is_some_and(|title| title != USUAL_TITLE);
        self.authors.is_empty() && !has_own_title
    }

    /// Its title, or that it has none.
    pub fn title(&self) -> &str {
        self.title.as_deref().unwrap_or("a catalogue without a title")
    }
}

impl Citation {
    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        *self == Citation::default()
    }
}

impl Source {
    /// The title behind who wrote it and when, as far as that is known: `Doe, Jane; Roe, Ann (2026): Title`.
    pub fn titled(&self) -> String {
        let Citation { authors, year, .. } = &self.citation;
        let year = year.map(|year| format!("({year})"));
        let by: Vec<String> = [(!authors.is_empty()).then(|| authors.join("; ")), year]
            .into_iter()
            .flatten()
            .collect();
        if by.is_empty() { self.title.clone() } else { format!("{}: {}", by.join(" "), self.title) }
    }

    pub(super) fn validate(&self) -> Result<(), MaterialError> {
        let place = format!("source `{}`", self.key);
        if self.title.trim().is_empty() {
            return Err(value(&format!("{place}: title"), "is empty", "fill it in"));
        }
        if self.citation.year.is_some_and(|year| !(1000..=9999).contains(&year)) {
            return Err(value(&place, "the year has not four digits", "mend it or leave it out"));
        }
        if self.citation.authors.iter().any(|author| author.trim().is_empty()) {
            return Err(value(&place, "an author has no name", "fill it in or leave it out"));
        }
        Ok(())
    }
}

impl Session {
    pub(super) fn validate(&self) -> Result<(), MaterialError> {
        let place = format!("session `{}`", self.key);
        let check = NumberCheck::new(&place);
        if !is_date(&self.date) {
            let problem = format!("`{}` is not a date", self.date.escape_debug());
            return Err(value(&place, &problem, "write it as 2026-03-14"));
        }
        check.positive("the temperature above absolute zero", self.temperature_k)?;
        if self.relative_humidity.is_some_and(|share| !(0.0..=1.0).contains(&share)) {
            return Err(value(&place, "the humidity is not within 0–100 %", "mend the number"));
        }
        let hashes = [("cloud", &self.cloud_hash), ("mesh", &self.mesh_hash)];
        for (what, hash) in hashes {
            if hash.as_ref().is_some_and(|hash| !is_hash(hash)) {
                let problem = format!("the hash of the {what} is not 64 hexadecimal digits");
                return Err(value(&place, &problem, "give what `b3sum` prints, or leave it out"));
            }
        }
        check.not_negative("the residual of the registration", self.registration_rms_m)?;
        check.quarter_turn("the deviation of the normals", self.normal_sd_rad)?;
        check.quarter_turn("the spread over the footprint", self.footprint_sd_rad)?;
        if self.pose.is_some_and(|pose| !pose.is_rigid()) {
            return Err(value(&place, "the pose is not a rotation with a shift", "mend its rows"));
        }
        Ok(())
    }
}

impl SessionPose {
    fn is_rigid(&self) -> bool {
        // What a file with six digits leaves of orthogonality.
        const ROUNDING: f64 = 1e-5;
        let [x, y, z] = self.rotation_rows.map(glam::DVec3::from_array);
        let unit = [x, y, z].iter().all(|row| (row.length() - 1.0).abs() < ROUNDING);
        let right_handed = (x.cross(y) - z).length() < ROUNDING;
        unit && right_handed && self.translation_m.into_iter().all(is_number)
    }
}
