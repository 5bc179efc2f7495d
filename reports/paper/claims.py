"""Tables of docs/study.md, for tables.py: the paper's claims with their evidence, and the methods with their tuning.

A claim "A ends ahead of B" is "same" at a noise level if A's error is lower by the rules `own` and `best`, "different" if it
is higher by both, "no difference found" if both are practically equal by either rule, else "not shown". A claim about a recipe
also needs several training runs (docs/reproduction.md, "How verdicts are reached"). Standard library only.
"""

import re

from cells import COLUMNS, FLOOR, LEVELS, NETWORKS, captures, read, rounded, table

TRAININGS = 3  # that a claim about a recipe needs at each level
NOT_SHOWN, EQUAL = "not shown", "no difference found"
OF_RULES = {"better": "same", "worse": "different", "practically equal": EQUAL}
MOVES = 10


def verdict(by_rule):
    """Of a claim that the first method ends ahead, from its verdicts by the rules `own` and `best` at one level."""
    return OF_RULES.get(by_rule[0], NOT_SHOWN) if by_rule[0] == by_rule[1] else NOT_SHOWN


def summed_up(verdicts):
    """One verdict if all levels have the same, else each with its levels."""
    if len(set(verdicts)) == 1:
        return f"**{verdicts[0]}**"
    return "; ".join(f"**{one}** at " + ", ".join(level for level, of_level in zip(LEVELS, verdicts) if of_level == one)
                     for one in dict.fromkeys(verdicts))


def spread(rows):
    """Lowest and highest ratio, and the ends of their intervals."""
    found = [[float(row[name]) for row in rows] for name in ("ratio", "lo95", "hi95")]
    return f"{min(found[0]):.2f} to {max(found[0]):.2f} ({min(found[1]):.2f} to {max(found[2]):.2f})"


def interval_of(row):
    return f"{float(row['ratio']):.2f} ({float(row['lo95']):.2f} to {float(row['hi95']):.2f})"


class Evidence:
    """Contrasts by methods, rule and level, and curves of all methods, at protocol `paper`."""

    def __init__(self):
        self.contrasts, self.authors, self.curves = {}, {}, {}
        floors = [row for row in read("floors.csv") if row["protocol"] == "paper" and row["floor"] == FLOOR]
        for row in floors + read("trainings/contrasts.csv"):
            self.contrasts[row["first"], row["second"], row["rule"], row["noise_level"]] = row
        for row in read("authors.csv"):
            self.authors[row["first"], row["second"], row["first_rule"], row["noise_level"]] = row
        for row in read("curves.csv") + read("trainings/curves.csv"):
            if row["protocol"] == "paper":
                self.curves.setdefault((row["algorithm"], row["noise_level"]), []).append(row)
        self.networks = list(dict.fromkeys(name for name, _ in self.curves if name.startswith("ppo-exact-200 ")))

    def ratios(self, first, second, rule):
        rows = [self.contrasts[first, second, rule, level] for level in LEVELS]
        return [interval_of(row) for row in rows]

    def verdicts(self, first, second):
        return [verdict([self.contrasts[first, second, rule, level]["verdict"] for rule in ("own", "best")])
                for level in LEVELS]

    def summed_up(self, first, second):
        """The verdicts in one cell; where no difference is found, with the outer ends of both rules' intervals."""
        verdicts = self.verdicts(first, second)
        text = summed_up(verdicts)
        for level, of_level in zip(LEVELS, verdicts):
            if of_level == EQUAL:
                rows = [self.contrasts[first, second, rule, level] for rule in ("own", "best")]
                low, high = min(float(row["lo95"]) for row in rows), max(float(row["hi95"]) for row in rows)
                text = re.sub(rf"{level}(?=[,;]|$)", f"{level} ({low:.2f} to {high:.2f})", text, count=1)
        return text

    def medians(self, names, column, step):
        """Lowest and highest median of some methods at each level."""
        found = [[float(self.curves[name, level][step][f"{column}_median"]) for name in names] for level in LEVELS]
        ends = [dict.fromkeys((rounded(min(of_level)), rounded(max(of_level)))) for of_level in found]
        return [" to ".join(of_level) for of_level in ends]


