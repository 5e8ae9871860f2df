//! Changes of single keys of a scene file: `radar.speckle.looks=4`.
//!
//! Tables in lists have a name in the place of a number: `mesh.NAME.key`, `region.NAME.key`, `receiver.NAME.key`,
//! `effect.NAME.key`, `radar.effect.NAME.key`.

use std::fmt;
use std::str::FromStr;

use toml::{Table, Value};

use super::file::SceneFile;
use crate::formats::FormatError;
use crate::formats::text::{from_toml, nearest};

/// A key of a scene file and its new value.
///
/// ```
/// use matdb::scene::{KeyChange, SceneFile};
/// let text = "[[mesh]]\nname = \"body\"\nfile = \"builtin:mannequin\"";
/// let changes = ["seed=7", "mesh.body.file=builtin:sphere"].map(|text| text.parse::<KeyChange>().unwrap());
/// let file = SceneFile::parse_changed(text, &changes)?;
/// assert_eq!((file.seed, file.mesh[0].file.as_str()), (7, "builtin:sphere"));
/// # Ok::<(), matdb::formats::FormatError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct KeyChange {
    key: String,
    /// The names of the tables around the key.
    tables: Vec<String>,
    /// The key within the innermost of them.
    last: String,
    value: Value,
}

impl KeyChange {
    /// A change of a key with its tables, as in `radar.speckle.looks`. A name with dots or spaces stands in quotes.
    ///
    /// # Errors
    /// When it is not a key of TOML.
    pub fn new(key: &str, value: impl Into<Value>) -> Result<KeyChange, FormatError> {
        let refused = || {
            let way_out =
                "write it as in radar.speckle.looks, a name with dots or spaces in quotes";
            FormatError::at(key, "is not a key", way_out)
        };
        let mut table: Table = format!("{key} = 0").parse().map_err(|_| refused())?;
        let mut tables = Vec::new();
        loop {
            let mut parts = std::mem::take(&mut table).into_iter();
            match (parts.next(), parts.next()) {
                (Some((part, Value::Table(inner))), None) => {
                    tables.push(part);
                    table = inner;
                }
                (Some((last, Value::Integer(0))), None) => {
                    let value = value.into();
                    return Ok(KeyChange { key: key.trim().to_owned(), tables, last, value });
                }
                _ => return Err(refused()),
            }
        }
    }

    /// The names of its tables and its own, which all spellings of a key have in common.
    pub fn path(&self) -> Vec<String> {
        self.tables.iter().chain([&self.last]).cloned().collect()
    }

    /// Makes the change in a scene file's document.
    fn apply(&self, file: &mut Table) -> Result<(), FormatError> {
        let (mut table, mut passed) = (file, 0);
        while let Some(outer) = self.tables.get(passed) {
            table = if is_list(&self.tables[..=passed]) {
                let name = self.tables.get(passed + 1).ok_or_else(|| {
                    let way_out = format!("write it as {outer}.NAME.KEY");
                    self.refused(format!("names no key of one {outer}"), way_out)
                })?;
                passed += 2;
                self.named(table, outer, name)?
            } else {
                passed += 1;
                let inner = table.entry(outer).or_insert_with(|| Table::new().into());
                inner.as_table_mut().ok_or_else(|| {
                    self.refused(format!("`{outer}` is not a table"), "change it as a whole")
                })?
            };
        }
        table.insert(self.last.clone(), self.value.clone());
        Ok(())
    }

    /// The table of this name in a list. An effect that is not there is added.
    fn named<'a>(
        &self,
        table: &'a mut Table,
        list: &str,
        name: &str,
    ) -> Result<&'a mut Table, FormatError> {
        let entries = table.entry(list).or_insert_with(|| Value::Array(Vec::new()));
        let entries = entries.as_array_mut().ok_or_else(|| {
            self.refused(format!("`{list}` is not a list"), format!("write it as [[{list}]]"))
        })?;
        let names: Vec<&str> = entries.iter().filter_map(name_of).collect();
        if !names.contains(&name) {
            if list != "effect" {
                let near = nearest(name, names.iter().copied());
                let near = near.map_or(String::new(), |near| format!("did you mean `{near}`? "));
                let way_out = match names[..] {
                    [] => "the scene has none".to_owned(),
                    _ => format!("{near}there are: {}", names.join(", ")),
                };
                return Err(self.refused(format!("there is no {list} `{name}`"), way_out));
            }
            entries.push(Table::from_iter([("name".to_owned(), name.into())]).into());
        }
        let entry = entries.iter_mut().find(|entry| name_of(entry) == Some(name));
        entry.and_then(Value::as_table_mut).ok_or_else(|| {
            self.refused(format!("{list} `{name}` is not a table"), "mend the scene file")
        })
    }

    fn refused(&self, problem: impl Into<String>, way_out: impl Into<String>) -> FormatError {
        FormatError::at(&self.key, problem, way_out)
    }
}

/// Whether tables of this path are a list, whose members have names.
fn is_list(path: &[String]) -> bool {
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    matches!(path[..], ["mesh" | "region" | "receiver" | "effect"] | ["radar", "effect"])
}

fn name_of(entry: &Value) -> Option<&str> {
    entry.get("name").and_then(Value::as_str)
}

impl FromStr for KeyChange {
    type Err = FormatError;

