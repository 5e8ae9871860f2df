//! The splits of a data set, and which options of its choices each of them has.

use super::draw::{Kind, stream};
use super::spec::{Choice, Spec};

/// A part of the scans that shares no option of the choices that are kept apart with another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Split {
    /// Its name.
    pub name: String,
    /// Number of its first scan among all.
    pub first: u32,
    /// Number of its scans.
    pub scans: u32,
    /// Number of its first shard among all.
    pub first_shard: u32,
    /// Number of its shards.
    pub shards: u32,
    /// For every choice the places of the options that it has.
    pub options: Vec<Vec<usize>>,
}

impl Split {
    /// All splits of a data set, in the order of their names. Scans of one target are in one shard.
    pub fn all(spec: &Spec) -> Vec<Split> {
        let splits = spec.splits();
        let targets = spec.scans / spec.repeats;
        let of_split = shared(targets, &splits.iter().map(|(_, share)| *share).collect::<Vec<_>>());
        let of_choices: Vec<Vec<Vec<usize>>> = spec
            .choose
            .iter()
            .enumerate()
            .map(|(entry, choice)| options(spec, &splits, entry, choice))
            .collect();
        let (mut first, mut first_shard) = (0, 0);
        let mut all = Vec::new();
        for (place, (name, _)) in splits.iter().enumerate() {
            let scans = of_split[place] * spec.repeats;
            let shards = scans.div_ceil(per_shard(spec));
            let options = of_choices.iter().map(|of_splits| of_splits[place].clone()).collect();
            all.push(Split {
                name: (*name).to_owned(),
                first,
                scans,
                first_shard,
                shards,
                options,
            });
            (first, first_shard) = (first + scans, first_shard + shards);
        }
        all
    }

    /// The scans of one of its shards, by their numbers among all.
    pub fn scans_of(&self, spec: &Spec, shard: u32) -> std::ops::Range<u32> {
        let from = self.first + (shard - self.first_shard) * per_shard(spec);
        from..(from + per_shard(spec)).min(self.first + self.scans)
    }

    /// Name of a shard: `train-00000-of-00004`.
    pub fn shard_name(&self, shard: u32) -> String {
        format!("{}-{:05}-of-{:05}", self.name, shard - self.first_shard, self.shards)
    }
}

/// Scans of a shard: those of whole targets.
fn per_shard(spec: &Spec) -> u32 {
    (spec.scans_per_shard / spec.repeats).max(1) * spec.repeats
}

/// So many things by their shares: the largest remainders get one more.
fn shared(all: u32, shares: &[f64]) -> Vec<u32> {
    let exact: Vec<f64> = shares.iter().map(|share| share * f64::from(all)).collect();
    let mut counts: Vec<u32> = exact.iter().map(|exact| exact.floor() as u32).collect();
    let mut by_rest: Vec<usize> = (0..shares.len()).collect();
    by_rest.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()));
    let left = all.saturating_sub(counts.iter().sum());
    by_rest.iter().cycle().take(left as usize).for_each(|&place| counts[place] += 1);
    counts
}

/// For every split the places of the options of a choice that it has: all, or some that no other split has.
fn options(spec: &Spec, splits: &[(&str, f64)], entry: usize, choice: &Choice) -> Vec<Vec<usize>> {
    let all = 0..choice.option.len();
    if !choice.apart || splits.len() == 1 {
        return splits.iter().map(|_| all.clone().collect()).collect();
    }
    let mut of_splits = vec![Vec::new(); splits.len()];
    let mut free = Vec::new();
    for place in all {
        let given = choice.option[place].split.as_deref();
        match splits.iter().position(|(name, _)| Some(*name) == given) {
            Some(split) => of_splits[split].push(place),
            None => free.push(place),
        }
    }
    // The rest in an order of the seed, first one for each split without any.
    let key = |place: &usize| stream(spec.seed, *place as u64, Kind::Split, entry).uniform();
    free.sort_by(|a, b| key(a).total_cmp(&key(b)));
    for split in &mut of_splits {
        if split.is_empty() {
            split.extend(free.pop());
        }
    }
    let counts =
        shared(free.len() as u32, &splits.iter().map(|(_, share)| *share).collect::<Vec<_>>());
    for (split, count) in of_splits.iter_mut().zip(counts) {
        split.extend(free.drain(..(count as usize).min(free.len())));
        split.sort_unstable();
    }
    of_splits
}
