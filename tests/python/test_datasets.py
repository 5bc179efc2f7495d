"""relign-export --minari: datasets read by minari and mlcroissant, and made again from their recipes."""

import contextlib
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import warnings
from unittest import mock

from support import np, package

from relign_bench.export import cli, dataset
from relign_bench.results import read_trials

SUITE = {"name": "spots", "scenes": [{"use": "gaussian_spot", "name": "dim.spot", "parameters": {"photons": 1e5}}],
         "noise_levels": ["rho0"], "algorithms": [{"use": "random", "name": "rändom +1", "parameters": {}}],
         "protocols": ["paper", "blind"], "first_instance": 3, "instances": 2, "steps": 4}
RANDOM = "relign-bench/dim_spot-rho0/r_ndom_1-paper-v0"
HOME = "relign-bench/dim_spot-rho0/home-paper-v0"


def setUpModule():
    """Runs a suite and exports it; the tests read the folders `results` and `datasets`."""
    global PLACE  # noqa: PLW0603
    program = os.environ.get("RELIGN_PROGRAM")
    if not program:
        raise unittest.SkipTest("RELIGN_PROGRAM does not name the program")
    package("minari.dataset._storages.hdf5_storage")
    place = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(place.cleanup)
    PLACE = pathlib.Path(place.name)
    changed = {"PATH": f"{pathlib.Path(program).parent}{os.pathsep}{os.environ['PATH']}",
               "MINARI_DATASETS_PATH": str(PLACE / "datasets")}
    patch = mock.patch.dict(os.environ, changed)
    patch.start()
    unittest.addModuleCleanup(patch.stop)
    (PLACE / "suite.json").write_text(json.dumps(SUITE))
    subprocess.run([program, "run", "suite.json", "-o", "results"], check=True, cwd=PLACE, capture_output=True)
    if export("results", "--minari", "datasets")[0]:
        raise AssertionError("the export failed")


