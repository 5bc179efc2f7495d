"""Coupling of Gaussian modes between a facet and a single-mode fibre: closed-form overlap integrals.

Along one transverse axis u the facet's mode, of waist w1, has propagated over the gap z and arrives at the fibre's facet with
the radius w(z), the radius of curvature R(z), the offset d and the angle t:

    E1(u) = (2 / (pi w^2))^(1/4) exp(-q (u - d)^2 - i k t u),   q = 1 / w^2 + i k / (2 R),   k = 2 pi / wavelength

The fibre's mode is E2(u) = (2 / (pi w2^2))^(1/4) exp(-u^2 / w2^2), so that the overlap is a Gaussian integral. The coupling
is the product of both axes' squared overlaps and of the transmission of the two facets (Joyce and DeLoach, Alignment of
Gaussian beams, Applied Optics 23, 4187, 1984). Angles are small; reflections between the facets do not interfere.
"""

import cmath
import math

WAVELENGTH_UM = 1.55
FIBRE_WAIST_UM = 5.2  # of a standard single-mode fibre at this wavelength: a mode field diameter of 10.4 um
GLASS_INDEX = 1.444


def overlap(w1_um, w2_um, gap_um, offset_um, angle_rad):
    """The squared overlap along one axis, 0 to 1."""
    k = 2 * math.pi / WAVELENGTH_UM
    rayleigh = math.pi * w1_um**2 / WAVELENGTH_UM
    radius = w1_um * math.hypot(1, gap_um / rayleigh)
    curvature = gap_um / (gap_um**2 + rayleigh**2)  # 1 / R
    q = 1 / radius**2 + 0.5j * k * curvature
    a = q + 1 / w2_um**2
    b = 2 * q * offset_um - 1j * k * angle_rad
    exponent = b * b / (4 * a) - q * offset_um**2
    return abs(2 / (radius * w2_um * a)) * math.exp(2 * exponent.real)


def fresnel():
    """Transmission of two uncoated glass facets, without interference."""
    reflected = ((GLASS_INDEX - 1) / (GLASS_INDEX + 1)) ** 2
    return (1 - reflected) ** 2


def coupling(waist_um, gap_um, offsets_um, angles_rad):
    """Power in the fibre as a share of that in the facet's mode; offsets and angles are pairs, of x and y."""
    shares = [overlap(waist_um, FIBRE_WAIST_UM, gap_um, d, t) for d, t in zip(offsets_um, angles_rad)]
    return fresnel() * shares[0] * shares[1]


def by_quadrature(w1_um, w2_um, gap_um, offset_um, angle_rad):
    """The same as overlap() by propagating plane waves and summing over points, for the tests."""
    k = 2 * math.pi / WAVELENGTH_UM
    count, width = 1201, 24 * max(w1_um, w2_um)
    points = [width * (i / (count - 1) - 0.5) for i in range(count)]
    step = points[1] - points[0]
    # The spectrum of the waist is a Gaussian of spatial frequencies; each plane wave gets its paraxial phase.
    waves = [6 / w1_um * (2 * i / 800 - 1) for i in range(801)]
    weights = [math.exp(-((s * w1_um / 2) ** 2)) * cmath.exp(0.5j * s * s / k * gap_um) for s in waves]
    total, power1, power2 = 0j, 0.0, 0.0
    for u in points:
        field = sum(a * cmath.exp(1j * s * (u - offset_um)) for a, s in zip(weights, waves))
        field *= cmath.exp(-1j * k * angle_rad * u)
        mode = math.exp(-((u / w2_um) ** 2))
        total += field * mode * step
        power1 += abs(field) ** 2 * step
        power2 += mode * mode * step
    return abs(total) ** 2 / (power1 * power2)
