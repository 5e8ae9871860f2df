"""Check the generator against closed forms. Needs Mitsuba for what it traces. Exits with 1 if a check fails."""

import sys

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.special import gammainc, gammaincc

import effects
import generate
import intervals
import physics
import refit
import scan
import score
import targets
from target_state import State

FAILED = []


def say(what, value, limit):
    good = value <= limit
    print(f"{'ok  ' if good else 'FAIL'} {what}: {value:.4g} (at most {limit:g})")
    if not good:
        FAILED.append(what)


def smith(kind, m, t):
    if kind == "ggx":
        return 2 / (1 + np.sqrt(1 + m**2 * np.tan(t) ** 2))
    a = 1 / (m * np.tan(np.maximum(t, 1e-9)))
    return np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)


def closed_form(material, t):
    """(12) to (15) with o = i, for the materials that have such a form."""
    m = material["m"]
    if material["distribution"] == "ggx":
        d = m**2 / (np.pi * np.cos(t) ** 4 * (m**2 + np.tan(t) ** 2) ** 2)
    else:
        d = np.exp(-np.tan(t) ** 2 / m**2) / (np.pi * m**2 * np.cos(t) ** 4)
    lobe = material["f"] * d * smith(material["distribution"], m, t) ** 2 / (4 * np.cos(t) ** 2)
    return (1 - material["k"]) * lobe, material["k"] * material["r"] / np.pi


def bases():
    for name, material in targets.MATERIALS.items():
        base = dict(np.load(f"bases/{name}.npz"))
        state = State(base, name, physics.waist_m(13.6))
        hit = base["range_m"] > 0
        t = state.clean_theta()[hit]
        if material["kind"] == "blend":
            lobe, rest = closed_form(material, t)
            say(f"{name}: Mitsuba's f cos(theta) of every chirp against (12)-(15), worst dB",
                np.abs(physics.db(base["f_cos"][hit]) - physics.db((lobe + rest) * np.cos(t))).max(), 0.02)
            wide = closed_form({**material, "m": 1.3 * material["m"]}, t)[0]
            seen = wide > 1e-6
            say(f"{name}: its lobe with 1.3 times the m, from the table, against (12)-(15), worst dB",
                np.abs(physics.db(state.law.rougher(t, 1.3)[seen] / wide[seen])).max(), 0.05)
        table = state.law.bare(t, "lobe") + state.law.bare(t, "rest")
        say(f"{name}: its table against every chirp, worst dB", np.abs(physics.db(table * np.cos(t)) - physics.db(base["f_cos"][hit])).max(), 0.05)
        if material["kind"] == "blend" and material["distribution"] == "beckmann":
            # Beckmann's slopes and the beam's are both Gaussian: m^2 + delta^2, up to the prefactors' slow change
            t = np.radians(np.arange(0, 14, 0.5))
            delta = physics.WAVELENGTH_M / (2 * np.pi * physics.waist_m(13.6))
            wide = closed_form({**material, "m": np.hypot(material["m"], delta)}, t)[0]
            say(f"{name}: lobe widened by the beam against m^2 + delta^2, worst dB", np.abs(physics.db(state.law.f(t, delta, "lobe") / wide)).max(), 0.1)
        power, _ = state.means_mw()
        n = 2 if material["footprint"] == "paper" else 1
        w = physics.beam_width_m(physics.waist_m(13.6), base["range_m"][hit])
        t = state.clean_theta()[hit]
        eleven = physics.mw(7 - 12.5) * physics.WAVELENGTH_M**2 / (np.pi * w**2) * table * np.cos(t) ** n
        say(f"{name}: widened power against (11) with the bare table, median dB", abs(np.median(physics.db(power[hit] / eleven))), 0.2)


