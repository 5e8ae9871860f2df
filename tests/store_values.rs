//! Promise: the value of a parameter of a model is stored once, in `fit_parameter`. Whatever shows the model is
//! derived from it, to the last bit. Only `fit.report` has the values that a fit once found, as its record. A file from before, which had three copies, loses none: where they agree, two are
//! removed; where they disagree, all stay until the content hash decides.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::database::{contents, fitted};
use crate::support::{self, matdb, refused};
use matdb::brdf::Brdf;
use matdb::catalogue::{Refit, StoreCheck};
use matdb::material::{Estimate, FitNumber, Material, builtin};
use matdb::store::{Cell, Repair, Store, StoreError};
use rusqlite::Connection;
use rusqlite::types::Value;

/// Tables that schema 10 had, and that publications have had since.
const TABLES: [&str; 4] = ["fit", "fit_covariance", "fit_estimate", "fit_parameter"];

/// A copy of a file of schema 10 with fits that `matdb fit` has made, changed as another program would.
fn old_file(change: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let kept = support::root().join("tests/fixtures/fits-of-schema-0010.sqlite");
    fs::write(&path, fs::read(kept).unwrap()).unwrap();
    Connection::open(&path).unwrap().execute_batch(change).unwrap();
    (folder, path)
}

/// The rows of a query as another program reads them.
fn raw_rows(path: &Path, sql: &str) -> Vec<Vec<Value>> {
    let conn = Connection::open(path).unwrap();
    let mut statement = conn.prepare(sql).unwrap();
    let columns = statement.column_count();
    let rows = statement.query_map([], |row| (0..columns).map(|at| row.get(at)).collect()).unwrap();
    rows.map(Result::unwrap).collect()
}

/// The rows of a table as a publication has them.
fn published_rows(store: &Store, name: &str) -> Vec<Vec<Value>> {
    let tables = store.tables().unwrap();
    let table = tables.iter().find(|table| table.name == name).unwrap();
    let mut rows = Vec::new();
    let take = |cells: &[Cell]| -> Result<(), StoreError> {
        rows.push(cells.iter().map(value).collect());
        Ok(())
    };
    store.rows(table, take).unwrap();
    rows
}

fn value(cell: &Cell) -> Value {
    match *cell {
        Cell::Null => Value::Null,
        Cell::Integer(number) => Value::Integer(number),
        Cell::Real(number) => Value::Real(number),
        Cell::Text(text) => Value::Text(text.to_owned()),
    }
}

/// A row of `fit_estimate` as it must be for a number.
fn estimate_row(fit: &str, position: usize, number: &FitNumber) -> Vec<Value> {
    let real = |number: Option<f64>| number.map_or(Value::Null, |x| Value::Real(x + 0.0));
    let flag = |is: bool| Value::Integer(is.into());
    vec![
        Value::Text(fit.to_owned()),
        Value::Integer(position as i64),
        Value::Text(number.name.clone()),
        real(Some(number.value)),
        Value::Text(number.unit.to_owned()),
        real(number.sd),
        real(number.interval_95.map(|[low, _]| low)),
        real(number.interval_95.map(|[_, high]| high)),
        Value::Text(number.chosen_by.as_str().to_owned()),
        flag(number.is_at_bound),
        flag(number.is_identified()),
    ]
}

/// Fails unless `fit_estimate` has exactly the numbers of a material's fits; it must be alone in the database.
fn assert_estimates(store: &Store, material: &Material) {
    let mut found = published_rows(store, "fit_estimate");
    found.iter_mut().for_each(|row| drop(row.remove(0)));
    let mut fits: Vec<_> = material.fits.iter().collect();
    fits.sort_by_key(|fit| &fit.name);
    let mut wanted = Vec::new();
    for fit in fits {
        let numbers = fit.numbers();
        wanted.extend(
            numbers.iter().enumerate().map(|(at, number)| estimate_row(&fit.name, at, number)),
        );
    }
    assert_eq!(found, wanted);
}

#[test]
fn only_the_rows_of_parameters_have_their_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let materials: Vec<Material> =
        builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
    Store::open(&path).unwrap().add(&materials).unwrap();
    let mut with_parameters = 0;
    for material in materials {
        for fit in material.fits.iter().filter(|fit| !fit.model.parameters().is_empty()) {
            let sql = format!(
                "SELECT fit.model FROM fit JOIN revision ON revision.id = revision_id
                 JOIN material ON material.id = material_id WHERE slug = '{}' AND fit.name = '{}'",
                material.slug, fit.name
            );
            let [Value::Text(structure)] = &raw_rows(&path, &sql)[0][..] else { panic!("{sql}") };
            let nulls = structure.matches(":null").count();
            assert_eq!(nulls, fit.model.parameters().len(), "{structure}");
            assert!(serde_json::from_str::<Brdf>(structure).is_err(), "{structure}");
            with_parameters += 1;
        }
    }
    assert!(with_parameters > 20);
}

