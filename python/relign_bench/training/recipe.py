"""Recipes of `relign-train ppo`: the settings of a run, and the named presets."""

from __future__ import annotations

import pathlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from .._errors import check_name, unknown_name
from ..rewards import REWARDS
from .folder import kind_of, read_recipe

if TYPE_CHECKING:
    from .folder import Path

ALGORITHMS = ("ppo", "a2c", "trpo", "recurrent-ppo")  # those that the paper compares
INPUTS = ("float32", "uint8")
SHAPED = "shaped"
"""Name of the reward of the preset "tuned" (privileged.py), which needs the instances' optima."""
SHAPED_EVEN = "shaped_even"
"""Name of the same reward where no direction counts less than a tenth of that with the strongest effect (shaped.py)."""
SHAPED_NEAR = "shaped_near"
"""Name of the reward of "tuned" minus the distance to the nominal pose where it exceeds 0.1, as in the reward "paper"."""
SHAPED_PAPER = "shaped_paper"
"""Name of the reward "paper" plus a tenth of that of "tuned"."""
SHAPED_LINEAR = "shaped_linear"
"""Name of the reward "paper" with the excess RMSE to first order in place of the measured one."""
SHAPED_REWARDS = (SHAPED, SHAPED_EVEN, SHAPED_NEAR, SHAPED_PAPER, SHAPED_LINEAR)
TUNED_LEVELS = (0.0, 0.125, 0.25, 0.375, 0.5)
"""Noise levels N of the preset "tuned"."""
NETWORK = {"algorithm": "--algorithm ", "scene": "--scene ", **{name: f"--set {name}=" for name in
                                                                ("size", "input", "heads", "frames")}}
"""Settings that a run shares with the one whose network it continues, presets "paper" and "package", as options."""
SMALLEST = 64  # columns: the package's network halves the image six times


@dataclass
class Recipe:
    """Settings of a run; recipe.json has them under these names, and python/README.md documents them.

    The defaults are the preset "paper": network, inputs and episodes of the paper's package (relign 0.1.0), and the rate,
    entropy weight, reward and length of the paper's text.
    """

    preset: str = "paper"
    algorithm: str = "ppo"
    scene: str = "relign_od"
    noise_level: str = "rho"  # id or preset; `level` is its parameter
    size: int = 200  # columns of the images
    input: str = "float32"  # irradiance, or "uint8": bytes / 255
    heads: tuple[int, ...] = (64, 64)  # hidden layers of actor and critic, each with its own
    level: float = 0.25
    reward: str = "paper"
    goal: float = 0.0555  # score below which an episode ends; the package's for N = 0.25
    episode: int = 200  # steps at most
    frames: int = 5  # latest images in an observation, zeros before the start
    environments: int = 5
    steps: int = 100  # of each environment between two updates
    batch: int = 500
    epochs: int = 5
    gamma: float = 0.9
    gae_lambda: float = 0.95
    clip: float = 0.2
    rate: float = 1e-4
    last_rate: float = 1e-4
    entropy: float = 1e-3
    target_kl: float = 0.0  # 0: no early stop
    first_log_std: float = -3.0
    total: int = 2_000_000  # steps of all environments
    stretch: int = 20_000  # length of a training segment, in steps of all environments
    warm_start: str = ""  # hash of the initial weights
    optimum_samples: int = 384
    warm_up: int = 0  # training segments in which only the critic learns
    seed: int = 0

    def __post_init__(self) -> None:
        self.heads = tuple(self.heads)  # JSON has a list


GOALS = {0.0: 0.051, 0.25: 0.0555, 0.5: 0.060}  # the package's, by noise level N

PRESETS = {
    "paper": Recipe(),
    # What the package's code has instead of the text's values.
    "package": Recipe(preset="package", noise_level="rho0-package", reward="minus_one", rate=3e-4, last_rate=3e-4, entropy=0.1,
                      total=5_000_000),
    # Met the criterion of docs/training.md once, after a second run with a rate that falls to zero.
    "linear": Recipe(preset="linear", size=100, reward=SHAPED_LINEAR, goal=0.0, episode=40, rate=3e-4, last_rate=3e-4,
                     total=620_000),
    # One policy for all levels, with the network of imitation learning, which observes one small image.
    "tuned": Recipe(preset="tuned", size=100, input="uint8", heads=(), level=0.5, reward=SHAPED, goal=0.0, episode=12, frames=1,
                    environments=160, steps=12, batch=960, epochs=4, rate=3e-6, last_rate=0.0, entropy=0.0, target_kl=0.03,
                    first_log_std=-1.0, total=480_000, stretch=19_200, warm_up=1),
}

