"""The tables of docs/reproduction.md, docs/training.md and README.md, from the files beside this script.

    python3 reports/paper/tables.py           prints them
    python3 reports/paper/tables.py --write   puts them into the three pages
    python3 reports/paper/tables.py --check   prints the pages whose tables are stale

Standard library only.
"""

import csv
import pathlib
import re
import statistics
import sys

from specification import LIMITS

HERE = pathlib.Path(__file__).resolve().parent
TREE = HERE.parent.parent
PAGES = (TREE / "docs" / "reproduction.md", TREE / "docs" / "training.md", TREE / "README.md")
CLASSES = ("images and design", "images", "merit", "neither")  # what a method observes; methods are ranked within their class
# Methods of the short table, with the recommendation rule of their authors; merit: the pose of the lowest merit.
IN_SHORT = {"sensitivity": "own", "imitation-ppo": "own", "through-focus": "own", "ppo-paper": "current", "nlopt-bobyqa": "own",
            "bo-gp-tuned": "own", "bo-gp": "merit", "random": "own", "home": "own"}
RULE_NAMES = {"merit": "lowest merit", "recommended": "own", "recommended_current": "current"}  # of authors.csv
FLOOR, FLOOR_OF_PROGRAM = "0.00035", "0.0001"  # smallest RMSE in ratios: the error of the noise-free RMSE; of the reports
INSTANCES = "50"
RULES = ("own", "best", "current")
COLUMNS = {"own": "recommended", "best": "recommended_best", "current": "recommended_current"}  # of instances.csv
LEVELS = ("rho0", "rho0.25", "rho0.5")
STEPS = (1, 2, 4, 10, 20, 50)  # moves after the capture at the start
TRAINED = (200_000, 400_000, 600_000, 1_000_000, 1_400_000, 2_000_000)  # of trainings
CONTINUED = {"then-even": 620_000, "shaped-linear-1e-4": 620_000, "shaped-linear-3e-4": 620_000}  # after steps of another
TARGETS = (0.01, 0.005, 0.002)
NO_VALUE = "-"


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

    def class_of(self, protocol, name):
        return next(row["class"] for key, row in self.ranking.items() if key[:2] == (protocol, name))

    def algorithms(self, protocol):
        """By class, best first within it, by the sum of the ranks at the three levels."""
        names = {key[1]: self.class_of(protocol, key[1]) for key in self.ranking if key[0] == protocol}
        medians = {(name, level): self._median(protocol, name, level) for name in names for level in LEVELS}
        ranks = {name: sum(sum(medians[other, level] < medians[name, level] for other in names if names[other] == names[name])
                           for level in LEVELS)
                 for name in names}
        return sorted(names, key=lambda name: ((*CLASSES, "oracle").index(names[name]), ranks[name], name))

    def _median(self, protocol, name, level):
        row = self.ranking.get((protocol, name, level))
        return number(row["recommended_median"]) if row and row["recommended_median"] else 1e9

    def at(self, protocol, name, level, step):
        """The row of a curve at a step; after its last step, the last row."""
        rows = self.curves.get((protocol, name, level), [])
        return next((row for row in reversed(rows) if int(row["step"]) <= step), None)

    def arrival(self, protocol, name, level, target):
        """First step after which the median excess stays below the target."""
        first = None
        for row in self.curves.get((protocol, name, level), []):
            value = number(row["excess_median"])
            if value is None or value >= target:
                first = None
            elif first is None:
                first = int(row["step"])
        return first


def label(study, protocol, name):
    """The name, with what differs from most methods: an oracle, another number of steps or of instances."""
    row = next(study.ranking[protocol, name, level] for level in LEVELS if (protocol, name, level) in study.ranking)
    return (name + (" (oracle)" if row["oracle"] == "true" else "") + ("" if row["step"] == "50" else f", {row['step']} steps")
            + ("" if row["trials"] == INSTANCES else f", {row['trials']} instances"))


