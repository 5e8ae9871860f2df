"""Received power of one Gaussian beam by surface integrals, independent of the program.

It writes `physical_optics.json` next to it. It needs numpy and one core for a few minutes:

    python3 tests/validation/physical_optics.py

Model, from first principles. The antenna sends one scalar beam of unit power along +z,

    E = sqrt(2/(pi w^2)) exp(-r^2/w^2) exp(i [k z + k r^2/(2 R_c) - arctan(z/z_R)]),

with z = 0 at the focus. On a perfect conductor physical optics puts the current 2 n x H. By
reciprocity the same antenna receives the amplitude

    b = integral over the lit surface of E^2 (khat . n) dA,        P_r/P = |b|^2,

khat being the local direction of the wavefront. An infinite flat mirror at the focus gives b = 1
exactly, which fixes the factor. No formula of the program enters. Where stationary phase or a
Gaussian integral gives a closed form, the script asserts that it agrees.

Incoherent targets: P_r/P = lambda^2 * integral of f cos(theta) u^2 over the area across the beam,
u = |E|^2. Scatterers: b = sum a_j E(x_j)^2 with complex Gaussian a_j.

Every value has `convergence_db` (or `convergence`): its change when the step is halved.
"""

import json
import math
import pathlib
import time

import numpy as np

LIGHT_SPEED = 299_792_458.0
FREQUENCY = 300e9
WAIST = 0.016 / math.sqrt(2.0 * math.log(2.0))
FOCUS = 8.0
WAVELENGTH = LIGHT_SPEED / FREQUENCY
K = 2.0 * math.pi / WAVELENGTH
RAYLEIGH = math.pi * WAIST**2 / WAVELENGTH
DELTA0 = WAVELENGTH / (2.0 * math.pi * WAIST)
PLACES = [0.0, 0.2, -0.2, 0.5, -0.5]
#: Half the width of the integrated square, in beam radii: exp(-2 * 16) is left out.
REACH = 4.0
#: Step of the surface integrals (m): a quarter of a wavelength, halved for the convergence.
STEP = 2.5e-4
SEED = 20250300


def db(power):
    return 10.0 * math.log10(power)


def width(z):
    """1/e radius of the field at z."""
    return WAIST * np.sqrt(1.0 + (z / RAYLEIGH) ** 2)


def inverse_curvature(z):
    """1/R_c of the wavefront at z, 0 at the focus."""
    return z / (z * z + RAYLEIGH**2)


def field(x, y, z):
    """The beam: complex amplitude of unit power."""
    w = width(z)
    r2 = x * x + y * y
    phase = K * z + 0.5 * K * r2 * inverse_curvature(z) - np.arctan(z / RAYLEIGH)
    return math.sqrt(2.0 / math.pi) / w * np.exp(-r2 / w**2 + 1j * phase)


def flux_factor(x, y, z, zx, zy):
    """khat . n dA per dx dy on the surface z(x, y) with slopes zx, zy."""
    c = inverse_curvature(z)
    kx, ky = x * c, y * c
    return (1.0 - kx * zx - ky * zy) / np.sqrt(1.0 + kx * kx + ky * ky)


def square_grid(z, step):
    reach = REACH * float(width(np.float64(z)))
    n = math.ceil(reach / step)
    line = step * np.arange(-n, n + 1)
    return np.meshgrid(line, line, indexing="ij")


def amplitude(surface, z, step):
    """b of a surface; `surface(x, y)` gives depth below the foot, its slopes and a mask."""
    x, y = square_grid(z, step)
    depth, zx, zy, lit = surface(x, y)
    at = z + depth
    value = field(x, y, at) ** 2 * flux_factor(x, y, at, zx, zy)
    return complex(np.sum(np.where(lit, value, 0.0))) * step * step


def plane(tilt):
    t = math.tan(tilt)
    return lambda x, y: (t * x, t + 0 * x, 0 * x, np.ones_like(x, bool))


