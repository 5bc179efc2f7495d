"""Recomputes the numbers of a report from the raw records and prints the differences:

    python3 tests/peers/compare_report.py results/quick

It compares `report --format json` and `csv`, and aggregate.csv, curves.csv, curves.json, instances.csv and matrix.csv of the
folder to 1e-9, and the data in its report.html to the printed digits. `--json FILE` and so on compare other files. The exit
code is 1 if something differs. Needs the program (RELIGN_BENCH, or build/release/bin), NumPy, pandas and SciPy.
"""

import argparse
import io
import json
import math
import pathlib
import re
import sys

import pandas as pd
import program
import recompute

TOLERANCE = 1e-9
# Texts and members that do not follow from the trials' errors. Every other member of a group must be recomputed.
WORDS = {"label", "training_tag", "station", "observes", "oracle", "name", "unit", "algorithm_seconds", "key", "reason",
         "leads"}
ONLY_IN_TABLES = {"n", "mean"}  # of a curve's tracks


class Differences:
    def __init__(self, tolerance=TOLERANCE):
        self.tolerance, self.compared, self.found = tolerance, 0, []

    def add(self, place, wanted, found):
        self.found.append(f"{place}: recomputed {wanted!r}, found {found!r}")

    def number(self, place, wanted, found, tolerance=None):
        """Compares numbers. None and NaN are missing values; both sides may be infinite."""
        self.compared += 1
        wanted, found = (math.nan if value is None else float(value) for value in (wanted, found))
        if math.isnan(wanted) and math.isnan(found) or wanted == found:
            return
        if not abs(wanted - found) <= (tolerance or self.tolerance) * max(abs(wanted), abs(found)) + 1e-14:
            self.add(place, wanted, found)

    def value(self, place, wanted, found):
        """Compares values of the report's JSON; objects and lists member by member."""
        if isinstance(wanted, dict) and isinstance(found, dict):
            for key in sorted((wanted.keys() | found.keys()) - WORDS):
                if key not in wanted or key not in found:
                    absent = [side.get(key) for side in (wanted, found)]
                    if absent != [None, None] and not self.all_missing(wanted.get(key)):
                        self.add(f"{place}/{key}", *absent)
                    continue
                self.value(f"{place}/{key}", wanted[key], found[key])
        elif isinstance(wanted, list) and isinstance(found, list):
            if len(wanted) != len(found):
                self.add(f"{place} (entries)", len(wanted), len(found))
            for index, pair in enumerate(zip(wanted, found)):
                self.value(f"{place}/{index}", *pair)
        elif isinstance(wanted, (str, bool)) or isinstance(found, bool):
            if wanted != found:
                self.add(place, wanted, found)
        elif isinstance(found, (dict, list)) or isinstance(wanted, (dict, list)):
            self.add(place, wanted, found)
        else:
            self.number(place, wanted, math.inf if found == "never" else found)

    @staticmethod
    def all_missing(wanted):
        """Whether the report leaves it out: a track without values, or bands of a track that has none."""
        if isinstance(wanted, dict):
            return all(Differences.all_missing(value) for value in wanted.values())
        return isinstance(wanted, list) and all(value is None or math.isnan(value) for value in wanted)


def by_place(groups):
    return {(group["scene"], group["noise_level"], group["protocol"]): group for group in groups}


def report_json(differences, groups, document, folder):
    entry = next((one for one in document["results"] if one["folder"] == str(folder)), document["results"][0])
    wanted, found = by_place(groups), by_place(entry["groups"])
    if wanted.keys() != found.keys():
        differences.add("groups", list(wanted), list(found))
        return
    for place, group in wanted.items():
        curves = [{**curve, "tracks": {track: {what: values for what, values in members.items() if what not in ONLY_IN_TABLES}
                                       for track, members in curve["tracks"].items()}} for curve in group["curves"]]
        differences.value("report.json: " + ", ".join(place), {**group, "curves": curves}, found[place])


