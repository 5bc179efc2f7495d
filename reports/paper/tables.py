"""The tables of README.md and of the study's pages in docs/, from the files beside this script.

    python3 reports/paper/tables.py           prints them
    python3 reports/paper/tables.py --write   puts them into the pages
    python3 reports/paper/tables.py --check   prints the pages whose tables are stale

Standard library only.
"""

import pathlib
import statistics
import sys

import tables_training
from cells import (
    COLUMNS,
    FLOOR,
    FLOOR_OF_PROGRAM,
    HERE,
    LEVELS,
    NO_VALUE,
    RULES,
    captures,
    named,
    number,
    ratio,
    read,
    rounded,
    table,
)
from claims import claims, methods, spread
from specification import LIMITS

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import pages  # noqa: E402

TREE = HERE.parent.parent
PAGES = [TREE / "README.md", *(TREE / "docs" / f"{name}.md" for name in
                               ("study", "reproduction", "training", "appendix_study", "appendix_training"))]
CLASSES = ("images and design", "images", "merit", "neither")  # what a method observes; methods are ranked within their class
# Methods of the short table, with the recommendation rule of their authors; merit: the pose of the lowest merit.
IN_SHORT = {"sensitivity": "own", "imitation-ppo": "own", "through-focus": "own", "ppo-paper": "current", "nlopt-bobyqa": "own",
            "bo-gp-tuned": "own", "bo-gp": "merit", "random": "own", "home": "own"}
RULE_NAMES = {"merit": "lowest merit", **{column: rule for rule, column in COLUMNS.items()}}  # of authors.csv
INSTANCES = "50"
STEPS = (1, 2, 4, 10, 20, 50)  # moves after the capture at the start
TARGETS = (0.01, 0.005, 0.002)
STAGE, SMALLEST = "stage errors twice as large", 0.0001
DOMAINS = {"relign_od": "as in training: `relign_od`", "relign_od-package": "reflections: `relign_od-package`",
           "relign_od-sensor": "another sensor: `relign_od-sensor`",
           "relign_od-target": "target 1 % too large: `relign_od-target`",
           STAGE: STAGE,
           **{scene: f"`{scene}`" for scene in ("relign4", "relign4_telecentric", "relign_l2", "relign_l3", "cooke_triplet",
                                                "tessar", "double_gauss", "wide_angle", "petzval")}}
