//! Text tables.

pub(super) use crate::formats::words::{counted, grouped};

/// Columns padded to their widest cell, under a header; numbers to the right.
pub(super) fn table<const N: usize>(
    header: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    let mut lines = vec![header.map(str::to_owned)];
    // A line break in a cell would pass for a row.
    lines.extend(rows.map(|row| row.map(|cell| cell.replace(char::is_control, " "))));
    let mut widths = [0; N];
    let mut is_right = [lines.len() > 1; N];
    for (number, cells) in lines.iter().enumerate() {
        for (column, cell) in cells.iter().enumerate() {
            widths[column] = widths[column].max(cell.chars().count());
            is_right[column] &= number == 0 || is_number(cell);
        }
    }
    let mut text = String::new();
    for cells in &lines {
        let mut line = Vec::new();
        for (column, cell) in cells.iter().enumerate() {
            let padding = " ".repeat(widths[column] - cell.chars().count());
            line.push(if is_right[column] { padding + cell } else { cell.clone() + &padding });
        }
        text += line.join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// Whether a cell goes to the right.
fn is_number(cell: &str) -> bool {
    !cell.is_empty() && cell.chars().all(|c| c.is_ascii_digit() || " .-–%°".contains(c))
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