def speckle():
    rng = np.random.default_rng(1)
    for mm in physics.SPOT:
        w0, step = physics.waist_m(mm), 0.004
        x, y = np.meshgrid(np.arange(-0.25, 0.25, step), np.arange(-0.45, 0.45, step))
        where, lags, contrast, fields = np.stack([x.ravel(), y.ravel()], -1), [], [], []
        for _ in range(4):
            f = physics.speckle(rng, 4, w0, where, np.zeros(x.size, int), True).reshape(4, *x.shape)
            lags.append([np.mean(f[:, :, k:] * f[:, :, :x.shape[1] - k].conj()).real / np.mean(np.abs(f) ** 2) for k in (1, 2, 3, 4, 6)])
            contrast.append(np.std(np.abs(f) ** 2) / np.mean(np.abs(f) ** 2))
            fields.append(np.mean(np.abs(f) ** 2))
        d = step * np.array([1, 2, 3, 4, 6])
        say(f"w0 = {mm} mm: correlation of amplitudes against exp(-d^2/w0^2), worst", np.abs(np.mean(lags, 0) - np.exp(-(d**2) / w0**2)).max(), 0.03)
        say(f"w0 = {mm} mm: contrast of one look against 1", abs(np.mean(contrast) - 1), 0.05)
        say(f"w0 = {mm} mm: mean intensity against 1", abs(np.mean(fields) - 1), 0.05)
    f = physics.speckle(rng, 4, 0.0136, np.zeros((40000, 2)), np.zeros(40000, int), False)
    say("independent, 4 looks: contrast against 1/2", abs(np.std(np.mean(np.abs(f) ** 2, 0)) - 0.5), 0.01)


def noise():
    rng, n = np.random.default_rng(2), 400_000
    level = physics.mean_noise_mw(4)
    f = physics.speckle(rng, 4, 0.0136, np.zeros((n, 2)), np.zeros(n, int), False)
    _, _, alarm = physics.detect(rng, np.zeros(n), np.zeros(n), np.zeros(n), f, level)
    expected = physics.FALSE_ALARM * n
    say("false alarms of empty gates, standard deviations off", abs(alarm.sum() - expected) / np.sqrt(expected), 3)
    # censoring of an echo that has the threshold's own mean: a sum of four exponentials
    mean = physics.mw(physics.THRESHOLD_DBM) - level
    seen, _, _ = physics.detect(rng, np.full(n, mean), np.zeros(n), np.full(n, 8.0), f, level)
    say("share of detections at the threshold against Gamma(4)", abs(np.isfinite(seen).mean() - gammaincc(4, 4)), 0.005)


def silhouettes():
    import tempfile

    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    aim, _ = scan.aims()
    with tempfile.TemporaryDirectory() as folder:
        for name, mesh in targets.MESHES.items():
            record = {"type": "scene"}
            for i, (v, f) in enumerate(mesh()):
                targets.write_ply(f"{folder}/{name}{i}.ply", v, f)
                record[f"s{i}"] = {"type": "ply", "filename": f"{folder}/{name}{i}.ply", "face_normals": True}
            scene = mi.load_dict(record)
            base = dict(np.load(f"bases/{name}.npz"))
            r, t = np.zeros(len(aim)), np.zeros(len(aim))
            for i, d in enumerate(scan.directions(aim)):
                si = scene.ray_intersect(mi.Ray3f(list(scan.ORIGIN), list(d)))
                if si.is_valid():
                    r[i], t[i] = si.t, np.arccos(min(1, abs(np.array(si.n) @ d)))
            both = (r > 0) & (base["range_m"] > 0)
            theta = np.arccos(np.clip(np.abs(np.sum(base["normal"] * scan.directions(aim), 1)), 0, 1))
            say(f"{name}: chirps that meet only the shape or only the user's mesh", np.sum((r > 0) != (base["range_m"] > 0)), 6)
            say(f"{name}: range of the user's mesh, 99 % within, mm", 1e3 * np.quantile(np.abs(r - base["range_m"])[both], 0.99), 0.5)
            near = both & (theta < 0.4)
            say(f"{name}: incidence on the user's mesh below 23 degrees, rms mrad", 1e3 * np.sqrt(np.mean((t - theta)[near] ** 2)), 2)


