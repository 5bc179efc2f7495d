"""Figure of docs/study.md: error against captures at rho0.25, protocol `paper`, a panel for each class of privileges:
`python3 reports/paper/curves_by_class.py`, from curves.csv and trainings/curves.csv beside it. Needs matplotlib."""

from cells import captures, named, read

OUT = "docs/images/study.svg"
LEVEL = "rho0.25"
BLUE, RED, GREEN, PINK, ORANGE, SKY, GREY = "#0072B2", "#D55E00", "#009E73", "#B5598E", "#C98A00", "#3C9BC9", "#8A8F98"
OWN, LAST = "recommended", "recommended_current"
TRAINED = "ppo-exact-200 (rho0.25-seed-0)"
# Panel: (method, recommended pose, colour, line).
PANELS = {
    "images and design": (("sensitivity", OWN, BLUE, "-"), ("tolerance-fit", OWN, RED, "-")),
    "images": (("imitation-ppo", OWN, BLUE, "-"), ("imitation", OWN, SKY, "-"), ("through-focus", OWN, GREEN, "-"),
               (TRAINED, OWN, RED, "-"), (TRAINED, LAST, RED, ":"), ("ppo-paper", OWN, PINK, "-"),
               ("ppo-paper", LAST, PINK, ":"), ("ceres-image", OWN, ORANGE, "-")),
    "merit": (("nlopt-bobyqa", OWN, BLUE, "-"), ("transfer-gp", OWN, GREEN, "-"), ("transfer-gp-authors", OWN, SKY, "-"),
              ("bo-gp-tuned", OWN, PINK, "-"), ("bo-gp", OWN, RED, "-"), ("bo-gp", "recommended_best", RED, "--"),
              ("bo-rf", OWN, ORANGE, "-")),
}
EVERYWHERE = (("random", OWN, GREY, "-"), ("home", OWN, GREY, "--"))
SUFFIX = {OWN: "", LAST: ", last pose", "recommended_best": ", lowest measured RMSE"}


def columns(rows, *names):
    return [captures(int(row["step"])) for row in rows], *([float(row[name]) for row in rows] for name in names)


def main():
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.hashsalt": OUT, "svg.fonttype": "none", "font.size": 9.5, "axes.edgecolor": "#3a3f47",
                                "font.family": "sans-serif", "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"]})
    from matplotlib import pyplot, ticker

    curves = {}
    for row in read("curves.csv") + read("trainings/curves.csv"):
        if row["protocol"] == "paper" and row["noise_level"] == LEVEL:
            curves.setdefault(row["algorithm"], []).append(row)
    figure, axes = pyplot.subplots(1, len(PANELS), figsize=(9.2, 5.2), sharey=True, layout="constrained")
    for panel, (observed, methods) in zip(axes, PANELS.items()):
        for method, pose, colour, line in (*methods, *EVERYWHERE):
            rows = curves[method]
            banded = [row for row in rows if row[f"{pose}_lo95"]]  # intervals are computed at some steps
            panel.plot(*columns(rows, f"{pose}_median"), color=colour, linestyle=line, linewidth=1.4,
                       label=named(method) + SUFFIX[pose])
            if line == "-":
                at, low, high = columns(banded, f"{pose}_lo95", f"{pose}_hi95")
                panel.fill_between(at, low, high, color=colour, alpha=0.14, linewidth=0)
        panel.set_title(f"observes {observed}", loc="left", fontsize=10, fontweight="bold", color="#3a3f47")
        panel.set_xlabel("captures")
        panel.set_xlim(1, 51)
        panel.set_yscale("log")
        panel.set_ylim(5e-4, 0.06)
        panel.yaxis.set_major_locator(ticker.FixedLocator([0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05]))
        panel.yaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
        panel.yaxis.set_minor_locator(ticker.NullLocator())
        panel.grid(axis="y", color="#3a3f47", alpha=0.18, linewidth=0.8)
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(frameon=False, fontsize=8.5, loc="upper left", bbox_to_anchor=(0, -0.12))
    axes[0].set_ylabel("error at the recommended pose (RMSE)")
    figure.savefig(OUT, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    main()
