"""An independent reader of Zemax files for the checks of corpus.py: surfaces, model glasses and first-order values.

Written from the meaning of the format's keywords, not from the program's reader. `Design.unread` lists what it does not
understand; checks that need it are left out.
"""

import dataclasses
import math
from dataclasses import dataclass

MILLIMETRES = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "METER": 1000.0, "M": 1000.0}
LINES_UM = {"F": 0.4861327, "d": 0.5875618, "C": 0.6562725}


@dataclass
class Surface:
    kind: str = "STANDARD"
    curvature: float = 0.0
    conic: float = 0.0
    thickness: float = 0.0
    even: dict = dataclasses.field(default_factory=dict)  # power of r -> coefficient, in mm
    glass: str = ""
    nd: float = 0.0  # of a model glass
    vd: float = 0.0
    is_stop: bool = False
    clear_radius: float = 0.0  # 0: not in the file


@dataclass
class Design:
    surfaces: list
    wavelength_um: float = 0.0
    aperture: tuple = ("", 0.0)
    field_type: int = 0
    field: float = 0.0
    unread: list = dataclasses.field(default_factory=list)  # keywords that are not understood


def text_of(path):
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", "replace")
    if data[1:2] == b"\0":
        return data.decode("utf-16-le", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def number(word):
    return float(word.replace(",", "."))


def read(path):
    """A Design, lengths in mm; surfaces from the object to the image."""
    design = Design([])
    wavelengths, primary, unit = {}, 1, 1.0
    fields = {"XFLN": [], "YFLN": []}
    used_fields, extra = None, {}
    for line in text_of(path).splitlines():
        words = line.split()
        if not words:
            continue
        key, rest = words[0].upper(), words[1:]
        surface = design.surfaces[-1] if design.surfaces else None
        if key == "SURF":
            design.surfaces.append(Surface())
            extra[len(design.surfaces) - 1] = {}
        elif key == "UNIT":
            unit = MILLIMETRES[rest[0].upper()]
        elif key in ("ENPD", "FNUM", "OBNA", "FLOA"):
            # FNUM's second number is 1 for a paraxial working f-number.
            working = key == "FNUM" and len(rest) > 1 and rest[1] == "1"
            design.aperture = ("working" if working else key, number(rest[0]) if rest else 0.0)
        elif key == "FTYP":
            design.field_type = int(rest[0])
            used_fields = int(rest[2]) if len(rest) > 2 else None
        elif key in fields:
            fields[key] = [number(word) for word in rest]
        elif key == "WAVM":
            wavelengths[int(rest[0])] = number(rest[1])
        elif key == "WAVL":
            wavelengths = {i + 1: number(word) for i, word in enumerate(rest)}
        elif key == "PWAV":
            primary = int(rest[0])
        elif surface is None:
            continue
        elif key == "TYPE":
            surface.kind = rest[0].upper()
        elif key == "STOP":
            surface.is_stop = True
        elif key == "CURV":
            surface.curvature = number(rest[0])
        elif key == "CONI":
            surface.conic = number(rest[0])
        elif key == "DISZ":
            surface.thickness = math.inf if rest[0].upper() == "INFINITY" else number(rest[0])
        elif key == "DIAM":
            surface.clear_radius = number(rest[0])
        elif key in ("PARM", "XDAT"):
            extra[len(design.surfaces) - 1][key, int(rest[0])] = number(rest[1])
        elif key == "GLAS":
            surface.glass = rest[0]
            if (len(rest) > 1 and rest[1] == "1") or rest[0] == "___BLANK":
                surface.nd, surface.vd = number(rest[3]), number(rest[4])
    for i, surface in enumerate(design.surfaces):
        finish_surface(design, surface, extra[i], unit)
    last, before = design.surfaces[-1], design.surfaces[-2] if len(design.surfaces) > 1 else Surface()
    if (before.nd > 0 or before.glass) and last.curvature == 0 and not last.even and 0 < last.thickness < math.inf:
        design.surfaces.append(Surface())  # the file ends with the back of its cover glass
    design.wavelength_um = wavelengths.get(primary, 0.0)
    pairs = list(zip(*[values + [0.0] * 12 for values in fields.values()]))[: used_fields or 12]
    design.field = max((math.hypot(*pair) for pair in pairs), default=0.0)
    if design.field_type > 0:
        design.field *= unit
    if design.aperture[0] == "ENPD":
        design.aperture = ("ENPD", design.aperture[1] * unit)
    return design


def finish_surface(design, surface, extra, unit):
    even = {}
    if surface.kind == "EVENASPH":
        even = {2 * i: extra.get(("PARM", i), 0.0) for i in range(1, 9)}
    elif surface.kind == "XASPHERE":
        # Terms (r / norm)^2, ^4, ...; as many as XDAT 1 has it.
        norm = extra.get(("XDAT", 2), 1.0) or 1.0
        count = int(extra.get(("XDAT", 1), 0))
        even = {2 * i: extra.get(("XDAT", 2 + i), 0.0) / norm ** (2 * i) for i in range(1, count + 1)}
        for i in range(1, 9):
            even[2 * i] = even.get(2 * i, 0.0) + extra.get(("PARM", i), 0.0)
    elif surface.kind != "STANDARD":
        design.unread.append(surface.kind)
    if surface.glass.upper() == "MIRROR":
        design.unread.append("MIRROR")
    surface.curvature /= unit
    surface.thickness *= unit
    surface.clear_radius *= unit
    surface.even = {power: value / unit ** (power - 1) for power, value in even.items() if value != 0}


def cauchy(nd, vd, wavelength_um):
    """n = A + B / wavelength^2 through the lines F, d and C: the program's convention for model glasses."""
    if vd == 0:
        return nd
    inverse = {name: 1 / line**2 for name, line in LINES_UM.items()}
    slope = (nd - 1) / vd / (inverse["F"] - inverse["C"])
    return nd + slope * (1 / wavelength_um**2 - inverse["d"])


@dataclass
class FirstOrder:
    focal_length: float
    back_focal_length: float
    entrance_pupil_z: float  # from the first face
    pupil_per_stop: float  # width of the entrance pupil over that of the stop
    f_number: float


def faces(design, wavelength_um):
    """[(surface, z from the first face, index behind)], and where stop and image are; faces part two media."""
    z, index, found, stop = 0.0, 1.0, [], None
    for surface in design.surfaces[1:-1]:
        if surface.is_stop:
            stop = (len(found), z)
        behind = 1.0
        if surface.nd > 0:
            behind = cauchy(surface.nd, surface.vd, wavelength_um)
        elif surface.glass:
            behind = surface.glass
        if behind != index:
            found.append((surface, z, behind))
        index = behind
        z += surface.thickness
    first = found[0][1] if found else 0.0
    return (
        [(surface, at - first, behind) for surface, at, behind in found],
        (stop[0], stop[1] - first) if stop else None,
        z - first,
    )


def power_curvature(surface):
    """Paraxial curvature: a term of r^2 acts as a curvature of twice its size."""
    return surface.curvature + 2 * surface.even.get(2, 0.0)


def first_order(design, indices):
    """First-order values by a paraxial ray from each side; `indices` are those behind the faces."""
    rows, stop, _ = faces(design, design.wavelength_um)

    def through(count, y, nu, to_z, from_z=0.0):
        at, before = from_z, 1.0
        for (surface, z, _), behind in zip(rows[:count], indices):
            y += nu / before * (z - at)
            nu -= y * (behind - before) * power_curvature(surface)
            at, before = z, behind
        return y + nu / before * (to_z - at), nu

    last = rows[-1][1]
    y, nu = through(len(rows), 1.0, 0.0, last)
    focal, back = -1 / nu, -y / nu
    if stop:
        a, _ = through(stop[0], 1.0, 0.0, stop[1])
        b, _ = through(stop[0], 0.0, 1.0, stop[1])
        # A ray with height y0 and slope u at the first vertex meets the stop at a y0 + b u; the chief ray at 0.
        pupil_z, per_stop = b / a, 1 / a
    else:
        pupil_z, per_stop = math.nan, math.nan
    kind, value = design.aperture
    f_number = {"FNUM": value, "ENPD": focal / value if value else math.nan}.get(kind, math.nan)
    return FirstOrder(focal, back, pupil_z, abs(per_stop), f_number)


def half_field_deg(design, first):
    """Half field of the file in degrees; NaN where it needs more than first order."""
    if design.field_type == 0:
        return design.field
    if design.field_type == 2:
        return math.degrees(math.atan(design.field / first.focal_length))
    return math.nan


def counts(design):
    """Number of faces, and of aspheres among them, of any file."""
    rows, _, _ = faces(design, design.wavelength_um or 0.55)
    aspheres = sum(1 for surface, _, _ in rows if surface.even or (surface.conic and surface.curvature))
    return len(rows), aspheres
