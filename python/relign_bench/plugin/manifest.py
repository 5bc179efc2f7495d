"""Manifests: the class of a plugin is its manifest."""

from __future__ import annotations

import inspect
import os
import re
import sys

from .parameters import Parameter, parameters_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

# Class attributes that the manifest has besides parameters, under the same key; "observes" is its key "observes".
ATTRIBUTES = ("id", "kind", "summary", "observes", "presets", "license", "citation", "reproducible", "oracle", "training",
              "prepare", "version")
SUGGESTIONS = {**{name: name for name in ATTRIBUTES}, "observes": "observes"}


class ManifestError(TypeError):
    """A mistake of the author in a plugin's class, whose message needs no traceback."""


def refuse_misspelt_attributes(cls: type) -> None:
    """Refuses attributes whose names are close to those of the manifest.

    Without this check, `observe` in the place of `observes` would silently change nothing.

    Raises:
        TypeError: An attribute is probably misspelt.
    """
    for name, value in vars(cls).items():
        if name.startswith("_") or name in ATTRIBUTES or callable(value) or isinstance(value, (Parameter, property)):
            continue
        from difflib import get_close_matches  # slow to import, and rarely needed

        for meant in get_close_matches(name, SUGGESTIONS, 1, 0.85):
            raise ManifestError(f"{cls.__name__} has the attribute '{name}'; did you mean '{SUGGESTIONS[meant]}'?")


def manifest_of(cls: type) -> dict[str, Any]:
    """The manifest of a plugin class, as docs/plugins.md describes it.

    Args:
        cls: A class derived from Optimizer, Agent, Scene, Station or NoiseLevel. Its name, in snake case, is the id unless it
            has an attribute `id`; the first paragraph of its docstring, or of its module's, is the summary.

    Raises:
        ManifestError: The class has no docstring, or a misspelt attribute.
    """
    refuse_misspelt_attributes(cls)
    summary = getattr(cls, "summary", None) or cls.__dict__.get("__doc__")
    if not summary:
        summary = getattr(sys.modules.get(cls.__module__), "__doc__", None)
    if not summary:
        raise ManifestError(f"the class {cls.__name__} needs a docstring: its first paragraph is the plugin's summary")
    words = re.sub(r"(?<=[a-z0-9])([A-Z])|(?<=[A-Z])([A-Z])(?=[a-z])", r"_\1\2", cls.__name__)
    manifest: dict[str, Any] = {
        "id": getattr(cls, "id", None) or words.strip("_").lower(),
        "kind": getattr(cls, "kind", None),
        "summary": " ".join(inspect.cleandoc(summary).split("\n\n")[0].split()),
        "parameters": {name: entry.declaration() for name, entry in parameters_of(cls).items()},
    }
    if hasattr(cls, "observes"):
        manifest["observes"] = list(cls.observes)
    presets = getattr(cls, "presets", None)
    if presets:
        manifest["presets"] = {name: {"parameters": dict(values)} for name, values in presets.items()}
    for key in ("license", "citation", "reproducible", "oracle", "training", "prepare", "version"):
        value = getattr(cls, key, None)
        if value is not None:
            manifest[key] = value
    return manifest


def imported_files() -> list[str]:
    """Modules that the script has imported from its own folder, relative to it: they are part of the plugin."""
    folder = os.path.dirname(os.path.realpath(sys.argv[0]))
    found = set()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name == "__main__" or not file or not file.endswith(".py"):
            continue
        path = os.path.relpath(os.path.realpath(file), folder)
        parts = path.split(os.sep)
        # A virtual environment within the folder is not part of the plugin.
        if parts[0] != os.pardir and not {"site-packages", "dist-packages"} & set(parts):
            found.add(path)
    return sorted(found)
