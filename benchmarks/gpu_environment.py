"""The vector environment on a GPU: equality with the CPU, then times, as rows of docs/performance.md.

benchmarks/gpu_all.sh runs it; by hand: PYTHONPATH=BUILD/python python3 benchmarks/gpu_environment.py. It needs torch and
gymnasium. Exit status 1 if anything differs from the CPU.
"""

import argparse
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
EPISODE = 200  # moves, as in the paper
SIZE = {}  # columns of the images, where they are not the scene's


def make(count, device, **arguments):
    return gymnasium.make_vec("relign_bench/Alignment-v0", num_envs=count, device=device, **SIZE, **arguments).unwrapped


def synchronize():
    if torch.cuda.is_available():
        torch.cuda.synchronize()


def seconds_of(body, rounds):
    """Median over some calls, of which the first is left out. Waits for the GPU."""
    times = []
    for _ in range(rounds + 1):
        start = time.perf_counter()
        body()
        synchronize()
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
                  (infos["noise_free_error"] == other_infos["noise_free_error"]).sum()]
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
             "step with noise-free RMSE": seconds_of(lambda: env.step(actions)[4]["noise_free_error"], rounds)}
    for what, seconds in times.items():
        print(f"| {where}: {what} | {1e3 * seconds:.1f} ms, {count / seconds:.0f} per second |", flush=True)
    moves = np.zeros((count, env.task.axes))
    slots = list(range(count))
    seconds = seconds_of(lambda: env.task.batch.move_by(slots, moves), rounds)
    print(f"| {where}: captures alone (Batch.move_by) | {1e3 * seconds:.1f} ms, {count / seconds:.0f} per second |", flush=True)


def measure_episodes(device, count, rounds):
    """Steps per second with resets, and with resets and the noise-free RMSE after every step."""
    env = make(count, device, max_episode_steps=EPISODE)
    actions = np.random.default_rng(1).uniform(-0.1, 0.1, env.action_space.shape).astype(np.float32)
    env.reset(seed=1)
    # Episodes that began at different times, so that in every step the same share of them ends.
    env.task.steps[:] = EPISODE - 1 - np.arange(count) * EPISODE // count

    def rate(read):
        moves, start = 0, time.perf_counter()
        for call in range(-1, 10 * rounds):  # the first is left out
            if call == 0:
                synchronize()
                moves, start = 0, time.perf_counter()
            infos = env.step(actions)[4]
            moves += int((env.task.steps > 0).sum())
            if read:
                infos["noise_free_error"].sum()
        synchronize()
        return moves / (time.perf_counter() - start)

    for what, read in (("resets included (episodes of 200 moves)", False),
                       ("resets and noise-free RMSE of every step included", True)):
        print(f"| environment, {count} instances, {device}: {what} | {rate(read):.0f} steps per second |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1024, metavar="N", help="environments [default: %(default)s]")
    parser.add_argument("--rounds", type=int, default=15, metavar="N",
                        help="calls whose median is a time [default: %(default)s]")
    parser.add_argument("--pixels", type=int, metavar="N", help="columns of the images [default: the scene's]")
    parser.add_argument("--emulated", action="store_true", help="the driver is emulated in the processor's memory (tests)")
    given = parser.parse_args()
    if given.pixels:
        SIZE["size"] = given.pixels
    if given.emulated:
        _cuda.DEVICE = "cpu"
    try:
        same = compare()
    except ValueError as problem:
        sys.exit(f"the environment was not measured: {problem}")
    measure_episodes("cuda", given.count, given.rounds)
    measure("cuda", given.count, given.rounds)
    measure("cuda", min(given.count, 16), given.rounds)
    measure("cpu", min(given.count, 64), min(given.rounds, 3))
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
