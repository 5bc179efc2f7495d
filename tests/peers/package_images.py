"""Images of the authors' package by its own LensEnv and its own draws, in the terms of relign-bench."""

import functools
import importlib.util
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import stand_ins

WIDTH = 200
# The package's names of the elements that its noise moves, and the file that identifies each lens.
ELEMENTS = {"lens_0": "L1", "lens_1": "L2", "lens_2": "L3", "lens_3": "L4"}


class RecordingRandom:
    """A NumPy generator that records its normal numbers: the tilts and shifts of the elements."""

    def __init__(self, seed):
        self.generator = np.random.default_rng(seed)
        self.normals = []

    def normal(self, *arguments, **named):
        drawn = self.generator.normal(*arguments, **named)
        self.normals.append(np.asarray(drawn))
        return drawn

    def __getattr__(self, name):
        return getattr(self.generator, name)


@dataclass
class Instance:
    """An image of the package with its pose in [0, 1] and its offsets in mm and degrees."""

    pattern: str
    pose: list
    elements: dict = field(default_factory=dict)
    first: np.ndarray = None
    second: np.ndarray = None


def data_folder():
    """The package's folder, without importing it."""
    return Path(importlib.util.find_spec("relign").submodule_search_locations[0]) / "data"


def pattern_file(name):
    return data_folder() / "ref_patterns" / f"{name}.png"


def shipped_reference():
    """The package's own reference image: its Siemens star at the nominal pose, 65,536 samples per pixel."""
    file = f"gt__spec_od__ref_pattern_siemens__sample_count_65536__{WIDTH}x{WIDTH}.npy"
    return np.load(data_folder() / "LensEnv" / file)[..., 0].astype(float)


def make_environment(pattern, samples, noise, seed):
    stand_ins.install()
    from relign.generator import LensEnv

    # The variant that the package chooses on a machine without a GPU.
    environment = LensEnv(
        spec="od",
        width=WIDTH,
        height=WIDTH,
        sample_count=samples,
        ref_pattern=pattern,
        noise_objects=noise,
        seed=seed,
        mitsuba_variant="scalar_rgb",
    )
    environment.random = RecordingRandom(seed)
    return environment


def turned_our_way(tilts_deg):
    """A pose in the terms of relign-bench: the package's angles about x and y are left-handed."""
    return [-float(tilt) for tilt in tilts_deg]


def our_pose(package_pose):
    return [float(share) for share in package_pose[:3]] + [1 - float(share) for share in package_pose[3:]]


def our_elements(environment):
    """The offsets that reset() drew: per element two tilts, then shifts in x and y, in the order of its table."""
    if environment.noise_objects == 0:
        return {}
    elements = {}
    names = list(environment.config["lens_noise_funcs"])
    for index, name in enumerate(names):
        tilts, shifts = environment.random.normals[2 * index : 2 * index + 2]
        elements[ELEMENTS[name]] = {
            "tilt_deg": turned_our_way(tilts),
            "shift_mm": [float(shifts[0]), float(shifts[1]), 0.0],
        }
    return elements


def all_elements_move(environment):
    """Shifts all four elements by 25 micrometres, by the package's own function; its noise shifts two by nanometres."""
    from relign import noise

    move = functools.partial(noise.gaussian_trans_rot, scale_rot=1.5, scale_trans=0.05)
    environment.config["lens_noise_funcs"] = dict.fromkeys(ELEMENTS, move)


def start_near_focus(environment):
    """Limits starts to a third of the travel along the axis: half a millimetre of defocus would hide everything else."""
    drawn = environment._init_random_starting_position
    environment._init_random_starting_position = lambda: drawn() * np.array([1, 1, 0.3, 1, 1])


def drawn_instance(pattern, samples, noise, seed):
    """Draws an assembly and a start pose by reset() and renders them twice, with independent noise."""
    environment = make_environment(pattern, samples, noise, seed)
    all_elements_move(environment)
    start_near_focus(environment)
    first = environment.reset()[..., 0].astype(float)
    second = environment._make_image(environment.r)[..., 0].astype(float)
    return Instance(pattern, our_pose(environment.r), our_elements(environment), first, second)
