//! Text tables.

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

/// A whole number with thin groups of three: `18 529`.
pub(super) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (position, digit) in digits.chars().enumerate() {
        if position > 0 && (digits.len() - position).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A number of things that end in `s`: `1 revision`, `18 529 revisions`.
pub(super) fn counted(number: usize, thing: &str) -> String {
    format!("{} {thing}{}", grouped(number), if number == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_no_things() {
        let said = [0, 1, 2000].map(|number| counted(number, "fit"));
        assert_eq!(said, ["0 fits", "1 fit", "2 000 fits"]);
    }

    #[test]
    fn no_cell_makes_a_row() {
        assert_eq!(table(&["a"], [["x\ny".to_owned()]].into_iter()), "a\nx y\n");
    }

    #[test]
    fn numbers_are_grouped_and_aligned() {
        assert_eq!(
            ["1", "999", "1 000", "18 529", "1 234 567"],
            [1, 999, 1000, 18_529, 1_234_567].map(grouped).each_ref().map(String::as_str)
        );
        let rows = [["a", "5"], ["bcd", "1 000"]].map(|row| row.map(str::to_owned));
        let text = table(&["name", "n"], rows.into_iter());
        assert_eq!(text, "name      n\na         5\nbcd   1 000\n");
    }
}
