"""Where training runs: the learner's device, the one that renders images, and the machine."""

from __future__ import annotations

import contextlib
import os
import pathlib
import platform
from typing import Any

import torch

from .. import _cuda
from .._errors import check_name

DEVICES = ("cpu", "cuda")


def check_device(device: str, render: str = "cpu") -> None:
    """Checks that torch can train on a device, with images from there or from the CPU.

    Args:
        device: Torch device of the learner: "cpu", "cuda" or "cuda:N".
        render: Where images are rendered: "cpu", or "cuda" for the first GPU.

    Raises:
        ValueError: It cannot.
    """
    chosen: torch.device | None = None
    with contextlib.suppress(RuntimeError):  # of names that torch does not have
        chosen = torch.device(device)
    if chosen is None or (device != "cpu" and chosen.type != "cuda"):
        raise ValueError(f"device '{device}' is not supported; expected 'cpu', 'cuda' or 'cuda:N'")
    check_name(render, DEVICES, "renderer")
    if chosen.type == "cuda" and not torch.cuda.is_available():
        raise ValueError(f"device '{device}': torch {torch.__version__} finds no GPU here; use --device cpu")
    if chosen.type == "cuda" and (chosen.index or 0) >= torch.cuda.device_count():
        raise ValueError(f"device '{device}': torch finds {torch.cuda.device_count()} GPUs here, from cuda:0 on")
    there = torch.device(_cuda.DEVICE)
    if render == "cuda" and (chosen.type, chosen.index or 0) != (there.type, there.index or 0):
        raise ValueError("images that are rendered on the first GPU stay there, and the learner is on "
                         f"'{device}'; use --device cuda, or --render cpu")


def processor() -> str:
    """Name of the processor."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def trained_on(before: dict[str, Any], threads: int | None, device: str, render: str) -> dict[str, Any]:
    """Where a run was trained, for its checkpoint and side file.

    Args:
        before: As returned for the run's beginning, or empty.
        threads: Threads that train; None: all cores.
        device: Torch device of the learner.
        render: Where images are rendered.

    Returns:
        threads and torch, both of this process; device and render likewise, where they are not the CPU; and machine: processors
        and GPUs of the whole run, separated by commas.
    """
    machines = [*(before["machine"].split(", ") if before else []), processor()]
    if torch.device(device).type == "cuda":
        machines.append(torch.cuda.get_device_name(device))
    places = {name: place for name, place in (("device", device), ("render", render)) if place != "cpu"}
    return {"threads": threads or os.cpu_count(), "torch": str(torch.__version__), **places,
            "machine": ", ".join(dict.fromkeys(machines))}
