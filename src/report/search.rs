//! A search for words in the database and in the built-in materials that it does not have.

use serde::Serialize;

use crate::error::Error;
use crate::setup::{Database, store_of_not_added};
use crate::store::{Filter, Match, Store};

/// What is looked for.
#[derive(Clone, Copy, Debug)]
pub struct MaterialSearch<'a> {
    /// Words, all of which must be there; the last may be a beginning.
    pub words: &'a str,
    /// Which of the materials with these words are wanted.
    pub filter: &'a Filter,
    /// How many materials are wanted at most.
    pub most: u32,
}

/// A material with the words.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialHit {
    /// The material and the text around the words.
    #[serde(flatten)]
    pub hit: Match,
    /// Where it is: `database` or `built-in`.
    pub origin: &'static str,
}

impl MaterialSearch<'_> {
    /// The materials with the words: the best first, those of the database before built-in ones.
    ///
    /// # Errors
    /// Words without a letter or a digit; a database that cannot be read.
    pub fn run(&self, database: &Database) -> Result<Vec<MaterialHit>, Error> {
        if !self.words.chars().any(char::is_alphanumeric) {
            return Err(Error::usage(
                "there is no word to look for",
                "give one with a letter or a digit, as in `matdb search paint`",
            ));
        }
        let store = database.read()?;
        let missing = store_of_not_added(store.as_ref())?;
        let mut hits = Vec::new();
        for (store, origin) in [(store.as_ref(), "database"), (Some(&missing), "built-in")] {
            let search = |store: &Store| store.search(self.words, self.filter, self.most);
            for hit in store.map_or(Ok(Vec::new()), search)? {
                hits.push(MaterialHit { hit, origin });
            }
        }
        hits.truncate(usize::try_from(self.most).unwrap_or(usize::MAX));
        Ok(hits)
    }
}
