"""The tables and the figure of README.md, from trials.csv beside this script.

    python3 reports/domains/table.py --read RESULTS...   makes trials.csv of the results folders of suites/domains
    python3 reports/domains/table.py                     prints the tables
    python3 reports/domains/table.py --write             puts them into README.md, and writes profile.svg
    python3 reports/domains/table.py --check             exit code 1 if a table of the page is stale

Standard library only; --read needs the package relign_bench, and the figure matplotlib.
"""

import csv
import math
import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import pages  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
TRIALS = HERE / "trials.csv"
COLUMNS = ("problem", "method", "instance", "failed", "possible", "outside",
           "captures", "seconds", "score", "own_optimum", "limit", "budget")
# In the order of the page; names of the suites without "domains-".
PROBLEMS = {"lens": "lens", "fibre": "fibre", "fibre-both-ends": "fibre, both ends", "beam": "beam", "telescope": "telescope",
            "interferometer": "interferometer"}
METHODS = ("procedure", "policy", "nlopt-bobyqa", "cma-es", "bo-gp", "bo-turbo", "coordinate-walk", "random")
HALF = 0.5
BOX = 0.5  # half of its width, in travels, around the start: where methods that observe the box search under `blind`
LARGEST_RATIO = 32  # of the figure
Z = 1.959964  # 95 %


# trials.csv ------------------------------------------------------------------------------------------------------------


def trial_row(problem, score, limit, closing, steps):
    """What a trial says of its problem: captures and machine seconds until a recommended pose is in specification."""
    shown = [None if "recommended_mse" not in step else float(score.shown(step["recommended_mse"])) for step in steps]
    reached = next((place for place, value in enumerate(shown) if value is not None and value <= limit), None)
    own = closing.get("own_optimum_mse")
    best = None if own is None else float(score.shown(own))
    return {"problem": problem, "method": closing["algorithm"], "instance": closing["instance"],
            "failed": int(closing["end"] not in ("budget_spent", "finished")),
            "possible": int(best is None or best <= limit),
            "outside": int(outside(closing, steps)),
            "captures": "" if reached is None else reached + 1,
            "seconds": "" if reached is None else f"{steps[reached]['recommended_seconds']:.3f}",
            "score": "" if not shown or shown[-1] is None else f"{shown[-1]:.6g}",
            "own_optimum": "" if best is None else f"{best:.6g}", "limit": f"{limit:g}", "budget": closing["budget"]}


def outside(closing, steps):
    """Whether the instance's optimum is outside the box around the start."""
    pose = closing.get("own_optimum_pose")
    return pose is not None and any(abs(best - start) > BOX for best, start in zip(pose, steps[0]["true_pose"]))


def read_results(folders):
    from relign_bench._score import score_of
    from relign_bench.results import read_manifest, read_trials
    rows = {}
    for folder in folders:
        manifest = read_manifest(folder)
        problem = manifest["suite_name"].removeprefix("domains-")
        if problem not in PROBLEMS:
            raise SystemExit(f"'{folder}' has the suite '{manifest['suite_name']}'; expected domains- and one of "
                             f"{', '.join(PROBLEMS)}")
        scene = manifest["scenes"][0]
        score = score_of(scene)
        spec = manifest.get("spec") or scene["spec"]
        limit = spec["rmse" if score.squared else "score"]
        for row in (trial_row(problem, score, limit, closing, steps) for closing, steps in read_trials(folder, checked=True)):
            # A later folder may repeat a method, which then shows that its instances are the same.
            if rows.setdefault((problem, row["method"], row["instance"]), row) != row:
                raise SystemExit(f"'{folder}' and an earlier folder differ in {row['method']} on instance {row['instance']}")
    places = list(PROBLEMS)
    rows = sorted(rows.values(), key=lambda row: (places.index(row["problem"]), row["method"], row["instance"]))
    with TRIALS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read_trials_csv():
    """{problem: {method: {instance: row}}}, empty before the first run."""
    found = {}
    if not TRIALS.exists():
        return found
    with TRIALS.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["problem"], {}).setdefault(row["method"], {})[int(row["instance"])] = row
    return found


# Statistics ------------------------------------------------------------------------------------------------------------


def possible(methods):
    """Instances whose optimum is in specification, or that any method brought there: the search for optima is local."""
    rows = [row for of_method in methods.values() for row in of_method.values()]
    return sorted({int(row["instance"]) for row in rows if row["possible"] == "1" or solved(row)})


def solved(row):
    """Whether the pose that the method recommends at the end is in specification."""
    return row["failed"] == "0" and row["score"] != "" and float(row["score"]) <= float(row["limit"])


def captures(row):
    """Until a recommended pose is in specification; infinite without one, or where the method leaves it again for good."""
    return float(row["captures"]) if solved(row) else math.inf


def wilson(count, total):
    """95 % interval of a share (Wilson 1927)."""
    share, z2 = count / total, Z * Z / total
    middle = (share + z2 / 2) / (1 + z2)
    half = Z * math.sqrt(share * (1 - share) / total + z2 / 4 / total) / (1 + z2)
    return middle - half, middle + half


def sign_test(wins, losses):
    """Two-sided p value."""
    n = wins + losses
    return min(1.0, 2 * sum(math.comb(n, k) for k in range(min(wins, losses) + 1)) / 2**n) if n else 1.0


def solvers(methods, instances):
    """{method: instances brought into specification}"""
    return {name: sum(solved(rows[i]) for i in instances) for name, rows in methods.items() if name in METHODS}


# Tables ----------------------------------------------------------------------------------------------------------------


