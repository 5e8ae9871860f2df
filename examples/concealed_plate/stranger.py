"""Scans by another generator: its own body, cloth, reflection laws and instrument, with no code of matdb."""

import numpy as np

SIDE, STEP_M = 40, 0.0105                       # the scan is a square of SIDE x SIDE chirps
MIDDLE_Y_M, RADAR_M = 1.1, np.array([0.0, 1.1, 8.0])
WAVELENGTH_M, WAIST_M = 299_792_458.0 / 300e9, 0.016 / np.sqrt(2 * np.log(2))
POWER_DBM, LOSS_DB, THRESHOLD_DBM, NOISE_DBM = 7.0, 12.5, -77.0, -88.4
RANGE_SD_M = 0.002
PARTING_M = 0.0111                              # nearer echoes of a chirp add up
BALL_M = 0.15
NAMES = ("scan", "chirp", "power_dbm", "range_m", "threat")

# The stranger's laws: level and slope of an exponential lobe, level and fall of a diffuse part.
SKIN = {"lobe": 0.08, "slope": 0.15, "diffuse": 0.0030, "fall": 1.4}
PLATE = {"lobe": 0.20, "slope": 0.10, "diffuse": 0.0120, "fall": 2.2}
CLOTH = {"lobe": 0.01, "slope": 0.20, "diffuse": 0.0008, "fall": 1.0}


def law(material, cosine):
    """The backscatter f, 1/sr: slopes of an exponential density, and cos^fall with a shallow dip at 45 degrees."""
    cosine = np.clip(cosine, 0.05, 1.0)
    slope = np.sqrt(1 - cosine**2) / cosine
    lobe = material["lobe"] / (2 * np.pi * material["slope"]**2) / 4 * np.exp(-slope / material["slope"]) / cosine**4
    sine = 2 * cosine * np.sqrt(1 - cosine**2)
    return lobe + material["diffuse"] * cosine**material["fall"] * (1 - 0.25 * sine**2)


def rays():
    """Where each chirp aims in the plane z = 0, line by line and upwards, and its unit direction."""
    y, x = np.meshgrid(*2 * [(np.arange(SIDE) - (SIDE - 1) / 2) * STEP_M], indexing="ij")
    aim = np.stack([x.ravel(), y.ravel() + MIDDLE_Y_M, np.zeros(SIDE**2)], 1)
    direction = aim - RADAR_M
    return aim, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def spot(number=20):
    """Offsets of rays over the beam, in beam radii: each stands for as much of the power there and back, exp(-4 r2)."""
    part = (np.arange(number) + 0.5) / number
    radius, turn = np.sqrt(-np.log(1 - part) / 4), np.pi * (3 - np.sqrt(5)) * np.arange(number)
    return radius * np.cos(turn), radius * np.sin(turn), np.full(number, 1 / number)


