"""Images of the authors' package: its own LensEnv and its own draws, written down as we name them."""

import functools
import importlib.util
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import stand_ins

WIDTH = 200
# The package's names for the elements that its noise moves, and the file whose name says which lens each is.
ELEMENTS = {"lens_0": "L1", "lens_1": "L2", "lens_2": "L3", "lens_3": "L4"}


class RecordingRandom:
    """A NumPy generator that remembers the normal numbers it gave: the tilts and shifts of the elements."""

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
    """What the package rendered, in this project's words: pose in [0, 1], offsets in mm and degrees."""

    pattern: str
    pose: list
    elements: dict = field(default_factory=dict)
    first: np.ndarray = None
    second: np.ndarray = None


def data_folder():
    """Where the package keeps its files, found without importing it."""
    return Path(importlib.util.find_spec("relign").submodule_search_locations[0]) / "data"


def pattern_file(name):
    return data_folder() / "ref_patterns" / f"{name}.png"


def shipped_reference():
    """The package's own reference image: its Siemens star at the nominal pose, 65,536 samples a pixel."""
    file = f"gt__spec_od__ref_pattern_siemens__sample_count_65536__{WIDTH}x{WIDTH}.npy"
    return np.load(data_folder() / "LensEnv" / file)[..., 0].astype(float)


def make_environment(pattern, samples, noise, seed):
    stand_ins.install()
    from relign.generator import LensEnv

    # Always the variant that the package chooses on a machine without a GPU.
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
    """The package turns left-handed: its angles about x and y are the negatives of ours."""
    return [-float(tilt) for tilt in tilts_deg]


def our_pose(package_pose):
    return [float(share) for share in package_pose[:3]] + [1 - float(share) for share in package_pose[3:]]


def our_elements(environment):
    """The offsets that reset() has drawn: per element two tilts, then shifts in x and y, in the order of its table."""
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
    """The package shifts two elements by nanometres; here all four by 25 micrometres, by its own function."""
    from relign import noise

    move = functools.partial(noise.gaussian_trans_rot, scale_rot=1.5, scale_trans=0.05)
    environment.config["lens_noise_funcs"] = {name: move for name in ELEMENTS}


def start_near_focus(environment):
    """Half a millimetre of defocus hides everything else: starts keep a third of their travel along the axis."""
    drawn = environment._init_random_starting_position
    environment._init_random_starting_position = lambda: drawn() * np.array([1, 1, 0.3, 1, 1])


def drawn_instance(pattern, samples, noise, seed):
    """reset() draws an assembly and a start pose and renders it; rendered again, so that two noises are independent."""
    environment = make_environment(pattern, samples, noise, seed)
    all_elements_move(environment)
    start_near_focus(environment)
    first = environment.reset()[..., 0].astype(float)
    second = environment._make_image(environment.r)[..., 0].astype(float)
    return Instance(pattern, our_pose(environment.r), our_elements(environment), first, second)
