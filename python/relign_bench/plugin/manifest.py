"""The class is the manifest."""

import inspect
import os
import re
import sys

from .parameters import Parameter, parameters_of

# What a class says of itself besides its parameters.
WORDS = ("id", "kind", "summary", "knows", "presets", "license", "citation", "reproducible", "oracle", "training", "prepare")


def refuse_misspelt_words(cls):
    """A manifest's mistakes are told, and a class is one: `know` for `knows` would change nothing, silently."""
    for name, value in vars(cls).items():
        if name.startswith("_") or name in WORDS or callable(value) or isinstance(value, (Parameter, property)):
            continue
        from difflib import get_close_matches  # slow to import, and rarely needed

        for meant in get_close_matches(name, WORDS, 1, 0.85):
            raise TypeError("%s has the attribute '%s'; did you mean '%s'?" % (cls.__name__, name, meant))


def manifest_of(cls):
    """The manifest that the class is, as a dictionary (see docs/plugins.md). Raises TypeError for what is none."""
    refuse_misspelt_words(cls)
    summary = getattr(cls, "summary", None) or cls.__dict__.get("__doc__")
    if not summary:
        summary = getattr(sys.modules.get(cls.__module__), "__doc__", None)
    if not summary:
        raise TypeError("%s needs a docstring: its first paragraph is the plugin's summary" % cls.__name__)
    words = re.sub(r"(?<=[a-z0-9])([A-Z])|(?<=[A-Z])([A-Z])(?=[a-z])", r"_\1\2", cls.__name__)
    manifest = {
        "id": getattr(cls, "id", None) or words.strip("_").lower(),
        "kind": cls.kind,
        "summary": " ".join(inspect.cleandoc(summary).split("\n\n")[0].split()),
        "parameters": {name: entry.declaration() for name, entry in parameters_of(cls).items()},
    }
    if hasattr(cls, "knows"):
        manifest["knows"] = list(cls.knows)
    if cls.presets:
        manifest["presets"] = {name: {"parameters": dict(values)} for name, values in cls.presets.items()}
    for key in ("license", "citation", "reproducible", "oracle", "training", "prepare"):
        value = getattr(cls, key, None)
        if value is not None:
            manifest[key] = value
    return manifest


def imported_files():
    """The modules that the script has imported from its own folder: they are part of the plugin."""
    folder = os.path.dirname(os.path.realpath(sys.argv[0]))
    found = set()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name == "__main__" or not file or not file.endswith(".py"):
            continue
        path = os.path.relpath(os.path.realpath(file), folder)
        parts = path.split(os.sep)
        # An environment that lies in the folder is no part of the plugin.
        if parts[0] != os.pardir and not {"site-packages", "dist-packages"} & set(parts):
            found.add(path)
    return sorted(found)
