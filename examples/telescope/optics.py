"""The Rubin telescope as rays see it: wavefronts over the field, and donuts in front of and behind the focus.

batoid traces the rays. Everything here is smooth in the positions of the optics and free of random numbers.
"""
import functools
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: products here are too small for more threads
try:
    import batoid
    import numpy as np
    MISSING = ""
except ModuleNotFoundError as problem:  # the scene is described without
    batoid = np = None
    MISSING = problem.name

WAVELENGTH_M = 622e-9  # the middle of the r band
FOCAL_LENGTH_M = 10.31
PUPIL_M, OBSCURED = 4.18, 0.612  # outer radius of M1, and the share of it that is a hole
FIELD_DEG = 1.75  # radius of the field
CORNERS_DEG = [(1.19, 1.19), (-1.19, 1.19), (-1.19, -1.19), (1.19, -1.19)]  # of the wavefront sensors R04, R44, R40, R00
DEFOCUS_M = 1.5e-3  # of their halves: in front of the focus, and behind it
PIXEL_M, TILE = 30e-6, 64  # a pixel is three by three of the detector's
POINTS = 12000  # of a donut: what a pixel gets varies by less than the noise of its photons
MIRRORS = {"M1": (4.18, 2.558), "M2": (1.71, 0.9), "M3": (2.508, 0.55)}  # outer and inner radius in m
SUBSTRATE_M = (4.18, 0.55)  # of M1 and M3, one piece of glass


def quadrature(rings, inner, spokes, turned=False):
    """Points of the unit disc outside a radius, and weights that add up to 1: Gauss and Legendre in r^2, equal angles."""
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    r = np.sqrt(inner**2 + (1 - inner**2) * (nodes + 1) / 2)
    angles = 2 * np.pi * (np.arange(spokes) + 0.5 * turned * (np.arange(rings)[:, None] % 2)) / spokes
    x, y = (r[:, None] * f(angles) * np.ones((rings, spokes)) for f in (np.cos, np.sin))
    return x.ravel(), y.ravel(), np.repeat(weights / 2 / spokes, spokes)


def need_batoid():
    if MISSING:
        raise ModuleNotFoundError(f"the Python package {MISSING} is not installed: pip install batoid numpy")


FIELDS = None if MISSING else quadrature(3, 0.0, 6, turned=True)
APERTURE = None if MISSING else quadrature(5, OBSCURED, 16)


def spiral(count, inner):
    """Points that fill the unit disc outside a radius evenly: Vogel's spiral."""
    k = np.arange(count) + 0.5
    r, angle = np.sqrt(inner**2 + (1 - inner**2) * k / count), k * np.pi * (3 - np.sqrt(5))
    return r * np.cos(angle), r * np.sin(angle)


def polynomials(x, y, order=9):
    """All products of powers up to an order, a column each."""
    return np.stack([x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)], axis=1)


@functools.cache
def design():
    """The telescope without errors."""
    batoid._batoid.set_nthreads(1)  # many short traces: more threads wait for each other
    return batoid.Optic.fromYaml("LSST_r.yaml")


def launch(optic, theta_x_deg, theta_y_deg, x, y):
    """Rays of a star through points of the entrance pupil, given in its radii; they start on one plane wave."""
    direction = np.array(batoid.utils.fieldToDirCos(np.deg2rad(theta_x_deg), np.deg2rad(theta_y_deg)))
    stop = optic.stopSurface.coordSys.origin
    r = stop + PUPIL_M * np.stack([x, y, np.zeros_like(x)], axis=1)
    r = r - np.outer((r - stop) @ direction + optic.backDist, direction)
    return batoid.RayVector(*r.T, *(np.full(len(r), part) for part in direction), 0.0, WAVELENGTH_M)


@functools.cache
def launched():
    """Rays of every field of the score, then rays of the corners."""
    fields = [launch(design(), FIELD_DEG * u, FIELD_DEG * v, *APERTURE[:2]) for u, v, _ in zip(*FIELDS)]
    corners = [launch(design(), u, v, *quadrature(9, OBSCURED, 24)[:2]) for u, v in CORNERS_DEG]
    return batoid.concatenateRayVectors(fields), batoid.concatenateRayVectors(corners)


@functools.cache
def pupil():
    """Points of a donut, how much of each the lenses of the camera let through in each corner, and what carries
    positions of rays to positions of points."""
    x, y = spiral(POINTS, OBSCURED)
    open_ = []
    for field in CORNERS_DEG:
        rays = launch(design(), *field, x, y)
        design().trace(rays)
        open_.append(~rays.vignetted)
    knots = np.linalg.pinv(polynomials(*quadrature(9, OBSCURED, 24)[:2]))
    return x, y, np.array(open_), polynomials(x, y), knots


def turned(rx, ry):
    return batoid.RotX(rx) @ batoid.RotY(ry)


def telescope(m2=(0,) * 5, camera=(0,) * 5, m3=(0,) * 5, figures=None):
    """A telescope with rigid motions in m and rad (x, y, z, Rx, Ry about the vertex) and errors of figure.

    Args:
        m2, camera, m3: Motions; M1 is where all others are measured from.
        figures: Lists of (mirrors, outer radius, inner radius, Zernike coefficients in m) that are added to surfaces.
    """
    optic = design()
    for name, motion in (("M2", m2), ("LSSTCamera", camera), ("M3", m3)):
        if any(motion):
            optic = optic.withLocallyRotatedOptic(name, turned(*motion[3:])).withGloballyShiftedOptic(name, motion[:3])
    for mirror, outer, inner, coefficients in figures or ():
        if any(coefficients):
            optic = optic.withPerturbedSurface(mirror, batoid.Zernike(coefficients, outer, inner))
    return optic


