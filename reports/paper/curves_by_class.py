"""Figures of docs/study.md and docs/paper: error against captures at rho0.25, protocol `paper`, a panel for each class of
privileges: `python3 reports/paper/curves_by_class.py`, from curves.csv and trainings/curves.csv beside it. Needs matplotlib.

On the page the panels are stacked, so that a phone shows them large enough; in the report they are side by side. Methods differ
by colour (those of Okabe and Ito) and by marker."""

from cells import captures, named, read

STACKED, ABREAST = "docs/images/study.svg", "docs/paper/curves.svg"
LEVEL = "rho0.25"
BLUE, RED, GREEN, PINK, ORANGE, SKY, GREY = "#0072B2", "#D55E00", "#009E73", "#B5598E", "#C98A00", "#3C9BC9", "#6F747C"
OWN, BEST, LAST = "recommended", "recommended_best", "recommended_current"
TRAINED = "ppo-exact-200 (rho0.25-seed-0)"
# Panel: (method, recommended pose, colour, line, marker).
PANELS = {
    "images and design": (("sensitivity", OWN, BLUE, "-", "o"), ("tolerance-fit", OWN, RED, "-", "s")),
    "images": (("imitation-ppo", OWN, BLUE, "-", "o"), ("imitation", OWN, SKY, "-", "^"),
               ("through-focus", OWN, GREEN, "-", "D"), (TRAINED, OWN, RED, "-", "s"),
               (TRAINED, LAST, RED, ":", "s"), ("ppo-paper", OWN, PINK, "-", "v"),
               ("ppo-paper", LAST, PINK, ":", "v"), ("ceres-image", OWN, ORANGE, "-", "X")),
    "merit": (("nlopt-bobyqa", OWN, BLUE, "-", "o"), ("transfer-gp", OWN, GREEN, "-", "D"),
              ("transfer-gp-authors", OWN, SKY, "-", "^"), ("bo-gp-tuned", OWN, PINK, "-", "v"), ("bo-gp", OWN, RED, "-", "s"),
              ("bo-gp", BEST, RED, "--", "s"), ("bo-rf", OWN, ORANGE, "-", "X")),
}
EVERYWHERE = (("random", OWN, GREY, "-", ""), ("home", OWN, GREY, "--", ""))
SUFFIX = {OWN: "", LAST: ", last pose", BEST: ",\nlowest measured RMSE"}


def columns(rows, *names):
    return [captures(int(row["step"])) for row in rows], *([float(row[name]) for row in rows] for name in names)


def draw(panel, curves, observed, methods, ticker):
    for number, (method, pose, colour, line, marker) in enumerate((*methods, *EVERYWHERE)):
        rows = curves[method]
        panel.plot(*columns(rows, f"{pose}_median"), color=colour, linestyle=line, linewidth=1.4, marker=marker, markersize=4,
                   markevery=(2 + number, 10), label=named(method).replace(" (", "\n(") + SUFFIX[pose])
        if line == "-":
            banded = [row for row in rows if row[f"{pose}_lo95"]]  # intervals are computed at some steps
            at, low, high = columns(banded, f"{pose}_lo95", f"{pose}_hi95")
            panel.fill_between(at, low, high, color=colour, alpha=0.14, linewidth=0)
    panel.set_title(observed, loc="left", fontsize=9, fontweight="bold", color="#3a3f47")
    panel.set_xlim(1, 51)
    panel.set_xticks([1, 11, 21, 31, 41, 51])
    panel.set_yscale("log")
    panel.set_ylim(5e-4, 0.06)
    panel.yaxis.set_major_locator(ticker.FixedLocator([0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05]))
    panel.yaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    panel.yaxis.set_minor_locator(ticker.NullLocator())
    panel.grid(axis="y", color="#3a3f47", alpha=0.18, linewidth=0.8)
    panel.spines[["top", "right"]].set_visible(False)


def main():
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.hashsalt": STACKED, "svg.fonttype": "none", "font.size": 9, "axes.edgecolor": "#3a3f47",
                                "font.family": "sans-serif", "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"],
                                "figure.facecolor": "white"})  # also on pages with a dark background
    from matplotlib import pyplot, ticker

    curves = {}
    for row in read("curves.csv") + read("trainings/curves.csv"):
        if row["protocol"] == "paper" and row["noise_level"] == LEVEL:
            curves.setdefault(row["algorithm"], []).append(row)
    for out, grid, size, beside in ((STACKED, (3, 1), (5.0, 7.6), dict(loc="center left", bbox_to_anchor=(1.0, 0.5))),
                                    (ABREAST, (1, 3), (7.2, 5.0), dict(loc="upper left", bbox_to_anchor=(-0.05, -0.15)))):
        figure, axes = pyplot.subplots(*grid, figsize=size, sharex=True, sharey=True, layout="constrained")
        for panel, (observed, methods) in zip(axes, PANELS.items()):
            draw(panel, curves, ("observes " if out == STACKED else "") + observed, methods, ticker)
            panel.legend(frameon=False, fontsize=8, handlelength=2.6, labelspacing=0.35, **beside)
        for panel in axes if out == ABREAST else axes[-1:]:
            panel.set_xlabel("captures")
        for panel in axes[:1] if out == ABREAST else axes[1:2]:
            panel.set_ylabel("error (RMSE)" if out == ABREAST else "error at the recommended pose (RMSE)")
        figure.savefig(out, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    main()
