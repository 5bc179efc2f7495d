"""Networks that see one picture and say where the optimum is."""

import torch
from torch import nn

from ..conventions import BYTE_WHITES


class StridedNet(nn.Module):
    """Strided convolutions without pooling, which would lose where an edge lies to a fraction of a pixel.

    Input: bytes or floats of bytes, batch x 1 x height x width. Output: the move to the optimum in shares of the travel,
    batch x axes. Scaling is inside, so that an exported graph takes captures as they are.
    """

    def __init__(self, size, axes, directions, widths=(16, 32, 64, 64), hidden=(256, 128)):
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
        self.head = nn.Linear(inputs, axes)  # errors along the eigen-directions
        self.register_buffer("vectors", torch.as_tensor(directions, dtype=torch.float32))

    def features(self, pictures):
        return self.body(pictures.float() * (BYTE_WHITES / 255))

    def along(self, pictures):
        """Errors along the directions: what the loss weighs."""
        return self.head(self.features(pictures))

    def forward(self, pictures):
        return self.along(pictures) @ self.vectors.T
