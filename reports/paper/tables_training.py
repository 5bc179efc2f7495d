"""Tables of docs/training.md and docs/appendix_training.md, for tables.py: networks trained from scratch.

Standard library only.
"""

import statistics

from cells import (
    COLUMNS,
    CONTINUED,
    LEVELS,
    NO_VALUE,
    RULES,
    interval,
    named,
    network,
    number,
    percent,
    read,
    rounded,
    table,
)
from specification import LIMITS

TRAINED = (200_000, 400_000, 600_000, 1_000_000, 1_400_000, 2_000_000)  # steps of training runs


def evaluations():
    """Median noise-free RMSE of networks of the recipe after 5, 11 and 51 captures, at two recommended poses."""
    cells = {}
    for row in read("trainings/curves.csv"):
        for rule, column in (("own", "recommended_median"), ("current", "recommended_current_median")):
            if "shrinking" not in row["algorithm"] and row["step"] in ("4", "10", "50"):
                cells.setdefault((row["algorithm"], rule), {}).setdefault(row["noise_level"], []).append(
                    rounded(number(row[column])))
    return table(("network", "rule") + LEVELS,
                 [(named(name) if rule == "own" else "", rule, *(", ".join(found[level]) for level in LEVELS))
                  for (name, rule), found in cells.items()])


def specification():
    """Instances of the study within some limits after the last step, by network, moves and recommended pose."""
    cells = {}
    for row in read("trainings/instances.csv"):
        if row["algorithm"].startswith("ppo-exact"):
            for rule in ("own", "current"):
                found = cells.setdefault((row["algorithm"].replace("-shrinking", ""), rule), {})
                moves = "shrinking" if "shrinking" in row["algorithm"] else "full"
                found.setdefault((row["noise_level"], moves), []).append(float(row[COLUMNS[rule]]))

    def cell(errors):
        return " / ".join(str(sum(error <= limit for error in errors)) for limit in LIMITS)

    return table(("network", "rule", *(f"{level}: {moves}" for level in LEVELS for moves in ("full", "shrinking"))),
                 [(named(name) if rule == "own" else "", rule,
                   *(cell(found[level, moves]) for level in LEVELS for moves in ("full", "shrinking")))
                  for (name, rule), found in sorted(cells.items(), key=lambda cell: cell[0][0])])


def improvement():
    """Probability that a trained network has the lower error, by each rule."""
    cells = {}
    for row in read("trainings/improvement.csv"):
        if row["opponent"] in ("bo-gp", "bo-gp-tuned"):
            cells.setdefault((row["method"], row["trainings"], row["opponent"]), {})[row["rule"]] = (
                f"{float(row['improvement']):.2f} ({float(row['lo95']):.2f} to {float(row['hi95']):.2f})")
    return table(("networks", "opponent", *RULES),
                 [(f"{named(method)}: {count}", opponent, *(found[rule] for rule in RULES))
                  for (method, count, opponent), found in cells.items()])


def limits():
    """Networks of the recipe with full and with shrinking moves."""
    return table(("network", "moves", "RMSE", "change", "without the common offset",
                  "in specification after 11, 21, 51 captures", "meets the goal", "from the nominal pose"),
                 [(network(row["training"]) if row["moves"] == "full" else "", row["moves"], interval(row, "rmse", 4),
                   "" if row["moves"] == "full" else interval(row, "change", 2), rounded(number(row["corrected"])),
                   ", ".join(percent(row, f"in_spec_{images}") for images in (10, 20, 50)),
                   percent(row, "goal"), rounded(number(row["distance"]), 2))
                  for row in read("trainings/limits.csv")])


def goals():
    """How often poses near the nominal one and farther away meet the goal of training and the specification."""
    cells = {}
    for row in read("trainings/goal.csv"):
        shell = f"{float(row['from']):g} to {float(row['to']):g}"
        cells.setdefault((row["noise_level"], row["goal"]), {})[shell] = (
            f"{percent(row, 'measured_below_goal')}, {percent(row, 'in_spec', 1)}")
    shells = list(next(iter(cells.values())))
    return table(("level", "goal", *shells),
                 [(*key, *(of_level[shell] for shell in shells)) for key, of_level in cells.items()])


def by_training(name):
    found = {}
    for row in read(name):
        found.setdefault(row["training"], []).append(row)
    return found


def mean(rows, name, digits=4):
    """Over the last five evaluations."""
    return rounded(statistics.mean(float(row[name]) for row in rows[-5:]), digits)


