"""Rollout buffers that keep images on the learner's device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from stable_baselines3.common.buffers import DictRolloutBuffer, RolloutBuffer
from stable_baselines3.common.type_aliases import DictRolloutBufferSamples, RolloutBufferSamples

if TYPE_CHECKING:
    from .._typing import AnyArray


def tensors(images: torch.Tensor) -> dict[str, torch.Tensor]:
    """Observations that are tensors, in the form in which Stable-Baselines3 hands them from environment to policy.

    It copies arrays to the device of the learner, and leaves the tensors of a dictionary that are there.
    """
    return {"image": images}


def images_of(observations: Any) -> Any:
    """The images of observations that are an array, a tensor, or of the form of `tensors`."""
    return observations["image"] if isinstance(observations, dict) else observations


class FrameRolloutBuffer(RolloutBuffer):
    """A RolloutBuffer for observations of shape (frames, height, width) that stack the latest frames.

    A stack shares all frames but one with the stack before it. This buffer keeps each frame once and stacks them in
    `_get_samples`: with five frames a fifth of the memory, and batches on a GPU are not copied from the host. The
    observations of a batch are valid until the next batch of the same size.
    """

    def reset(self) -> None:
        """Empties the buffer."""
        shape: tuple[int, ...] = self.observation_space.shape
        self.stacked, size = shape[0], shape[1:]
        self.obs_shape = (0,)  # no array for stacks
        super().reset()
        kind = torch.uint8 if self.observation_space.dtype == np.uint8 else torch.float32
        if not hasattr(self, "frames"):
            self.frames = torch.zeros((self.stacked - 1 + self.buffer_size, self.n_envs, *size), dtype=kind, device=self.device)
            self.stacks = self.frames[:0]
        self.ages = np.zeros((self.buffer_size, self.n_envs), np.int64)  # how many older frames a stack has

    def add(self, obs: Any, *arguments: Any, **named: Any) -> None:
        """As of RolloutBuffer, with an array or what `tensors` returns."""
        position = self.pos
        super().add(np.empty((self.n_envs, 0)), *arguments, **named)
        last, stacks = position + self.stacked, images_of(obs)
        if position == 0:  # with the frames of the rollout before, or zeros where the episode had not begun
            self.frames[:last] = torch.as_tensor(stacks).transpose(0, 1)
            self.ages[0] = self.stacked - 1
        else:
            self.frames[last - 1] = torch.as_tensor(stacks[:, -1])
            begins = self.episode_starts[position].astype(bool)
            self.ages[position] = np.where(begins, 0, np.minimum(self.ages[position - 1] + 1, self.stacked - 1))

    def _get_samples(self, batch_inds: AnyArray, env: Any = None) -> RolloutBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        environments, steps = np.divmod(batch_inds, self.buffer_size)  # the order of swap_and_flatten
        places = (steps[:, None] + np.arange(self.stacked)) * self.n_envs + environments[:, None]  # in self.frames
        # The batch before is used up; new memory for a batch of 100 MB would take as long as filling it.
        if len(self.stacks) != len(batch_inds):
            self.stacks = self.frames.new_empty((len(batch_inds), *self.observation_space.shape))
        stacks = self.stacks
        torch.index_select(self.frames.flatten(0, 1), 0, torch.from_numpy(places.ravel()).to(self.device),
                           out=stacks.view(-1, *stacks.shape[2:]))
        earlier = np.arange(self.stacked) < self.stacked - 1 - self.ages[steps, environments][:, None]  # of another episode
        stacks.flatten(0, 1).index_fill_(0, torch.from_numpy(np.flatnonzero(earlier)).to(self.device), 0)
        return samples._replace(observations=stacks)


class ImageRolloutBuffer(DictRolloutBuffer):
    """A DictRolloutBuffer whose observation "image", an array or a tensor, is kept on the learner's device."""

    def reset(self) -> None:
        """Empties the buffer."""
        super().reset()
        images = self.observations.pop("image")
        if not hasattr(self, "images"):
            self.images = torch.from_numpy(images).to(self.device)

    def add(self, obs: dict[str, Any], *arguments: Any, **named: Any) -> None:
        """As of DictRolloutBuffer."""
        self.images[self.pos] = torch.as_tensor(obs["image"])
        super().add(obs, *arguments, **named)

    def _get_samples(self, batch_inds: AnyArray, env: Any = None) -> DictRolloutBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        environments, steps = np.divmod(batch_inds, self.buffer_size)  # the order of swap_and_flatten
        places = torch.from_numpy(steps * self.n_envs + environments).to(self.device)
        images = self.images.flatten(0, 1).index_select(0, places)
        return samples._replace(observations={**samples.observations, "image": images})
