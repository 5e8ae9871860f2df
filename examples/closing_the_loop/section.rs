//! The tables of one set of cases.

use std::collections::{BTreeMap, BTreeSet};

use matdb::diagnose::Diagnosis;
use matdb::effects::library;

use super::label::{Expected, Strength};
use super::numbers::{Share, Sorted, fixed_or_dash, runs};
use super::page::{Set, listing, table};
use super::reason::reason;
use super::report::{NO_ANSWER, NONE, Run};
use super::score::{Case, Scale, confusion, deviations, expecting, mean, pairs, share, singles};

/// The section of a set.
pub fn section(set: &Set) -> String {
    let cases = &set.cases;
    let parts = [
        ("What the cases are", about(set)),
        ("One effect", by_strength(cases)),
        ("What each effect was called", confusions(cases)),
        ("Counted as right", alike(cases)),
        ("Two effects", of_pairs(cases)),
        ("Nothing missing", complete(cases)),
        ("Effects that no library has", unknown(cases)),
        ("Error", errors(cases)),
        ("Numbers of the effects", parameters(cases)),
        ("Time", time(cases)),
        ("Every miss", misses(cases)),
    ];
    let parts = parts.iter().filter(|(_, text)| !text.is_empty());
    let parts: String = parts.map(|(title, text)| format!("\n### {title}\n\n{text}")).collect();
    format!("\n## {}\n{parts}", set.title)
}

fn about(set: &Set) -> String {
    let Set { made_by, cases, unmatched: [unlabelled, without_case], .. } = set;
    let made_by = match made_by {
        Some(command) => format!("Made by\n\n```sh\n{command}\n```\n\n"),
        None => "It is not stated how they were made. ".into(),
    };
    let seeds: BTreeSet<u64> = cases.iter().map(|case| case.label.seed).collect();
    let mut text = format!("{made_by}{} cases of the seeds {}.", cases.len(), runs(&seeds));
    let mut geometries = BTreeMap::<&str, usize>::new();
    for case in cases {
        *geometries.entry(&case.label.geometry).or_default() += 1;
    }
    let listed: Vec<String> =
        geometries.iter().map(|(name, count)| format!("{name} {count}")).collect();
    text += &format!(" Geometries: {}.", listed.join(", "));
    let less = cases.iter().filter(|case| case.label.wanted.is_some()).count();
    if less > 0 {
        text += &format!(" {less} effects got less strong than wanted and count as what they are.");
    }
    if unlabelled + without_case > 0 {
        text += &format!(
            " Left out: {unlabelled} cases without a label, {without_case} labels without a case."
        );
    }
    text + "\n"
}

fn by_strength(cases: &[Case]) -> String {
    let head = [
        "strength",
        "right name first",
        "right name first, or in the class of the first",
        "exactly the right name",
        "verdict `explained`",
        "extra names per case",
        "all wrong names per case",
        "no answer",
    ];
    if Strength::ALL.iter().all(|&strength| singles(cases, strength).is_empty()) {
        return String::new();
    }
    let row = |strength: Strength| {
        let cases = singles(cases, strength);
        vec![
            strength.name().to_owned(),
            share(&cases, Case::named_first).cell(),
            share(&cases, Case::first_or_class).cell(),
            share(&cases, Case::exact).cell(),
            share(&cases, |case| case.run.verdict() == "explained").cell(),
            fixed_or_dash(mean(&cases, Case::extra), 2),
            fixed_or_dash(mean(&cases, Case::wrong), 2),
            share(&cases, |case| case.run.first() == NO_ANSWER).count.to_string(),
        ]
    };
    table(&head, Strength::ALL.map(row))
}

/// What each effect was called, by strength: the first name of the report and how often.
fn confusions(cases: &[Case]) -> String {
    let counts = Strength::ALL.map(|strength| confusion(&singles(cases, strength)));
    if counts.iter().all(BTreeMap::is_empty) {
        return String::new();
    }
    let mut head = vec!["true effect"];
    head.extend(Strength::ALL.map(Strength::name));
    let rows = library().map(|effect| {
        let mut cells = vec![effect.name().to_owned()];
        cells.extend(counts.iter().map(|counts| names_of(effect.name(), counts)));
        cells
    });
    format!(
        "First name of the report and number of cases; the right name is bold.\n\n{}",
        listing(&head, rows)
    )
}

/// First names that cases of one effect got, with their numbers, the right one first.
fn names_of(truth: &str, counts: &BTreeMap<(String, String), usize>) -> String {
    let others = library().map(|effect| effect.name()).into_iter().chain([NONE, NO_ANSWER]);
    let names = std::iter::once(truth).chain(others.filter(|name| *name != truth));
    let mut cell = Vec::new();
    for name in names {
        match counts.get(&(truth.to_owned(), name.to_owned())) {
            Some(count) if name == truth => cell.push(format!("**{count}**")),
            Some(count) => cell.push(format!("{name} {count}")),
            None => {}
        }
    }
    if cell.is_empty() { "·".to_owned() } else { cell.join(", ") }
}

