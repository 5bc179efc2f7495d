"""Searches on the same instances: paired ratios of their results after some numbers of images, and times of their proposals."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import program

STEPS = (10, 20, 50)
MOST_STEPS = max(STEPS)
SKOPT = str(Path(__file__).with_name("skopt_search.py"))
PACKAGE = str(Path(__file__).with_name("package_search.py"))
LEAST_ERROR = 1e-4  # resolution of the noise-free RMSE (docs/statistics.md)


def suite(scene, noise_level, instances, searches, first_instance=0, steps=MOST_STEPS):
    """A suite; searches: {"name": {"use": id or path, "parameters": {...}}}, with the names of the results below."""
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
    """Runs a suite, or resumes it; returns the trials of read()."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "suite.json"
    file.write_text(json.dumps(given, indent=1))
    program.call("run", file, "-o", folder / "results", "--workers", workers, "--progress", "none")
    return read(folder / "results")


@dataclass
class Trial:
    """One search on one instance; arrays have one value per step, of which 0 is the capture at the start."""

    algorithm: str
    noise_level: str
    protocol: str
    instance: int
    poses: np.ndarray  # commanded, shares of the travel, (steps, axes)
    true_poses: np.ndarray  # after the movement distortion, (steps, axes)
    merits: np.ndarray  # measured
    errors: np.ndarray  # noise-free RMSE at the true pose
    seconds: np.ndarray  # from the capture before to the request of this step
    own_optimum: np.ndarray  # true pose of the instance's own optimum, (axes,)

    def lowest_merit(self, step):
        """Lowest merit of the first `step` captures, without the one at the start, which the search did not choose."""
        return np.nanmin(self.merits[1 : step + 1])

    def error_at_lowest_merit(self, step):
        """Noise-free RMSE at the pose of lowest_merit, which is scikit-optimize's result."""
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
    """Median ratio ours / theirs over the shared pairs, its 95 % bootstrap interval, and the number of pairs.

    The bootstrap resamples instances with all their levels, since a search draws the same random numbers for an instance at
    every level.
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
