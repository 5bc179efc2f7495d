"""Rays and first-order values against Optiland and ray-optics, which are independent of this project."""

import importlib

import conftest
import numpy as np
import program
import pytest

SEED = 5
RAYS = 30
# A few hundred roundings of 20 mm in double precision.
ALLOWED_MM = 1e-12
# ray-optics has no object at infinity; at 1e8 mm its pupils deviate by 3e-8 mm.
ALLOWED_FIRST_ORDER = {"optiland": 1e-10, "rayoptics": 1e-7}


@pytest.fixture(params=["optiland", "rayoptics"])
def peer(request):
    conftest.need(request.param)
    return request.param, importlib.import_module(f"{request.param}_lens")


def drawn_rays(lens, disturbed):
    """Rays towards the entrance pupil, up to 35 degrees off the axis; all four elements offset as at rho0.5, or perfect."""
    random = np.random.default_rng(SEED)
    pupil_z, pupil_radius = program.first_order()["entrance_pupil_z"], lens["entrance_pupil_diameter_mm"] / 2
    rays = []
    for _ in range(RAYS):
        tangent, azimuth = np.tan(np.radians(35)) * np.sqrt(random.uniform()), random.uniform(0, 2 * np.pi)
        direction = np.array([tangent * np.cos(azimuth), tangent * np.sin(azimuth), 1])
        radius, angle = pupil_radius * np.sqrt(random.uniform()), random.uniform(0, 2 * np.pi)
        in_pupil = np.array([radius * np.cos(angle), radius * np.sin(angle), pupil_z])
        start = in_pupil - (pupil_z + 1) * direction
        elements = {}
        if disturbed:
            for element in lens["elements"]:
                tilts, shifts = random.normal(0, 0.75, 2), random.normal(0, 0.02, 3)
                elements[element["name"]] = {"tilt_deg": list(tilts), "shift_mm": list(shifts)}
        direction = direction / np.linalg.norm(direction)
        rays.append({"start_mm": list(start), "direction": list(direction), "elements": elements})
    return rays


def hits(traced):
    assert "lost_at" not in traced, f"our trace lost a ray at {traced['lost_at']}"
    return np.array(traced["hits_mm"] + [traced["image_mm"]])


def largest_deviation(found, expected):
    deviations = [np.linalg.norm(a - b, axis=1).max() for a, b in zip(found, expected)]
    return max(deviations), min(deviations)


@pytest.mark.parametrize("disturbed", [False, True], ids=["perfect", "all elements off"])
def test_intersections_with_all_faces_and_the_image_plane(peer, disturbed, tmp_path, figures):
    name, module = peer
    lens = program.lens()
    rays = drawn_rays(lens, disturbed)
    ours = [hits(traced) for traced in program.trace(rays, tmp_path)]
    theirs = [module.trace(lens, ray) for ray in rays]
    deviation, _ = largest_deviation(ours, theirs)
    figures.append(f"{name}: {RAYS} rays, {'all elements off' if disturbed else 'perfect lens'}: {deviation:.1e} mm")
    assert deviation < ALLOWED_MM


def mirrored(elements, key, index):
    """The same assembly with the sign of one number reversed."""
    changed = {name: {kind: list(values) for kind, values in offset.items()} for name, offset in elements.items()}
    for offset in changed.values():
        offset[key][index] *= -1
    return changed


@pytest.mark.parametrize("key, index", [("tilt_deg", 0), ("tilt_deg", 1), ("shift_mm", 0), ("shift_mm", 2)])
def test_wrong_sign_changes_every_ray(peer, key, index, tmp_path):
    name, module = peer
    lens = program.lens()
    rays = drawn_rays(lens, True)[:5]
    wrong = [{**ray, "elements": mirrored(ray["elements"], key, index)} for ray in rays]
    ours = [hits(traced) for traced in program.trace(rays, tmp_path)]
    theirs = [module.trace(lens, ray) for ray in wrong]
    _, least = largest_deviation(ours, theirs)
    assert least > 1e4 * ALLOWED_MM


def test_first_order_values(peer, figures):
    name, module = peer
    ours, theirs = program.first_order(), module.first_order(program.lens())
    deviations = {key: abs(value - ours[key]) for key, value in theirs.items()}
    figures.append(f"{name}: {len(theirs)} first-order values: {max(deviations.values()):.1e} mm")
    assert max(deviations.values()) < ALLOWED_FIRST_ORDER[name], deviations
