"""Processor time of PPO's parts: `PYTHONPATH=BUILD/python python benchmarks/training_perf.py [SIZE [THREADS]]`.

The recipe of `relign-train ppo --preset paper`, with images of SIZE columns (default 100), for two updates of 500 steps after one that
is not counted. "torch" has the convolutions by torch's layers, on one thread. Needs torch and stable-baselines3.
"""

import dataclasses
import sys
import tempfile
import time

from relign_bench.training.recipe import preset_recipe
from relign_bench.training.reinforce import Reinforcement

STEPS = 500


def timed(owner, name, spent):
    """Adds the processor time of a method's calls to spent[name]."""
    method, spent[name] = getattr(owner, name), 0.0

    def call(*arguments, **named):
        begun = time.process_time()
        try:
            return method(*arguments, **named)
        finally:
            spent[name] += time.process_time() - begun

    setattr(owner, name, call)


def parts(size, threads, compiled):
    """Processor milliseconds of a step in updates, their batches, rollouts and rendering; steps per second."""
    recipe = dataclasses.replace(preset_recipe("paper"), size=size)
    with tempfile.TemporaryDirectory() as folder:
        run = Reinforcement(recipe, folder, threads=threads, log=lambda _: None)
        run.model.policy.features_extractor.compiled = compiled
        spent = {}
        for owner, name in ((run.model, "train"), (run.model.rollout_buffer, "_get_samples"), (run.model, "collect_rollouts"),
                            (run.env.environments.task.batch, "move_by")):
            timed(owner, name, spent)
        run._seed(0)
        run.model.learn(STEPS, reset_num_timesteps=False)
        spent.update(dict.fromkeys(spent, 0.0))
        begun = time.perf_counter()
        run.model.learn(2 * STEPS, reset_num_timesteps=False)
        lasted = time.perf_counter() - begun
    return [*(seconds / (2 * STEPS) * 1000 for seconds in spent.values()), 2 * STEPS / lasted]


def main():
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    threads = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    print("layers    updates  their batches  rollouts  rendering  (processor ms a step)  steps a processor second  a second")
    for layers in ("torch", "compiled"):
        update, batches, rollout, rendering, rate = parts(size, threads, layers == "compiled")
        print(f"{layers:8} {update:8.2f} {batches:14.2f} {rollout:9.2f} {rendering:10.2f} {1000 / (update + rollout):49.0f} "
              f"{rate:9.0f}")


if __name__ == "__main__":
    main()
