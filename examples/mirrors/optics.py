"""Grazing-incidence mirrors of a Kirkpatrick-Baez pair: rays, source, figure and diffraction. Lengths in m, angles in rad.

A mirror is part of an ellipse whose foci are the source and the focus, which are `source` and `focus` away from its centre;
there, the grazing angle is `grazing`. Coordinates of the mirror: x along it, downstream, and z along its normal. A mirror out
of place or out of shape is the ellipse plus a small distance d(x) along z, of slope d'(x):

    d(x) = height + pitch (x - pivot) + k ((up + down) / 4 x^2 + (down - up) / (6 length) x^3)

k is the ellipse's curvature at the centre; up and down are relative changes of curvature at the mirror's ends, since two
couples bend a beam to a curvature that is linear along it (Howells et al., Theory and practice of elliptically bent x-ray
mirrors, Optical Engineering 39, 2748, 2000). A ray from the source that meets the mirror at x, where r1 and r2 are the
distances to source and focus, then misses the focus by

    y(x) = 2 r2 d' + (1 - r2 / r1) d

To first order in d, exact in x: the reflected ray turns by twice the slope; a surface that is higher by d moves the point of
reflection by d, and turns the ray that comes from the source by d / r1 away from the ellipse's own. Neglected are products of
these small angles, and cosines of grazing angles (5e-6 at 3 mrad).
"""

import math
from dataclasses import dataclass

CELLS = 40  # between edges along a mirror; rays within one are linear in their place in the slit
FWHM = math.sqrt(8 * math.log(2))  # of a normal distribution of standard deviation 1
SLIT_FWHM = 0.8859  # of sinc(u)^2 = (sin(pi u) / (pi u))^2, in u


@dataclass
class Light:
    """What is behind a mirror of the light in the slit before it."""

    share: float  # of the light, 0 to 1
    position: float  # mean of the rays in the focal plane, m
    deviation: float  # standard deviation of the rays in the focal plane, m
    width: float  # of the beam that the mirror reflects, in the slit, m
    spread: float  # standard deviation of that beam in the slit, m


class Mirror:
    """One mirror.

    Args:
        length: Of the mirror.
        source: Distance from the source to the mirror's centre.
        focus: Distance from the mirror's centre to the focus.
        grazing: Angle between beam and mirror at its centre.
        pivot: Place x about which the pitch turns the mirror.
    """

    def __init__(self, length, source, focus, grazing, pivot=0.0):
        self.length, self.source, self.focus, self.grazing, self.pivot = length, source, focus, grazing, pivot
        self.curvature = math.sin(grazing) * (1 / source + 1 / focus) / 2
        self.edges = [(x, *self.ellipse(x)) for x in (length * (i / CELLS - 0.5) for i in range(CELLS + 1))]

    def ellipse(self, x):
        """Height z of the ellipse, and its distances to source and focus, at x.

        From r1 + r2 = source + focus, of which r1^2 - r2^2 follows, a quadratic equation for z; the same curve as that of
        Goldberg, Journal of Synchrotron Radiation 29, 991 (2022).
        """
        p, q, s, c = self.source, self.focus, math.sin(self.grazing), math.cos(self.grazing)
        m = (p - q) / (p + q)
        a = 1 - (s * m) ** 2
        b = s * (2 * p * q / (p + q) - x * c * m)
        z = (x * s) ** 2 / (b + math.sqrt(b * b - a * (x * s) ** 2))
        r1 = p + x * c - z * s * m
        return z, r1, p + q - r1

    def rays(self, pitch=0.0, height=0.0, up=0.0, down=0.0):
        """(place in the slit, deviation y in the focal plane) of the rays that meet the edges of the mirror's cells.

        The slit is in the plane of the mirror's centre, across the beam. Both count from the ray through source and centre,
        the first towards the side of the mirror's normal, the second likewise from the focus.
        """
        s, c, k = math.sin(self.grazing), math.cos(self.grazing), self.curvature
        two, three = k * (up + down) / 4, k * (down - up) / (6 * self.length)
        found = []
        for x, z, r1, r2 in self.edges:
            d = height + pitch * (x - self.pivot) + (two + three * x) * x * x
            slope = pitch + (2 * two + 3 * three * x) * x
            across, along = x * s + (z + d) * c, self.source + x * c - (z + d) * s
            found.append((self.source * across / along, 2 * r2 * slope + (1 - r2 / r1) * d))
        return found


def beam(rays, slit):
    """The Light of rays from an evenly lit slit of full width `slit`; cells that the mirror itself shades reflect nothing."""
    width = v1 = v2 = y1 = y2 = 0.0
    for (v, y), (v_next, y_next) in zip(rays, rays[1:]):
        low, high = max(v, -slit / 2), min(v_next, slit / 2)
        if high <= low:
            continue
        y_low, y_high = (y + (y_next - y) * (end - v) / (v_next - v) for end in (low, high))
        part = high - low
        width += part
        v1 += part * (low + high) / 2
        v2 += part * (low * low + low * high + high * high) / 3
        y1 += part * (y_low + y_high) / 2
        y2 += part * (y_low * y_low + y_low * y_high + y_high * y_high) / 3
    if width == 0.0:
        return Light(0.0, 0.0, 0.0, 0.0, 0.0)
    v1, v2, y1, y2 = (total / width for total in (v1, v2, y1, y2))
    return Light(width / slit, y1, math.sqrt(max(y2 - y1 * y1, 0.0)), width, math.sqrt(max(v2 - v1 * v1, 0.0)))


def pencil(rays, place):
    """Deviation y of a narrow beam at this place in the slit; None where it misses the mirror."""
    for (v, y), (v_next, y_next) in zip(rays, rays[1:]):
        if v <= place < v_next:
            return y + (y_next - y) * (place - v) / (v_next - v)
    return None


def source_image(size, source, focus):
    """FWHM of the image of a source of FWHM `size`."""
    return size * focus / source


def figure_blur(slope_error, focus):
    """FWHM by slope errors of this standard deviation, much shorter than the mirror: rays turn by twice the slope."""
    return FWHM * 2 * slope_error * focus


def diffraction(wavelength, focus, width):
    """FWHM of the focus of a beam of this full width at the mirror: that of a slit, sinc(width y / (wavelength focus))^2."""
    return SLIT_FWHM * wavelength * focus / width


def skew(roll, source, focus, spread):
    """Standard deviation in the focal plane that a mirror adds across its neighbour, from which it is `roll` away from square.

    It focuses along a direction that is turned by the roll, with the power 1 / source + 1 / focus. A ray that is `spread` away
    from the axis along the neighbour's direction gets roll times this power too much along its own, and is `focus` away.
    Holds both ways: along this mirror's direction by the beam's spread along the neighbour's, and the reverse.
    """
    return abs(roll) * (1 + focus / source) * spread


def sideways(roll, grazing, focus):
    """How far a mirror that is `roll` away from square moves the focus along its neighbour's direction, by its deflection."""
    return math.sin(2 * grazing) * math.sin(roll) * focus


def width(light, *parts):
    """FWHM of a focus: 2.355 standard deviations of its rays and the FWHM of the other parts, added as squares."""
    return math.sqrt((FWHM * light.deviation) ** 2 + sum(part * part for part in parts))
