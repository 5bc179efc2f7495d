"""A training of the paper's recipe on a GPU: the layers against torch's, then times, as rows of docs/performance.md.

benchmarks/gpu_bundle.sh packs it; by hand: PYTHONPATH=BUILD/python python3 benchmarks/gpu_training.py. It needs torch with
CUDA and stable_baselines3. Exit status 1 if the layers differ from torch's by more than the rounding to TF32 explains.
"""

import dataclasses
import sys
import tempfile
import time

try:
    import numpy as np
    import torch
    from gymnasium import spaces

    from relign_bench.training.evaluation import evaluate, tuning_instances
    from relign_bench.training.policies import PackageFeatures, _layer_on_gpu
    from relign_bench.training.recipe import PRESETS
    from relign_bench.training.reinforce import Reinforcement
except ImportError as problem:
    sys.exit(f"training was not measured: {problem}")
if not torch.cuda.is_available():
    sys.exit("training was not measured: torch finds no GPU")

RECIPE = dataclasses.replace(PRESETS["paper"], total=20_000, stretch=5_000)
BATCH = RECIPE.batch


def milliseconds_of(body, rounds):
    """Mean of some calls, after three others. Waits for the GPU."""
    for _ in range(3):
        body()
    torch.cuda.synchronize()
    start = time.perf_counter()
    for _ in range(rounds):
        body()
    torch.cuda.synchronize()
    return 1e3 * (time.perf_counter() - start) / rounds


def row(what, value):
    print(f"| training: {what} | {value} |", flush=True)


def compare_layers():
    """The network's features and gradients by torch's layers and by ours. Returns whether they agree."""
    torch.manual_seed(0)
    features = PackageFeatures(spaces.Box(0, 1, (RECIPE.frames, RECIPE.size, RECIPE.size), np.float32)).cuda()
    images = torch.rand(BATCH, RECIPE.frames, RECIPE.size, RECIPE.size, device="cuda")
    found = []

    def once():
        features.zero_grad()
        values = features(images)
        (values * torch.sin(torch.arange(values.shape[1], device="cuda"))).sum().backward()
        return values.detach()

    for whose, compiled in (("torch's", False), ("our", True)):
        features.compiled = compiled
        found.append([once(), *(parameter.grad.clone() for parameter in features.parameters())])
        row(f"values and gradients of {BATCH} images, {whose} layers", f"{milliseconds_of(once, 20):.2f} ms")
    differences = [float((mine - others).norm() / others.norm()) for others, mine in zip(*found)]
    row("largest relative difference of both", f"{max(differences):.1e}")
    return _layer_on_gpu() is not None and all(difference < 0.02 for difference in differences)


def measure(folder):
    run = Reinforcement(RECIPE, folder, threads=1, log=lambda line: None, device="cuda", render="cuda")
    run.run(until=1)
    env, batch = run.env, run.env.environments.task.batch
    count, axes = env.num_envs, env.environments.task.axes
    env.seed(3)
    images = env.reset()["image"]
    seeds = iter(range(10**9))
    slots, moves = list(range(count)), np.zeros((count, axes))
    tuning = tuning_instances(RECIPE.scene, (RECIPE.level,), RECIPE.size, 1, RECIPE.noise_level, RECIPE.input, "cuda")
    for what, body, rounds in (
            (f"step of {count} environments", lambda: env.step(moves.astype(np.float32)), 300),
            (f"captures alone (Batch.move_by) of {count}", lambda: batch.move_by(slots, moves), 300),
            ("a new instance in one environment (Batch.reset)", lambda: batch.reset([0], [next(seeds)]), 100),
            (f"new instances in {count} environments (Batch.reset)",
             lambda: batch.reset(slots, [next(seeds) for _ in slots]), 50),
            (f"policy of {count} images, read", lambda: run.model._policy_graph(images).cpu(), 300),
            ("evaluation on tuning instances", lambda: evaluate(run.moves, tuning, RECIPE.frames), 5)):
        row(what, f"{milliseconds_of(body, rounds):.3f} ms")
    run.model.learn(RECIPE.stretch, reset_num_timesteps=False)
    row(f"{RECIPE.epochs} updates of {BATCH}", f"{milliseconds_of(run.model.train, 10):.1f} ms")
    start = time.perf_counter()
    run.model.learn(RECIPE.stretch, reset_num_timesteps=False)
    row("all of it, one training alone, in its first 10,000 steps",
        f"{RECIPE.stretch / (time.perf_counter() - start):.0f} steps per second")


def main():
    print(f"| {torch.cuda.get_device_name()}, PyTorch {torch.__version__} | |\n|---|---|")
    same = compare_layers()
    with tempfile.TemporaryDirectory() as folder:
        measure(folder)
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
