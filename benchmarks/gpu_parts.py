"""The parts of gpu_all.py in order of their worth: what each measures, needs and runs."""

from __future__ import annotations

import json
import pathlib
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    Command = Callable[["Place", float], list[str]]

HERE = pathlib.Path(__file__).resolve().parent
TRAININGS = HERE / "gpu_trainings.py"
STUDY = HERE.parent / "python" / "recipes" / "paper_study.json"


@dataclass(frozen=True)
class Place:
    """Where parts run: the kit (gpu_bundle.sh), folders, the sanitizer's path, and whether sizes are those of tests."""

    kit: pathlib.Path
    work: pathlib.Path
    state: pathlib.Path
    out: pathlib.Path
    ledger: pathlib.Path
    small: bool = False
    sanitizer: str = "compute-sanitizer"

    def scene(self, name: str) -> str:
        """The file of a scene of the kit."""
        return str(self.kit / "plugins" / "lens_system" / name / "scene.json")


@dataclass(frozen=True)
class Part:
    """One part.

    Attributes:
        name: Its id in the ledger.
        about: What it answers, one line.
        seconds: Estimate of its length, on an H200; of one that resumes the least that is worth a start.
        needs: Names of gpu_probe.py. Sizes of tests need no torch-gpu.
        command: Its arguments, from a place and the seconds that it has.
        resumes: Whether it takes all the time there is and resumes the next time.
    """

    name: str
    about: str
    seconds: int
    needs: tuple[str, ...]
    command: Command
    resumes: bool = False


def program(*parts: str, scene: str = "", small: tuple[str, ...] = (), full: tuple[str, ...] = (), checked: str = "",
            ) -> Command:
    """A command of relign-bench-gpu; checked: a tool of compute-sanitizer that watches it."""
    def command(place: Place, _: float) -> list[str]:
        given = [str(place.kit / "relign-bench-gpu"), *parts]
        given += ["--scene", place.scene(scene)] if scene else ["--plugins", str(place.kit / "plugins")]
        given += ["--errors", str(place.kit / "randomisation.json")] if "errors" in parts else []
        watcher = [place.sanitizer, "--tool", checked, "--error-exitcode", "9"] if checked else []
        return [*watcher, *given, *(small if place.small else full)]

    return command


def python_tests(*modules: str, small: str) -> Command:
    """A command that runs modules of the kit's tests; small: the test that stands for them."""
    def command(place: Place, _: float) -> list[str]:
        tests = [small] if place.small else modules
        there = ["sh", "-c", 'cd "$0" && exec "$@"', str(place.kit / "tests" / "python")]
        return [*there, sys.executable, "-m", "unittest", *tests]

    return command


def environment(place: Place, _: float) -> list[str]:
    """The command of gpu_environment.py."""
    small = ["--count", "4", "--rounds", "1", "--pixels", "20", "--emulated"] if place.small else []
    return [sys.executable, str(HERE / "gpu_environment.py"), *small]


# A training of one segment and a few seconds.
TINY = {"size": 100, "environments": 1, "steps": 10, "batch": 10, "epochs": 1, "episode": 5, "total": 20, "stretch": 10,
        "optimum_samples": 32}
TINY_IMITATION = ("size=40", "levels=0,0.5", "lenses=40", "pictures=2", "passes=2", "moves=3", "optimum_samples=32", "batch=32")


def trainings(only: str, jobs: int, render: str = "cuda") -> Command:
    """The command of a stretch of trainings of the paper's study."""
    def command(place: Place, seconds: float) -> list[str]:
        places = ["--work", str(place.work), "--state", str(place.state), "--ledger", str(place.ledger)]
        sizes = (["--settings", json.dumps(TINY), "--count", "1"] if place.small else
                 ["--jobs", str(jobs), "--device", "cuda", "--render", render])
        length = ["--seconds", f"{seconds:.0f}"]
        return [sys.executable, str(TRAININGS), "sweep", str(STUDY), "--only", only, *length, *places, *sizes]

    return command


def imitation(name: str, *settings: str) -> Command:
    """The command of a stretch of a training by imitation."""
    def command(place: Place, seconds: float) -> list[str]:
        arguments = [part for setting in (TINY_IMITATION if place.small else settings) for part in ("--set", setting)]
        arguments += ["--threads", "1"] if place.small else ["--device", "cuda", "--render", "cuda"]
        return [sys.executable, str(TRAININGS), "imitate", name, "--work", str(place.work), "--state", str(place.state),
                "--seconds", f"{seconds:.0f}", "--", *arguments]

    return command


