//! What is concluded from curves that others measured, and what is not: the table of `docs/real-curves.md`.
//!
//! The data are not part of the repository. The folder `../shared/data` or the one that `MATDB_REAL_CURVES` names holds
//! them; the page says where each is published. Without it the tests say that they are skipped.
//! A test that fails prints the lines that the page lacks.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::support::matdb;

/// A row of a CSV file by column.
type Record = BTreeMap<String, String>;

/// The folder of one set, if it is there.
fn data(set: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let all = std::env::var_os("MATDB_REAL_CURVES").map_or(beside, PathBuf::from);
    let folder = all.join(set);
    if folder.exists() {
        return Some(folder);
    }
    println!("skipped: {} is absent; MATDB_REAL_CURVES names another folder", folder.display());
    None
}

fn records(path: &Path) -> Vec<Record> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn real(record: &Record, column: &str) -> f64 {
    record[column].parse().unwrap()
}

/// Tables by name.
type Tables = BTreeMap<String, String>;

fn push(tables: &mut Tables, name: String, header: &str, row: &[f64]) {
    let table = tables.entry(name).or_insert_with(|| format!("{header}\n"));
    let cells: Vec<String> = row.iter().map(f64::to_string).collect();
    *table += &format!("{}\n", cells.join(","));
}

/// σ⁰ of the sea over grazing angle, one curve each polarisation, sea state and frequency with five angles or more.
fn sea(folder: &Path) -> Tables {
    let mut tables = Tables::new();
    for record in records(&folder.join("nathanson_sigma0.csv")) {
        let name = format!(
            "sea-{}-{}-{}-ghz",
            record["polarisation"].to_lowercase(),
            record["sea_state"],
            record["frequency_ghz"]
        );
        let row = ["grazing_deg", "sigma0_db"].map(|column| real(&record, column));
        push(&mut tables, name, "grazing_deg,sigma0_db", &row);
    }
    tables.retain(|_, table| table.lines().count() > 5);
    tables
}

/// The plane of incidence of sintered PTFE at each wavelength.
fn ptfe(folder: &Path) -> Tables {
    let mut tables = Tables::new();
    for record in records(&folder.join("PTFE.data.csv")) {
        let [i, s, turn, f] =
            ["thetai", "thetar", "phir", "f_r11"].map(|column| real(&record, column));
        let out = match turn.abs() {
            turn if turn < 0.5 => s,
            turn if (turn - 180.0).abs() < 0.5 => -s,
            _ => continue,
        };
        let name = format!("ptfe-{}-um", record["lambda"]);
        push(&mut tables, name, "theta_i_deg,theta_s_deg,brdf_per_sr", &[-i, out, f]);
    }
    tables
}

/// The plane of incidence of black coatings, with the blank beside each reading and the repeats one below the other.
fn coatings(folder: &Path) -> Tables {
    let place = |r: &Record| ["scan", "incidence_deg", "receive_deg"].map(|key| r[key].clone());
    let in_plane = |r: &Record| r["azimuth_deg"] == "-90";
    let mut blanks: BTreeMap<[String; 3], Vec<f64>> = BTreeMap::new();
    for record in records(&folder.join("blanks.csv")).iter().filter(|r| in_plane(r)) {
        blanks.entry(place(record)).or_default().push(real(record, "rt"));
    }
    let mut tables = Tables::new();
    for record in records(&folder.join("samples.csv")).iter().filter(|r| in_plane(r)) {
        let [i, s, rt] = ["incidence_deg", "receive_deg", "rt"].map(|column| real(record, column));
        let blank =
            blanks.get(&place(record)).map_or(0.0, |b| b.iter().sum::<f64>() / b.len() as f64);
        let f = (rt - blank) / (PI * s.to_radians().cos());
        // The detector stands in the beam there; below is stray light.
        if (i + s).abs() > 4.9 && f > 1e-3 {
            let name = record["sample"].clone();
            push(&mut tables, name, "theta_i_deg,theta_s_deg,brdf_per_sr", &[i, s, f]);
        }
    }
    tables
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    matdb(folder).args(arguments).output().unwrap()
}

fn answer(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or(Value::Null)
}

/// What is said of a curve.
struct Said {
    name: String,
    rows: usize,
    /// The diagnosis, as `--json` prints it.
    diagnosis: Value,
    /// Names of the findings of a fit.
    findings: Vec<String>,
}

impl Said {
    fn of(folder: &Path, name: &str, file: &str, rows: usize, noise_db: Option<&str>) -> Said {
        let mut arguments = vec!["diagnose", "--curve", file, "-o", "out", "--json", "-q"];
        arguments.extend(noise_db.iter().flat_map(|db| ["--noise-db", db]));
        let diagnosis = answer(&run(folder, &arguments));
        let fit = answer(&run(folder, &["fit", file, "--json", "-q"]));
        Said { name: name.to_owned(), rows, diagnosis, findings: texts(&fit["verdict"], "finding") }
    }

    fn verdict(&self) -> &str {
        self.diagnosis["verdict"].as_str().unwrap_or("no answer")
    }

    fn names(&self) -> Vec<String> {
        texts(&self.diagnosis["effects"], "name")
    }

