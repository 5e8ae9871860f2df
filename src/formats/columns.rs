//! Other people's names of columns.

use std::fmt;
use std::str::FromStr;

use super::error::FormatError;
use super::text::nearest;

/// Our names for the columns of a file, as in `X=x_m,Intensity=power_dbm`; `-` for one that is to be passed over, which
/// then has no name.
///
/// ```
/// use matdb::formats::ColumnNames;
/// let names: ColumnNames = "X=x_m,Time=-".parse()?;
/// let mut columns = ["X", "Time"].map(str::to_owned);
/// names.apply(&mut columns)?;
/// assert_eq!(columns[0], "x_m");
/// assert!("X".parse::<ColumnNames>().is_err());
/// # Ok::<(), matdb::formats::FormatError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColumnNames {
    /// Theirs and ours.
    pairs: Vec<(String, String)>,
}

impl FromStr for ColumnNames {
    type Err = FormatError;

    fn from_str(text: &str) -> Result<ColumnNames, FormatError> {
        let pairs = text.split(',').map(|pair| match pair.rsplit_once('=') {
            Some((theirs, ours)) if !theirs.trim().is_empty() && !ours.trim().is_empty() => {
                Ok((theirs.trim().to_owned(), ours.trim().to_owned()))
            }
            _ => Err(FormatError::at(
                format!("`{pair}`"),
                "this does not say which column gets which name",
                "write THEIRS=OURS, as in X=x_m,Intensity=power_dbm",
            )),
        });
        Ok(ColumnNames { pairs: pairs.collect::<Result<_, _>>()? })
    }
}

impl fmt::Display for ColumnNames {
    /// As it is given.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pairs: Vec<String> =
            self.pairs.iter().map(|(theirs, ours)| format!("{theirs}={ours}")).collect();
        f.write_str(&pairs.join(","))
    }
}

impl ColumnNames {
    /// Gives the columns their new names.
    ///
    /// # Errors
    /// A name of no column, or a column that gets two.
    pub fn apply(&self, columns: &mut [String]) -> Result<(), FormatError> {
        let given = columns.to_vec();
        for (at, (theirs, ours)) in self.pairs.iter().enumerate() {
            if self.pairs[..at].iter().any(|(earlier, _)| earlier == theirs) {
                let problem = format!("the column `{theirs}` gets two names");
                return Err(FormatError::at("the columns", problem, "give it one"));
            }
            let named: Vec<usize> = (0..given.len()).filter(|&at| given[at] == *theirs).collect();
            if ours == PASSED_OVER && !named.is_empty() {
                named.iter().for_each(|&at| columns[at].clear());
                continue;
            }
            let &[only] = named.as_slice() else {
                let problem = match named.len() {
                    0 => format!("there is no column `{theirs}`"),
                    _ => format!("column `{theirs}` is there twice"),
                };
                return Err(FormatError::at("the columns", problem, among(&given, theirs)));
            };
            columns[only] = ours.clone();
        }
        Ok(())
    }
}

/// Our name for a column that is passed over.
const PASSED_OVER: &str = "-";

/// The columns of a file, and the one that was perhaps meant.
fn among(columns: &[String], meant: &str) -> String {
    let all = format!("the columns are {}", columns.join(", "));
    match nearest(meant, columns.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`? {all}"),
        None => all,
    }
}

/// The first name that two columns have.
pub fn twice(columns: &[String]) -> Option<&str> {
    let mut named = columns.iter().enumerate().filter(|(_, name)| !name.is_empty());
    named.find(|(at, name)| columns[..*at].contains(name)).map(|(_, name)| name.as_str())
}

/// A sentence on columns of which nothing is read; of one that looks like a slip, it says what was perhaps meant.
pub fn passed_over(unknown: &[&str], known: &[&str]) -> Option<String> {
    let words: Vec<String> = unknown
        .iter()
        .map(|column| match nearest(column, known.iter().copied()) {
            Some(near) => format!("{column} (did you mean {near}?)"),
            None => (*column).to_owned(),
        })
        .collect();
    (!words.is_empty()).then(|| format!("these columns are passed over: {}", words.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn renamed(names: &str) -> Result<Vec<String>, String> {
        let mut columns = ["X", "Y", "Intensity", "Y"].map(str::to_owned);
        let names: Result<ColumnNames, FormatError> = names.parse();
        let applied = names.and_then(|names| names.apply(&mut columns));
        applied.map(|()| columns.to_vec()).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_get_our_names() {
        assert_eq!(renamed("X=x_m, Intensity=power_dbm").unwrap()[..3], ["x_m", "Y", "power_dbm"]);
        assert_eq!(renamed("X=Y,Intensity=X").unwrap()[..3], ["Y", "Y", "X"], "all at once");
        assert_eq!(renamed("X=-").unwrap()[0], "");
        let names: ColumnNames = "X=x_m, Y=-".parse().unwrap();
        assert_eq!(names.to_string(), "X=x_m,Y=-");
    }

    #[test]
    fn what_names_no_column_is_refused() {
        for (names, said) in [
            ("X", "`X`: this does not say which column gets which name; write THEIRS=OURS"),
            ("=x_m", "`=x_m`: this does not"),
            ("X=", "`X=`: this does not"),
            ("", "``: this does not"),
            ("Z=z_m", "there is no column `Z`; the columns are X, Y, Intensity, Y"),
            ("Intensiti=power", "there is no column `Intensiti`; did you mean `Intensity`?"),
            ("Y=y_m", "column `Y` is there twice"),
            ("X=x_m,X=y_m", "the column `X` gets two names"),
        ] {
            let error = renamed(names).unwrap_err();
            assert!(error.contains(said), "{names}: {error}");
        }
    }

    #[test]
    fn a_slip_is_named() {
        let known = ["theta_deg", "sigma0_db"];
        assert_eq!(passed_over(&[], &known), None);
        let said = passed_over(&["time", "sigma_db"], &known).unwrap();
        assert_eq!(said, "these columns are passed over: time, sigma_db (did you mean sigma0_db?)");
    }
}
