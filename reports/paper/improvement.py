"""The probability that a training is better than another method, from reports by any number of rules:

    for rule in own best current; do relign-bench report RESULTS --format json --rule $rule; done \
        | python3 reports/paper/improvement.py > reports/paper/trainings/improvement.csv

A row is a list of trainings, a method without trainings and a rule: the share of pairs of a training and an instance on which
the training has the lower normalised error, ties counting half and levels alike, and its 95 % interval over trainings and
instances (docs/statistics.md, "Aggregate scores"). Standard library only.
"""

import csv
import json
import sys

COLUMNS = ("protocol", "method", "trainings", "opponent", "rule", "n", "improvement", "lo95", "hi95")


def documents(text):
    """The JSON values that follow each other in a text."""
    decoder, at = json.JSONDecoder(), 0
    while text[at:].strip():
        value, at = decoder.raw_decode(text, at + len(text[at:]) - len(text[at:].lstrip()))
        yield value


def rows(result):
    for aggregate in result["aggregate"]:
        trainings = {method["method"]: len(method["trainings"]) for method in aggregate["methods"] if method.get("trainings")}
        for pair in aggregate["pairs"]:
            first, second, share, low, high = pair["a"], pair["b"], pair["improvement"], pair["lo95"], pair["hi95"]
            if second in trainings and first not in trainings:
                first, second, share, low, high = second, first, 1 - share, 1 - high, 1 - low
            if first in trainings and second not in trainings:
                yield (aggregate["protocol"], first, trainings[first], second, result["rule"], pair["n"],
                       *(f"{value:.6g}" for value in (share, low, high)))


def main():
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    found = [row for report in documents(sys.stdin.read()) for result in report["results"] for row in rows(result)]
    table.writerows(sorted(found, key=lambda row: row[:4]))


if __name__ == "__main__":
    main()
