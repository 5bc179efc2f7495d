"""What an environment shows to people."""

import gymnasium
import numpy as np

_SCALE_TO = 300  # pixels a side
_GAP, _BAR = 8, 14


def _grey(image, white):
    """Height x width x 3 bytes, whole pixels repeated until the picture is large enough to see."""
    repeat = max(1, round(_SCALE_TO / image.shape[0]))
    bytes_ = (np.clip(image / (1.5 * white), 0, 1) * 255).astype(np.uint8)
    return np.repeat(np.repeat(np.repeat(bytes_, repeat, 0), repeat, 1)[..., None], 3, 2)


def scene_picture(task, slot):
    """Sensor image, reference, and one bar an axis for the true pose: uint8, height x width x 3.

    The tick in each bar is the nominal pose; a bar is red where its axis met a limit on the last move.
    """
    seen, wanted = _grey(task.frames[slot], task.white), _grey(task.reference, task.white)
    height, width = seen.shape[:2]
    total = 2 * width + 3 * _GAP
    rows = task.axes * (_BAR + _GAP) + _GAP
    picture = np.full((height + 2 * _GAP + rows, total, 3), 32, np.uint8)
    picture[_GAP:_GAP + height, _GAP:_GAP + width] = seen
    picture[_GAP:_GAP + height, 2 * _GAP + width:2 * _GAP + 2 * width] = wanted
    stopped = task.batch.limits(slot)
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
    """A window of its own, by pygame."""

    def __init__(self, title, frames_a_second):
        try:
            import pygame
        except ImportError as problem:
            raise gymnasium.error.DependencyNotInstalled(
                'render_mode="human" needs pygame: pip install pygame') from problem
        self._pygame, self._screen = pygame, None
        self._title, self._fps = title, frames_a_second
        self._clock = pygame.time.Clock()

    def show(self, picture):
        pygame = self._pygame
        if self._screen is None:
            pygame.display.init()
            pygame.display.set_caption(self._title)
            self._screen = pygame.display.set_mode((picture.shape[1], picture.shape[0]))
        pygame.surfarray.blit_array(self._screen, picture.swapaxes(0, 1))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self):
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None
