"""The latest observations of every slot: as arrays, or on the GPU as tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _cuda
from .conventions import binned, to_bytes

if TYPE_CHECKING:
    from ._typing import AnyArray, Float32Array, Slots


class Stacks:
    """The latest frames of every slot, oldest first.

    Args:
        slots: Number of slots.
        shape: Frames, height and width of a stack.
        binning: Rows and columns of a capture that become one pixel.
        white: Value of a white pixel of bytes; None for float32.
        largest: Upper bound of float32 values.
    """

    def __init__(self, slots: int, shape: tuple[int, int, int], binning: int, white: float | None, largest: float) -> None:
        self._binning, self._white, self._largest = binning, white, largest
        self._stacks: Any = np.zeros((slots, *shape), np.float32 if white is None else np.uint8)

    def clear(self, slots: Slots) -> None:
        """Sets the stacks of these slots to zeros."""
        self._stacks[slots] = 0

    def push(self, slots: Slots, frames: Float32Array) -> None:
        """Appends the latest captures of these slots.

        Args:
            slots: The slots.
            frames: The captures of all slots, shape (slots, height, width).
        """
        if self._stacks.shape[1] > 1:
            self._stacks[slots, :-1] = self._stacks[slots, 1:]
        for slot in slots:
            frame = frames[slot]
            if self._binning > 1:
                frame = binned(frame, self._binning)
            if self._white is not None:
                self._stacks[slot, -1] = to_bytes(frame, self._white)
            else:
                np.minimum(frame, self._largest, out=self._stacks[slot, -1])

    def one(self, slot: int) -> AnyArray:
        """A copy of a slot's stack."""
        return self._stacks[slot].copy()

    def all(self) -> AnyArray:
        """A copy of all stacks."""
        return self._stacks.copy()


class DeviceStacks(Stacks):
    """The same on the GPU. Captures are tensors there, too, and no image is copied to the host."""

    def __init__(self, slots: int, shape: tuple[int, int, int], binning: int, white: float | None, largest: float) -> None:
        super().__init__(0, shape, binning, white, largest)
        self._torch = _cuda.load_torch()
        self._stacks = _cuda.on_device(np.zeros((slots, *shape), self._stacks.dtype))

    def clear(self, slots: Slots) -> None:
        """As of Stacks."""
        self._stacks = self._stacks.clone()  # `all` has handed out the other
        super().clear(slots)

    def push(self, slots: Slots, frames: Any) -> None:
        """As of Stacks; frames is a tensor."""
        every = list(slots) == list(range(len(self._stacks)))
        index = slice(None) if every else _cuda.on_device(np.array(slots, np.int64))
        frames = frames[index]
        if self._binning > 1:
            frames = binned(frames, self._binning)
        frames = frames.clamp(max=self._largest) if self._white is None else to_bytes(frames, self._white)
        stacks = self._torch.cat((self._stacks[index, 1:], frames[:, None]), 1)
        if every:
            self._stacks = stacks
        else:
            self._stacks = self._stacks.clone()
            self._stacks[index] = stacks

    def one(self, slot: int) -> Any:
        """A copy of a slot's stack, a tensor."""
        return self._stacks[slot].clone()

    def all(self) -> Any:
        """All stacks, a tensor that no later step changes."""
        return self._stacks
