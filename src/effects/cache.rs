//! The latest results of slow functions.

use std::sync::{Arc, Mutex, PoisonError};

/// The latest results of a slow function by what they depend on. By default it holds those of a dozen points around the one
/// that a search stands at, with it and the next one.
pub(super) struct Cache<K, V, const MOST: usize = 15>(Mutex<Vec<(K, Arc<V>)>>);

impl<K, V, const MOST: usize> Default for Cache<K, V, MOST> {
    fn default() -> Self {
        Cache(Mutex::default())
    }
}

impl<K: PartialEq, V, const MOST: usize> Cache<K, V, MOST> {
    /// The result for a key: the stored one, or a new one.
    pub(super) fn get_or_make(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        if let Some(found) = self.find(&key) {
            return found;
        }
        // Without the lock, since other threads may need another key at the same time.
        let made = Arc::new(make());
        let mut results = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Another thread may have made it in the meantime.
        if let Some(found) = move_to_end(&mut results, &key) {
            return found;
        }
        if results.len() >= MOST {
            results.remove(0);
        }
        results.push((key, made.clone()));
        made
    }

    fn find(&self, key: &K) -> Option<Arc<V>> {
        move_to_end(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner), key)
    }
}

/// The result of a key, which becomes the latest.
fn move_to_end<K: PartialEq, V>(results: &mut Vec<(K, Arc<V>)>, key: &K) -> Option<Arc<V>> {
    let at = results.iter().position(|(other, _)| other == key)?;
    let found = results.remove(at);
    let value = found.1.clone();
    results.push(found);
    Some(value)
}
