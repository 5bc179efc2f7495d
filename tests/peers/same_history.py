"""The next poses of relign-bench's searches and of scikit-optimize after equal captures: `python same_history.py RESULTS...`.

Two searches with different random numbers soon have different captures, and their results vary randomly. Here scikit-optimize
gets the captures of each bo-rf, bo-et and bo-gp trial up to some image, twice, with two seeds. The model of the first seed
judges the next pose of relign-bench and that of the second seed. No trial is run.
"""

import argparse
import warnings
from pathlib import Path

import numpy as np
import paired_search

AFTER = (10, 20, 35, 49)  # images
ESTIMATORS = {"bo-rf": "RF", "bo-et": "ET", "bo-gp": "GP"}
LOWER, UPPER = 0.2, 0.8  # the box of protocol paper


def fitted(estimator, poses, merits, seed):
    """scikit-optimize's optimizer after these captures, set up as by gp_minimize and forest_minimize."""
    import skopt

    optimizer = skopt.Optimizer(
        [(LOWER, UPPER)] * poses.shape[1],
        base_estimator=estimator,
        n_initial_points=10,
        acq_func="gp_hedge" if estimator == "GP" else "EI",
        acq_func_kwargs={"xi": 0.01, "kappa": 1.96},
        acq_optimizer_kwargs={"n_points": 10000, "n_restarts_optimizer": 5, "n_jobs": 1},
        random_state=seed,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "did not converge"
        optimizer.tell(poses.tolist(), merits.tolist())
    return optimizer


def improvement(optimizer, poses):
    """Expected improvement under the optimizer's model, relative to the best of its candidates."""
    from skopt.acquisition import gaussian_ei

    proposals = np.vstack([optimizer.space.transform(poses), optimizer.next_xs_])
    found = gaussian_ei(proposals, optimizer.models[-1], y_opt=min(optimizer.yi), xi=0.01)
    return found[:-1] / found[-1] if found[-1] > 0 else np.full(len(poses), np.nan)


def nearest(optimizer, poses):
    """Distance of each pose from the nearest of the three acquisitions' proposals, in the unit cube."""
    away = optimizer.space.transform(poses)[:, None] - np.array(optimizer.next_xs_)[None]
    return np.linalg.norm(away, axis=2).min(axis=1)


def comparisons(trial):
    """(images, value of relign-bench, of the second seed, of a random pose): shares of the improvement; for a GP distances."""
    estimator = ESTIMATORS[trial.algorithm]
    chance = np.random.default_rng(trial.instance)
    start = trial.poses[0]
    if estimator != "GP" and np.all((start >= LOWER) & (start <= UPPER)):
        return  # relign-bench's forests also use such a start
    for images in AFTER:
        if images + 1 >= len(trial.poses):
            continue
        poses, merits = trial.poses[1 : images + 1], trial.merits[1 : images + 1]
        judge, other = (fitted(estimator, poses, merits, seed) for seed in (2 * trial.instance, 2 * trial.instance + 1))
        theirs = chance.permutation(other.space.inverse_transform(np.array(other.next_xs_)))[0]
        asked = [trial.poses[images + 1].tolist(), list(theirs), chance.uniform(LOWER, UPPER, poses.shape[1]).tolist()]
        yield (images, *(nearest if estimator == "GP" else improvement)(judge, asked))


def table(trials):
    lines = ["| search | after | comparisons | our next pose | scikit-optimize's, another seed | a random pose |"]
    lines.append("|---|---|---|---|---|---|")
    for algorithm in ESTIMATORS:
        found = [row for trial in trials if trial.algorithm == algorithm for row in comparisons(trial)]
        for images in AFTER:
            shown = np.array([row[1:] for row in found if row[0] == images and np.all(np.isfinite(row))])
            if len(shown):
                quartiles = np.percentile(shown, [50, 25, 75], axis=0).T
                cells = [f"{middle:.2f} ({low:.2f} to {high:.2f})" for middle, low, high in quartiles]
                lines.append(f"| {algorithm} | {images} images | {len(shown)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="+", type=Path)
    parser.add_argument("--trials", type=int, default=20, help="largest number of trials of each search [default: %(default)s]")
    asked = parser.parse_args()
    trials = [trial for folder in asked.results for trial in paired_search.read(folder)]
    chosen = [
        trial
        for algorithm in ESTIMATORS
        for trial in [trial for trial in trials if trial.algorithm == algorithm][: asked.trials]
    ]
    if not chosen:
        raise SystemExit(f"no finished trial of {', '.join(ESTIMATORS)}")
    print(table(chosen))


if __name__ == "__main__":
    main()