def field(rng, aim):
    """Complex speckle of unit mean power at each aim; beams d apart correlate as exp(-d2/w0^2)."""
    fine = STEP_M / 4
    count = 4 * SIDE + 48
    noise = rng.normal(size=(count, count)) + 1j * rng.normal(size=(count, count))
    wave = 2 * np.pi * np.fft.fftfreq(count, fine)
    smooth = np.exp(-WAIST_M**2 / 8 * (wave[:, None]**2 + wave**2))
    lattice = np.fft.ifft2(np.fft.fft2(noise) * smooth)
    lattice /= np.sqrt((np.abs(smooth)**2).mean() * 2)
    row = np.round((aim[:, 1] - MIDDLE_Y_M) / fine).astype(int) + count // 2
    return lattice[row, np.round(aim[:, 0] / fine).astype(int) + count // 2]


def waves(rng, number, shortest_m, longest_m, height_m):
    """A random sum of plane waves in x and y, as wave vector, phase and height."""
    length, turn = rng.uniform(shortest_m, longest_m, number), rng.uniform(0, np.pi, number)
    vector = 2 * np.pi / length[:, None] * np.stack([np.cos(turn), np.sin(turn)], 1)
    return vector, rng.uniform(0, 2 * np.pi, number), height_m * rng.normal(size=number) / np.sqrt(number)


def ripple(parts, x, y):
    """The sum of waves at x and y."""
    return sum(height * np.sin(vector[0] * x + vector[1] * y + phase) for vector, phase, height in zip(*parts))


class Person:
    """A torso without arms: its front is z = front(x, y), turned about the upright axis and leaning a little."""

    def __init__(self, rng):
        self.half_width, self.half_depth = rng.uniform(0.155, 0.20), rng.uniform(0.10, 0.14)
        self.waist, self.waist_y = rng.uniform(0.0, 0.14), rng.uniform(1.0, 1.1)
        self.belly, self.chest = rng.uniform(-0.01, 0.04), rng.uniform(0.0, 0.025)
        self.power = rng.uniform(2.1, 2.7)
        self.turn, self.lean, self.aside = rng.uniform(-0.25, 0.25), rng.uniform(-0.08, 0.08), rng.uniform(-0.01, 0.01)
        self.skin_waves = waves(rng, 6, 0.06, 0.25, 0.002)
        self.folds, self.loose = waves(rng, 8, 0.04, 0.16, 0.004), rng.uniform(0.022, 0.034)

    def front(self, x, y, cloth=False):
        """z of the skin, or of the cloth, at x and y; NaN beside the torso."""
        x = x - self.aside
        wide = self.half_width * (1 - self.waist * np.exp(-((y - self.waist_y) / 0.1)**2)) + self.loose * cloth
        across = np.abs(x / wide)
        z = self.half_depth * np.maximum(1 - across**self.power, 0)**(1 / self.power)
        z = z + self.belly * np.exp(-(x / 0.12)**2 - ((y - 1.02) / 0.09)**2)
        z = z + self.chest * np.exp(-((np.abs(x) - 0.08) / 0.06)**2 - ((y - 1.24) / 0.07)**2)
        z = z + self.turn * x * (1 - across**4) + self.lean * (y - MIDDLE_Y_M) - 0.02
        z = z + (self.loose + ripple(self.folds, x, y) if cloth else ripple(self.skin_waves, x, y))
        return np.where(across < 0.97, z, np.nan)


class Ball:
    """The front of a ball, for the calibration."""

    def front(self, x, y, cloth=False):
        """z of the ball at x and y; NaN beside it."""
        inside = BALL_M**2 - x**2 - (y - MIDDLE_Y_M)**2
        return np.where(inside > (0.05 * BALL_M)**2, np.sqrt(np.maximum(inside, 0)), np.nan)


def meet(front, x, y, direction):
    """Place and cosine of incidence where rays that pass (x, y, 0) meet z = front(x, y)."""
    lean_x, lean_y = direction[..., 0] / direction[..., 2], direction[..., 1] / direction[..., 2]
    z = np.full(x.shape, 0.1)
    for _ in range(6):
        z = front(x + z * lean_x, y + z * lean_y)
    place = np.stack([x + z * lean_x, y + z * lean_y, z], -1)
    d = 1e-4
    slope_x = (front(place[..., 0] + d, place[..., 1]) - front(place[..., 0] - d, place[..., 1])) / (2 * d)
    slope_y = (front(place[..., 0], place[..., 1] + d) - front(place[..., 0], place[..., 1] - d)) / (2 * d)
    normal = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], -1)
    return place, -(normal * direction).sum(-1) / np.linalg.norm(normal, axis=-1)


class Plate:
    """A flat plate on the skin, nowhere in it."""

    def __init__(self, rng, person):
        while True:
            x, y = rng.uniform(-0.11, 0.11), rng.uniform(1.0, 1.2)
            half = rng.uniform(0.022, 0.055, 2)
            d = 0.01
            slope_x = (person.front(x + d, y) - person.front(x - d, y)) / (2 * d)
            slope_y = (person.front(x, y + d) - person.front(x, y - d)) / (2 * d)
            self.normal = np.array([-slope_x, -slope_y, 1]) / np.sqrt(1 + slope_x**2 + slope_y**2)
            if not self.normal[2] > np.cos(np.radians(45)):
                continue
            turn = rng.uniform(-0.5, 0.5)
            up = np.cross(self.normal, [np.cos(turn), np.sin(turn), 0])
            self.up = up / np.linalg.norm(up)
            self.right, self.half = np.cross(self.up, self.normal), half
            s, t = np.meshgrid(np.linspace(-half[0], half[0], 15), np.linspace(-half[1], half[1], 15))
            under = np.array([x, y, person.front(x, y)]) + s[..., None] * self.right + t[..., None] * self.up
            rise = (person.front(under[..., 0], under[..., 1]) - under[..., 2]) * self.normal[2]
            lift = np.max(rise) + rng.uniform(0.0005, 0.003) + rng.uniform(0.002, 0.005)
            top = under + lift * self.normal
            if np.min(person.front(top[..., 0], top[..., 1], cloth=True) - top[..., 2]) > 0.004:
                self.middle = np.array([x, y, person.front(x, y)]) + lift * self.normal
                return

    def meet(self, x, y, direction):
        """Place on the plate and cosine of incidence; NaN beside it."""
        origin = np.stack([x, y, np.zeros_like(x)], -1)
        cosine = -(direction @ self.normal)
        along = ((self.middle - origin) @ self.normal) / -cosine
        place = origin + along[..., None] * direction
        off = place - self.middle
        inside = (np.abs(off @ self.right) < self.half[0]) & (np.abs(off @ self.up) < self.half[1])
        return np.where(inside[..., None], place, np.nan), cosine