def short(study, protocol):
    """Medians after the last step of some methods by class, by every recommendation rule; that of the authors is bold."""
    lowest = by_merit(protocol)

    def cell(name, level):
        medians = {rule: rounded(number(study.ranking[protocol, name, level][f"{rule}_median"])) for rule in RULES}
        if IN_SHORT[name] == "merit":
            medians["merit"] = rounded(lowest[name, level])
        return " / ".join(f"**{value}**" if rule == IN_SHORT[name] else value for rule, value in medians.items())

    return table(("observes", "method") + LEVELS,
                 [(observes if first else "", f"`{name}`", *(cell(name, level) for level in LEVELS))
                  for observes in CLASSES
                  for first, name in zip((True, *[False] * len(IN_SHORT)),
                                         [name for name in IN_SHORT if study.class_of(protocol, name) == observes])])


def by_merit(protocol):
    """Median error at the pose of the lowest merit, by method and level."""
    errors = {}
    for row in read("merit.csv"):
        if row["protocol"] == protocol:
            errors.setdefault((row["algorithm"], row["noise_level"]), []).append(float(row["rmse"]))
    return {key: statistics.median(of_key) for key, of_key in errors.items()}


def authors():
    """Contrasts in which each method recommends by the rule of its authors."""
    cells = {}
    for row in read("authors.csv"):
        names = " : ".join(f"{row[which]} ({RULE_NAMES[row[f'{which}_rule']]})" for which in ("first", "second"))
        cells.setdefault(names, {})[row["noise_level"]] = ratio(row)
    return table(("contrast",) + LEVELS, [(names, *(found[level] for level in LEVELS)) for names, found in cells.items()])


def rules(study, protocol):
    """Medians after the last step by the three recommendation rules."""
    def cell(name, level):
        row = study.ranking.get((protocol, name, level))
        return NO_VALUE if not row else " / ".join(rounded(number(row[f"{rule}_median"])) for rule in RULES)

    return table(("observes", "method") + LEVELS,
                 [(study.class_of(protocol, name), label(study, protocol, name), *(cell(name, level) for level in LEVELS))
                  for name in study.algorithms(protocol)])


def yields(study, protocol):
    """Shares of the trials of all levels whose error after the last step is within some limits, by the three rules."""
    errors = {}
    for row in read("instances.csv"):
        if row["protocol"] == protocol:
            errors.setdefault(row["algorithm"], []).append([number(row[COLUMNS[rule]]) for rule in RULES])

    def cell(name, limit):
        trials = errors[name]
        return " / ".join(f"{100 * sum(error <= limit for error in of_rule) / len(trials):.0f} %" for of_rule in zip(*trials))

    return table(("method", *(f"at most {limit:g}" for limit in LIMITS)),
                 [(label(study, protocol, name), *(cell(name, limit) for limit in LIMITS))
                  for name in study.algorithms(protocol)])


def floors(study_rows):
    """Contrasts whose verdict depends on the smallest error in ratios, with both verdicts."""
    cells = {}
    for row in study_rows:
        key = (row["protocol"], f"{row['first']} : {row['second']}" + ("" if row["planned"] == "yes" else " (not planned)"),
               row["noise_level"], row["rule"])
        cells.setdefault(key, {})[row["floor"]] = row
    return table(("protocol", "contrast", "level", "rule", f"errors below {FLOOR_OF_PROGRAM} raised to it",
                  f"errors below {FLOOR} raised to it"),
                 [(*key, *(ratio(found[floor]) for floor in (FLOOR_OF_PROGRAM, FLOOR))) for key, found in cells.items()
                  if len({row["verdict"] for row in found.values()}) > 1])


def ratio(row):
    return f"{float(row['ratio']):.2f} ({float(row['lo95']):.2f} to {float(row['hi95']):.2f}) {row['verdict']}"


def planned(study_rows):
    return [row for row in study_rows if row["planned"] == "yes" and row["floor"] == FLOOR]


def contrasts(protocol, rows, shown=("own", "best"), wanted=lambda first: True):
    """Ratio of errors of each planned contrast, its interval and verdict by some rules, for some first methods."""
    cells = {(row["first"], row["second"], row["noise_level"], row["rule"]): row
             for row in rows if row["protocol"] == protocol and wanted(row["first"])}
    pairs = list(dict.fromkeys(key[:2] for key in cells))

    def cell(first, second, level, rule):
        row = cells.get((first, second, level, rule))
        return NO_VALUE if not row else ratio(row)

    return table(("contrast", "rule") + LEVELS,
                 [(f"{first} : {second}" if rule == shown[0] else "", rule,
                   *(cell(first, second, level, rule) for level in LEVELS))
                  for first, second in pairs for rule in shown])


