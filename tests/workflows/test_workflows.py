"""The workflow files of forges follow their schemas, run the same jobs, and name steps, presets and targets that exist."""

import json
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest

try:
    import yaml
except ImportError:
    yaml = None

ROOT = pathlib.Path(__file__).resolve().parents[2]
GITHUB = ROOT / ".github" / "workflows" / "ci.yml"
GITLAB = ROOT / ".gitlab-ci.yml"
KEYWORDS = {"default", "workflow", "stages", "variables", "include"}
PROGRAMS = {"apt-get", "git", "cmake", "ctest"}
SCHEMAS = {GITHUB: "vendor.github-workflows", GITLAB: "vendor.gitlab-ci"}
CHECKER = shutil.which("check-jsonschema", path=ROOT / ".python" / "bin") or shutil.which("check-jsonschema")
MODES = {"cmake": "configurePresets", "cmake --build": "buildPresets", "ctest": "testPresets"}


def github_jobs(text):
    """Name of each job, and its commands."""
    return {name: [step["run"] for step in job["steps"] if "run" in step] for name, job in yaml.safe_load(text)["jobs"].items()}


def gitlab_jobs(text):
    """Name of each job, and its commands."""
    return {name: job["script"] for name, job in yaml.safe_load(text).items() if name not in KEYWORDS}


def quickstart_words():
    """Steps and options of quickstart."""
    text = (ROOT / "quickstart").read_text()
    steps = re.search(r"^  ((?:\w+ \| )+\w+)\) ;;$", text, re.M)[1].split(" | ")
    return set(steps), set(re.findall(r"^    (?:-\w \| )?(--[\w-]+)\) ", text, re.M))


def target_exists(name):
    """Whether a CMake file makes a target of this name. All tests of a folder are one program, named after it."""
    if name.startswith("test_"):
        return any("_".join(path.parent.relative_to(ROOT / "tests").parts) == name[5:]
                   for path in (ROOT / "tests").rglob("CMakeLists.txt"))
    files = [ROOT / "CMakeLists.txt", *(ROOT / "cmake").glob("*.cmake"), *(ROOT / "core").rglob("CMakeLists.txt")]
    return any(re.search(rf"add_(?:executable|library|custom_target)\({name}\b", file.read_text()) for file in files)


def mistakes(command):
    """What a command names that does not exist."""
    found = []
    for one in command.split("&&"):
        words = shlex.split(one)
        while words[0] == "setarch":
            words = words[2:]
        program, given = words[0], words[1:]
        if program == "./quickstart":
            steps, options = quickstart_words()
            found += [word for word in given if word not in steps | options]
        elif program.startswith(".ci/"):
            found += [] if (ROOT / program).is_file() else [program]
        elif program not in PROGRAMS:
            found.append(program)
        mode = "cmake --build" if program == "cmake" and "--build" in given else program
        if "--preset" in given:
            presets = json.loads((ROOT / "CMakePresets.json").read_text())[MODES[mode]]
            name = given[given.index("--preset") + 1]
            found += [] if any(one["name"] == name and not one.get("hidden") for one in presets) else [f"--preset {name}"]
        if "--target" in given:
            found += [name for name in given[given.index("--target") + 1:] if not target_exists(name)]
        if program == "ctest" and "-R" in given:
            names = re.findall(r"\w+", given[given.index("-R") + 1])
            tests = "".join(path.read_text() for path in (ROOT / "tests").rglob("CMakeLists.txt"))
            found += [name for name in names if f"relign_add_test({name} " not in tests]
    return found


@unittest.skipUnless(CHECKER, "check-jsonschema is not installed (tests/workflows/requirements.txt)")
class Schemas(unittest.TestCase):
    """Those that check-jsonschema brings; it downloads nothing for them."""

    def problems(self, file, schema):
        """What is wrong with a file; empty: nothing."""
        done = subprocess.run([CHECKER, "--builtin-schema", schema, file], capture_output=True, text=True, check=False)
        return done.stdout + done.stderr if done.returncode != 0 else ""

    def test_files_follow_them(self):
        for file, schema in SCHEMAS.items():
            self.assertEqual(self.problems(file, schema), "")

    def test_finds_mistakes(self):
        for file, schema, key in ((GITHUB, SCHEMAS[GITHUB], "runs-on"), (GITLAB, SCHEMAS[GITLAB], "script")):
            with tempfile.NamedTemporaryFile("w", suffix=".yml") as wrong:
                wrong.write(file.read_text().replace(f"{key}:", f"{key}s:", 1))
                wrong.flush()
                self.assertIn(f"{key}s", self.problems(wrong.name, schema))


@unittest.skipIf(yaml is None, "PyYAML is not installed (Debian and Ubuntu: python3-yaml)")
class Workflows(unittest.TestCase):
    def test_commands_name_what_exists(self):
        for jobs in (github_jobs(GITHUB.read_text()), gitlab_jobs(GITLAB.read_text())):
            self.assertGreater(len(jobs), 5)
            for name, commands in jobs.items():
                for command in commands:
                    with self.subTest(f"{name}: {command}"):
                        self.assertEqual(mistakes(command), [])

    def test_both_forges_run_the_same_jobs(self):
        self.assertEqual(sorted(github_jobs(GITHUB.read_text())), sorted(gitlab_jobs(GITLAB.read_text())))

    def test_actions_are_pinned_and_leave_no_credentials(self):
        steps = [step for job in yaml.safe_load(GITHUB.read_text())["jobs"].values() for step in job["steps"] if "uses" in step]
        self.assertGreater(len(steps), 5)
        for step in steps:
            self.assertRegex(step["uses"], r"^actions/[\w-]+@[0-9a-f]{40}$")
            if step["uses"].startswith("actions/checkout@"):
                self.assertIs(step["with"]["persist-credentials"], False)

    def test_all_images_are_the_same(self):
        images = set(re.findall(r"\bdebian:[\w.]+", GITHUB.read_text() + GITLAB.read_text()
                                + (ROOT / "Containerfile").read_text()))
        self.assertEqual(len(images), 1, images)


class TheCheckItself(unittest.TestCase):
    def test_finds_mistakes(self):
        self.assertEqual(mistakes("./quickstart tset --yes --no"), ["tset", "--no"])
        self.assertEqual(mistakes("cmake --preset debug"), ["--preset debug"])
        self.assertEqual(mistakes("cmake --preset base"), ["--preset base"])
        self.assertEqual(mistakes("cmake --build --preset tsan --target test_runner relign-bench"), ["test_runner"])
        self.assertEqual(mistakes("apt-get update && .ci/nothing"), [".ci/nothing"])
        self.assertEqual(mistakes("setarch -R ctest --preset tsan -R '^(runner_run|runner_walk)$'"), ["runner_walk"])


if __name__ == "__main__":
    unittest.main()
