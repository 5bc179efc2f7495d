"""Trials with their images as Minari datasets for offline learning (https://minari.farama.org), with Croissant metadata.

Records have no images. An image is a function of instance, pose and frame seed, so that it is rendered again, and compared with
the recorded RMSE. A recipe of a suite and a hash makes a dataset again, bit for bit.
"""

from __future__ import annotations

import copy
import hashlib
import json
import math
import pathlib
import re
import subprocess
import tempfile
from typing import TYPE_CHECKING, Any

from .._json import unique_keys
from .._score import score_of
from ..program import find_program
from ..results import ENDED_WELL
from .croissant import described
from .runs import chosen_trials, file_names, new_folder

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator

    Steps = list[dict[str, Any]]
    Trials = list[tuple[dict[str, Any], Steps]]
    """Closing line and steps of each."""

FORMAT = 1
KEYS = {"format": int, "dataset": str, "suite": dict, "instances": list, "version": str, "sha256": str}
SUITE_KEYS = ("name", "seed", "commitment", "scenes", "noise_levels", "algorithms", "protocol", "protocols", "steps", "limits",
              "trial_seconds", "trial_memory_mb", "spec", "machine_time")
"""Keys of a suite on which trials depend, besides the instances."""
GROUP = {"scene": "scenes", "noise_level": "noise_levels", "algorithm": "algorithms"}
DATASET = re.compile(r"[-\w]{2,}(/[-\w]+)*/[-\w]+-v\d+", re.ASCII)
COLUMNS = {"episode": "Integer", "instance": "Integer", "steps": "Integer", "end": "Text", "return": "Float",
           "recommended_error": "Float"}
LARGEST_DIFFERENCE = 1e-5  # of the RMSE of an image, relative to that of the record, which is a sum in another order


def write_minari(source: str | os.PathLike[str], folder: str | os.PathLike[str], only: Iterable[str] = ()) -> tuple[
        dict[str, int], int]:
    """Writes a dataset per scene, noise level, method and protocol, with recipe.json, episodes.csv and croissant.json.

    Args:
        source: A results folder; or the recipe.json of a dataset, whose suite the program relign-bench then runs.
        folder: Folder to create, for MINARI_DATASETS_PATH.
        only: KEY=VALUE with a key of ONLY_KEYS, for a results folder.

    Returns:
        Number of episodes by id of the dataset, and number of trials that were left out: they failed, have no action, or
        no complete record.

    Raises:
        FileExistsError: The folder exists and is not empty.
        FileNotFoundError: The folder has no results, or no trials, or the program is not installed.
        ImportError: minari or h5py is not installed.
        ValueError: No trial is left, images or trials are not those of the record or the recipe, or the recipe is not valid.
    """
    try:
        from minari.dataset._storages import hdf5_storage  # noqa: F401
    except ImportError as problem:
        raise ImportError(f"datasets need minari: pip install 'minari[hdf5]' pillow ({problem})") from None
    if not pathlib.Path(source).is_file():
        manifest, recipes, left_out = _recipes(source, only)
        with new_folder(folder) as new:
            return {recipe["dataset"]: _write(manifest, recipe, trials, new / recipe["dataset"])
                    for recipe, trials in recipes}, left_out
    if list(only):
        raise ValueError("--only does not apply to a recipe, which states its instances")
    recipe = read_recipe(source)
    with new_folder(folder) as new, tempfile.TemporaryDirectory() as place:
        manifest, ((again, trials),), left_out = _recipes(_run(recipe["suite"], pathlib.Path(place)),
                                                          [f"algorithm={_name(recipe['suite']['algorithms'][0])}"])
        wanted = {number for first, last in recipe["instances"] for number in range(first, last + 1)}
        trials = [trial for trial in trials if trial[0]["instance"] in wanted]
        again.update(dataset=recipe["dataset"], suite=recipe["suite"], instances=recipe["instances"], version=recipe["version"],
                     sha256=recipe["sha256"])
        return {recipe["dataset"]: _write(manifest, again, trials, new / recipe["dataset"])}, left_out


def _run(suite: dict[str, Any], place: pathlib.Path) -> pathlib.Path:
    """Runs a suite in a folder; returns the results folder."""
    (place / "suite.json").write_text(json.dumps(suite), encoding="utf-8")
    done = subprocess.run([find_program(), "run", "suite.json", "-o", "results", "--progress", "none"], cwd=place,
                          capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):  # 3: some trials failed
        raise ValueError(f"relign-bench run failed: {' '.join(done.stderr.split())}")
    return place / "results"


