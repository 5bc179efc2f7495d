"""The claims of replication.md about one of its suites, from the table of improvement.py:

    python3 reports/paper/verdicts.py randomised improvement.csv

A row is a claim in its order: P(A < B) by the rules `own` and `best` with its 95 % interval over trainings and instances, and
the verdict. A is "lower" than B where both intervals are above one half, "higher" where both are below, else "not shown". The
first claim that is not shown ends the testing: all later ones are "not shown", too, whatever their intervals. Standard library
only.
"""

import csv
import sys

CLAIMS = {
    "randomised": (("imitation-randomised-replicated", "nlopt-bobyqa"), ("imitation-randomised-replicated", "transfer-gp")),
    "core": (("imitation-replicated", "nlopt-bobyqa"), ("imitation-replicated", "transfer-gp"),
             ("imitation-ppo-last", "nlopt-bobyqa"), ("imitation-ppo-last", "transfer-gp"),
             ("linear-last", "bo-gp"), ("linear-last", "transfer-gp"), ("linear-last", "nlopt-bobyqa")),
}
RULES = ("own", "best")
TRAININGS = 5


def verdicts(suite, table):
    """Yields claim, intervals by rule and verdict.

    Raises:
        ValueError: The table lacks a claim, or has it with another number of trainings.
    """
    ended = False
    for method, opponent in CLAIMS[suite]:
        found = []
        for rule in RULES:
            rows = [row for row in table if (row["method"], row["opponent"], row["rule"]) == (method, opponent, rule)]
            if len(rows) != 1 or int(rows[0]["trainings"]) != TRAININGS:
                raise ValueError(f"{method} : {opponent}, rule {rule}: expected one row of {TRAININGS} trainings, found "
                                 f"{[row['trainings'] for row in rows]}")
            found.append([float(rows[0][name]) for name in ("improvement", "lo95", "hi95")])
        lower, higher = all(low > 0.5 for _, low, _ in found), all(high < 0.5 for _, _, high in found)
        ended = ended or not (lower or higher)
        yield method, opponent, found, "not shown" if ended else "lower" if lower else "higher"


def main(suite, path):
    with open(path, newline="") as file:
        rows = list(verdicts(suite, list(csv.DictReader(file))))
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("claim", "method", "opponent", *RULES, "verdict"))
    for number, (method, opponent, found, verdict) in enumerate(rows, 1):
        shown = (f"{share:.2f} ({low:.3f} to {high:.3f})" for share, low, high in found)
        table.writerow((number, method, opponent, *shown, verdict))


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in CLAIMS:
        sys.exit(f"usage: verdicts.py {'|'.join(CLAIMS)} improvement.csv")
    main(*sys.argv[1:])