def final(study, protocol):
    """Noise-free RMSE at the last recommendation: median and its 95 % band; and the time of the method per step."""
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

    return table(("observes", "method") + LEVELS + ("ms per step",),
                 [(study.class_of(protocol, name), label(study, protocol, name), *(cell(name, level) for level in LEVELS),
                   milliseconds(name))
                  for name in study.algorithms(protocol)])


def curves(study, protocol, level):
    """Median noise-free RMSE after some numbers of captures."""
    rows = []
    for name in study.algorithms(protocol):
        at = [study.at(protocol, name, level, step) for step in STEPS]
        if at[0]:
            rows.append((name, *(rounded(number(row["recommended_median"])) for row in at)))
    return table(("method",) + tuple(f"{captures(step)} captures" for step in STEPS), rows)


def captures(step):
    """The capture at the start, and one after each move."""
    return step + 1


def evaluations():
    """Median noise-free RMSE of trainings of the recipe after 5, 11 and 51 captures, at two recommended poses."""
    cells = {}
    for row in read("trainings/curves.csv"):
        for rule, column in (("own", "recommended_median"), ("current", "recommended_current_median")):
            if "shrinking" not in row["algorithm"] and row["step"] in ("4", "10", "50"):
                cells.setdefault((row["algorithm"], rule), {}).setdefault(row["noise_level"], []).append(
                    rounded(number(row[column])))
    return table(("training", "rule") + LEVELS,
                 [(name if rule == "own" else "", rule, *(", ".join(found[level]) for level in LEVELS))
                  for (name, rule), found in cells.items()])


def specification():
    """Instances of the study within some limits after the last step, by training, moves and recommended pose."""
    cells = {}
    for row in read("trainings/instances.csv"):
        if row["algorithm"].startswith("ppo-exact"):
            for rule in ("own", "current"):
                found = cells.setdefault((row["algorithm"].replace("-shrinking", ""), rule), {})
                moves = "shrinking" if "shrinking" in row["algorithm"] else "full"
                found.setdefault((row["noise_level"], moves), []).append(float(row[COLUMNS[rule]]))

    def cell(errors):
        return " / ".join(str(sum(error <= limit for error in errors)) for limit in LIMITS)

    return table(("training", "rule", *(f"{level}: {moves}" for level in LEVELS for moves in ("full", "shrinking"))),
                 [(name if rule == "own" else "", rule,
                   *(cell(found[level, moves]) for level in LEVELS for moves in ("full", "shrinking")))
                  for (name, rule), found in sorted(cells.items(), key=lambda cell: cell[0][0])])


def improvement():
    """Probability that a training has the lower error, by each rule."""
    cells = {}
    for row in read("trainings/improvement.csv"):
        if row["opponent"] in ("bo-gp", "bo-gp-tuned"):
            cells.setdefault((row["method"], row["trainings"], row["opponent"]), {})[row["rule"]] = (
                f"{float(row['improvement']):.2f} ({float(row['lo95']):.2f} to {float(row['hi95']):.2f})")
    return table(("trainings", "opponent", *RULES),
                 [(f"{method} ({count})", opponent, *(found[rule] for rule in RULES))
                  for (method, count, opponent), found in cells.items()])


def interval(row, name, digits):
    return "{} ({} to {})".format(*(rounded(number(row[name + end]), digits) for end in ("", "_lo95", "_hi95")))


def percent(row, name, digits=0):
    return f"{100 * float(row[name]):.{digits}f} %"


