"""Evaluation of policies on tuning instances, which training never uses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .doubt import Belief, Doubt
from .instances import InstanceSet, stacked

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from .._typing import Float64Array

    PolicyFunction = Callable[[Any, int, Any], tuple[Float64Array, Any]]
    """(frames, step, memory) to (moves, memory): frames are those of the instances, an array or a tensor of shape (n, frames,
    size, size), the newest last; the first step is 1 and its memory None; moves have shape (n, axes), in shares of the
    travel."""

EVALUATED_STEPS = (6, 12)
TUNING_INSTANCES = 100  # over all levels


def rmse_after_steps(policy: PolicyFunction, instances: InstanceSet, frames: int, steps: Collection[int],
                     ) -> dict[int, Float64Array]:
    """Noise-free RMSE of the first instances of a family, after some steps of a policy.

    Args:
        policy: The policy.
        instances: The instances; they are reset.
        frames: How many of the latest captures the policy observes, zeros before the start.
        steps: The steps after which the ground truth is evaluated; 0 is the start.

    Returns:
        RMSE by step, each of shape (n,).
    """
    instances.reset(0)
    latest = [instances.frames() * 0] * frames
    memory, found = None, {}
    for step in range(max(steps) + 1):
        if step > 0:
            latest = [*latest[1:], instances.frames()]
            move, memory = policy(stacked(latest), step, memory)
            instances.move_by(move)
        if step in steps:
            found[step] = np.sqrt(np.maximum(0, instances.noise_free_mse()))
    return found


def belief_policy(answers: Callable[[Any], tuple[Float64Array, Float64Array]], doubt: Doubt, instances: InstanceSet,
                  ) -> PolicyFunction:
    """The policy that moves to the optimum it expects from all answers so far (doubt.py).

    Args:
        answers: From frames to residuals and standard deviations, see `imitate.predictions`.
        doubt: How answers are combined.
        instances: The instances that are aligned; their commanded poses are read.
    """

    def moves(frames: Any, step: int, memory: Any) -> tuple[Float64Array, Any]:
        belief: Belief = memory or Belief(doubt)
        poses = instances.commanded_poses()
        belief.add(poses, *answers(frames[:, -1]))
        return belief.moves(poses), belief

    return moves


def tuning_instances(scene: str, levels: Sequence[float], size: int, threads: int | None = None, noise_level: str = "rho",
                     observation: str = "uint8", device: str = "cpu") -> InstanceSet:
    """The tuning instances that policies are evaluated on.

    Args:
        scene: Id, preset or path of a scene.
        levels: Noise levels N, in equal parts.
        size: Columns of the images.
        threads: Threads that render; None uses all cores.
        noise_level: Id or preset of the noise level.
        observation: What the policy observes, "uint8" or "float32".
        device: Where images are rendered, as for InstanceSet.
    """
    return InstanceSet(scene, levels, TUNING_INSTANCES // len(levels), size, family="tuning", threads=threads,
                       noise_level=noise_level, observation=observation, device=device)


def evaluate(policy: PolicyFunction, instances: InstanceSet, frames: int) -> dict[str, Any]:
    """Evaluates a policy.

    Args:
        policy: As for `rmse_after_steps`.
        instances: The instances; they are reset.
        frames: As for `rmse_after_steps`.

    Returns:
        rmse_6 and rmse_12 (medians after 6 and 12 steps), under_0.01 (share below 0.01 after 12 steps), score (mean over the
        instances after 6 and 12 steps, which a few failures raise; smaller is better) and errors (noise-free RMSE of every
        instance, by the number of steps).
    """
    found = rmse_after_steps(policy, instances, frames, EVALUATED_STEPS)
    result: dict[str, Any] = {f"rmse_{step}": float(np.median(rmse)) for step, rmse in found.items()}
    result["under_0.01"] = float((found[EVALUATED_STEPS[-1]] < 0.01).mean())
    result["score"] = float(np.mean([rmse.mean() for rmse in found.values()]))
    result["errors"] = {str(step): rmse.tolist() for step, rmse in found.items()}
    return result
