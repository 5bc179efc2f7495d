"""The networks and settings of `relign-train ppo` against those that the package builds from its own configuration."""

import dataclasses
import importlib.util

import conftest
import numpy as np
import program
import pytest

conftest.need("torch", "stable_baselines3", "sb3_contrib", "gymnasium", "relign", "mitsuba")

import torch  # noqa: E402

import relign_bench  # noqa: E402

if importlib.util.find_spec("relign_bench._core") is None and program.path() is not None:
    # The compiled module is beside the program, in its build folder.
    relign_bench.__path__.append(str(program.path().resolve().parents[1] / "python" / "relign_bench"))

BENCHMARKS = {0.0: "b_OD_N000_64", 0.25: "b_OD_N025_64", 0.5: "b_OD_N050_64"}
MODELS = {"ppo": "PPO", "a2c": "A2C", "trpo": "TRPO", "recurrent-ppo": "RPPO"}
# Compared on the learners, so that defaults count too.
SETTINGS = (
    "n_steps", "gamma", "gae_lambda", "batch_size", "n_epochs", "ent_coef", "vf_coef", "max_grad_norm", "normalize_advantage",
    "use_sde", "target_kl", "n_critic_updates", "cg_max_steps",
)
DIFFERENT = {"preset", "noise_level", "reward", "rate", "last_rate", "entropy", "total"}  # text and code of the paper


def package_parts(algorithm, level=0.25):
    """The package's learner, environment arguments and training arguments; nothing is rendered."""
    from relign.config import Config
    from relign.generator import make_stacked_vec_env

    params = Config.set_benchmark_params({"env": "la", "model": MODELS[algorithm], "device": "cpu", "seed": 0},
                                         BENCHMARKS[level])
    env_args, model_args, training_args = Config.setup_params(dict(params))
    env = make_stacked_vec_env("la", score_threshold=params["sgt"], n_envs=training_args["n_envs"],
                               n_stack=training_args["n_stack"], reward=env_args["reward"],
                               env_args={name: value for name, value in env_args.items() if name != "reward"})
    # A2C adds its optimiser to the policy's arguments, which all algorithms of the configuration share.
    model_args["policy_kwargs"] = dict(model_args["policy_kwargs"])
    model = Config.algorithms[MODELS[algorithm]]["cls"](env=env, **{**model_args, "device": "cpu"})
    return model, env, training_args


@pytest.fixture(params=list(MODELS))
def pair(request, tmp_path):
    pytest.importorskip("relign_bench._core")
    from relign_bench.training.recipe import preset_recipe
    from relign_bench.training.reinforce import Reinforcement

    recipe = preset_recipe("package", request.param)
    return request.param, Reinforcement(recipe, tmp_path, threads=1, log=lambda _: None), *package_parts(request.param)


def test_networks_agree(pair, figures):
    algorithm, ours, theirs, _, _ = pair
    own, given = ours.model.policy.state_dict(), theirs.policy.state_dict()
    assert {name: value.shape for name, value in own.items()} == {name: value.shape for name, value in given.items()}
    torch.testing.assert_close(own["log_std"], given["log_std"], rtol=0, atol=0)
    ours.model.policy.load_state_dict(given)
    # Irradiances up to twice that of a lit pixel; the oldest frames of one episode are still empty.
    observations = np.random.default_rng(1).uniform(0, 0.2, (30, *theirs.observation_space.shape)).astype(np.float32)
    observations[0, :3] = 0
    seen = torch.from_numpy(observations)
    recurrent = algorithm == "recurrent-ppo"
    deviation = compare(ours.model, theirs, seen, recurrent)
    ours.model.policy.features_extractor.compiled = False
    same = compare(ours.model, theirs, seen, recurrent)
    count = sum(value.numel() for value in ours.model.policy.parameters())
    figures.append(f"{algorithm}: {count} parameters, largest deviation {deviation:.1e}, with the layers of torch {same:.1e}")
    assert deviation <= 1e-6
    assert same == 0


def compare(ours, theirs, observations, recurrent):
    """Largest deviation of mean actions and values."""
    results = []
    for model in (ours, theirs):
        policy = model.policy
        with torch.no_grad():
            if recurrent:
                zeros = torch.zeros(policy.lstm_actor.num_layers, len(observations), policy.lstm_actor.hidden_size)
                memory = (zeros, zeros), torch.ones(len(observations))
                mean = policy.get_distribution(observations, *memory)[0].distribution.mean
                value = policy.predict_values(observations, *memory)
            else:
                mean, value = policy.get_distribution(observations).distribution.mean, policy.predict_values(observations)
        results.append(torch.cat([mean, value], dim=1))
    return float((results[0] - results[1]).abs().max())


def test_settings_agree(pair):
    _, ours, theirs, _, training_args = pair
    assert type(ours.model) is type(theirs)
    for name in SETTINGS:
        if hasattr(theirs, name):
            assert getattr(ours.model, name) == getattr(theirs, name), name
    if hasattr(theirs, "clip_range"):
        assert ours.model.clip_range(1) == theirs.clip_range(1)
    assert ours.model.lr_schedule(1) == ours.model.lr_schedule(0) == theirs.lr_schedule(1)
    optimizers = [model.policy.optimizer for model in (ours.model, theirs)]
    assert type(optimizers[0]) is type(optimizers[1])
    assert optimizers[0].defaults == optimizers[1].defaults
    assert ours.recipe.environments == training_args["n_envs"]
    assert ours.recipe.frames == training_args["n_stack"]
    assert ours.recipe.total == training_args["total_steps"]


def test_actions_observations_and_episodes_agree(pair):
    _, ours, theirs, env, _ = pair
    assert ours.env.observation_space.shape == theirs.observation_space.shape
    assert ours.env.observation_space.dtype == theirs.observation_space.dtype
    np.testing.assert_array_equal(ours.env.action_space.low, theirs.action_space.low)
    np.testing.assert_array_equal(ours.env.action_space.high, theirs.action_space.high)
    lens = env.get_attr("env")[0]
    lens = getattr(lens, "env", lens)
    assert ours.recipe.episode == lens.max_episode_steps
    assert ours.recipe.goal == lens.score_goal_threshold
    assert ours.recipe.reward == "minus_one" and lens.reward_func == lens.compute_minus_one_reward


def test_goals_agree():
    from relign.config import Config

    from relign_bench.training.recipe import GOALS

    assert {level: Config.lens_benchmarks[name]["sgt"] for level, name in BENCHMARKS.items()} == GOALS


def test_presets_differ_where_text_and_code_do():
    from relign_bench.training.recipe import PRESETS

    paper, package = (dataclasses.asdict(PRESETS[name]) for name in ("paper", "package"))
    assert {name for name, value in paper.items() if package[name] != value} == DIFFERENT