def sphere(a, aside=0.0):
    """Radius a, convex to the radar if a > 0; its axis `aside` of the beam's."""

    def shape(x, y):
        u = x - aside
        r2 = u * u + y * y
        lit = r2 < a * a * (1.0 - 1e-9)
        root = np.sqrt(np.where(lit, a * a - r2, a * a))
        sign = math.copysign(1.0, a)
        # The apex is moved so that the surface crosses the beam's axis at the foot.
        foot = abs(a) - math.sqrt(a * a - aside * aside)
        return sign * (abs(a) - root - foot), sign * u / root, sign * y / root, lit

    return shape


def paraboloid(a):
    return lambda x, y: ((x * x + y * y) / (2 * a), x / a, y / a, np.ones_like(x, bool))


def cylinder(a, tilt):
    """Radius a, its axis along y, tilted by `tilt` in the y-z plane about the foot."""

    def shape(x, y):
        lit = x * x < a * a * (1.0 - 1e-9)
        root = np.sqrt(np.where(lit, a * a - x * x, a * a))
        c, s = math.cos(tilt), math.sin(tilt)
        return (a - root + y * s) / c, x / root / c, s / c + 0 * y, lit

    return shape


def closed_quadratic(z, hxx, hyy, sx=0.0, sy=0.0):
    """|b|^2 of a quadratic surface with curvatures h and slopes s at the foot."""
    w, c = float(width(z)), inverse_curvature(z)
    dw2 = (WAVELENGTH / (2 * math.pi * w)) ** 2
    mx = dw2 + w * w / 4 * (hxx + c) ** 2
    my = dw2 + w * w / 4 * (hyy + c) ** 2
    return dw2 / math.sqrt(mx * my) * math.exp(-sx * sx / mx - sy * sy / my)


def surface_row(surface, z, closed, agree_db, **what):
    """One value with its convergence; asserts that it agrees with the closed form."""
    fine = db(abs(amplitude(surface, z, STEP / 2)) ** 2)
    coarse = db(abs(amplitude(surface, z, STEP)) ** 2)
    assert abs(fine - coarse) < 1e-4, (what, fine, coarse)
    row = dict(what, z_m=z, ratio_db=fine, convergence_db=abs(fine - coarse))
    if closed is not None:
        row["closed_form_db"] = db(closed)
        assert abs(fine - db(closed)) < agree_db, (what, z, fine, db(closed))
    return row


def mirrors():
    rows = []
    for z in PLACES:
        for n in [0.0, 0.3, 0.7, 1.0, 1.5]:
            tilt = n * DELTA0
            closed = math.exp(-((math.tan(tilt) / DELTA0) ** 2)) / (1 + (z / RAYLEIGH) ** 2)
            # The depth varies across the spot, so w does: 1e-4 of z_R.
            rows.append(surface_row(plane(tilt), z, closed, 5e-3, tilt_delta0=n, tilt_rad=tilt))
    return rows


def spheres():
    rows = []
    for a in [0.05, 0.15, 0.5, -0.5, -0.15]:
        for z in PLACES:
            closed = closed_quadratic(z, 1 / a, 1 / a)
            # The closed form is that of the paraboloid; 1/(ka)^2 parts it from the sphere.
            exact = db(abs(amplitude(paraboloid(a), z, STEP)) ** 2)
            assert abs(exact - db(closed)) < 5e-3, (a, z, exact, db(closed))
            rows.append(surface_row(sphere(a), z, closed, 3e-3, radius_m=a, aside_w0=0.0))
    for a in [0.15, 0.5]:
        for z in [0.0, 0.2]:
            for n in [0.5, 1.0]:
                s = n * WAIST
                closed = closed_quadratic(z, 1 / a, 1 / a, s / math.sqrt(a * a - s * s))
                # The curvature of the sphere is not constant aside of its apex.
                rows.append(surface_row(sphere(a, s), z, closed, 0.15, radius_m=a, aside_w0=n))
    return rows


