//! What a diagnosis found in words, for the terminal and for the page.

use crate::diagnose::{
    Contradiction, FoundEffect, MAY_BE, Parameters, Report, Triple, Value, Verdict,
};
use crate::effects::{Level, find};
use crate::formats::words::{digits, in_unit, listed, plus_minus};

/// How much of the error above the noise floor is gone. The floor is an estimate: what ends below it has nothing left
/// to explain, and what ends as far above it as it began has lost none.
pub(super) fn gone(share: f64) -> String {
    match share {
        1.0.. => "all".to_owned(),
        0.005.. => format!("{:.0} %", 100.0 * share),
        _ => "none".to_owned(),
    }
}

/// The verdict in a word or two.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoMissingEffect => "nothing is missing",
        Verdict::Explained => "explained",
        Verdict::Unexplained => "unexplained",
        Verdict::Contradictory => "the clouds contradict each other",
    }
}

/// The verdict as a heading; `effects` is the number of effects that were found.
pub(super) fn heading(verdict: Verdict, effects: usize) -> &'static str {
    match (verdict, effects) {
        (Verdict::NoMissingEffect, _) => "Nothing is missing",
        (Verdict::Explained, 2..) => "The missing effects are found",
        (Verdict::Explained, _) => "The missing effect is found",
        (Verdict::Unexplained, _) => "Something unknown remains",
        (Verdict::Contradictory, _) => "The clouds contradict each other",
    }
}

