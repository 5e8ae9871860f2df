//! Promise: `docs/levels.md` has the peak of each built-in material as this program renders it, and a change from 0.1.0 that
//! follows from its class. No material returns more than was sent.

use std::collections::BTreeSet;
use std::fs;

use crate::support::{entries, matdb, root};
use serde_json::Value;

/// Of two rounded numbers, dB.
const ROUNDING_DB: f64 = 0.0051;

/// P_t·L of the preset, dBm.
const SENT_DBM: f64 = 7.0 - 12.5;

/// A row of the table of materials.
struct Row<'a> {
    material: &'a str,
    before_dbm: f64,
    after_dbm: f64,
    change_db: f64,
    class: &'a str,
}

fn number(cell: &str) -> f64 {
    cell.replace('−', "-").parse().unwrap()
}

fn rows(page: &str) -> Vec<Row<'_>> {
    let lines = page.lines().filter(|line| line.starts_with("| `"));
    let cells = lines.map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    cells
        .map(|cells| Row {
            material: cells[1].trim_matches('`'),
            before_dbm: number(cells[2]),
            after_dbm: number(cells[3]),
            change_db: number(cells[4]),
            class: cells[5],
        })
        .collect()
}

/// Whether a law, or a part of it, has a key, or is one of these models.
fn any(law: &Value, is_it: fn(&Value) -> bool) -> bool {
    let parts = ["specular", "diffuse"].into_iter().filter_map(|part| law.get(part));
    is_it(law) || parts.into_iter().any(|part| any(part, is_it))
}

fn is_mirror(law: &Value) -> bool {
    (law["model"] == "fresnel" || law["model"] == "layered") && law.get("lobe_rad").is_none()
}

fn has_lobe(law: &Value) -> bool {
    law["model"] == "cook-torrance" || law.get("lobe_rad").is_some()
}

/// Materials that 0.1.0 did not have.
const NEW: [&str; 1] = ["pvdf"];

#[test]
fn the_page_has_the_levels_of_all_materials() {
    let page = fs::read_to_string(root().join("docs/levels.md")).unwrap();
    let rows = rows(&page);
    let named: BTreeSet<String> = rows.iter().map(|row| row.material.to_owned()).collect();
    let mut both_have = BTreeSet::from_iter(entries(&root().join("materials")));
    NEW.iter().for_each(|new| assert!(both_have.remove(*new), "{new}"));
    assert_eq!(named, both_have);
    let scene = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut counts = [0; 3];
    for Row { material, before_dbm, after_dbm, change_db, class } in rows {
        fs::write(at.join("one.toml"), scene.replace("MATERIAL", material)).unwrap();
        matdb(at).args(["render", "-q", "one.toml", "-o", "out"]).assert().success();
        let record: Value =
            serde_json::from_slice(&fs::read(at.join("out/scan.json")).unwrap()).unwrap();
        let found_dbm = record["power_dbm"]["strongest"].as_f64().unwrap();
        assert!((found_dbm - after_dbm).abs() < ROUNDING_DB, "{material}: {found_dbm} dBm");
        assert!(found_dbm <= SENT_DBM, "{material}: {found_dbm} dBm");
        let law = &record["materials"][0]["scattering"];
        // A lobe of 0.02 rad became that of the beam; what is seen of the others is as before.
        let (expected, place, expected_db) = if any(law, is_mirror) {
            ("mirror", 0, 4.652)
        } else if any(law, has_lobe) {
            ("lobe", 1, -0.002)
        } else {
            ("diffuse", 2, -0.002)
        };
        counts[place] += 1;
        assert_eq!(class, expected, "{material}");
        assert!((change_db - expected_db).abs() < ROUNDING_DB, "{material}: {change_db}");
        assert!((after_dbm - before_dbm - expected_db).abs() < 2.0 * ROUNDING_DB, "{material}");
    }
    for (class, count) in std::iter::zip(["mirror", "lobe", "diffuse"], counts) {
        assert!(page.contains(&format!("| {class} | {count} |")), "{class}: {count}");
    }
}
