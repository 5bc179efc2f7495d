"""The reward of the preset "tuned" for policies that are trained from scratch, and others that lead along weak directions, too.

Along some directions of pose space the image hardly changes: in `relign_od` a shift together with the tilt that undoes it.
Policies that started from scratch moved along them to the end of the travel (docs/appendix_training.md). "shaped_even" counts
these directions more; "shaped_near" subtracts the distance to the nominal pose, as the reward "paper" does. In a logarithm
exploration changes the reward by about 0.25 from step to step, however small the error is, which hides the distance. So
"shaped_paper" adds a tenth of it to the reward "paper", and "shaped_linear" is "paper" with the excess RMSE in place of the
measured one.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from ..rewards import scores
from .instances import OptimumModel, offsets_of
from .privileged import excess, reward
from .recipe import SHAPED_EVEN, SHAPED_LINEAR, SHAPED_NEAR, SHAPED_PAPER
from .stable_baselines import StableBaselinesEnv

if TYPE_CHECKING:
    from .._typing import BoolArray, Float64Array, Observation
    from .directions import Directions


LEAST_EFFECT = 0.1
"""Of a direction in the reward "shaped_even", as a share of the strongest one's RMSE per unit of travel."""
TENTH = 0.1
"""Weight of the reward of "tuned" in "shaped_paper"."""


class ShapedEnv(StableBaselinesEnv):
    """A StableBaselinesEnv with a reward from the excess RMSE to first order, e: -log10(1 + e / FLOOR) or another.

    Args:
        count: Number of environments.
        named: The reward's name, one of SHAPED_REWARDS.
        directions: The image's directions.
        optimum: Model of the instances' optima.
        **arguments: Of AlignmentVectorEnv.
    """

    def __init__(self, count: int, named: str, directions: Directions, optimum: OptimumModel, **arguments: Any) -> None:
        super().__init__(count, reward="paper", **arguments)
        self._directions, self._optimum, self.named = directions, optimum, named
        if named == SHAPED_EVEN:
            self._directions = copy.copy(directions)
            self._directions.values = np.maximum(directions.values, LEAST_EFFECT**2 * directions.values.max())
        self._optima: Float64Array = np.zeros((count, len(directions.values)))

    def _draw(self, slots: list[int]) -> None:
        batch = self.environments.task.batch
        if slots:
            self._optima[slots] = self._optimum.optima(offsets_of([batch.instance(slot)["elements"] for slot in slots]))

    def reset(self) -> Observation:
        """As of StableBaselinesEnv."""
        observations = super().reset()
        self._draw(list(range(self.num_envs)))
        return observations

    def rewards(self, rewards: Float64Array, infos: dict[str, Any], over: BoolArray) -> Float64Array:
        """The rewards; instances that follow ended episodes are known from then on."""
        poses = np.array(infos["true_pose"])
        ended = [int(slot) for slot in np.flatnonzero(over)]
        if ended:
            poses[ended] = infos["final_info"]["true_pose"][ended]
        residuals = (self._optima - poses) @ self._directions.vectors
        self._draw(ended)
        cost = excess(residuals, self._directions) if self.named == SHAPED_LINEAR else -reward(residuals, self._directions)
        if self.named == SHAPED_PAPER:
            return rewards - TENTH * cost
        if self.named in (SHAPED_NEAR, SHAPED_LINEAR):  # with the distance, as the reward "paper"
            cost = scores("combined", cost, poses, self.environments.task.nominal_pose, None, None)
        return -cost
