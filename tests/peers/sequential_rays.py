"""An independent sequential ray tracer in numpy, for the checks of corpus.py: exact irradiance and single rays.

It has only the keys of the lens file in common with the program. It samples a ray's path through a face's clear disc and
bisects the first change of side: the result is the first intersection and does not depend on a start value.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import zemax_file
from numpy.polynomial import polynomial

SAMPLES = 48  # along a ray's path through a clear disc
BISECTIONS = 14  # of a step of that path; Newton's method then converges to rounding within the remaining step
NEWTON_STEPS = 2


@dataclass
class Face:
    z: float
    curvature: float
    conic: float
    clear_radius: float
    index_after: float
    even: np.ndarray = None  # coefficients of r^0, r^2, r^4, ...
    odd: np.ndarray = None  # coefficients of r, r^3, r^5, ...
    q_bfs: tuple = None  # (radius, coefficients of x^0, x^1, ... with x = (r / radius)^2)
    q_con: tuple = None

    def sag(self, r):
        return self.sag_and_slope(r)[0]

    def sag_and_slope(self, r):
        """z(r) and dz/dr; NaN beyond the end of a conic."""
        r2 = r * r
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(1 - (1 + self.conic) * self.curvature**2 * r2)
            z = self.curvature * r2 / (1 + root)
            slope = self.curvature * r / root
        if self.even is not None:
            z = z + polynomial.polyval(r2, self.even)
            slope = slope + 2 * r * polynomial.polyval(r2, polynomial.polyder(self.even))
        if self.odd is not None:
            value, derivative = (polynomial.polyval(r2, c) for c in (self.odd, polynomial.polyder(self.odd)))
            z = z + r * value
            slope = slope + value + 2 * r2 * derivative
        if self.q_con is not None:
            radius, series = self.q_con
            x = r2 / radius**2
            value, derivative = (polynomial.polyval(x, c) for c in (series, polynomial.polyder(series)))
            z = z + x**2 * value
            slope = slope + (2 * x * value + x**2 * derivative) * 2 * r / radius**2
        if self.q_bfs is not None:
            radius, series = self.q_bfs
            x = r2 / radius**2
            value, derivative = (polynomial.polyval(x, c) for c in (series, polynomial.polyder(series)))
            with np.errstate(invalid="ignore", divide="ignore"):
                cosine = np.sqrt(1 - self.curvature**2 * r2)
            shape, by_x = x * (1 - x) * value, (1 - 2 * x) * value + x * (1 - x) * derivative
            z = z + shape / cosine
            slope = slope + by_x * 2 * r / radius**2 / cosine + shape * self.curvature**2 * r / cosine**3
        return z, slope


def q_con_series(coefficients):
    """Forbes's Qcon: Jacobi polynomials P_m^(0,4)(2x - 1), as one polynomial in x."""
    t = np.array([-1.0, 2.0])
    family = [np.array([1.0]), np.array([-5.0, 6.0])]
    for m in range(1, len(coefficients)):
        a = 2 * (m + 1) * (m + 5) * (2 * m + 4)
        b, c = (2 * m + 5) * -16.0, (2 * m + 4.0) * (2 * m + 5) * (2 * m + 6)
        d = 2 * m * (m + 4) * (2 * m + 6.0)
        following = polynomial.polysub(polynomial.polymul(polynomial.polyadd([b], c * t), family[m]), d * family[m - 1])
        family.append(following / a)
    return summed(coefficients, family)


def q_bfs_series(coefficients):
    """Forbes's Qbfs by his recurrence, as one polynomial in x."""
    p = [np.array([2.0]), np.array([6.0, -8.0])]
    f, g, h = [2.0, math.sqrt(19) / 2], [-0.5], []
    family = [np.array([1.0]), np.array([13.0, -16.0]) / math.sqrt(19)]
    for n in range(2, len(coefficients)):
        p.append(polynomial.polysub(polynomial.polymul([2.0, -4.0], p[n - 1]), p[n - 2]))
        h.append(-n * (n - 1) / (2 * f[n - 2]))
        g.append(-(1 + g[n - 2] * h[n - 2]) / f[n - 1])
        f.append(math.sqrt(n * (n + 1) + 3 - g[n - 1] ** 2 - h[n - 2] ** 2))
        rest = polynomial.polyadd(g[n - 1] * family[n - 1], h[n - 2] * family[n - 2])
        family.append(polynomial.polysub(p[n], rest) / f[n])
    return summed(coefficients, family)