def cylinders():
    rows = []
    for a in [0.05, 0.15, 0.5]:
        for z in PLACES:
            for n in [0.0, 0.5]:
                t = n * DELTA0
                closed = closed_quadratic(z, 1 / a, 0.0, 0.0, math.tan(t))
                rows.append(
                    surface_row(cylinder(a, t), z, closed, 3e-3, radius_m=a, tilt_delta0=n, tilt_rad=t)
                )
    return rows


def complex_erfc(value):
    """erfc by its series: enough for |value| < 4."""
    term, total = value, value
    for n in range(1, 120):
        term = -term * value * value / n
        total += term / (2 * n + 1)
    return 1.0 - 2.0 / math.sqrt(math.pi) * total


def edge_amplitude(s, z, nodes):
    """b of the facing mirror x > s: Gauss-Legendre across the edge, trapezoids along it."""
    reach = REACH * float(width(z))
    t, weight = np.polynomial.legendre.leggauss(nodes)
    start = s
    half = 0.5 * (reach - start)
    x = start + half * (1 + t)
    step = STEP if nodes < 300 else STEP / 2
    y = step * np.arange(-math.ceil(reach / step), math.ceil(reach / step) + 1)
    gx, gy = np.meshgrid(x, y, indexing="ij")
    zero = 0 * gx
    value = field(gx, gy, z + zero) ** 2 * flux_factor(gx, gy, z + zero, zero, zero)
    return complex(np.sum(weight[:, None] * value)) * half * step


def edges():
    rows = []
    for z in [0.0, 0.2]:
        for n in [-1.0, -0.5, 0.0, 0.5, 1.0]:
            s = n * WAIST
            fine, coarse = (db(abs(edge_amplitude(s, z, m)) ** 2) for m in (400, 200))
            zeta, w = z / RAYLEIGH, float(width(z))
            q = np.sqrt(complex(1.0, -zeta))
            closed = abs(0.5 * complex_erfc(math.sqrt(2) * s / w * q)) ** 2 / (1 + zeta**2)
            # 1e-3: the field off the axis is not quite across the wavefront (flux_factor).
            assert abs(fine - db(closed)) < 1e-3, (n, z, fine, db(closed))
            assert abs(fine - coarse) < 1e-6
            a = 0.5 * math.erfc(math.sqrt(2) * s / w)
            rows.append(
                dict(
                    edge_w0=n,
                    edge_m=s,
                    z_m=z,
                    ratio_db=fine,
                    closed_form_db=db(closed),
                    visible_share_squared_db=db(a * a / (1 + zeta**2)),
                    convergence_db=abs(fine - coarse),
                )
            )
    middle = [r for r in rows if r["edge_w0"] == 0.0 and r["z_m"] == 0.0][0]
    assert abs(middle["ratio_db"] + 6.0206) < 1e-3, middle
    return rows


def corner_amplitude(s, z, step):
    """Two mirrors at right angles, their edge along y at x = s and depth z, facing the radar.

    The images of a right-angled corner of infinite mirrors are exact: the field of the two
    bounces is the beam turned by half a turn about the edge, and the one-bounce images leave
    sideways. The plane through the edge across the axis collects it.
    """
    x, y = square_grid(z, step)
    zero = 0 * x
    return complex(np.sum(field(x, y, z + zero) * field(2 * s - x, y, z + zero))) * step * step


def corners():
    rows = []
    for z in PLACES:
        for n in [0.0, 0.25, 0.5, 1.0]:
            s = n * WAIST
            w = float(width(z))
            fine, coarse = (db(abs(corner_amplitude(s, z, h)) ** 2) for h in (STEP / 2, STEP))
            closed = math.exp(-4 * s * s / w**2) / (1 + (z / RAYLEIGH) ** 2)
            assert abs(fine - db(closed)) < 1e-6, (n, z, fine, db(closed))
            rows.append(
                dict(
                    edge_w0=n,
                    edge_m=s,
                    z_m=z,
                    ratio_db=fine,
                    closed_form_db=db(closed),
                    convergence_db=abs(fine - coarse),
                )
            )
    return rows


