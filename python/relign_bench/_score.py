"""What a scene judges a pose by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._typing import Float32Array, Float64Array


@dataclass(frozen=True)
class Score:
    """The score of a scene, the better the lower it is.

    Attributes:
        name: "RMSE" for a scene that compares images, which needs no declaration.
        unit: "" without one.
        squared: Whether records keep its square, as the RMSE is kept as an MSE.
        measure: Place of the reading that measures it among the values of a capture, row by row; None: the RMSE of the
            image does.
        further: Name and unit of each further score; they rank nothing.
    """

    name: str = "RMSE"
    unit: str = ""
    squared: bool = True
    measure: int | None = None
    further: tuple[tuple[str, str], ...] = ()

    @property
    def label(self) -> str:
        """Name and unit: "insertion loss in dB"."""
        return f"{self.name} in {self.unit}" if self.unit else self.name

    def shown(self, recorded: Any) -> Float64Array:
        """The scores of recorded values, 0 where an estimate is negative; NaN stays NaN."""
        values: Float64Array = np.maximum(0.0, recorded)
        return np.sqrt(values) if self.squared else values

    def measured(self, frame: Float32Array, reference: Float32Array) -> float:
        """What a capture measures, noise included; both shapes (height, width)."""
        if self.measure is not None:
            return float(frame.ravel()[self.measure])
        return float(np.sqrt(np.mean((frame.astype(np.float64) - reference) ** 2)))


RMSE = Score()


def score_of(scene: dict[str, Any]) -> Score:
    """The score of a scene's description, or of a scene in a manifest."""
    declared = scene.get("score")
    if declared is None:
        return RMSE
    names = [reading["name"] for reading in scene.get("readings", [])]
    image = scene.get("image", {"width": 0, "height": 0})
    measure = None
    if declared.get("reading") in names:
        measure = image["width"] * image["height"] + names.index(declared["reading"])
    further = tuple((one["name"], one.get("unit", "")) for one in declared.get("further", []))
    return Score(declared["name"], declared.get("unit", ""), False, measure, further)