def moves():
    """The moved target of `motion` and `pose` against Mitsuba's rays on meshes that were moved as much."""
    import tempfile

    import mitsuba as mi

    shift, turn = np.array([4e-3, -2e-3, 5e-3]), np.radians([0.8, -1.2, 0.5])
    for name in ("cylinder", "body", "groove", "vase"):  # the cylinder's mesh has facets of 2.5 mrad, Mitsuba's is round
        state = State(dict(np.load(f"bases/{name}.npz")), name, physics.waist_m(13.6))
        still = state.range_m.copy()
        state.move(np.tile(shift, (state.n, 1)), np.tile(turn, (state.n, 1)))
        angle = np.linalg.norm(turn)
        k = np.cross(np.eye(3), turn / angle)
        matrix = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        record = {"type": "scene"}
        with tempfile.TemporaryDirectory() as folder:
            for i, (v, f) in enumerate(targets.MESHES[name]()):
                targets.write_ply(f"{folder}/{i}.ply", (v - targets.CENTRE) @ matrix.T + targets.CENTRE + shift, f)
                record[f"s{i}"] = {"type": "ply", "filename": f"{folder}/{i}.ply", "face_normals": True}
            scene = mi.load_dict(record)
        r, t = np.zeros(state.n), np.zeros(state.n)
        for i, d in enumerate(state.ray):
            si = scene.ray_intersect(mi.Ray3f(list(scan.ORIGIN), list(d)))
            if si.is_valid():
                r[i], t[i] = si.t, np.arccos(min(1, abs(np.array(si.n) @ d)))
        both = (r > 0) & (state.range_m > 0)
        say(f"{name}: moved, share of chirps where only one of the two hits", np.mean((r > 0) != (state.range_m > 0)), 0.002)
        say(f"{name}: moved, range, 95 % within, mm", 1e3 * np.quantile(np.abs(r - state.range_m)[both], 0.95), 0.01)
        say(f"{name}: (the move itself, median mm of range)", 1e3 * np.median(np.abs(r - still)[both & (still > 0)]), 50)
        say(f"{name}: moved, incidence, median mrad", 1e3 * np.median(np.abs(t - state.clean_theta())[both]), 1)
        say(f"{name}: moved, incidence, 95 % within, mrad", 1e3 * np.quantile(np.abs(t - state.clean_theta())[both], 0.95), 3)


def scans():
    """Places that are met twice, and the speckle of the second visit."""
    for pattern, visits in (("ellipses-twice", (20, 2, 115)), ("scan-twice", (1, 2, 2300))):
        aim = scan.aims(pattern)[0].reshape(visits + (2,))
        say(f"{pattern}: first against second visit of each place, m", np.abs(aim[:, 0] - aim[:, 1]).max(), 1e-12)
        rng, w0 = np.random.default_rng(3), physics.waist_m(13.6)
        places = aim.reshape(-1, 2)
        f = physics.speckle(rng, 4, w0, places, np.zeros(len(places), int), True).reshape((4,) + visits)
        say(f"{pattern}: their speckle", np.abs(f[:, :, 0] - f[:, :, 1]).max(), 1e-9)
    aim, _ = scan.aims("long")
    apart = np.hypot(*np.diff(aim, axis=0).T)
    say("long: chirps a turn and their distance against the paper's 6 mm, median off, mm", abs(1e3 * np.median(apart) - 6), 0.5)


def numbers():
    """True numbers of a gain that has a stated form, and of a pose, against what they were made of."""
    base = dict(np.load("bases/groove.npz"))
    s = State(base, "groove", physics.waist_m(13.6))
    forms = effects.gains_of(s)
    for name, index, true in (("drift", 1, (3.0, -1.0, 0.5)), ("fov-gain", 2, (-4.0, 1.0, -2.0, 0.7, 0.3, 5.0))):
        after = State(base, "groove", physics.waist_m(13.6))
        after.gain = physics.mw(sum(a * column for a, column in zip(true, forms[name][index].values())))
        fitted = effects.fitted_numbers(s, after, name, s.range_m > 0, 4)[index]
        say(f"{name}: numbers of a gain of that form, worst dB", np.abs(np.array(list(fitted.values())) - true).max(), 1e-4)
    v = np.random.default_rng(1).normal(size=6) * np.array([4e-3, 4e-3, 4e-3, 0.01, 0.015, 0.01])
    told = effects.pose_numbers(s, v[:3], v[3:])
    point = (scan.ORIGIN + s.range_m[:, None] * s.ray)[s.range_m > 0]
    middle = point.mean(0)
    matrix = targets.rotation([told[f"rotation_{a}_deg"] for a in "xyz"])
    moved = (point - middle) @ matrix.T + middle + [told[f"translation_{a}_m"] for a in "xyz"]
    angle = np.linalg.norm(v[3:])
    k = np.cross(np.eye(3), v[3:] / angle)
    turn = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    say("pose: its numbers move the target as the effect does, worst m",
        np.abs(moved - ((point - targets.CENTRE) @ turn.T + targets.CENTRE + v[:3])).max(), 1e-9)
    # without the foot, and round, FWHM = sd sqrt(16 ln 2) of the two-way spot; the foot adds its power below the core
    say("finite-spot: diameter of 4.8 mm two-way sd against 16 mm, mm off", abs(1e3 * effects.diameter_m(0.48, 1.0) - 16), 0.5)


