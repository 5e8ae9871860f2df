//! Title, people and licence of a catalogue: a small TOML file that a laboratory writes once.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::layout::{ABOUT, SUMS};
use crate::formats::text::from_toml;
use crate::material::form::{is_address, is_doi, is_licence, is_orcid};
use crate::material::{USUAL_TITLE, turns_the_line};

/// Title, people and licence of a catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct About {
    /// Title.
    pub title: String,
    /// A sentence or two below it.
    pub description: String,
    /// Version of this publication, for those who cite it; none where it is not numbered.
    pub version: Option<String>,
    /// SPDX expression of the licence of the catalogue as a whole. None where nobody declared one: it is then the
    /// licence that all materials share.
    pub licence: Option<String>,
    /// Web address at which the catalogue will be published, if it is known.
    pub url: Option<String>,
    /// DOI of the publication, without a resolver in front.
    pub doi: Option<String>,
    /// People who are responsible for it.
    #[serde(rename = "person")]
    pub people: Vec<Person>,
    /// Laboratories that are responsible for it, listed after the people.
    #[serde(rename = "institute", skip_serializing_if = "Vec::is_empty")]
    pub institutes: Vec<Institute>,
}

/// A person who is responsible for a catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// Family name.
    pub family: String,
    /// Given names.
    pub given: String,
    /// ORCID, sixteen digits in groups of four.
    pub orcid: Option<String>,
    /// Where they work.
    pub affiliation: Option<String>,
}

/// A laboratory that is responsible for a catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Institute {
    /// Its name, without a comma: names of authors with one are read as `Family, Given`.
    pub name: String,
    /// Its address.
    pub url: Option<String>,
}

impl Default for About {
    fn default() -> About {
        About {
            title: USUAL_TITLE.to_owned(),
            description: "How materials scatter, measured or fitted, each number with its source."
                .to_owned(),
            version: None,
            licence: None,
            url: None,
            doi: None,
            people: Vec::new(),
            institutes: Vec::new(),
        }
    }
}

/// Why an `about` file was refused.
#[derive(Debug, Error)]
#[error("{file}: {problem}")]
pub struct AboutError {
    /// The file.
    file: String,
    /// What is wrong, and where.
    problem: String,
}

impl About {
    /// Reads the file's text; `file` names it in errors.
    ///
    /// # Errors
    /// When it is not TOML, has an unknown key, or lacks a name.
    ///
    /// ```
    /// use matdb::catalogue::About;
    /// let text = "title = 'Paints of our laboratory'\n[[person]]\nfamily = 'Roe'\ngiven = 'Ann'";
    /// assert_eq!(About::parse("about.toml", text).unwrap().people[0].family, "Roe");
    /// assert!(About::parse("about.toml", "titel = 'x'").is_err());
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<About, AboutError> {
        About::checked(text).map_err(|problem| AboutError { file: file.to_owned(), problem })
    }

    fn checked(text: &str) -> Result<About, String> {
        let about: About = from_toml(text).map_err(|error| error.to_string())?;
        about.check()?;
        Ok(about)
    }

    /// That of the publication in a folder; none where there is no publication, or its record cannot be read.
    pub fn of_publication(folder: &Path) -> Option<About> {
        let text = fs::read_to_string(folder.join(ABOUT)).ok()?;
        let about: About = serde_json::from_str(&text).ok()?;
        let is_publication = folder.join(SUMS).is_file() && about.check().is_ok();
        is_publication.then_some(about)
    }

    /// Whether it names people or institutes.
    pub fn has_authors(&self) -> bool {
        !self.people.is_empty() || !self.institutes.is_empty()
    }

    /// People, as `Family, Given`, then institutes.
    pub(super) fn authors(&self) -> Vec<String> {
        let people = self.people.iter().map(|p| format!("{}, {}", p.family, p.given));
        people.chain(self.institutes.iter().map(|institute| institute.name.clone())).collect()
    }

    /// The first problem of what was stated, with its way out.
    fn check(&self) -> Result<(), String> {
        if self.title.trim().is_empty() {
            return Err("`title` is empty; give the catalogue a title".to_owned());
        }
        if let Some((key, _)) = self.names().into_iter().find(|(_, name)| turns_the_line(name)) {
            return Err(format!(
                "`{key}` holds a character that turns the line round; write it without"
            ));
        }
        if let Some(licence) = self.licence.as_ref().filter(|licence| !is_licence(licence)) {
            return Err(format!(
                "`licence` is `{licence}`; write an SPDX expression such as CC-BY-4.0 or \
                 LicenseRef-proprietary"
            ));
        }
        if let Some(Institute { name, .. }) = self.institutes.iter().find(|i| !i.has_one_name()) {
            return Err(format!(
                "`name` of an [[institute]] is `{name}`; write a name without a comma, such as `Laboratory at \
                 University`, since those with one are read as `Family, Given`"
            ));
        }
        let urls = self.institutes.iter().filter_map(|institute| institute.url.as_ref());
        if let Some(url) = urls.chain(&self.url).find(|url| !is_address(url)) {
            return Err(format!(
                "`url` is `{url}`; write an address that begins with http:// or https://"
            ));
        }
        if let Some(doi) = self.doi.as_ref().filter(|doi| !is_doi(doi)) {
            return Err(format!(
                "`doi` is `{doi}`; write it as 10.1234/name, without a resolver in front"
            ));
        }
        let mut orcids = self.people.iter().flat_map(|person| &person.orcid);
        if let Some(orcid) = orcids.find(|orcid| !is_orcid(orcid)) {
            return Err(format!(
                "`orcid` is `{orcid}`, whose digits do not check; copy it from orcid.org, as in \
                 0000-0002-1825-0097"
            ));
        }
        Ok(())
    }

    /// Every name that is shown in a line, with its key.
    fn names(&self) -> Vec<(&'static str, &str)> {
        let mut names = vec![("title", self.title.as_str())];
        names.extend(self.version.iter().map(|version| ("version", version.as_str())));
        for Person { family, given, affiliation, .. } in &self.people {
            names.extend([("family", family.as_str()), ("given", given.as_str())]);
            names.extend(affiliation.iter().map(|place| ("affiliation", place.as_str())));
        }
        names.extend(self.institutes.iter().map(|institute| ("name", institute.name.as_str())));
        names
    }
}

impl Institute {
    fn has_one_name(&self) -> bool {
        !self.name.trim().is_empty() && !self.name.contains(',')
    }
}
