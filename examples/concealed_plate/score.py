"""Scores of detection and segmentation, and their intervals over scans and over trainings."""

import numpy as np

DRAWS, FALSE_ALARMS = 2000, 0.05
OF_PLATES, OF_OTHERS = ("precision", "overlap", "found"), ("alarms",)


def precision(mask, truth):
    """Average precision of the pixels of one scan."""
    hit = truth.ravel()[np.argsort(-mask.ravel(), kind="stable")]
    return float((np.cumsum(hit) / np.arange(1, hit.size + 1))[hit].mean())


def overlap(mask, truth):
    """Intersection over union of one scan, pixels above one half."""
    found = mask > 0.5
    return float((found & truth).sum() / (found | truth).sum())


def judge(masks, scores, truth):
    """What later steps need of one network on one test: whether a scan has a plate, its score, and its segmentation."""
    has = truth.any((1, 2))
    pairs = list(zip(masks[has], truth[has]))
    return {"has": has, "score": scores, "precision": np.array([precision(*pair) for pair in pairs]),
            "overlap": np.array([overlap(*pair) for pair in pairs])}


def decide(judged, own):
    """Adds which scans are flagged, at the threshold that flags 5 % of the scans without a plate of matdb's own."""
    flagged = judged["score"] > np.quantile(own["score"][~own["has"]], 1 - FALSE_ALARMS)
    return {**judged, "found": flagged[judged["has"]], "alarms": flagged[~judged["has"]]}


def wins(judged):
    """For each scan with a plate and each without, whether the first has the higher score."""
    with_plate, without = judged["score"][judged["has"]], judged["score"][~judged["has"]]
    return (with_plate[:, None] > without) + 0.5 * (with_plate[:, None] == without)


def draws(rng, trainings):
    """Scores of all scans and trainings, and of DRAWS draws of scans and trainings with replacement, for each arm."""
    arms = list(trainings)
    pairs = {arm: np.stack([wins(one) for one in trainings[arm]]) for arm in arms}
    parts = {arm: {name: np.stack([one[name] for one in trainings[arm]]) for name in OF_PLATES + OF_OTHERS}
             for arm in arms}
    result = {arm: {"auc": [pairs[arm].mean()], **{name: [part.mean()] for name, part in parts[arm].items()}}
              for arm in arms}
    number, plates, others = pairs[arms[0]].shape
    for _ in range(DRAWS):
        a = rng.multinomial(plates, np.full(plates, 1 / plates)) / plates
        b = rng.multinomial(others, np.full(others, 1 / others)) / others
        for arm in arms:
            s = rng.multinomial(number, np.full(number, 1 / number)) / number
            result[arm]["auc"].append(float(s @ (pairs[arm] @ b) @ a))
            for name, part in parts[arm].items():
                result[arm][name].append(float(s @ part @ (a if name in OF_PLATES else b)))
    return {arm: {name: np.array(values) for name, values in scores.items()} for arm, scores in result.items()}


def interval(values):
    """[value, lower, upper]: of all, and the middle 95 % of the draws."""
    return [round(float(v), 4) for v in (values[0], *np.percentile(values[1:], [2.5, 97.5]))]


def summary(trainings, base):
    """Scores of each arm with intervals, and of the others less the arm base, with the same draws of scans."""
    drawn = draws(np.random.default_rng(0), trainings)
    table = {arm: {name: interval(values) for name, values in scores.items()} for arm, scores in drawn.items()}
    less = {arm: {name: interval(values - drawn[base][name]) for name, values in scores.items()}
            for arm, scores in drawn.items() if arm != base}
    return {"arms": table, f"less {base}": less}
