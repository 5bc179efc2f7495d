"""The tables of README.md, from instances.csv and the files of focus.py and add_class.py beside this script.

    python3 reports/camera_module/table.py           prints them
    python3 reports/camera_module/table.py --write   puts them into README.md
    python3 reports/camera_module/table.py --check   exit code 1 if a table of the page is stale

Standard library only.
"""

import csv
import math
import pathlib
import random
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import pages  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
LIMITS = {"field_mtf_deficit": 0, "centre_px": 4, "pose_um": 20, "tilt_arcmin": 15}  # of suites/camera_module.json
CLOSE_UM, CLOSE_ARCMIN = 2, 2
BATCH = 12  # modules, of the third and fourth run (plan.py)
HEADER = (
    "| modules | method | in specification | within 2 µm | within 2′ | within both | position, µm | tilt, ′ | alignment, s |\n"
    "|---|---|---|---|---|---|---|---|---|\n"
)


def read(name):
    with (HERE / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def value(row, column):
    """Of a trial's last recommendation; infinite where the trial has none."""
    return float(row[column]) if row[column] else float("inf")


def share(rows, condition):
    return f"{sum(map(condition, rows))} of {len(rows)}"


def share_95(rows, condition):
    """The share with its 95 % interval in per cent (Clopper and Pearson)."""
    hits, n = sum(map(condition, rows)), len(rows)

    def tail(p, least, most):
        return sum(math.comb(n, k) * p**k * (1 - p) ** (n - k) for k in range(least, most + 1))

    def bound(is_below):
        low, high = 0.0, 1.0
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if is_below(middle) else (low, middle)
        return 100 * low

    low = bound(lambda p: tail(p, hits, n) < 0.025) if hits else 0
    high = bound(lambda p: tail(p, 0, hits) > 0.025) if hits < n else 100
    return f"{hits} of {n} ({low:.0f} to {high:.0f} %)"


def is_in_spec(row):
    return all(value(row, column) <= limit for column, limit in LIMITS.items())


def line(level, method, rows, count=share):
    def middle(column, digits):
        return f"{statistics.median(value(row, column) for row in rows):.{digits}f}"

    def is_close(row):
        return value(row, "pose_um") <= CLOSE_UM and value(row, "tilt_arcmin") <= CLOSE_ARCMIN

    cells = [
        level, method,
        count(rows, is_in_spec),
        share(rows, lambda row: value(row, "pose_um") <= CLOSE_UM),
        share(rows, lambda row: value(row, "tilt_arcmin") <= CLOSE_ARCMIN),
        share(rows, is_close),
        middle("pose_um", 1), middle("tilt_arcmin", 1), middle("recommended_seconds", 1),
    ]
    return "| " + " | ".join(cells) + " |\n"


def table():
    rows = read("instances.csv")
    text = HEADER
    for level in dict.fromkeys(row["noise_level"] for row in rows):
        here = [row for row in rows if row["noise_level"] == level]
        for method in dict.fromkeys(row["algorithm"] for row in here):
            text += line(level, method, [row for row in here if row["algorithm"] == method])
        own = [row for row in here if row["algorithm"] == here[0]["algorithm"]]
        possible = share(own, lambda row: value(row, "criterion_optimum_deficit") <= 0)
        text += f"| {level} | *optimum* | {possible} | | | | | | |\n"
    return text


def floats(rows, column):
    return [float(row[column]) for row in rows if row[column]]


def spread(values, digits=1):
    """Median, and the range in brackets where there are several."""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    low, mid, high = (f"{value:.{digits}f}" for value in (min(values), statistics.median(values), max(values)))
    return f"{mid} ({low} to {high})"


def tilt_costs(row):
    return [float(value) for column, value in row.items() if column.startswith("cost_")]


def modules_table():
    rows = read("focus_modules.csv")
    classes = {name: [row for row in rows if row["class"] == name] for name in dict.fromkeys(row["class"] for row in rows)}

    def between(row, *axes):
        return sum((float(row[f"plane_{axis}"]) - float(row[f"best_{axis}"])) ** 2 for axis in axes) ** 0.5

    facts = {
        "modules": lambda group: str(len(group)),
        "best foci about their plane, µm rms": lambda group: spread(floats(group, "foci_rms_um")),
        "plane above the criterion's optimum, µm of z": lambda group: spread(
            [float(row["plane_z_um"]) - float(row["best_z_um"]) for row in group]),
        "plane against the criterion's optimum, ′": lambda group: spread(
            [between(row, "rx_arcmin", "ry_arcmin") for row in group]),
        "plane through centre and corners alone against that through all fields, ′": lambda group: spread(
            floats(group, "spec_fields_tilt_arcmin")),
        "tilt that costs 0.01 of MTF, steepest direction, ′": lambda group: spread([min(tilt_costs(row)) for row in group]),
        "the same, median direction, ′": lambda group: spread([statistics.median(tilt_costs(row)) for row in group]),
        "the same, flattest direction, ′ (13: more)": lambda group: spread([max(tilt_costs(row)) for row in group]),
    }  # fmt: skip
    text = "| | " + " | ".join(classes) + " |\n|---|" + "---|" * len(classes) + "\n"
    for fact, of in facts.items():
        text += f"| {fact} | " + " | ".join(of(group) for group in classes.values()) + " |\n"
    return text


def poses_table():
    text = (
        "| modules | method | glue | to the plane: z, µm | tilt, ′ | within 2 µm | within 2′ | both "
        "| to the criterion's optimum: tilt, ′ | costs less than 0.01 | loss of MTF |\n" + "|---" * 11 + "|\n"
    )
    rows = read("focus_trials.csv")
    for level, method in dict.fromkeys((row["noise_level"], row["algorithm"]) for row in rows):
        group = [row for row in rows if (row["noise_level"], row["algorithm"]) == (level, method)]
        for when in ("before", "after"):

            def near(row, limits, when=when):
                return all(abs(float(row[f"{when}_plane_{column}"])) <= limit for column, limit in limits.items())

            def middle(column, digits, when=when, group=group):
                return f"{statistics.median(floats(group, f'{when}_{column}')):.{digits}f}"

            cells = [
                level, method, when, middle("plane_z_um", 1), middle("plane_arcmin", 1),
                share(group, lambda row: near(row, {"um": CLOSE_UM})),
                share(group, lambda row: near(row, {"arcmin": CLOSE_ARCMIN})),
                share(group, lambda row: near(row, {"um": CLOSE_UM, "arcmin": CLOSE_ARCMIN})),
                middle("best_arcmin", 1),
                share(group, lambda row, when=when: float(row[f"{when}_best_arcmin"]) <= float(row[f"{when}_cost_arcmin"])),
                middle("loss", 3),
            ]  # fmt: skip
            text += "| " + " | ".join(cells) + " |\n"
    return text


def bounds_table():
    rows = read("focus_bounds.csv")
    names = dict.fromkeys(column.removesuffix("_z_um") for column in rows[0] if column.endswith("_z_um"))
    text = "| modules | from | n | z, µm (standard deviation) | tilt, ′ (95 % within) |\n|---|---|---|---|---|\n"
    for group in dict.fromkeys(row["class"] for row in rows):
        for name in names:
            known = [row for row in rows if row["class"] == group and row[f"{name}_z_um"]]
            source, number = name.split("_")
            images = number.replace("-spread", " images, spread over 30 µm") if "-" in number[1:] else f"{number} images"
            words = f"MTF of {images}" if source == "mtf" else f"pixels of one image at z {number} µm"
            cells = [group, words, str(len(known))]
            cells += [spread(floats(known, f"{name}_{column}"), 2) for column in ("z_um", "r95_arcmin")]
            text += "| " + " | ".join(cells) + " |\n"
    return text


def classes_of(run):
    """(name, rows by method) of every class of the third or fourth run."""
    rows = read(f"{run}_instances.csv")
    for name in dict.fromkeys(row["class"] for row in rows):
        group = [row for row in rows if row["class"] == name]
        yield name.replace("_", ", "), {
            method: [row for row in group if row["algorithm"] == method]
            for method in dict.fromkeys(row["algorithm"] for row in group)
        }


def third_table():
    text = HEADER
    for name, methods in classes_of("third"):
        for method, rows in methods.items():
            text += line(name, method, rows, share_95)
        possible = share_95(next(iter(methods.values())), lambda row: value(row, "criterion_optimum_deficit") <= 0)
        text += f"| {name} | *optimum* | {possible} | | | | | | |\n"
    return text


def aiming_table():
    """Paired by module; the interval of the difference from 10,000 draws of whole batches."""
    text = "| modules | both in specification | only with aiming off | only without | difference of yields (95 %) |\n"
    text += "|---" * 5 + "|\n"
    for name, methods in classes_of("third"):
        usual, aimed = ({row["instance"]: is_in_spec(row) for row in methods[method]}
                        for method in ("field-focus with limits", "the same, aiming off"))  # fmt: skip
        gains, batches = [], {}
        for module in usual:
            gains.append(aimed[module] - usual[module])
            batches.setdefault(int(module) // BATCH, []).append(gains[-1])
        draw = random.Random(1)
        drawn = []
        for _ in range(10_000):
            some = [gain for batch in draw.choices(list(batches.values()), k=len(batches)) for gain in batch]
            drawn.append(100 * sum(some) / len(some))
        low, *_, high = statistics.quantiles(drawn, n=40)
        both = sum(usual[module] and aimed[module] for module in usual)
        text += (f"| {name} | {both} | {gains.count(1)} | {gains.count(-1)} | {100 * sum(gains) / len(gains):.1f} % "
                 f"({low:.1f} to {high:.1f}) |\n")  # fmt: skip
    return text


def plane_table(run, method):
    text = "| modules | z, µm | tilt, ′ | within 2 µm | within 2′ | both |\n" + "|---" * 6 + "|\n"
    for name, methods in classes_of(run):
        rows = methods[method]
        near = [
            share_95(rows, lambda row, limits=limits: all(value(row, column) <= limit for column, limit in limits))
            for limits in ([("plane_um", CLOSE_UM)], [("plane_arcmin", CLOSE_ARCMIN)],
                           [("plane_um", CLOSE_UM), ("plane_arcmin", CLOSE_ARCMIN)])
        ]  # fmt: skip
        middle = (f"{statistics.median(floats(rows, f'plane_{column}')):.1f}" for column in ("z_um", "arcmin"))
        text += "| " + " | ".join([name, *middle, *near]) + " |\n"
    return text


def errors_table():
    """Errors of field-focus-plane in the fourth run: means, and standard deviations in brackets."""
    text = "| modules | z, µm | tilt about x, ′ | tilt about y, ′ |\n" + "|---" * 4 + "|\n"
    for name, methods in classes_of("fourth"):
        columns = (floats(methods["field-focus-plane"], f"plane_{axis}") for axis in ("z_um", "rx_arcmin", "ry_arcmin"))
        cells = (f"{statistics.mean(column):.2f} ({statistics.stdev(column):.2f})" for column in columns)
        text += "| " + " | ".join([name, *cells]) + " |\n"
    return text


if __name__ == "__main__":
    made = {"yields": table(), "modules": modules_table(), "poses": poses_table(), "bounds": bounds_table(),
            "third": third_table(), "aiming": aiming_table(),
            "plane": plane_table("third", "field-focus to the plane"),
            "fourth": plane_table("fourth", "field-focus-plane"), "errors": errors_table()}  # fmt: skip
    sys.exit(pages.main(sys.argv[1:], __doc__, [HERE / "README.md"], made))
