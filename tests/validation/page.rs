//! The page: sections of tables whose rows carry a number, its tolerance and a verdict.

/// Every row of every table, beside the page that sums them up.
pub const ROWS: &str = "tests/validation/rows.md";

/// Writes the page.
pub const COMMAND: &str =
    "`MATDB_WRITE_VALIDATION=1 cargo test --test promises validation::` writes it";

/// Margins that differ by less are equal: rounding must not choose which row is shown.
const SAME_MARGIN: f64 = 1e-6;

/// So many rows of one kind are shown as the worst of them.
const MANY: usize = 3;

/// Below this a number is rounding and differs from one machine to the next.
const ROUNDING: f64 = 1e-12;

/// Where a number must lie.
#[derive(Clone, Copy)]
pub enum Tolerance {
    /// At most this.
    Below(f64),
    /// Between the two.
    Within(f64, f64),
}

/// One number and where it must lie.
pub struct Row {
    /// What the number is.
    pub what: String,
    value: f64,
    digits: i32,
    unit: &'static str,
    tolerance: Tolerance,
    /// Why the number is known to lie outside, which the page then lists.
    fails_because: Option<String>,
}

/// A table with the reason for its tolerances.
pub struct Table {
    /// What is compared and why the tolerance is what it is.
    pub text: String,
    /// Its rows.
    pub rows: Vec<Row>,
}

/// A section of the page.
pub struct Section {
    /// Its heading.
    pub title: &'static str,
    /// Its tables.
    pub tables: Vec<Table>,
    /// What this section leaves open.
    pub not_covered: Vec<&'static str>,
}

impl Section {
    /// Every row of every table.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.tables.iter().flat_map(|table| &table.rows)
    }
}

impl Row {
    /// A pure number, shown with two digits.
    pub fn new(what: impl Into<String>, value: f64, tolerance: Tolerance) -> Row {
        Row { what: what.into(), value, digits: 2, unit: "", tolerance, fails_because: None }
    }

    /// The same with a unit.
    pub fn unit(self, unit: &'static str) -> Row {
        Row { unit, ..self }
    }

    /// The same with more digits.
    pub fn digits(self, digits: i32) -> Row {
        Row { digits, ..self }
    }

    /// The same, known to lie outside.
    pub fn fails_because(self, reason: impl Into<String>) -> Row {
        Row { fails_because: Some(reason.into()), ..self }
    }

    /// Whether the number lies within its tolerance; NaN does not.
    pub fn passes(&self) -> bool {
        match self.tolerance {
            Tolerance::Below(most) => self.value <= most,
            Tolerance::Within(least, most) => self.value >= least && self.value <= most,
        }
    }

    /// A sentence when the verdict is not the one that is known.
    pub fn surprise(&self) -> Option<String> {
        let known = if self.fails_because.is_some() { "fail" } else { "pass" };
        let surprising = self.passes() == self.fails_because.is_some();
        surprising.then(|| format!("{} is {}, which should {known}", self.what, self.found()))
    }

    /// The number as the page shows it.
    pub fn found(&self) -> String {
        with_unit(&number(self.value, self.digits), self.unit)
    }

    /// What is measured, without of what.
    fn kind(&self) -> &str {
        self.what.rsplit_once(": ").map_or(&self.what, |(_, kind)| kind)
    }

    /// Share of its tolerance that the number takes.
    fn share_of_tolerance(&self) -> f64 {
        match self.tolerance {
            Tolerance::Below(most) => self.value / most,
            Tolerance::Within(least, most) => {
                (2.0 * self.value - least - most).abs() / (most - least)
            }
        }
    }

    fn tolerance(&self) -> String {
        let tolerance = match self.tolerance {
            Tolerance::Below(most) => format!("≤ {}", plain(most)),
            Tolerance::Within(least, most) => format!("{} to {}", plain(least), plain(most)),
        };
        with_unit(&tolerance, self.unit)
    }

    fn markdown(&self, what: &str) -> String {
        format!("| {what} | {} | {} |\n", self.found(), self.tolerance())
    }
}

