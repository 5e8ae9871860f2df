//! Another laboratory's catalogue into one's own: what is not there is added with all its revisions, and
//! what they have made since of what was taken before; nothing that is there changes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::about::About;
use super::error::CatalogueError;
use super::layout::DATABASE;
use super::verify::{about, database, is_newer, verify};
use crate::effects::{Level, resolve};
use crate::material::{Activity, Material, Origin, Slug};
use crate::store::{Added, RevisionSummary, Store, StoreError, Stored};

/// Somebody's catalogue that was [verified](super::verify) and may be taken over.
#[derive(Debug)]
pub struct Import {
    path: PathBuf,
    theirs: Store,
}

/// What becomes of one material.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Taken {
    /// Its name in their catalogue.
    pub slug: Slug,
    /// Its name here.
    pub name: Slug,
    /// What is done with it.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// What is done with a material.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "result", rename_all = "kebab-case")]
pub enum Outcome {
    /// It is added with its revisions.
    Added {
        /// How many.
        revisions: usize,
    },
    /// What is here was theirs once, and what they have made of it since is added as revisions.
    Continued {
        /// How many.
        revisions: usize,
        /// The revision here that they follow.
        after: u32,
    },
    /// What they have is what is, or once was, here.
    Unchanged,
    /// Something else of this name is here, and stays as it is.
    Conflict {
        /// [`Material::content_hash`] of what is here.
        ours: String,
        /// That of what they have.
        theirs: String,
    },
}

/// What was, or would be, imported.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Imported {
    /// Whether nothing was written because nothing should be.
    pub dry_run: bool,
    /// Every material of their catalogue.
    pub materials: Vec<Taken>,
}

impl Import {
    /// Opens a published folder or its database after a complete check.
    ///
    /// # Errors
    /// When it is no catalogue, anything in it is wrong, or a newer program has made it.
    pub fn open(bundle: &Path) -> Result<Import, CatalogueError> {
        let unsound =
            |problem: String| CatalogueError::Unsound { bundle: bundle.to_owned(), problem };
        if bundle.is_dir() && is_newer(bundle) {
            return Err(CatalogueError::Newer { bundle: bundle.to_owned() });
        }
        // No other copy of it could be read, either.
        if let Err(CatalogueError::Store(newer @ StoreError::Newer { .. })) =
            database(&database_of(bundle))
        {
            return Err(newer.into());
        }
        let problems = verify(bundle)?.problems;
        if let Some(first) = problems.first() {
            let others = match problems.len() - 1 {
                0 => String::new(),
                more => format!(" (and {more} more, which `matdb verify` lists)"),
            };
            return Err(unsound(format!("{first}{others}")));
        }
        Ok(Import { theirs: database(&database_of(bundle))?, path: bundle.to_owned() })
    }

    /// The database's file.
    pub fn database(&self) -> PathBuf {
        database_of(&self.path)
    }

    /// What becomes of every material. Conflicts get the prefix, if there is one, and are looked at
    /// again under that name.
    ///
    /// # Errors
    /// When a database cannot be read, the prefix makes no name, or what would be added has effects that are not known
    /// here, or names that do not read as they stand.
    pub fn plan(
        &self,
        ours: Option<&Store>,
        prefix: Option<&str>,
    ) -> Result<Vec<Taken>, CatalogueError> {
        let mut plan = Vec::new();
        let mut names = BTreeSet::new();
        for summary in self.theirs.list()? {
            let slug = summary.slug;
            let mut taken = self.taken(ours, &slug, slug.clone())?;
            if let (Outcome::Conflict { .. }, Some(prefix)) = (&taken.outcome, prefix) {
                taken = self.taken(ours, &slug, prefixed(prefix, &slug)?)?;
            }
            if !names.insert(taken.name.clone()) {
                let problem =
                    format!("two materials would be called `{}`; choose another", taken.name);
                let prefix = prefix.unwrap_or_default().to_owned();
                return Err(CatalogueError::Prefix { prefix, problem });
            }
            self.check(ours, &taken)?;
            plan.push(taken);
        }
        Ok(plan)
    }

