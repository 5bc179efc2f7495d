"""Gaussian beams through a Mach-Zehnder interferometer, and the fringes of two of them on a camera. Lengths are in mm.

A beam of wavelength L and wave number k = 2 pi / L has the field, along each transverse axis u,

    E(u) = (2 / (pi w^2))^(1/4) exp(i k (Q (u - place)^2 / 2 + angle (u - place))),   Q = 1 / R + i L / (pi w^2)

with the radius w at which the intensity has fallen to 1 / e^2, and the radius of curvature R, positive where it diverges.
Drifts and thin lenses change Q by Kogelnik's law, place and angle as those of a ray (Kogelnik and Li, Laser beams and
resonators, Applied Optics 5, 1550, 1966): the paraxial approximation, for which this is exact. Beams are round.
"""

import cmath
import math
from dataclasses import dataclass

try:
    import numpy as np
except ModuleNotFoundError:  # an error where it is needed is one sentence, here it would be a traceback
    np = None

WAVELENGTH = 632.8e-6
WAVE_NUMBER = 2 * math.pi / WAVELENGTH
NODES_A_PIXEL = 4  # of the average over a pixel, along each axis


def need_numpy():
    if np is None:
        raise ModuleNotFoundError("numpy, which computes with fringes, is not installed: pip install numpy")


@dataclass
class Beam:
    """Of unit power; curvature is Q in 1/mm, place in mm and angle in rad along x and y."""

    curvature: complex
    place: list
    angle: list

    @property
    def radius(self):
        return math.sqrt(WAVELENGTH / (math.pi * self.curvature.imag))

    def drift(self, length):
        place = [u + length * angle for u, angle in zip(self.place, self.angle)]
        return Beam(self.curvature / (1 + length * self.curvature), place, self.angle)

    def lens(self, focal_length, centre=(0.0, 0.0)):
        angle = [a - (u - c) / focal_length for a, u, c in zip(self.angle, self.place, centre)]
        return Beam(self.curvature - 1 / focal_length, self.place, angle)

    def mirror(self, turn):
        """In coordinates that follow the folded axis."""
        return Beam(self.curvature, self.place, [a + t for a, t in zip(self.angle, turn)])


def beam_of(radius, distance, place=(0.0, 0.0), angle=(0.0, 0.0)):
    """A beam of this radius at its waist, so far in front of the waist."""
    return Beam(1 / complex(-distance, -math.pi * radius**2 / WAVELENGTH), list(place), list(angle))


def log_overlap(one, other):
    """Of the magnitude of the integral of E1 conj(E2) over the plane: 0 for equal beams, below it for others."""
    q1, q2 = one.curvature, other.curvature.conjugate()
    bend = -0.5j * WAVE_NUMBER * (q1 - q2)
    total = 0.0
    for axis in (0, 1):
        distance = other.place[axis] - one.place[axis]
        slope = 1j * WAVE_NUMBER * (one.angle[axis] - other.angle[axis] + q2 * distance)
        exponent = slope * slope / (4 * bend) - 0.5j * WAVE_NUMBER * q2 * distance**2
        total += exponent.real + 0.5 * math.log(2 / (one.radius * other.radius * abs(bend)))
    return total


def lost_visibility(one, other, powers=(1.0, 1.0)):
    """1 - V, V = (Imax - Imin) / (Imax + Imin) of the whole power over a period of the phase between the beams."""
    balance = math.log(2 * math.sqrt(powers[0] * powers[1]) / sum(powers))
    return max(0.0, -math.expm1(balance + log_overlap(one, other)))


def profile(beam, axis, points):
    """The field along an axis, without its normalisation."""
    u = points - beam.place[axis]
    return np.exp(1j * WAVE_NUMBER * (0.5 * beam.curvature * u * u + beam.angle[axis] * u))


class Camera:
    """Square pixels that average the intensity over their area, row 0 at the lowest y; centre in mm."""

    def __init__(self, pixels, pitch, centre=(0.0, 0.0)):
        nodes, self.weights = np.polynomial.legendre.leggauss(NODES_A_PIXEL)
        middles = pitch * (np.arange(pixels) - 0.5 * (pixels - 1))
        self.points = [middles[:, None] + 0.5 * pitch * nodes + c for c in centre]

    def average(self, one, other):
        """Of E1 conj(E2) over each pixel: complex, shape (pixels, pixels), y first; per mm^2, of beams of unit power."""
        across, down = (0.5 * (profile(one, axis, points) * profile(other, axis, points).conj()) @ self.weights
                        for axis, points in enumerate(self.points))
        return 2 / (math.pi * one.radius * other.radius) * np.outer(down, across)

    def fringes(self, one, other, powers=(1.0, 1.0)):
        """Sum of both intensities, and the complex interference term c: a frame at phase p is sum + 2 Re(c exp(-i p))."""
        alone = powers[0] * self.average(one, one).real + powers[1] * self.average(other, other).real
        return alone, math.sqrt(powers[0] * powers[1]) * self.average(one, other)


def visibility_of(totals):
    """Of the whole light in frames at equally spaced phases: amplitude of the first harmonic over the mean; 0 in the dark."""
    count = len(totals)
    mean = sum(totals) / count
    wave = sum(total * cmath.exp(-2j * math.pi * k / count) for k, total in enumerate(totals))
    return 2 * abs(wave) / count / mean if mean > 0 else 0.0
