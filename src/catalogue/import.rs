//! Import of another laboratory's catalogue. Materials that the database lacks are added with all their
//! revisions; materials that were imported before get the revisions made since. Nothing that is stored changes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::about::About;
use super::error::CatalogueError;
use super::layout::DATABASE;
use super::read::{about, is_newer};
use super::verify::{database, verify_with};
use super::view::CatalogueView;
use crate::effects::{Level, resolve};
use crate::material::{Activity, Material, Origin, Slug};
use crate::store::{Addition, Store, StoreError, StoredRevision};

/// Another laboratory's catalogue that was [verified](super::verify_with) and may be imported.
#[derive(Debug)]
pub struct Import {
    path: PathBuf,
    theirs: Store,
}

/// What the import does with one material.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MaterialPlan {
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
    /// The material was imported from this catalogue before; the revisions made there since are added.
    Continued {
        /// How many.
        revisions: usize,
        /// The revision here that they follow.
        after: u32,
    },
    /// The database has, or had, the same content.
    Unchanged,
    /// The database has another material of this name, which stays as it is.
    Conflict {
        /// [`Material::content_hash`] of the material in the database.
        ours: String,
        /// [`Material::content_hash`] of the material in their catalogue.
        theirs: String,
    },
}

/// What was, or would be, imported.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ImportSummary {
    /// Whether this was a trial that writes nothing.
    pub dry_run: bool,
    /// Every material of their catalogue.
    pub materials: Vec<MaterialPlan>,
    /// What a person should not overlook.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
}

impl Import {
    /// Opens a published folder or its database after a complete check; `view` as for [`verify_with`].
    ///
    /// # Errors
    /// When it is not a catalogue, anything in it is wrong, or a newer program made it.
    pub fn open(bundle: &Path, view: CatalogueView) -> Result<Import, CatalogueError> {
        if bundle.is_dir() && is_newer(bundle) {
            return Err(CatalogueError::Newer { bundle: bundle.to_owned() });
        }
        // A copy of a newer database could not be read either.
        if let Err(CatalogueError::Store(newer @ StoreError::Newer { .. })) =
            database(&database_of(bundle))
        {
            return Err(newer.into());
        }
        let problems = verify_with(bundle, view)?.problems;
        if let Some(first) = problems.first() {
            let others = match problems.len() - 1 {
                0 => String::new(),
                more => format!(" (and {more} more, which `matdb verify` lists)"),
            };
            let (bundle, problem) = (bundle.to_owned(), format!("{first}{others}"));
            return Err(CatalogueError::Unsound { bundle, problem });
        }
        Ok(Import { theirs: database(&database_of(bundle))?, path: bundle.to_owned() })
    }

    /// The database's file.
    pub fn database(&self) -> PathBuf {
        database_of(&self.path)
    }

    /// What the import does with every material. A conflict gets the prefix, if there is one, and is decided again
    /// under that name.
    ///
    /// # Errors
    /// When a database cannot be read, the prefix makes no name, or what would be added has effects that are not known
    /// here, or names that do not read as they stand.
    pub fn plan(
        &self,
        ours: Option<&Store>,
        prefix: Option<&str>,
    ) -> Result<Vec<MaterialPlan>, CatalogueError> {
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
    ) -> Result<MaterialPlan, CatalogueError> {
        let added = Outcome::Added { revisions: self.theirs.revision_numbers(slug)?.len() };
        let known = ours.map_or(Ok(None), |ours| ours.get(&name, None))?;
        let outcome = match (ours, known) {
            (Some(ours), Some(known)) => self.beside(ours, known, slug, &name)?,
            _ => added,
        };
        Ok(MaterialPlan { slug: slug.clone(), name, outcome })
    }

    /// What the import does with a material where the database has one of the same name.
    fn beside(
        &self,
        ours: &Store,
        known: StoredRevision,
        slug: &Slug,
        name: &Slug,
    ) -> Result<Outcome, CatalogueError> {
        let Some(theirs) = self.revision(slug, None, name)? else { return Ok(Outcome::Unchanged) };
        let theirs = theirs.content_hash();
        for revision in ours.revision_numbers(name)? {
            let once = ours.get(name, Some(revision))?;
            if once.is_some_and(|once| once.content_hash == theirs) {
                return Ok(Outcome::Unchanged);
            }
        }
        let since = self.since(slug, name, &known.content_hash)?;
        if !since.is_empty() && self.is_theirs(&known, slug, &since)? {
            return Ok(Outcome::Continued { revisions: since.len(), after: known.revision });
        }
        Ok(Outcome::Conflict { ours: known.content_hash, theirs })
    }