    fn taken(
        &self,
        ours: Option<&Store>,
        slug: &Slug,
        name: Slug,
    ) -> Result<Taken, CatalogueError> {
        let history = self.theirs.history(slug)?;
        let added = Outcome::Added { revisions: history.len() };
        let known = ours.map_or(Ok(None), |ours| ours.get(&name, None))?;
        let outcome = match (ours, known) {
            (Some(ours), Some(known)) => self.beside(ours, known, slug, &name)?,
            _ => added,
        };
        Ok(Taken { slug: slug.clone(), name, outcome })
    }

    /// What becomes of a material beside one of the same name.
    fn beside(
        &self,
        ours: &Store,
        known: Stored,
        slug: &Slug,
        name: &Slug,
    ) -> Result<Outcome, CatalogueError> {
        let Some(theirs) = self.revision(slug, None, name)? else { return Ok(Outcome::Unchanged) };
        let theirs = theirs.content_hash();
        for revision in ours.history(name)? {
            let once = ours.get(name, Some(revision.revision))?;
            if once.is_some_and(|once| once.content_hash == theirs) {
                return Ok(Outcome::Unchanged);
            }
        }
        let since = self.since(slug, name, &known.content_hash)?;
        Ok(match !since.is_empty() && self.is_theirs(&known, slug, &since)? {
            false => Outcome::Conflict { ours: known.content_hash, theirs },
            true => Outcome::Continued { revisions: since.len(), after: known.revision },
        })
    }

