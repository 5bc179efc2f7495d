"""PPO on a GPU: Stable-Baselines3's, with the policy and the gradients recorded as CUDA graphs.

A policy and its gradients have some two hundred small kernels, and starting them one by one takes longer than they do. The
algorithm is that of stable_baselines3.PPO for actions that are vectors: the same draws, batches and losses, up to the
order of sums.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.utils import explained_variance
from torch.nn import functional

from .frames import images_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.type_aliases import RolloutBufferSamples
    from stable_baselines3.common.vec_env import VecEnv

    from .frames import FrameRolloutBuffer

STATISTICS = ("policy_gradient_loss", "value_loss", "entropy_loss", "approx_kl", "clip_fraction", "loss")
"""What the gradients' graph returns, by the names of Stable-Baselines3's log, which has means over all updates of a rollout."""


class Recorded:
    """A function of tensors as a CUDA graph; on a CPU the function itself.

    Args:
        function: The function. It waits for nothing, and may draw from torch's generator.
        values: Tensors of the shapes for which it is recorded.
        shared: Number of the first values that are used where they are; of the others there are copies.
    """

    def __init__(self, function: Callable[..., Any], *values: torch.Tensor, shared: int = 0) -> None:
        self._values = tuple(value if k < shared else value.clone() for k, value in enumerate(values))
        self._function, device = function, values[0].device
        self._graph: torch.cuda.CUDAGraph | None = None
        if device.type != "cuda":
            return
        drawn = torch.cuda.get_rng_state(device)
        stream = torch.cuda.Stream(device)  # of all calls, since nodes of gradients keep theirs
        stream.wait_stream(torch.cuda.current_stream(device))
        with _without_checks():
            with torch.cuda.stream(stream):  # loads the libraries, and Triton compiles
                for _ in range(3):
                    function(*self._values)
            torch.cuda.current_stream(device).wait_stream(stream)
            torch.cuda.set_rng_state(drawn, device)
            self._graph = torch.cuda.CUDAGraph()
            with torch.cuda.graph(self._graph, stream=stream):
                self._results = function(*self._values)

    def suits(self, *values: torch.Tensor) -> bool:
        """Whether it was recorded for tensors of these shapes."""
        return all(mine.shape == value.shape for mine, value in zip(self._values, values))

    def __call__(self, *values: torch.Tensor) -> Any:
        """The results, on a GPU in memory that the next call writes to."""
        if self._graph is None:
            return self._function(*values)
        for mine, value in zip(self._values, values):
            if mine is not value:
                mine.copy_(value)
        self._graph.replay()
        return self._results


@contextlib.contextmanager
def _without_checks() -> Iterator[None]:
    """Distributions do not check their arguments, for which they would wait for the GPU."""
    kept = torch.distributions.Distribution._validate_args
    torch.distributions.Distribution.set_default_validate_args(False)
    try:
        yield
    finally:
        torch.distributions.Distribution.set_default_validate_args(kept)


class GraphPPO(PPO):
    """stable_baselines3.PPO on a GPU, with a FrameRolloutBuffer.

    The clip range and the weights of the loss are constants, since the graph keeps them; values are not clipped.
    """

    rollout_buffer: FrameRolloutBuffer
    _last_obs: Any
    _last_episode_starts: Any
    _policy_graph: Recorded | None = None
    _gradient_graph: Recorded | None = None
    _graph_gradients: Sequence[torch.Tensor | None] = ()

    def _images(self) -> torch.Tensor:
        return torch.as_tensor(images_of(self._last_obs), device=self.device)

    def _draw(self, images: torch.Tensor) -> torch.Tensor:
        """Actions, value and log-probability of each image, one row each."""
        actions, values, log_probs = self.policy(images)
        return torch.cat((actions, values, log_probs[:, None]), 1)

    def collect_rollouts(self, env: VecEnv, callback: BaseCallback, rollout_buffer: Any, n_rollout_steps: int) -> bool:
        """As of PPO; what the policy returns comes to the host in one copy."""
        self.policy.set_training_mode(False)
        rollout_buffer.reset()
        callback.on_rollout_start()
        for _ in range(n_rollout_steps):
            images = self._images()
            with torch.no_grad():
                if self._policy_graph is None or not self._policy_graph.suits(images):
                    self._policy_graph = Recorded(self._draw, images)
                drawn = self._policy_graph(images).cpu()
            actions = drawn[:, :-2].numpy()
            new_obs, rewards, dones, infos = env.step(np.clip(actions, self.action_space.low, self.action_space.high))
            self.num_timesteps += env.num_envs
            callback.update_locals(locals())
            if not callback.on_step():
                return False
            self._update_info_buffer(infos, dones)
            for k in np.flatnonzero(dones):
                if infos[k]["TimeLimit.truncated"]:
                    last = torch.as_tensor(infos[k]["terminal_observation"], device=self.device)
                    with torch.no_grad():
                        rewards[k] += self.gamma * float(self.policy.predict_values(last[None]))
            rollout_buffer.add(self._last_obs, actions, rewards, self._last_episode_starts, drawn[:, -2], drawn[:, -1])
            self._last_obs, self._last_episode_starts = new_obs, dones
        with torch.no_grad():
            values = self.policy.predict_values(self._images())
        rollout_buffer.compute_returns_and_advantage(last_values=values, dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    def _gradients(self, images: torch.Tensor, actions: torch.Tensor, old_log_prob: torch.Tensor, advantages: torch.Tensor,
                   returns: torch.Tensor) -> torch.Tensor:
        """Leaves the gradients of a batch's loss in the parameters, and returns STATISTICS."""
        clip = self.clip_range(1.0)  # type: ignore[operator]
        values, log_prob, entropy = self.policy.evaluate_actions(images, actions)
        if self.normalize_advantage and len(advantages) > 1:
            advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        log_ratio = log_prob - old_log_prob
        ratio = log_ratio.exp()
        policy_loss = -torch.min(advantages * ratio, advantages * ratio.clamp(1 - clip, 1 + clip)).mean()
        value_loss = functional.mse_loss(returns, values.flatten())
        entropy_loss = -entropy.mean()
        loss = policy_loss + self.ent_coef * entropy_loss + self.vf_coef * value_loss
        self.policy.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
        with torch.no_grad():
            kl = (ratio - 1 - log_ratio).mean()
            clipped = ((ratio - 1).abs() > clip).float().mean()
            return torch.stack((policy_loss, value_loss, entropy_loss, kl, clipped, loss))

    def _found(self, batch: RolloutBufferSamples) -> torch.Tensor:
        """`_gradients` of a batch, recorded for batches of batch_size."""
        values = (batch.observations, batch.actions, batch.old_log_prob, batch.advantages, batch.returns)
        parameters = list(self.policy.parameters())
        if len(batch.actions) != self.batch_size:
            return self._gradients(*values)
        if self._gradient_graph is None or not self._gradient_graph.suits(*values):
            self._gradient_graph = Recorded(self._gradients, *values, shared=1)
            self._graph_gradients = [parameter.grad for parameter in parameters]
        found = self._gradient_graph(*values).clone()
        if self.device.type == "cuda":  # where batches of other sizes put theirs elsewhere
            for parameter, gradient in zip(parameters, self._graph_gradients):
                parameter.grad = gradient
        return found

    def _epoch(self, statistics: list[torch.Tensor]) -> bool:
        """Updates by every batch and appends its STATISTICS. Returns whether target_kl has stopped it."""
        for batch in self.rollout_buffer.get(self.batch_size):
            statistics.append(self._found(batch))
            if self.target_kl is not None and float(statistics[-1][STATISTICS.index("approx_kl")]) > 1.5 * self.target_kl:
                return True
            self.policy.optimizer.step()
        return False

    def train(self) -> None:
        """As of PPO.

        Raises:
            ValueError: The loss is not finite: the training has diverged.
        """
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        statistics: list[torch.Tensor] = []
        for _ in range(self.n_epochs):
            stopped = self._epoch(statistics)
            self._n_updates += 1
            if stopped:
                break
        means = dict(zip(STATISTICS, torch.stack(statistics).double().mean(0).tolist()))
        if not np.isfinite(means["loss"]):
            raise ValueError(f"the training has diverged: the loss is {means['loss']} after {self.num_timesteps} steps; its "
                             "checkpoint has the last segment before; try a smaller rate")
        for name, value in means.items():
            self.logger.record(f"train/{name}", value)
        buffer = self.rollout_buffer
        self.logger.record("train/explained_variance", explained_variance(buffer.values.flatten(), buffer.returns.flatten()))
        self.logger.record("train/std", float(self.policy.log_std.detach().exp().mean()))
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
