"""Searches on the same instances: what each reached after so many images, in pairs, and the time of its proposals."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import program

STEPS = (10, 20, 50)
SKOPT = str(Path(__file__).with_name("skopt_search.py"))
PACKAGE = str(Path(__file__).with_name("package_search.py"))
LEAST_ERROR = 1e-4  # the noise-free RMSE is no surer than that (docs/statistics.md)


def suite(scene, noise_level, instances, searches, first_instance=0, steps=max(STEPS)):
    """searches: {"name": {"use": id or path, "parameters": {...}}}; names are those of the answers below."""
    return {
        "name": "paired_search",
        "scenes": [scene],
        "noise_levels": [noise_level],
        "algorithms": [{"name": name, **search} for name, search in searches.items()],
        "instances": instances,
        "first_instance": first_instance,
        "steps": steps,
    }


def run(folder, given, workers=1):
    """Resumes what an earlier call left; the trials of read()."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "suite.json"
    file.write_text(json.dumps(given, indent=1))
    program.call("run", file, "-o", folder / "results", "--workers", workers, "--progress", "none")
    return read(folder / "results")


@dataclass
class Trial:
    """One search on one instance; arrays with a value a step, of which 0 is the free capture at the start."""

    algorithm: str
    noise_level: str
    protocol: str
    instance: int
    poses: np.ndarray  # commanded, shares of the travel, (steps, axes)
    true_poses: np.ndarray  # where the distorted movement led, (steps, axes)
    merits: np.ndarray  # measured
    errors: np.ndarray  # noise-free RMSE at the true pose
    seconds: np.ndarray  # from the capture before to the request of this step
    own_optimum: np.ndarray  # the true pose at which this instance is best, (axes,)

    def lowest_merit(self, step):
        """Of the first `step` captures; the free one at the start is not the search's."""
        return np.nanmin(self.merits[1 : step + 1])

    def error_at_lowest_merit(self, step):
        """Noise-free RMSE at the pose of lowest_merit: what scikit-optimize returns as its result."""
        return max(self.errors[1 + np.nanargmin(self.merits[1 : step + 1])], LEAST_ERROR)


def read(results):
    """The finished trials of a results folder."""
    lines = {}
    trials = []
    seconds = {}
    for file in sorted(Path(results).glob("times/*.jsonl")):
        for line in map(json.loads, file.read_text().splitlines()):
            seconds[line["trial"]] = line["algorithm_seconds"]
    for file in sorted(Path(results).glob("trials/*.jsonl")):
        for line in map(json.loads, file.read_text().splitlines()):
            steps = lines.setdefault(line["trial"], [])
            if "step" in line:
                steps.append(line)
            elif line.get("end") in ("budget_spent", "finished"):
                trials.append(trial_of(steps, line, seconds[line["trial"]]))
    return trials


def trial_of(steps, closing, seconds):
    def column(key):
        return np.array([step[key] for step in steps], dtype=float)  # null becomes nan

    return Trial(
        algorithm=closing["algorithm"],
        noise_level=closing["noise_level"],
        protocol=closing["protocol"],
        instance=closing["instance"],
        poses=column("commanded_pose"),
        true_poses=column("true_pose"),
        merits=column("merit"),
        errors=np.sqrt(np.maximum(column("commanded_mse"), 0)),
        seconds=np.array(seconds),
        own_optimum=np.array(closing["own_optimum_pose"]),
    )


def values(trials, algorithm, noise_levels, measure):
    """{(noise level, instance): measure(trial)}"""
    return {
        (trial.noise_level, trial.instance): measure(trial)
        for trial in trials
        if trial.algorithm == algorithm and trial.noise_level in noise_levels
    }


def median_ratio(ours, theirs, resamples=10000):
    """Median over the shared pairs of ours / theirs, its 95 % bootstrap interval, and how many pairs these are.

    Resampled are instances, with all their levels: a search draws the same random numbers for an instance at every
    level.
    """
    ratios = {}
    for level, instance in sorted(set(ours) & set(theirs)):
        ratios.setdefault(instance, []).append(ours[level, instance] / theirs[level, instance])
    if not ratios:
        raise ValueError("the two searches share no instance")
    groups = list(ratios.values())
    draws = np.random.default_rng(1).integers(len(groups), size=(resamples, len(groups)))
    medians = [np.median(np.concatenate([groups[i] for i in draw])) for draw in draws]
    everything = np.concatenate(groups)
    return np.median(everything), *np.percentile(medians, [2.5, 97.5]), len(everything)


def proposal_seconds(trials, algorithm, step):
    """Median over instances of the time from the capture before to the request of this step."""
    return np.median([trial.seconds[step] for trial in trials if trial.algorithm == algorithm])
