"""Makes "relign_bench/Alignment-v0" known to gymnasium. Imports nothing but gymnasium itself."""

ENVIRONMENT = "relign_bench/Alignment-v0"


def register():
    """Registers the environment; once is enough, twice does no harm."""
    import gymnasium

    if ENVIRONMENT in gymnasium.registry:
        return
    with gymnasium.envs.registration.namespace("relign_bench"):
        gymnasium.register(
            id="Alignment-v0",
            entry_point="relign_bench.environment:AlignmentEnv",
            vector_entry_point="relign_bench.vector_environment:AlignmentVectorEnv",
        )
