"""Trains what README.md compares, each within the same processor time, and prints the tables of the results.

    python3 compare.py train     # into training/ of this folder; writes processor.csv and curves/; skips complete runs
    python3 compare.py suite     # prints suite.json with the networks that exist
    python3 compare.py tables    # from processor.csv and instances.csv
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).parent
METHODS = ("policy-gradient", "imitation", "ppo-linear")
SEEDS = (1, 2, 3)
MINUTES = 2.0
# Images for the time that labels and start leave: 27,000 at 3 ms. The schedule of the rate must end within the time.
IMITATION = ["levels=0.25", "passes=8", "lenses=140"]
PPO = ["stretch=1500"]  # a checkpoint every quarter of a minute
RULES = {"current": "recommended_current", "own": "recommended"}  # with the columns of instances.csv


def command(method: str, seed: int, folder: pathlib.Path) -> list[str]:
    """The command of a training run."""
    if method == "policy-gradient":
        return [sys.executable, str(HERE / "train.py"), "--minutes", str(MINUTES), "--seed", str(seed), "-o", str(folder)]
    verb, settings = ("imitate", IMITATION) if method == "imitation" else ("ppo", PPO)
    return [sys.executable, "-m", "relign_bench.training", verb, *(["--preset", "linear"] if verb == "ppo" else []),
            "--seed", str(seed), "--threads", "1", "-o", str(folder), *(word for one in settings for word in ("--set", one))]


def timed(words: list[str], minutes: float) -> tuple[float, bool]:
    """Runs a command until it ends or has used the time.

    Returns:
        Its user and system time in minutes, and whether the limit ended it.
    """
    seconds = int(60 * minutes)

    child = subprocess.Popen(words, env={**os.environ, "OMP_NUM_THREADS": "1"})
    resource.prlimit(child.pid, resource.RLIMIT_CORE, (0, 0))
    resource.prlimit(child.pid, resource.RLIMIT_CPU, (seconds, seconds + 5))
    _, status, used = os.wait4(child.pid, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status):
        sys.exit(f"error: '{' '.join(words)}' failed with exit code {os.WEXITSTATUS(status)}; see its message above")
    return (used.ru_utime + used.ru_stime) / 60, os.WIFSIGNALED(status)


def train(method: str, seed: int) -> None:
    """One training run, its networks NAME-SEED.onnx, and its line of processor.csv."""
    networks, folder = HERE / "training" / method, HERE / "training" / "folders" / f"{method}-{seed}"
    last, best = networks / f"last-{seed}", networks / f"best-{seed}"
    if last.with_suffix(".onnx").is_file():
        return
    shutil.rmtree(folder, ignore_errors=True)  # an interrupted run starts again, so that its time is counted in full
    networks.mkdir(parents=True, exist_ok=True)
    # train.py ends by its own clock, and relign-train imitate by its number of images; both may use a little more than planned.
    minutes, ended = timed(command(method, seed, folder), MINUTES if method == "ppo-linear" else 1.5 * MINUTES)
    if method == "policy-gradient":
        for name, target in (("last", last), ("best", best)):
            for suffix in (".onnx", ".json"):
                shutil.copy(folder / f"{name}{suffix}", target.with_suffix(suffix))
    else:
        export = [sys.executable, "-m", "relign_bench.training", "export", str(folder), "-o"]
        if method == "ppo-linear":
            subprocess.run([*export, f"{best}.onnx"], check=True)
        subprocess.run([*export, f"{last}.onnx", *(["--last"] if method == "ppo-linear" else [])], check=True)
    (HERE / "curves").mkdir(exist_ok=True)
    shutil.copy(folder / "curve.csv", HERE / "curves" / f"{method}-{seed}.csv")
    with open(HERE / "processor.csv", "a", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow([method, seed, f"{minutes:.2f}", "limit" if ended else "end"])


def suite_so_far() -> None:
    """Prints suite.json without the networks that do not exist yet."""
    suite = json.loads((HERE / "suite.json").read_text())
    for entry in suite["algorithms"]:
        if "trainings" in entry:
            entry["trainings"] = [path for path in entry["trainings"] if (HERE / path).is_file()]
    suite["algorithms"] = [entry for entry in suite["algorithms"] if entry.get("trainings", True)]
    print(json.dumps(suite, indent=1))


def interval(values: np.ndarray) -> tuple[float, float]:
    """95 % bootstrap interval of a median, over instances."""
    draws = np.random.default_rng(1).integers(len(values), size=(2000, len(values)))
    low, high = np.quantile(np.median(values[draws], axis=1), [0.025, 0.975])
    return float(low), float(high)


def tables() -> None:
    """Prints the tables of README.md as Markdown."""
    with open(HERE / "processor.csv", newline="", encoding="utf-8") as file:
        minutes = {(row["method"], row["seed"]): row["minutes"] for row in csv.DictReader(file)}
    errors: dict[str, dict[str, list[float]]] = {}
    with open(HERE / "instances.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found = errors.setdefault(row["algorithm"], {rule: [] for rule in RULES})
            for rule, column in RULES.items():
                found[rule].append(float(row[column]))
    head = " | ".join(f"RMSE, `{rule}`" for rule in RULES)
    print(f"| method | network | processor minutes | {head} |\n|---|---|---|---|---|")
    medians: dict[str, dict[str, list[float]]] = {}
    for algorithm, by_rule in errors.items():
        method, _, training = algorithm.rstrip(")").partition(" (")
        used = minutes.get((method.replace("-best", ""), training[-1:]), "-")
        cells = []
        for rule, values in by_rule.items():
            low, high = interval(np.array(values))
            cells.append(f"{statistics.median(values):.4f} ({low:.4f} to {high:.4f})")
            medians.setdefault(method, {}).setdefault(rule, []).append(statistics.median(values))
        print(f"| {method} | {training or '-'} | {used} | {' | '.join(cells)} |")
    head = " | ".join(f"RMSE, `{rule}`: median and range over the seeds" for rule in RULES)
    print(f"\n| method | seeds | {head} |\n|---|---|---|---|")
    for method, by_rule in medians.items():
        cells = [f"{statistics.median(found):.4f}, {min(found):.4f} to {max(found):.4f}" for found in by_rule.values()]
        print(f"| {method} | {len(by_rule['own'])} | {' | '.join(cells)} |")


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("train", "suite", "tables"))
    parser.add_argument("--only", choices=METHODS, help="train this method only, to run several side by side")
    given = parser.parse_args()
    if given.verb != "train":
        return tables() if given.verb == "tables" else suite_so_far()
    if not (HERE / "processor.csv").is_file():
        (HERE / "processor.csv").write_text("method,seed,minutes,ended_by\n")
    for seed in SEEDS:  # seed by seed, so that an interrupted comparison has pairs
        for method in METHODS:
            if given.only in (None, method):
                train(method, seed)
    return None


if __name__ == "__main__":
    main()