/// Cases of which no data of this kind could tell the right name.
fn alike(cases: &[Case]) -> String {
    let row = |case: &Case| {
        let why = case.alike()?;
        let mut cells = miss(case);
        cells.pop();
        Some((cells, why))
    };
    let (rows, whys): (Vec<_>, BTreeSet<&str>) = cases.iter().filter_map(row).unzip();
    if rows.is_empty() {
        return String::new();
    }
    let why: Vec<&str> = whys.into_iter().collect();
    format!(
        "In these cases the first name is another effect. The right one is named as predicting the data as well, the two \
         gains in ln likelihood differ by at most {}, and there is a reason: {}.\n\n{}",
        Diagnosis::default().least_gain,
        why.join("; "),
        listing(&MISS[..MISS.len() - 1], rows)
    )
}

/// Cases by what was put in.
fn groups<'a>(cases: &[&'a Case]) -> BTreeMap<String, Vec<&'a Case>> {
    let mut groups = BTreeMap::<String, Vec<&Case>>::new();
    cases.iter().for_each(|case| groups.entry(put_in(case)).or_default().push(case));
    groups
}

fn of_pairs(cases: &[Case]) -> String {
    let pairs = pairs(cases);
    if pairs.is_empty() {
        return String::new();
    }
    let head =
        ["pair", "cases", "both named", "one named", "both named or in a class", "wrong names"];
    let row = |name: String, cases: &[&Case]| {
        vec![
            name,
            cases.len().to_string(),
            share(cases, Case::all_found).cell(),
            share(cases, |case| case.found() == 1).cell(),
            share(cases, Case::all_found_or_in_class).cell(),
            cases.iter().map(|case| case.wrong()).sum::<usize>().to_string(),
        ]
    };
    let all = row("all".into(), &pairs);
    let by_pair = groups(&pairs);
    let rows = by_pair.into_iter().map(|(name, cases)| row(name, &cases)).chain([all]);
    format!("In any order.\n\n{}", table(&head, rows))
}

fn complete(cases: &[Case]) -> String {
    let cases = expecting(cases, Expected::Complete);
    let alarms = share(&cases, Case::alarm);
    let Some(upper) = alarms.upper_95() else { return String::new() };
    let named = share(&cases, |case| !case.run.found().is_empty());
    let unexplained =
        share(&cases, |case| case.run.found().is_empty() && case.run.verdict() == "unexplained");
    let silent = share(&cases, |case| case.run.first() == NO_ANSWER);
    format!(
        "False alarms: {}. With 95 % confidence the true share is below {:.1} % (Clopper and Pearson). In {} an effect was \
         named, in {} only the verdict was `unexplained`, in {} there was no answer.\n",
        alarms.cell(),
        100.0 * upper,
        named.count,
        unexplained.count,
        silent.count,
    )
}

fn unknown(cases: &[Case]) -> String {
    let cases = expecting(cases, Expected::Unknown);
    if cases.is_empty() {
        return String::new();
    }
    let mut head = vec!["put in".to_owned()];
    for strength in Strength::ALL {
        head.push(format!("{}: unexplained", strength.name()));
        head.push("named".into());
    }
    head.extend(["all: unexplained".to_owned(), "all: named".to_owned()]);
    let row = |name: String, cases: &[&Case]| {
        let mut cells = vec![name];
        let mut add = |those: &[&Case], all: bool| {
            let called = share(those, |case| case.run.verdict() == "unexplained");
            let named = share(those, |case| !case.run.found().is_empty());
            let short = |share: Share| match share.of {
                0 => "–".into(),
                of => format!("{} of {of}", share.count),
            };
            cells.extend([called, named].map(|s| if all { s.cell() } else { short(s) }));
        };
        for strength in Strength::ALL {
            let those: Vec<&Case> =
                cases.iter().copied().filter(|c| c.label.strength == Some(strength)).collect();
            add(&those, false);
        }
        add(cases, true);
        cells
    };
    let all = row("all".into(), &cases);
    let by_name = groups(&cases);
    let rows = by_name.into_iter().map(|(name, cases)| row(name, &cases)).chain([all]);
    format!(
        "“Named” counts cases that got a name, whatever their verdict.\n\n{}",
        table(&head, rows)
    )
}