def aggregate_json(differences, aggregates, document, folder):
    entry = next((one for one in document["results"] if one["folder"] == str(folder)), document["results"][0])
    differences.value("report.json: aggregate", aggregates, entry.get("aggregate", []))


AGGREGATE = [name + end for name in ("iqm", "median", "gap", "area") for end in ("", "_lo95", "_hi95")]


def aggregate_csv(differences, aggregates, file):
    table = pd.read_csv(file, float_precision="round_trip", keep_default_na=False, na_values=dict.fromkeys(AGGREGATE, ""))
    rows = {(row.protocol, row.algorithm, row.training): row for row in table.itertuples()}
    for entry in aggregates:
        best = entry["methods"][0]["method"] if entry["methods"] else ""
        against = {pair["b"]: pair for pair in entry["pairs"] if pair["a"] == best}
        for method in entry["methods"]:
            for training, numbers in [("", method), *((one["training"], one) for one in method.get("trainings", []))]:
                name = f"aggregate.csv: {entry['protocol']}, {method['method']} {training}"
                row = rows.pop((entry["protocol"], method["method"], training), None)
                if row is None:
                    differences.add(name, "a row", None)
                    continue
                wanted = {**{column: numbers.get(column) for column in ("n", *AGGREGATE)}, "failed": numbers["failed"],
                          "strata": method["strata"], "steps": method["steps"]}
                if not training:
                    spread = method.get("spread", {})
                    wanted.update({f"iqm_{what}_training": spread.get(what) for what in ("lowest", "highest")},
                                  iqm_sd_of_trainings=spread.get("sd"))
                    pair = against.get(method["method"], {})
                    wanted.update(best_improves=pair.get("improvement"), best_improves_lo95=pair.get("lo95"),
                                  best_improves_hi95=pair.get("hi95"))
                for column, value in wanted.items():
                    found = getattr(row, column)
                    differences.number(f"{name}, {column}", value, None if found == "" else found)
    for place in rows:
        differences.add(f"aggregate.csv: {place}", "no such row", "a row")


def matrix_csv(differences, groups, file):
    table = pd.read_csv(file, float_precision="round_trip", dtype={"noise_level": str})
    keys = ["scene", "noise_level", "protocol", "algorithm", "rule", "images"]
    rows = {tuple(getattr(row, key) for key in keys): row for row in table.itertuples()}
    for place, group in by_place(groups).items():
        start = group.get("start_excess")
        for row in group["rows"]:
            for after in row.get("excess", []):
                for rule in recompute.RULES:
                    name = f"matrix.csv: {', '.join(place)}, {row['method']}, {rule}, {after['images']}"
                    found = rows.pop((*place, row["method"], rule, after["images"]), None)
                    if found is None:
                        differences.add(name, "a row", None)
                        continue
                    of = after[rule]
                    wanted = {f"excess_{what}": of.get(what) for what in ("median", "q25", "q75", "lo95", "hi95")}
                    wanted.update(n=of["n"], trials=row["trials"], failed=row["failed"], start_excess_median=start,
                                  last=after is row["excess"][-1],
                                  share_of_start=of["median"] / start if of["n"] and start else None)
                    for column, value in wanted.items():
                        differences.number(f"{name}, {column}", value, getattr(found, column))
    for place in rows:
        differences.add(f"matrix.csv: {place}", "no such row", "a row")


RANKING = {"in_spec": ("yield", "in"), "in_spec_of": ("yield", "n"), "yield": ("yield", "share"),
           "yield_lo95": ("yield", "lo95"), "yield_hi95": ("yield", "hi95"), "yield_uncured": ("yield", "uncured", "share"),
           "yield_uncured_lo95": ("yield", "uncured", "lo95"), "yield_uncured_hi95": ("yield", "uncured", "hi95"),
           "steps_to_spec": ("to_spec", "steps"), "steps_to_spec_lo95": ("to_spec", "lo95"),
           "steps_to_spec_hi95": ("to_spec", "hi95"), "expected_steps_to_spec": ("to_spec", "expected"),
           "seconds_to_spec": ("to_spec", "seconds"), "machine_seconds_median": ("machine_seconds",),
           "algorithm_ms_per_step_median": ("algorithm_ms_per_step",), "mtf_centre_median": ("mtf", "centre", "median"),
           "mtf_corner_median": ("mtf", "corner", "median"), "trials": ("trials",), "failed": ("failed",), "step": ("step",)}


