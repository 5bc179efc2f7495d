"""Data of the technical report in docs/paper, and the report itself, from the files beside this script.

    python3 reports/paper/report.py --write         writes docs/paper/data.json
    python3 reports/paper/report.py --check         exit code 1 if it is stale
    python3 reports/paper/report.py -o report.pdf   writes it, and typesets the report: a PDF, or PNG pages for 'page-{p}.png'

The tables are those of tables.py; values are medians, ratios and counts from the results files, settings of the suite and
the scene, and figures whose home is a page, found there by their text. Standard library only; -o needs the package typst.
"""

import datetime
import json
import re
import sys

import report_values
import tables as study_tables
from cells import LEVELS, NO_VALUE, RULES

TREE = study_tables.TREE
REPORT = TREE / "docs" / "paper"
SOURCE, DATA = REPORT / "report.typ", REPORT / "data.json"
USED = re.compile(r'\b(v|checked)\("([^"]+)"\)')
# Columns and rows that the report shows of the pages' tables, by their heads and first cells.
TABLES = ("claims", "methods", "authors", "improvement of trainings")
LEFT_OUT = "transfer-gp"  # contrasts with it are on the page
DOMAIN_ROWS, DOMAIN_METHODS = 5, ("sensitivity", "imitation", "imitation-randomised", "imitation-ppo", "nlopt-bobyqa", "bo-gp")


def markup(text):
    """A cell of a Markdown table in Typst's markup: links as their text, bold, code, signs, ranges in parentheses."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", "–" if text == NO_VALUE else text)
    text = re.sub(r"\(([\d.]+) to ([\d.]+)\)", r"(\1–\2)", text)
    parts = re.split(r"(`[^`]*`)", re.sub(r"^(\d+)\.(?= )", r"\1\\.", text))
    plain = {"**": "*", " x ": " × "}
    return "".join(part if part.startswith("`") else
                   re.sub(r"\*\*| x |[#$@<>_~]", lambda found: plain.get(found[0], f"\\{found[0]}"), part) for part in parts)


def grid(text):
    """Head and rows of a Markdown table."""
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()]
    return {"head": lines[0], "rows": lines[2:]}


def by_class(table):
    """The same table without its first column, what methods observe, which becomes a heading of the class."""
    rows, last = [], None
    for observes, *cells in table["rows"]:
        if observes != last:
            rows.append([f"**{observes}**", *[""] * (len(cells) - 1)])
            last = observes
        rows.append(cells)
    return {"head": table["head"][1:], "rows": rows}


def final(table):
    """The page's table of final errors by class, with a column for each rule, without times."""
    table = {"head": ["", "method", *RULES * len(LEVELS)],
             "rows": [[*row[:2], *(part for cell in row[2:-1] for part in cell.split(" / "))] for row in table["rows"]]}
    return by_class(table)


def domains(table):
    columns = [0, *(table["head"].index(f"`{method}`") for method in DOMAIN_METHODS)]
    names = [table["head"][column].replace("imitation-randomised", "randomised") for column in columns]
    return {"head": names, "rows": [[row[column] for column in columns] for row in table["rows"][:DOMAIN_ROWS]]}


def tables(made):
    found = {name: grid(made[name]) for name in TABLES}
    found["claims"]["head"][-2:] = ["n", "runs"]
    found["authors"]["rows"] = [row for row in found["authors"]["rows"] if LEFT_OUT not in row[0]]
    found["methods"] = by_class(found["methods"])
    found["final"], found["domains"] = final(grid(made["final paper"])), domains(grid(made["domains"]))
    return {name: {"head": [markup(cell) for cell in table["head"]],
                   "rows": [[markup(cell) for cell in row] for row in table["rows"]]} for name, table in found.items()}


def made():
    """The data of the report: its tables, and the values that its text uses.

    Raises:
        SystemExit: The text uses a key that no file has.
    """
    known = report_values.values()
    used = set()
    for function, key in USED.findall(SOURCE.read_text()):
        used |= {key} if function == "v" else {f"validation.{key}.{column}" for column in ("allowed", "found")}
    if unknown := sorted(used - known.keys()):
        raise SystemExit(f"{SOURCE.name}: unknown values {', '.join(unknown)}")
    return {"levels": LEVELS, "values": {key: known[key] for key in sorted(used)}, "tables": tables(study_tables.tables())}


def text_of(data):
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def typeset(output):
    """Typeset the report with the fonts of the package alone, so that every machine has the same pages.

    Raises:
        SystemExit: The package typst is missing, or the source has errors or warnings.
    """
    try:
        import typst
    except ModuleNotFoundError:
        raise SystemExit("-o needs the Python package typst; install it with 'pip install typst'") from None
    form = "png" if output.endswith(".png") else "pdf"
    compiler = typst.Compiler(SOURCE, root=REPORT.parent, ignore_system_fonts=True)
    date = datetime.datetime(2026, 11, 28, tzinfo=datetime.timezone.utc)  # in the file's metadata, so that its bytes repeat
    pages, warnings = compiler.compile_with_warnings(output=output, format=form, ppi=110.0, timestamp=date)
    if warnings:
        raise SystemExit("\n".join(f"{SOURCE.name}: {warning}" for warning in warnings))
    return pages


def main(arguments):
    if arguments in (["--write"], ["--check"]) or len(arguments) == 2 and arguments[0] == "-o":
        text = text_of(made())
        if arguments == ["--check"]:
            if DATA.read_text() == text:
                return 0
            print(f"{DATA}: differs from the results files; python3 reports/paper/report.py --write updates it")
            return 1
        DATA.write_text(text)
        if arguments[0] == "-o":
            typeset(arguments[1])
        return 0
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