def settled(*names):
    """Rows of limits.py by network and moves."""
    return {(row["training"], row["moves"]): row for name in names for row in read(f"trainings/{name}.csv")}


def ablations():
    """Training runs that continue one of the recipe with one change: means of their last five evaluations, and limits.py."""
    found = settled("ablation_limits")

    def end(name, moves):
        row = found.get((name, moves))
        return NO_VALUE if row is None else (
            f"{interval(row, 'rmse', 4)}; {', '.join(percent(row, f'in_spec_{images}') for images in (10, 50))}")

    return table(("run", "steps", "steps per episode", "goal met", "RMSE after 6, 12 moves",
                  *(f"{moves} moves; in specification after 11, 51 captures" for moves in ("full", "shrinking"))),
                 [(name, f"{int(rows[-1]['steps']):,}", mean(rows, "episode", 1), mean(rows, "success", 2),
                   f"{mean(rows, 'rmse_6')}, {mean(rows, 'rmse_12')}",
                   *(end(name, moves) for moves in ("full", "shrinking")))
                  for name, rows in by_training("trainings/ablations.csv").items()])


def from_scratch():
    """Runs from scratch with another reward, and those of the recipe: RMSE after twelve moves by steps, and limits.py."""
    found = settled("shaped_limits", "limits")
    exact = {name.removeprefix("ppo-exact-"): rows for name, rows in by_training("training_exact.csv").items()
             if rows[0]["size"] == "100"}

    def error_at(rows, steps):
        rows = [row for row in rows if int(row["steps"]) <= steps]
        return mean(rows, "rmse_12") if rows and int(rows[-1]["steps"]) == steps else NO_VALUE

    def length(name, rows):
        return (f"{CONTINUED[name]:,} + " if name in CONTINUED else "") + f"{int(rows[-1]['steps']):,}"

    def end(name):
        full, shrinking = (found.get((name, moves)) for moves in ("full", "shrinking"))
        if full is None:
            return [NO_VALUE] * 5
        return (", ".join(percent(row, "in_spec_10") for row in (full, shrinking)), interval(full, "rmse", 4),
                interval(shrinking, "rmse", 4), rounded(number(shrinking["corrected"])),
                rounded(number(full["distance"]), 2))

    return table(("run", "steps", *(f"{steps / 1e6:.1f} million" for steps in TRAINED), "end",
                  "in specification after 11 captures: full, shrinking moves", "RMSE after fifty full moves",
                  "after fifty shrinking moves", "the same without the common offset", "from the nominal pose"),
                 [(network(name), length(name, rows), *(error_at(rows, steps - CONTINUED.get(name, 0)) for steps in TRAINED),
                   mean(rows, "rmse_12"), *end(name))
                  for name, rows in {**by_training("trainings/shaped.csv"), **exact}.items()])


def trainings():
    """Reward and error at the end of each training run, and of the usual recipe after as many steps.

    The reward varies from segment to segment, so it is the mean of the last three.
    """
    runs = {}
    for row in read("training.csv"):
        runs.setdefault(row["training"], []).append(row)
    usual = runs["ppo-paper"]

    def cells(run, steps):
        so_far = [row for row in run if int(row["steps"]) <= steps][-3:]
        return (f"{sum(float(row['reward']) for row in so_far) / len(so_far):.2f}",
                f"{rounded(float(so_far[-1]['rmse_6']))}, {rounded(float(so_far[-1]['rmse_12']))}")

    head = ("algorithm", "N", "rate", "entropy", "seed", "steps", "hours", "reward a step", "error after 6, 12 moves",
            "PPO, first row, after as many steps: reward", "error")
    rows = []
    for run in runs.values():
        last = run[-1]
        steps = int(last["steps"])
        rows.append((last["algorithm"], f"{float(last['level']):g}", f"{float(last['rate']):g}", f"{float(last['entropy']):g}",
                     last["seed"], f"{steps:,}", f"{float(last['hours']):.1f}", *cells(run, steps),
                     *((NO_VALUE, NO_VALUE) if run is usual else cells(usual, steps))))
    return table(head, rows)


def made():
    """The tables by their names in the pages."""
    return {"training": trainings(), "evaluations of trainings": evaluations(), "specification of trainings": specification(),
            "improvement of trainings": improvement(), "limits of trainings": limits(), "goal of trainings": goals(),
            "ablations of trainings": ablations(), "trainings from scratch": from_scratch()}