def limits():
    """Trainings of the recipe with moves in full and with shrinking ones."""
    return table(("training", "moves", "RMSE", "change", "without the common offset",
                  "in specification after 11, 21, 51 captures", "meets the goal", "from the nominal pose"),
                 [(row["training"] if row["moves"] == "full" else "", row["moves"], interval(row, "rmse", 4),
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
    """Rows of limits.py by training and moves."""
    return {(row["training"], row["moves"]): row for name in names for row in read(f"trainings/{name}.csv")}


def ablations():
    """Trainings that continue one of the recipe with one change: means of their last five evaluations, and limits.py."""
    found = settled("ablation_limits")

    def end(name, moves):
        row = found.get((name, moves))
        return NO_VALUE if row is None else (
            f"{interval(row, 'rmse', 4)}; {', '.join(percent(row, f'in_spec_{images}') for images in (10, 50))}")

    return table(("training", "steps", "steps an episode", "goal met", "RMSE after 6, 12 moves",
                  *(f"{moves} moves; in specification after 11, 51 captures" for moves in ("full", "shrinking"))),
                 [(name, f"{int(rows[-1]['steps']):,}", mean(rows, "episode", 1), mean(rows, "success", 2),
                   f"{mean(rows, 'rmse_6')}, {mean(rows, 'rmse_12')}",
                   *(end(name, moves) for moves in ("full", "shrinking")))
                  for name, rows in by_training("trainings/ablations.csv").items()])


def from_scratch():
    """Trainings from scratch with another reward, and those of the recipe: RMSE after twelve moves by steps, and limits.py."""
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

    return table(("training", "steps", *(f"{steps / 1e6:.1f} million" for steps in TRAINED), "end",
                  "in specification after 11 captures: full, shrinking moves", "RMSE after fifty full moves",
                  "after fifty shrinking ones", "the same without the common offset", "from the nominal pose"),
                 [(name, length(name, rows), *(error_at(rows, steps - CONTINUED.get(name, 0)) for steps in TRAINED),
                   mean(rows, "rmse_12"), *end(name))
                  for name, rows in {**by_training("trainings/shaped.csv"), **exact}.items()])


def arrivals(study, protocol):
    """Captures after which half of the instances stay within some distances of their own optimum."""
    def cell(name, level):
        return " / ".join(str(NO_VALUE if step is None else captures(step))
                          for step in (study.arrival(protocol, name, level, target) for target in TARGETS))

    return table(("method",) + LEVELS,
                 [(name, *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def thresholds(study, protocol):
    """Instances that meet the package's thresholds at the start, after one move, and ever."""
    def cell(name, level):
        row = study.thresholds.get((protocol, name, level))
        return NO_VALUE if not row else f"{row['met_at_start']} / {row['met_after_1']} / {row['met_ever']} of {row['n']}"

    return table(("method",) + LEVELS,
                 [(name, *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def trainings():
    """Reward and error at the end of each training, and of the usual recipe after as many steps.

    The reward varies from segment to segment, so it is the mean of the last three.
    """
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
            "PPO, first row, after as many steps: reward", "error")
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
    compared, of_trainings = read("floors.csv"), read("trainings/contrasts.csv")
    made = {"short": short(study, "paper"), "floors": floors(compared), "authors": authors()}
    for protocol in ("paper", "blind"):
        made[f"final {protocol}"] = final(study, protocol)
        made[f"rules {protocol}"] = rules(study, protocol)
        made[f"yields {protocol}"] = yields(study, protocol)
        made[f"contrasts {protocol}"] = contrasts(protocol, planned(compared))
        made[f"arrivals {protocol}"] = arrivals(study, protocol)
        made[f"thresholds {protocol}"] = thresholds(study, protocol)
        for level in LEVELS:
            made[f"curves {protocol} {level}"] = curves(study, protocol, level)
    made["training"] = trainings()
    made["evaluations of trainings"] = evaluations()
    made["specification of trainings"] = specification()
    made["improvement of trainings"] = improvement()
    made["limits of trainings"] = limits()
    made["goal of trainings"] = goals()
    made["ablations of trainings"] = ablations()
    made["trainings from scratch"] = from_scratch()
    made["contrasts of trainings"] = contrasts("paper", of_trainings, wanted=lambda name: "shrinking" not in name)
    made["shrinking of trainings"] = contrasts("paper", of_trainings, ("own", "current"),
                                               lambda name: "shrinking" in name)
    return made


def replaced(name, page, made):
    """The page with every `<!-- table NAME -->` ... `<!-- end -->` filled."""
    def fill(match):
        if match["name"] not in made:
            raise SystemExit(f"{name}: unknown table '{match['name']}'; tables: {', '.join(made)}")
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
            print(f"{page}: the tables differ from {HERE}; python3 reports/paper/tables.py --write updates them")
        return 1 if stale else 0
    for page in stale:
        page.write_text(replaced(page.name, page.read_text(), made))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