def shapes():
    """Fits of return from below and of a grain give back what has their form; of what has another they give all or nothing."""
    for name, effect, count, true in (
        ("groove", "subsurface", 1, (np.log(0.01),)), ("box", "subsurface", 2, (np.log(0.003), 0.7)),
        ("sphere", "subsurface", 2, (np.log(0.003), 1.4)), ("groove", "anisotropy", 2, (np.log(1.4), 0.9)),
        ("cylinder", "anisotropy", 4, (np.log(1.3), -0.5, 0.4, 0.8)),
    ):
        before, after = untouched(name), untouched(name)
        make, forms = effects.SHAPES[effect]
        slope_scale, added = make(before, count).at(true)
        after.slope_scale = after.slope_scale if slope_scale is None else slope_scale
        after.added_mw = after.added_mw if added is None else added
        index = [len(form) for form in forms].index(count)
        fitted = effects.fitted_numbers(before, after, effect, audible(before), 4)[index]
        say(f"{name}: {forms[index][0]} of {effect} of a form with {count} numbers, off as a share",
            abs(fitted[forms[index][0]] / np.exp(true[0]) - 1), 1e-3)
    # 0.8 + 0.3 cos(theta) where a diffuse part without exponent takes the cosine
    before, after = untouched("sphere"), untouched("sphere")
    effects.subsurface(after, 2.0, None)
    flat, falling = effects.fitted_numbers(before, after, "subsurface", audible(before), 4)
    say("sphere: sigma_v of the effect beside a refitted law, off as a share", abs(falling["sigma_v"] / 1.6e-3 - 1), 1e-3)
    say("sphere: levels of sigma-0 that are stated with the footprint `projected`", int(flat["sigma_v"] is not None), 0)
    before, after = untouched("groove"), untouched("groove")
    effects.anisotropy(after, 1.0, np.random.default_rng(1))
    fitted = effects.fitted_numbers(before, after, "anisotropy", audible(before), 4)
    say("groove: ratios of a grain that swings too far for a straight one", sum(f["ratio"] is not None for f in fitted), 0)


def untouched(name):
    return State(dict(np.load(f"bases/{name}.npz")), name, physics.waist_m(13.6))


def audible(state):
    return state.means_mw()[0] > physics.mw(physics.THRESHOLD_DBM)


def strengths():
    """Effects with a strength of their own: what it says happens, and a weak one is in the data."""
    for name in targets.MATERIALS:
        before = untouched(name)
        use, power = audible(before), before.means_mw()[0]
        found = effects.calibrate(lambda: untouched(name), "angle-error", "weak", 1, 4)
        truth = {"detections": int(use.sum()), "false_alarms": 0, "labels": ["angle-error"], "looks": 4, "declared_looks": 4,
                 "independent_share": 1.0, "tilt_spread_db": generate.tilt_spread_db(before, found.size, use)}
        gain = score.held_out("angle-error", score.expected_gain(truth)["angle-error"])
        say(f"{name}: gain in held-out ln p that counts as in the data, over that of a weak angle-error, {gain:.1f}",
            score.IN_THE_DATA / gain, 1)
        for strength, loss in effects.OWN_DB["compression"].items():
            s = untouched(name)
            effects.compression(s, effects.calibrate(lambda: untouched(name), "compression", strength, 1, 4).size, None)
            strongest = np.argmax(power)
            say(f"{name}: {strength} compression, what the strongest echo loses, dB off",
                abs(physics.db(power[strongest] / s.seen_mw()[strongest]) - loss), 1e-3)
    # against a histogram of echoes, on cells that Gamma fills alike
    rng = np.random.default_rng(5)
    for ratio in (0.5, 5.0):
        echo = np.mean(np.tanh(np.sqrt(ratio * rng.exponential(size=(4, 1_000_000)))) ** 2, 0)
        share = np.histogram(gammainc(4, 4 * echo / echo.mean()), 100, (0, 1))[0] / echo.size
        nats = np.sum(share * np.log(np.maximum(100 * share, 1e-12)))
        say(f"compression by {ratio}: nats of the scatter against a histogram, off as a share",
            abs(nats / effects.ceiling_divergence(ratio, 4) - 1), 0.03)