DOMAIN_METHODS = {**dict.fromkeys(("sensitivity", "sensitivity-stray-light", "imitation", "imitation-randomised",
                                   "imitation-ppo", "ceres-image"), (6, 12)), "nlopt-bobyqa": (12, 50), "bo-gp": (12, 50)}


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
    return (named(name) + (" (oracle)" if row["oracle"] == "true" else "")
            + ("" if row["step"] == "50" else f", {row['step']} steps")
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
                 [(observes if first else "", f"`{name}`" if named(name) == name else named(name),
                   *(cell(name, level) for level in LEVELS))
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
    """Contrasts in which each method recommends by the rule of its authors; networks of one kind share a row."""
    found = {}
    for row in read("authors.csv"):
        kinds = [row[which].split(" ")[0] for which in ("first", "second")]
        if kinds[1] == "bo-gp" or kinds[0] in ("bo-gp", "imitation-ppo", "ppo-exact-200"):
            rules = [RULE_NAMES[row[f"{which}_rule"]] for which in ("first", "second")]
            pair = tuple(zip(map(named, kinds), rules))
            found.setdefault(pair, {}).setdefault(row["noise_level"], []).append(row)

    def cell(rows):
        verdicts = " or ".join(dict.fromkeys(row["verdict"] for row in rows))
        return ratio(*rows) if len(rows) == 1 else f"{spread(rows)} {verdicts}"

    return table(("contrast",) + LEVELS,
                 [(" : ".join(f"{name} ({rule})" for name, rule in pair), *(cell(levels[level]) for level in LEVELS))
                  for pair, levels in found.items()])


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
                 [(f"{named(first)} : {named(second)}" if rule == shown[0] else "", rule,
                   *(cell(first, second, level, rule) for level in LEVELS))
                  for first, second in pairs for rule in shown])


def final(study, protocol):
    """Noise-free RMSE after the last step: median and its 95 % band by `own`, medians by the other rules; time per step."""
    def cell(name, level):
        row = study.ranking.get((protocol, name, level))
        if not row or not row["recommended_median"]:
            return NO_VALUE
        low, high = rounded(number(row["recommended_lo95"])), rounded(number(row["recommended_hi95"]))
        others = (rounded(number(row[f"{rule}_median"])) for rule in RULES[1:])
        return f"{rounded(number(row['recommended_median']))} ({low} to {high}) / " + " / ".join(others)

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
            rows.append((named(name), *(rounded(number(row["recommended_median"])) for row in at)))
    return table(("method",) + tuple(f"{captures(step)} captures" for step in STEPS), rows)


def arrivals(study, protocol):
    """Captures after which half of the instances stay within some distances of their own optimum."""
    def cell(name, level):
        return " / ".join(str(NO_VALUE if step is None else captures(step))
                          for step in (study.arrival(protocol, name, level, target) for target in TARGETS))

    return table(("method",) + LEVELS,
                 [(named(name), *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def thresholds(study, protocol):
    """Instances that meet the package's thresholds at the start, after one move, and ever."""
    def cell(name, level):
        row = study.thresholds.get((protocol, name, level))
        return NO_VALUE if not row else f"{row['met_at_start']} / {row['met_after_1']} / {row['met_ever']} of {row['n']}"

    return table(("method",) + LEVELS,
                 [(named(name), *(cell(name, level) for level in LEVELS)) for name in study.algorithms(protocol)])


def domains():
    """Median excess error on other scenes and stages, by `own`, after the moves of each method's column."""
    rows = {(row["scene"] if name == "matrix" else STAGE, row["algorithm"].removesuffix("-elsewhere"), row["images"]): row
            for name in ("matrix", "matrix_stage") for row in read(f"../domain_gap/{name}.csv") if row["rule"] == "own"}

    def median(scene, method, moves):
        value = float(rows[scene, method, str(moves)]["excess_median"])
        return rounded(value) if value >= SMALLEST else f"<{SMALLEST:g}"

    return table(("domain", *(f"`{method}`" for method in DOMAIN_METHODS)),
                 [(label, *(", ".join(median(scene, method, moves) for moves in at) for method, at in DOMAIN_METHODS.items()))
                  for scene, label in DOMAINS.items()])


def tables():
    study = Study()
    compared, of_trainings = read("floors.csv"), read("trainings/contrasts.csv")
    made = {"short": short(study, "paper"), "floors": floors(compared), "authors": authors(),
            "domains": domains()}
    for protocol in ("paper", "blind"):
        made[f"final {protocol}"] = final(study, protocol)
        made[f"yields {protocol}"] = yields(study, protocol)
        made[f"contrasts {protocol}"] = contrasts(protocol, planned(compared))
        made[f"arrivals {protocol}"] = arrivals(study, protocol)
        made[f"thresholds {protocol}"] = thresholds(study, protocol)
        for level in LEVELS:
            made[f"curves {protocol} {level}"] = curves(study, protocol, level)
    made |= tables_training.made()
    made |= {"claims": claims(), "methods": methods(study)}
    made["contrasts of trainings"] = contrasts("paper", of_trainings, wanted=lambda name: "shrinking" not in name)
    made["shrinking of trainings"] = contrasts("paper", of_trainings, ("own", "current"),
                                               lambda name: "shrinking" in name)
    return made


if __name__ == "__main__":
    sys.exit(pages.main(sys.argv[1:], __doc__, PAGES, tables()))
