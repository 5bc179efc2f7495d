"""Networks that predict the residual to the optimum from one image."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch
from torch import nn

from ..conventions import BYTE_WHITES

if TYPE_CHECKING:
    from .._typing import Float64Array


class StridedNet(nn.Module):
    """Strided convolutions without pooling, which would lose the position of an edge within a pixel.

    Input: bytes, or floats with the values of bytes, shape (batch, 1, height, width). Output: the residual to the optimum in
    shares of the travel, shape (batch, axes). The network scales its input, so that an exported graph takes captures as they
    are.

    Args:
        size: Rows and columns of the images.
        axes: Number of axes.
        directions: Directions as columns, shape (axes, axes); the last layer predicts along them.
        widths: Channels of the convolutions.
        hidden: Widths of the hidden layers.
    """

    def __init__(self, size: int, axes: int, directions: Float64Array, widths: Sequence[int] = (16, 32, 64, 64),
                 hidden: Sequence[int] = (256, 128)) -> None:
        super().__init__()
        layers, channels = [], 1
        for k, width in enumerate(widths):
            kernel = 5 if k == 0 else 3
            layers += [nn.Conv2d(channels, width, kernel, 2, kernel // 2), nn.ReLU()]
            channels, size = width, (size + 1) // 2
        layers.append(nn.Flatten())
        inputs = channels * size * size
        for width in hidden:
            layers += [nn.Linear(inputs, width), nn.ReLU()]
            inputs = width
        self.body = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, axes)  # residuals along the directions
        self.register_buffer("vectors", torch.as_tensor(directions, dtype=torch.float32))

    def features(self, images: torch.Tensor) -> torch.Tensor:
        """Features, shape (batch, last hidden width)."""
        return self.body(images.float() * (BYTE_WHITES / 255))

    def along(self, images: torch.Tensor) -> torch.Tensor:
        """Residuals along the directions, shape (batch, axes), for the loss."""
        return self.head(self.features(images))

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Residuals in shares of the travel, shape (batch, axes)."""
        return self.along(images) @ self.vectors.T
