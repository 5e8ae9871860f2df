"""Numbers and tables as the page writes them."""


def number(value):
    """Three digits, without an exponent."""
    if value == 0 or abs(value) >= 99.95:
        return f"{value:,.0f}".replace(",", " ")
    decimals = 0
    while abs(value) * 10**decimals < 99.95 and decimals < 6:
        decimals += 1
    return f"{value:.{decimals}f}"


def spread(quartiles):
    """Median and, in brackets, quartiles."""
    low, median, high = map(number, quartiles)
    return median if low == high else f"{median} ({low}–{high})"


def bound(value):
    """A goal's number, as it was set."""
    return f"{value:g}"


def times(ratio):
    return f"× {number(ratio)}"


def share(part):
    return "all" if part == 1 else f"{100 * part:.4f} %"


def grouped(count):
    return f"{count:,}".replace(",", " ")


def table(head, rows, right=()):
    """A table in Markdown; the columns in `right` are numbers."""
    rule = ["--:" if name in right else "---" for name in head]
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in [head, rule, *rows]) + "\n"