#[test]
fn every_number_of_a_report_is_shown_to_the_last_bit() {
    // Finite numbers of any size: xorshift (Marsaglia, J. Stat. Softw. 8 (2003), 14).
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || loop {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let number = f64::from_bits(state);
        if number.is_finite() {
            return number;
        }
    };
    for _ in 0..40 {
        let mut material = fitted("own");
        let report = material.fits[0].report.as_mut().unwrap();
        let mut estimates = Vec::new();
        for number in 0..100 {
            let (a, b) = (random(), random());
            let (sd, interval_95) = (Some(random().abs()), Some([a.min(b), a.max(b)]));
            let name = if number == 0 { "k".to_owned() } else { format!("x{}", number / 2) };
            estimates.push(Estimate { name, value: random(), sd, interval_95 });
        }
        estimates[9].sd = None;
        estimates[9].interval_95 = Some([-0.0, 0.0]);
        report.covariance = vec![vec![0.0; estimates.len()]; estimates.len()];
        report.estimates = estimates;
        let mut store = Store::in_memory().unwrap();
        store.add([&material]).unwrap();
        assert_estimates(&store, &material);
    }
}

#[test]
fn a_file_with_three_copies_that_agree_keeps_every_number_to_the_last_bit() {
    let (_folder, path) = old_file("");
    let view = "SELECT * FROM v_fits ORDER BY fit, path";
    let shown = raw_rows(&path, view);
    let before = TABLES.map(|table| {
        let keys = if table == "fit" { "1, 2" } else { "1, 2, 3" };
        raw_rows(&path, &format!("SELECT * FROM {table} ORDER BY {keys}"))
    });
    let was_read = contents(&path);
    drop(Store::open(&path).unwrap());
    let store = Store::open_existing(&path).unwrap().unwrap();
    for (table, before) in std::iter::zip(TABLES, before) {
        assert!(before.len() > 3, "{table}");
        assert_eq!(published_rows(&store, table), before, "{table}");
    }
    let sql = "SELECT count(*) FROM fit WHERE json_extract(model, '$.k') IS NOT NULL";
    assert_eq!(raw_rows(&path, sql), [[Value::Integer(0)]]);
    assert_eq!(raw_rows(&path, view).len(), shown.len());
    assert_eq!(contents(&path), was_read);
    // This verifies the content hashes that the older program has stored.
    assert_eq!(problems(&path), [""; 0]);
}

/// The value of k in a fit of the last revision, by both copies; the one in the structure may be removed.
fn copies(path: &Path) -> [Option<f64>; 2] {
    let last = "revision_id = (SELECT max(id) FROM revision)";
    let row =
        format!("SELECT value FROM fit_parameter WHERE {last} AND fit = 'five' AND path = 'k'");
    let structure =
        format!("SELECT json_extract(model, '$.k') FROM fit WHERE {last} AND name = 'five'");
    [row, structure].map(|sql| match raw_rows(path, &sql)[0][0] {
        Value::Real(number) => Some(number),
        _ => None,
    })
}

const OTHER_STRUCTURE: &str = "UPDATE fit SET model = json_set(model, '$.k', 0.7)
    WHERE name = 'five' AND revision_id = (SELECT max(id) FROM revision);";
const OTHER_ROW: &str = "UPDATE fit_parameter SET value = 0.6
    WHERE fit = 'five' AND path = 'k' AND revision_id = (SELECT max(id) FROM revision);";

/// The problem of a revision with another content than its hash says.
const NOT_AS_STORED: &str = "ptfe@3: revision 3 of `ptfe` is not what was stored";

/// What is wrong with a file, a sentence each. Fits are not made again.
fn problems(path: &Path) -> Vec<String> {
    let store = Store::open_existing(path).unwrap().unwrap();
    let mut found = Vec::new();
    let check = StoreCheck {
        name: "matdb.sqlite",
        refit: Refit::None,
        report: &mut |problem| found.push(problem.to_string()),
        advance: &mut || (),
    };
    check.run(&store);
    found
}

/// What `matdb check --repair` does with a file, a sentence each.
fn repair(path: &Path) -> Vec<String> {
    let materials = builtin::all().unwrap();
    let Repair { mended, failed, .. } = Store::open(path).unwrap().repair(&materials).unwrap();
    assert_eq!(failed, [""; 0]);
    mended
}

