"""95 % intervals of a report whose truth is known. README.md lists which are compared, and why others are not."""

# Names of effects beside which a number of the law, or of its level, keeps its meaning.
LOBE_STAYS = {"covering-layer", "drift", "fov-gain", "motion", "noise-floor", "pose", "speckle"}
LEVEL_STAYS = {"motion", "noise-floor", "pose", "speckle"}


def stated(parameters):
    """Value and sd by name of the parameters; the vectors among them repeat others."""
    return {name: (p["value"], p["sd"]) for name, p in parameters.items() if not isinstance(p["value"], list)}


def true_numbers(forms, said):
    """Truths by name: of an only form all, of several those of the form that has the numbers that were said."""
    if len(forms) == 1:
        return forms[0]
    used = {name for name, (value, _) in said.items() if value != 0}
    return next((form for form in forms if set(form) == used), {})


def of_effects(answer, truth):
    for effect in answer.get("effects", []):
        name, said = effect["name"], stated(effect["parameters"])
        if name not in truth["labels"]:
            continue
        for key, true in true_numbers(truth.get("numbers", {}).get(name, [{}]), said).items():
            value, sd = said.get(key, (None, None))
            if sd and true is not None:
                if (name, key) == ("anisotropy", "ratio") and value < 1:  # the same, turned by 90 degrees
                    value, sd = 1 / value, sd / value**2
                yield f"{name}.{key}", value, sd, true


def of_laws(answer, truth):
    law, labels, base = truth["law"], set(truth["labels"]), answer.get("base", {})
    if law["kind"] != "blend" or not labels <= {effect["name"] for effect in answer.get("effects", [])}:
        return  # what has no name is in the law
    true = {}
    if labels <= LOBE_STAYS:
        true["specular.m"] = law["m"]
    if labels <= LEVEL_STAYS:
        true |= {"S": (1 - law["k"]) * law["f"], "R": law["k"] * law["r"], "level_db": truth["level_offset_db"]}
    level = base.get("level_db")
    said = [(p["name"], p["value"], p["sd"]) for p in base.get("parameters", [])]
    said += [("level_db", level["value"], level["sd"])] if level else []
    for name, value, sd in said:
        if sd and name in true:
            yield f"law.{name}", value, sd, true[name]


def intervals(answer, truth):
    """(name, value, sd, truth, whether the interval holds the truth) of each number with a known truth."""
    found = [*of_effects(answer, truth), *of_laws(answer, truth)]
    return [(n, v, s, t, abs(v - t) <= 1.96 * s) for n, v, s, t in found]
