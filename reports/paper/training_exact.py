"""Figure of the exact recipe's trainings, a line each, beside that of ppo-paper: `python3 reports/paper/training_exact.py`.

Reads training_exact.csv and training.csv beside it and writes docs/images/training_exact.png; needs matplotlib.
"""

import csv
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
OUT = HERE.parents[1] / "docs" / "images" / "training_exact.png"
PANELS = (("reward", "reward a step"), ("success", "share of episodes that reach the goal"),
          ("rmse_12", "RMSE after twelve moves"))
# (file, settings of its rows, label, colour)
TRAININGS = (("training_exact.csv", {"size": "100"}, "100 x 100 pixels, rho0.25", "#0072b2"),
             ("training_exact.csv", {"size": "200", "level": "0.0"}, "200 x 200, rho0", "#009e73"),
             ("training_exact.csv", {"size": "200", "level": "0.25"}, "200 x 200, rho0.25", "#cc79a7"),
             ("training_exact.csv", {"size": "200", "level": "0.5"}, "200 x 200, rho0.5", "#000000"),
             ("training.csv", {"training": "ppo-paper"}, "ppo-paper", "#d55e00"))


def main():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    figure, panels = pyplot.subplots(1, len(PANELS), figsize=(13, 4), constrained_layout=True)
    for name, wanted, label, colour in TRAININGS:
        with (HERE / name).open(newline="") as file:
            runs = {}
            for row in csv.DictReader(file):
                if all(row[key] == value for key, value in wanted.items()):
                    runs.setdefault(row["training"], []).append(row)
        for panel, (column, _) in zip(panels, PANELS):
            for number, rows in enumerate(runs.values()):
                shown = [row for row in rows if row[column]]
                panel.plot([int(row["steps"]) for row in shown], [float(row[column]) for row in shown],
                           color=colour, linewidth=1, alpha=1 - 0.35 * min(number, 2), label=label if number == 0 else None)
    for panel, (_, title) in zip(panels, PANELS):
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("steps")
        panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        panel.spines[["top", "right"]].set_visible(False)
    figure.legend(*panels[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=len(TRAININGS))
    figure.savefig(OUT, dpi=100)


if __name__ == "__main__":
    main()
