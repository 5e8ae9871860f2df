"""What a scan meets: geometry of every chirp and its mean power, which an effect may change."""

import numpy as np
from scipy.spatial.transform import Rotation

import physics
import scan
import targets

LAWS = {}  # of each target and waist


class State:
    def __init__(self, base, name, w0, pattern="once"):
        self.base, self.name, self.w0, self.pattern = base, name, w0, pattern
        if (name, w0) not in LAWS:
            LAWS[name, w0] = physics.Law(base, w0, targets.MATERIALS[name])
        self.law = LAWS[name, w0]
        self.material = targets.MATERIALS[name]
        self.aim, self.time_s = scan.aims(pattern)
        self.n = len(self.aim)
        self.share = (np.arange(self.n) + 0.5) / self.n
        self.ray = scan.directions(self.aim)
        self.range_m = base["range_m"].copy()
        self.normal = base["normal"].astype(float)
        self.piece = base["piece"].astype(int)
        self.surface = self.aim.copy()  # where on the target, as x_t and y_t of the undisturbed scan
        self.slope_scale = np.ones(self.n)  # what multiplies the slope at which the lobe is looked up
        self.lobe_gain, self.rest_gain, self.gain = np.ones(self.n), np.ones(self.n), np.ones(self.n)
        self.added_mw = np.zeros(self.n)
        self.spread, self.spread_share = None, None  # what replaces the mean power and the share of the lobe
        self.draft = False  # while a size is sought, an effect may do with fewer chirps and leave the others silent
        self.ceiling_mw, self.noise_gain, self.looks = None, 1.0, None
        self.numbers = {}  # of each effect: forms that a report may state, as parameters with their true numbers
        self.tilt = np.zeros(self.n)
        self.grid_x, self.grid_y = scan.grid()
        shape = (len(self.grid_y), len(self.grid_x))
        self.grid_range = base["grid_range_m"].reshape(shape)
        self.grid_piece = base["grid_piece"].reshape(shape).astype(int)
        self.grid_normal = base["grid_normal"].reshape(shape + (3,)) / 32000.0

    def theta(self):
        if np.ndim(self.tilt) == 2:
            # the normal turned about two of its tangents, one in the plane of incidence; behind the horizon nothing returns
            theta, (along, across) = self.clean_theta(), np.tan(np.clip(self.tilt, -1.5, 1.5)).T
            cosine = np.cos(theta) + along * np.sin(theta)
            return np.arccos(np.clip(cosine / np.sqrt(1 + along**2 + across**2), 0.01, 1))
        return self.clean_theta()

    def clean_theta(self):
        return np.arccos(np.clip(-np.sum(self.normal * self.ray, 1), 0.01, 1))

    def scale_mw(self, range_m):
        """P_t L lambda^2/(pi w^2): what multiplies f cos^n."""
        w = physics.beam_width_m(self.w0, range_m)
        return physics.mw(physics.POWER_DBM - physics.loss_db(self.w0)) * physics.WAVELENGTH_M**2 / (np.pi * w**2)

    def delta(self, range_m):
        """Slopes over which the beam spreads a law: its kernel is exp(-s^2/delta^2)."""
        return physics.WAVELENGTH_M / (2 * np.pi * physics.beam_width_m(self.w0, range_m))

    def parts_mw(self, theta, range_m, slope_scale=1.0):
        delta = self.delta(range_m)
        power = 2 if self.material["footprint"] == "paper" else 1
        common = self.scale_mw(range_m) * np.cos(theta) ** power
        met = np.arctan(np.tan(theta) * slope_scale)
        # a lobe D/(4 cos^2 ...) ~ g(slope)/cos^6: only the density of slopes is stretched
        stretch = (np.cos(met) / np.cos(theta)) ** 6 if np.ndim(slope_scale) else 1.0
        return common * self.law.f(met, delta, "lobe") * stretch, common * self.law.f(theta, delta, "rest")

    def means_mw(self):
        """Mean echo of each chirp, 0 where it hits nothing, and the share of the lobe."""
        hit = self.range_m > 0
        safe = np.where(hit, self.range_m, 8.0)
        theta = np.where(hit, self.theta(), 0.0)
        lobe, rest = self.parts_mw(theta, safe, self.slope_scale if np.any(self.slope_scale != 1) else 1.0)
        lobe, rest = lobe * self.lobe_gain, rest * self.rest_gain
        whole = lobe + rest + self.added_mw
        total, share = np.where(hit, whole * self.gain, 0.0), lobe / whole
        if self.spread is not None:
            total, share = np.where(hit, self.spread * self.gain, 0.0), self.spread_share
        return total, share

    def seen_mw(self):
        """Mean power of each chirp: below a ceiling the mean, over speckle, of what the ceiling leaves of a look."""
        power = self.means_mw()[0]
        if self.ceiling_mw is None:
            return power
        return physics.below_ceiling(power, self.ceiling_mw)

    def move(self, shift, turn):
        """The target moves: for each chirp a shift, m, and a turn about the centre as a rotation vector, rad.

        Mitsuba traces the rays anew, each moved the other way against the target at rest."""
        import build_bases

        back = Rotation.from_rotvec(-turn)
        centre = targets.CENTRE
        origin = back.apply(scan.ORIGIN - centre - shift) + centre
        hits = build_bases.trace(*build_bases.load(self.name), origin, back.apply(self.ray), False)
        hit = hits["range"] > 0
        point = origin + hits["range"][:, None] * back.apply(self.ray) - scan.ORIGIN
        at = point[:, :2] / -np.where(hit, point[:, 2], -8.0)[:, None] * 8.0  # x_t, y_t of that place of the surface
        self.surface = np.where(hit[:, None], at, self.aim)
        self.range_m, self.piece = hits["range"], hits["piece"]
        self.normal = back.inv().apply(hits["normal"])

    def sub_rays(self, chirps, points, weight):
        """Weighted powers of the lobe and of the rest, mW, of rays through points around the aims at the target plane.

        Mitsuba traces them. Each has its own range, normal and law, as the single ray of a chirp has; what misses
        brings nothing. Returns lobe and rest, one row a chirp, and the hits."""
        import build_bases

        at = (self.aim[chirps, None, :] + points).reshape(-1, 2)
        ray = scan.directions(at)
        hits = build_bases.trace(*build_bases.load(self.name), scan.ORIGIN, ray, False)
        hit = hits["range"] > 0
        theta = np.where(hit, np.arccos(np.clip(-np.sum(hits["normal"] * ray, 1), 0.01, 1)), 0.0)
        shape = (len(chirps), len(points))
        lobe, rest = (np.where(hit, p, 0.0).reshape(shape) * weight
                      for p in self.parts_mw(theta, np.where(hit, hits["range"], physics.FOCUS_M)))
        return lobe, rest, {k: v.reshape(shape + v.shape[1:]) for k, v in hits.items()}
