//! Text tables.

pub(super) use crate::formats::words::{counted, grouped};

/// Columns padded to their widest cell, under a header; numbers to the right.
pub(super) fn table<const N: usize>(
    header: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    // A line break in a cell would pass for a row.
    let on_one_line = |cell: String| cell.replace(char::is_control, " ");
    let mut lines = vec![header.map(str::to_owned)];
    lines.extend(rows.map(|row| row.map(on_one_line)));
    let widths: Vec<usize> = (0..N)
        .map(|column| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0))
        .collect();
    let is_number = |text: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_ascii_digit() || " .-–%°".contains(c))
    };
    let right: Vec<bool> = (0..N)
        .map(|column| lines.len() > 1 && lines[1..].iter().all(|line| is_number(&line[column])))
        .collect();
    let cell = |column: usize, text: &str| {
        let padding = " ".repeat(widths[column] - text.chars().count());
        if right[column] { padding + text } else { text.to_owned() + &padding }
    };
    let line = |cells: &[String; N]| {
        let cells: Vec<String> = (0..N).map(|column| cell(column, &cells[column])).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    lines.iter().map(line).collect()
}

/// A cell of a table with the status of its material, which is left out while it is active.
pub(super) fn with_status(cell: &str, status: &str) -> String {
    match status {
        "active" => cell.to_owned(),
        status => format!("{cell}, {status}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_makes_a_row() {
        assert_eq!(table(&["a"], [["x\ny".to_owned()]].into_iter()), "a\nx y\n");
    }

    #[test]
    fn numbers_are_aligned() {
        let rows = [["a", "5"], ["bcd", "1 000"]].map(|row| row.map(str::to_owned));
        let text = table(&["name", "n"], rows.into_iter());
        assert_eq!(text, "name      n\na         5\nbcd   1 000\n");
    }
}
