"""Tables of pages, made from files by scripts: what stands between `<!-- table NAME -->` and `<!-- end -->`.

A script prints its tables, with --write it puts them into its pages, and with --check it ends with 1 if one is stale.
"""

import re

BLOCK = re.compile(r"<!-- table (?P<name>[^>]+?) -->.*?<!-- end -->", re.S)


def filled(page, tables):
    """The text of a page, a path, with its tables.

    Args:
        page: Path.
        tables: {name: text}

    Raises:
        SystemExit: The page has a table that the script does not make.
    """
    def fill(match):
        if match["name"] not in tables:
            raise SystemExit(f"{page}: unknown table '{match['name']}'; tables: {', '.join(tables)}")
        return f"<!-- table {match['name']} -->\n\n{tables[match['name']].strip()}\n\n<!-- end -->"

    return BLOCK.sub(fill, page.read_text(encoding="utf-8"))


def main(arguments, usage, pages, tables):
    """Prints, writes or checks the tables; returns the exit code.

    Args:
        arguments: [], ["--write"] or ["--check"].
        usage: Printed for others.
        pages: Paths.
        tables: {name: text}
    """
    if not arguments:
        print("\n\n".join(f"{name}\n\n{text.strip()}" for name, text in tables.items()))
        return 0
    if arguments not in (["--write"], ["--check"]):
        print(usage)
        return 2
    made = {page: filled(page, tables) for page in pages}
    stale = [page for page, text in made.items() if text != page.read_text(encoding="utf-8")]
    for page in stale:
        if arguments == ["--write"]:
            page.write_text(made[page], encoding="utf-8")
        else:
            print(f"{page}: a table is stale; the script beside its files updates it with --write")
    return int(arguments == ["--check"] and bool(stale))
