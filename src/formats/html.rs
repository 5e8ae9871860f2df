//! HTML pages from templates. This is the only file that knows which template engine is used.
//!
//! Every value that a template inserts is escaped and loses its control characters. The only exceptions
//! are the filters `drawing`, for SVG that this program wrote, and `json`, for data that a script reads.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, UndefinedBehavior, escape_formatter};
use serde::Serialize;
use thiserror::Error;

use super::words;

/// A template that does not compile, or that its context does not fit.
#[derive(Debug, Error)]
#[error("page {name}: {reason}; please report this")]
pub struct PageError {
    /// The template.
    pub name: String,
    /// What the engine says.
    pub reason: String,
}

/// A set of templates that may extend and import each other.
///
/// Filters: `drawing` (SVG as it is), `json` (JSON as an element `script` holds it), `urlword` (text as a value in an address), and the functions of
/// [`words`] of the same names: `digits`, `fixed(decimals)`, `signed(decimals)`, `plus_minus(sd)`,
/// `grouped`, `counted(thing)`, `probability`, `in_unit(ucum)`, `listed`.
pub struct Templates(Environment<'static>);

impl Templates {
    /// Compiles templates, each given as its name and its text.
    ///
    /// # Errors
    /// When one has a syntax error.
    pub fn new(pages: &[(&'static str, &'static str)]) -> Result<Templates, PageError> {
        let mut env = Environment::new();
        env.set_auto_escape_callback(|_| AutoEscape::Html);
        env.set_undefined_behavior(UndefinedBehavior::Strict);
        let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
        env.set_syntax(syntax.map_err(|error| failed("syntax", &error))?);
        env.set_formatter(|out, state, value| match value.as_str() {
            Some(text) if !value.is_safe() => {
                escape_formatter(out, state, &Value::from(clean(text)))
            }
            _ => escape_formatter(out, state, value),
        });
        // Drawings are ours; the text in them is escaped where they are drawn.
        env.add_filter("drawing", |svg: String| Value::from_safe_string(svg));
        // In JSON this letter is in texts alone, and there it may be spelled out.
        env.add_filter("json", |json: String| {
            Value::from_safe_string(json.replace('<', "\\u003c"))
        });
        env.add_filter("urlword", |text: String| urlword(&text));
        add_words(&mut env);
        for (name, text) in pages {
            env.add_template(name, text).map_err(|error| failed(name, &error))?;
        }
        Ok(Templates(env))
    }

    /// Fills a template with a context.
    ///
    /// # Errors
    /// When the template names something that the context lacks.
    pub fn page(&self, name: &str, context: &impl Serialize) -> Result<String, PageError> {
        let page = self.0.get_template(name).and_then(|page| page.render(Serde(context)));
        page.map_err(|error| failed(name, &error))
    }
}

/// The filters that write numbers and lists.
fn add_words(env: &mut Environment) {
    env.add_filter("digits", words::digits);
    env.add_filter("fixed", words::fixed);
    env.add_filter("signed", words::signed);
    env.add_filter("plus_minus", words::plus_minus);
    env.add_filter("grouped", words::grouped);
    env.add_filter("counted", |number: usize, thing: String| words::counted(number, &thing));
    env.add_filter("probability", words::probability);
    env.add_filter("in_unit", |number: String, ucum: String| words::in_unit(number, &ucum));
    env.add_filter("listed", |names: Vec<String>| words::listed(&names));
}

/// Text with U+FFFD for control characters, which no page may hold; line ends and tabs stay.
pub fn clean(text: &str) -> String {
    let is_visible = |c: char| !c.is_control() || matches!(c, '\n' | '\t');
    text.chars().map(|c| if is_visible(c) { c } else { '\u{fffd}' }).collect()
}

/// Text as a value in an address.
fn urlword(text: &str) -> String {
    let mut word = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() {
            word.push(char::from(byte));
        } else {
            word += &format!("%{byte:02X}");
        }
    }
    word
}

fn failed(name: &str, error: &minijinja::Error) -> PageError {
    PageError { name: name.to_owned(), reason: format!("{error:#}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_text_becomes_a_tag() {
        let templates = Templates::new(&[("a", "<p title=\"{{ x }}\">{{ x }}</p>")]).unwrap();
        let hostile = "<script>alert('x')</script>\u{1b}[2J & \"quoted\"";
        let page = templates.page("a", &serde_json::json!({ "x": hostile })).unwrap();
        assert!(!page.contains("<script") && !page.contains('\u{1b}'), "{page}");
        assert_eq!(page.matches("&lt;script&gt;alert(&#x27;x&#x27;)").count(), 2, "{page}");
        assert!(!page.replace("title=\"", "").contains("\"quoted"), "{page}");
    }

    #[test]
    fn what_a_context_lacks_is_an_error() {
        let templates = Templates::new(&[("a", "{{ b }}")]).unwrap();
        assert!(templates.page("a", &serde_json::json!({})).is_err());
        assert!(Templates::new(&[("a", "{% if %}")]).is_err());
    }

    #[test]
    fn numbers_are_written_by_filters() {
        let text = "{{ 1.0 | plus_minus(0.1) }} {{ 18529 | grouped }} {{ ['a', 'b'] | listed }}";
        let page = Templates::new(&[("a", text)]).unwrap().page("a", &()).unwrap();
        assert_eq!(page, "1.00 ± 0.10 18 529 a and b");
    }
}