def beam_power(cosine, z, material, weight):
    """Mean power of one surface in mW: f cos over the beam, and the share that the beam loses out of its focus."""
    radius2 = WAIST_M**2 * (1 + (z * WAVELENGTH_M / (np.pi * WAIST_M**2))**2)
    level = 10**((POWER_DBM - LOSS_DB) / 10) * WAVELENGTH_M**2 / (np.pi * radius2)
    power = weight * level * law(material, cosine) * cosine
    return np.where(np.isfinite(z), np.nan_to_num(power), 0.0)


def vary(rng, material, level_db, slope):
    """A material of another level and lobe."""
    factor = 10**(rng.normal(0, level_db) / 10)
    return dict(material, diffuse=material["diffuse"] * factor, lobe=material["lobe"] * factor,
                slope=material["slope"] * np.exp(rng.normal(0, slope)))


def unseen(rng, aim):
    """What no training scan has: gain of each chirp, dB; sd of the angle; loss of a covering layer, dB."""
    x, y, time = aim[:, 0] / 0.21, (aim[:, 1] - MIDDLE_Y_M) / 0.21, np.linspace(0, 1, len(aim))
    gain, tilt, loss = np.full(len(aim), rng.normal(0, 1.0)), 0.0, np.zeros(len(aim))
    if rng.random() < 0.5:                      # gain over the field of view, off its centre
        gain -= rng.uniform(1, 4) * ((x - rng.uniform(-0.5, 0.5))**2 + (y - rng.uniform(-0.5, 0.5))**2) / 2
    if rng.random() < 0.5:                      # drift: a warm-up and a slow wave
        gain += rng.uniform(-2, 2) * np.exp(-4 * time)
        gain += rng.uniform(0, 1) * np.sin(2 * np.pi * (2 * time + rng.random()))
    if rng.random() < 0.5:                      # normals are not those of the smooth shape
        tilt = np.radians(rng.uniform(1, 6))
    if rng.random() < 0.5:                      # a pocket or a damp place
        wide, high = rng.uniform(0.04, 0.12, 2)
        middle = rng.uniform(-0.12, 0.12, 2)
        inside = (np.abs(aim[:, 0] - middle[0]) < wide) & (np.abs(aim[:, 1] - MIDDLE_Y_M - middle[1]) < high)
        loss = np.where(inside, rng.uniform(1, 5), 0.0)
    return gain, tilt, loss


def scan(rng, person, skin, plate=None, plate_material=None, clothed=True, effects=False):
    """One scan: a row for each echo above the threshold, and one of NaN for each chirp without any."""
    aim, direction = rays()
    gain, angle_sd, loss_db = unseen(rng, aim) if effects else (0.0, 0.0, np.zeros(len(aim)))
    bend = angle_sd * rng.normal(size=(len(aim), 1)) if effects else 0.0
    across, upwards, weight = spot()
    x, y, d = aim[:, :1] + WAIST_M * across, aim[:, 1:2] + WAIST_M * upwards, direction[:, None]

    def surface(place, cosine, material):
        """Power of each ray of each chirp, range, and speckle."""
        bent = np.maximum(np.cos(np.arccos(np.clip(cosine, -1, 1)) + bend), 0)
        power = beam_power(bent, place[..., 2], material, weight)
        return [power, np.linalg.norm(place - RADAR_M, axis=-1), field(rng, aim)]

    body, cosine = meet(person.front, x, y, d)
    behind = [surface(body, cosine, skin)]
    threat = np.zeros(len(aim), bool)
    if plate:
        place, cosine = plate.meet(x, y, d)
        before = np.isfinite(place[..., 2]) & ~(place[..., 2] < body[..., 2])
        behind.append(surface(place, cosine, plate_material))
        behind[0][0] = np.where(before, 0.0, behind[0][0])
        behind[1][0] = np.where(before, behind[1][0], 0.0)
        threat = before[:, 0]
    echoes = [behind]
    if clothed:
        place, cosine = meet(lambda a, b: person.front(a, b, cloth=True), x, y, d)
        lost_db = (rng.uniform(1.0, 4.0) + loss_db[:, None]) / np.clip(cosine, 0.2, 1)
        for part in behind:
            part[0] = part[0] * np.where(np.isfinite(place[..., 2]), 10**(-lost_db / 10), 1.0)
        power, distance, speckle = surface(place, cosine, CLOTH)
        near = (np.abs(mean_range([[power, distance, speckle]]) - mean_range(behind)) < PARTING_M)[:, None]
        echoes = [[*behind, [power * near, distance, speckle]], [[power * ~near, distance, speckle]]]
    power_dbm, range_m = (np.concatenate(parts) for parts in zip(*(receive(rng, parts, gain) for parts in echoes)))
    chirp = np.tile(np.arange(len(aim), dtype=np.int32), len(echoes))
    echo = power_dbm > THRESHOLD_DBM
    silent = np.setdiff1d(chirp, chirp[echo])
    chirp = np.concatenate([chirp[echo], silent])
    power_dbm, range_m = (np.pad(v[echo], (0, len(silent)), constant_values=np.nan) for v in (power_dbm, range_m))
    place = RADAR_M + direction[chirp] * range_m[:, None]
    return {"chirp": chirp, "power_dbm": power_dbm, "range_m": range_m, "threat": threat[chirp], "place": place}


