//! Numbers and names of a diagnosis, as a person reads them on the terminal and in the page.

use super::plots::Peak;
use crate::cli::effects::unit;
use crate::diagnose::{Found, Parameters, Report, Triple, Value, Verdict};
use crate::effects::{Level, find};

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
    }
}

/// The verdict as a heading over so many effects.
pub(super) fn heading(verdict: Verdict, effects: usize) -> &'static str {
    match (verdict, effects) {
        (Verdict::NoMissingEffect, _) => "Nothing is missing",
        (Verdict::Explained, 2..) => "The missing effects are found",
        (Verdict::Explained, _) => "The missing effect is found",
        (Verdict::Unexplained, _) => "Something unknown remains",
    }
}

/// The effects of a class beside the one that was added.
pub(super) fn others(class: &[&'static str], name: &str) -> Vec<&'static str> {
    class.iter().copied().filter(|other| *other != name).collect()
}

/// The verdict in a sentence.
pub(super) fn sentence(report: &Report) -> String {
    let names: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
    let (effects, with) = match names.len() {
        1 => ("effect", "with it"),
        _ => ("effects", "with them"),
    };
    let names = listed(&names);
    match (report.verdict, report.effects.is_empty()) {
        (Verdict::NoMissingEffect, _) => "The scene's model explains the cloud: no effect that was \
             tried predicts unseen parts of the scan better, and nothing that is tested for remains."
            .to_owned(),
        (Verdict::Explained, _) => format!(
            "The scene's model lacks the {effects} {names}: {with} the model predicts unseen parts \
             of the scan better, and nothing that is tested for remains."
        ),
        (Verdict::Unexplained, true) => {
            "The scene's model does not explain the cloud, and no effect that was tried does: what \
             remains is unknown."
                .to_owned()
        }
        (Verdict::Unexplained, false) => format!(
            "The scene's model lacks the {effects} {names}, which the data support, and something \
             else remains that no effect that was tried explains."
        ),
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A number with its deviation and its unit.
pub(super) fn value(value: &Value) -> String {
    let Value { value, sd, unit } = value;
    let number = match sd {
        Some(sd) => plus_minus(*value, *sd),
        None => format!("{} (deviation not told)", digits(*value)),
    };
    in_unit(number, unit)
}

/// Three numbers that belong together, with their deviations and their unit.
fn triple(triple: &Triple) -> String {
    let Triple { value, sd, unit } = triple;
    let number = |axis: usize| match sd {
        Some(sd) => plus_minus(value[axis], sd[axis]),
        None => digits(value[axis]),
    };
    in_unit(format!("({})", [0, 1, 2].map(number).join(", ")), unit)
}

/// The numbers of an effect by name, and where on the target it is.
pub(super) fn numbers(parameters: &Parameters) -> Vec<[String; 2]> {
    // Shift and turn of a pose are among the numbers already, axis by axis.
    let is_new = |name: &str| !parameters.contains_key(name.replacen('_', "_z_", 1).as_str());
    let numbers = parameters.iter().map(|(name, number)| [(*name).to_owned(), value(number)]);
    let triples = parameters.triples.iter().filter(|(name, _)| is_new(name));
    numbers.chain(triples.map(|(name, three)| [(*name).to_owned(), triple(three)])).collect()
}

/// What the numbers of an effect come to, where they are too many to be read.
pub(super) fn told(found: &Found) -> Option<String> {
    let effect = find(found.name)?;
    let values =
        effect.parameters().iter().map(|knob| Some(found.parameters.get(knob.name)?.value));
    effect.summary(&values.collect::<Option<Vec<f64>>>()?)
}

/// Where something unknown is strongest; nothing where there is no such place.
pub(super) fn strongest(places: &[Peak]) -> Option<String> {
    let place = |place: &Peak| {
        let Peak { x_m, y_m, db } = *place;
        format!("{} dB at x = {} m, y = {} m", signed(db, 1), fixed(x_m, 2), fixed(y_m, 2))
    };
    let places: Vec<String> = places.iter().map(place).collect();
    (!places.is_empty()).then(|| format!("strongest in the target plane: {}", places.join("; ")))
}

/// A number with its unit, of which a pure number has none.
pub(super) fn in_unit(number: String, code: &str) -> String {
    match code {
        "1" => number,
        code => format!("{number} {}", unit(code)),
    }
}

/// A number to two digits of its standard deviation.
pub(super) fn plus_minus(value: f64, sd: f64) -> String {
    if !(sd > 0.0 && sd.is_finite() && value.is_finite()) {
        return format!("{} ± {}", digits(value), digits(sd));
    }
    let decimals = (1.0 - sd.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{} ± {sd:.decimals$}", fixed(value, decimals))
}

/// A number with so many decimals and a true minus; 0 never has a sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = !text.contains(|c: char| c.is_ascii_digit() && c != '0') && value.is_finite();
    match text.strip_prefix('-') {
        Some(size) if is_zero => size.to_owned(),
        Some(size) => format!("−{size}"),
        None => text,
    }
}

/// A number with so many decimals and always a sign, unless it is 0.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    let is_zero = !text.contains(|c: char| c.is_ascii_digit() && c != '0');
    match is_zero || text.starts_with('−') {
        true => text,
        false => format!("+{text}"),
    }
}

/// Four significant digits.
pub(super) fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    crate::units::shown(rounded).replace('-', "−")
}

/// A probability; below what can be counted it is a bound.
pub(super) fn probability(p: f64) -> String {
    if p < 0.001 { "below 0.001".to_owned() } else { format!("{p:.3}") }
}

/// Where an effect belongs, in a sentence.
pub(super) fn belongs(level: Level) -> &'static str {
    match level {
        Level::Instrument => "It belongs to the instrument: the radar and its calibration.",
        Level::Material => "It belongs to the material, wherever that is used.",
        Level::Scene => "It belongs to the scene: what stands where.",
    }
}

/// What a covariate of the residual tests is, and what usually makes residuals go with it.
pub(super) fn covariate(name: &str) -> (String, &'static str) {
    if let Some(inner) = name.strip_prefix("spread over ") {
        let (inner, _) = covariate(inner);
        let hint = "The powers scatter more or less than declared there: speckle, noise or tilts.";
        return (format!("scatter over {inner}"), hint);
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
        "progress" => ("time", "Something changed while the scan ran."),
        "predicted power" => ("predicted power", "The receiver is not linear, or noise is added."),
        "region" => ("region", "A region has another material than declared."),
        "map" => ("place on the target", "Something stands at one place and not at others."),
        "bearing from centre" => {
            ("bearing from the middle of the target", "The beam or the antenna is lopsided.")
        }
        "range residual" => {
            ("measured less expected range", "What is strong or weak also lies elsewhere in range.")
        }
        "neighbourhood" => {
            ("what neighbours share", "Something small and rough on the target has another power.")
        }
        "outlying powers" => ("powers far from any law", "Silhouettes, or echoes of other things."),
        "outlying ranges" => ("ranges far off", "Silhouettes, echoes of other things, or detours."),
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
    fn numbers_have_two_digits_of_their_deviation() {
        assert_eq!(plus_minus(-3.0219, 0.1134), "−3.02 ± 0.11");
        assert_eq!(plus_minus(1234.56, 42.0), "1235 ± 42");
        assert_eq!(plus_minus(0.001234, 0.0000567), "0.001234 ± 0.000057");
        assert_eq!(plus_minus(-0.0001, 0.3), "0.00 ± 0.30");
        let shown = |sd, unit| value(&Value { value: 1.5, sd, unit });
        assert_eq!(shown(Some(0.25), "deg"), "1.50 ± 0.25 °");
        assert_eq!(shown(None, "1"), "1.5 (deviation not told)");
    }

    #[test]
    fn a_place_is_told_and_a_shift_is_told_once() {
        let number = Value { value: 0.25, sd: Some(0.01), unit: "m" };
        let three = |sd| Triple { value: [0.1, -1.25, 0.0], sd, unit: "m" };
        let mut parameters = Parameters::default();
        for name in ["centre_x_m", "centre_y_m", "translation_z_m"] {
            parameters.numbers.insert(name, number.clone());
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
    fn signs_are_true_and_zero_has_none() {
        assert_eq!(
            [-0.004, 0.004, 1.0, -1.0].map(|x| signed(x, 2)),
            ["0.00", "0.00", "+1.00", "−1.00"]
        );
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
    }

    #[test]
    fn unknown_covariates_keep_their_name() {
        assert_eq!(covariate("moon phase").0, "moon phase");
        assert_eq!(covariate("spread over theta").0, "scatter over angle of incidence");
        assert_eq!(covariate("spread").0, "scatter");
    }
}
