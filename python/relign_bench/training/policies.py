"""Actors and critics for Stable-Baselines3."""

from __future__ import annotations

import functools
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from stable_baselines3.common.policies import ActorCriticCnnPolicy, ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn
from torch.autograd.function import once_differentiable

from .. import _core
from .._native import chosen_threads
from .frames import images_of
from .nets import StridedNet

if TYPE_CHECKING:
    from collections.abc import Callable

    from gymnasium import spaces

    from .._typing import Float64Array


@functools.cache
def _compiled_layer(threads: int) -> _core.PooledConvolution:
    return _core.PooledConvolution(threads)


class _PooledConvolution(torch.autograd.Function):
    """A convolution of PackageFeatures with its ReLU and pooling by the compiled module, in half the time of torch's layers."""

    @staticmethod
    def forward(ctx: Any, images: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor, threads: int) -> torch.Tensor:
        """Outputs are stored with the channels last, as the compiled module has them; images may be stored in any way."""
        images, weight, bias = images.detach().permute(0, 2, 3, 1), weight.detach().contiguous(), bias.detach().contiguous()
        shape = (len(images), (images.shape[1] + 1) // 4, (images.shape[2] + 1) // 4, len(weight))
        out, places = torch.empty(shape), torch.empty(shape, dtype=torch.uint8)
        _compiled_layer(threads).forward(images.numpy(), weight.numpy(), bias.numpy(), out.numpy(), places.numpy())
        ctx.save_for_backward(images, weight, places)
        ctx.threads = threads
        return out.permute(0, 3, 1, 2)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor | None, torch.Tensor, torch.Tensor, None]:
        images, weight, places = ctx.saved_tensors
        gradient = gradient.permute(0, 2, 3, 1).contiguous()
        of_images = torch.empty(images.shape) if ctx.needs_input_grad[0] else None
        of_weight, of_bias = torch.empty_like(weight), torch.empty(len(weight))
        _compiled_layer(ctx.threads).backward(
            images.numpy(), weight.numpy(), gradient.numpy(), places.numpy(),
            None if of_images is None else of_images.numpy(), of_weight.numpy(), of_bias.numpy())
        return None if of_images is None else of_images.permute(0, 3, 1, 2), of_weight, of_bias, None


@functools.cache
def _layer_on_gpu() -> Any:
    """The same for a GPU, in a third of the time of torch's layers.

    None where torch's convolutions shall not round to TF32, which these kernels do, and, with a warning, where Triton fails.
    """
    if not torch.backends.cudnn.allow_tf32:
        return None
    try:
        from .pooled import PooledConvolution

        PooledConvolution.apply(torch.zeros(1, 1, 8, 8, device="cuda"), torch.zeros(16, 1, 3, 3, device="cuda"),
                                torch.zeros(16, device="cuda"))
    except Exception as problem:  # noqa: BLE001 (of Triton, the C compiler that it calls, and the driver)
        warnings.warn(f"torch's layers compute the network, which takes longer, since Triton failed: {problem}", stacklevel=2)
        return None
    return PooledConvolution


