//! The unit of every numeric column, as UCUM code, by the ending of its name. The table `unit` of the database holds
//! the same units (`tests/publish_command.rs` compares them).

/// Endings of names and their units.
pub(super) const ENDINGS: [(&str, &str); 8] = [
    ("_hz", "Hz"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_w", "W"),
    ("_k", "K"),
    ("_db", "dB"),
    ("_deg", "deg"),
    ("_s", "s"),
];

/// Names that have a unit without an ending for it.
const WHOLE: [(&str, &str); 1] = [("year", "a")];

/// Columns whose unit is in another column of the same row.
const BY_ROW: [(&str, &str, &str); 8] = [
    ("fit_parameter", "value", "the column `unit`"),
    ("fit_parameter", "sd", "the column `unit`"),
    ("fit_estimate", "value", "the column `unit`"),
    ("fit_estimate", "sd", "the column `unit`"),
    ("fit_estimate", "low_95", "the column `unit`"),
    ("fit_estimate", "high_95", "the column `unit`"),
    ("fit_covariance", "covariance", "the product of the units of `row_path` and `column_path`"),
    ("effect_parameter", "value", "the ending of the column `name`"),
];

/// UCUM code of a numeric column; `1` for a pure number. `Err` names the place of the unit where it differs from
/// row to row.
pub(super) fn unit(table: &str, column: &str) -> Result<&'static str, &'static str> {
    if let Some((.., place)) = BY_ROW.iter().find(|known| (known.0, known.1) == (table, column)) {
        return Err(place);
    }
    if let Some((_, unit)) = WHOLE.iter().find(|(name, _)| *name == column) {
        return Ok(unit);
    }
    let ending = ENDINGS.iter().find(|(ending, _)| column.ends_with(ending));
    Ok(ending.map_or("1", |(_, unit)| unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_the_unit_or_where_it_stands() {
        assert_eq!(unit("observation", "theta_i_rad"), Ok("rad"));
        assert_eq!(unit("observation", "sigma0"), Ok("1"));
        assert_eq!(unit("instrument", "bandwidth_hz"), Ok("Hz"));
        assert!(unit("fit_parameter", "value").unwrap_err().contains("`unit`"));
    }
}