#[test]
fn a_copy_that_nobody_read_and_that_disagrees_is_reported_and_removed_by_repair() {
    let whole = contents(&old_file("").1);
    let (_folder, path) = old_file(OTHER_STRUCTURE);
    drop(Store::open(&path).unwrap());
    assert_eq!(copies(&path), [Some(0.1), Some(0.7)], "nothing was chosen");
    assert_eq!(contents(&path), whole, "what was readable stays readable");
    let rows = "ptfe@3: its rows of `fit` are not those that its content gives";
    assert_eq!(problems(&path), [rows]);
    assert_eq!(repair(&path), ["`ptfe@3` was written anew"]);
    assert_eq!(copies(&path), [Some(0.1), None]);
    assert_eq!(contents(&path), whole);
    assert_eq!(problems(&path), [""; 0]);
}

#[test]
fn a_value_that_is_sound_only_in_the_structure_is_kept_and_comes_back_by_repair() {
    let whole = contents(&old_file("").1);
    let (folder, path) = old_file(OTHER_ROW);
    drop(Store::open(&path).unwrap());
    assert_eq!(copies(&path), [Some(0.6), Some(0.1)], "nothing was chosen");
    let message = refused(matdb(folder.path()).args(["show", "ptfe"]));
    assert!(message.contains("is damaged") && message.contains("check --repair"), "{message}");
    assert!(problems(&path).contains(&NOT_AS_STORED.to_owned()));
    let mended = repair(&path);
    assert!(
        mended.len() == 1 && mended[0].contains("with the values in `fit.model`"),
        "{mended:?}"
    );
    assert_eq!(copies(&path), [Some(0.1), None]);
    assert_eq!(contents(&path), whole);
    assert_eq!(problems(&path), [""; 0]);
}

#[test]
fn a_value_is_taken_from_the_structure_of_one_fit_and_from_the_row_of_another() {
    let whole = contents(&old_file("").1);
    let other_structure = OTHER_STRUCTURE.replace("'five'", "'stated'");
    let (_folder, path) = old_file(&[OTHER_ROW, &other_structure].concat());
    drop(Store::open(&path).unwrap());
    let mended = repair(&path);
    assert!(mended.len() == 1 && mended[0].contains("in `fit.model` of `five`:"), "{mended:?}");
    assert_eq!(contents(&path), whole);
    assert_eq!(problems(&path), [""; 0]);
}

#[test]
fn where_no_copy_is_what_was_stored_all_of_them_stay() {
    let (folder, path) = old_file(&[OTHER_ROW, OTHER_STRUCTURE].concat());
    repair(&path);
    let lists = "matdb.sqlite: what lists and searches say of `ptfe` is not what is stored";
    assert_eq!(problems(&path), [lists, NOT_AS_STORED]);
    assert_eq!(copies(&path), [Some(0.6), Some(0.7)]);
    matdb(folder.path()).args(["rm", "ptfe"]).assert().success();
}

#[test]
fn an_estimate_that_disagrees_with_the_content_is_derived_from_the_content() {
    let (_folder, path) = old_file("UPDATE fit_estimate SET value = 9, sd = 9, at_bound = 1");
    drop(Store::open(&path).unwrap());
    let count = "SELECT count(*) FROM fit_estimate WHERE value = 9 OR sd = 9";
    assert_eq!(raw_rows(&path, count), [[Value::Integer(0)]]);
    assert_eq!(problems(&path), [""; 0]);
}

#[test]
fn a_report_that_was_changed_is_not_what_was_stored() {
    for change in [
        "'$.estimates[0].sd', -1",
        "'$.estimates[0].interval_95[0]', 9",
        "'$.estimates[0].value', 9",
    ] {
        let (_folder, path) = old_file("");
        drop(Store::open(&path).unwrap());
        let sql =
            format!("UPDATE fit SET report = json_set(report, {change}) WHERE name = 'lobes'");
        Connection::open(&path).unwrap().execute_batch(&sql).unwrap();
        assert_eq!(problems(&path), [NOT_AS_STORED], "{change}");
    }
}

#[test]
fn a_parameter_without_a_value_is_damage_and_a_built_in_material_has_it_again() {
    let (folder, path) = old_file("");
    drop(Store::open(&path).unwrap());
    let lose = "PRAGMA foreign_keys = off; DELETE FROM fit_parameter WHERE path = 'k'";
    Connection::open(&path).unwrap().execute_batch(lose).unwrap();
    let message = refused(matdb(folder.path()).args(["show", "ptfe"]));
    assert!(message.contains("lost the value of its parameter `k`"), "{message}");
    assert_eq!(repair(&path), ["`ptfe@1` was written anew"]);
    let store = Store::open_existing(&path).unwrap().unwrap();
    let ptfe = builtin::get("ptfe").unwrap().unwrap();
    assert_eq!(store.get(&ptfe.slug, Some(1)).unwrap().unwrap().material, ptfe);
    assert!(store.get(&ptfe.slug, None).is_err());
}
