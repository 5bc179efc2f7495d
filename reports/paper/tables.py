"""The tables of docs/reproduction.md and of README.md, from the files beside this script.

    python3 reports/paper/tables.py           prints them
    python3 reports/paper/tables.py --write   puts them into the two pages
    python3 reports/paper/tables.py --check   says where they are stale

Standard library only.
"""

import csv
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
TREE = HERE.parent.parent
# Told what the paper told, told nothing, and methods that were run by themselves under both.
FOLDERS = tuple(folder for folder in (HERE, HERE / "blind", HERE / "ppo_paper", HERE / "tolerance_fit") if folder.is_dir())
PAGES = (TREE / "docs" / "reproduction.md", TREE / "README.md")
IN_SHORT = ("sensitivity", "ppo", "through-focus", "nlopt-bobyqa", "ppo-paper", "bo-gp", "home", "random")
LEVELS = ("rho0", "rho0.25", "rho0.5")
STEPS = (1, 2, 4, 10, 20, 50)
TARGETS = (0.01, 0.005, 0.002)
NO_VALUE = "-"


def read(name):
    """Rows of all folders' files. `home` and `random`, which every suite has, are the first folder's that has them."""
    rows, owners = [], {}
    for folder in FOLDERS:
        with (folder / name).open(newline="") as file:
            rows += [row for row in csv.DictReader(file)
                     if owners.setdefault((row["protocol"], row["algorithm"]), folder) == folder]
    return rows


def number(text):
    return float(text) if text else None


def rounded(value, digits=4):
    return NO_VALUE if value is None else f"{value:.{digits}f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


class Study:
    """Curves and ranking, found by protocol, algorithm and noise level."""

    def __init__(self):
        self.curves, self.ranking, self.thresholds = {}, {}, {}
        for row in read("curves.csv"):
            self.curves.setdefault((row["protocol"], row["algorithm"], row["noise_level"]), []).append(row)
        for row in read("ranking.csv"):
            self.ranking[row["protocol"], row["algorithm"], row["noise_level"]] = row
        for row in read("thresholds.csv"):
            self.thresholds[row["protocol"], row["algorithm"], row["noise_level"]] = row

    def algorithms(self, protocol):
        """Best first, by the sum of the ranks at the three levels: those of equal medians are the same."""
        names = {key[1] for key in self.ranking if key[0] == protocol}
        return sorted(names, key=lambda name: (sum(self._rank(protocol, name, level) for level in LEVELS), name))

    def _rank(self, protocol, name, level):
        """Counted here: a method that has a folder of its own has no rank among the others there."""
        def median(of):
            row = self.ranking.get((protocol, of, level))
            return number(row["recommended_median"]) if row else None

        own = median(name)
        others = (median(of) for key, of, at in self.ranking if key == protocol and at == level)
        return 1e9 if own is None else sum(other is not None and other < own for other in others)

    def at(self, protocol, name, level, step):
        """The row of a curve at a step; after its last step the last one stands."""
        rows = self.curves.get((protocol, name, level), [])
        return next((row for row in reversed(rows) if int(row["step"]) <= step), None)

    def arrival(self, protocol, name, level, target):
        """First step from which on the median excess stays under the target."""
        first = None
        for row in self.curves.get((protocol, name, level), []):
            value = number(row["excess_median"])
            if value is None or value >= target:
                first = None
            elif first is None:
                first = int(row["step"])
        return first


def short(study, protocol):
    """Medians after the last image, of some methods."""
    return table(("",) + LEVELS,
                 [(f"`{name}`", *(rounded(number(study.ranking[protocol, name, level]["recommended_median"])) for level in LEVELS))
                  for name in IN_SHORT])


def final(study, protocol):
    """Noise-free RMSE at the last recommendation: median, its 95 % band, and what the method costs."""
    def cell(name, level):
        row = study.ranking.get((protocol, name, level))
        if not row or not row["recommended_median"]:
            return NO_VALUE
        low, high = rounded(number(row["recommended_lo95"])), rounded(number(row["recommended_hi95"]))
        return f"{rounded(number(row['recommended_median']))} ({low} to {high})"

    def milliseconds(name):
        values = sorted(number(study.ranking[protocol, name, level]["algorithm_ms_per_step_median"]) or 0
                        for level in LEVELS if (protocol, name, level) in study.ranking)
        return f"{float(f'{values[len(values) // 2]:.2g}'):g}"  # two digits, and 1000 for 1e+03

    def label(name):
        row = next(study.ranking[protocol, name, level] for level in LEVELS if (protocol, name, level) in study.ranking)
        steps, lenses = row["step"], row["trials"]
        name = name.removesuffix(", blind")
        return name + (" (oracle)" if row["oracle"] == "true" else "") + ("" if steps == "50" else f", {steps} steps") + (
            "" if lenses == "100" else f", {lenses} lenses")

    return table(("method",) + LEVELS + ("ms a step",),
                 [(label(name), *(cell(name, level) for level in LEVELS), milliseconds(name))
                  for name in study.algorithms(protocol)])