def summed(coefficients, family):
    series = np.zeros(1)
    for coefficient, member in zip(coefficients, family):
        series = polynomial.polyadd(series, coefficient * member)
    return series


@dataclass
class Stop:
    gap: int  # the stop's plane is met by the ray before face number `gap` (from 0); len(faces): behind the last
    z: float
    radius: float
    face: int = -1  # the stop is this face's own rim


@dataclass
class Lens:
    faces: list
    stops: list = field(default_factory=list)
    mount: tuple = None  # (z of its rear rim, radius)
    image_z: float = 0.0

    def index_before(self, i):
        return self.faces[i - 1].index_after if i else 1.0


def from_lens_json(lens, printed_indices):
    """The lens of a lens.json; `printed_indices` are for catalogue glasses, whose data only the program has."""
    made, numbers, last_of_element = [], iter(printed_indices), []
    for element in lens["elements"]:
        for face in element["faces"]:
            made.append(face_of(face, lens, next(numbers)))
        last_of_element.append((len(made), made[-1].z))
    stops = []
    for stop in lens["stops"]:
        radius = stop.get("opening_radius_mm", math.inf)
        if "on_face" in stop:
            stops.append(Stop(-1, stop["z_mm"], radius, stop["on_face"] - 1))
            continue
        # Without "before_face" a stop is before the first element that ends behind it.
        gap = next((i for i, (_, z) in enumerate(last_of_element) if stop["z_mm"] < z), None)
        gap = len(made) if gap is None else last_of_element[gap - 1][0] if gap else 0
        stops.append(Stop(stop["before_face"] - 1 if "before_face" in stop else gap, stop["z_mm"], radius))
    mount = lens.get("mount")
    return Lens(made, stops, mount and (mount["to_z_mm"], mount["bore_radius_mm"]), lens["image_z_mm"])


def face_of(face, lens, printed_index):
    radius = face["radius_mm"]
    made = Face(
        face["z_mm"],
        1 / radius if radius is not None else 0.0,
        face.get("conic", 0.0),
        face["clear_radius_mm"],
        index_of(face, lens, printed_index),
    )
    if "even_asphere" in face or "r2" in face:
        made.even = np.array([0.0, face.get("r2", 0.0), *face.get("even_asphere", [])])
    if "odd_asphere" in face:
        made.odd = np.array([0.0, *face["odd_asphere"]])
    if "q_con" in face:
        made.q_con = (face["q_con"]["radius_mm"], q_con_series(face["q_con"]["coefficients"]))
    if "q_bfs" in face:
        made.q_bfs = (face["q_bfs"]["radius_mm"], q_bfs_series(face["q_bfs"]["coefficients"]))
    return made


def index_of(face, lens, printed):
    if "glass_after" not in face:
        return face.get("index_after", 1.0)
    glass = lens.get("glasses", {}).get(face["glass_after"], {})
    if "nd" in glass:
        return zemax_file.cauchy(glass["nd"], glass["vd"], lens["wavelength_nm"] / 1000)
    return printed


