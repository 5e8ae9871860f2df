//! BibTeX.

/// An entry with the fields that have a value. Of its key TeX reads letters, digits, `:` and `-` safely;
/// whatever else is in it becomes `-`.
pub(super) fn entry<const N: usize>(
    kind: &str,
    key: &str,
    fields: [(&str, Option<String>); N],
) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || ":-".contains(c) { c } else { '-' };
    let mut text = format!("@{kind}{{{}", key.chars().map(plain).collect::<String>());
    for (name, value) in fields {
        if let Some(value) = value {
            let value = if matches!(name, "doi" | "url") { address(&value) } else { tex(&value) };
            text += &format!(",\n  {name} = {{{value}}}");
        }
    }
    text + "\n}\n"
}

/// An address as it is, but for what would end a field.
fn address(value: &str) -> String {
    value.replace('{', "%7B").replace('}', "%7D").replace('\\', "%5C")
}

/// Text that TeX sets as it stands.
fn tex(text: &str) -> String {
    let mut set = String::new();
    for letter in text.chars() {
        match letter {
            '\\' => set += "\\textbackslash{}",
            '~' => set += "\\textasciitilde{}",
            '^' => set += "\\textasciicircum{}",
            '{' | '}' | '&' | '%' | '$' | '#' | '_' => set.extend(['\\', letter]),
            other => set.push(other),
        }
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_tex_would_read_is_spelled_out() {
        assert_eq!(tex("50 % of {a_b} \\x"), "50 \\% of \\{a\\_b\\} \\textbackslash{}x");
    }

    #[test]
    fn an_address_stays_one_and_ends_no_field() {
        let url = Some("https://a.example/x_y?z={1}".to_owned());
        let text = entry("misc", "a key}, é", [("url", url), ("note", None)]);
        assert_eq!(text, "@misc{a-key----,\n  url = {https://a.example/x_y?z=%7B1%7D}\n}\n");
    }
}