/// The effects of a class other than the one that was added.
pub(super) fn others(class: &[&'static str], name: &str) -> Vec<&'static str> {
    class.iter().copied().filter(|other| *other != name).collect()
}

/// The verdict in a sentence.
pub(super) fn sentence(report: &Report) -> String {
    let names: Vec<String> =
        report.effects.iter().map(|found| named(found.name, &found.scans, report)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (effects, with) = match names.len() {
        1 => ("effect", "with it"),
        _ => ("effects", "with them"),
    };
    let names = listed(&names);
    if let Some(first) = report.contradictions.first() {
        return contradiction(first, report);
    }
    match (report.verdict, report.effects.is_empty()) {
        (Verdict::NoMissingEffect, _) => "The scene's model explains the cloud: no effect that was \
             tried predicts unseen parts of the scan better, and nothing that is tested for remains."
            .to_owned(),
        (Verdict::Explained, _) => format!(
            "The scene's model lacks the {effects} {names}: {with} the model predicts unseen parts \
             of the scan better, and nothing that is tested for remains."
        ),
        (Verdict::Unexplained | Verdict::Contradictory, true) => {
            "The scene's model does not explain the cloud, and no effect that was tried does: what \
             remains is unknown."
                .to_owned()
        }
        (Verdict::Unexplained | Verdict::Contradictory, false) => format!(
            "The scene's model lacks the {effects} {names}, which the data support, and something \
             else remains that no effect that was tried explains."
        ),
    }
}

/// Why several clouds have no one answer, and the way out.
fn contradiction(one: &Contradiction, report: &Report) -> String {
    let Contradiction { cloud, effect, gain, se, size_db } = *one;
    let name = report.clouds.get(cloud.saturating_sub(1)).map_or("a cloud", |part| &part.name);
    let gain = plus_minus(gain, se);
    match effect {
        None => format!(
            "The laws that fit all clouds do not fit {name}: laws of its own differ by {size_db:.2} dB and change ln p of \
             its held-out patches by {gain}; check that its material, its radar and its pose are those of the other \
             clouds, or diagnose it alone."
        ),
        Some(effect) => format!(
            "The clouds together support {effect}, and {name} excludes it: there ln p of held-out patches changes by \
             {gain}; check what differs in that scan, or diagnose each cloud alone."
        ),
    }
}

/// The name of an effect, with the clouds on which it acts where these are not all.
pub(super) fn named(name: &str, scans: &[u16], report: &Report) -> String {
    let clouds = scans.iter().filter_map(|scan| report.clouds.get(usize::from(*scan)));
    let clouds: Vec<&str> = clouds.map(|part| part.name.as_str()).collect();
    if clouds.is_empty() { name.to_owned() } else { format!("{name} in {}", listed(&clouds)) }
}

/// A number with its standard deviation and its unit.
pub(super) fn value(value: &Value) -> String {
    let Value { value, sd, unit } = value;
    let number = match sd {
        Some(sd) => plus_minus(*value, *sd),
        None => format!("{} (standard deviation unknown)", digits(*value)),
    };
    in_unit(number, unit)
}

/// The numbers along x, y and z with their standard deviations and their unit.
fn triple(triple: &Triple) -> String {
    let Triple { value, sd, unit } = triple;
    let mut numbers = Vec::new();
    for axis in 0..3 {
        numbers.push(match sd {
            Some(sd) => plus_minus(value[axis], sd[axis]),
            None => digits(value[axis]),
        });
    }
    in_unit(format!("({})", numbers.join(", ")), unit)
}

/// The numbers of an effect by name, then its vectors, such as its place on the target.
pub(super) fn numbers(parameters: &Parameters) -> Vec<[String; 2]> {
    let mut numbers = Vec::new();
    for (name, number) in parameters.iter() {
        numbers.push([(*name).to_owned(), value(number)]);
    }
    for (name, vector) in &parameters.triples {
        // Shift and turn of a pose are among the numbers already, axis by axis.
        if !parameters.contains_key(name.replacen('_', "_z_", 1).as_str()) {
            numbers.push([(*name).to_owned(), triple(vector)]);
        }
    }
    numbers
}

/// What the values of an effect mean together, where they are too many to be read one by one.
pub(super) fn summary(found: &FoundEffect) -> Option<String> {
    let effect = find(found.name)?;
    let mut values = Vec::new();
    for parameter in effect.parameters() {
        let number = found.parameters.get(parameter.name);
        values.push(number.map_or(parameter.absent, |number| number.value));
    }
    effect.summary(&values)
}

/// Where an effect belongs, in a sentence.
pub(super) fn belongs(level: Level) -> &'static str {
    match level {
        Level::Instrument => "It belongs to the instrument: the radar and its calibration.",
        Level::Material => "It belongs to the material, wherever that is used.",
        Level::Scene => "It belongs to the scene: what stands where.",
    }
}

/// What a covariate of the residual tests is, and what residuals that depend on it often mean.
pub(super) fn covariate(name: &str) -> (String, &'static str) {
    if let Some(inner) = name.strip_prefix("spread over ") {
        let (inner, _) = covariate(inner);
        let hint = "The powers scatter more or less than declared there: speckle, noise or tilts.";
        return (format!("scatter over {inner}"), hint);
    }
    if let Some(effect) = name.strip_prefix(MAY_BE) {
        let hint = "Beside the strongest effect it may be real, or make up for an error of that one's form.";
        return (format!("what may be {effect}"), hint);
    }
    let (words, hint) = match name {
        "spread" => {
            ("scatter", "All powers scatter more or less than declared: speckle, or its law.")
        }
        "theta" => ("angle of incidence", "The law of scattering has another shape."),
        "azimuth" => ("azimuth of the radar about the normal", "The surface has a direction."),
        "range" => ("range", "The power balance or the range calibration is off."),
        "x_t" => ("x in the target plane", "Something changes across the field of view."),
        "y_t" => ("y in the target plane", "Something changes along the field of view."),
        "distance from centre" => {
            ("distance from the middle of the target", "The gain changes in rings.")
        }
        "distance from edge" => ("distance from the nearest edge", "The beam has a width."),
        "order of the chirps" => {
            ("the order of the chirps", "Something swings while the scan runs.")
        }
        "progress" => ("time", "Something changed while the scan ran."),
        "predicted power" => ("predicted power", "The receiver is not linear, or noise is added."),
        "region" => ("region", "A region has another material than declared."),
        "cloud" => {
            ("the cloud", "The clouds differ in their level or in something that no effect has.")
        }
        "map" => ("place on the target", "Something stands at one place and not at others."),
        "bearing from centre" => {
            ("bearing from the middle of the target", "The beam or the antenna is lopsided.")
        }
        "range residual" => {
            ("measured less expected range", "What is strong or weak also lies elsewhere in range.")
        }
        "waves over the target" => (
            "waves over the target",
            "Something repeats over the surface, such as stripes or checkers.",
        ),
        "neighbourhood" => {
            ("what neighbours share", "Something small and rough on the target has another power.")
        }
        "outlying powers" => ("powers far from any law", "Silhouettes, or echoes of other things."),
        "outlying ranges" => ("ranges far off", "Silhouettes, echoes of other things, or detours."),
        "false alarms" => (
            "detections beside the target",
            "The receiver's noise is another one than declared, or something else is in its gate.",
        ),
        "detections beside an edge" => (
            "detections beside an edge",
            "The beam is wider than the ray that stands for it: give the scene several, `spot.rays`.",
        ),
        "stray detections" => ("detections off the target", "False alarms, or a mesh that is cut."),
        "form of the scatter" => {
            ("form of the scatter", "The fluctuation follows another law than speckle.")
        }
        "steps of the power" => ("powers in steps", "The receiver or the file rounds them."),
        other => return (other.to_owned(), ""),
    };
    (words.to_owned(), hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_its_deviation_and_its_unit() {
        let shown = |sd, unit| value(&Value { value: 1.5, sd, unit });
        assert_eq!(shown(Some(0.25), "deg"), "1.50 ± 0.25 °");
        assert_eq!(shown(None, "1"), "1.5 (standard deviation unknown)");
    }

    #[test]
    fn a_place_is_told_and_a_shift_is_told_once() {
        let number = Value { value: 0.25, sd: Some(0.01), unit: "m" };
        let three = |sd| Triple { value: [0.1, -1.25, 0.0], sd, unit: "m" };
        let mut parameters = Parameters::default();
        for name in ["centre_x_m", "centre_y_m", "translation_z_m"] {
            parameters.numbers.insert(name, number);
        }
        parameters.triples.insert("centre_m", three(None));
        parameters.triples.insert("translation_m", three(Some([0.01; 3])));
        let told = numbers(&parameters);
        let names: Vec<&str> = told.iter().map(|[name, _]| name.as_str()).collect();
        assert_eq!(names, ["centre_x_m", "centre_y_m", "translation_z_m", "centre_m"]);
        assert_eq!(told[3][1], "(0.1, −1.25, 0) m");
        assert_eq!(
            triple(&three(Some([0.01; 3]))),
            "(0.100 ± 0.010, −1.250 ± 0.010, 0.000 ± 0.010) m"
        );
    }

    #[test]
    fn unknown_covariates_keep_their_name() {
        assert_eq!(covariate("moon phase").0, "moon phase");
        assert_eq!(covariate("spread over theta").0, "scatter over angle of incidence");
        assert_eq!(covariate("spread").0, "scatter");
    }
}