def _recipes(results: str | os.PathLike[str], only: Iterable[str] = ()) -> tuple[
        dict[str, Any], list[tuple[dict[str, Any], Trials]], int]:
    """The manifest of a results folder; of each dataset its recipe, without hash, and its trials; number of those left out."""
    manifest, trials, missing = chosen_trials(results, only)
    found: dict[tuple[str, ...], Trials] = {}
    for closing, steps in trials:
        if closing["end"] in ENDED_WELL and len(steps) > 1:  # one step is the start, without an action
            found.setdefault(tuple(closing[key] for key in (*GROUP, "protocol")), []).append((closing, steps))
    if not found:
        raise ValueError(f"'{results}' has no trial to export: {len(trials)} were chosen, which failed or have no action")
    several = len({key[3] for key in found}) > 1
    titles = {key: (f"{key[0]}-{key[1]}", f"{key[2]}-{key[3]}" if several else key[2]) for key in found}
    names = [file_names(list(dict.fromkeys(title[k] for title in titles.values())), "_-") for k in (0, 1)]
    recipes = []
    for key, group in found.items():
        dataset = "/".join(("relign-bench", *(names[k][titles[key][k]] for k in (0, 1)))) + "-v0"
        numbers = sorted(closing["instance"] for closing, _ in group)
        recipes.append(({"format": FORMAT, "dataset": dataset, "suite": _suite(manifest, key, numbers[0], numbers[-1]),
                         "instances": _ranges(numbers), "version": manifest["program"]["version"]}, group))
    return manifest, recipes, missing + len(trials) - sum(map(len, found.values()))


def _suite(manifest: dict[str, Any], key: tuple[str, ...], first: int, last: int) -> dict[str, Any]:
    """The suite of a results folder with one scene, noise level, method and protocol, and these instances."""
    whole = json.loads(manifest["suite"])
    suite = {name: whole[name] for name in SUITE_KEYS if name in whole}
    for entries, name in zip(GROUP.values(), key):
        used = next(one for one in manifest[entries] if one["name"] == name)
        # Methods that the program or a merge has added are not in the suite.
        entry = {"use": used["id"], "name": name, "parameters": used["parameters"]}
        suite[entries] = [one for one in whole[entries] if _name(one) == name][:1] or [entry]
    if "protocols" in suite:
        suite["protocols"] = [key[3]]
    return {**suite, "first_instance": first, "instances": last - first + 1}


def _name(entry: Any) -> str:
    return str(entry.get("name", entry.get("use")) if isinstance(entry, dict) else entry)


def _ranges(numbers: list[int]) -> list[list[int]]:
    """First and last of each row of consecutive numbers."""
    ranges: list[list[int]] = []
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return ranges


def read_recipe(file: str | os.PathLike[str]) -> dict[str, Any]:
    """The recipe of a dataset.

    Raises:
        ValueError: The file is not such a recipe.
    """
    try:
        recipe = json.loads(pathlib.Path(file).read_text(encoding="utf-8"), object_pairs_hook=unique_keys)
        for key, kind in KEYS.items():
            if not isinstance(recipe, dict) or type(recipe.get(key)) is not kind:
                raise ValueError(f"'{key}' is missing or not of type {kind.__name__}")
        if recipe["format"] > FORMAT:
            raise ValueError(f"format {recipe['format']} is of a newer version of relign-bench; this one reads {FORMAT}")
        if not DATASET.fullmatch(recipe["dataset"]):
            raise ValueError("'dataset' must be NAMESPACE/NAME-vNUMBER of letters, digits, '-' and '_', found "
                             f"'{recipe['dataset']}'")
        for entries in GROUP.values():
            if not isinstance(recipe["suite"].get(entries), list) or len(recipe["suite"][entries]) != 1:
                raise ValueError(f"'suite' must have one entry in '{entries}'")
        for pair in recipe["instances"] or [None]:
            whole = isinstance(pair, list) and len(pair) == 2 and all(type(number) is int for number in pair)
            if not (whole and 0 <= pair[0] <= pair[1]):
                raise ValueError(f"'instances' must be pairs [FIRST, LAST], found {json.dumps(pair)}")
    except (ValueError, RecursionError) as problem:
        raise ValueError(f"'{file}' is not the recipe of a dataset: {problem}; restore it from a copy") from None
    return dict(recipe)


