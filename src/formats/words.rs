//! Numbers and lists as people read them: rounded, with a true minus, with thousands apart.

use crate::units::shown;

/// A number with this many significant digits and an ASCII minus, as it can be typed again.
///
/// ```
/// use matdb::formats::words::significant;
/// assert_eq!([0.0160406, 3.0e11, -2.0].map(|x| significant(x, 4)), ["0.01604", "3e11", "-2"]);
/// ```
pub fn significant(value: f64, digits: usize) -> String {
    shown(round_significant(value, digits))
}

/// The number that [`significant`] writes.
pub fn round_significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

/// A number with four significant digits and a true minus.
///
/// ```
/// assert_eq!(matdb::formats::words::digits(-0.016040620), "−0.01604");
/// ```
pub fn digits(value: f64) -> String {
    true_minus(&significant(value, 4))
}

/// A number that somebody stated, in the digits in which it was typed, with a true minus. A change of unit leaves nothing of
/// itself in ten digits.
///
/// ```
/// assert_eq!(matdb::formats::words::as_typed(2.4945), "2.4945");
/// assert_eq!(matdb::formats::words::as_typed(0.00052 * 1e3), "0.52");
/// ```
pub fn as_typed(value: f64) -> String {
    true_minus(&significant(value, 10))
}

/// Text whose hyphens are minus signs.
pub fn true_minus(number: &str) -> String {
    number.replace('-', "−")
}

/// A number with this many decimals and a true minus; zero has no sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if is_zero(size) => size.to_owned(),
        Some(size) => format!("−{size}"),
        None => text,
    }
}

/// A number with this many decimals and always a sign, unless it is zero.
pub fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    let has_plus = value.is_finite() && !is_zero(&text) && !text.starts_with('−');
    if has_plus { format!("+{text}") } else { text }
}

/// Whether a written number has only zeros; `NaN` and `inf` have no digit and are not zero.
fn is_zero(number: &str) -> bool {
    number.contains('0') && !number.contains(|c: char| matches!(c, '1'..='9'))
}

/// A number ± its standard deviation, both to two digits of the latter.
///
/// ```
/// assert_eq!(matdb::formats::words::plus_minus(-3.0219, 0.1134), "−3.02 ± 0.11");
/// ```
pub fn plus_minus(value: f64, sd: f64) -> String {
    if !(sd > 0.0 && sd.is_finite() && value.is_finite()) {
        return format!("{} ± {}", digits(value), digits(sd));
    }
    let decimals = (1.0 - sd.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{} ± {sd:.decimals$}", fixed(value, decimals))
}

/// Decibels to a tenth; `nothing` for the level of no power.
pub fn decibels(level_db: f64) -> String {
    if level_db.is_finite() { fixed(level_db, 1) } else { "nothing".to_owned() }
}

/// A share in percent; `none` and `all` at the ends.
pub fn percent(part: usize, whole: usize) -> String {
    match part {
        0 => "none".to_owned(),
        part if part == whole => "all".to_owned(),
        part => format!("{:.1} %", 100.0 * part as f64 / whole as f64),
    }
}

/// A probability; one that is too small to be counted is given as a bound.
pub fn probability(p: f64) -> String {
    if p < 0.001 { "below 0.001".to_owned() } else { format!("{p:.3}") }
}

/// A whole number with a blank before every three digits: `18 529`.
pub fn grouped(number: usize) -> String {
    grouped_with(number, ' ')
}

/// A whole number with this separator before every three digits.
pub fn grouped_with(number: usize, separator: char) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (position, digit) in digits.chars().enumerate() {
        if position > 0 && (digits.len() - position).is_multiple_of(3) {
            text.push(separator);
        }
        text.push(digit);
    }
    text
}

/// A number of things whose plural ends in `s`: `1 revision`, `18 529 revisions`.
pub fn counted(number: usize, thing: &str) -> String {
    format!("{} {thing}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed<Name: AsRef<str>>(names: &[Name]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Text on one line, cut after this many characters, without marks that turn its direction: for titles, whose marks
/// would turn the text around them, too.
///
/// ```
/// assert_eq!(matdb::formats::words::shortened("first\nsecond", 8), "first se…");
/// ```
pub fn shortened(text: &str, most: usize) -> String {
    let mut line = text
        .chars()
        .filter(|c| !matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'))
        .map(|c| if c.is_control() { ' ' } else { c });
    let short: String = line.by_ref().take(most).collect();
    if line.next().is_some() { short.trim_end().to_owned() + "…" } else { short }
}

/// Text with a capital first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Text with a small first letter, such as a sentence after a colon.
pub fn uncapitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

/// The sign that people write for a unit's UCUM code.
pub fn unit(ucum: &str) -> &str {
    match ucum {
        "deg" => "°",
        "dB[mW]" => "dBm",
        other => other,
    }
}

/// A written number with its unit, given as a UCUM code; `1` is the code of a pure number.
pub fn in_unit(number: String, ucum: &str) -> String {
    if ucum == "1" { number } else { format!("{number} {}", unit(ucum)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_gives_a_number_its_digits() {
        assert_eq!(plus_minus(1234.56, 42.0), "1235 ± 42");
        assert_eq!(plus_minus(0.001234, 0.0000567), "0.001234 ± 0.000057");
        assert_eq!(plus_minus(-0.0001, 0.3), "0.00 ± 0.30");
    }

    #[test]
    fn signs_are_true_and_zero_has_none() {
        assert_eq!(
            [-0.004, 0.004, 1.0, -1.0].map(|x| signed(x, 2)),
            ["0.00", "0.00", "+1.00", "−1.00"]
        );
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(|x| fixed(x, 1)), ["NaN", "−inf"]);
        assert_eq!([-10.0, -0.04, f64::NEG_INFINITY].map(decibels), ["−10.0", "0.0", "nothing"]);
    }

    #[test]
    fn counts_are_grouped_and_have_a_plural() {
        assert_eq!(
            ["1", "999", "1 000", "18 529", "1 234 567"],
            [1, 999, 1000, 18_529, 1_234_567].map(grouped).each_ref().map(String::as_str)
        );
        let said = [0, 1, 2000].map(|number| counted(number, "fit"));
        assert_eq!(said, ["0 fits", "1 fit", "2 000 fits"]);
        assert_eq!([percent(0, 9), percent(1, 8), percent(9, 9)], ["none", "12.5 %", "all"]);
    }

    #[test]
    fn line_ends_and_marks_of_direction_do_not_reach_a_title() {
        assert_eq!(shortened("ab\u{202e}cd\nef", 6), "abcd e…");
        assert_eq!(shortened("abc", 3), "abc");
    }

    #[test]
    fn names_are_listed() {
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
        assert_eq!([capitalised("ab"), uncapitalised("AB")], ["Ab", "aB"]);
    }
}
