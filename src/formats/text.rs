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
    let record = toml::from_str(text).map_err(|error| {
        let place = match error.span() {
            Some(span) => line_and_column(text, span.start),
            None => "the file".to_owned(),
        };
        let (problem, way_out) = explain(error.message());
        FormatError::at(place, problem, way_out)
    })?;
    match too_long::<T>(text) {
        Some(place) => Err(FormatError::at(place, "more entries than it takes", "remove the last")),
        None => Ok(record),
    }
}

/// A list that has more entries than are read, which the parser of texts drops without a word and that of values does not.
fn too_long<T: DeserializeOwned>(text: &str) -> Option<String> {
    let whole = Value::Table(toml::from_str(text).ok()?);
    let is_refused = |value: Value| {
        value
            .try_into::<T>()
            .is_err_and(|error| error.to_string().contains("fewer elements in array"))
    };
    if !is_refused(whole.clone()) {
        return None;
    }
    let is_it = |path: &Vec<String>| {
        let mut shorter = whole.clone();
        let list = path.iter().try_fold(&mut shorter, |value, step| match value {
            Value::Array(list) => list.get_mut(step.parse::<usize>().ok()?),
            value => value.get_mut(step),
        });
        list.and_then(Value::as_array_mut).and_then(Vec::pop).is_some() && !is_refused(shorter)
    };
    let mut paths = Vec::new();
    lists(&whole, &mut Vec::new(), &mut paths);
    // The innermost: a list of which that one is a part would be right without it, too.
    let found = paths.iter().rev().find(|path| is_it(path));
    Some(found.map_or("a list".to_owned(), |path| format!("`{}`", path.join("."))))
}

/// Appends the paths of all lists in a value.
fn lists(value: &Value, path: &mut Vec<String>, all: &mut Vec<Vec<String>>) {
    let inner: Vec<(String, &Value)> = match value {
        Value::Array(list) => {
            all.push(path.clone());
            list.iter().enumerate().map(|(place, inner)| (place.to_string(), inner)).collect()
        }
        Value::Table(table) => table.iter().map(|(key, inner)| (key.clone(), inner)).collect(),
        _ => Vec::new(),
    };
    for (step, inner) in inner {
        path.push(step);
        lists(inner, path, all);
        path.pop();
    }
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
    fn a_list_that_is_too_long_is_refused_by_its_name() {
        #[derive(serde::Deserialize, Debug)]
        #[allow(dead_code)]
        struct Sizes {
            size: Vec<Size>,
        }
        #[derive(serde::Deserialize, Debug)]
        #[allow(dead_code)]
        struct Size {
            size_m: [f64; 3],
            others: Vec<f64>,
        }
        let first = "[[size]]\nsize_m = [1, 2, 3]\nothers = [1, 2, 3, 4, 5]\n";
        let text = |last: &str| format!("{first}[[size]]\nsize_m = [1, 2, 3{last}]\nothers = []\n");
        assert!(from_toml::<Sizes>(&text("")).is_ok());
        let said = from_toml::<Sizes>(&text(", 4")).unwrap_err().to_string();
        assert_eq!(said, "`size.1.size_m`: more entries than it takes; remove the last");
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
