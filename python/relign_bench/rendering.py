"""What `render` of an environment shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from ._cuda import on_host

if TYPE_CHECKING:
    from ._task import AlignmentTask
    from ._typing import ByteArray, Float32Array

_IMAGE_SIDE = 300  # pixels, at least: the images are enlarged to about this height
_GAP, _BAR = 8, 14  # pixels


def _grey(image: Float32Array, white: float) -> ByteArray:
    """An image as RGB bytes, each pixel repeated so that the image is large enough to see."""
    repeat = max(1, round(_IMAGE_SIDE / image.shape[0]))
    values = (np.clip(image / (1.5 * white), 0, 1) * 255).astype(np.uint8)
    return np.repeat(np.repeat(np.repeat(values, repeat, 0), repeat, 1)[..., None], 3, 2)


def draw_frame(task: AlignmentTask, slot: int) -> ByteArray:
    """Sensor image, reference, and one bar per axis for the true pose.

    A tick marks the nominal pose on each bar; a bar is red where its axis met a limit during the latest move.

    Returns:
        RGB image, shape (height, width, 3).
    """
    image, reference = _grey(on_host(task.frames[slot]), task.white), _grey(task.reference, task.white)
    height, width = image.shape[:2]
    total = 2 * width + 3 * _GAP
    rows = task.axes * (_BAR + _GAP) + _GAP
    picture = np.full((height + 2 * _GAP + rows, total, 3), 32, np.uint8)
    picture[_GAP:_GAP + height, _GAP:_GAP + width] = image
    picture[_GAP:_GAP + height, 2 * _GAP + width:2 * _GAP + 2 * width] = reference
    stopped = task.batch.limits([slot])[0]
    length = total - 2 * _GAP
    for axis, (pose, nominal) in enumerate(zip(task.batch.true_poses([slot])[0], task.nominal_pose)):
        top = height + 2 * _GAP + axis * (_BAR + _GAP)
        bar = picture[top:top + _BAR, _GAP:_GAP + length]
        bar[:] = 64
        bar[:, :max(1, round(pose * length))] = (200, 60, 40) if stopped[axis] else (80, 140, 210)
        tick = min(length - 2, round(nominal * length))
        bar[:, tick:tick + 2] = 255
    return picture


class Window:
    """A window that shows frames, by pygame.

    Raises:
        gymnasium.error.DependencyNotInstalled: pygame is not installed.
    """

    def __init__(self, title: str, frames_per_second: int) -> None:
        try:
            import pygame
        except ImportError as problem:
            raise gymnasium.error.DependencyNotInstalled(
                'render_mode="human" needs pygame: pip install pygame') from problem
        self._pygame = pygame
        self._screen: Any = None
        self._title, self._frames_per_second = title, frames_per_second
        self._clock = pygame.time.Clock()

    def show(self, picture: ByteArray) -> None:
        """Shows an RGB image, shape (height, width, 3); the first one opens the window."""
        pygame = self._pygame
        if self._screen is None:
            pygame.display.init()
            pygame.display.set_caption(self._title)
            self._screen = pygame.display.set_mode((picture.shape[1], picture.shape[0]))
        pygame.surfarray.blit_array(self._screen, picture.swapaxes(0, 1))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._frames_per_second)

    def close(self) -> None:
        """Closes the window; a second call has no effect."""
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None
