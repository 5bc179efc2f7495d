"""PyTorch on the GPU that the compiled module renders on: memory for images, where they stay."""

from __future__ import annotations

import os
import pathlib
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._typing import AnyArray

DEVICE = "cuda:0"
"""The first GPU, which the simulator uses. Tests replace it where the driver is emulated in the processor's memory."""


def find_compiler() -> None:
    """Sets RELIGN_LIBNVRTC to NVIDIA's compiler among the installed Python packages, which is on no search path.

    That of PyTorch's version of CUDA comes first: a GPU that PyTorch can use runs its code.
    """
    if "RELIGN_LIBNVRTC" in os.environ:
        return
    try:
        import torch
    except ImportError:
        version = ""
    else:
        version = str(torch.version.cuda).partition(".")[0]
    found = [str(path) for folder in sys.path
             for path in sorted(pathlib.Path(folder).glob("nvidia/*/lib/libnvrtc.so.1[0-9]"))]
    found.sort(key=lambda path: not path.endswith("." + version))
    if found:
        os.environ["RELIGN_LIBNVRTC"] = found[0]


def load_torch() -> Any:
    """The module torch.

    Raises:
        ValueError: It is not installed, or cannot use a GPU.
    """
    try:
        import torch
    except ImportError as problem:
        raise ValueError(f"device 'cuda' needs PyTorch, whose tensors are its images: pip install torch ({problem})") from None
    if DEVICE.startswith("cuda") and not torch.cuda.is_available():
        raise ValueError(f"device 'cuda' needs a PyTorch that can use the GPU; PyTorch {torch.__version__} cannot")
    return torch


def images(count: int, shape: tuple[int, ...]) -> Any:
    """A float32 tensor on the GPU of zeros, of shape (count, *shape)."""
    torch = load_torch()
    return torch.zeros((count, *shape), dtype=torch.float32, device=DEVICE)


def on_device(values: AnyArray) -> Any:
    """A tensor on the GPU with a copy of these values."""
    return load_torch().tensor(values, device=DEVICE)


def on_host(values: Any) -> AnyArray:
    """An array with the values of a tensor; another array as it is."""
    if hasattr(values, "detach"):
        values = values.detach().cpu().numpy()
    return np.asarray(values)
