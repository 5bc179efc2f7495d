"""Registers "relign_bench/Alignment-v0" with Gymnasium. Imports gymnasium only."""

from __future__ import annotations

ENVIRONMENT = "relign_bench/Alignment-v0"


def register() -> None:
    """Registers the environment; a second call has no effect.

    Raises:
        ImportError: gymnasium is not installed.
    """
    from gymnasium.envs import registration

    if ENVIRONMENT in registration.registry:
        return
    with registration.namespace("relign_bench"):
        registration.register(
            id="Alignment-v0",
            entry_point="relign_bench.environment:make_single",
            max_episode_steps=200,
            vector_entry_point="relign_bench.vector_environment:AlignmentVectorEnv",
        )
