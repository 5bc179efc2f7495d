"""Where trainings run: the learner's device, and the one that renders images."""

from __future__ import annotations

import contextlib

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
