"""What a machine offers to the parts of gpu_all.py, as JSON: GPU, driver, Python packages, tools. Standard library only.

gpu_all.py runs it in a process of its own, because a driver or a package that is broken may end or block it.
"""

from __future__ import annotations

import contextlib
import ctypes
import glob
import importlib
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

PACKAGES = ("numpy", "torch", "gymnasium", "stable_baselines3", "sb3_contrib", "matplotlib", "onnx", "relign_bench")
TOOLS = ("compute-sanitizer", "nvidia-cuda-mps-control", "cc")
# Searched after those of PATH and of the loader: containers have NVIDIA's driver there.
TOOL_FOLDERS = ("/usr/local/cuda/bin", "/usr/local/nvidia/bin")
DRIVER_FOLDERS = ("/usr/local/nvidia/lib64",)


def gpu() -> str:
    """The name of the first GPU, by the driver that the simulator uses.

    Raises:
        OSError: No driver or no GPU was found.
    """
    driver = ctypes.CDLL(os.environ.get("RELIGN_LIBCUDA", "libcuda.so.1"))
    device, name = ctypes.c_int(), ctypes.create_string_buffer(256)
    for function, arguments in ((driver.cuInit, (0,)), (driver.cuDeviceGet, (ctypes.byref(device), 0)),
                                (driver.cuDeviceGetName, (name, len(name), device))):
        status = function(*arguments)
        if status != 0:
            raise OSError(f"{function.__name__} returned {status}")
    return name.value.decode()


def driver_version() -> str:
    """The driver's version, by nvidia-smi; "unknown" without it."""
    try:
        done = subprocess.run(["nvidia-smi", "--query-gpu=driver_version", "--format=csv,noheader"], capture_output=True,
                              text=True, timeout=30, check=True)
        return done.stdout.split()[0]
    except (OSError, subprocess.SubprocessError, IndexError):
        return "unknown"


def compiler() -> str:
    """NVRTC's file, which Python packages and toolkits put where no loader looks, or the name that the loader finds."""
    if "RELIGN_LIBNVRTC" in os.environ:
        return os.environ["RELIGN_LIBNVRTC"]
    patterns = [f"{folder}/nvidia/*/lib/libnvrtc.so.1[2-9]" for folder in sys.path]
    patterns += ["/usr/local/cuda*/lib64/libnvrtc.so.1[2-9]", "/usr/local/cuda*/targets/*/lib/libnvrtc.so.1[2-9]"]
    found = [file for pattern in patterns for file in sorted(glob.glob(pattern))]
    for name in (*found, "libnvrtc.so.13", "libnvrtc.so.12"):
        with contextlib.suppress(OSError):
            ctypes.CDLL(name)
            return name
    return ""


def package(name: str) -> str:
    """The version of a package that can be imported.

    Raises:
        Exception: It cannot be imported, for whatever reason.
    """
    return str(getattr(importlib.import_module(name), "__version__", "of unknown version"))


def tool(name: str) -> str:
    """The path of a program; "" where there is none."""
    return shutil.which(name) or ""


def machine() -> dict[str, dict[str, str]]:
    """What is here, and why something is not.

    Returns:
        "here": version, name or path of each thing; "missing": the reason of each.
    """
    here = {"python": platform.python_version(), "cores": str(len(os.sched_getaffinity(0))), "kernel": platform.release()}
    missing: dict[str, str] = {}

    def look(what: str, find: Callable[..., str], *arguments: str) -> None:
        try:
            found = find(*arguments)
        except BaseException as problem:  # noqa: BLE001 (of packages: also SystemExit)
            missing[what] = " ".join(f"{type(problem).__name__}: {problem}".split())[:200]
            return
        if found:
            here[what] = found
        else:
            missing[what] = "not found"

    look("gpu", gpu)
    look("driver", driver_version)
    look("nvrtc", compiler)
    for name in PACKAGES:
        look(name, package, name)
    if "relign_bench" in here:
        look("module", package, "relign_bench._core")
    else:
        missing["module"] = missing["relign_bench"]
    if "torch" in here:
        torch = importlib.import_module("torch")
        look("torch-gpu", lambda: torch.cuda.get_device_name(0))
    else:
        missing["torch-gpu"] = missing["torch"]
    for name in TOOLS:
        look(name, tool, name)
    return {"here": here, "missing": missing}


if __name__ == "__main__":
    print(json.dumps(machine()))