def ranking_csv(differences, groups, text):
    table = pd.read_csv(io.StringIO(text), float_precision="round_trip", dtype={"noise_level": str})
    columns = [column for column in table.columns if re.match("(recommended|commanded|measured)_", column)]
    paths = {**RANKING, **{column: tuple(column.split("_", 1)) for column in columns}}
    for rule in recompute.RULES:
        paths.update({f"{rule}_{what}": ("rules", rule, what) for what in ("median", "lo95", "hi95")})
        ends = (("", "share"), ("_lo95", "lo95"), ("_hi95", "hi95"))
        paths.update({f"{rule}_yield{end}": ("rules", rule, "yield", what) for end, what in ends})
        paths[f"{rule}_steps_to_spec"] = ("rules", rule, "steps")
    table = table.set_index(["scene", "noise_level", "protocol", "algorithm"])
    for place, group in by_place(groups).items():
        for rank, row in enumerate(group["rows"], 1):
            name = "ranking.csv: " + ", ".join([*place, row["method"]])
            fields = table.loc[(*place, row["method"])]
            has_result = row.get("measured", row["recommended"])["n"] > 0
            differences.number(f"{name}, rank", rank if has_result else None, fields["rank"])
            for column, path in paths.items():
                value = row
                for key in path:
                    value = (value or {}).get(key)
                differences.number(f"{name}, {column}", value, fields[column])
            for column in ("class", "merit"):
                if fields[column] != row[column]:
                    differences.add(f"{name}, {column}", row[column], fields[column])
            for column, value in (("start_median", group["start"]), ("spec_rmse", group.get("spec_rmse")),
                                  ("own_optimum_median", group.get("floor", {}).get("own_optimum")),
                                  *(("spec_mtf_" + what, group.get("spec_mtf", {}).get(what))
                                    for what in ("lp_per_mm", "centre", "corner"))):
                differences.number(f"{name}, {column}", value, fields[column])


def curves_csv(differences, groups, file):
    table = pd.read_csv(file, float_precision="round_trip", dtype={"noise_level": str})
    rows = dict(list(table.groupby(["scene", "noise_level", "protocol", "algorithm"], sort=False)))
    for place, group in by_place(groups).items():
        for curve in group["curves"]:
            name = "curves.csv: " + ", ".join([*place, curve["method"]])
            found = rows.pop((*place, curve["method"]), None)
            if found is None or list(found.step) != list(range(len(curve["machine_seconds"]))):
                differences.add(f"{name}, steps", len(curve["machine_seconds"]), None if found is None else list(found.step))
                continue
            wanted = {f"{track}_{what}": values for track, members in curve["tracks"].items()
                      for what, values in members.items() if what != "n"}
            wanted.update(machine_seconds_median=curve["machine_seconds"], n=[curve["trials"]] * len(found))
            for column, values in wanted.items():
                for step, value, there in zip(found.step, values, found[column]):
                    differences.number(f"{name}, step {step}, {column}", value, there)
    for place in rows:
        differences.add("curves.csv: " + ", ".join(place), "no such curve", "a curve")


def curves_json(differences, groups, file):
    found = {(c["scene"], c["noise_level"], c["protocol"], c["algorithm"]): c for c in json.loads(file.read_text())["curves"]}
    for place, group in by_place(groups).items():
        for curve in group["curves"]:
            there = found[(*place, curve["method"])]
            name = "curves.json: " + ", ".join([*place, curve["method"]])
            differences.value(f"{name}/machine_seconds", list(curve["machine_seconds"]), there["machine_seconds"])
            for track, of in curve["tracks"].items():
                for what, values in of.items():
                    differences.value(f"{name}/{track}/{what}", list(values), there["tracks"][track][what])


