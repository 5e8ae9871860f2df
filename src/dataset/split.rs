//! The splits of a data set, and which options of its choices each of them has.

use std::collections::BTreeMap;

use super::spec::{Choice, Spec};
use super::streams::{Kind, stream};

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

    /// The names of the options that it has of the choices that are kept apart.
    pub fn apart(&self, spec: &Spec) -> BTreeMap<String, Vec<String>> {
        let choices = spec.choose.iter().zip(&self.options).filter(|(choice, _)| choice.apart);
        let names = choices.map(|(choice, places)| {
            let options = places.iter().map(|place| choice.option[*place].name.clone());
            (choice.name.clone(), options.collect())
        });
        names.collect()
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

/// Numbers of things by their shares: the largest remainders get one more.
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn spec(text: &str) -> Spec {
        let options = (0..7).map(|n| format!("{{ name = \"o{n}\", set = {{ name = \"{n}\" }} }}"));
        let options = options.collect::<Vec<_>>().join(", ");
        let text = format!(
            "name = \"s\"\nscene = \"s.toml\"\n{text}\n[[choose]]\nname = \"c\"\napart = true\noption = [{options}]\n"
        );
        Spec::parse(&text, Path::new("spec.toml")).unwrap()
    }

    #[test]
    fn every_scan_is_in_one_split_and_one_shard() {
        let spec =
            spec("scans = 106\nrepeats = 2\nscans_per_shard = 9\nsplit = { a = 3, b = 1, c = 1 }");
        let splits = Split::all(&spec);
        let scans: Vec<u32> = splits
            .iter()
            .flat_map(|split| {
                (split.first_shard..split.first_shard + split.shards)
                    .map(move |shard| (split, shard))
            })
            .flat_map(|(split, shard)| split.scans_of(&spec, shard))
            .collect();
        assert_eq!(scans, (0..106).collect::<Vec<_>>());
        assert!(splits.iter().all(|split| split.scans % 2 == 0 && split.first % 2 == 0));
        assert_eq!(splits.iter().map(|split| split.scans).collect::<Vec<_>>(), [64, 22, 20]);
        assert_eq!(splits[1].shard_name(splits[1].first_shard), "b-00000-of-00003");
    }

    #[test]
    fn splits_share_no_option_that_is_kept_apart() {
        for seed in 0..20 {
            let spec =
                spec(&format!("scans = 10\nseed = {seed}\nsplit = {{ a = 8, b = 1, c = 1 }}"));
            let splits = Split::all(&spec);
            let mut all: Vec<usize> =
                splits.iter().flat_map(|split| split.options[0].clone()).collect();
            assert!(splits.iter().all(|split| !split.options[0].is_empty()));
            all.sort_unstable();
            assert_eq!(all, (0..7).collect::<Vec<_>>(), "{seed}");
        }
    }

    #[test]
    fn an_option_is_in_the_split_that_it_names() {
        let mut spec = spec("scans = 10\nsplit = { a = 1, b = 1 }");
        spec.choose[0].option[3].split = Some("b".to_owned());
        let splits = Split::all(&spec);
        assert!(splits[1].options[0].contains(&3) && !splits[0].options[0].contains(&3));
    }
}
