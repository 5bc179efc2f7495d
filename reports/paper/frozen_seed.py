"""The suite of the replication study (replication.md), with the seed that follows from its frozen networks:

    python3 reports/paper/frozen_seed.py reports/paper/trainings/replication/core.template.json

writes core.json beside the template. The seed: the SHA-256 of every network that the template's `trainings` name, as 64
lower-case hexadecimal digits, sorted, equal ones once, each followed by a newline; the SHA-256 of that text; of its first 64
bits the upper 63, since a suite's seed is below 2^63. A template has no valid seed, so it cannot be run by mistake. A suite
that is already there is not replaced by one with another seed: its instances are known. Standard library only.
"""

import hashlib
import json
import pathlib
import sys

SUFFIX = ".template.json"


def networks(template):
    """The different networks that a template names, in the order of their paths."""
    suite = json.loads(template.read_text())
    return sorted({template.parent / name for entry in suite["algorithms"] if isinstance(entry, dict)
                   for name in entry.get("trainings", [])})


def seed_of(paths):
    """The seed that follows from the bytes of files."""
    digests = {hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}
    text = "".join(f"{digest}\n" for digest in sorted(digests))
    return int(hashlib.sha256(text.encode()).hexdigest()[:16], 16) >> 1


def write_suite(template):
    """Writes the suite of a template; returns its path and its seed."""
    if not template.name.endswith(SUFFIX):
        raise ValueError(f"'{template}' must end with '{SUFFIX}'")
    paths = networks(template)
    if not paths:
        raise ValueError(f"'{template}' names no trainings")
    missing = [str(path) for path in paths if not path.is_file()]
    if missing:
        raise ValueError(f"{len(missing)} of {len(paths)} networks are not trained yet, first '{missing[0]}'")
    seed, placeholder = seed_of(paths), json.loads(template.read_text())["seed"]
    if not isinstance(placeholder, str):
        raise ValueError(f"'{template}' has the seed {placeholder}; expected a text in its place")
    suite = template.with_name(template.name.removesuffix(SUFFIX) + ".json")
    if suite.is_file() and json.loads(suite.read_text())["seed"] != seed:
        raise ValueError(f"'{suite}' has been written from other networks, and its instances are known")
    suite.write_text(template.read_text().replace(json.dumps(placeholder), str(seed), 1))
    return suite, seed


def main(arguments):
    if len(arguments) != 1:
        print(f"usage: frozen_seed.py NAME{SUFFIX}", file=sys.stderr)
        return 2
    try:
        print(*write_suite(pathlib.Path(arguments[0])))
    except (ValueError, OSError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
