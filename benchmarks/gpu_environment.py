"""The vector environment on a GPU: equality with the CPU, then times, as rows of docs/performance.md.

benchmarks/gpu_bundle.sh packs it; by hand: PYTHONPATH=BUILD/python python3 benchmarks/gpu_environment.py. It needs torch
and gymnasium. Exit status 1 if anything differs from the CPU.
"""

import os
import statistics
import sys
import time

try:
    import gymnasium
    import numpy as np
    import torch

    import relign_bench
    from relign_bench import _cuda
except ImportError as problem:
    sys.exit(f"the environment was not measured: {problem}")

relign_bench.register()
COUNT = int(os.environ.get("RELIGN_ENVIRONMENTS", "1024"))
ROUNDS = 15


def make(count, device, **arguments):
    return gymnasium.make_vec("relign_bench/Alignment-v0", num_envs=count, device=device, **arguments).unwrapped


def seconds_of(body, rounds=ROUNDS):
    """Median over some calls, of which the first is left out. Waits for the GPU."""
    times = []
    for _ in range(rounds + 1):
        start = time.perf_counter()
        body()
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return statistics.median(times[1:])


def compare():
    """How many images, scores and noise-free RMSEs have the CPU's bits."""
    here, there = (make(16, device, frame_stack=2, max_episode_steps=3) for device in ("cpu", "cuda"))
    (one, infos), (other, other_infos) = here.reset(seed=1), there.reset(seed=1)
    random, equal, total = np.random.default_rng(1), np.zeros(3, int), 0
    for _ in range(6):
        total += 16
        equal += [(one == _cuda.on_host(other)).all(axis=(1, 2, 3)).sum(),
                  (infos["score"] == other_infos["score"]).sum(),
                  (infos["noise_free_rmse"] == other_infos["noise_free_rmse"]).sum()]
        actions = random.uniform(-1, 1, here.action_space.shape).astype(np.float32)
        one, _, _, _, infos = here.step(actions)
        other, _, _, _, other_infos = there.step(actions)
    for what, count in zip(("observations", "scores", "noise-free RMSE"), equal):
        print(f"| environment: {what} with the CPU's bits | {count} of {total} |", flush=True)
    return (equal == total).all()


def measure(device, count, rounds):
    env = make(count, device, max_episode_steps=None)
    actions = np.zeros(env.action_space.shape, np.float32)
    where = f"environment, {count} instances, {device} ({env.task.batch.threads} CPU threads)"
    seeds = iter(range(0, 10**9, count))
    times = {"reset": seconds_of(lambda: env.reset(seed=next(seeds)), rounds),
             "step": seconds_of(lambda: env.step(actions), rounds),
             "step with noise-free RMSE": seconds_of(lambda: env.step(actions)[4]["noise_free_rmse"], rounds)}
    for what, seconds in times.items():
        print(f"| {where}: {what} | {1e3 * seconds:.1f} ms, {count / seconds:.0f} per second |", flush=True)
    moves = np.zeros((count, env.task.axes))
    slots = list(range(count))
    seconds = seconds_of(lambda: env.task.batch.move_by(slots, moves), rounds)
    print(f"| {where}: captures alone (Batch.move_by) | {1e3 * seconds:.1f} ms, {count / seconds:.0f} per second |", flush=True)


def main():
    try:
        same = compare()
    except ValueError as problem:
        sys.exit(f"the environment was not measured: {problem}")
    measure("cuda", COUNT, ROUNDS)
    measure("cuda", 16, ROUNDS)
    measure("cpu", min(COUNT, 64), 3)
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
