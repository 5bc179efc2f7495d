"""Makes "relign_bench/Alignment-v0" known to gymnasium. Imports nothing but gymnasium itself."""

ENVIRONMENT = "relign_bench/Alignment-v0"


def register():
    """Registers the environment; once is enough, twice does no harm."""
    from gymnasium.envs import registration

    if ENVIRONMENT in registration.registry:
        return
    with registration.namespace("relign_bench"):
        registration.register(
            id="Alignment-v0",
            entry_point="relign_bench.environment:made_by_gymnasium",
            max_episode_steps=200,
            vector_entry_point="relign_bench.vector_environment:AlignmentVectorEnv",
        )