def curves(study, protocol, level):
    """Median noise-free RMSE after so many images."""
    rows = []
    for name in study.algorithms(protocol):
        at = [study.at(protocol, name, level, step) for step in STEPS]
        if at[0]:
            rows.append((name, *(rounded(number(row["recommended_median"])) for row in at)))
    return table(("method",) + tuple(f"{step} image{'s' if step > 1 else ''}" for step in STEPS), rows)


def arrivals(study, protocol):
    """Images from which on half of the lenses are within so much of their own optimum."""
    def cell(name, level):
        return " / ".join(str(NO_VALUE if step is None else step)
                          for step in (study.arrival(protocol, name, level, target) for target in TARGETS))

    return table(("method",) + LEVELS,
                 [(name, *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def thresholds(study, protocol):
    """Who meets the thresholds of the package: lenses of all at the start, after one move, ever."""
    def cell(name, level):
        row = study.thresholds.get((protocol, name, level))
        return NO_VALUE if not row else f"{row['met_at_start']} / {row['met_after_1']} / {row['met_ever']} of {row['n']}"

    return table(("method",) + LEVELS,
                 [(name, *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def trainings():
    """Reward and error of each training where it ended, and of the usual recipe after as many steps. The reward is the mean of
    three stretches, over which it wavers."""
    runs = {}
    with (HERE / "training.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            runs.setdefault(row["training"], []).append(row)
    usual = runs["ppo-paper"]

    def cells(run, steps):
        so_far = [row for row in run if int(row["steps"]) <= steps][-3:]
        return (f"{sum(float(row['reward']) for row in so_far) / len(so_far):.2f}",
                f"{rounded(float(so_far[-1]['rmse_6']))}, {rounded(float(so_far[-1]['rmse_12']))}")

    head = ("algorithm", "N", "rate", "entropy", "seed", "steps", "hours", "reward a step", "error after 6, 12 moves",
            "usual recipe: reward", "error")
    rows = []
    for run in runs.values():
        last = run[-1]
        steps = int(last["steps"])
        rows.append((last["algorithm"], f"{float(last['level']):g}", f"{float(last['rate']):g}", f"{float(last['entropy']):g}",
                     last["seed"], f"{steps:,}", f"{float(last['hours']):.1f}", *cells(run, steps),
                     *((NO_VALUE, NO_VALUE) if run is usual else cells(usual, steps))))
    return table(head, rows)


def tables():
    study = Study()
    made = {"short": short(study, "paper")}
    for protocol in ("paper", "blind"):
        made[f"final {protocol}"] = final(study, protocol)
        made[f"arrivals {protocol}"] = arrivals(study, protocol)
        made[f"thresholds {protocol}"] = thresholds(study, protocol)
        for level in LEVELS:
            made[f"curves {protocol} {level}"] = curves(study, protocol, level)
    made["training"] = trainings()
    return made


def replaced(name, page, made):
    """The page with every `<!-- table NAME -->` ... `<!-- end -->` filled."""
    def fill(match):
        if match["name"] not in made:
            raise SystemExit(f"{name} asks for the table '{match['name']}'; there are: {', '.join(made)}")
        return f"<!-- table {match['name']} -->\n\n{made[match['name']]}\n\n<!-- end -->"

    return re.sub(r"<!-- table (?P<name>[^>]+?) -->.*?<!-- end -->", fill, page, flags=re.DOTALL)


def main(arguments):
    made = tables()
    if not arguments:
        for name, text in made.items():
            print(f"{name}\n\n{text}\n")
        return 0
    if arguments not in (["--write"], ["--check"]):
        print(__doc__)
        return 2
    stale = [page for page in PAGES if page.read_text() != replaced(page.name, page.read_text(), made)]
    if arguments == ["--check"]:
        for page in stale:
            print(f"{page}: its tables are not those of {HERE}; python3 reports/paper/tables.py --write mends it")
        return 1 if stale else 0
    for page in stale:
        page.write_text(replaced(page.name, page.read_text(), made))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
