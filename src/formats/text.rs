//! TOML with errors a person can act on: the line, the column and the nearest valid key.

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::error::FormatError;

/// Reads a TOML document into a type that refuses unknown keys.
///
/// # Errors
/// [`FormatError`] with `line L, column C`, and for an unknown key or value the nearest valid one.
///
/// ```
/// #[derive(serde::Deserialize, Debug)]
/// #[serde(deny_unknown_fields)]
/// struct Spot { diameter_m: f64 }
/// let refused = matdb::formats::text::from_toml::<Spot>("diametre_m = 0.016").unwrap_err();
/// assert!(refused.to_string().contains("did you mean `diameter_m`"), "{refused}");
/// ```
pub fn from_toml<T: DeserializeOwned>(text: &str) -> Result<T, FormatError> {
    toml::from_str(text).map_err(|error| {
        let place = match error.span() {
            Some(span) => line_and_column(text, span.start),
            None => "the file".to_owned(),
        };
        let (problem, way_out) = explain(error.message());
        FormatError::at(place, problem, way_out)
    })
}

/// Writes a record as TOML.
///
/// # Errors
/// When the record holds what TOML has no form for.
pub fn to_toml(record: &impl Serialize) -> Result<String, FormatError> {
    toml::to_string(record).map_err(|error| unwritable(&error))
}

/// Writes a record as TOML with the keys of `given`, the text it was once read from, and with those of
/// these names wherever they are: defaults that nobody wrote stay unwritten.
///
/// # Errors
/// When the record holds what TOML has no form for, or `given` is no TOML.
///
/// ```
/// #[derive(serde::Serialize)]
/// struct Spot { rays: u32, diameter_m: f64, name: String }
/// let spot = Spot { rays: 4, diameter_m: 0.016, name: "mine".to_owned() };
/// let written = matdb::formats::text::to_toml_as(&spot, "rays = 1", &["name"]).unwrap();
/// assert_eq!(written, "name = \"mine\"\nrays = 4\n");
/// ```
pub fn to_toml_as(
    record: &impl Serialize,
    given: &str,
    always: &[&str],
) -> Result<String, FormatError> {
    let mut table = Table::try_from(record).map_err(|error| unwritable(&error))?;
    keep_given(&mut table, &from_toml(given)?, always);
    to_toml(&table)
}

fn keep_given(table: &mut Table, given: &Table, always: &[&str]) {
    table.retain(|key, value| match (value, given.get(key)) {
        _ if always.contains(&key) => true,
        (Value::Table(inner), Some(Value::Table(given))) => {
            keep_given(inner, given, always);
            true
        }
        (Value::Array(list), Some(Value::Array(given))) => {
            for pair in std::iter::zip(list, given) {
                if let (Value::Table(inner), Value::Table(given)) = pair {
                    keep_given(inner, given, always);
                }
            }
            true
        }
        (_, Some(_)) => true,
        (Value::Table(inner), None) => {
            keep_given(inner, &Table::new(), always);
            !inner.is_empty()
        }
        (_, None) => false,
    });
}

fn unwritable(error: &toml::ser::Error) -> FormatError {
    FormatError::at("the record", format!("TOML cannot hold it: {error}"), "please report this")
}

/// The name nearest to `wanted`, when one is near enough to be a slip of the finger.
///
/// ```
/// use matdb::formats::text::nearest;
/// assert_eq!(nearest("aluminum", ["glass", "aluminium"]), Some("aluminium"));
/// assert_eq!(nearest("granite", ["glass", "aluminium"]), None);
/// ```
pub fn nearest<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Bounds the quadratic cost of the distance for names that no one could have meant.
    const LONGEST: usize = 100;
    if wanted.len() > LONGEST {
        return None;
    }
    names
        .into_iter()
        .filter(|name| name.len() <= LONGEST)
        .map(|name| (strsim::normalized_damerau_levenshtein(wanted, name), name))
        .filter(|(similarity, _)| *similarity >= 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

fn line_and_column(text: &str, byte: usize) -> String {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    format!("line {line}, column {column}")
}

/// Splits serde's message into what is wrong and what to do, which for a name is the nearest one.
fn explain(message: &str) -> (String, String) {
    let message = message.lines().next().unwrap_or("not valid TOML").to_owned();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let is_name = message.starts_with("unknown field") || message.starts_with("unknown variant");
    if let (true, Some(wanted)) = (is_name, quoted.next()) {
        let valid: Vec<&str> = quoted.collect();
        let problem = message.split(',').next().unwrap_or(&message).to_owned();
        let problem = problem.replace("unknown field", "unknown key");
        let problem = problem.replace("unknown variant", "unknown value");
        let way_out = match nearest(wanted, valid.iter().copied()) {
            Some(name) => format!("did you mean `{name}`?"),
            None if valid.is_empty() => "remove it".to_owned(),
            None => format!("valid here: {}", valid.join(", ")),
        };
        return (problem, way_out);
    }
    if message.starts_with("invalid type: map, expected a sequence") {
        let problem = "one table stands where a list of tables is expected".to_owned();
        return (problem, "write its name in double brackets, as in [[mesh]]".to_owned());
    }
    let in_words =
        [("usize", "a whole number, 0 or greater"), ("u64", "a whole number, 0 or greater")];
    let in_words = in_words.into_iter().chain([("f64", "a number"), ("i64", "a whole number")]);
    let message = in_words.fold(message, |text, (word, words)| {
        text.replace(&format!("expected {word}"), &format!("expected {words}"))
    });
    (message, "mend the line".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Deserialize, Debug)]
    #[serde(deny_unknown_fields, rename_all = "kebab-case")]
    #[allow(dead_code)]
    struct Sample {
        colour: Colour,
        count: u32,
    }

    #[derive(serde::Deserialize, Debug)]
    #[serde(rename_all = "kebab-case")]
    enum Colour {
        Red,
        Green,
    }

    fn message(text: &str) -> String {
        from_toml::<Sample>(text).unwrap_err().to_string()
    }

    #[test]
    fn the_place_and_the_nearest_name_are_given() {
        let text = message("colour = \"red\"\nccount = 3\n");
        assert!(text.starts_with("line 2, column 1: unknown key `ccount`"), "{text}");
        assert!(text.contains("did you mean `count`?"), "{text}");
        let text = message("colour = \"gren\"\ncount = 3\n");
        assert!(text.contains("unknown value `gren`; did you mean `green`?"), "{text}");
    }

    #[test]
    fn broken_syntax_has_a_place() {
        assert!(message("colour = \n").starts_with("line 1, column"));
        assert!(message("colour = \"red\"\ncount = \"x\"").starts_with("line 2, column 9"));
    }
}
