"""Conventions that environments, training and agents share."""

from __future__ import annotations

import functools
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._typing import AnyArray, ByteArray, Float32Array

LARGEST_MOVE = 0.2
"""Largest move of an agent, per axis and step, as a share of the travel (arXiv 2503.02075)."""

BYTE_WHITES = 3.0
"""Byte 255 of an image stands for this many times the value of a white pixel: noise exceeds white."""


def binned(frames: AnyArray, bins: int) -> Any:
    """Means over squares of pixels, ten times as fast as by numpy's mean, and with the same bits for tensors.

    Args:
        frames: An array or a tensor, shape (..., height, width), multiples of `bins`.
        bins: Rows and columns of a square.

    Returns:
        Shape (..., height / bins, width / bins).
    """
    # Not a division, which PyTorch on a GPU makes a product.
    columns = functools.reduce(operator.add, (frames[..., k::bins] for k in range(bins)))
    return functools.reduce(operator.add, (columns[..., k::bins, :] for k in range(bins))) * (1 / (bins * bins))


def byte_scale(white: float) -> np.float32:
    """The factor from values of captures, with this value of a white pixel, to bytes."""
    return np.float32(255 / (BYTE_WHITES * white))


def to_bytes(frames: Float32Array, white: float) -> ByteArray:
    """Captures as bytes.

    Args:
        frames: Captures in the scene's units, any shape.
        white: Value of a white pixel, in the same units.

    Returns:
        Rounded values, 255 at BYTE_WHITES times white and above, 0 below 0; the same shape.
    """
    scaled = frames * byte_scale(white)
    scaled += np.float32(0.5)
    return np.clip(scaled, 0, 255, out=scaled).astype(np.uint8)
