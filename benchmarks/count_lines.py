#!/usr/bin/env python3
"""Lines of the tree: benchmarks/count_lines.py [--json]

Counts the lines of tracked source files (C, C++, CUDA, Python, JavaScript, CSS and shell), blank lines and comments included,
in core/, in everything except tests, and in tests, then by component (core/README.md).
"""

import argparse
import json
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
SOURCES = {".c", ".cc", ".cpp", ".h", ".hpp", ".cu", ".py", ".pyi", ".js", ".css", ".sh", ".inc", ".soa"}
COMPONENTS = {
    "simulator": ("core/simulator", "plugins/scenes/lens_system", "plugins/scenes/lens_mesh"),
    "gpu": ("core/simulator/gpu",),
    "leaderboard": ("core/analysis/leaderboard", "core/analysis/leaderboard_verbs", "core/harness/submissions"),
    "cluster": ("core/harness/slurm",),
    "training": ("core/training", "python/relign_bench/training"),
    "plugins": ("plugins",),
    "Python": ("python",),
    "harness": ("core",),
}


def tracked():
    listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True, check=True).stdout
    for name in listed.split("\0"):
        path = pathlib.PurePath(name)
        if path.suffix in SOURCES or name in ("quickstart", ".ci/run", ".ci/fuzz", ".ci/tidy"):
            yield path


def is_test(path):
    return path.parts[0] == "tests" or path.stem.endswith("_test")


def component(path):
    """The component with the longest folder that holds the file; None for documents, benchmarks and examples."""
    held = [(len(folder), name) for name, folders in COMPONENTS.items() for folder in folders
            if path.is_relative_to(folder)]
    return max(held)[1] if held else None


def counted():
    totals = {"core": 0, "not tests": 0, "tests": 0}
    parts = dict.fromkeys(reversed(COMPONENTS), 0)
    for path in tracked():
        with open(ROOT / path, "rb") as file:
            lines = sum(1 for _ in file)
        totals["tests" if is_test(path) else "not tests"] += lines
        if is_test(path):
            continue
        if path.parts[0] == "core":
            totals["core"] += lines
        if name := component(path):
            parts[name] += lines
    return {"totals": totals, "components": parts}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print JSON")
    result = counted()
    if parser.parse_args().json:
        print(json.dumps(result, indent=1))
        return
    for group in result.values():
        for name, lines in group.items():
            print(f"{name:<12} {lines:>7,}")
        print()


if __name__ == "__main__":
    main()