    /// Whether the catalogue that made these newer revisions is the one that the stored material was imported
    /// from: no other may revise or withdraw it.
    fn is_theirs(
        &self,
        known: &StoredRevision,
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
        for revision in self.theirs.revision_numbers(slug)? {
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
        plan: &[MaterialPlan],
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
        let expected: BTreeMap<&Slug, Addition> =
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

    /// Curves of what is added whose form of the footprint is not stated, each with its material.
    ///
    /// # Errors
    /// When their database cannot be read.
    pub fn without_footprint(&self, plan: &[MaterialPlan]) -> Result<Vec<String>, CatalogueError> {
        let mut unstated = Vec::new();
        for MaterialPlan { slug, name, outcome } in plan {
            let is_new = outcome.first().is_some();
            let stored = if is_new { self.theirs.get(slug, None)? } else { None };
            let curves = stored.into_iter().flat_map(|stored| stored.material.curves);
            let curves = curves.filter(|curve| curve.illumination.footprint.is_none());
            unstated.extend(curves.map(|curve| format!("`{name}`, `{}`", curve.name)));
        }
        Ok(unstated)
    }

    /// Numbers of their revisions that are added, oldest first.
    fn wanted(
        &self,
        ours: Option<&Store>,
        taken: &MaterialPlan,
    ) -> Result<Vec<u32>, CatalogueError> {
        let MaterialPlan { slug, name, outcome } = taken;
        match outcome {
            Outcome::Added { .. } => Ok(self.theirs.revision_numbers(slug)?),
            Outcome::Continued { .. } => {
                match ours.map_or(Ok(None), |ours| ours.get(name, None))? {
                    Some(known) => self.since(slug, name, &known.content_hash),
                    None => Err(CatalogueError::Overtaken { slug: name.to_string() }),
                }
            }
            Outcome::Unchanged | Outcome::Conflict { .. } => Ok(Vec::new()),
        }
    }

    fn stored(&self, slug: &Slug, number: u32) -> Result<StoredRevision, CatalogueError> {
        self.theirs.get(slug, Some(number))?.ok_or_else(|| CatalogueError::Unsound {
            bundle: self.path.clone(),
            problem: format!("{slug}@{number} is not there any more"),
        })
    }

    /// Title and people of their catalogue; none where it is a database alone.
    fn about(&self) -> Result<Option<About>, CatalogueError> {
        if !self.path.is_dir() {
            return Ok(None);
        }
        let about = about(&self.path);
        about
            .map(Some)
            .map_err(|problem| CatalogueError::Unsound { bundle: self.path.clone(), problem })
    }

    /// Refuses what `add` would refuse, too: unknown effects and misleading names.
    fn check(&self, ours: Option<&Store>, taken: &MaterialPlan) -> Result<(), CatalogueError> {
        let about = self.about()?;
        for number in self.wanted(ours, taken)? {
            let stored = self.stored(&taken.slug, number)?;
            let problem = match resolve(&stored.material.effects, Level::Material) {
                Err(error) => Some(error.to_string()),
                Ok(_) => {
                    let name = stored.material.misleading_name();
                    name.or_else(|| origin(&about, &stored).misleading_name())
                }
            };
            if let Some(problem) = problem {
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
    /// The expected result of adding the first revision, if any is added.
    fn first(&self) -> Option<Addition> {
        match self {
            Outcome::Added { .. } => Some(Addition::New),
            Outcome::Continued { after, .. } => Some(Addition::Revision(after + 1)),
            Outcome::Unchanged | Outcome::Conflict { .. } => None,
        }
    }
}

/// Where a revision of theirs comes from. If they imported it themselves, this is the catalogue that published it
/// first, which gets the credit.
fn origin(about: &Option<About>, stored: &StoredRevision) -> Origin {
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