# Where the package's configuration of another algorithm differs from that of PPO, Stable-Baselines3's defaults included.
_OF_ALGORITHM: dict[str, dict[str, Any]] = {"ppo": {}, "a2c": {"gae_lambda": 1.0}, "trpo": {"batch": 50},
                                            "recurrent-ppo": {"batch": 100}}


def preset_recipe(preset: str, algorithm: str = "ppo", scene: str = "relign_od", seed: int = 0) -> Recipe:
    """The recipe of a preset with the package's values for an algorithm.

    Raises:
        ValueError: The preset or the algorithm is unknown.
    """
    if preset not in PRESETS:
        raise ValueError(unknown_name("preset", preset, list(PRESETS)))
    check_name(algorithm, ALGORITHMS, "algorithm")
    recipe = replace(PRESETS[preset], algorithm=algorithm, scene=scene, seed=seed, **_OF_ALGORITHM[algorithm])
    return replace(recipe, entropy=0.0) if (preset, algorithm) == ("package", "a2c") else recipe


def check_recipe(recipe: Recipe) -> None:
    """Checks what the single settings do not decide.

    Raises:
        ValueError: A setting is not valid.
    """
    check_name(recipe.preset, list(PRESETS), "preset")
    check_name(recipe.algorithm, ALGORITHMS, "algorithm")
    check_name(recipe.input, INPUTS, "input")
    check_name(recipe.reward, (*REWARDS, *SHAPED_REWARDS), "reward")
    if recipe.preset != "tuned" and recipe.size < SMALLEST:
        raise ValueError(f"size={recipe.size} is too small: the package's network halves images six times and needs at least "
                         f"{SMALLEST} columns")
    if recipe.preset == "tuned" and recipe.algorithm != "ppo":
        raise ValueError(f"preset 'tuned' has no algorithm '{recipe.algorithm}'; use ppo, or --preset paper")
    if recipe.preset == "tuned" and recipe.reward != SHAPED:
        raise ValueError(f"preset 'tuned' has the reward '{SHAPED}' only, not '{recipe.reward}'; add --preset paper")
    if recipe.preset == "tuned" and recipe.environments % len(TUNED_LEVELS):
        raise ValueError(f"environments={recipe.environments} must be a multiple of {len(TUNED_LEVELS)}, the number of noise "
                         "levels of preset 'tuned'")
    if recipe.stretch % (recipe.environments * recipe.steps):
        raise ValueError(f"stretch={recipe.stretch} must be a multiple of environments * steps, here "
                         f"{recipe.environments * recipe.steps}: a training segment consists of whole rollouts")


def check_warm_start(recipe: Recipe, folder: Path | None) -> pathlib.Path | None:
    """The checkpoint of the initial weights; None for a run that starts from scratch.

    Args:
        recipe: The recipe.
        folder: For preset "tuned" the folder of a run of relign-train imitate; for the others None, or that of a run of
            relign-train ppo whose network the recipe has, too.

    Raises:
        ValueError: The preset needs a folder and none is given, or the folder does not suit.
    """
    if folder is None:
        if recipe.preset == "tuned":
            raise ValueError("preset 'tuned' needs --warm-start FOLDER, the folder of a run of relign-train imitate")
        return None
    if not str(folder):
        raise ValueError("--warm-start '' names no folder")
    if recipe.preset == "tuned" and kind_of(read_recipe(folder)) == "ppo":
        raise ValueError(f"'{folder}' is the folder of a run of relign-train ppo; expected one of relign-train imitate; or add "
                         "--preset paper")
    kept = read_recipe(folder, "imitate" if recipe.preset == "tuned" else "ppo")
    if kept.get("preset") == "tuned":
        raise ValueError(f"--warm-start '{folder}' is of preset tuned, whose network is another one; preset '{recipe.preset}' "
                         "starts from scratch or from a run of presets paper, package or linear")
    for name in ("size",) if recipe.preset == "tuned" else NETWORK:
        there, here = setting_text(kept.get(name)), setting_text(getattr(recipe, name))
        if there != here:
            raise ValueError(f"--warm-start '{folder}' has a network for {name}={there}, not {here or '()'}; add "
                             f"{NETWORK[name]}{there}")
    checkpoint = pathlib.Path(folder) / "checkpoint.pt"
    if not checkpoint.is_file():
        raise ValueError(f"nothing trained yet: --warm-start '{folder}' has no checkpoint.pt")
    return checkpoint


def setting_text(value: Any) -> str:
    """A value as --set takes it."""
    return ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