    /// Errors of the law alone on held-out angles, and the noise, dB.
    fn errors_db(&self) -> [f64; 2] {
        let error = &self.diagnosis["error"];
        [&error["before"]["rmse_db"], &error["noise_floor_db"]]
            .map(|db| db.as_f64().unwrap_or(f64::NAN))
    }

    /// The law alone of those that were tried which fits best, and the rms that it leaves, dB.
    fn best_law(&self) -> (String, f64) {
        let laws = self.diagnosis["laws"].as_array().into_iter().flatten();
        let laws = laws
            .map(|law| (law["name"].as_str().unwrap().to_owned(), law["rms_db"].as_f64().unwrap()));
        laws.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(("–".to_owned(), f64::NAN))
    }

    /// The curve as a line of the page.
    fn line(&self) -> String {
        let [error_db, noise_db] = self.errors_db();
        let (law, left_db) = self.best_law();
        let law = if law == "declared" { "one GGX lobe over Lambert".to_owned() } else { law };
        let may_be: Vec<&str> = self.diagnosis["may_be"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .collect();
        let may_be = if may_be.is_empty() { "–".to_owned() } else { may_be.join(", ") };
        let Said { name, rows, .. } = self;
        format!(
            "| `{name}` | {rows} | {error_db:.2} | {noise_db:.2} | {law} | {left_db:.2} | `{}` | {may_be} |\n",
            self.verdict()
        )
    }

    /// Fails unless structure is found that no law and no effect explains.
    fn assert_unexplained(&self) {
        let (name, [error_db, noise_db]) = (&self.name, self.errors_db());
        assert_eq!((self.verdict(), self.names().len()), ("unexplained", 0), "{name}");
        assert!(error_db > 2.0 * noise_db, "{name}: {error_db} dB, noise {noise_db} dB");
        for unknown in self.diagnosis["unexplained"].as_array().unwrap() {
            assert!(unknown["strength_db"].as_f64().unwrap() > noise_db, "{name}: {unknown}");
        }
    }
}

/// A text of each entry of a list.
fn texts(list: &Value, key: &str) -> Vec<String> {
    let all = list.as_array().into_iter().flatten();
    all.map(|one| one[key].as_str().unwrap().to_owned()).collect()
}

/// Every curve of a set, asked with this noise.
fn all_of(tables: &Tables, noise_db: Option<&str>) -> Vec<Said> {
    let folder = tempfile::tempdir().unwrap();
    let mut all = Vec::new();
    for (name, table) in tables {
        let file = format!("{name}.csv");
        fs::write(folder.path().join(&file), table).unwrap();
        all.push(Said::of(folder.path(), name, &file, table.lines().count() - 1, noise_db));
    }
    all
}

#[test]
fn of_seven_averages_of_the_sea_nothing_is_concluded() {
    let Some(data) = data("nrl-sea-clutter") else { return };
    let said = all_of(&sea(&data), None);
    assert!(said.len() > 60, "{}", said.len());
    for one in &said {
        let name = &one.name;
        assert_eq!((one.verdict(), one.names().len()), ("cannot-tell", 0), "{name}");
        // A fit refuses five averages, and says of more that they are too few.
        let doubts = one.findings.iter().any(|finding| finding == "few-rows");
        assert_eq!(doubts, one.rows > 5, "{name}: {:?}", one.findings);
    }
    let few = said.iter().filter(|one| one.rows > 5).count();
    hold(&format!(
        "Of all {} curves `diagnose` says `cannot-tell`. `fit` refuses the {} of five angles, and says `few-rows` of the other {few}.",
        said.len(),
        said.len() - few
    ));
}

#[test]
fn a_small_error_of_the_law_of_ptfe_is_no_noise() {
    let Some(data) = data("nist-ptfe-brdf") else { return };
    let said = all_of(&ptfe(&data), Some("0.05"));
    assert_eq!(said.len(), 4);
    said.iter().for_each(Said::assert_unexplained);
    hold(&said.iter().map(Said::line).collect::<String>());
}

#[test]
fn no_effect_of_measured_coatings_has_a_name() {
    /// What the provenance of the data says that one lobe and Lambert leave, dB, with room.
    const LEFT_DB: [f64; 2] = [0.4, 2.0];
    let Some(data) = data("ua-loft-black-coatings") else { return };
    let mut said = all_of(&coatings(&data), None);
    assert_eq!(said.len(), 4);
    for one in &said {
        let [error_db, noise_db] = one.errors_db();
        assert!((LEFT_DB[0]..LEFT_DB[1]).contains(&error_db), "{}: {error_db}", one.name);
        assert!((0.05..0.3).contains(&noise_db), "{}: {noise_db}", one.name);
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["AnoBlackEC1onAlum", "AnoBlackEC2onAlum", "AnoBlackNiTEonSteel"] {
        let file = data.join(format!("{name}.bsdf"));
        said.push(Said::of(
            folder.path(),
            &format!("{name}.bsdf"),
            file.to_str().unwrap(),
            71,
            None,
        ));
    }
    said.iter().for_each(Said::assert_unexplained);
    hold(&said.iter().map(Said::line).collect::<String>());
}

/// Fails unless the page of the book has this text.
fn hold(text: &str) {
    let page =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/real-curves.md"));
    assert!(page.unwrap().contains(text), "docs/real-curves.md lacks\n{text}");
}
