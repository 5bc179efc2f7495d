"""Where trainings run: the learner's device, and the one that renders images."""

from __future__ import annotations

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
    if device.partition(":")[0] not in DEVICES:
        raise ValueError(f"device '{device}' is not supported; expected 'cpu' or 'cuda'")
    check_name(render, DEVICES, "renderer")
    if device != "cpu" and not torch.cuda.is_available():
        raise ValueError(f"device '{device}': torch {torch.__version__} finds no GPU here; use --device cpu")
    there = torch.device(_cuda.DEVICE)
    if render == "cuda" and (torch.device(device).type, torch.device(device).index or 0) != (there.type, there.index or 0):
        raise ValueError("images that are rendered on the first GPU stay there, and the learner is on "
                         f"'{device}'; use --device cuda, or --render cpu")
