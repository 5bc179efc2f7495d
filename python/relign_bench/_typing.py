"""Type aliases of the package. Import them under TYPE_CHECKING: nothing here is needed at run time."""

import os
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

Plugin = Union[str, "os.PathLike[str]", Mapping[str, Any]]
"""Id, preset or path of a scene, noise level or algorithm, or an object as in a suite: {"use": ..., "parameters": ...}."""

Slots = Sequence[int]
"""Indices of slots of a batch, each at most once."""
