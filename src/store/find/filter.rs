//! Filters: each condition has an index. The query uses the index of one that few materials match.

use rusqlite::types::Value;
use rusqlite::{Connection, Result, Row, params_from_iter};

use crate::material::{Fit, Material, SourceKind};
use crate::store::results::Summary;
use crate::store::rows::rows;

/// Conditions on a material, all of which must hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// A frequency within the range for which the numbers are claimed, Hz.
    pub frequency_hz: Option<f64>,
    /// One of its tags.
    pub tag: Option<String>,
    /// Kind of the source of what scenes render.
    pub kind: Option<SourceKind>,
    /// Class, such as `polymer`.
    pub class: Option<String>,
    /// Whether it has a model that was fitted to a curve.
    pub fitted: Option<bool>,
    /// `active`, `superseded` or `withdrawn`.
    pub status: Option<String>,
}

impl Filter {
    /// Whether a material matches, stored or not, by the rules of [`Store::find`](crate::store::Store::find).
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

/// Up to this number of matches are read and sorted at once. With more, a page is read in the order of names.
const FEW: u32 = 500;

const LINE: &str = "slug, name, class, revision, kind, status, curves, observations, fits";

/// Up to this number of different highest frequencies, each is queried by itself.
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
        is_damaged: false,
    })
}

/// One condition of a filter.
struct Condition {
    sql: String,
    values: Vec<Value>,
    /// The table with the index of this condition.
    table: &'static str,
    /// The condition in a query by the index of another condition.
    beside: String,
    /// Whether its index gives matches in the order of names.
    is_ordered: bool,
}

impl Condition {
    /// A condition on one column.
    fn plain(sql: &str, table: &'static str, values: Vec<Value>, is_ordered: bool) -> Condition {
        // A plus before a column stops SQLite from using its index.
        let (sql, beside) = (sql.to_owned(), format!("+{sql}"));
        Condition { sql, values, table, beside, is_ordered }
    }
}

fn text(text: &str) -> Vec<Value> {
    vec![Value::Text(text.to_owned())]
}

/// All materials that match a filter, sorted by name.
pub(super) fn all(conn: &Connection, filter: &Filter) -> Result<Vec<Summary>> {
    let conditions = conditions(conn, filter)?;
    let index = rare(conn, &conditions)?.or((!conditions.is_empty()).then_some(0));
    sorted(conn, &conditions, index)
}

/// The first `most` materials that match a filter, sorted by name.
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

/// Number of materials that match a filter, at most `most`.
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

/// The clause of all conditions, by the index of the one that the fewest materials match.
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
    // With ORDER BY, SQLite would read all materials in order instead of using the index.
    found.sort_by(|a, b| a.slug.cmp(&b.slug));
    Ok(found)
}

/// Place of the first condition that only few materials match.
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

/// The clause of all conditions, by the index of one of them.
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

/// The conditions of a filter, usually the most selective first.
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

/// The condition that a frequency lies within the claimed range. The index finds the lower ends directly only for one
/// highest frequency at a time.
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

/// The different highest frequencies of materials from this one on, Hz; `None` for more than [`FEW_ENDS`].
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