def seen_divergence(true_mw, base_mw):
    """Nats by which Gamma of four looks shows another mean, with noise, where what is below the threshold is silent."""
    noise = physics.mean_noise_mw(4)
    true, base = true_mw + noise, base_mw + noise
    u, v = (4 * physics.mw(physics.THRESHOLD_DBM) / mean for mean in (true, base))
    echo = 4 * (gammaincc(4, u) * np.log(base / true) + (true / base - 1) * gammaincc(5, u))
    return np.minimum(echo + gammainc(4, u) * np.log(gammainc(4, u) / gammainc(4, v)), refit.MOST)


def realised(name, label, found, draws):
    """Realised gains over draws of the noise, and the last of the truths, all that an expected gain needs."""
    before, state, rng, out = untouched(name), untouched(name), np.random.default_rng(8), []
    effects.EFFECTS[label](state, found.size, np.random.default_rng(7))
    alone = state.means_mw()[0]
    for _ in range(draws):
        if label == "angle-error":  # whose tilts are noise as well
            effects.angle_error(state, found.size, rng)
        data = generate.observe(rng, state, False)
        out.append(generate.realised_gain(data, before, alone, label, found, 0.0, 1.0))
    truth = {"labels": [label], "detections": int(data.seen.sum()), "false_alarms": int(data.alarm.sum()),
             "looks": state.looks, "declared_looks": 4, "independent_share": 1.0, "power_gain": {label: found.gain},
             "range_gain": generate.range_gain(before, data.range_m, data.echo)}
    if label == "angle-error":
        truth["tilt_spread_db"] = generate.tilt_spread_db(before, found.size, data.echo)
    return np.array(out), truth, alone


def gains():
    """Realised gains against what is expected, and of effects of size 0."""
    for name, label in (("groove", "drift"), ("vase", "foreign-patch"), ("cylinder", "subsurface"), ("body", "thin-film"),
                        ("groove", "motion"), ("box", "subsurface")):
        found = effects.calibrate(lambda: untouched(name), label, "weak", 7, 4)
        out, truth, alone = realised(name, label, found, 200)
        nats, loud, error = seen_divergence(alone, found.law_mw), audible(untouched(name)), np.std(out) / len(out) ** 0.5
        whole, expected, what = nats.sum() + truth["range_gain"], score.expected_gain(truth)[label], f"{name}: weak {label}"
        say(f"{what}, mean realised gain {out.mean():.1f} against {whole:.1f} by divergences, standard errors off",
            abs(out.mean() - whole) / error, 3)
        say(f"{what}, what noise and silences change of the expected gain, {expected:.1f}, where an echo was loud, as a share",
            abs((nats[loud].sum() + truth["range_gain"]) / expected - 1), 0.2)
        if name != "box":  # some of whose chirps are audible by the effect alone, and gain much each
            say(f"{what}, sd of the realised gain against the root of twice its mean, off as a share",
                abs(np.std(out) / np.sqrt(2 * out.mean()) - 1), 0.2)
    names, law = ("angle-error", "compression", "speckle"), refit.Law(untouched("groove"))
    own = {name: effects.calibrate(lambda: untouched("groove"), name, "weak", 7, 4) for name in names}
    for label, found, draws, low, high in (
        ("speckle", own["speckle"]._replace(size=3.0), 200, 0.9, 1.1), ("speckle", own["speckle"], 200, 0.5, 1.0),
        ("angle-error", own["angle-error"], 20, 1.0, 1.6), ("compression", own["compression"], 20, 0.9, 1.1),
    ):
        out, truth, _ = realised("groove", label, found, draws)
        ratio = out / score.expected_gain(truth)[label]
        mean, error = ratio.mean(), np.std(ratio) / draws**0.5
        say(f"groove: {label} of size {found.size:.3g}, mean realised gain over the expected one, {mean:.2f}, "
            f"standard errors outside of {low} to {high}", max(low - mean, mean - high, 0) / error, 2)
    law_mw = law.means_mw(effects.refitted(law, untouched("groove")).numbers)
    for label in effects.EFFECTS:
        if label not in ("finite-spot", "noise-floor"):  # a spot has a size, and alarms are counted as they are
            size = {"compression": 1e-9, "speckle": 4.0}.get(label, 0.0)
            out = realised("groove", label, effects.Sized(size, 0.0, 0.0, law_mw), 1)[0]
            say(f"groove: realised gain of {label} of size 0", abs(out[0]), 0.01)