def diffuse_power(z, tilt, start, nodes):
    """lambda^2 * integral of (1/pi) cos(theta) u^2 over the plane's part x > start."""
    reach = 3.0 * float(width(abs(z) + 0.15))
    t, weight = np.polynomial.legendre.leggauss(nodes)
    lower = max(start, -reach)
    half = 0.5 * (reach - lower)
    x = lower + half * (1 + t)
    y = reach * t
    gx, gy = np.meshgrid(x, y, indexing="ij")
    w = width(z + math.tan(tilt) * gx)
    u = 2 / (math.pi * w**2) * np.exp(-2 * (gx**2 + gy**2) / w**2)
    total = np.sum(weight[:, None] * weight[None, :] * u * u) * half * reach
    return WAVELENGTH**2 / math.pi * math.cos(tilt) * float(total)


def diffuse():
    rows = []
    cases = [(z, t, None) for z in PLACES + [RAYLEIGH, -RAYLEIGH] for t in (0.0, 30.0, 60.0)]
    cases += [(z, 0.0, n) for z in (0.0, 0.2) for n in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    for z, degrees, edge in cases:
        tilt, start = math.radians(degrees), -math.inf if edge is None else edge * WAIST
        fine, coarse = (db(diffuse_power(z, tilt, start, m)) for m in (240, 120))
        w = float(width(z))
        closed = math.cos(tilt) / math.pi * WAVELENGTH**2 / (math.pi * w**2)
        if edge is not None:
            closed *= 0.5 * math.erfc(2 * start / w)
        # A plane at 60 degrees runs through 50 mm of depth, over which w varies.
        assert abs(fine - db(closed)) < (1e-6 if degrees == 0.0 else 0.02), (z, degrees, edge)
        row = dict(z_m=z, tilt_deg=degrees, ratio_db=fine, closed_form_db=db(closed))
        if edge is not None:
            row["edge_w0"] = edge
        rows.append(dict(row, convergence_db=abs(fine - coarse)))
    return rows


def screen_power(w, g, length, s):
    """Mean |b|^2 of a random phase screen: a 1-D integral over the lag (a Hankel transform)."""
    lag = np.linspace(0.0, 6.0 * WAIST, 12_001)
    turn = np.linspace(0.0, math.pi, 181)
    bessel = np.cos(2 * K * s * lag[:, None] * np.cos(turn)[None, :])
    bessel = np.trapezoid(bessel, turn, axis=1) / math.pi
    rho = np.exp(-((lag / length) ** 2))
    body = np.exp(-((lag / WAIST) ** 2)) * bessel * lag
    total = np.trapezoid(body * np.exp(-g * (1 - rho)), lag)
    coherent = (WAIST / w) ** 2 * math.exp(-g - (K * s * WAIST) ** 2)
    return float(2 / w**2 * total), coherent


def heights(rng, n, step, sd, length):
    """Two independent periodic n x n maps of Gaussian correlation exp(-(lag/length)^2)."""
    q = 2 * math.pi * np.fft.fftfreq(n, step)
    gain = np.exp(-(q**2) * length**2 / 8)
    gain = gain[:, None] * gain[None, :]
    gain *= sd / math.sqrt(np.mean(gain**2))
    noise = rng.standard_normal((n, n)) + 1j * rng.standard_normal((n, n))
    both = np.fft.ifft2(np.fft.fft2(noise) * gain)
    return both.real, both.imag


def rough_amplitudes(h, step, z, slopes):
    """b of the surface z + h(x, y) + s x, and of s y and the opposite slopes, for each slope."""
    n = h.shape[0]
    line = step * (np.arange(n) - n // 2)
    x, y = line[:, None], line[None, :]
    e = field(x, y, np.full_like(h, z)) ** 2 * np.exp(2j * K * h) * step * step
    rows, columns = e.sum(axis=1), e.sum(axis=0)
    turns = np.exp(2j * K * np.asarray(slopes)[:, None] * line[None, :])
    return np.stack([turns @ rows, turns.conj() @ rows, turns @ columns, turns.conj() @ columns])


ROUGH = [
    # slope m, correlation length (m), step (m), realisations
    (0.02, 5e-3, 5e-4, 3000),
    (0.02, 1e-2, 5e-4, 3000),
    (0.05, 2.5e-3, 5e-4, 3000),
    (0.05, 5e-3, 5e-4, 3000),
    (0.05, 1e-2, 5e-4, 3000),
    (0.2, 4e-3, 2.5e-4, 800),
]


def rough():
    """Heights of Gaussian correlation: m = 2 sd/length is Beckmann's slope (not of one axis)."""
    rows = []
    for number, (m, length, step, count) in enumerate(ROUGH):
        for z in (0.0, 0.3):
            if z > 0.0 and number not in (1, 4):
                continue
            rng = np.random.default_rng([SEED, number, int(z * 1000)])
            w, sd = float(width(z)), 0.5 * m * length
            g = (2 * K * sd) ** 2
            slopes = [0.0, 0.5 * DELTA0, DELTA0, 0.5 * m, m]
            n = 2 * math.ceil(3.2 * w / step)
            collected, halved = [], 0.0
            for _ in range(count // 2):
                for h in heights(rng, n, step, sd, length):
                    collected.append(rough_amplitudes(h, step, z, slopes))
            for _ in range(10):
                for h in heights(rng, 2 * n, step / 2, sd, length):
                    fine = rough_amplitudes(h, step / 2, z, slopes)
                    coarse = rough_amplitudes(h[::2, ::2], step, z, slopes)
                    halved = max(halved, float(np.max(np.abs(np.abs(fine) ** 2 - np.abs(coarse) ** 2))))
            b = np.array(collected)
            for i, s in enumerate(slopes):
                power = np.mean(np.abs(b[:, :, i]) ** 2, axis=1)
                if i == 0:
                    power = np.abs(b[:, 0, 0]) ** 2
                mean, error = float(np.mean(power)), float(np.std(power) / math.sqrt(count))
                coherent = abs(complex(np.mean(b[:, 0, i]))) ** 2
                total, mirror = screen_power(w, g, length, s)
                # Geometric optics; it holds for large g only, and is recorded beside the rest.
                lobe = m * m + DELTA0**2
                beckmann = (WAVELENGTH / (2 * math.pi * w)) ** 2 / lobe * math.exp(-s * s / lobe)
                if g > 20.0:
                    assert abs(db(total / beckmann)) < 0.25, (m, length, s)
                assert abs(mean - total) < 4.5 * error + 1e-6, (m, length, z, s, mean, total, error)
                # An average of `count` amplitudes leaves power/count of the incoherent part.
                assert abs(math.sqrt(coherent) - math.sqrt(mirror)) < 4 * math.sqrt(mean / count)
                rows.append(
                    dict(
                        m=m,
                        rms_height_m=sd,
                        correlation_length_m=length,
                        phase_variance=g,
                        z_m=z,
                        slope=s,
                        slope_delta0=s / DELTA0,
                        realisations=count,
                        mean_ratio_db=db(mean),
                        standard_error_db=10 / math.log(10) * error / mean,
                        coherent_ratio=coherent,
                        screen_total_db=db(total),
                        screen_coherent_ratio=mirror,
                        screen_incoherent_ratio=total - mirror,
                        beckmann_convolved_db=db(beckmann),
                        convergence_ratio=halved,
                    )
                )
    return rows


def beam_shifted(p, d, z):
    return field(p[0] - d, p[1], z + 0 * p[0])


def beam_turned(p, d, z):
    """The beam turned about a pivot FOCUS before the focus, so that its foot moves by d."""
    angle = math.atan2(d, FOCUS + z)
    c, s = math.cos(angle), math.sin(angle)
    depth = FOCUS + z
    return field(c * p[0] - s * depth, p[1], s * p[0] + c * depth - FOCUS)


def beam_on_turned_target(p, turn, z):
    return field(p[0] * math.cos(turn), p[1], z + p[0] * math.sin(turn))


def beam_of_receiver(p, beta, z):
    """E_t E_r of a receiver whose beam crosses the axis at the foot under the angle beta."""
    other = field(p[0] * math.cos(beta), p[1], z + p[0] * math.sin(beta))
    return np.sqrt(field(p[0], p[1], z + 0 * p[0]) * other + 0j)


STEPS_W0 = [0.0, 0.25, 0.5, 1.0, 1.5]
SCATTERERS = (50, 40)
DRAWS, SETS = 1000, 24


def speckle_cases(z):
    w, c = float(width(z)), inverse_curvature(z)
    dw = WAVELENGTH / (2 * math.pi * w)
    cases = []
    for n in STEPS_W0:
        d = n * WAIST
        cases.append(("shift", n, d, beam_shifted, math.exp(-((d / WAIST) ** 2))))
        bend = (0.5 * K * w * w) * (c - 1 / (FOCUS + z))
        cases.append(("pivot", n, d, beam_turned, math.exp(-((d / w) ** 2) * (1 + bend**2))))
    for n in [0.5, 1.0, 2.0, 3.0]:
        turn = n * DELTA0
        cases.append(("target turned", n, turn, beam_on_turned_target, math.exp(-((turn / dw) ** 2) / 4)))
    return cases


def quadrature_correlation(make, amount, z, step):
    x, y = square_grid(z, step)
    p = (x.ravel(), y.ravel())
    one, two = beam_shifted(p, 0.0, z) ** 2, make(p, amount, z) ** 2
    top = abs(np.vdot(two, one))
    return float(top / math.sqrt(np.sum(np.abs(one) ** 2) * np.sum(np.abs(two) ** 2)))


def receiver_rows(z):
    """Two receivers beta apart see the same scatterers: correlation of E_t E_r1 with E_t E_r2."""
    rows, w = [], float(width(z))
    dw = WAVELENGTH / (2 * math.pi * w)
    x, y = square_grid(z, STEP)
    p = (x.ravel(), y.ravel())
    et = beam_shifted(p, 0.0, z)
    for n in [1.0, 2.0, 4.0]:
        beta = n * DELTA0
        one = et * beam_on_turned_target(p, -beta / 2, z)
        two = et * beam_on_turned_target(p, beta / 2, z)
        value = abs(np.vdot(two, one)) / math.sqrt(np.sum(np.abs(one) ** 2) * np.sum(np.abs(two) ** 2))
        closed = math.exp(-((beta / dw) ** 2) / 16)
        assert abs(value - closed) < 1e-3, (n, value, closed)
        rows.append(dict(kind="receivers apart", z_m=z, amount_delta0=n, amount_rad=beta,
                         field_quadrature=float(value), field_closed_form=closed))
    return rows


def speckle():
    rows, statistics = [], []
    for z in (0.0, 0.3):
        rng = np.random.default_rng([SEED, 99, int(z * 1000)])
        cases = speckle_cases(z)
        half = 3.0 * float(width(z))
        nx, ny = SCATTERERS
        received = []
        for _ in range(SETS):
            i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
            x = half * (2 * (i + rng.random((nx, ny))) / nx - 1)
            y = half * (2 * (j + rng.random((nx, ny))) / ny - 1)
            p = (x.ravel(), y.ravel())
            beams = np.stack([make(p, amount, z) ** 2 for _, _, amount, make, _ in cases])
            a = rng.standard_normal((nx * ny, DRAWS)) + 1j * rng.standard_normal((nx * ny, DRAWS))
            received.append(beams @ a)
        b = np.concatenate(received, axis=1)
        intensity = np.abs(b) ** 2
        for number, (kind, n, amount, make, closed) in enumerate(cases):
            scale = math.sqrt(np.mean(intensity[0]) * np.mean(intensity[number]))
            correlation = abs(complex(np.mean(b[0] * b[number].conj()))) / scale
            exact = quadrature_correlation(make, amount, z, STEP)
            coarse = quadrature_correlation(make, amount, z, 2 * STEP)
            noise = 1 / math.sqrt(b.shape[1])
            assert abs(exact - closed) < 2e-3, (kind, n, z, exact, closed)
            assert abs(correlation - closed) < 4 * noise, (kind, n, z, correlation, closed)
            of_intensity = float(np.corrcoef(intensity[0], intensity[number])[0, 1])
            assert abs(of_intensity - closed**2) < 6 * noise, (kind, n, z, of_intensity, closed)
            unit = "w0" if kind != "target turned" else "delta0"
            rows.append(
                {
                    "kind": kind,
                    "z_m": z,
                    f"amount_{unit}": n,
                    "amount_m" if unit == "w0" else "amount_rad": amount,
                    "field_monte_carlo": correlation,
                    "intensity_monte_carlo": of_intensity,
                    "monte_carlo_error": noise,
                    "field_quadrature": exact,
                    "convergence": abs(exact - coarse),
                    "field_closed_form": closed,
                    "intensity_closed_form": closed**2,
                }
            )
        rows.extend(receiver_rows(z))
        level = np.sort(intensity[0] / np.mean(intensity[0]))
        law = 1 - np.exp(-level)
        distance = float(np.max(np.abs(law - (np.arange(level.size) + 0.5) / level.size)))
        contrast = float(np.std(intensity[0]) / np.mean(intensity[0]))
        assert abs(contrast - 1) < 4 * math.sqrt(2 / level.size), contrast
        assert distance < 1.63 / math.sqrt(level.size), distance
        statistics.append(
            dict(
                z_m=z,
                draws=int(level.size),
                scatterers=nx * ny,
                contrast=contrast,
                contrast_expected=1.0,
                second_moment=float(np.mean(level**2)),
                second_moment_expected=2.0,
                third_moment=float(np.mean(level**3)),
                third_moment_expected=6.0,
                distance_to_exponential=distance,
                distance_limit_1_percent=1.63 / math.sqrt(level.size),
            )
        )
    return rows, statistics


def rounded(value):
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, list):
        return [rounded(v) for v in value]
    if isinstance(value, float):
        return float(f"{value:.7g}")
    return value


def main():
    out = {
        "made_by": "python3 tests/validation/physical_optics.py",
        "units": "ratio_db = 10 log10(P_r/P); lengths in m, angles in rad unless the name says else; "
        "*_delta0 and *_w0 are multiples of delta0_rad and waist_m; slopes are tangents",
        "beam": dict(
            frequency_hz=FREQUENCY,
            waist_m=WAIST,
            focus_m=FOCUS,
            wavelength_m=WAVELENGTH,
            rayleigh_m=RAYLEIGH,
            delta0_rad=DELTA0,
        ),
    }
    parts = dict(
        flat_mirror=mirrors,
        sphere=spheres,
        cylinder=cylinders,
        mirror_edge=edges,
        dihedral=corners,
        diffuse=diffuse,
        rough=rough,
    )
    for name, make in parts.items():
        start = time.perf_counter()
        out[name] = make()
        worst = max(r.get("convergence_db", r.get("convergence_ratio", 0.0)) for r in out[name])
        print(f"{name:12} {len(out[name]):3} values, halving the step changes {worst:.1e}"
              f" ({time.perf_counter() - start:.0f} s)")
    start = time.perf_counter()
    out["speckle"], out["speckle_statistics"] = speckle()
    worst = max(r.get("convergence", 0.0) for r in out["speckle"])
    print(f"{'speckle':12} {len(out['speckle']):3} values, halving the step changes {worst:.1e}"
          f" ({time.perf_counter() - start:.0f} s)")
    path = pathlib.Path(__file__).with_suffix(".json")
    path.write_text(json.dumps(rounded(out), indent=1) + "\n")


if __name__ == "__main__":
    main()