def intersect(face, radius, p, d):
    """Distance to the face within `radius` of its axis: the first intersection ahead of p, else the nearest behind; NaN: none.

    Intersections behind p are virtual: faces may overlap slightly near their rims, and design programs trace rays backwards.
    """
    rings = face.sag(np.linspace(0, radius, 400))
    low, high = np.nanmin(rings), np.nanmax(rings)
    margin = 1e-6 + 1e-3 * (high - low)
    low, high = face.z + low - margin, face.z + high + margin
    ends = np.sort([(low - p[2]) / d[2], (high - p[2]) / d[2]], axis=0)
    across = d[0] ** 2 + d[1] ** 2
    along = p[0] * d[0] + p[1] * d[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.sqrt(along**2 - across * (p[0] ** 2 + p[1] ** 2 - radius**2))
        parallel = across < 1e-24
        inside = p[0] ** 2 + p[1] ** 2 <= radius**2
        enter = np.where(parallel, np.where(inside, -np.inf, np.nan), (-along - half) / across)
        leave = np.where(parallel, np.where(inside, np.inf, np.nan), (-along + half) / across)
    begin, end = np.maximum(ends[0], enter), np.minimum(ends[1], leave)
    begin, end = np.where(begin < end, begin, np.nan), np.where(begin < end, end, np.nan)

    def above(t):
        r = np.sqrt((p[0] + t * d[0]) ** 2 + (p[1] + t * d[1]) ** 2)
        return p[2] + t * d[2] - face.z - face.sag(np.minimum(r, radius))

    steps = begin + np.linspace(0, 1, SAMPLES)[:, None] * (end - begin)
    sides = above(steps) > 0
    changes = sides[1:] != sides[:-1]
    ahead = changes & (steps[1:] >= 0)
    has_ahead, has_any = ahead.any(axis=0), changes.any(axis=0) & np.isfinite(begin)
    first = ahead.argmax(axis=0)
    nearest_behind = changes.shape[0] - 1 - changes[::-1].argmax(axis=0)
    step = np.where(has_ahead, first, nearest_behind)
    ray = np.arange(step.size)
    a, b, side = steps[step, ray], steps[step + 1, ray], sides[step, ray]
    for _ in range(BISECTIONS):
        middle = (a + b) / 2
        same = (above(middle) > 0) == side
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    t = (a + b) / 2
    for _ in range(NEWTON_STEPS):
        x, y = p[0] + t * d[0], p[1] + t * d[1]
        r = np.minimum(np.hypot(x, y), radius)
        sag, slope = face.sag_and_slope(r)
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = d[2] - slope * np.where(r > 0, (x * d[0] + y * d[1]) / r, 0)
            t = np.fmin(np.fmax(t - (p[2] + t * d[2] - face.z - sag) / rise, np.minimum(a, b)), np.maximum(a, b))
    return np.where(has_any, t, np.nan)


def refract(face, radius, before, behind, p, d):
    """(intersection, direction, transmittance, passes) of rays refracted from index `before` into `behind`."""
    t = intersect(face, radius, p, d)
    hit = p + t * d
    r = np.hypot(hit[0], hit[1])
    _, slope = face.sag_and_slope(np.minimum(r, radius))
    with np.errstate(divide="ignore", invalid="ignore"):
        towards = np.where(r > 0, slope / np.where(r > 0, r, 1), 0)
        normal = np.array([-towards * hit[0], -towards * hit[1], np.ones_like(r)])
        normal /= np.sqrt((normal**2).sum(axis=0))
        cosine = (normal * d).sum(axis=0)
        # A ray that meets the face from its other side has already passed it.
        right_side = cosine * d[2] > 0
        normal, cosine = normal * np.sign(cosine), np.abs(cosine)
        ratio = before / behind
        squared = 1 - ratio**2 * (1 - cosine**2)
        refracted = np.sqrt(squared)
        s = (before * cosine - behind * refracted) / (before * cosine + behind * refracted)
        q = (before * refracted - behind * cosine) / (before * refracted + behind * cosine)
        turned = ratio * d + (refracted - ratio * cosine) * normal
    passes = np.isfinite(t) & right_side & (squared > 0)
    return hit, turned, 1 - (s**2 + q**2) / 2, passes


def at_plane(p, d, z):
    return p + (z - p[2]) / d[2] * d


def pass_backwards(lens, p, d):
    """Rays from the sensor to the object side: (passed, p, d, transmittance), clipped by every semi-diameter and stop."""
    which, transmittance = np.arange(p.shape[1]), np.ones(p.shape[1])

    def keep(passes):
        nonlocal which, p, d, transmittance
        which, p, d, transmittance = which[passes], p[:, passes], d[:, passes], transmittance[passes]

    def within(z, radius):
        here = at_plane(p, d, z)
        keep(here[0] ** 2 + here[1] ** 2 <= radius**2)

    if lens.mount:
        within(*lens.mount)
    for i in range(len(lens.faces), -1, -1):
        for stop in lens.stops:
            if stop.gap == i and stop.face < 0:
                within(stop.z, stop.radius)
        if i == 0 or which.size == 0:
            break
        face = lens.faces[i - 1]
        radius = min([face.clear_radius] + [stop.radius for stop in lens.stops if stop.face == i - 1])
        p, d, here, passes = refract(face, radius, face.index_after, lens.index_before(i - 1), p, d)
        transmittance = transmittance * here
        keep(passes)
    keep(d[2] < 0)
    return which, p, d, transmittance


def irradiance(lens, height, sensor_z, emitter_z, emitter_half, seed=1):
    """(irradiance for radiance 1, its standard error) at a height on the sensor's diagonal.

    Rays are uniform in the direction cosines, the weight of irradiance. Lens and square emitter are symmetric about the plane
    of the diagonal, so half of the directions are enough.
    """
    random = np.random.default_rng(seed)
    last = lens.faces[-1]
    rings = last.z + last.sag(np.linspace(0, last.clear_radius, 400))
    near, far = sensor_z - np.nanmax(rings), sensor_z - np.nanmin(rings)
    if not near > 0:
        raise ValueError("the sensor is in front of the last face")
    tangents = [(side * last.clear_radius - height) / h for side in (-1, 1) for h in (near, far)]
    widest = last.clear_radius / near
    edges = [t / math.sqrt(1 + t * t + w * w) for t in tangents for w in (0, widest)]
    box = (min(edges), max(edges), 0.0, widest / math.sqrt(1 + widest**2))

    def traced(box, columns, rows):
        """Share of light of each cell, by one ray at a random place in it."""
        across, up = (random.uniform(size=(rows, columns)) + np.indices((rows, columns))[k] for k in (1, 0))
        dx = (box[0] + (box[1] - box[0]) * across / columns).ravel()
        dy = (box[2] + (box[3] - box[2]) * up / rows).ravel()
        possible = np.flatnonzero(dx * dx + dy * dy < 1)
        dx, dy = dx[possible], dy[possible]
        d = np.array([dx, dy, -np.sqrt(1 - dx * dx - dy * dy)])
        p = np.repeat(np.array([[height], [0.0], [sensor_z]]), dx.size, axis=1)
        which, p, d, transmittance = pass_backwards(lens, p, d)
        seen = at_plane(p, d, emitter_z)
        # The diagonal is the x axis here, so the square is rotated by 45 degrees.
        lit = (np.abs(seen[0]) + np.abs(seen[1]) < emitter_half * math.sqrt(2)) & (p[2] >= emitter_z)
        light = np.zeros(rows * columns)
        light[possible[which[lit]]] = transmittance[lit]
        return light.reshape(rows, columns)

    # Shrink the box until the passing rays fill enough of it.
    for _ in range(4):
        columns, rows = 120, 60
        found = traced(box, columns, rows) > 0
        if not found.any():
            return 0.0, (box[1] - box[0]) * (box[3] - box[2]) * 2 / (columns * rows)
        x, y = np.flatnonzero(found.any(axis=0)), np.flatnonzero(found.any(axis=1))
        dx, dy = (box[1] - box[0]) / columns, (box[3] - box[2]) / rows
        width, height_ = x[-1] - x[0] + 1, y[-1] - y[0] + 1
        box = (
            box[0] + (x[0] - 2) * dx,
            box[0] + (x[-1] + 3) * dx,
            max(0.0, box[2] + (y[0] - 2) * dy),
            box[2] + (y[-1] + 3) * dy,
        )
        if width > 30 and height_ > 15:
            break
    area = 2 * (box[1] - box[0]) * (box[3] - box[2])
    parts = [area * traced(box, 130, 65).mean() for _ in range(4)]
    return float(np.mean(parts)), float(np.std(parts, ddof=1) / 2)


def image_points(lens, starts, directions, image_z, widened=1.2):
    """Intersections of rays from the front with the image plane; NaN beyond `widened` times the semi-diameters."""
    p, d = np.array(starts, dtype=float).T, np.array(directions, dtype=float).T
    d = d / np.sqrt((d**2).sum(axis=0))
    lost = np.zeros(p.shape[1], dtype=bool)
    for i, face in enumerate(lens.faces):
        p, d, _, passes = refract(face, widened * face.clear_radius, lens.index_before(i), face.index_after, p, d)
        lost |= ~passes
    points = at_plane(p, d, image_z)
    points[:, lost | ~(d[2] > 0)] = np.nan
    return points.T