class PackageFeatures(BaseFeaturesExtractor):
    """The network of the paper's package: three convolutions of stride 2, each with ReLU and 2 x 2 pooling, and one layer.

    Modules and parameters have the package's names. Input: shape (batch, frames, height, width). Output: shape (batch,
    features_dim).

    Args:
        observation_space: Images.
        features_dim: Number of features.
        compiled: Whether the compiled module computes the convolutions on a CPU, and kernels of Triton those on a GPU
            (pooled.py). They have first derivatives only; TRPO needs second ones.
        threads: Threads of the compiled module; None: one for each core. The values do not depend on it.
    """

    def __init__(self, observation_space: spaces.Box, features_dim: int = 256, compiled: bool = True,
                 threads: int | None = None) -> None:
        super().__init__(observation_space, features_dim)
        self.compiled, self.threads = compiled, chosen_threads(threads)
        layers: list[nn.Module] = []
        channels = observation_space.shape[0]
        for width in (32, 64, 128):
            layers += [nn.Conv2d(channels, width, 3, 2, 1), nn.ReLU(), nn.MaxPool2d(2, 2)]
            channels = width
        self.cnn = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            inputs = self.cnn(torch.zeros(1, *observation_space.shape)).shape[1]
        self.linear = nn.Sequential(nn.Linear(inputs, features_dim), nn.ReLU())

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Features of a batch."""
        layer_of: Any = None
        on_cpu = observations.device.type == "cpu"
        if self.compiled and observations.dtype == torch.float32 and not torch.jit.is_tracing():
            layer_of = _PooledConvolution if on_cpu else _layer_on_gpu()
        if layer_of is None:
            return self.linear(self.cnn(observations))
        values, threads = observations, (self.threads,) if on_cpu else ()
        for layer in self.cnn:
            if isinstance(layer, nn.Conv2d):
                values = layer_of.apply(values, layer.weight, layer.bias, *threads)
        return self.linear(values.flatten(1))


class PackagePolicy(ActorCriticCnnPolicy):
    """The package's actor and critic, which also take tensors of an environment on the GPU (frames.tensors)."""

    def forward(self, obs: Any, deterministic: bool = False) -> Any:
        """As of ActorCriticPolicy."""
        return super().forward(images_of(obs), deterministic)

    def predict_values(self, obs: Any) -> torch.Tensor:
        """As of ActorCriticPolicy."""
        return super().predict_values(images_of(obs))


class ActorFeatures(BaseFeaturesExtractor):
    """Features of the actor: the body of the network that imitation learning trains."""

    def __init__(self, observation_space: spaces.Dict, net: StridedNet) -> None:
        super().__init__(observation_space, net.head.in_features)
        self.net = net

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features of a batch."""
        return self.net.features(observations["image"])


class CriticFeatures(BaseFeaturesExtractor):
    """Features of the critic, from the privileged observation."""

    def __init__(self, observation_space: spaces.Dict, features_dim: int) -> None:
        super().__init__(observation_space, features_dim)
        inputs = int(np.prod(observation_space["privileged"].shape or ()))
        self.layers = nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, features_dim), nn.Tanh())

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features of a batch."""
        return self.layers(observations["privileged"])


class PrivilegedCriticPolicy(ActorCriticPolicy):
    """A StridedNet as actor and a critic with privileged observations (asymmetric actor-critic: Pinto et al. 2017).

    Args:
        observation_space: Of PrivilegedEnv.
        action_space: Of PrivilegedEnv.
        schedule: Learning rate by remaining progress.
        size: Rows and columns of the images.
        directions: Directions as columns, shape (axes, axes).
        spread: Unit of the actions along each direction, shape (axes,).
        **arguments: Further arguments of ActorCriticPolicy.
    """

    def __init__(self, observation_space: spaces.Dict, action_space: spaces.Box, schedule: Callable[[float], float],
                 size: int, directions: Float64Array, spread: Float64Array, **arguments: Any) -> None:
        # Set before nn.Module.__init__; the features extractors register the modules.
        self.__dict__["_make_net"] = lambda: StridedNet(size, action_space.shape[0], directions)
        super().__init__(observation_space, action_space, schedule, net_arch=[], ortho_init=False,
                         share_features_extractor=False, normalize_images=False, **arguments)
        self.register_buffer("spread", torch.as_tensor(spread, dtype=torch.float32), persistent=False)  # moves to the GPU

    def make_features_extractor(self) -> BaseFeaturesExtractor:
        """Called by Stable-Baselines3 for the actor, then for the critic."""
        if self.features_extractor is None:
            return ActorFeatures(self.observation_space, self._make_net())
        return CriticFeatures(self.observation_space, self.features_extractor.features_dim)

    def _build(self, lr_schedule: Callable[[float], float]) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()  # the net has its own head
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)

    @property
    def net(self) -> StridedNet:
        """The actor's network."""
        return self.pi_features_extractor.net

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Any:
        return self.action_dist.proba_distribution(self.net.head(latent_pi) / self.spread, self.log_std)

    def actor_parameters(self) -> list[nn.Parameter]:
        """Parameters that the warm-up of the critic freezes."""
        return [*self.net.parameters(), self.log_std]
