"""Figures of trainings, a line each: `python3 reports/paper/training_exact.py`.

Reads training_exact.csv, training.csv and trainings/shaped.csv beside it and writes docs/images/training_exact.png (PPO-100,
PPO-200 and PPO-small) and docs/images/training_shaped.png (other rewards from scratch); needs matplotlib.
"""

import csv
import pathlib

from cells import CONTINUED

HERE = pathlib.Path(__file__).resolve().parent
IMAGES = HERE.parents[1] / "docs" / "images"
EXACT, SHAPED = "training_exact.csv", "trainings/shaped.csv"
BLUE, GREEN, PINK, BLACK, RED = "#0072b2", "#009e73", "#cc79a7", "#000000", "#d55e00"
ORANGE, SKY, GREY = "#e69f00", "#56b4e9", "#7f7f7f"
ERROR = ("rmse_12", "RMSE after twelve moves")
# By file: columns and titles of the panels; evaluations that a point is the mean of; and (file, settings of its rows, label,
# colour) of the trainings
FIGURES = {
    "training_exact.png": (
        (("reward", "reward a step"), ("success", "share of episodes that reach the goal"), ERROR), 1,
        ((EXACT, {"size": "100"}, "PPO-100, three seeds", BLUE),
         (EXACT, {"size": "200", "level": "0.0"}, "PPO-200, trained at rho0", GREEN),
         (EXACT, {"size": "200", "level": "0.25"}, "PPO-200, at rho0.25", PINK),
         (EXACT, {"size": "200", "level": "0.5"}, "PPO-200, at rho0.5", BLACK),
         ("training.csv", {"training": "ppo-paper"}, "PPO-small", RED))),
    "training_shaped.png": (
        (("rmse_6", "RMSE after six moves"), ERROR), 5,
        ((EXACT, {"size": "100"}, "PPO-100, three seeds", BLUE),
         (SHAPED, {"training": "shaped-200"}, "shaped-200", RED),
         (SHAPED, {"training": "shaped-rate"}, "shaped-rate", ORANGE),
         (SHAPED, {"training": "shaped-even"}, "shaped-even", SKY),
         (SHAPED, {"training": "shaped-near"}, "shaped-near", PINK),
         (SHAPED, {"training": "shaped-linear"}, "shaped-linear", GREEN),
         (SHAPED, {"training": "shaped-linear-1e-4"}, "then 1e-4 to 0", BLACK),
         (SHAPED, {"training": "shaped-linear-3e-4"}, "then 3e-4 to 0 (PPO-linear)", GREY))),
}


def smoothed(values, count):
    return [sum(values[max(0, end - count):end]) / min(count, end) for end in range(1, len(values) + 1)]


def draw(path, panels_shown, count, trainings):
    from matplotlib import pyplot, ticker

    figure, panels = pyplot.subplots(1, len(panels_shown), figsize=(13, 4), constrained_layout=True)
    for name, wanted, label, colour in trainings:
        with (HERE / name).open(newline="") as file:
            runs = {}
            for row in csv.DictReader(file):
                if all(row[key] == value for key, value in wanted.items()):
                    runs.setdefault(row["training"], []).append(row)
        for panel, (column, _) in zip(panels, panels_shown):
            for number, rows in enumerate(runs.values()):
                shown = [row for row in rows if row[column]]
                before = CONTINUED.get(rows[0]["training"], 0)
                panel.plot([before + int(row["steps"]) for row in shown],
                           smoothed([float(row[column]) for row in shown], count),
                           color=colour, linewidth=1, alpha=1 - 0.35 * min(number, 2), label=label if number == 0 else None)
    for panel, (_, title) in zip(panels, panels_shown):
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("steps")
        panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        panel.spines[["top", "right"]].set_visible(False)
    columns = len(trainings) if len(trainings) < 7 else -(-len(trainings) // 2)
    figure.legend(*panels[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=columns)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def main():
    import matplotlib

    matplotlib.use("Agg")
    for name, (panels, count, trainings) in FIGURES.items():
        draw(IMAGES / name, panels, count, trainings)


if __name__ == "__main__":
    main()
