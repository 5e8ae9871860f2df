"""A study as a page of the book."""

import collections

import score

STRENGTHS = ("strong", "moderate", "weak")


def percent(count, total):
    return f"{100 * count / total:.1f} %" if total else "-"


def table(head, rows):
    """Markdown; the first column is text, the others numbers."""
    lines = [head, ["---", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def called(scores):
    """What was said of each effect: how often, by the strength of the set."""
    said = collections.defaultdict(lambda: collections.defaultdict(collections.Counter))
    for strength in STRENGTHS:
        for (truth, answer), count in scores[strength].confusion.items():
            said[truth][strength][answer] += count
    return [(truth, *(in_words(truth, by[s]) for s in STRENGTHS)) for truth, by in sorted(said.items())]


def in_words(truth, counts):
    return ", ".join(f"{'**' + a + '**' if a == truth else a} {n}" for a, n in counts.most_common()) or "-"


def page(rows, scores, done, made_by):
    everything = score.Score()
    for s in scores.values():
        everything.update(s)
    seconds = sorted(everything.seconds) or [0.0]
    names = ", ".join(f"`{name}` {count}" for name, count in done.items() if count)
    lists = [("Every miss", everything.misses), ("Not in the data", everything.apart)]
    parts = [
        "# Closing the loop on scans of other code\n",
        "Mitsuba 3 renders the mean power of six targets by its own rays and BSDFs; numpy adds speckle that is fixed to the "
        "surface, noise, an unknown level and one effect, two, one that no library has, or none. Nothing of it is code of "
        "this program. `examples/mitsuba/README.md` says how the scans are made and judged. All data are synthetic.\n",
        f"Written by `examples/mitsuba/study.py table --page`. Judged: {made_by}.\n",
        f"Scans that are done: {names}.\n",
        "## Targets\n",
        table(("what", "count", "of", "share", "target", ""), [(w, c, t, percent(c, t), g, m) for w, c, t, g, m in rows]),
        "*Right name first*: the first effect of the report is the true one. *Both of a pair*: the first two are the two. "
        "*Unknown*: the verdict is `unexplained` and nothing is named. *False alarm*: any name, and any verdict but "
        "`no-missing-effect`, where nothing is missing. *Not in the data*: the true form itself gains less than "
        f"{score.IN_THE_DATA:g} in held-out ln p on the observations of the case. *Below weak*: the effect cannot be had weak "
        "on that target.\n",
        "## What each effect was called\n",
        "Names that were said in one case are joined by `+`; where none was, the verdict stands.\n",
        table(("true effect", *STRENGTHS), called(scores)),
        "## 95 % intervals\n",
        "How many hold the truth, of those that a report states:\n",
        table(("number", "hold", "of"), [(n, everything.held[n], c) for n, c in sorted(everything.stated.items())]),
        "## Time\n",
        f"A diagnosis took {seconds[len(seconds) // 2]:.1f} s in the median and {seconds[-1]:.1f} s at worst, several at once.\n",
    ]
    for title, lines in lists:
        parts += [f"## {title}\n", "\n".join(f"- {line}" for line in lines) + "\n" if lines else "None.\n"]
    return "\n".join(parts)
