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
    shares of the travel, shape (batch, axes); with `doubt`, followed by the logarithms of the standard deviations of the
    residual's errors along the directions, shape (batch, 2 * axes). The network scales its input, so that an exported graph
    takes captures as they are.

    Args:
        size: Rows and columns of the images.
        axes: Number of axes.
        directions: Directions as columns, shape (axes, axes); the last layer predicts along them.
        widths: Channels of the convolutions.
        hidden: Widths of the hidden layers.
        doubt: Whether the network also predicts how wrong it is.
    """

    def __init__(self, size: int, axes: int, directions: Float64Array, widths: Sequence[int] = (16, 32, 64, 64),
                 hidden: Sequence[int] = (256, 128), doubt: bool = False) -> None:
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
        self.axes, self.doubt = axes, doubt
        self.body = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, 2 * axes if doubt else axes)  # along the directions
        vectors = torch.as_tensor(directions, dtype=torch.float32)
        # From values along the directions to the output.
        to_output = torch.block_diag(vectors.T, torch.eye(axes)) if doubt else vectors.T
        self.register_buffer("vectors", vectors)
        self.register_buffer("to_output", to_output.contiguous(), persistent=False)

    def features(self, images: torch.Tensor) -> torch.Tensor:
        """Features, shape (batch, last hidden width)."""
        return self.body(images.float() * (BYTE_WHITES / 255))

    def along(self, images: torch.Tensor) -> torch.Tensor:
        """Output along the directions, for the loss; shape as of the output."""
        return self.head(self.features(images))

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """The output, shape (batch, axes) or (batch, 2 * axes)."""
        return self.along(images) @ self.to_output

    def load_residual(self, state: dict[str, torch.Tensor]) -> None:
        """Loads the weights of a network of the same shape; of one with doubt only what predicts the residual."""
        own = self.state_dict()
        self.load_state_dict({name: value[:len(own[name])] if name.startswith("head.") else value
                              for name, value in state.items()})