fn errors(cases: &[Case]) -> String {
    let head = [
        "cases",
        "number",
        "before, dB",
        "after, dB",
        "floor, dB",
        "after/floor, median",
        "90th percentile",
        "worst",
        "after worse than before",
        "explained share",
        "within 90 % interval after",
    ];
    let row = |name: &str, cases: &[&Case]| {
        let errors: Vec<_> = cases.iter().filter_map(|case| case.run.error()).collect();
        let median = |of: &dyn Fn(&super::report::BeforeAfter) -> Option<f64>| {
            Sorted::new(errors.iter().filter_map(|error| of(error))).median()
        };
        let after = Sorted::new(cases.iter().filter_map(|case| case.after_to_floor()));
        let worse = cases.iter().filter(|case| case.is_worse());
        let percent = |share: Option<f64>| match share {
            Some(share) => format!("{:.1} %", 100.0 * share),
            None => "–".into(),
        };
        vec![
            name.to_owned(),
            errors.len().to_string(),
            fixed_or_dash(median(&|error| Some(error.before.rmse_db)), 3),
            fixed_or_dash(median(&|error| Some(error.after.rmse_db)), 3),
            fixed_or_dash(median(&|error| Some(error.noise_floor_db)), 3),
            fixed_or_dash(after.median(), 3),
            fixed_or_dash(after.quantile(0.9), 3),
            fixed_or_dash(after.worst(), 3),
            worse.count().to_string(),
            percent(median(&|error| error.explained_share)),
            percent(median(&|error| error.after.coverage_90)),
        ]
    };
    let mut rows: Vec<Vec<String>> =
        Strength::ALL.map(|strength| row(strength.name(), &singles(cases, strength))).to_vec();
    rows.push(row("two effects", &pairs(cases)));
    rows.push(row("all with known effects", &expecting(cases, Expected::Named)));
    rows.push(row("nothing missing", &expecting(cases, Expected::Complete)));
    rows.push(row("unknown effects", &expecting(cases, Expected::Unknown)));
    rows.retain(|row| row[1] != "0");
    format!("Columns are medians over cases unless they say otherwise.\n\n{}", table(&head, rows))
}

fn parameters(cases: &[Case]) -> String {
    let deviations = deviations(cases);
    if deviations.is_empty() {
        return String::new();
    }
    let head = [
        "number",
        "cases",
        "off, median",
        "worst",
        "with an sd",
        "off in stated sd, median",
        "worst",
    ];
    let rows = deviations.iter().map(|one| {
        let unit = if one.scale == Scale::Level { "dB" } else { "%" };
        let off = |value: Option<f64>| format!("{} {unit}", fixed_or_dash(value, 1));
        vec![
            format!("{} `{}`", one.effect, one.parameter),
            one.off.count().to_string(),
            off(one.off.median()),
            off(one.off.worst()),
            one.in_sd.count().to_string(),
            fixed_or_dash(one.in_sd.median(), 1),
            fixed_or_dash(one.in_sd.worst(), 1),
        ]
    });
    format!(
        "Cases in which the right effect was named, alone or not, and parameters that mean the same in label and report. \
         Errors of levels are in dB, others in per cent of the truth. A stated sd covers noise, and what the model leaves from place to place; the truth can have \
         another form than the program's effect, which adds an error.\n\n{}",
        table(&head, rows)
    )
}

fn time(cases: &[Case]) -> String {
    let answered = cases.iter().filter(|case| case.run.report.is_ok());
    let seconds = Sorted::new(answered.map(|case| case.run.seconds));
    let jobs: BTreeSet<u64> = cases.iter().map(|case| case.run.jobs as u64).collect();
    let threads = match jobs.last() {
        Some(&most) if most > 1 => ", each on one thread",
        _ => "",
    };
    format!(
        "`add` and `diagnose` together: median {} s, worst {} s; {} ran at a time{threads}.\n",
        fixed_or_dash(seconds.median(), 1),
        fixed_or_dash(seconds.worst(), 1),
        runs(&jobs),
    )
}

fn misses(cases: &[Case]) -> String {
    let mut missed: Vec<&Case> = cases.iter().filter(|case| case.missed()).collect();
    if missed.is_empty() {
        return "There is none.\n".into();
    }
    missed.sort_by_key(|case| (put_in(case), case.label.strength, case.label.seed));
    listing(&MISS, missed.into_iter().map(miss))
}

/// What is told of a case that was missed.
const MISS: [&str; 10] = [
    "put in",
    "strength",
    "rms, dB",
    "seed",
    "geometry",
    "case",
    "said",
    "gain of the right one",
    "gain of the wrong one",
    "reason",
];

fn miss(case: &Case) -> Vec<String> {
    let Case { label, run } = case;
    let right = label.names().into_iter().map(|name| gain(run, name));
    let right = match label.expected {
        Expected::Named => right.collect::<Vec<_>>().join(" + "),
        _ => "–".into(),
    };
    let wrong = run.found().iter().find(|found| !label.has(&found.name));
    let named = wrong.map_or("–".into(), |found| gain(run, &found.name));
    vec![
        put_in(case),
        label.strength.map_or("–", Strength::name).to_owned(),
        fixed_or_dash(label.rms_db, 2),
        label.seed.to_string(),
        label.geometry.clone(),
        label.case.clone(),
        run.said(),
        right,
        named,
        reason(label, run),
    ]
}

fn gain(run: &Run, name: &str) -> String {
    let Some(tried) = run.tried(1, name) else { return "–".into() };
    let about = if tried.sampled { "≈ " } else { "" };
    tried.gain.map_or("–".into(), |gain| format!("{about}{gain:.0}"))
}

fn put_in(case: &Case) -> String {
    if case.label.effects.is_empty() { "nothing".into() } else { case.label.names().join(" + ") }
}