def export(source, *arguments):
    """Runs relign-export in PLACE; its status, output and errors."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as errors, \
            contextlib.chdir(PLACE) if hasattr(contextlib, "chdir") else contextlib.nullcontext():
        status = cli.main([str(source), *map(str, arguments)])
    return status, out.getvalue(), errors.getvalue()


def opened(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # relign-bench is not installed as a package in the tests
        return package("minari").load_dataset(name)


class Datasets(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory(dir=PLACE)
        self.addCleanup(place.cleanup)
        self.place = pathlib.Path(place.name)

    def refused(self, source, *arguments):
        """The error of an export that fails, which leaves nothing."""
        status, _, errors = export(source, "--minari", self.place / "out", *arguments)
        self.assertEqual(status, 2)
        self.assertEqual([path.name for path in self.place.glob("out*")], [])
        return errors

    def test_minari_has_every_trial_of_the_records(self):
        found = package("minari").list_local_datasets()
        self.assertEqual(sorted(found), sorted(f"relign-bench/dim_spot-rho0/{name}-{protocol}-v0" for protocol in
                                               ("blind", "paper") for name in ("home", "r_ndom_1")))
        recorded = {closing["instance"]: steps for closing, steps in read_trials(PLACE / "results")
                    if (closing["algorithm"], closing["protocol"]) == ("rändom +1", "paper")}
        data = opened(RANDOM)
        self.assertEqual((data.total_episodes, data.total_steps), (2, 8))
        for about, episode in zip(data.storage.get_episode_metadata(range(2)), data.iterate_episodes()):
            steps = recorded.pop(int(about["options"]["instance"]))
            np.testing.assert_array_equal(episode.actions, np.float32([step["commanded_pose"] for step in steps[1:]]))
            np.testing.assert_array_equal(episode.infos["measured_error"], [step["measured"] for step in steps])
            np.testing.assert_array_equal(episode.infos["recommended_error"] ** 2,
                                          np.sqrt([step["recommended_mse"] for step in steps]) ** 2)
            self.assertEqual((episode.terminations.sum(), episode.truncations.tolist()), (0, [False] * 3 + [True]))
        self.assertEqual(recorded, {})
        home = opened(HOME)[0]
        self.assertEqual((home.terminations.tolist(), home.truncations.tolist()), ([True], [False]))

    def test_recovered_environment_has_the_images_and_rewards_of_the_dataset(self):
        data = opened(RANDOM)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            environment = data.recover_environment()
        self.assertEqual((environment.observation_space, environment.action_space), (data.observation_space, data.action_space))
        episode, about = data[1], next(iter(data.storage.get_episode_metadata([1])))
        observation, _ = environment.reset(options={"instance": int(about["options"]["instance"]), "instances": "benchmark"})
        np.testing.assert_array_equal(observation, episode.observations[0])
        for step, action in enumerate(episode.actions):
            observation, reward, *_ = environment.step(action)
            self.assertAlmostEqual(reward, episode.rewards[step], 6)  # actions are rounded to float32
            differ = np.abs(observation.astype(int) - episode.observations[step + 1])
            self.assertLessEqual(differ.max(), 1)
            self.assertLess((differ > 0).mean(), 0.01)
        # The poses of protocol blind count from a start that the environment does not hide.
        self.assertIsNone(opened(RANDOM.replace("paper", "blind")).env_spec)

    def test_croissant_describes_every_file_and_episode(self):
        mlcroissant = package("mlcroissant")
        place = PLACE / "datasets" / RANDOM
        with self.assertLogs("absl") as logged:
            described = mlcroissant.Dataset(jsonld=str(place / "croissant.json"))
        self.assertEqual(described.metadata.issues.errors, set())
        for warning in described.metadata.issues.warnings:  # which the publisher decides
            self.assertRegex(warning, "datePublished|license")
        self.assertNotIn("not standard", "\n".join(logged.output))
        rows = list(described.records("episodes"))
        self.assertEqual([(row["episodes/instance"], row["episodes/steps"]) for row in rows], [(3, 4), (4, 4)])
        for row, episode in zip(rows, opened(RANDOM).iterate_episodes()):
            self.assertAlmostEqual(row["episodes/return"], episode.rewards.sum(), 12)
        files = {path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()}
        self.assertEqual(files, {one.id for one in described.metadata.distribution} | {"croissant.json"})
        (place / "episodes.csv").write_text((place / "episodes.csv").read_text() + " ")
        with self.assertRaisesRegex(Exception, r"Download\(episodes.csv\)"):  # its hash differs
            list(package("mlcroissant").Dataset(jsonld=str(place / "croissant.json")).records("episodes"))
        (place / "episodes.csv").write_text((place / "episodes.csv").read_text()[:-1])

    def test_recipe_of_a_kilobyte_makes_the_same_files(self):
        for name in (RANDOM, RANDOM.replace("paper", "blind"), HOME):
            recipe = PLACE / "datasets" / name / "recipe.json"
            self.assertLess(recipe.stat().st_size, 1024)
            out = self.place / name.rpartition("/")[2]
            self.assertEqual(export(recipe, "--minari", out), (0, f"{name}: 2 episodes\n", ""))
            for file in recipe.parent.rglob("*.*"):
                self.assertEqual((out / name / file.relative_to(recipe.parent)).read_bytes(), file.read_bytes(), file)

    def test_single_instances_keep_their_numbers(self):
        self.assertEqual(export("results", "--minari", self.place / "out", "--only", "instance=4", "--only", "algorithm=home",
                                "--only", "protocol=paper")[0], 0)
        (recipe,) = self.place.rglob("recipe.json")
        kept = json.loads(recipe.read_text())
        self.assertEqual((kept["instances"], kept["suite"]["first_instance"], kept["suite"]["instances"]), ([[4, 4]], 4, 1))
        self.assertEqual(export(recipe, "--minari", self.place / "again")[0], 0)

    def test_damaged_recipes_are_refused(self):
        good = json.loads((PLACE / "datasets" / RANDOM / "recipe.json").read_text())
        file = self.place / "recipe.json"
        for changed, why in (({"dataset": "../../etc/x-v0"}, "'dataset' must be NAMESPACE/NAME"),
                             ({"dataset": "ab/x-v0\n"}, "'dataset' must be NAMESPACE/NAME"),
                             ({"instances": [[4, 3]]}, r"'instances' must be pairs [FIRST, LAST], found [4, 3]"),
                             ({"instances": []}, "found null"), ({"format": 2}, "newer version"),
                             ({"suite": 1}, "'suite' is missing or not of type dict"),
                             ({"suite": {**good["suite"], "scenes": []}}, "'suite' must have one entry in 'scenes'"),
                             ({"suite": {**good["suite"], "stepz": 3}}, "unknown key 'stepz'"),
                             ({"sha256": "0" * 64}, "does not repeat bit for bit"),
                             ({"suite": {**good["suite"], "seed": 2}}, "does not repeat bit for bit")):
            file.write_text(json.dumps({**good, **changed}))
            self.assertIn(why, self.refused(file))
        for text in ("", "[]", "[" * 100_000, '{"format": 1, "format": 1}', "\0"):
            file.write_text(text)
            self.assertIn("is not the recipe of a dataset", self.refused(file))
        file.write_bytes(b"\xff")
        self.assertIn("is not the recipe of a dataset", self.refused(file))
        file.write_text(json.dumps(good))
        self.assertIn("--only does not apply to a recipe", self.refused(file, "--only", "instance=3"))

    def test_images_that_are_not_those_of_the_record_are_refused(self):
        with mock.patch.object(dataset, "frame_seed", lambda seed, step: 7):
            self.assertIn("cannot be rendered again: the image of step 0 has a score of", self.refused("results"))
        for key, value, why in (("seed", 2, "has another seed than the suite's instance"),
                                ("scenes", None, "is a station, whose images cannot be rendered again")):
            changed = self.place / "changed"
            shutil.copytree(PLACE / "results", changed)
            manifest = json.loads((changed / "manifest.json").read_text())
            manifest[key] = value if value else [{**one, "replayable": False} for one in manifest[key]]
            (changed / "manifest.json").write_text(json.dumps(manifest))
            self.assertIn(why, self.refused(changed))
            shutil.rmtree(changed)

    def test_missing_packages_are_named(self):
        with mock.patch.dict(sys.modules, {"minari.dataset._storages": None}):
            self.assertIn("datasets need minari: pip install 'minari[hdf5]' pillow", self.refused("results"))
        with mock.patch.dict(os.environ, PATH="/nowhere"):
            self.assertIn("is not on PATH", self.refused(PLACE / "datasets" / RANDOM / "recipe.json"))


if __name__ == "__main__":
    unittest.main()
