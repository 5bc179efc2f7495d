"""The planned contrasts by every recommendation rule: `relign-bench report RESULTS --format json | python3
reports/paper/contrasts.py > reports/paper/contrasts.csv`.

A row is a contrast of the suite's analysis plan at one protocol, noise level and rule: the ratio of the two methods'
errors on the same instances (exp of the interquartile mean of log ratios) with its 95 % interval, p after Holm's
correction over the plan, and the verdict (docs/statistics.md). Standard library only.
"""

import csv
import json
import sys

RULES = ("own", "best", "current")
COLUMNS = ("protocol", "noise_level", "first", "second", "rule", "n", "ratio", "lo95", "hi95", "p_holm", "verdict")
OPPOSITE = {"better": "worse"}


def planned(pairs, first, second):
    """The pair as first against second, whichever of the two the report lists first; None where it has no such pair."""
    for pair in pairs:
        if {pair["a"], pair["b"]} != {first, second} or not pair.get("planned"):
            continue
        if pair["a"] == first:
            return pair
        return {**pair, "ratio": 1 / pair["ratio"], "lo95": 1 / pair["hi95"], "hi95": 1 / pair["lo95"],
                "verdict": OPPOSITE.get(pair["verdict"], pair["verdict"])}
    return None


def rows(result):
    for first, second in result["analysis"]["contrasts"]:
        for group in result["groups"]:
            for rule in RULES:
                pairs = group["pairs"] if rule == result["rule"] else group["rules"][rule]["pairs"]
                pair = planned(pairs, first, second)
                if pair:
                    yield (group["protocol"], group["noise_level"], first, second, rule, pair["n"], f"{pair['ratio']:.6g}",
                           f"{pair['lo95']:.6g}", f"{pair['hi95']:.6g}", f"{pair['p_planned']:.3g}", pair["verdict"])


def main():
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for result in json.load(sys.stdin)["results"]:
        table.writerows(rows(result))


if __name__ == "__main__":
    main()
