"""The table of README.md, from instances.csv and costs.csv beside this script.

    python3 reports/camera_module/table.py           prints it
    python3 reports/camera_module/table.py --write   puts it into README.md
    python3 reports/camera_module/table.py --check   exit code 1 if the page's table is stale

Standard library only.
"""

import csv
import pathlib
import re
import statistics
import sys

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE / "README.md"
BLOCK = re.compile(r"(<!-- table -->\n).*?(<!-- end -->)", re.S)
LIMITS = {"field_mtf_deficit": 0, "centre_px": 4, "pose_um": 20, "tilt_arcmin": 15}  # of suites/camera_module.json
CLOSE_UM, CLOSE_ARCMIN = 2, 2
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


def line(level, method, rows):
    def middle(column, digits):
        return f"{statistics.median(value(row, column) for row in rows):.{digits}f}"

    def is_close(row):
        return value(row, "pose_um") <= CLOSE_UM and value(row, "tilt_arcmin") <= CLOSE_ARCMIN

    cells = [
        level, method,
        share(rows, lambda row: all(value(row, column) <= limit for column, limit in LIMITS.items())),
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
        text += f"| {level} | *own optimum* | {share(own, lambda row: value(row, 'criterion_optimum_deficit') <= 0)} | | | | | | |\n"
    return text


def main():
    text = table()
    if not {"--write", "--check"} & set(sys.argv):
        print(text, end="")
        return 0
    page = PAGE.read_text(encoding="utf-8")
    wanted = BLOCK.sub(lambda match: match[1] + text + match[2], page)
    if "--write" in sys.argv:
        PAGE.write_text(wanted, encoding="utf-8")
        return 0
    if wanted == page:
        return 0
    print("README.md: its table is stale; run table.py --write", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
