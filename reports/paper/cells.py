"""What the tables of the study have in common: reading the files beside this script, cells, and names of networks.

Standard library only.
"""

import csv
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
RULES = ("own", "best", "current")
COLUMNS = {"own": "recommended", "best": "recommended_best", "current": "recommended_current"}  # of instances.csv
LEVELS = ("rho0", "rho0.25", "rho0.5")
FLOOR, FLOOR_OF_PROGRAM = "0.00035", "0.0001"  # smallest RMSE in ratios: the error of the noise-free RMSE; of the reports
CONTINUED = {"then-even": 620_000, "shaped-linear-1e-4": 620_000, "shaped-linear-3e-4": 620_000}  # after steps of another
NO_VALUE = "-"
# Names of the pages for networks trained from scratch, by their names in the files (docs/reproduction.md, "Names").
NETWORKS = {"ppo-paper": "PPO-small", "ppo-exact": "PPO-100", "ppo-exact-200": "PPO-200", "ppo-linear": "PPO-linear"}


def named(name):
    """The pages' name for a method of the files; 'ppo-exact-200-shrinking (rho0-seed-0)' is a network with shrinking moves."""
    family, _, training = name.partition(" ")
    shrinking = family.endswith("-shrinking")
    known = NETWORKS.get(family.removesuffix("-shrinking"))
    if known is None:
        return name
    return " ".join(filter(None, (known, training_of(training)))) + (", shrinking moves" if shrinking else "")


def training_of(name):
    """'(rho0-seed-0)': the only training at that level; '(seed-1)': one of several at rho0.25."""
    name = re.sub(r"(rho[0-9.]+)-seed-0", r"trained at \1", name)
    return re.sub(r"seed-([0-9])", r"seed \1", name)


def network(file):
    """The pages' name for a network file of trainings/; names of other trainings stay."""
    if re.fullmatch(r"rho[0-9.]+-seed-0", file):
        return named(f"ppo-exact-200 ({file})")
    if file == "shaped-linear-3e-4":
        return f"PPO-linear ({file})"
    return named(f"ppo-exact ({file})" if re.fullmatch(r"seed-[0-9]", file) else file)


def read(name):
    with (HERE / name).open(newline="") as file:
        return list(csv.DictReader(file))


def number(text):
    return float(text) if text else None


def rounded(value, digits=4):
    return NO_VALUE if value is None else f"{value:.{digits}f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def ratio(row):
    return f"{float(row['ratio']):.2f} ({float(row['lo95']):.2f} to {float(row['hi95']):.2f}) {row['verdict']}"


def interval(row, name, digits):
    return "{} ({} to {})".format(*(rounded(number(row[name + end]), digits) for end in ("", "_lo95", "_hi95")))


def percent(row, name, digits=0):
    return f"{100 * float(row[name]):.{digits}f} %"


def captures(step):
    """The capture at the start, and one after each move."""
    return step + 1