def removed(wave, x, y, weights):
    """Waves, a row each, without their piston and tilts."""
    root = np.sqrt(weights)
    basis, _ = np.linalg.qr(np.stack([np.ones_like(x), x, y], axis=1) * root[:, None])
    scaled = wave * root
    return (scaled - scaled @ basis @ basis.T) / root


def waves(rays, radius_m):
    """Path differences in m at the reference sphere about the middle of each star's rays; those that fail are NaN.

    Args:
        rays: Traced, in the coordinates of the detector, r and v of shape (stars, rays, 3), t of shape (stars, rays).
        radius_m: Of the sphere.
    """
    r, v, t = rays
    d = r - r.mean(axis=1, keepdims=True)
    v = v / np.linalg.norm(v, axis=2, keepdims=True)
    along = np.sum(d * v, axis=2)
    back = -along - np.sqrt(along**2 - np.sum(d * d, axis=2) + radius_m**2)
    return -(t + back)


def traced(optic, which):
    """r, v, t of the rays of the fields (0) or the corners (1), a star in each row."""
    rays = optic.trace(launched()[which].copy())
    stars = len(FIELDS[0]) if which == 0 else len(CORNERS_DEG)
    fine = ~rays.failed
    r, v, t = (np.where(fine[:, None] if a.ndim == 2 else fine, a, np.nan) for a in (rays.r, rays.v, rays.t))
    return r.reshape(stars, -1, 3), v.reshape(stars, -1, 3), t.reshape(stars, -1)


def residuals_nm(optic):
    """What squares of add up to the squared score: the wave of each ray and field by the root of its weight."""
    wave = 1e9 * waves(traced(optic, 0), optic.sphereRadius)
    return (removed(wave, *APERTURE) * np.sqrt(APERTURE[2]) * np.sqrt(FIELDS[2])[:, None]).ravel()


def spots_m(optic):
    """Places of the rays of every field about their middle, in m, of shape (fields, rays, 2), and the weights of both."""
    r = traced(optic, 0)[0][:, :, :2]
    return r - (APERTURE[2][:, None] * r).sum(1, keepdims=True), FIELDS[2], APERTURE[2]


def footprints_m(optic):
    """Where the points of the pupil meet the halves of the sensors, of shape (4 corners, 2 halves, POINTS, 2)."""
    r, v, _ = traced(optic, 1)
    slope = v[:, :, :2] / v[:, :, 2:]
    at = np.stack([r[:, :, :2] + z * slope for z in (-DEFOCUS_M, DEFOCUS_M)], axis=1)  # corners, halves, rays, 2
    polynomial, knots = pupil()[3:]
    return polynomial @ (knots @ at)


def kernel(seeing_arcsec):
    """A row of a Gaussian of this full width at half maximum, in pixels."""
    sigma = np.deg2rad(seeing_arcsec / 3600) * FOCAL_LENGTH_M / PIXEL_M / np.sqrt(8 * np.log(2))
    place = np.arange(-8, 9)
    row = np.exp(-0.5 * (place / max(sigma, 1e-3)) ** 2)
    return row / row.sum()


def donut(places_m, shares, seeing_arcsec):
    """A tile of (TILE, TILE) that adds up to the shares that meet it, its middle where the light's is, row 0 at large y."""
    places = places_m - shares @ places_m / shares.sum()
    column, row = places[:, 0] / PIXEL_M + TILE / 2 - 0.5, -places[:, 1] / PIXEL_M + TILE / 2 - 0.5
    left, top = np.floor(column), np.floor(row)
    right, below = column - left, row - top
    tile = np.zeros(TILE * TILE)
    for dx, dy, part in ((0, 0, (1 - right) * (1 - below)), (1, 0, right * (1 - below)), (0, 1, (1 - right) * below),
                         (1, 1, right * below)):
        x, y = left + dx, top + dy
        inside = (x >= 0) & (x < TILE) & (y >= 0) & (y < TILE)
        at = (y[inside] * TILE + x[inside]).astype(np.int64)
        tile += np.bincount(at, (shares * part)[inside], TILE * TILE)
    blur = circulant(kernel(seeing_arcsec))
    return blur @ tile.reshape(TILE, TILE) @ blur.T


def circulant(row):
    """The matrix that convolves a column with a row of odd length; light beyond the edges is lost."""
    shift = np.arange(TILE)[:, None] - np.arange(TILE) + len(row) // 2
    return np.where((shift >= 0) & (shift < len(row)), row[np.clip(shift, 0, len(row) - 1)], 0.0)


def donuts(optic, seeing_arcsec):
    """The tiles of all corners: 2 rows (in front of the focus, behind it) of 4, each adding up to its share of light."""
    places = footprints_m(optic)
    tiles = [[donut(places[c, half], open_ / len(open_), seeing_arcsec) for c, open_ in enumerate(pupil()[2])]
             for half in range(2)]
    return np.block(tiles)
