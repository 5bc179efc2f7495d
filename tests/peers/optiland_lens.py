"""The lens in Optiland: every face placed for itself, in the coordinates of the undisturbed lens."""

import numpy as np
from placed_lens import placed_faces
from scipy.spatial.transform import Rotation


def build(lens, elements, with_stop):
    """with_stop: first-order values need the aperture stop, single rays go through the glass alone."""
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic

    optic = Optic()
    optic.surfaces.add(index=0, radius=np.inf, z=-np.inf)
    index = 1
    stop = next(stop for stop in lens["stops"] if stop.get("aperture"))
    for face in placed_faces(lens, elements):
        if with_stop and stop["z_mm"] < face.vertex_mm[2]:
            optic.surfaces.add(index=index, radius=np.inf, z=stop["z_mm"], is_stop=True)
            index, with_stop = index + 1, False
        # Optiland turns about x, then y, then z of the fixed axes.
        rx, ry, rz = Rotation.from_matrix(face.rotation).as_euler("xyz")
        x, y, z = face.vertex_mm
        placement = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
        material = IdealMaterial(n=face.index_after)
        optic.surfaces.add(index=index, radius=face.radius_mm, material=material, **placement)
        index += 1
    optic.surfaces.add(index=index, radius=np.inf, z=lens["image_z_mm"])
    optic.set_aperture(aperture_type="EPD", value=lens["entrance_pupil_diameter_mm"])
    optic.fields.set_type("angle")
    optic.fields.add(y=0)
    optic.wavelengths.add(value=lens["wavelength_nm"] / 1000, is_primary=True)
    return optic


def trace(lens, ray):
    """Hits on all faces and on the image plane, in mm."""
    from optiland.rays import RealRays

    optic = build(lens, ray["elements"], with_stop=False)
    bundle = RealRays(*(np.array([v]) for v in (*ray["start_mm"], *ray["direction"], 1, lens["wavelength_nm"] / 1000)))
    hits = []
    for surface in list(optic.surfaces)[1:]:
        surface.trace(bundle)
        hits.append(np.array([bundle.x[0], bundle.y[0], bundle.z[0]]))
    return np.array(hits)


def first_order(lens):
    paraxial = build(lens, {}, with_stop=True).paraxial
    last_to_image = lens["image_z_mm"] - lens["elements"][-1]["faces"][-1]["z_mm"]
    return {
        "focal_length": float(paraxial.f2()),
        "entrance_pupil_z": float(paraxial.EPL()),
        "exit_pupil_diameter": float(paraxial.XPD()),
        "exit_pupil_from_last": float(paraxial.XPL()) + last_to_image,
    }
