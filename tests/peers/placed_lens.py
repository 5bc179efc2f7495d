"""The lens file as a list of faces placed by an assembly, for both ray tracers.

Written from the definition of the file's keys, not from the program's code.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class PlacedFace:
    vertex_mm: np.ndarray
    rotation: np.ndarray  # face axes in columns, in lens coordinates
    radius_mm: float
    index_after: float


def turn(axis, degrees):
    """Right-handed rotation about x (0) or y (1)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == 0 else [[c, 0, s], [0, 1, 0], [-s, 0, c]])


def placed_faces(lens, elements):
    """p = pivot + Rx Ry (p - pivot) + shift, the pivot on the axis; light meets the faces in this order."""
    pivot = np.array([0, 0, lens["pivot_z_mm"]])
    placed = []
    for element in lens["elements"]:
        offset = elements.get(element["name"], {})
        tilts = offset.get("tilt_deg", [0, 0])
        shift = np.array(offset.get("shift_mm", [0, 0, 0]))
        rotation = turn(0, tilts[0]) @ turn(1, tilts[1])
        for face in element["faces"]:
            vertex = pivot + rotation @ (np.array([0, 0, face["z_mm"]]) - pivot) + shift
            placed.append(PlacedFace(vertex, rotation, face["radius_mm"], face.get("index_after", 1.0)))
    return placed