def instances_csv(differences, folder, file):
    table = pd.read_csv(file, float_precision="round_trip", dtype={"trial": str}).set_index("trial")
    trials = recompute.read(folder)[1].set_index("trial")
    if list(table.index) != list(trials.index):
        differences.add("instances.csv, trials", len(trials), len(table))
        return
    for trial, row in trials.iterrows():
        counts = row.made and row.end in recompute.ENDED_WELL
        for column, values in ((track, row[track]) for track in recompute.TRACKS):
            differences.number(f"instances.csv: {trial}, {column}", values[-1] if counts else None, table.loc[trial, column])
        for column in recompute.MTF:
            if column in table.columns:
                value = row[column] if counts or column.startswith("own_optimum") else None
                differences.number(f"instances.csv: {trial}, {column}", value, table.loc[trial, column])


def page(differences, groups, file):
    """The data of the page's script: three digits, as the page shows them, and intervals at their steps only."""
    text = re.search(r'<script type="application/json" id="report-data">(.*?)</script>', file.read_text(), re.DOTALL).group(1)
    data = json.loads(text)
    tolerance = 0.51e-2
    for wanted, found in zip(groups, data["groups"]):
        if "spec_rmse" in wanted:
            differences.number("report.html: spec", wanted["spec_rmse"], found.get("spec"))
        for curve, there in zip(wanted["curves"], found["curves"]):
            name = f"report.html: {found['label']}, {curve['method']}"
            if curve["method"] != there["method"]:
                differences.add(name, curve["method"], there["method"])
            for track, found_of in there["tracks"].items():
                of = there["tracks"][found_of] if isinstance(found_of, str) else found_of  # a name: equal to that track
                steps = there.get("steps") or range(there["first_step"], there["first_step"] + len(of["median"]))
                for what, values in of.items():
                    at = [steps[place] for place in there["at"]] if what in ("lo95", "hi95") else steps
                    if len(at) != len(values):
                        differences.add(f"{name}, {track} {what} (entries)", len(at), len(values))
                    for step, value in zip(at, values):
                        expected = curve["tracks"][track][what][step]
                        differences.number(f"{name}, step {step}, {track} {what}", expected, value, tolerance)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=pathlib.Path)
    for name in ("json", "csv", "curves", "page"):
        options.add_argument(f"--{name}", type=pathlib.Path)
    options.add_argument("--rule", choices=list(recompute.RULES), help="recommendation rule of report, tables and page")
    chosen = options.parse_args()
    folder = chosen.folder
    by = ["--rule", chosen.rule] if chosen.rule else []
    document = chosen.json.read_text() if chosen.json else program.call("report", folder, "--format", "json", *by)
    ranking = chosen.csv.read_text() if chosen.csv else program.call("report", folder, "--format", "csv", *by)
    groups = recompute.groups(folder, chosen.rule)
    aggregates = recompute.aggregates(folder, chosen.rule)
    differences = Differences()
    report_json(differences, groups, json.loads(document), folder)
    aggregate_json(differences, aggregates, json.loads(document), folder)
    aggregate_csv(differences, aggregates, folder / "aggregate.csv")
    ranking_csv(differences, groups, ranking)
    curves_csv(differences, groups, chosen.curves or folder / "curves.csv")
    curves_json(differences, groups, folder / "curves.json")
    instances_csv(differences, folder, folder / "instances.csv")
    matrix_csv(differences, groups, folder / "matrix.csv")
    page(differences, groups, chosen.page or folder / "report.html")
    for line in differences.found[:50]:
        print(line)
    print(f"{differences.compared} numbers compared, {len(differences.found)} differ")
    return 1 if differences.found else 0


if __name__ == "__main__":
    sys.exit(main())