def costs():
    """What learning the numbers of a form costs in held-out ln p, by linear forms of ln mean and by effects near the limit."""
    rng, chirps, draws, looks, law, form = np.random.default_rng(6), 1000, 1000, 4, 4, 6
    x = rng.normal(size=(chirps, law + form))
    ln_mean = x @ np.repeat([0.0, 0.03], (law, form))
    echo, fold = np.exp(ln_mean) * rng.gamma(looks, 1 / looks, (draws, chirps)), np.arange(chirps) % score.FOLDS

    def fit(x, echo):  # by scores: the information on ln mean is the same everywhere
        found, step = np.zeros((len(echo), x.shape[1])), np.linalg.pinv(x).T
        for _ in range(8):
            found += (echo * np.exp(-found @ x.T) - 1) @ step
        return found

    def ln_p(echo, ln_mean):
        return -looks * np.sum(ln_mean + echo * np.exp(-ln_mean), 1)

    def held(out, count):
        return ln_p(echo[:, out], fit(x[~out, :count], echo[:, ~out]) @ x[out, :count].T)

    refitted = fit(x[:, :law], np.exp(ln_mean)[None]) @ x[:, :law].T
    realised = ln_p(echo, ln_mean) - ln_p(echo, refitted)
    lost = (realised - sum(held(fold == k, law + form) - held(fold == k, law) for k in range(score.FOLDS))) / form
    say(f"held-out gain below the realised one, {realised.mean():.1f}, by {lost.mean():.3f} a number against {score.COST}, "
        "standard errors off", abs(lost.mean() - score.COST) / (np.std(lost) / draws**0.5), 3)
    for name in ("groove", "sphere"):
        for label in ("drift", "fov-gain", "covering-layer"):
            found = effects.calibrate(lambda: untouched(name), label, "weak", 0, 4)
            best, gain = simplest(name, label, found), NEAR * found.gain
            say(f"{name}: weak {label} of gain {gain:.1f}, of which the best simple form keeps {best:.1f} in held-out ln p, "
                "what is counted off", abs(best - score.held_out(label, gain)), 1)


NEAR = 0.18  # share of independent chirps with which weak effects gain 5 to 10


def simplest(name, label, found):
    """Held-out gain of the best form with few numbers: a polynomial, a field about the middle, a circle of even thickness."""
    before, after = untouched(name), untouched(name)
    effects.EFFECTS[label](after, found.size, np.random.default_rng(0))
    law, true, use = refit.Law(before), after.means_mw()[0], audible(before)

    def lost(*gains):
        return law.fit(true, use, gains).loss(4)

    if label == "drift":
        column = [np.polynomial.Legendre.basis(n)(2 * before.share - 1) for n in range(1, 9)]
        forms = [(n, lost(*column[:n])) for n in range(1, 9)]
    elif label == "fov-gain":
        x, y = before.aim.T / [[0.25], [0.45]]
        forms = [(1, lost(np.hypot(x, y) ** 2.15 + 0.2 * x))]
    else:
        change = np.abs(np.log(np.where(use, true, 1) / np.where(use, law.power_mw, 1)))
        inside = before.surface[change > 0.3 * change.max()]

        def circle(at):
            d = np.hypot(*(before.surface - at[:2]).T)
            return lost(1 / np.cos(before.theta()) / (1 + np.exp((d - at[2]) / 0.003)))

        start = np.array([*inside.mean(0), np.sqrt(2 * inside.var(0).sum())])
        simplex = start + 0.02 * np.eye(4, 3, -1)
        forms = [(4, minimize(circle, start, method="Nelder-Mead", options={"maxfev": 60, "initial_simplex": simplex}).fun)]
    return max(NEAR * (found.gain - left) - score.COST * count for count, left in forms)


