"""Published instances keep their bits: the first instance of every scene and noise level of the suites in suites/, as `home`
meets it. A change of the draw, of the images or of the score changes the published results (docs/releasing.md)."""

import hashlib
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
GOLDEN = TREE / "tests" / "golden" / "published_instances.json"
PROGRAM = shlex.split(os.environ["RELIGN_BENCH"])  # behind an emulator, too
SUITES = ("agents_elsewhere", "domain_gap", "paper")
VERSIONS = "versions"  # of scenes and noise levels, in the golden file


def versions():
    """Of all scenes and noise levels and their presets, by id, those above 1."""
    found = {}
    for kind in ("scenes", "noise-levels"):
        listed = json.loads(subprocess.check_output([*PROGRAM, "list", kind, "--json"]))
        found.update({one["id"]: one["version"] for plugin in listed for one in (plugin, *plugin["presets"])})
    return {name: version for name, version in found.items() if version > 1}


def first_instances(name, folder):
    """By scene and noise level of a suite: seed of the instance, and hashes of its steps and of its own optimum."""
    shutil.copytree(TREE / "suites", folder / "suites", dirs_exist_ok=True)
    suite = json.loads((TREE / "suites" / f"{name}.json").read_text())
    for key in ("analysis", "protocols", "cost", "cycle"):
        suite.pop(key, None)
    suite.update(algorithms=["home"], instances=1, steps=1, protocol="paper")
    file, results = folder / "suites" / f"{name}.json", folder / name
    file.write_text(json.dumps(suite))
    command = [*PROGRAM, "--progress", "none", "run", file, "-o", results, "--only", "algorithm=home", "--isolation", "none"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{name}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    steps, found = {}, {}
    for records in sorted((results / "trials").glob("*.jsonl")):
        for line in records.read_text().splitlines():
            record = json.loads(line)
            if "step" in record:
                steps[record["trial"]] = steps.get(record["trial"], "") + json.dumps({**record, "trial": ""}) + "\n"
                continue
            optimum = json.dumps([record["own_optimum_mse"], record["own_optimum_pose"]])
            found[f"{record['scene']} {record['noise_level']}"] = {
                "seed": record["instance_seed"],
                "steps": hashlib.sha256(steps[record["trial"]].encode()).hexdigest(),
                "own_optimum": hashlib.sha256(optimum.encode()).hexdigest()}
    return found


class Instances(unittest.TestCase):
    maxDiff = None

    def test_published_instances_keep_their_bits(self):
        with tempfile.TemporaryDirectory() as scratch:
            found = {name: first_instances(name, pathlib.Path(scratch)) for name in SUITES}
        found[VERSIONS] = versions()
        golden = json.loads(GOLDEN.read_text())
        raised = {name for name, version in found[VERSIONS].items() if version > golden[VERSIONS].get(name, 1)}
        for suite in SUITES:
            for cell in golden[suite].keys() & found[suite].keys():
                if golden[suite][cell]["steps"] != found[suite][cell]["steps"]:
                    changed = f"{suite}: {cell} changed: raise the version of one of them"
                    self.assertTrue(raised & set(cell.split(" ", 1)), changed)
        if os.environ.get("RELIGN_UPDATE_GOLDEN"):
            GOLDEN.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
        self.assertEqual(found, json.loads(GOLDEN.read_text()))


if __name__ == "__main__":
    unittest.main()