def instances(rows):
    """Per level."""
    return ", ".join(sorted({row["n"] for row in rows}))


def claims():
    """The five claims: verdict, numbers with intervals, instances, training runs.

    Raises:
        ValueError: There are enough training runs for a verdict on the recipe, and no rule yet that combines them.
    """
    found = Evidence()
    per_level = len(found.networks) / len(LEVELS)
    if per_level >= TRAININGS:
        raise ValueError(f"{per_level:g} training runs of PPO-200 per level: claims 2 and 3 need a verdict over runs")

    def ahead(claim, first, second, trainings):
        rows = [found.contrasts[first, second, "own", level] for level in LEVELS]
        for rule, start in (("own", (claim, found.summed_up(first, second))), ("best", ("", ""))):
            yield (*start, f"`{first}` : `{second}`, {rule}", *found.ratios(first, second, rule), instances(rows), trainings)

    def recipe(start, measured, cells, rows):
        return (*start, measured, *cells, instances(rows), f"{per_level:g} per level")

    same_rule = [[found.contrasts[name, "bo-gp", "own", level] for name in found.networks] for level in LEVELS]
    authors = [[found.authors[name, "bo-gp", COLUMNS["current"], level] for name in found.networks] for level in LEVELS]
    bobyqa = [[found.authors[name, "nlopt-bobyqa", COLUMNS["own"], level] for name in found.networks] for level in LEVELS]
    against = {rule: [found.authors["imitation-ppo", "nlopt-bobyqa", COLUMNS[rule], level] for level in LEVELS]
               for rule in ("own", "best")}
    ten = [found.curves[name, level][MOVES] for name in found.networks for level in LEVELS]
    after = f"PPO-200, median error after {captures(MOVES)} captures"
    return table(("claim of the paper", "verdict", "measured", *LEVELS, "instances per level", "training runs"), [
        *ahead("1. A policy that observes images ends ahead of BO-GP", "imitation-ppo", "bo-gp", "1"),
        *(("", "", f"`imitation-ppo` : `nlopt-bobyqa`, {rule}", *map(interval_of, against[rule]), instances(against[rule]), "1")
          for rule in against),
        recipe(("2. PPO by the paper's recipe does so", f"**{NOT_SHOWN}**"), "PPO-200 : `bo-gp`, own", map(spread, same_rule),
               sum(same_rule, [])),
        recipe(("", ""), "the same, each by its authors' rule", map(spread, authors), sum(authors, [])),
        recipe(("", ""), "PPO-200 : `nlopt-bobyqa`, own", map(spread, bobyqa), sum(bobyqa, [])),
        recipe(("3. It does so in fewer than ten steps", f"**{NOT_SHOWN}**"), f"{after}, own",
               found.medians(found.networks, "recommended", MOVES), ten),
        recipe(("", ""), f"{after}, last pose", found.medians(found.networks, "recommended_current", MOVES), ten),
        *ahead("4. BO-GP ends ahead of random poses", "bo-gp", "random", "-"),
        *ahead("5. BO-RF ends ahead of random poses", "bo-rf", "random", "-"),
    ])


def methods(study):
    """Every method with what it observes, what it is, how it was tuned or trained, and its median error at rho0.25."""
    found = Evidence()
    in_files = {network: name for name, network in NETWORKS.items()}

    def cells(row):
        shown = row["methods"].split(";")
        names = [name for shown_name in shown for name, _ in found.curves
                 if name.split(" ")[0] == in_files.get(shown_name, shown_name)]
        classes = {row["class"] for key, row in study.ranking.items() if key[0] == "paper" and key[1] in names} or {"images"}
        page = f"[{', '.join(shown)}](../{row['page']}/README.md)"
        return (*classes, page, row["what"], row["tuning"], row["trainings"],
                *found.medians(list(dict.fromkeys(names)), "recommended", -1)[1:2])

    head = ("observes", "method", "what", "tuned or chosen (by this project) on", "training runs", "error at rho0.25, own")
    return table(head, map(cells, read("methods.csv")))
