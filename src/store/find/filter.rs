//! Filters: each condition has an index, and one that lets few through is used.

use rusqlite::types::Value;
use rusqlite::{Connection, Result, Row, params_from_iter};

use crate::material::{Fit, Material, SourceKind};
use crate::store::record::Summary;
use crate::store::rows::rows;

/// Which materials are wanted: those of which all holds that is said here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// A frequency within the range for which the numbers are claimed, Hz.
    pub frequency_hz: Option<f64>,
    /// One of its tags.
    pub tag: Option<String>,
    /// How the numbers that a scene renders came to be.
    pub kind: Option<SourceKind>,
    /// Kind of stuff.
    pub class: Option<String>,
    /// Whether it has a model that was fitted to a curve.
    pub fitted: Option<bool>,
    /// `active`, `superseded` or `withdrawn`.
    pub status: Option<String>,
}

impl Filter {
    /// Whether it lets a material through that need not be stored: the same as [`Store::find`](crate::store::Store::find) says of the
    /// current revision of one that is.
    pub fn lets_through(&self, material: &Material) -> bool {
        let Filter { frequency_hz, tag, kind, class, fitted, status } = self;
        frequency_hz.is_none_or(|hz| material.frequency_outside_hz(hz) == 0.0)
            && tag.as_ref().is_none_or(|tag| material.tags.contains(tag))
            && kind.is_none_or(|kind| material.render_kind() == Some(kind))
            && class.as_ref().is_none_or(|class| material.class == *class)
            && fitted.is_none_or(|fitted| material.fits.iter().any(Fit::is_fitted) == fitted)
            && status.as_ref().is_none_or(|status| material.status.as_str() == status)
    }
}

/// So many are read and sorted at once; where no condition lets so few through, a page is read in the
/// order of names.
const FEW: u32 = 500;

const LINE: &str = "slug, name, class, revision, kind, status, curves, observations, fits";

/// Where the highest frequencies of materials are no more different values than this, each is looked at.
const FEW_ENDS: usize = 64;

/// A line of a list.
pub(super) fn summary(row: &Row) -> Result<Summary> {
    Ok(Summary {
        slug: row.get(0)?,
        name: row.get(1)?,
        class: row.get(2)?,
        revision: row.get(3)?,
        render_kind: row.get(4)?,
        status: row.get(5)?,
        curves: row.get(6)?,
        observations: row.get(7)?,
        fits: row.get(8)?,
    })
}

/// What a filter says of one thing.
struct Condition {
    sql: String,
    values: Vec<Value>,
    /// The table by the index of this condition.
    table: &'static str,
    /// The condition where it is another one's index that is used.
    beside: String,
    /// Whether its index has what it lets through in the order of names.
    is_ordered: bool,
}

impl Condition {
    /// A condition on one column.
    fn plain(sql: &str, table: &'static str, values: Vec<Value>, is_ordered: bool) -> Condition {
        // The sign before a column keeps SQLite from its index.
        let (sql, beside) = (sql.to_owned(), format!("+{sql}"));
        Condition { sql, values, table, beside, is_ordered }
    }
}

fn text(text: &str) -> Vec<Value> {
    vec![Value::Text(text.to_owned())]
}

/// All that a filter lets through, sorted by name.
pub(super) fn all(conn: &Connection, filter: &Filter) -> Result<Vec<Summary>> {
    let conditions = conditions(conn, filter)?;
    let index = rare(conn, &conditions)?.or((!conditions.is_empty()).then_some(0));
    sorted(conn, &conditions, index)
}

/// The first `most` of them.
pub(super) fn page(conn: &Connection, filter: &Filter, most: u32) -> Result<Vec<Summary>> {
    let conditions = conditions(conn, filter)?;
    if let Some(rare) = rare(conn, &conditions)? {
        let mut found = sorted(conn, &conditions, Some(rare))?;
        found.truncate(usize::try_from(most).unwrap_or(usize::MAX));
        return Ok(found);
    }
    let index = conditions.iter().position(|condition| condition.is_ordered);
    let (from, mut values) = from(&conditions, index);
    values.push(Value::Integer(most.into()));
    let sql = format!("SELECT {LINE} {from} ORDER BY slug LIMIT ?");
    rows(conn, &sql, params_from_iter(values), summary)
}

/// How many a filter lets through, `most` at most.
pub(super) fn count(conn: &Connection, filter: &Filter, most: u32) -> Result<usize> {
    let (from, mut values) = from_rarest(conn, filter)?;
    values.push(Value::Integer(most.into()));
    let found: u32 = conn
        .prepare_cached(&format!("SELECT count(*) FROM (SELECT 1 {from} LIMIT ?)"))?
        .query_row(params_from_iter(values), |row| row.get(0))?;
    Ok(usize::try_from(found).unwrap_or(usize::MAX))
}

/// Every class.
pub(super) fn classes(conn: &Connection) -> Result<Vec<String>> {
    distinct(conn, "SELECT min(class) FROM entry WHERE class > ?1", usize::MAX)
}

/// The first `most` tags.
pub(super) fn tags(conn: &Connection, most: usize) -> Result<Vec<String>> {
    distinct(conn, "SELECT min(tag) FROM entry_tag WHERE tag > ?1", most)
}

/// The first `most` values of an indexed column, each found by the index from the one before.
fn distinct(conn: &Connection, next: &str, most: usize) -> Result<Vec<String>> {
    let mut next = conn.prepare_cached(next)?;
    let mut values: Vec<String> = Vec::new();
    while values.len() < most {
        let last = values.last().map_or("", String::as_str);
        let value: Option<String> = next.query_row([last], |row| row.get(0))?;
        let Some(value) = value else { break };
        values.push(value);
    }
    Ok(values)
}