    /// Reads `KEY=VALUE`. The value is one of TOML; a word that is none is a string.
    fn from_str(text: &str) -> Result<KeyChange, FormatError> {
        let refused = |problem: &str, way_out: &str| Err(FormatError::at(text, problem, way_out));
        let Some((key, value)) = text.split_once('=') else {
            return refused("has no value", "write KEY=VALUE, as in radar.speckle.looks=4");
        };
        let value = value.trim();
        match value.parse::<Value>() {
            Ok(value) => KeyChange::new(key, value),
            Err(_) if value.is_empty() => refused("has no value", "write \"\" for an empty text"),
            Err(_) if value.starts_with(['[', '{', '"', '\'']) => {
                refused("has no value of TOML", "close its brackets and quotes")
            }
            Err(_) => KeyChange::new(key, value),
        }
    }
}

impl fmt::Display for KeyChange {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}", self.key, self.value)
    }
}

/// Makes changes, one after the other, in the document of a scene file. Tables that are not there are added.
///
/// # Errors
/// A mesh, region or receiver that is not there, and a key in what is not a table.
pub fn apply(file: &mut Table, changes: &[KeyChange]) -> Result<(), FormatError> {
    changes.iter().try_for_each(|change| change.apply(file))
}

impl SceneFile {
    /// Reads a scene file's text and changes keys of it. Values are checked when the scene is loaded.
    ///
    /// # Errors
    /// As [`SceneFile::parse`] and [`apply`].
    pub fn parse_changed(text: &str, changes: &[KeyChange]) -> Result<SceneFile, FormatError> {
        let given = SceneFile::parse(text)?;
        if changes.is_empty() {
            return Ok(given);
        }
        let mut table = from_toml(text)?;
        apply(&mut table, changes)?;
        SceneFile::parse(&table.to_string()).map_err(|error| match error {
            // The line would be one of a text that nobody has seen.
            FormatError::Malformed { problem, way_out, .. } => {
                FormatError::at("the changed scene", problem, way_out)
            }
            error => error,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "
        [radar]
        threshold_dbm = -80
        [[mesh]]
        name = \"body\"
        file = \"builtin:mannequin\"
        [[mesh]]
        name = \"left arm\"
        file = \"builtin:cuboid\"
        [[region]]
        name = \"skin\"
        material = \"mannequin-paint\"
        [[effect]]
        name = \"pose\"
        rotation_y_deg = 1.0
    ";

    fn changed(changes: &[&str]) -> Result<SceneFile, FormatError> {
        let changes: Vec<KeyChange> =
            changes.iter().map(|change| change.parse()).collect::<Result<_, _>>()?;
        SceneFile::parse_changed(TEXT, &changes)
    }

    fn refused(change: &str) -> String {
        changed(&[change]).unwrap_err().to_string()
    }

    #[test]
    fn keys_change_wherever_they_are() {
        let file = changed(&[
            "seed=7",
            "radar.threshold_dbm=-70",
            "radar.speckle.looks=4",
            "bounce.rays = 16",
            "mesh.body.rotation_deg=[0, 20, 0]",
            "mesh.\"left arm\".scale=2.5",
            "region.skin.material=human-skin@2",
            "effect.pose.rotation_y_deg=3",
            "effect.motion.z_m=1.5",
            "radar.effect.drift.slope_db=2",
            "seed=8",
        ])
        .unwrap();
        assert_eq!((file.seed, file.radar.threshold_dbm), (8, -70.0));
        assert_eq!(file.radar.speckle.map(|speckle| speckle.looks), Some(4.0));
        assert_eq!(file.bounce.map(|bounce| bounce.rays), Some(16));
        assert_eq!(file.mesh[0].rotation_deg, [0.0, 20.0, 0.0]);
        assert_eq!(file.mesh[1].scale, 2.5);
        assert_eq!(file.region[0].material, "human-skin@2");
        let effects = [&file.effect[0], &file.effect[1], &file.radar.effect[0]];
        assert_eq!(effects.map(|effect| effect.name.as_str()), ["pose", "motion", "drift"]);
        assert_eq!(effects.map(|effect| effect.parameters.values().sum::<f64>()), [3.0, 1.5, 2.0]);
        assert_eq!(file.mesh.len() + file.region.len() + file.effect.len(), 5);
    }

    #[test]
    fn without_a_change_the_file_is_that_of_the_text() {
        assert_eq!(changed(&[]).unwrap(), SceneFile::parse(TEXT).unwrap());
        assert_eq!(changed(&["radar.threshold_dbm=-80"]).unwrap(), SceneFile::parse(TEXT).unwrap());
    }

    #[test]
    fn what_is_no_change_is_refused_with_a_way_out() {
        for (change, problem, way_out) in [
            ("seed", "has no value", "KEY=VALUE"),
            ("name=", "has no value", "\"\""),
            ("mesh.body.scale=[1", "no value of TOML", "close its brackets"),
            ("mesh..scale=1", "is not a key", "in quotes"),
            (
                "mesh.bodi.scale=1",
                "there is no mesh `bodi`",
                "did you mean `body`? there are: body, left arm",
            ),
            ("receiver.left.aperture_m2=1", "there is no receiver `left`", "has none"),
            ("mesh.body=1", "names no key of one mesh", "mesh.NAME.KEY"),
            ("radar.threshold_dbm.x=1", "`threshold_dbm` is not a table", "as a whole"),
            ("radar.speckle.lookz=4", "unknown key `lookz`", "did you mean `looks`?"),
            ("radar.threshold_dbm=low", "invalid type: string \"low\", expected a number", ""),
        ] {
            let error = refused(change);
            assert!(error.contains(problem) && error.contains(way_out), "{error}");
        }
        let shown = "mesh.body.file=\"a b.ply\"".parse::<KeyChange>().unwrap().to_string();
        assert_eq!(shown, "mesh.body.file=\"a b.ply\"");
    }
}
