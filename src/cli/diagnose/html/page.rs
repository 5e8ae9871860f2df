//! Parts of a page that stands alone: no script, no other file, nothing from outside.
//!
//! Whatever a function takes as `text` is escaped by it; `html` is taken as it is.

use crate::cli::diagnose::plots::Picture;
use crate::error::Error;
use crate::formats::figure::FigureError;

const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1c1c1c;--quiet:#595959;--page:#fff;--soft:#f3f3f1;--line:#d5d5d0;\
--mark:#00568a}
@media(prefers-color-scheme:dark){:root{--ink:#e9e9e6;--quiet:#a9a9a4;--page:#161614;--soft:#222220;\
--line:#3c3c38;--mark:#7cc4f2}}
*{box-sizing:border-box}
body{margin:0 auto;padding:1rem 1rem 4rem;max-width:60rem;background:var(--page);color:var(--ink);\
font:1rem/1.55 system-ui,sans-serif;overflow-wrap:break-word}
h1{font-size:1.7rem;line-height:1.25;margin:.2rem 0 .6rem}
h2{font-size:1.25rem;margin:2.4rem 0 .5rem;border-top:1px solid var(--line);padding-top:1.2rem}
h3{font-size:1.08rem;margin:1.4rem 0 .3rem}
p,ul,ol,dl{margin:.5rem 0;max-width:46rem}
.verdict{font-size:1.15rem}
.quiet,figcaption,caption{color:var(--quiet);font-size:.92rem}
article{background:var(--soft);border-left:4px solid var(--mark);padding:.2rem 1rem .8rem;margin:1rem 0}
article h3{margin-top:.8rem}
.scroll{overflow-x:auto;margin:.8rem 0}
table{border-collapse:collapse}
caption{text-align:left;padding-bottom:.3rem}
th,td{padding:.35rem .9rem .35rem 0;text-align:left;vertical-align:top;\
border-bottom:1px solid var(--line)}
td.n,th.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
td:last-child:not(.n){min-width:14rem}
code,pre{font-family:ui-monospace,monospace;font-size:.92em}
pre{background:var(--soft);padding:.7rem 1rem;overflow-x:auto}
figure{margin:1.2rem 0 2rem}
.panels{display:flex;flex-wrap:wrap;gap:.5rem;align-items:flex-start}
.panels svg{flex:1 1 20rem;max-width:100%;min-width:0;height:auto;background:#fff;border-radius:4px}
figcaption{max-width:46rem;margin-top:.4rem}
dt{font-weight:600;margin-top:.5rem}
dd{margin:0}
a{color:var(--mark)}
";

/// Text as HTML: its signs spelled out, control characters as blanks.
pub(super) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            control if control.is_control() && control != '\n' => html.push(' '),
            other => html.push(other),
        }
    }
    html
}

/// The whole page.
pub(super) fn page(title: &str, html: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{html}</main>\n\
         </body>\n</html>\n",
        escaped(title)
    )
}

/// A section under a heading.
pub(super) fn section(heading: &str, html: &str) -> String {
    format!("<section>\n<h2>{}</h2>\n{html}</section>\n", escaped(heading))
}

/// A paragraph.
pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// A paragraph that says something beside the point.
pub(super) fn quiet(text: &str) -> String {
    format!("<p class=\"quiet\">{}</p>\n", escaped(text))
}

/// A list of sentences.
pub(super) fn list(texts: &[String]) -> String {
    let items: String = texts.iter().map(|text| format!("<li>{}</li>\n", escaped(text))).collect();
    format!("<ul>\n{items}</ul>\n")
}

/// Names and what they mean.
pub(super) fn meanings(pairs: &[(&str, &str)]) -> String {
    let pair = |(name, meaning): &(&str, &str)| {
        format!("<dt>{}</dt>\n<dd>{}</dd>\n", escaped(name), escaped(meaning))
    };
    format!("<dl>\n{}</dl>\n", pairs.iter().map(pair).collect::<String>())
}

/// Commands to type.
pub(super) fn commands(text: &str) -> String {
    format!("<pre><code>{}</code></pre>\n", escaped(text))
}

/// A table with a heading for each row and column.
pub(super) fn table<const N: usize>(
    caption: &str,
    columns: [Column; N],
    rows: &[[String; N]],
) -> String {
    let class = |column: &Column| if column.is_number { " class=\"n\"" } else { "" };
    let head = columns
        .iter()
        .map(|column| format!("<th scope=\"col\"{}>{}</th>", class(column), escaped(column.name)));
    let head: String = head.collect();
    let cell = |(place, (column, text)): (usize, (&Column, &String))| {
        let text = escaped(text);
        match place {
            0 => format!("<th scope=\"row\">{text}</th>"),
            _ => format!("<td{}>{text}</td>", class(column)),
        }
    };
    let row = |row: &[String; N]| {
        let cells: String = columns.iter().zip(row).enumerate().map(cell).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = rows.iter().map(row).collect();
    let caption = escaped(caption);
    // What scrolls sideways must be reached by keyboard, too.
    format!(
        "<div class=\"scroll\" role=\"region\" aria-label=\"{caption}\" tabindex=\"0\">\n<table>\n\
         <caption>{caption}</caption>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n\
         </table>\n</div>\n"
    )
}

/// Heading of a column.
#[derive(Clone, Copy)]
pub(super) struct Column {
    name: &'static str,
    is_number: bool,
}

/// A column of words.
pub(super) const fn words(name: &'static str) -> Column {
    Column { name, is_number: false }
}

/// A column of numbers.
pub(super) const fn numbers(name: &'static str) -> Column {
    Column { name, is_number: true }
}

/// A picture with its caption; its panels stand below each other where there is no room.
pub(super) fn figure(picture: &Picture) -> Result<String, Error> {
    let mut panels = String::new();
    for panel in &picture.panels {
        let svg = panel.svg().map_err(FigureError::from)?;
        // Inside a page the name space goes without saying.
        panels += &svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    }
    let (title, caption) = (escaped(picture.title), escaped(&picture.caption));
    Ok(format!(
        "<figure>\n<div class=\"panels\" role=\"img\" aria-label=\"{title}\">\n{panels}</div>\n\
         <figcaption><strong>{title}.</strong> {caption}</figcaption>\n</figure>\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_text_becomes_a_tag() {
        let hostile = "<script>alert('x')</script>\u{1b}[2J & \"quoted\"";
        let html = paragraph(hostile)
            + &section(hostile, "")
            + &list(&[hostile.to_owned()])
            + &table(hostile, [words("a")], &[[hostile.to_owned()]])
            + &commands(hostile)
            + &page(hostile, "");
        assert!(!html.contains("<script") && !html.contains('\u{1b}'), "{html}");
        assert!(html.contains("&lt;script&gt;alert(&#39;x&#39;)"), "{html}");
    }
}
