"""Table and figure that compare trainings, as in the paper: `python3 reports/paper/training.py FOLDER... -o
reports/paper/training.csv --figure docs/images/training.png`, from the folders of relign-train ppo.

The table has a row for each segment of each training. The figure needs matplotlib, the table the standard library only.
"""

import argparse
import csv
import json
import pathlib

RECIPE = ("algorithm", "level", "rate", "entropy", "size", "seed")  # settings in which the trainings differ
CURVE = ("steps", "hours", "reward", "episode", "success", "rmse_6", "rmse_12")
# Each panel varies one setting of the usual recipe: (setting, label).
USUAL = {"algorithm": "ppo", "level": 0.25, "rate": 1e-4, "entropy": 1e-3}
PANELS = (("algorithm", "{}"), ("level", "N = {:g}"), ("rate", "rate {:g}"), ("entropy", "entropy {:g}"))
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9")


def rows_of(folder):
    recipe = json.loads((folder / "recipe.json").read_text())
    with (folder / "curve.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            yield {"training": folder.name, **{key: recipe[key] for key in RECIPE}, **{key: row[key] for key in CURVE}}


def named(label, value):
    return label.format(value).replace("e-0", "e-")


def curve(panel, run, most_steps, **style):
    shown = [row for row in run if not most_steps or int(row["steps"]) <= most_steps]
    panel.plot([int(row["steps"]) for row in shown], [float(row["reward"] or "nan") for row in shown], **style)


def draw(rows, out):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    trainings = {}
    for row in rows:
        trainings.setdefault(row["training"], []).append(row)
    figure, panels = pyplot.subplots(1, len(PANELS), figsize=(13, 4.2), sharey=True, constrained_layout=True)
    again = [run for run in trainings.values() if all(run[0][key] == value for key, value in USUAL.items())][1:]
    for panel, (varied, label) in zip(panels, PANELS):
        alike = [run for run in trainings.values() if run not in again
                 and all(run[0][key] == value for key, value in USUAL.items() if key != varied)]
        compared = max((int(run[-1]["steps"]) for run in alike if run[0][varied] != USUAL[varied]), default=0)
        for colour, run in zip(COLOURS, sorted(alike, key=lambda run: (run[0][varied] != USUAL[varied], run[0][varied]))):
            curve(panel, run, compared, color=colour, marker=".", label=named(label, run[0][varied]))
        for run in again:  # other seeds of the usual recipe, for the random variation
            curve(panel, run, compared, color="0.7", zorder=1, label=f"{named(label, USUAL[varied])}, seed {run[0]['seed']}")
        panel.set_xlabel("steps")
        panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0)
    panels[0].set_ylabel("reward a step, training")
    figure.savefig(out, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("-o", "--out", required=True, type=pathlib.Path, metavar="FILE.csv")
    parser.add_argument("--figure", metavar="FILE.png")
    given = parser.parse_args()
    rows = [row for folder in given.folders for row in rows_of(folder)]
    with given.out.open("w", newline="") as file:
        table = csv.DictWriter(file, ("training",) + RECIPE + CURVE, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    if given.figure:
        draw(rows, given.figure)


if __name__ == "__main__":
    main()
