"""The compiled part and the plugins it may use."""

import json
import os
import pathlib
import sys
import threading

try:
    from . import _core
except ImportError as problem:
    raise ImportError(
        "relign_bench's compiled part is missing. From a clone: `pip install ./python`, or build with CMake and put "
        "BUILD_FOLDER/python on PYTHONPATH. (" + str(problem) + ")"
    ) from problem

# Plugins in Python see what is installed beside this package.
os.environ.setdefault("RELIGN_PYTHON", sys.executable or "python3")

_catalog = None
_lock = threading.Lock()


def plugin_roots():
    """Folders that are searched for plugins: the package's own, the build folder's, then RELIGN_PLUGIN_PATH."""
    here = pathlib.Path(__file__).parent  # in a build folder: a link among links
    package = pathlib.Path(_core.__file__).parent
    roots = [
        package / "lib" / "relign-bench" / "plugins",  # installed by pip
        package.parents[1] / "lib" / "relign-bench" / "plugins",  # BUILD/python/relign_bench
        here / "lib" / "relign-bench" / "plugins",
    ]
    roots += [pathlib.Path(part) for part in os.environ.get("RELIGN_PLUGIN_PATH", "").split(os.pathsep) if part]
    seen = []
    for root in roots:
        if root.is_dir() and root.resolve() not in seen:
            seen.append(root.resolve())
    return seen


def catalog():
    """Every plugin that can be used; made once."""
    global _catalog
    with _lock:
        if _catalog is None:
            _catalog = _core.Catalog([str(root) for root in plugin_roots()])
        return _catalog


def parameters_text(parameters):
    """A mapping of parameters as the compiled part takes it."""
    return json.dumps(dict(parameters)) if parameters else ""


def sized_parameters(scene, parameters, size):
    """Parameters that give the scene `size` columns; a pixel takes as many samples as ever, and so has as much noise.

    Raises ValueError for a scene whose sensor cannot be chosen.
    """
    given = dict(parameters or {})
    if size is None:
        return given
    if int(size) < 1:
        raise ValueError(f"size={size}: allowed: 1 or more")
    if "pixels" not in json.loads(catalog().parameters("scene", str(scene))):
        raise ValueError(f"size={size}: the sensor of scene '{scene}' cannot be chosen; leave size out")
    return {"pixels": int(size), **given}


def binned_parameters(scene, size):
    """Parameters that give the scene `size` columns, each pixel with the samples of all the pixels in its place: a
    picture of half the size has the noise of the whole one binned 2 x 2."""
    parameters = sized_parameters(scene, None, size)
    own = json.loads(catalog().parameters("scene", str(scene)))
    if "samples" in own:
        native = make_batch(scene, None, "rho0", None, "soft", 1, 1, 1).width
        parameters["samples"] = max(1, round(own["samples"] * (native / size) ** 2))
    return parameters


def make_batch(scene, scene_parameters, level, level_parameters, clipping, suite_seed, slots, threads):
    """The compiled part's batch of these names and mappings."""
    return _core.Batch(catalog(), str(scene), parameters_text(scene_parameters), str(level),
                       parameters_text(level_parameters), clipping, suite_seed, slots, threads, _core.cache_folder())


def cores():
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
