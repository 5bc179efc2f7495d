"""Values that the text of docs/paper uses, by key, for report.py. Standard library only.

Most come from the results files. A value whose home is a page of the documentation is read there, by the text around it.
"""

import json
import re

import tables as study_tables
from cells import COLUMNS, FLOOR, FLOOR_OF_PROGRAM, LEVELS, RULES, captures, number, read, rounded
from claims import Evidence
from specification import LIMITS

TREE = study_tables.TREE
OTHER_RATIO = 1.05  # the factor of the robustness table of docs/reproduction.md
MOVES = 10
MOST = 0.5  # of the bootstrap's seeds
# Values with a page as their home: page, and the text around the value.
QUOTED = {
    "scene.lens": ("plugins/scenes/lens_system/README.md", r"\| `relign_od` \| ([^|]*) \|"),
    "noise.tilt": ("plugins/noise_levels/rho/README.md", r"Tilt is ([\d.]+) N degrees"),
    "noise.shift": ("plugins/noise_levels/rho/README.md", r"x, y, z: (\S+) N mm"),
    "noise.levels": ("docs/study.md", r"N = (0, 0\.25, 0\.5); one draw"),
    "protocol.radius": ("docs/study.md", r"exceeds ([\d.]+) of\s+the travel"),
    "protocol.box": ("docs/reproduction.md", r"the box (\[[\d., ]+\])"),
    "protocol.move": ("docs/reproduction.md", r"moves of at most ([\d.]+) per step"),
    "start.paper": ("docs/study.md", r"At the start it is ([\d.]+);"),
    "percent": ("docs/study.md", r"with (95 %) intervals"),
    "capture.samples": ("plugins/scenes/lens_system/README.md", r"\(sampler `paper`\): (\d+) cosine-weighted"),
    "mitsuba.noise": ("tests/peers/README.md", r"Of this RMSE, ([\d.]+) is the reference's own noise"),
    "mitsuba.remaining": ("tests/peers/README.md", r"was\s+measured \([^)]*\); ([\d.]+) remains"),
    "speed.package": ("docs/validation.md", r"package's environment takes ([\d.]+ s);"),
    "speed.step": ("docs/validation.md", r"noise-free error\s+included, ([\d.]+ s) \("),
    "recipe.rate": ("docs/training.md", r"\| (\S+) at all levels;"),
    "recipe.entropy": ("docs/training.md", r"\| entropy weight \|[^|]*\|[^|]*\| (\S+);"),
    "recipe.steps": ("docs/training.md", r"\| steps \|[^|]*\|[^|]*\| (2 million) \|"),
    "target.fine": ("docs/reproduction.md", r"are within ([\d.]+) of the optimum after\s+four and\s+five captures"),
    "limits.instances": ("docs/training.md", r"fifty moves twice on (\d+) tuning instances"),
    "limits.moves": ("docs/training.md", r"move k scaled by (\d) / k"),
    "package.level": ("docs/reproduction.md", r"after 11 captures at N = ([\d.]+) with the package's offsets"),
    "package.imitation": ("docs/reproduction.md", r"`imitation` has a median error of ([\d.]+ \(20 instances\))"),
    "package.imitation-ppo": ("docs/reproduction.md", r"`imitation-ppo` of ([\d.]+ \(8\))"),
    "package.here": ("docs/reproduction.md", r"on `relign_od` both have\s+([\d.]+)"),
    "cost.study": ("docs/appendix_study.md", r"in (1 h 30 min of two cores)"),
    "cost.ppo200": ("docs/reproduction.md", r"PPO-200: ([\d.]+) hours of an H200"),
    "cost.ppo100": ("docs/reproduction.md", r"PPO-100: ([\d.]+ to [\d.]+) hours"),
    "cost.jobs": ("reports/paper/trainings/README.md", r"--jobs (\d+)"),
    "cost.size": ("reports/paper/trainings/README.md", r"--set size=(\d+)"),
    "cost.threads": ("reports/paper/trainings/README.md", r"--set seed=N --threads (\d)"),
    "cite.authors": ("CITATION.cff", r'- name: "([^"]+)"'),
}
# Rows of the tables of docs/validation.md by the beginning of their first cell: columns "allowed" and "found".
VALIDATION = {
    "corner": "corners of the chessboard", "corners": "the same, all 121 corners together", "radiometry": "uniform emitter",
    "mtf": "slanted-edge MTF on images", "rays": "30 rays", "shifted": "the same with all four elements turned",
    "reference": "noise-free image against the shipped reference", "six": "six images",
    "noise": "variance of the package's noise", "light": "total light", "ghosts": "noise-free image of `relign_od-package`",
}


SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def signs(text):
    """Plain text of a page as the report has it: 1e-4 as a power of ten, signs, degrees."""
    text = re.sub(r"(\d)e(-?\d+)", lambda power: f"{power[1]} × 10{power[2].translate(SUPERSCRIPT)}", text)
    return re.sub(r"^-(?=\d)", "−", text).replace(" +- ", " ± ").replace("`", "").replace(" deg", "°").replace(" x ", " × ")


def quoted():
    found = {}
    for key, (page, pattern) in QUOTED.items():
        match = re.search(pattern, (TREE / page).read_text())
        if not match:
            raise SystemExit(f"{page}: no text like '{pattern}', which has the value '{key}' of the report")
        found[key] = signs(match[1])
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in (TREE / "docs" / "validation.md").read_text().splitlines() if line.startswith("| ")]
    for key, start in VALIDATION.items():
        row = next((row for row in rows if row[0].startswith(start)), None)
        if row is None:
            raise SystemExit(f"docs/validation.md: no row that begins with '{start}'")
        found[f"validation.{key}.allowed"], found[f"validation.{key}.found"] = map(signs, row[1:3])
    return found


def settings():
    suite = json.loads((TREE / "suites" / "paper.json").read_text())
    scene = json.loads((TREE / "plugins/scenes/lens_system/relign_od/scene.json").read_text())
    instances = read("instances.csv")
    version = re.search(r"^version: (\S+)", (TREE / "CITATION.cff").read_text(), re.M)[1]
    return {
        "cite.version": f"version {version}",
        "suite.instances": str(suite["instances"]), "suite.steps": str(suite["steps"]), "suite.seed": str(suite["seed"]),
        "suite.captures": str(captures(suite["steps"])), "suite.ratio": f"{suite['analysis']['smallest_relevant_ratio']:g}",
        "tolerance.steps": str(next(one["steps"] for one in suite["algorithms"] if isinstance(one, dict) and "steps" in one)),
        "spec": str(scene["spec"]["rmse"]), "floor": FLOOR, "floor.program": FLOOR_OF_PROGRAM, "factor.other": str(OTHER_RATIO),
        "limit.2": f"{LIMITS[2]:g}", "scene.pixels": "{0} × {0}".format(scene["sensor"]["pixels"]),
        "scene.distance": f"{-scene['emitter']['z_mm']:.0f}", "scene.shift": f"{scene['travel']['shift_mm'][0]:g}",
        "scene.tilt": f"{scene['travel']['tilt_deg'][0]:g}",
        "count.methods": {20: "twenty"}.get(len(suite["algorithms"]), str(len(suite["algorithms"]))),
        "count.contrasts": str(len(suite["analysis"]["contrasts"])),
        "cost.trials": f"{len(instances):,}", "cost.steps": f"{sum(int(row['steps']) for row in instances):,}",
        "domains.instances": ", ".join(sorted({row["trials"] for row in read("../domain_gap/matrix.csv")
                                               if row["scene"].startswith("relign_od")})),
        **{f"domains.{name}": " and ".join(str(captures(step)) for step in study_tables.DOMAIN_METHODS[method])
           for name, method in (("early", "imitation"), ("late", "bo-gp"))},
    }


def ends(values, digits):
    values = [float(value) for value in values]
    return " to ".join(dict.fromkeys(rounded(one, digits) for one in (min(values), max(values))))


def listed(values):
    *first, last = values
    return f"{', '.join(first)} and {last}"


def medians(study):
    found = {}
    for (protocol, name, level), row in study.ranking.items():
        for rule in RULES:
            found[("" if protocol == "paper" else f"{protocol}.") + f"{rule}.{name}.{level}"] = rounded(
                number(row[f"{rule}_median"]))
        if protocol == "paper" and name == "home":
            found[f"optimum.{level}"] = rounded(number(row["own_optimum_median"]))
    for (name, level), value in study_tables.by_merit("paper").items():
        found[f"merit.{name}.{level}"] = rounded(value)
    return found | all_levels(found)


def all_levels(found):
    """The values of the three levels in one text, by the keys that end with a level."""
    stems = [key.removesuffix(f".{LEVELS[0]}") for key in found if key.endswith(f".{LEVELS[0]}")]
    stems = [stem for stem in stems if all(f"{stem}.{level}" in found for level in LEVELS)]
    return {f"{stem}.all": listed(found[f"{stem}.{level}"] for level in LEVELS) for stem in stems}