    /// Whether the catalogue that made these newer revisions is the one from which what is here was
    /// imported: nobody else may revise, or withdraw, what is here.
    fn is_theirs(
        &self,
        known: &Stored,
        slug: &Slug,
        since: &[u32],
    ) -> Result<bool, CatalogueError> {
        let Some(first) = known.activity.as_ref().and_then(|activity| activity.origin.as_ref())
        else {
            return Ok(false);
        };
        let about = self.about()?;
        for &number in since {
            let newer = origin(&about, &self.stored(slug, number)?);
            if newer.is_anonymous()
                || (&newer.title, &newer.authors) != (&first.title, &first.authors)
            {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Numbers of their revisions after the one with this content; none where they never had it.
    fn since(&self, slug: &Slug, name: &Slug, content: &str) -> Result<Vec<u32>, CatalogueError> {
        let mut since = None;
        for RevisionSummary { revision, .. } in self.theirs.history(slug)? {
            let Some(material) = self.revision(slug, Some(revision), name)? else { continue };
            match &mut since {
                _ if material.content_hash() == content => since = Some(Vec::new()),
                Some(numbers) => numbers.push(revision),
                None => {}
            }
        }
        Ok(since.unwrap_or_default())
    }

    /// A revision of theirs under the name that it gets here.
    fn revision(
        &self,
        slug: &Slug,
        number: Option<u32>,
        name: &Slug,
    ) -> Result<Option<Material>, CatalogueError> {
        let stored = self.theirs.get(slug, number)?;
        Ok(stored.map(|stored| Material { slug: name.clone(), ..stored.material }))
    }

    /// Adds what the plan adds, in one transaction: all of it or nothing.
    ///
    /// # Errors
    /// When the database cannot be written, or somebody else has changed a material of the same name since the
    /// plan was made.
    pub fn take(
        &self,
        ours: &mut Store,
        plan: &[Taken],
        by: &Activity,
    ) -> Result<(), CatalogueError> {
        let about = self.about()?;
        let mut wanted = Vec::new();
        for taken in plan {
            wanted
                .extend(self.wanted(Some(ours), taken)?.into_iter().map(|number| (taken, number)));
        }
        let made = wanted.iter().map(|(taken, number)| {
            let stored = self.stored(&taken.slug, *number)?;
            let by = Activity { origin: Some(origin(&about, &stored)), ..by.clone() };
            let material = Material { slug: taken.name.clone(), ..stored.material };
            Ok((material, Some(by)))
        });
        let expected: BTreeMap<&Slug, Added> =
            plan.iter().filter_map(|taken| Some((&taken.name, taken.outcome.first()?))).collect();
        let mut last: Option<Slug> = None;
        ours.add_each_made(made, |material, added| {
            let is_first = last.as_ref() != Some(&material.slug);
            if is_first && expected.get(&material.slug) != Some(&added) {
                return Err(CatalogueError::Overtaken { slug: material.slug.to_string() });
            }
            last = Some(material.slug.clone());
            Ok(())
        })
    }

    /// Numbers of their revisions that are added, oldest first.
    fn wanted(&self, ours: Option<&Store>, taken: &Taken) -> Result<Vec<u32>, CatalogueError> {
        let Taken { slug, name, outcome } = taken;
        match outcome {
            Outcome::Added { .. } => {
                Ok(self.theirs.history(slug)?.into_iter().map(|line| line.revision).collect())
            }
            Outcome::Continued { .. } => {
                match ours.map_or(Ok(None), |ours| ours.get(name, None))? {
                    Some(known) => self.since(slug, name, &known.content_hash),
                    None => Err(CatalogueError::Overtaken { slug: name.to_string() }),
                }
            }
            Outcome::Unchanged | Outcome::Conflict { .. } => Ok(Vec::new()),
        }
    }

    fn stored(&self, slug: &Slug, number: u32) -> Result<Stored, CatalogueError> {
        self.theirs.get(slug, Some(number))?.ok_or_else(|| CatalogueError::Unsound {
            bundle: self.path.clone(),
            problem: format!("{slug}@{number} is not there any more"),
        })
    }

    /// What their catalogue says of itself; none of a database alone.
    fn about(&self) -> Result<Option<About>, CatalogueError> {
        match self.path.is_dir() {
            true => about(&self.path)
                .map(Some)
                .map_err(|problem| CatalogueError::Unsound { bundle: self.path.clone(), problem }),
            false => Ok(None),
        }
    }

    /// Refuses what nobody could add here by themselves.
    fn check(&self, ours: Option<&Store>, taken: &Taken) -> Result<(), CatalogueError> {
        let about = self.about()?;
        for number in self.wanted(ours, taken)? {
            let stored = self.stored(&taken.slug, number)?;
            let effects = resolve(&stored.material.effects, Level::Material);
            let problem = effects.err().map(|error| error.to_string());
            let misleading =
                || stored.material.misleading_name().or(origin(&about, &stored).misleading_name());
            if let Some(problem) = problem.or_else(misleading) {
                return Err(CatalogueError::Unsound {
                    bundle: self.path.clone(),
                    problem: format!("{}@{number}: {problem}", taken.slug),
                });
            }
        }
        Ok(())
    }
}

impl Outcome {
    /// What adding the first of the revisions does, if any is added.
    fn first(&self) -> Option<Added> {
        match self {
            Outcome::Added { .. } => Some(Added::New),
            Outcome::Continued { after, .. } => Some(Added::Revision(after + 1)),
            Outcome::Unchanged | Outcome::Conflict { .. } => None,
        }
    }
}

/// Where a revision of theirs comes from: of what they have imported themselves the catalogue that published it
/// first, whom it is to be credited to.
fn origin(about: &Option<About>, stored: &Stored) -> Origin {
    if let Some(first) = stored.activity.as_ref().and_then(|activity| activity.origin.clone()) {
        return first;
    }
    let about = about.clone();
    let (version, doi, url) =
        about.clone().map_or((None, None, None), |about| (about.version, about.doi, about.url));
    Origin {
        authors: about.as_ref().map_or(Vec::new(), About::authors),
        title: about.map(|about| about.title),
        version,
        doi,
        url,
        revision: stored.revision,
        added_at: stored.added_at.clone(),
        program_version: stored.program_version.clone(),
        command: stored.activity.as_ref().map(|activity| activity.command.clone()),
    }
}

fn database_of(bundle: &Path) -> PathBuf {
    if bundle.is_dir() { bundle.join(DATABASE) } else { bundle.to_owned() }
}

fn prefixed(prefix: &str, slug: &Slug) -> Result<Slug, CatalogueError> {
    let name = format!("{prefix}{slug}");
    name.parse().map_err(|problem| CatalogueError::Prefix { prefix: prefix.to_owned(), problem })
}
