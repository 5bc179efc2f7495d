"""Type aliases of the package. Import them under TYPE_CHECKING: nothing here is needed at run time."""

from collections.abc import Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

AnyArray = npt.NDArray[Any]
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]
Float32Array = npt.NDArray[np.float32]
Float64Array = npt.NDArray[np.float64]

Observation = Union[AnyArray, dict[str, AnyArray]]
"""Of an environment: an image stack, or {"image": ..., "actions": ...}."""

Parameters = Mapping[str, Any]
"""Parameters of a scene, noise level or algorithm, as in a suite."""

Slots = Sequence[int]
"""Indices of slots of a batch, each at most once."""
