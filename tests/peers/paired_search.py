"""Two searches on the same instances: lowest merit so far, in pairs, and the time of their proposals."""

import json
from pathlib import Path

import numpy as np

import program

STEPS = (10, 20, 50)
SKOPT = str(Path(__file__).with_name("skopt_search.py"))


def suite(scene, noise_level, instances, searches, steps=max(STEPS)):
    """searches: {"name": {"use": id or path, "parameters": {...}}}; names are those of the answers below."""
    return {
        "name": "paired_search",
        "scenes": [scene],
        "noise_levels": [noise_level],
        "algorithms": [{"name": name, **search} for name, search in searches.items()],
        "instances": instances,
        "steps": steps,
    }


def run(folder, given, workers=1):
    """Goes on where an earlier call stopped. {(algorithm, instance): {"merits": [...], "seconds": [...]}}, by step."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "suite.json"
    file.write_text(json.dumps(given, indent=1))
    program.call("run", file, "-o", folder / "results", "--workers", workers, "--progress", "none")
    return read(folder / "results")


def read(results):
    merits, trials, seconds = {}, {}, {}
    for file in sorted(Path(results).glob("trials/*.jsonl")):
        for line in map(json.loads, file.read_text().splitlines()):
            if "step" in line:
                value = line["merit"]
                merits.setdefault(line["trial"], []).append(np.nan if value is None else value)
            elif line.get("end") in ("budget_spent", "finished"):
                trials[line["trial"]] = (line["algorithm"], line["instance"])
    for file in sorted(Path(results).glob("times/*.jsonl")):
        for line in map(json.loads, file.read_text().splitlines()):
            seconds[line["trial"]] = line["algorithm_seconds"]
    return {
        key: {"merits": np.array(merits[trial]), "seconds": np.array(seconds[trial])} for trial, key in trials.items()
    }


def best_so_far(trials, algorithm, step):
    """{instance: lowest merit of the first `step` captures}; the free one at the start is not the search's."""
    return {
        instance: np.nanmin(found["merits"][1 : step + 1])
        for (name, instance), found in trials.items()
        if name == algorithm
    }


def median_difference(ours, theirs, resamples=10000):
    """Median over instances of ours - theirs, over the median of theirs, and its 95 % bootstrap interval."""
    shared = sorted(set(ours) & set(theirs))
    differences = np.array([ours[instance] - theirs[instance] for instance in shared])
    scale = np.median([theirs[instance] for instance in shared])
    draws = np.random.default_rng(1).integers(len(shared), size=(resamples, len(shared)))
    low, high = np.percentile(np.median(differences[draws], axis=1), [2.5, 97.5])
    return np.array([np.median(differences), low, high]) / scale


def proposal_seconds(trials, algorithm, step):
    """Median over instances of the time from the capture before to the request of this step."""
    return np.median([found["seconds"][step] for (name, _), found in trials.items() if name == algorithm])
