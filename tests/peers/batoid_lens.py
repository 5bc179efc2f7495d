"""The lens in batoid: every face is placed separately, in the coordinates of the perfect lens."""

import numpy as np
from placed_lens import placed_faces


def build(lens, elements):
    import batoid

    faces, before = [], 1.0
    for number, face in enumerate(placed_faces(lens, elements)):
        faces.append(
            batoid.RefractiveInterface(
                batoid.Sphere(face.radius_mm),
                name=f"face {number + 1}",
                coordSys=batoid.CoordSys(face.vertex_mm, face.rotation),
                inMedium=batoid.ConstMedium(before),
                outMedium=batoid.ConstMedium(face.index_after),
            )
        )
        before = face.index_after
    return faces


def bundle(starts, directions):
    import batoid

    return batoid.RayVector(*(np.ascontiguousarray(v) for v in (*starts.T, *directions.T)))


def hits(lens, elements, starts, directions):
    """Intersections with all faces and the image plane, in mm: rays x surfaces x 3."""
    import batoid

    rays, found = bundle(starts, directions), []
    for face in build(lens, elements):
        face.trace(rays)
        found.append(rays.toCoordSys(batoid.CoordSys()).r.copy())
    image = batoid.CoordSys(np.array([0, 0, lens["image_z_mm"]]))
    batoid.Plane().intersect(rays, coordSys=image)
    found.append(rays.toCoordSys(batoid.CoordSys()).r.copy())
    return np.stack(found, axis=1)


def pass_through_faces(lens, elements, starts, directions):
    """A function that traces all rays through all faces once."""
    import batoid

    optic, fresh = batoid.CompoundOptic(build(lens, elements), name="lens"), bundle(starts, directions)
    return lambda: optic.trace(fresh.copy())