def ratios(evidence):
    found = {}
    for (first, second, rule, level), row in evidence.contrasts.items():
        found[f"ratio.{first}:{second}.{rule}.{level}"] = "{:.2f} ({:.2f} to {:.2f})".format(
            *(float(row[name]) for name in ("ratio", "lo95", "hi95")))
    floors = {row["floor"]: row for row in read("floors.csv")
              if (row["protocol"], row["noise_level"], row["first"], row["rule"]) == ("paper", "rho0", "sensitivity", "own")}
    for name, floor in (("low", FLOOR_OF_PROGRAM), ("high", FLOOR)):
        found[f"floors.sensitivity.{name}"] = f"{float(floors[floor]['ratio']):.2f}, {floors[floor]['verdict']}"
    ratio = json.loads((TREE / "suites" / "paper.json").read_text())["analysis"]["smallest_relevant_ratio"]
    bands = [evidence.contrasts["bo-rf", "random", rule, "rho0"] for rule in ("own", "best")]
    found["hull.bo-rf:random.rho0"] = (f"{min(float(row['lo95']) for row in bands):.2f} to "
                                       f"{max(float(row['hi95']) for row in bands):.2f}")
    found["miss.bogp"] = f"{float(evidence.contrasts['bo-gp', 'random', 'own', 'rho0.5']['hi95']) - 1 / ratio:.4f}"
    return found | all_levels(found)


def spans(evidence):
    """Lowest and highest of several levels or networks."""
    networks = {"ppo200": evidence.networks, "ppo100": [f"ppo-exact (seed-{seed})" for seed in range(3)]}
    found = {"count.networks": {6: "six"}[sum(map(len, networks.values()))]}
    for name, of_name in networks.items():
        for rule, column in COLUMNS.items():
            found[f"span.{name}.{rule}"] = ends(
                [evidence.curves[one, level][-1][f"{column}_median"] for one in of_name for level in LEVELS], 4)
    found["span.ppo200:bo-gp.own"] = ends([evidence.contrasts[one, "bo-gp", "own", level]["ratio"]
                                           for one in evidence.networks for level in LEVELS], 2)
    found["span.ppo200:bo-gp.authors"] = ends([evidence.authors[one, "bo-gp", COLUMNS["current"], level]["ratio"]
                                               for one in evidence.networks for level in LEVELS], 2)
    for key, names in (("ppo200", evidence.networks), ("imitation-ppo", ("imitation-ppo",))):
        found[f"span.{key}:bobyqa.own"] = ends([evidence.authors[one, "nlopt-bobyqa", COLUMNS["own"], level]["ratio"]
                                                for one in names for level in LEVELS], 2)
    assert all(row["verdict"] != "better" for key, row in evidence.authors.items() if key[1] == "nlopt-bobyqa"
               and key[0] != "imitation-ppo"), "the text says that no network from scratch is ahead of BOBYQA"
    found["span.imitation-ppo:bo-gp.own"] = ends(
        [evidence.contrasts["imitation-ppo", "bo-gp", "own", level]["ratio"] for level in LEVELS], 2)
    last = [float(evidence.curves[one, level][MOVES]["recommended_current_median"]) for one in evidence.networks
            for level in LEVELS]
    own = [float(evidence.curves[one, level][MOVES]["recommended_median"]) for one in evidence.networks for level in LEVELS]
    assert max(own) <= LIMITS[0], "the text says that every median by the lowest measured RMSE is in the specification"
    found |= {"count.steps-above": str(sum(value > LIMITS[0] for value in last)), "count.steps-cases": str(len(last))}
    found["span.limits.change"] = ends([row["change"] for row in read("trainings/limits.csv")
                                        if row["training"].startswith("rho") and row["moves"] == "shrinking"], 2)
    linear = {row["noise_level"]: row["in_spec_current"] for row in read("trainings/linear.csv")
              if row["algorithm"] == "ppo-linear" and row["images"] == str(MOVES)}
    return found | {"linear.current.all": listed(linear[level] for level in LEVELS)}


def domains():
    found = {}
    for scene in ("relign_od", "relign_od-package"):
        found[f"span.domain.{scene}"] = ends([row["excess_median"] for row in read("../domain_gap/matrix.csv") if (
            row["scene"], row["rule"], row["images"]) == (scene, "own", "12") and row["algorithm"] in (
            "imitation", "imitation-ppo", "imitation-elsewhere", "imitation-ppo-elsewhere")], 4)
    return found


