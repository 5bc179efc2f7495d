"""relign-bench, called as users call it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LENS_FILE = ROOT / "plugins/scenes/lens_system/relign_od/lens.json"


def path():
    """Path of the program, or None where it is not built."""
    candidate = Path(os.environ.get("RELIGN_BENCH", ROOT / "build/release/bin/relign-bench"))
    return candidate if candidate.is_file() else None


def call(*arguments):
    # Plugins in Python run with this interpreter, which has their packages.
    folders = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    environment = {**os.environ, "PATH": folders}
    done = subprocess.run([str(path()), *map(str, arguments)], capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"relign-bench {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


def lens():
    return json.loads(LENS_FILE.read_text())


def first_order():
    info = json.loads(call("lens", "info", "--scene", "relign_od", "--json"))
    return info["first_order"]


def trace(rays, folder):
    """Traces rays, [{"start_mm", "direction", "elements"}]; returns them with their intersections."""
    file = Path(folder) / "rays.json"
    file.write_text(json.dumps({"rays": rays}))
    return json.loads(call("lens", "trace", file, "--scene", "relign_od"))["rays"]


def has_scene(scene):
    return has_plugin(scene)


def has_plugin(plugin):
    try:
        call("describe", plugin)
        return True
    except RuntimeError:
        return False


def render(folder, pose, elements, target, scene="relign_od", *options):
    """One image at a pose in shares of the travel, noise-free unless the options change it."""
    assembly = Path(folder) / "assembly.json"
    assembly.write_text(json.dumps({"elements": elements}))
    out = Path(folder) / "image.npy"
    call(
        "render",
        *("--scene", scene),
        *("--pose", ",".join(repr(float(share)) for share in pose)),
        *("--assembly", assembly),
        *("--target", target),
        *("-o", out),
        *(options or ("--noise-free",)),
    )
    return np.load(out).reshape(200, 200).astype(float)