def laws():
    """Numbers of the law are compared where every true effect was named."""
    said = {"base": {"level_db": {"value": 0.0, "sd": 1.0}, "parameters": [{"name": "specular.m", "value": 0.1, "sd": 0.01}]}}
    truth = {"law": targets.MATERIALS["groove"], "labels": ["pose", "speckle"], "level_offset_db": 0.5}
    for names, wanted in ((["pose"], 0), (["pose", "speckle"], 2), ([], 0)):
        answer = said | {"effects": [{"name": n, "parameters": {}} for n in names]}
        say(f"numbers of the law beside pose and speckle, of which {' and '.join(names) or 'none'} got a name, off",
            abs(len(list(intervals.of_laws(answer, truth))) - wanted), 0)
    say("numbers of the law of a complete scan, off", abs(len(list(intervals.of_laws(said, truth | {"labels": []}))) - 2), 0)


def refits():
    """The refit of the law against minima by Nelder and Mead, with a table of its own for each width of the lobe."""
    cases = (("groove", "anisotropy", 1.2), ("sphere", "compression", 20.0), ("cylinder", "fov-gain", 0.8),
             ("body", "foreign-patch", 0.9), ("vase", "correlated-shadowing", 0.9), ("box", "subsurface", 0.4))
    for name, effect, size in cases:
        base = dict(np.load(f"bases/{name}.npz"))
        before, after = (State(base, name, physics.waist_m(13.6)) for _ in range(2))
        effects.EFFECTS[effect](after, size, np.random.default_rng(9100))
        left = effects.refitted(refit.Law(before), after).left
        use = (before.range_m > 0) & (before.means_mw()[0] > physics.mw(physics.THRESHOLD_DBM))
        theta, range_m, true, law = before.theta()[use], before.range_m[use], after.seen_mw()[use], before.law
        lobe, rest = before.parts_mw(theta, range_m)
        delta = before.delta(range_m)

        def least(ln_width):
            table = law.convolved(lambda t: law.rougher(t, np.exp(ln_width)))
            wider = lobe * law.at(table, theta, delta) / law.f(theta, delta, "lobe")

            def deviance(x):
                q = true / (np.exp(x[0]) * wider + np.exp(x[1]) * rest * np.cos(theta) ** abs(x[2]))
                return 4 * np.sum(q - 1 - np.log(q))

            starts = ((0, 0, 0.1), (-3 * ln_width, 0, 1.0), (0, 0.5, 0.1))
            return min(minimize(deviance, x, method="Nelder-Mead", options={"maxfev": 1000}).fun for x in starts)

        found = min(minimize_scalar(least, bounds=b, options={"xatol": 0.001}).fun for b in ((-0.8, 0.05), (-0.05, 0.8)))
        say(f"{name}, {effect}: what a refit leaves, {found:.1f} nats by Nelder and Mead, off",
            abs(4 * np.sum(np.expm1(left) - left) - found), 0.05)
    s = State(base, name, physics.waist_m(13.6))
    s.ceiling_mw = s.means_mw()[0].max() / 3
    rng, strongest = np.random.default_rng(4), np.argmax(s.means_mw()[0])
    each = s.ceiling_mw * np.tanh(np.sqrt(3 * rng.exponential(size=400_000))) ** 2
    say("compression: mean power below a ceiling against a mean of looks, dB", abs(physics.db(s.seen_mw()[strongest] / each.mean())), 0.02)


def met(name, ray):
    """Range and incidence on the sphere, the cylinder's endless side or the groove's first flat, from equations."""
    if name == "groove":
        normal = targets.rotation((-6, 9, 0)) @ np.array([0, 0, 1.0])
        r = (targets.CENTRE - scan.ORIGIN) @ normal / (ray @ normal)
        return r, np.arccos(-ray @ normal)
    if name == "sphere":
        (centre, radius), across = targets.BALL, np.eye(3)
    else:
        centre, radius = targets.TUBE[0], targets.TUBE[2]
        across = np.eye(3) - np.outer(targets.TILT, targets.TILT)
    o, d = (scan.ORIGIN - centre) @ across, ray @ across
    a, b, c = np.sum(d * d, -1), np.sum(d * o, -1), o @ o - radius**2
    root = b * b - a * c
    r = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, 0.0)
    normal = (o + r[..., None] * d) / radius
    return r, np.where(root > 0, np.arccos(np.clip(-np.sum(normal * ray, -1), 0.01, 1)), 0.0)