def markdown(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def matrix(found, cell):
    """A row for each method, a column for each problem."""
    problems = [problem for problem in PROBLEMS if problem in found]
    rows = []
    for method in METHODS:
        cells = [cell(found[problem], method) if method in found[problem] else "" for problem in problems]
        rows.append([f"`{method}`", *cells])
    return markdown(["method", *(PROBLEMS[problem] for problem in problems)], rows)


def solved_cell(methods, method):
    instances = possible(methods)
    count = solvers(methods, instances)[method]
    low, high = wilson(count, len(instances))
    return f"{count} of {len(instances)} ({100 * low:.0f} to {100 * high:.0f} %)"


def median_cell(methods, method, column, digits):
    rows = [methods[method][i] for i in possible(methods)]
    middle = statistics.median_high(float(row[column]) if solved(row) else math.inf for row in rows)
    return f"{middle:.{digits}f}" if middle < math.inf else "-"


def boxes(found):
    """Of all instances, those whose optimum is outside the box, and solved instances inside and outside."""
    rows = []
    for problem, methods in found.items():
        instances = possible(methods)
        far = {i for i in instances if methods["random"][i]["outside"] == "1"}
        cells = []
        for method in METHODS:
            rows_of = methods.get(method)
            parts = (set(instances) - far, far) if rows_of else ()
            cells.append(" / ".join(str(sum(solved(rows_of[i]) for i in part)) for part in parts))
        rows.append([PROBLEMS[problem], f"{len(instances) - len(far)} / {len(far)}", *cells])
    return markdown(["problem", "instances inside / outside", *(f"`{method}`" for method in METHODS)], rows)


def contrast(found):
    """The policy against each other method, by captures until in specification, on the same instances."""
    rows = []
    for problem, methods in found.items():
        if "policy" not in methods:
            continue
        for method in METHODS:
            if method in ("policy", "random") or method not in methods:
                continue
            pairs = [(captures(methods["policy"][i]), captures(methods[method][i])) for i in possible(methods)]
            wins, losses = sum(a < b for a, b in pairs), sum(a > b for a, b in pairs)
            rows.append([PROBLEMS[problem], f"`{method}`", str(wins), str(losses), str(len(pairs) - wins - losses),
                         f"{sign_test(wins, losses):.2g}"])
    return markdown(["problem", "the policy against", "fewer captures", "more", "equal, or both missed", "p, sign test"], rows)


def verdicts(found):
    """By the rules of the plan."""
    rows = []
    for method in METHODS:
        shares = {problem: solvers(methods, possible(methods))[method] / len(possible(methods))
                  for problem, methods in found.items() if method in methods}
        good = [PROBLEMS[problem] for problem, share in shares.items() if share >= HALF]
        everywhere = len(good) == len(found) and len(shares) == len(found)
        rows.append([f"`{method}`", f"{len(good)} of {len(shares)}", "yes" if everywhere else "no",
                     ", ".join(good) if good else "none"])
    return markdown(["method", "problems with at least half of the instances in specification", "good everywhere", "which"], rows)


def profile_values(found, method):
    """Ratios of captures to the fewest that any method needed on the same instance: {problem: [ratio, ...]}."""
    ratios = {}
    for problem, methods in found.items():
        if method not in methods:
            continue
        for i in possible(methods):
            fewest = min(captures(rows[i]) for name, rows in methods.items() if name in METHODS)
            if fewest < math.inf:
                ratios.setdefault(problem, []).append(captures(methods[method][i]) / fewest)
    return ratios


def profile_at(found, method, ratio):
    """The mean over all problems of the share of instances within this ratio (Dolan and More 2002, problems weighted equally)."""
    of = profile_values(found, method)
    return sum(sum(value <= ratio for value in values) / len(values) for values in of.values()) / len(found)


def profile_table(found):
    ratios = (1, 2, 4, 8, LARGEST_RATIO)
    rows = [[f"`{method}`", *(f"{profile_at(found, method, ratio):.2f}" for ratio in ratios)] for method in METHODS]
    return markdown(["method", *(f"within {ratio} x" if ratio > 1 else "the fewest" for ratio in ratios)], rows)


TABLES = {
    "solved": lambda found: matrix(found, solved_cell),
    "captures": lambda found: matrix(found, lambda methods, method: median_cell(methods, method, "captures", 0)),
    "seconds": lambda found: matrix(found, lambda methods, method: median_cell(methods, method, "seconds", 1)),
    "boxes": boxes,
    "verdicts": verdicts,
    "policy": contrast,
    "profile": profile_table,
}


def figure(found):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "relign"  # equal files from equal values
    from matplotlib import pyplot
    picture, axes = pyplot.subplots(figsize=(8, 4), layout="constrained")
    ratios = [2 ** (k / 16) for k in range(16 * 5 + 1)]
    colours = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#777777", "#bbbbbb")  # Okabe and Ito
    for method, colour in zip(METHODS, colours):
        axes.step(ratios, [profile_at(found, method, ratio) for ratio in ratios], where="post", label=method, color=colour)
    axes.set(xscale="log", xlim=(1, LARGEST_RATIO), ylim=(0, 1), ylabel="share of instances in specification",
             xlabel="captures, against the fewest of any method on the instance")
    axes.set_xticks((1, 2, 4, 8, 16, 32), ("1", "2", "4", "8", "16", "32"))
    axes.minorticks_off()
    picture.legend(loc="outside right upper", fontsize="small")
    axes.grid(alpha=0.3)
    picture.savefig(HERE / "profile.svg", metadata={"Date": None})


def main(arguments):
    if arguments[:1] == ["--read"]:
        read_results(arguments[1:])
        return 0
    found = read_trials_csv()
    if arguments == ["--write"]:
        figure(found)
    return pages.main(arguments, __doc__, [HERE / "README.md"],
                      {name: make(found) for name, make in TABLES.items() if found})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