def mean_range(parts):
    """The range of the echo of several surfaces, weighted by power; NaN where nothing returns."""
    power = sum(part[0].sum(1) for part in parts)
    total = sum(np.nansum(part[0] * np.nan_to_num(part[1]), 1) for part in parts)
    return np.where(power > 0, total / np.where(power > 0, power, 1), np.nan)


def receive(rng, parts, gain):
    """What the radar reports of surfaces whose waves add up: power in dBm with speckle and noise, and range."""
    wave = sum(np.sqrt(part[0].sum(1)) * part[2] for part in parts) * 10**(np.asarray(gain) / 20)
    noise = np.sqrt(10**(NOISE_DBM / 10) / 2) * (rng.normal(size=len(wave)) + 1j * rng.normal(size=len(wave)))
    distance = mean_range(parts)
    power = np.where(np.isfinite(distance), np.abs(wave + noise)**2, 1e-30)
    ratio = power / 10**(NOISE_DBM / 10)
    return 10 * np.log10(power), distance + RANGE_SD_M * np.sqrt(1 + 4 / ratio) * rng.normal(size=len(wave))


def scans(seed, count, effects):
    """Columns of count scans of as many persons, every second one with a plate."""
    tables = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        person = Person(rng)
        plate = Plate(rng, person) if number % 2 == 0 else None
        spread = (1.0, 0.15) if effects else (0.0, 0.0)
        one = scan(rng, person, vary(rng, SKIN, *spread), plate, vary(rng, PLATE, *spread), effects=effects)
        tables.append({**one, "scan": np.full(len(one["chirp"]), number, np.int32)})
    return {name: np.concatenate([table[name] for table in tables]) for name in NAMES}


def height_mesh(front, step_m=0.003):
    """Vertices and triangles of a surface z = front(x, y), as a laser scanner would give them."""
    x, y = np.meshgrid(np.arange(-0.23, 0.23, step_m), np.arange(0.86, 1.34, step_m))
    z = front(x, y)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    vertices = np.stack([x.ravel(), y.ravel(), z.ravel()], 1)
    faces = faces[np.isfinite(vertices[faces]).all((1, 2))]
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


def calibration(folder, seed):
    """Writes clouds of a bare person and of a ball of the plate's material, meshes of both, and the radar's rays."""
    aim, direction = rays()
    with open(folder / "rays.csv", "w") as file:
        file.write("chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n")
        for chirp, d in enumerate(direction):
            file.write(",".join([f"{chirp},{chirp * 2e-4:.4f}", *map(str, RADAR_M), *(f"{v:.9f}" for v in d)]) + "\n")
    rng = np.random.default_rng([seed, 10**6])
    for name, target, material in (("skin", Person(rng), SKIN), ("ball", Ball(), PLATE)):
        one = scan(rng, target, material, clothed=False)
        there = np.isfinite(one["power_dbm"])
        rows = np.column_stack([one["place"], one["power_dbm"], one["chirp"]])[there]
        np.savetxt(folder / f"{name}.csv", rows, "%.6f,%.6f,%.6f,%.3f,%d", comments="",
                   header="x_m,y_m,z_m,power_dbm,chirp")
        vertices, faces = height_mesh(target.front)
        with open(folder / f"{name}.obj", "w") as file:
            file.writelines("v {:.6f} {:.6f} {:.6f}\n".format(*v) for v in vertices)
            file.writelines("f {} {} {}\n".format(*f) for f in faces + 1)