def spots():
    """The finite spot: against integrals over the closed form of a shape, and against twice as many sub-rays."""
    for name, size, big in (("sphere", 0.1, 1.2), ("cylinder", 0.1, 1.2), ("groove", 0.1, 0.3)):
        base = dict(np.load(f"bases/{name}.npz"))
        narrow, wide, twice = (State(base, name, physics.waist_m(13.6)) for _ in range(3))
        # a chirp is far from edges if none nearby meets another piece or nothing
        edge = narrow.aim[base["piece"] != 0]
        far = np.array([np.min(np.hypot(*(edge - a).T)) > 0.02 for a in narrow.aim])
        inner = far & (narrow.clean_theta() < 0.6) & (np.abs(narrow.aim[:, 1]) < 0.3)
        effects.finite_spot(narrow, size, np.random.default_rng(5))
        r, t = met(name, narrow.ray[inner])
        # the plane keeps its power; curved lobes change a little
        change = physics.db(narrow.spread[inner] / sum(narrow.parts_mw(t, r)))
        say(f"{name}: a spot of {size} cm, {inner.sum()} chirps far from edges, against one closed-form ray, rms dB",
            np.sqrt(np.mean(change**2)), 0.001 if name == "groove" else 0.05)
        say(f"{name}: the same, range, worst mm", 1e3 * np.abs(narrow.range_m[inner] - r).max(), 0.1)
        effects.finite_spot(wide, big, np.random.default_rng(5))
        effects.finite_spot(twice, big, np.random.default_rng(5), 192)
        seen = wide.spread > physics.mw(physics.THRESHOLD_DBM)
        change = physics.db(wide.spread[seen] / twice.spread[seen])
        say(f"{name}: a spot of {big} cm, {seen.sum()} chirps, twice as many sub-rays, rms dB",
            np.sqrt(np.mean(change**2)), 0.05)
        if name == "groove":
            continue
        # a lattice of 0.2 sd over the footprint, by equations, silhouettes included; away from the cylinder's ends
        draw = np.random.default_rng(5)
        longer, turn = draw.uniform(1.0, 1.4), draw.uniform(0, np.pi)
        u, v = np.meshgrid(*[np.arange(-13, 13.01, 0.1)] * 2)
        weight = 0.93 / longer * np.exp(-((u / longer) ** 2 + v**2) / 2) + 0.07 / 6.25 * np.exp(-(u**2 + v**2) / 12.5)
        c, s = np.cos(turn), np.sin(turn)
        points = 0.01 * big * np.stack([c * u - s * v, s * u + c * v], -1).reshape(-1, 2)
        error, apart = [], []
        for i in np.flatnonzero(seen & (np.abs(wide.aim[:, 1]) < 0.2))[::25]:
            r, t = met(name, scan.directions(wide.aim[i] + points))
            power = np.where(r > 0, sum(wide.parts_mw(t, np.where(r > 0, r, 8.0))), 0.0)
            power = power * weight.ravel() / weight.sum()
            error.append(physics.db(wide.spread[i] / power.sum()))
            apart.append(1e3 * (wide.range_m[i] - np.sum(power * r) / power.sum()))
        say(f"{name}: the same against an integral over the shape's equation, {len(error)} chirps, rms dB",
            np.sqrt(np.mean(np.square(error))), 0.05)
        # silhouettes decide, where the range turns by centimetres: half the noise of a range
        say(f"{name}: the same, range, rms mm", np.sqrt(np.mean(np.square(apart))), 500 * physics.RANGE_SD_M)


if __name__ == "__main__":
    bases()
    speckle()
    noise()
    silhouettes()
    moves()
    scans()
    numbers()
    shapes()
    strengths()
    gains()
    costs()
    laws()
    refits()
    spots()
    sys.exit(1 if FAILED else 0)