def shares():
    """Shares of the trials within the limits, and instances in the specification."""
    errors, found = {}, {}
    for row in read("instances.csv"):
        if row["protocol"] == "paper":
            errors.setdefault(row["algorithm"], []).append((row["noise_level"], float(row["recommended"])))
    for name, of_name in errors.items():
        for index, limit in enumerate(LIMITS):
            within = sum(error <= limit for _, error in of_name)
            found[f"within.{name}.{index}"] = f"{100 * within / len(of_name):.0f} %"
    for name in ("imitation", "imitation-ppo"):
        assert found[f"within.{name}.2"] == "100 %", "the text says that all trials of the imitation networks are within it"
    found["count.home-in-spec"] = str(sum(error <= LIMITS[0] for level, error in errors["home"] if level == "rho0"))
    last = {}
    for row in read("trainings/instances.csv") + read("instances.csv"):
        scratch = row["algorithm"].startswith("ppo-exact") and "shrinking" not in row["algorithm"]
        if (scratch or row["algorithm"] == "ppo-paper") and row["noise_level"] == "rho0" and row["protocol"] == "paper":
            last.setdefault(row["algorithm"], {})[row["instance"]] = float(row[COLUMNS["current"]]) <= LIMITS[0]
    return found | {"count.best-scratch-last": str(max(sum(of_one.values()) for of_one in last.values()))}


def verdict_at(row, factor):
    low, high = float(row["lo95"]), float(row["hi95"])
    if high < 1 / factor or low > factor:
        return "better" if high < 1 / factor else "worse"
    return "practically equal" if 1 / factor <= low and high <= factor else "undecided"


def counts(evidence):
    """How many planned verdicts a rule, the floor, the factor or a training changes."""
    planned = [row for row in read("floors.csv") if row["planned"] == "yes" and row["rule"] in ("own", "best")]
    by_key = {}
    for row in planned:
        by_key[row["protocol"], row["first"], row["second"], row["noise_level"], row["rule"], row["floor"]] = row
    at_floor = {key[:5]: row for key, row in by_key.items() if key[5] == FLOOR}
    paper = {key for key in at_floor if key[0] == "paper"}
    pairs = {key[:4] for key in paper}
    by_rule = sum(at_floor[(*pair, "own")]["verdict"] != at_floor[(*pair, "best")]["verdict"] for pair in pairs)
    by_floor = sum(by_key[(*key, FLOOR_OF_PROGRAM)]["verdict"] != by_key[(*key, FLOOR)]["verdict"] for key in paper)
    by_factor = sum(verdict_at(row, OTHER_RATIO) != row["verdict"] for row in at_floor.values())
    seeds = [f"ppo-exact (seed-{seed})" for seed in range(3)]
    by_seed = sum(len({evidence.contrasts[seed, opponent, rule, level]["verdict"] for seed in seeds}) > 1
                  for opponent in ("bo-gp", "bo-gp-tuned") for rule in ("own", "best") for level in LEVELS)
    seeds = next(row for row in read("bootstrap.csv") if (row["protocol"], row["noise_level"], row["first"], row["rule"]) == (
        "paper", "rho0.5", "bo-gp", "own"))
    by_bootstrap = sum(float(row[row["verdict"]]) < MOST for row in read("bootstrap.csv"))
    return {"bootstrap.bogp": f"{100 * float(seeds['better']):.0f} of {seeds['seeds']}",
            "count.bootstrap-changes": str(by_bootstrap), "count.rule-changes": str(by_rule),
            "count.planned": str(len(pairs)), "count.floor-changes": str(by_floor),
            "count.planned-rules": str(len(paper)), "count.factor-changes": str(by_factor),
            "count.factor-all": str(len(at_floor)), "count.seed-changes": str(by_seed)}


def arrivals(study):
    """Captures after which the median excess stays within the finest target, over the levels."""
    found = {}
    for name in ("imitation", "imitation-ppo"):
        steps = [captures(study.arrival("paper", name, level, study_tables.TARGETS[-1])) for level in LEVELS]
        found[f"arrival.{name}"] = " to ".join(dict.fromkeys((str(min(steps)), str(max(steps)))))
    return found


def values():
    """Every value by its key.

    Raises:
        SystemExit: A page no longer has the text around a value.
    """
    study, evidence = study_tables.Study(), Evidence()
    return (quoted() | settings() | medians(study) | ratios(evidence) | spans(evidence) | domains() | shares()
            | counts(evidence) | arrivals(study))
