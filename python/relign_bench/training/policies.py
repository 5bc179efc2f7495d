"""Actors and critics that Stable-Baselines3 trains."""

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from .nets import StridedNet


class PackageFeatures(BaseFeaturesExtractor):
    """The paper's network: three convolutions of stride 2, each with a pooling that halves again, and one layer."""

    def __init__(self, observation_space, features_dim=256):
        super().__init__(observation_space, features_dim)
        layers, channels = [], observation_space.shape[0]
        for width in (32, 64, 128):
            # The package's ReLU stands before the pooling: the same numbers at four times the work.
            layers += [nn.Conv2d(channels, width, 3, 2, 1), nn.MaxPool2d(2, 2), nn.ReLU()]
            channels = width
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            inputs = self.convolutions(torch.zeros(1, *observation_space.shape)).shape[1]
        self.linear = nn.Sequential(nn.Linear(inputs, features_dim), nn.ReLU())

    def forward(self, observations):
        # Twice as fast on processors.
        return self.linear(self.convolutions(observations.contiguous(memory_format=torch.channels_last)))


class Seen(BaseFeaturesExtractor):
    """What the actor makes of the picture: the body of the network that imitation trains."""

    def __init__(self, observation_space, net):
        super().__init__(observation_space, net.head.in_features)
        self.net = net

    def forward(self, observations):
        return self.net.features(observations["image"])


class Told(BaseFeaturesExtractor):
    """What the critic makes of the truth."""

    def __init__(self, observation_space, features_dim):
        super().__init__(observation_space, features_dim)
        inputs = observation_space["told"].shape[0]
        self.layers = nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, features_dim), nn.Tanh())

    def forward(self, observations):
        return self.layers(observations["told"])


class GuidedPolicy(ActorCriticPolicy):
    """A StridedNet as actor, in units of `spread` along its directions, and a critic that is told the truth."""

    def __init__(self, observation_space, action_space, schedule, size, directions, spread, **arguments):
        # Not yet a module: what belongs to it is registered by the features extractors.
        self.__dict__["_parts"] = lambda: StridedNet(size, action_space.shape[0], directions)
        self.__dict__["_spread"] = torch.as_tensor(spread, dtype=torch.float32)
        super().__init__(observation_space, action_space, schedule, net_arch=[], ortho_init=False,
                         share_features_extractor=False, normalize_images=False, **arguments)

    def make_features_extractor(self):
        # Called for the actor, then for the critic.
        if self.features_extractor is None:
            return Seen(self.observation_space, self._parts())
        return Told(self.observation_space, self.features_extractor.features_dim)

    def _build(self, lr_schedule):
        super()._build(lr_schedule)
        self.action_net = nn.Identity()  # the head is the net's own
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)

    @property
    def net(self):
        return self.pi_features_extractor.net

    def _get_action_dist_from_latent(self, latent_pi):
        return self.action_dist.proba_distribution(self.net.head(latent_pi) / self._spread, self.log_std)

    def actor_parameters(self):
        return [*self.net.parameters(), self.log_std]
