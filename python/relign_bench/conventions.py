"""What environments, training and agents agree on."""

import numpy as np

LARGEST_MOVE = 0.2  # of an agent, per axis and step, shares of the travel (the paper's)
BYTE_WHITES = 3.0  # pictures as bytes: 255 stands for this many times a white pixel; noise reaches beyond white


def to_bytes(frames, white):
    """Captures as bytes, any shape: rounded, 255 is BYTE_WHITES times a white pixel and all above."""
    scaled = frames * np.float32(255 / (BYTE_WHITES * white))
    scaled += np.float32(0.5)
    return np.minimum(scaled, 255, out=scaled).astype(np.uint8)
