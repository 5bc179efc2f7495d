"""The lens in ray-optics: its surfaces and its ray trace, with transformations from face to face computed here.

Its own decentres rotate a face about its own vertex without a shift along the axis, so they cannot express an element that
rotates about the front of the lens.
"""

import numpy as np
from placed_lens import placed_faces


def build(lens, with_stop):
    from rayoptics.optical.opticalmodel import OpticalModel
    from rayoptics.raytr.opticalspec import FieldSpec, PupilSpec, WvlSpec

    model = OpticalModel(radius_mode=True)
    sequence, specification = model["seq_model"], model["optical_spec"]
    specification["pupil"] = PupilSpec(specification, key=["object", "epd"], value=lens["entrance_pupil_diameter_mm"])
    specification["fov"] = FieldSpec(specification, key=["object", "angle"], value=lens["half_field_deg"], flds=[0.0])
    specification["wvls"] = WvlSpec([(float(lens["wavelength_nm"]), 1.0)], ref_wl=0)
    # Far enough not to change a compared digit, near enough for double precision.
    sequence.gaps[0].thi = 1e8

    stop = next(stop for stop in lens["stops"] if stop.get("aperture"))
    faces = [face for element in lens["elements"] for face in element["faces"]]
    faces = [(face["z_mm"], face["radius_mm"], face.get("index_after", 1.0)) for face in faces]
    if with_stop:
        faces = sorted(faces + [(stop["z_mm"], 0.0, 1.0)])
    positions = [z for z, _, _ in faces] + [lens["image_z_mm"]]
    for (z, radius, index_after), following in zip(faces, positions[1:]):
        sequence.add_surface([radius, following - z, index_after])
        if with_stop and z == stop["z_mm"]:
            sequence.set_stop()
    model.update_model()
    return model


class Path:
    """Its list of surfaces for a lens as built; traces single rays, as all of ray-optics does."""

    def __init__(self, lens, elements):
        from rayoptics.optical import model_constants as mc

        self.wavelength_nm = float(lens["wavelength_nm"])
        self.steps = [list(step) for step in build(lens, with_stop=False)["seq_model"].path(self.wavelength_nm)]
        faces = placed_faces(lens, elements)
        self.vertices = [np.zeros(3)] + [face.vertex_mm for face in faces] + [np.array([0, 0, lens["image_z_mm"]])]
        self.turns = [np.eye(3)] + [face.rotation for face in faces] + [np.eye(3)]
        for here in range(len(self.steps) - 1):
            there = here + 1
            shift = self.turns[here].T @ (self.vertices[there] - self.vertices[here])
            self.steps[here][mc.Tfrm] = (self.turns[there].T @ self.turns[here], shift)

    def segments(self, start, direction):
        from rayoptics.raytr.raytrace import trace_raw

        return trace_raw(iter(self.steps), start, direction, self.wavelength_nm, intersect_obj=False)[0]

    def hits(self, start, direction):
        from rayoptics.optical import model_constants as mc

        local = [segment[mc.p] for segment in self.segments(start, direction)[1:]]
        return np.array([v + turn @ point for v, turn, point in zip(self.vertices[1:], self.turns[1:], local)])


def hits(lens, elements, starts, directions):
    """Intersections with all faces and the image plane, in mm: rays x surfaces x 3."""
    path = Path(lens, elements)
    return np.array([path.hits(start, direction) for start, direction in zip(starts, directions)])


def pass_through_faces(lens, elements, starts, directions):
    """A function that traces all rays through all faces, and to the image plane, once."""
    path = Path(lens, elements)

    def once():
        for start, direction in zip(starts, directions):
            path.segments(start, direction)

    return once


def trace(lens, ray):
    """Intersections of one ray with all faces and the image plane, in mm, in lens coordinates."""
    return Path(lens, ray["elements"]).hits(np.array(ray["start_mm"]), np.array(ray["direction"]))


def first_order(lens):
    data = build(lens, with_stop=True)["analysis_results"]["parax_data"].fod
    # ray-optics measures the exit pupil's distance from the paraxial image.
    defocus = lens["image_z_mm"] - lens["elements"][-1]["faces"][-1]["z_mm"] - data.img_dist
    return {
        "focal_length": data.efl,
        "back_focal_length": data.bfl,
        "front_focal_length": data.ffl,
        "f_number": data.fno,
        "entrance_pupil_z": data.enp_dist,
        "exit_pupil_diameter": 2 * data.exp_radius,
        "exit_pupil_from_last": data.exp_dist + defocus,
    }
