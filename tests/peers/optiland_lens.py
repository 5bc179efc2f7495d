"""The lens in Optiland: every face is placed separately, in the coordinates of the perfect lens."""

import numpy as np
from placed_lens import placed_faces
from scipy.spatial.transform import Rotation


def build(lens, elements, with_stop):
    """The lens as an Optic; first-order values need the aperture stop (with_stop), single rays do not."""
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
        # Optiland rotates about the fixed axes x, then y, then z.
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


def bundle(lens, starts, directions):
    from optiland import backend
    from optiland.rays import RealRays

    ones = np.ones(len(starts))
    values = (*starts.T, *directions.T, ones, ones * lens["wavelength_nm"] / 1000)
    arrays = [backend.array(np.ascontiguousarray(v)) for v in values]
    return lambda: RealRays(*(backend.copy(a) for a in arrays))


def hits(lens, elements, starts, directions):
    """Intersections with all faces and the image plane, in mm: rays x surfaces x 3."""
    from optiland import backend

    rays, found = bundle(lens, starts, directions)(), []
    for surface in list(build(lens, elements, with_stop=False).surfaces)[1:]:
        surface.trace(rays)
        found.append(np.stack([backend.to_numpy(v).astype(float) for v in (rays.x, rays.y, rays.z)], axis=1))
    return np.stack(found, axis=1)


def pass_through_faces(lens, elements, starts, directions):
    """A function that traces all rays through all faces once."""
    faces = list(build(lens, elements, with_stop=False).surfaces)[1:-1]
    fresh = bundle(lens, starts, directions)

    def once():
        rays = fresh()
        for face in faces:
            face.trace(rays)

    return once


def trace(lens, ray):
    """Intersections of one ray with all faces and the image plane, in mm."""
    return hits(lens, ray["elements"], np.array([ray["start_mm"]]), np.array([ray["direction"]]))[0]


def first_order(lens):
    paraxial = build(lens, {}, with_stop=True).paraxial
    last_to_image = lens["image_z_mm"] - lens["elements"][-1]["faces"][-1]["z_mm"]
    return {
        "focal_length": float(paraxial.f2()),
        "entrance_pupil_z": float(paraxial.EPL()),
        "exit_pupil_diameter": float(paraxial.XPD()),
        "exit_pupil_from_last": float(paraxial.XPL()) + last_to_image,
    }


def fft_mtf(lens, scene, height_mm, behind_mm, frequencies):
    """The lower of tangential and sagittal MTF with diffraction, for an object point height_mm off the axis; all faces clip."""
    from optiland.materials import IdealMaterial
    from optiland.mtf import FFTMTF
    from optiland.optic import Optic

    optic = Optic()
    optic.surfaces.add(index=0, radius=np.inf, z=scene["emitter"]["z_mm"] + scene["pivot_behind_first_vertex_mm"])
    stop = next(stop for stop in lens["stops"] if stop.get("aperture"))
    index, placed = 1, False
    for face in (face for element in lens["elements"] for face in element["faces"]):
        if not placed and stop["z_mm"] < face["z_mm"]:
            opening = 2 * stop["opening_radius_mm"]
            optic.surfaces.add(index=index, radius=np.inf, z=stop["z_mm"], is_stop=True, aperture=opening)
            index, placed = index + 1, True
        material = IdealMaterial(n=face.get("index_after", 1.0))
        clear = 2 * face["clear_radius_mm"]
        optic.surfaces.add(index=index, radius=face["radius_mm"], z=face["z_mm"], material=material, aperture=clear)
        index += 1
    optic.surfaces.add(index=index, radius=np.inf, z=lens["image_z_mm"] + behind_mm)
    optic.set_aperture("float_by_stop_size", 2 * stop["opening_radius_mm"])
    optic.fields.set_type("object_height")
    optic.fields.add(y=max(height_mm, 1e-6))
    optic.wavelengths.add(value=lens["wavelength_nm"] / 1000, is_primary=True)
    optic.ray_tracer.set_aiming("robust")
    mtf = FFTMTF(optic, fields=[(0, 1 if height_mm else 0)], num_rays=256, grid_size=2048, max_freq=400)
    tangential, sagittal = (np.asarray(curve) for curve in mtf.mtf[0])
    along, across = np.asarray(mtf.freq_tang[0]), np.asarray(mtf.freq_sag[0])
    return [float(min(np.interp(f, along, tangential), np.interp(f, across, sagittal))) for f in frequencies]