GPU, TORCH = ("gpu", "nvrtc"), ("gpu", "nvrtc", "torch", "torch-gpu", "gymnasium", "module")
LEARN = (*TORCH, "stable_baselines3", "matplotlib", "onnx")
IMAGES = ("--pixels", "20", "--images", "2", "--captures", "32", "--batch", "2", "--rounds", "1")
CHECKED = ("--pixels", "40", "--images", "2", "--captures", "32", "--batch", "2", "--rounds", "1")
MEGAPIXELS = ("--images", "2", "--batch", "8", "--rounds", "5")

PARTS = (
    # (a) Is it right?
    Part("bits", "images, MSE and imaging errors of relign_od against the CPU's bits", 10, GPU,
         program("bits", "law", "errors", scene="relign_od", small=IMAGES)),
    Part("ghosts", "captures with reflections against the CPU's distribution", 30, GPU,
         program("ghosts", scene="relign_od", small=IMAGES)),
    Part("camera_2mp", "two megapixels against the CPU's bits", 40, GPU,
         program("bits", scene="camera_2mp", small=IMAGES, full=MEGAPIXELS)),
    Part("memcheck", "invalid accesses of all kernels", 40, (*GPU, "compute-sanitizer"),
         program("bits", "errors", "ghosts", scene="relign_od", small=IMAGES, full=CHECKED, checked="memcheck")),
    Part("racecheck", "races of all kernels", 40, (*GPU, "compute-sanitizer"),
         program("bits", "errors", "ghosts", scene="relign_od", small=IMAGES, full=CHECKED, checked="racecheck")),
    Part("tests", "Python tests of environment, trainings and graphs", 60, LEARN,
         python_tests("test_cuda", "test_cuda_training", "test_graphs", small="test_cuda.TheBatch")),
    # (b) How fast is it?
    Part("camera_2mp-times", "two megapixels; goal 5 ms", 30, GPU,
         program("latency", "times", scene="camera_2mp", small=IMAGES, full=MEGAPIXELS)),
    Part("latency", "one image; goal under 0.2 ms", 5, GPU,
         program("latency", scene="relign_od", small=IMAGES, full=("--rounds", "200"))),
    Part("ghost-times", "captures with reflections; goal 1,000 a second", 20, GPU,
         program("ghost-times", scene="relign_od", small=IMAGES, full=("--batch", "256"))),
    Part("batch", "resets and noise-free RMSE in one figure, without Python and torch", 30, GPU,
         program("environment", small=IMAGES)),
    Part("environment", "the same of the vector environment; goal 100,000 steps a second", 60, TORCH, environment),
    Part("images", "times of 1,024 images and their parts", 20, GPU,
         program("times", scene="relign_od", small=IMAGES)),
    # (c) and (d): what do networks reach?
    Part("ppo-200", "the paper's recipe, 200 x 200 pixels, seeds 1 to 3 at each level", 120, LEARN,
         trainings("ppo-rho*/seed-[123]", 9), resumes=True),
    Part("ppo-200-seed-4", "the same, seed 4", 120, LEARN, trainings("ppo-rho*/seed-4", 3), resumes=True),
    Part("linear-200", "preset linear, 200 x 200 pixels, five seeds", 120, LEARN, trainings("linear-200/*", 5), resumes=True),
    Part("a2c", "A2C at N = 0.25, three seeds", 120, LEARN, trainings("a2c/*", 3), resumes=True),
    Part("trpo", "TRPO at N = 0.25, three seeds", 120, (*LEARN, "sb3_contrib"), trainings("trpo/*", 3), resumes=True),
    Part("recurrent-ppo", "RecurrentPPO at N = 0.25, three seeds", 120, (*LEARN, "sb3_contrib"),
         trainings("recurrent-ppo/*", 3, render="cpu"), resumes=True),
    Part("imitation-10", "imitation with 10 times the images: is the floor of 0.0008 after twelve images lower?", 120,
         (*TORCH, "onnx"),
         imitation("imitation-10", "passes=400"), resumes=True),
    Part("imitation-100", "the same with 100 times the images", 120, (*TORCH, "onnx"),
         imitation("imitation-100", "passes=400", "lenses=12000"), resumes=True),
)
