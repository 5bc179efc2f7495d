"""What authors of noise levels derive from."""

from .base import Plugin


class NoiseLevel(Plugin):
    """A distribution of the variances: start, movement distortion, element offsets."""

    kind = "noise-level"

    def draw(self, seed, scene):
        """One draw, a function of its arguments alone; `scene` is the scene's description. Gives {"start": [n values
        in 0..1], "distortion": [[n x n]], "elements": {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}}, and
        where the glue matters "cure_shift": [n shares of the travel]."""
        raise self._lacks("draw(self, seed, scene)")
