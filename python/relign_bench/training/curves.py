"""Learning curves as CSV and PNG."""

COLUMNS = ("steps", "hours", "episodes", "reward", "episode", "success", "rmse_6", "rmse_12", "under_0.01", "score")


def write_csv(folder, rows):
    """curve.csv: a row after every stretch.

    steps        of all environments so far
    hours        of training so far
    episodes     that ended in the stretch; reward a step, steps an episode and share that reached the goal: their means
    rmse_6, _12  median noise-free RMSE of tuning lenses after so many steps of the policy without exploration
    under_0.01   share of them below 0.01 after 12
    score        what chooses the best checkpoint (evaluation.py)
    """
    lines = [",".join(COLUMNS)]
    lines += [",".join(f"{row[name]:.6g}" if name != "steps" else str(row[name]) for name in COLUMNS) for row in rows]
    folder.keep_text("curve.csv", "\n".join(lines) + "\n")


def draw(folder, title, rows):
    """curve.png: reward, success and error against steps, as the paper's figure of its training."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    steps = [row["steps"] for row in rows]
    figure, panels = pyplot.subplots(1, 3, figsize=(12, 3.4), constrained_layout=True)
    for panel, (name, label) in zip(panels, (("reward", "reward a step, training"),
                                             ("success", "episodes that reach the goal, training"))):
        panel.plot(steps, [row[name] for row in rows], color="#0072b2")
        panel.set_ylabel(label)
    for name, label, style in (("rmse_6", "after 6 steps", "--"), ("rmse_12", "after 12 steps", "-")):
        panels[2].plot(steps, [row[name] for row in rows], style, color="#d55e00", label=label)
    panels[2].set_ylabel("noise-free RMSE, tuning lenses, median")
    panels[2].set_yscale("log")
    panels[2].legend(frameon=False)
    for panel in panels:
        panel.set_xlabel("steps")
        panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        panel.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title)
    folder.keep("curve.png", lambda out: figure.savefig(out, format="png", dpi=100))
    pyplot.close(figure)
