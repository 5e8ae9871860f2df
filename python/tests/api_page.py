"""Writes the page of the book that lists the package, out of its docstrings: python python/tests/api_page.py > docs/python-api.md"""

import inspect
import re

import matdb as md

HEAD = """# Python, name by name

Generated from the package's own documentation, which `help(matdb.render)` shows, by `python python/tests/api_page.py > docs/python-api.md`.
[Python](python.md) has the way through it.
"""
SECTIONS = ("Parameters", "Returns", "Raises", "Warns")


def markdown(doc):
    """The text of a docstring of numpydoc: sections in bold, their entries as lists."""
    lines, out, section = inspect.cleandoc(doc or "").splitlines(), [], None
    for number, line in enumerate(lines):
        if line in SECTIONS and lines[number + 1 : number + 2] == ["-" * len(line)]:
            section = line
            out += [f"**{line}**", ""]
        elif set(line) == {"-"}:
            continue
        elif section and line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            out.append(f"- `{name}`" + (f" ({kind})" if kind else ""))
        else:
            out.append(line.replace("<", "&lt;") if not section else "  " + line.strip() if line else "")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(out)).strip()


def signature(name, thing, is_method=False):
    try:
        words = str(inspect.signature(thing))
    except ValueError:
        return name
    words = words.replace("=Ellipsis", "=...")
    return name + (re.sub(r"\(\$?self(, /)?(, )?", "(", words) if is_method else words)


def of_class(name, kind):
    out = [f"## {name}", markdown(kind.__doc__)]
    if "Parameters" in (kind.__doc__ or ""):
        out.insert(1, f"```text\n{signature(name, kind)}\n```")
    rows, methods = [], []
    for word, thing in sorted(vars(kind).items()):
        if word.startswith("_"):
            continue
        if inspect.isgetsetdescriptor(thing):
            rows.append(f"| `{word}` | {' '.join(markdown(thing.__doc__).split())} |")
        else:
            method = getattr(kind, word)
            shown = signature(f"{name}.{word}", method, is_method=True)
            methods += [f"### {name}.{word}", f"```text\n{shown}\n```", markdown(method.__doc__)]
    if rows:
        out.append("| attribute | what it is |\n|---|---|\n" + "\n".join(rows))
    return out + methods


def page():
    functions, classes, errors = [], [], []
    for name in md.__all__:
        thing = getattr(md, name)
        if name.startswith("_"):
            continue
        if not inspect.isclass(thing):
            functions += [f"## {name}", f"```text\n{signature('matdb.' + name, thing)}\n```", markdown(thing.__doc__)]
        elif issubclass(thing, Exception):
            errors.append(f"| `{name}` | {' '.join((thing.__doc__ or '').split())} |")
        else:
            classes += of_class(name, thing)
    table = "| exception | when |\n|---|---|\n" + "\n".join(errors)
    return "\n\n".join([HEAD.strip(), *functions, *classes, "## Exceptions", table]) + "\n"


if __name__ == "__main__":
    print(page(), end="")
