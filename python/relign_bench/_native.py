"""The compiled module, the plugin catalogue, and parameters in the form that the compiled module takes."""

from __future__ import annotations

import json
import os
import pathlib
import sys
import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

try:
    from . import _core
except ImportError as problem:
    raise ImportError(
        "the compiled module relign_bench._core is missing; from a clone run `pip install ./python`, or build with "
        f"CMake and put BUILD_FOLDER/python on PYTHONPATH ({problem})"
    ) from problem

from ._errors import require_integer, unknown_name

if TYPE_CHECKING:
    from ._typing import Parameters, Plugin

# Plugins in Python run with this interpreter, so that they find the packages installed beside this one.
os.environ.setdefault("RELIGN_PYTHON", sys.executable or "python3")

_catalog: _core.Catalog | None = None
_lock = threading.Lock()


def plugin_roots() -> list[pathlib.Path]:
    """Existing folders that are searched for plugins, without duplicates.

    In this order: the installed package's own, the build folder's, then those named in RELIGN_PLUGIN_PATH.
    """
    here = pathlib.Path(__file__).parent  # in a build folder, __file__ is a symbolic link into the source tree
    package = pathlib.Path(_core.__file__).parent
    roots = [
        package / "lib" / "relign-bench" / "plugins",  # installed by pip
        package.parents[1] / "lib" / "relign-bench" / "plugins",  # BUILD/python/relign_bench
        here / "lib" / "relign-bench" / "plugins",
    ]
    roots += [pathlib.Path(part) for part in os.environ.get("RELIGN_PLUGIN_PATH", "").split(os.pathsep) if part]
    found: list[pathlib.Path] = []
    for root in roots:
        if root.is_dir() and root.resolve() not in found:
            found.append(root.resolve())
    return found


def catalog() -> _core.Catalog:
    """The catalogue of all plugins, created on first use and shared by all threads."""
    global _catalog  # noqa: PLW0603
    with _lock:
        if _catalog is None:
            _catalog = _core.Catalog([str(root) for root in plugin_roots()])
        return _catalog


def chosen_plugin(kind: str, plugin: Plugin, parameters: Parameters | None = None) -> tuple[str, dict[str, Any]]:
    """Name and parameters of a plugin that is chosen by its name, or by an object as in a suite.

    Args:
        kind: "scene", "noise level" or "algorithm", for messages.
        plugin: Id, preset or path, or {"use": id, preset or path, "parameters": {...}}.
        parameters: Parameters beside a name.

    Raises:
        ValueError: It is neither, the object has other keys, or there are parameters in it and beside it.
    """
    use: object = plugin
    if isinstance(plugin, Mapping):
        for key in plugin:
            if key not in ("use", "parameters"):
                raise ValueError(f"{kind} {dict(plugin)!r}: {unknown_name('key', key, ('use', 'parameters'))}")
        if parameters and plugin.get("parameters"):
            raise ValueError(f"{kind} {dict(plugin)!r} has parameters of its own: give no others, not {parameters!r}")
        use, parameters = plugin.get("use"), plugin.get("parameters") or parameters
    if not isinstance(use, (str, os.PathLike)):
        raise ValueError(f"{kind} must be an id, a preset, a path, or an object {{'use': ..., 'parameters': {{...}}}}, "
                         f"not {plugin!r}")
    if not isinstance(parameters or {}, Mapping):
        raise ValueError(f"parameters of the {kind} must be an object (a dict), not {parameters!r}")
    return os.fspath(use), dict(parameters or {})


def parameters_text(parameters: Parameters | None) -> str:
    """Parameters as the compiled module takes them: the text of a JSON object, "" for none.

    Raises:
        ValueError: JSON has no such value; the message names the parameter.
    """
    for name, value in (parameters or {}).items():
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError):
            raise ValueError(f"parameter '{name}' must be a finite number, a text, a bool, a list or a dict of Python, not "
                             f"{value!r}; convert it, such as float(value) or value.tolist() of numpy") from None
    return json.dumps(dict(parameters)) if parameters else ""


def sized_parameters(scene: str, parameters: Parameters | None, size: int | None) -> dict[str, Any]:
    """Scene parameters that give the sensor `size` columns.

    The number of samples a pixel does not change with the size, and neither does the noise of a pixel.

    Args:
        scene: Id, preset or path of the scene.
        parameters: Other parameters of the scene; they take precedence.
        size: Columns of the sensor; None leaves the parameters as they are.

    Raises:
        ValueError: The size is not positive, or the scene has a fixed sensor.
    """
    given = dict(parameters or {})
    if size is None:
        return given
    size = require_integer(size, "size", 1)
    if "pixels" not in json.loads(catalog().parameters("scene", str(scene))):
        raise ValueError(f"scene '{scene}' has a fixed sensor: size={size} is not supported; leave size out")
    return {"pixels": size, **given}


def binned_parameters(scene: str, size: int) -> dict[str, Any]:
    """Scene parameters that give the sensor `size` columns with the noise of binned pixels.

    Each pixel gets the samples of all native pixels that it replaces: an image of half the size has the noise of a native
    image that was binned 2 x 2.

    Raises:
        ValueError: The size is not positive, or the scene has a fixed sensor.
    """
    parameters = sized_parameters(scene, None, size)
    defaults = json.loads(catalog().parameters("scene", str(scene)))
    if "samples" in defaults:
        native = make_batch(scene, None, "rho0", None, "soft", 1, 1, 1).width
        parameters["samples"] = max(1, round(defaults["samples"] * (native / size) ** 2))
    return parameters


def make_batch(scene: str, scene_parameters: Parameters | None, level: str, level_parameters: Parameters | None,
               clipping: str, suite_seed: int, slots: int, threads: int, device: str = "cpu") -> _core.Batch:
    """A batch of the compiled module, from names and mappings."""
    return _core.Batch(catalog(), str(scene), parameters_text(scene_parameters), str(level),
                       parameters_text(level_parameters), clipping, suite_seed, slots, threads, _core.cache_folder(),
                       device)


def make_trials(scene: str, scene_parameters: Parameters | None, level: str, level_parameters: Parameters | None,
                suite_seed: int, threads: int) -> _core.Trials:
    """A trial runner of the compiled module, from names and mappings."""
    return _core.Trials(catalog(), str(scene), parameters_text(scene_parameters), str(level),
                        parameters_text(level_parameters), suite_seed, threads, _core.cache_folder())


def available_cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def chosen_threads(threads: int | None) -> int:
    """A number of threads; None: one for each core.

    Raises:
        ValueError: It is not a positive integer.
    """
    return available_cores() if threads is None else require_integer(threads, "threads", 1, 2**31 - 1)
