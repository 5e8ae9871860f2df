//! What a catalogue says of itself: title, people, licence. A small TOML file that a laboratory writes
//! once.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::layout::{ABOUT, SUMS};
use crate::material::form::{is_address, is_doi, is_licence, is_orcid};
use crate::material::{USUAL_TITLE, turns_the_line};

/// What a catalogue says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct About {
    /// Title.
    pub title: String,
    /// A sentence or two below it.
    pub description: String,
    /// Version of this publication, as the people who cite it will read it; none: not numbered.
    pub version: Option<String>,
    /// SPDX expression of the licence of the catalogue as a whole; materials say their own. None: nobody has
    /// declared one, so that it is what they share.
    pub licence: Option<String>,
    /// Address at which the catalogue will stand, if it is known.
    pub url: Option<String>,
    /// DOI of the publication, without a resolver in front.
    pub doi: Option<String>,
    /// Who answers for it.
    #[serde(rename = "person")]
    pub people: Vec<Person>,
    /// Laboratories that answer for it, after the people.
    #[serde(rename = "institute", skip_serializing_if = "Vec::is_empty")]
    pub institutes: Vec<Institute>,
}

/// Somebody who answers for a catalogue.
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

/// A laboratory that answers for a catalogue.
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
    /// What the file says that it should not, and where.
    problem: String,
}

impl About {
    /// Reads the file's text; `file` names it in errors.
    ///
    /// # Errors
    /// When it is no TOML, has a key that means nothing, or lacks a name.
    ///
    /// ```
    /// use matdb::catalogue::About;
    /// let text = "title = 'Paints of our laboratory'\n[[person]]\nfamily = 'Roe'\ngiven = 'Ann'";
    /// assert_eq!(About::parse("about.toml", text).unwrap().people[0].family, "Roe");
    /// assert!(About::parse("about.toml", "titel = 'x'").is_err());
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<About, AboutError> {
        let refused = |problem: String| AboutError { file: file.to_owned(), problem };
        let about: About = toml::from_str(text).map_err(|error| refused(error.to_string()))?;
        about.check(file)?;
        Ok(about)
    }

    /// What the publication in a folder says of itself; none where there is none, or none that can be read.
    pub fn of_publication(folder: &Path) -> Option<About> {
        let text = fs::read_to_string(folder.join(ABOUT)).ok()?;
        let about: About = serde_json::from_str(&text).ok()?;
        let is_publication = folder.join(SUMS).is_file() && about.check(ABOUT).is_ok();
        is_publication.then_some(about)
    }

    /// Whether somebody answers for it.
    pub fn has_authors(&self) -> bool {
        !self.people.is_empty() || !self.institutes.is_empty()
    }

    /// Who answers for it, people as `Family, Given`.
    pub(super) fn authors(&self) -> Vec<String> {
        let person = |Person { family, given, .. }: &Person| format!("{family}, {given}");
        let institutes = self.institutes.iter().map(|institute| institute.name.clone());
        self.people.iter().map(person).chain(institutes).collect()
    }

    fn check(&self, file: &str) -> Result<(), AboutError> {
        let about = self;
        let refused = |problem: String| AboutError { file: file.to_owned(), problem };
        if about.title.trim().is_empty() {
            return Err(refused("`title` is empty; give the catalogue a title".to_owned()));
        }
        let mut names = vec![("title", about.title.as_str())];
        names.extend(about.version.iter().map(|version| ("version", version.as_str())));
        for Person { family, given, affiliation, .. } in &about.people {
            names.extend([("family", family.as_str()), ("given", given.as_str())]);
            names.extend(affiliation.iter().map(|place| ("affiliation", place.as_str())));
        }
        names.extend(about.institutes.iter().map(|institute| ("name", institute.name.as_str())));
        if let Some((key, _)) = names.into_iter().find(|(_, name)| turns_the_line(name)) {
            return Err(refused(format!(
                "`{key}` holds a character that turns the line round; write it without"
            )));
        }
        if let Some(licence) = about.licence.as_ref().filter(|licence| !is_licence(licence)) {
            return Err(refused(format!(
                "`licence` is `{licence}`; write an SPDX expression such as CC-BY-4.0 or \
                 LicenseRef-proprietary"
            )));
        }
        let is_one_name = |name: &str| !name.trim().is_empty() && !name.contains(',');
        let mut institutes = about.institutes.iter();
        if let Some(Institute { name, .. }) = institutes.find(|one| !is_one_name(&one.name)) {
            return Err(refused(format!(
                "`name` of an [[institute]] is `{name}`; write a name without a comma, such as `Laboratory at \
                 University`, since those with one are read as `Family, Given`"
            )));
        }
        let urls = about.institutes.iter().filter_map(|institute| institute.url.as_ref());
        if let Some(url) = urls.chain(&about.url).find(|url| !is_address(url)) {
            return Err(refused(format!(
                "`url` is `{url}`; write an address that begins with http:// or https://"
            )));
        }
        if let Some(doi) = about.doi.as_ref().filter(|doi| !is_doi(doi)) {
            return Err(refused(format!(
                "`doi` is `{doi}`; write it as 10.1234/name, without a resolver in front"
            )));
        }
        let orcids = about.people.iter().flat_map(|person| &person.orcid);
        if let Some(orcid) = orcids.into_iter().find(|orcid| !is_orcid(orcid)) {
            return Err(refused(format!(
                "`orcid` is `{orcid}`, whose digits do not check; copy it from orcid.org, as in \
                 0000-0002-1825-0097"
            )));
        }
        Ok(())
    }
}
