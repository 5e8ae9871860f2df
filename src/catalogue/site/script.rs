//! Data for scripts: a file that calls a function with one value. A page opened from a folder may load
//! scripts and nothing else.

use serde::Serialize;

/// `name(value);` as the text of a script.
pub(super) fn call(name: &str, value: &impl Serialize) -> String {
    format!("{name}({});\n", inert(value))
}

/// JSON in which nothing can end a script element or a line of a script.
pub(super) fn inert(value: &impl Serialize) -> String {
    // Plain structs and JSON values have no way to fail.
    let json = serde_json::to_string(value).unwrap_or_default();
    let mut text = String::with_capacity(json.len());
    for letter in json.chars() {
        // Outside strings JSON has none of these.
        match letter {
            '<' | '>' | '&' | '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' => {
                text += &format!("\\u{:04x}", letter as u32);
            }
            other => text.push(other),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_cannot_leave_their_script() {
        let hostile = "</script><!--\u{2028}\u{2029}\"\\";
        let text = call("f", &hostile);
        assert!(!text.contains(['<', '>', '\u{2028}', '\u{2029}']), "{text}");
        let json = text.trim_end().strip_prefix("f(").unwrap().strip_suffix(");").unwrap();
        assert_eq!(serde_json::from_str::<String>(json).unwrap(), hostile);
    }
}