/// All conditions, by the index of the one that lets the fewest through.
pub(super) fn from_rarest(conn: &Connection, filter: &Filter) -> Result<(String, Vec<Value>)> {
    let conditions = conditions(conn, filter)?;
    let index = rare(conn, &conditions)?.or((!conditions.is_empty()).then_some(0));
    Ok(from(&conditions, index))
}

fn sorted(
    conn: &Connection,
    conditions: &[Condition],
    index: Option<usize>,
) -> Result<Vec<Summary>> {
    let (from, values) = from(conditions, index);
    let sql = format!("SELECT {LINE} {from}");
    let mut found = rows(conn, &sql, params_from_iter(values), summary)?;
    // Asked for the order, SQLite would go through all of them in it instead of using an index.
    found.sort_by(|a, b| a.slug.cmp(&b.slug));
    Ok(found)
}

/// Place of the first condition that lets only few through.
fn rare(conn: &Connection, conditions: &[Condition]) -> Result<Option<usize>> {
    for (place, Condition { sql, values, table, .. }) in conditions.iter().enumerate() {
        let sql =
            format!("SELECT count(*) FROM (SELECT 1 FROM {table} WHERE {sql} LIMIT {FEW} + 1)");
        let found: u32 =
            conn.prepare_cached(&sql)?.query_row(params_from_iter(values), |row| row.get(0))?;
        if found <= FEW {
            return Ok(Some(place));
        }
    }
    Ok(None)
}

/// All conditions, by the index of one of them.
fn from(conditions: &[Condition], index: Option<usize>) -> (String, Vec<Value>) {
    let used = index.and_then(|index| conditions.get(index));
    let table = used.map_or("entry", |condition| condition.table);
    let all: Vec<&str> =
        conditions
            .iter()
            .enumerate()
            .map(|(place, condition)| {
                if index == Some(place) {
                    condition.sql.as_str()
                } else {
                    condition.beside.as_str()
                }
            })
            .collect();
    let filter = match all.as_slice() {
        [] => String::new(),
        all => format!(" WHERE {}", all.join(" AND ")),
    };
    let values = conditions.iter().flat_map(|condition| condition.values.clone()).collect();
    (format!("FROM {table}{filter}"), values)
}

/// What a filter says; what mostly lets the fewest through first.
fn conditions(conn: &Connection, filter: &Filter) -> Result<Vec<Condition>> {
    let Filter { frequency_hz, tag, kind, class, fitted, status } = filter;
    let beside = "EXISTS (SELECT 1 FROM entry_tag AS t WHERE t.slug = entry.slug AND t.tag = ?)";
    let tag = tag.as_deref().map(|tag| Condition {
        beside: beside.to_owned(),
        ..Condition::plain(
            "tag = ?",
            "entry_tag INDEXED BY entry_tag_tag CROSS JOIN entry USING (slug)",
            text(tag),
            true,
        )
    });
    let class = class.as_deref().map(|class| {
        Condition::plain("class = ?", "entry INDEXED BY entry_class", text(class), true)
    });
    let frequency = frequency_hz.map(|hz| frequency(conn, hz)).transpose()?;
    let fitted = fitted.map(|fitted| {
        let sql = if fitted { "fitted > 0" } else { "fitted = 0" };
        Condition::plain(sql, "entry INDEXED BY entry_fitted", Vec::new(), !fitted)
    });
    let status = status.as_deref().map(|status| {
        Condition::plain("status = ?", "entry INDEXED BY entry_status", text(status), true)
    });
    let kind = kind.map(|kind| {
        Condition::plain("kind = ?", "entry INDEXED BY entry_kind", text(kind.as_str()), true)
    });
    Ok([tag, class, frequency, fitted, status, kind].into_iter().flatten().collect())
}

/// That a frequency lies within the claimed range. The index finds at once what begins below it only
/// among those of one highest frequency.
fn frequency(conn: &Connection, hz: f64) -> Result<Condition> {
    let ends = ends(conn, hz)?;
    let above = match &ends {
        Some(ends) => format!("frequency_max_hz IN ({})", vec!["?"; ends.len()].join(", ")),
        None => "frequency_max_hz >= ?".to_owned(),
    };
    let values = ends.unwrap_or_else(|| vec![hz]).into_iter().chain([hz]).map(Value::Real);
    Ok(Condition {
        sql: format!("{above} AND frequency_min_hz <= ?"),
        beside: format!("+{above} AND +frequency_min_hz <= ?"),
        values: values.collect(),
        table: "entry INDEXED BY entry_frequency",
        is_ordered: false,
    })
}

/// The different highest frequencies of materials from this one on, Hz; `None` when they are many.
fn ends(conn: &Connection, hz: f64) -> Result<Option<Vec<f64>>> {
    let sql = "SELECT min(frequency_max_hz) FROM entry WHERE frequency_max_hz >= ?1";
    let mut next = conn.prepare_cached(sql)?;
    let (mut ends, mut from) = (Vec::new(), hz);
    loop {
        let end: Option<f64> = next.query_row([from], |row| row.get(0))?;
        let Some(end) = end else { return Ok(Some(ends)) };
        if ends.len() == FEW_ENDS {
            return Ok(None);
        }
        ends.push(end);
        from = end.next_up();
    }
}
