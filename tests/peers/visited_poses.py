"""Poses that searches visit, and their errors, from the raw trials of results folders: `python
tests/peers/visited_poses.py RESULTS... [--noise-level rho0.25] [-o docs/images/visited_poses.png]`.

Prints Markdown tables; -o draws the figure, which needs matplotlib.
"""

import argparse

import numpy as np
import paired_search

METHODS = ("random", "bo-rf", "bo-gp", "nlopt-bobyqa")  # in the order of drawing
COLOURS = {"random": "#999999", "bo-rf": "#d55e00", "bo-gp": "#0072b2", "nlopt-bobyqa": "#009e73"}
NOMINAL = 0.5  # coordinate of the nominal pose, whose distance is in the merit of protocol paper
REACH = 0.1  # only while it is larger than this
DOTS = 500  # drawn of each method
EDGES = (0, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 1.2)  # of the bins of distances


def distances(trial, to):
    """Distances of the true poses from step 1 on, in shares of the travel."""
    return np.linalg.norm(trial.true_poses[1:] - to, axis=1)


def own_distances(trial):
    return distances(trial, trial.own_optimum)


def nominal_distances(trial):
    return distances(trial, NOMINAL)


def joined(trials, what):
    return np.concatenate([what(trial) for trial in trials])


def quartiles(values):
    return np.percentile(values, [25, 50, 75], axis=0)


def bins(trials):
    """Noise-free error by distance from the own optimum: (lower edge, upper edge, poses, quartiles)."""
    away, errors = joined(trials, own_distances), joined(trials, lambda trial: trial.errors[1:])
    for lower, upper in zip(EDGES, EDGES[1:]):
        within = errors[(away >= lower) & (away < upper)]
        if len(within) >= 10:
            yield lower, upper, len(within), quartiles(within)


def row(method, trials, step):
    """Medians over the instances after some numbers of images."""
    nearest = [[away(trial)[:step].min() for trial in trials] for away in (nominal_distances, own_distances)]
    return (
        method,
        len(trials),
        step,
        f"{np.mean(np.array(nearest[0]) < REACH):.0%}",
        *(f"{np.median(found):.3f}" for found in nearest),
        f"{np.median([trial.lowest_merit(step) for trial in trials]):.3f}",
        f"{np.median([trial.error_at_lowest_merit(step) for trial in trials]):.4f}",
    )


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def draw(by_method, level, most, out):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (merit, error, reached) = pyplot.subplots(1, 3, figsize=(13, 4.3), constrained_layout=True)
    rng = np.random.default_rng(1)
    for method, trials in by_method.items():
        style = {"color": COLOURS.get(method)}
        columns = [joined(trials, what) for what in (nominal_distances, own_distances)]
        merits, errors = (joined(trials, lambda trial, key=key: getattr(trial, key)[1:]) for key in ("merits", "errors"))
        some = rng.permutation(len(merits))[:DOTS]
        dots = {"s": 5, "linewidths": 0, "alpha": 0.7, **style}
        merit.scatter(columns[0][some], merits[some], **dots)
        error.scatter(columns[1][some], errors[some], **dots)
        nearest = quartiles([np.minimum.accumulate(own_distances(trial)[:most]) for trial in trials])
        images = np.arange(1, most + 1)
        reached.fill_between(images, nearest[0], nearest[2], linewidth=0, alpha=0.2, **style)
        reached.plot(images, nearest[1], label=f"{method}, {len(trials)} instances", **style)
    merit.axvline(REACH, color="0.7", linewidth=0.8, zorder=0)
    merit.set(xlabel="distance from the nominal pose", ylabel="measured merit", title="what a search is shown")
    error.set(xlabel="distance from the own optimum", ylabel="noise-free RMSE", title="what is scored")
    reached.set(xlabel="images", ylabel="nearest distance from the own optimum so far", title="median and quartiles")
    reached.legend(frameon=False)
    for panel in (merit, error, reached):
        panel.set_ylim(bottom=0)
        panel.set_xlim(left=0)
        panel.spines[["top", "right"]].set_visible(False)
    title = f"Poses that searches visit in {most} images, {level}; distances in shares of the travel"
    figure.suptitle(title, fontsize=10)
    figure.savefig(out, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="+")
    parser.add_argument("--noise-level", default="rho0.25")
    parser.add_argument("--protocol", default="paper")
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    parser.add_argument("--images", nargs="+", type=int, default=list(paired_search.STEPS), help="rows of the table")
    parser.add_argument("-o", "--output")
    asked = parser.parse_args()

    trials = [trial for folder in asked.results for trial in paired_search.read(folder)]
    most = max(asked.images)
    trials = [trial for trial in trials if (trial.noise_level, trial.protocol) == (asked.noise_level, asked.protocol)
              and len(trial.merits) > most]
    by_method = {name: [trial for trial in trials if trial.algorithm == name] for name in asked.methods}
    missing = [name for name, own in by_method.items() if not own]
    if missing:
        where = f"at {asked.noise_level} in {', '.join(asked.results)}"
        raise SystemExit(f"no trial of {', '.join(missing)} with {most} images {where}")
    head = ("method", "instances", "images", "within 0.1 of nominal")
    head += ("distance: nominal", "own optimum", "lowest merit", "error there")
    print(table(head, [row(name, own, step) for name, own in by_method.items() for step in sorted(asked.images)]))
    everything = [trial for own in by_method.values() for trial in own]
    print("\nNoise-free RMSE of all these poses:\n")
    rows = [(f"{low} to {high}", count, *(f"{at:.4f}" for at in found)) for low, high, count, found in bins(everything)]
    print(table(("distance from the own optimum", "poses", "25 %", "median", "75 %"), rows))
    if asked.output:
        draw(by_method, asked.noise_level, most, asked.output)


if __name__ == "__main__":
    main()