def _write(manifest: dict[str, Any], recipe: dict[str, Any], trials: Trials, folder: pathlib.Path) -> int:
    """Writes a dataset, whose hash its recipe gets, or must have; returns the number of episodes."""
    from minari import __version__
    from minari.dataset.minari_storage import MinariStorage

    if not trials:
        raise ValueError(f"no trial of dataset '{recipe['dataset']}' is left: they failed, or have no action")
    source = _Source(manifest, recipe["suite"], trials[0][0])
    folder.mkdir(parents=True)
    storage = MinariStorage.new(folder / "data", *source.spaces(), source.environment(), "hdf5", jpeg_encoding=False)
    title = "{algorithm} on {scene} at {noise_level}".format_map(trials[0][0])
    text = f"Trials of relign-bench {recipe['version']}: {title}; recipe.json makes them again."
    storage.update_metadata({"dataset_id": recipe["dataset"], "algorithm_name": trials[0][0]["algorithm"], "description": text,
                             "minari_version": __version__, "requirements": [f"relign-bench=={recipe['version']}"]})
    sha, rows = hashlib.sha256(), [",".join(COLUMNS)]
    storage.update_episodes(_episodes(source, trials, sha, rows))
    if recipe.setdefault("sha256", sha.hexdigest()) != sha.hexdigest():
        raise ValueError(f"dataset '{recipe['dataset']}' does not repeat bit for bit: its arrays have the hash "
                         f"{sha.hexdigest()}, its recipe has {recipe['sha256']}; it was made by version {recipe['version']} "
                         "of relign-bench, and some methods repeat on processors of one kind only")
    (folder / "episodes.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "recipe.json").write_text(json.dumps(recipe, ensure_ascii=False) + "\n", encoding="utf-8")
    files = ["data/main_data.hdf5", "data/metadata.json", "episodes.csv", "recipe.json"]
    about = described(folder, files, "episodes.csv", COLUMNS, name=recipe["dataset"], description=text, version="1.0.0",
                      citeAs="relign-bench, a benchmark for active alignment")
    (folder / "croissant.json").write_text(json.dumps(about, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return len(rows) - 1


def _episodes(source: _Source, trials: Trials, sha: Any, rows: list[str]) -> Iterator[Any]:
    """Minari's EpisodeBuffers; updates the hash with their arrays, and appends to the rows of episodes.csv."""
    from minari.data_collector import EpisodeBuffer

    own = ("observations", "actions", "rewards", "terminations", "truncations")
    for closing, steps in sorted(trials, key=lambda trial: trial[0]["instance"]):
        arrays, instance = source.arrays(closing, steps), closing["instance"]
        for name, values in arrays.items():
            sha.update(f"{instance} {name} {values.dtype.str} {values.shape}\n".encode() + values.tobytes())
        yield EpisodeBuffer(options={"instance": instance, "instances": "benchmark"}, **{name: arrays[name] for name in own},
                            infos={name: values for name, values in arrays.items() if name not in own})
        recommended = arrays.get("recommended_error")
        numbers = (len(rows) - 1, instance, len(steps) - 1, closing["end"], float(arrays["rewards"].sum()),
                   "" if recommended is None else float(recommended[-1]))
        rows.append(",".join(map(str, numbers)))


class _Source:
    """A scene at a noise level, as a results folder has them, which renders its captures again."""

    def __init__(self, manifest: dict[str, Any], suite: dict[str, Any], closing: dict[str, Any]) -> None:
        from ..bench import Bench

        self._paper = closing["protocol"] == "paper"
        self._steps = closing["budget"]
        name, seed, limits = closing["scene"], manifest["seed"], manifest["limits"]
        if not next(scene for scene in manifest["scenes"] if scene["name"] == name)["replayable"]:
            raise ValueError(f"scene '{name}' is a station, whose images cannot be rendered again, and records have none; "
                             "leave it out with --only scene=NAME")
        # As the suite has them, since the manifest has paths of files as text.
        (scene, scene_parameters), (level, level_parameters) = (
            (one["use"], one.get("parameters", {})) if isinstance(one, dict) else (one, {})
            for one in (suite["scenes"][0], suite["noise_levels"][0]))
        self.bench = Bench(scene, level, seed, limits, scene_parameters, level_parameters)
        self._batch, self._score = self.bench.batch(1), score_of(self.bench.description)
        self._arguments = {"scene": scene, "scene_parameters": scene_parameters, "noise_level": level,
                           "noise_level_parameters": level_parameters, "suite_seed": seed, "clipping": limits,
                           "instances": "benchmark", "action": "absolute"}

    def spaces(self) -> tuple[Any, Any]:
        """Spaces of observations and actions, those of the environment."""
        import numpy as np
        from gymnasium import spaces

        return (spaces.Box(0, 255, (1, *self.bench.reference.shape), np.uint8),
                spaces.Box(0, 1, (len(self.bench.axes),), np.float32))

    def environment(self) -> Any:
        """The environment whose spaces, images and rewards the dataset has, as a gymnasium.envs.registration.EnvSpec.

        None for protocol blind, whose poses count from an unknown start.
        """
        import gymnasium

        from ..registration import ENVIRONMENT, register

        if not self._paper:
            return None
        register()
        spec = copy.deepcopy(gymnasium.spec(ENVIRONMENT))
        spec.max_episode_steps, spec.kwargs = self._steps, self._arguments
        return spec

    def arrays(self, closing: dict[str, Any], steps: Steps) -> dict[str, Any]:
        """The arrays of an episode: those of Minari, and infos with a row per capture."""
        import numpy as np

        from ..conventions import to_bytes
        from ..rewards import rewards, scores

        def column(name: str) -> Any:
            return np.array([step[name] for step in steps], np.float64)

        true, commanded, measured, count = column("true_pose"), column("commanded_pose"), column("measured"), len(steps) - 1
        score = scores("combined", measured, true, self.bench.nominal_pose, None, None)
        last = np.arange(count) == count - 1
        arrays = {
            "observations": to_bytes(self._frames(closing, steps), self._batch.white)[:, None],
            "actions": np.clip(commanded[1:], 0, 1).astype(np.float32),
            "rewards": rewards("paper", score[:-1], score[1:], score[1:], true[1:], None),
            "terminations": last & (closing["end"] == "finished"), "truncations": last & (closing["end"] == "budget_spent"),
            "commanded_pose": commanded, "true_pose": true, "recommended_pose": column("recommended_pose"),
            "measured_error": measured}
        for name in ("commanded", "recommended"):
            if steps[0][f"{name}_mse"] is not None:
                arrays[f"{name}_error"] = self._score.shown(column(f"{name}_mse"))
        return arrays

    def _frames(self, closing: dict[str, Any], steps: Steps) -> Any:
        """The captures of a trial, shape (steps, height, width), in the scene's units."""
        import numpy as np

        where = f"the trial of '{closing['algorithm']}' on instance {closing['instance']} of '{closing['scene']}'"
        self._batch.reset([0], [closing["instance"]], "benchmark")
        seed = int(closing["instance_seed"])
        if self._batch.instance(0)["seed"] != seed:
            raise ValueError(f"{where} has another seed than the suite's instance; sealed suites cannot be exported")
        frames = []
        for step in steps:
            if step["measured"] is None:
                raise ValueError(f"{where} has captures of regions, which are not whole images; leave the method out with "
                                 "--only algorithm=NAME")
            frame = self._batch.capture_at([0], [step["true_pose"]], [frame_seed(seed, step["step"])])[0]
            measured = self._score.measured(frame, self.bench.reference)
            if not math.isclose(measured, step["measured"], rel_tol=LARGEST_DIFFERENCE, abs_tol=1e-9):
                raise ValueError(f"{where} cannot be rendered again: the image of step {step['step']} has a score of "
                                 f"{measured:.8g}, recorded {step['measured']:.8g}; export with the version that ran it")
            frames.append(frame)
        return np.stack(frames)


def frame_seed(instance_seed: int, step: int) -> int:
    """The seed of a capture's noise, as in core/foundation/base/seeds.h: Philox4x32-10 (Salmon et al. 2011)."""
    low = 2**32 - 1
    counter, key = [step, 0, 0, 0x4652414D], [instance_seed & low, instance_seed >> 32]
    for _ in range(10):
        first, second = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
        counter = [(second >> 32) ^ counter[1] ^ key[0], second & low, (first >> 32) ^ counter[3] ^ key[1], first & low]
        key = [(key[0] + 0x9E3779B9) & low, (key[1] + 0xBB67AE85) & low]
    return counter[0] << 32 | counter[1]
