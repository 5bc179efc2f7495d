"""Steps per second of the Gymnasium environment: `PYTHONPATH=BUILD/python python benchmarks/environment_perf.py`.

Sixteen environments per call, the paper's noise, uniform actions, with and without the noise-free RMSE. The last column is the
ratio to the authors' package on two CPU cores, 0.32 steps per second.
"""

import time

import gymnasium

import relign_bench  # noqa: F401  (registers the environment)

PACKAGE = 0.32
ENVIRONMENTS, STEPS = 16, 100


def steps_per_second(size, episode, noise_free=False):
    env = gymnasium.make_vec("relign_bench/Alignment-v0", num_envs=ENVIRONMENTS, size=size, noise_free=noise_free,
                             max_episode_steps=episode)
    env.reset(seed=1)
    actions = [env.action_space.sample() for _ in range(STEPS)]
    begun = time.monotonic()
    for action in actions:
        env.step(action)
    return ENVIRONMENTS * STEPS / (time.monotonic() - begun)


def main():
    print("size  steps/episode  noise-free RMSE  steps/s  ratio to package")
    for size, episode, noise_free in ((200, 200, False), (200, 10, False), (100, 200, False), (100, 10, False),
                                      (200, 200, True)):
        rate = steps_per_second(size, episode, noise_free)
        print(f"{size:4}  {episode:13}  {'yes' if noise_free else 'no':>15}  {rate:7.0f}  {rate / PACKAGE:16.0f}")


if __name__ == "__main__":
    main()
