"""The table of README.md, from feed.json beside this script.

    python3 reports/leaderboard/table.py           prints it
    python3 reports/leaderboard/table.py --write   puts it into README.md
    python3 reports/leaderboard/table.py --check   exit code 1 if the page's table is stale

Standard library only.
"""

import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import pages  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
NO_VALUE = "-"


def band(value, scale=1, digits=3):
    if value is None or value["estimate"] is None:
        return NO_VALUE
    low, high = (f"{scale * value[end]:.{digits}f}" for end in ("lo95", "hi95"))
    return f"{scale * value['estimate']:.{digits}f} ({low}–{high})"


def number(value, digits=1):
    return NO_VALUE if value is None else f"{value:.{digits}f}"


def row(of_class, entry):
    name = f"{entry['method']} {entry['submission']['version']} (submitted)" if entry["submission"] else entry["method"]
    seconds = None if entry["machine_seconds"] is None else entry["machine_seconds"] + (entry["compute_seconds"] or 0)
    cells = [
        ", ".join(of_class["observes"]) if of_class["ranked"] else "oracle", str(entry["rank"] or NO_VALUE), name,
        band(entry["error"]), band(entry["beats_baseline"], 100, 0), f"{entry['failed']} of {entry['trials']}", number(entry["images"], 0),
        number(seconds), number(entry["training"]["hours"], 2) if entry["training"] else NO_VALUE,
    ]
    return "| " + " | ".join(cells) + " |"


def table(feed):
    lines = [
        f"| observes | rank | method | normalised error, IQM (95 %) | better than {feed['baseline']}, % | failed | captures | time, s "
        "| training, h |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [row(of_class, entry) for of_class in feed["rounds"][0]["classes"] for entry in of_class["methods"]]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    feed = json.loads((HERE / "feed.json").read_text(encoding="utf-8"))
    sys.exit(pages.main(sys.argv[1:], __doc__, [HERE / "README.md"], {"round": table(feed)}))
