//! Entries in BibTeX.

/// An entry with these authors and the fields that have a value. Every character of the key that TeX could misread,
/// all but letters, digits, `:` and `-`, becomes `-`.
pub(super) fn entry<const N: usize>(
    kind: &str,
    key: &str,
    authors: &[String],
    fields: [(&str, Option<String>); N],
) -> String {
    let key = key.replace(|c: char| !c.is_ascii_alphanumeric() && !":-".contains(c), "-");
    let mut text = format!("@{kind}{{{key}");
    if !authors.is_empty() {
        let names: Vec<String> = authors.iter().map(|author| name(author)).collect();
        text += &format!(",\n  author = {{{}}}", names.join(" and "));
    }
    for (name, value) in fields {
        if let Some(value) = value {
            let value = if matches!(name, "doi" | "url") { address(&value) } else { tex(&value) };
            text += &format!(",\n  {name} = {{{value}}}");
        }
    }
    text + "\n}\n"
}

/// A person as `Family, Given`, or an institute, which braces keep in one piece.
fn name(author: &str) -> String {
    if author.contains(", ") { tex(author) } else { format!("{{{}}}", tex(author)) }
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
    fn an_institute_is_one_name() {
        let authors = ["Roe, Ann".to_owned(), "Institute of Paint & Cloth and Others".to_owned()];
        let text = entry("misc", "k", &authors, [("note", None)]);
        let names = "{Roe, Ann and {Institute of Paint \\& Cloth and Others}}";
        assert_eq!(text, format!("@misc{{k,\n  author = {names}\n}}\n"));
    }

    #[test]
    fn an_address_stays_one_and_ends_no_field() {
        let url = Some("https://a.example/x_y?z={1}".to_owned());
        let text = entry("misc", "a key}, é", &[], [("url", url), ("note", None)]);
        assert_eq!(text, "@misc{a-key----,\n  url = {https://a.example/x_y?z=%7B1%7D}\n}\n");
    }
}