/// The rows of a table that pass; many of one kind as the one that takes most of its tolerance.
fn summary(table: &Table) -> String {
    let mut kinds: Vec<(&str, Vec<&Row>)> = Vec::new();
    for row in table.rows.iter().filter(|row| row.passes()) {
        match kinds.iter_mut().find(|(kind, _)| *kind == row.kind()) {
            Some((_, rows)) => rows.push(row),
            None => kinds.push((row.kind(), vec![row])),
        }
    }
    kinds.iter().map(|(kind, rows)| summary_of_kind(kind, rows)).collect()
}

fn summary_of_kind(kind: &str, rows: &[&Row]) -> String {
    if rows.len() < MANY {
        return rows.iter().map(|row| row.markdown(&row.what)).collect();
    }
    let most = rows.iter().map(|row| row.share_of_tolerance()).fold(0.0, f64::max);
    let is_worst = |row: &&&Row| row.share_of_tolerance() >= most - SAME_MARGIN;
    let worst = rows.iter().find(is_worst).expect("one of them takes most");
    if worst.value.abs() < ROUNDING {
        worst.markdown(&format!("all {}: {kind}", rows.len()))
    } else {
        worst.markdown(&format!("worst of {}, {}", rows.len(), worst.what))
    }
}

fn with_unit(text: &str, unit: &str) -> String {
    format!("{text} {unit}").trim_end().to_owned()
}

/// So many significant digits; rounding errors are shown as a bound.
fn number(value: f64, digits: i32) -> String {
    if value.abs() < ROUNDING {
        return format!("< {ROUNDING:e}");
    }
    let scientific = format!("{value:.*e}", (digits - 1) as usize);
    let rounded: f64 = scientific.parse().unwrap_or(value);
    let exponent = rounded.abs().log10().floor() as i32;
    if !(-3..5).contains(&exponent) {
        return scientific;
    }
    format!("{rounded:.*}", (digits - 1 - exponent).max(0) as usize)
}

/// A tolerance is a chosen number and is shown as it was written.
fn plain(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { format!("{value}") }
}

const HEAD: &str = "| what | found | tolerance |\n|---|---|---|\n";

fn introduction() -> String {
    format!(
        "This page compares what the code computes with closed forms, published figures, limits that two models must \
         share, another renderer, and an integral of physical optics. It checks the code, not whether a model suits a material; nothing here is \
         measured. Generated: `tests/validation.rs` computes every number and fails when one leaves its tolerance or \
         changes; {COMMAND}. Where a table has many rows of one kind, the page shows the one that takes most of its \
         tolerance. `{ROWS}` has every row."
    )
}

/// A paragraph in lines of at most 110 characters.
fn wrapped(text: &str) -> String {
    const WIDTH: usize = 110;
    let (mut lines, mut length) = (String::new(), 0);
    for word in text.split_whitespace() {
        let count = word.chars().count();
        let fits = length + 1 + count <= WIDTH;
        lines += if length == 0 {
            ""
        } else if fits {
            " "
        } else {
            "\n"
        };
        length = if fits { length + 1 + count } else { count };
        lines += word;
    }
    lines
}

/// The page.
pub fn markdown(sections: &[Section]) -> String {
    let mut page = format!("# Validation\n\n{}\n\n## What fails\n\n", wrapped(&introduction()));
    for row in sections.iter().flat_map(Section::rows) {
        if let Some(reason) = &row.fails_because {
            page += &format!("- {} {}. {reason}\n", row.what, row.found());
        }
    }
    page += "\n## What is not covered\n\n";
    for what in sections.iter().flat_map(|section| &section.not_covered) {
        page += &format!("- {what}\n");
    }
    for section in sections {
        page += &format!("\n## {}\n", section.title);
        for table in &section.tables {
            page += &format!("\n{}\n\n{HEAD}{}", wrapped(&table.text), summary(table));
        }
    }
    page
}

/// Every row of every table.
pub fn rows(sections: &[Section]) -> String {
    let mut text = format!("Every number of docs/validation.md; {COMMAND}.\n");
    for section in sections {
        text += &format!(
            "\n## {}\n\n| what | found | tolerance | verdict |\n|---|---|---|---|\n",
            section.title
        );
        for row in section.rows() {
            let verdict = if row.passes() { "passes" } else { "**fails**" };
            text +=
                &format!("| {} | {} | {} | {verdict} |\n", row.what, row.found(), row.tolerance());
        }
    }
    text
}
