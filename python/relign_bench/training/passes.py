"""Training in passes, each over new data, with a checkpoint after every pass: what recipes of imitation learning share."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import torch

from .devices import trained_on
from .folder import reading
from .settings import kept_recipe

if TYPE_CHECKING:
    import os
    from collections.abc import Callable
    from typing import TypeVar

    from .folder import RunFolder

    Run = TypeVar("Run", bound="PassTraining")


class PassTraining:
    """A run in a folder. Derived classes give the data of a pass, train on them, and add to the checkpoint what is theirs.

    Attributes:
        recipe: The recipe, of the class RECIPE, with passes, rate and last_rate.
        folder: The folder of the run.
        net: The network.
        threads: Threads that capture and train; None uses all cores.
        device: Torch device that trains.
        render: Where images are rendered, "cpu" or "cuda".
        log: Gets one line about each part of the work.
        curve: [pass, mean loss] of each pass.
        seconds: Time spent so far, over all sessions of the run.
        trained_on: As devices.trained_on returns it; empty before the first checkpoint.
    """

    RECIPE: type[Any]
    DATA: str  # what a pass consists of, for the log
    recipe: Any
    folder: RunFolder
    net: torch.nn.Module
    threads: int | None
    device: str
    log: Callable[[str], object]
    render = "cpu"

    def _begin(self) -> None:
        """Sets what a run without a checkpoint has."""
        self.curve: list[list[Any]] = []
        self.seconds = 0.0
        self.trained_on: dict[str, Any] = {}

    @classmethod
    def open(cls: type[Run], folder: str | os.PathLike[str], threads: int | None = None,
             log: Callable[[str], object] = lambda _: None) -> Run:
        """Opens a run, complete or not.

        Raises:
            ValueError: The folder is not that of such a run of `relign-train imitate`, or it has no checkpoint yet.
        """
        training = cls(kept_recipe(cls.RECIPE, folder), folder, threads, log)  # type: ignore[call-arg]
        if not training.load():
            raise ValueError(f"nothing trained yet in '{folder}': it has no checkpoint.pt")
        return training

    def _data(self, number: int) -> tuple[Any, Any]:
        """Inputs and residuals of pass `number`, from 0."""
        raise NotImplementedError

    def _pass(self, inputs: Any, residuals: Any, optimizer: torch.optim.Optimizer, number: int) -> float:
        """Trains on the data of a pass; returns the mean loss."""
        raise NotImplementedError

    def _state(self) -> dict[str, Any]:
        """What the checkpoint has besides network, optimizer, curve and cost."""
        raise NotImplementedError

    def _restore(self, state: dict[str, Any]) -> None:
        """Takes back what `_state` returned."""
        raise NotImplementedError

    def _train_passes(self, done: int, optimizer: torch.optim.Optimizer, log: Callable[[int, dict[str, Any]], None]) -> None:
        for number in range(done, self.recipe.passes):
            begun = time.monotonic()
            inputs, residuals = self._data(number)
            captured = time.monotonic() - begun
            loss = self._pass(inputs, residuals, optimizer, number)
            seconds = time.monotonic() - begun
            self.curve.append([number + 1, loss])
            self.seconds += seconds
            log(number + 1, {"curve/loss": loss, "curve/hours": self.seconds / 3600})
            self.log(f"pass {number + 1} of {self.recipe.passes}: loss {loss:.4f}, {len(residuals)} {self.DATA} in "
                     f"{captured:.0f} + {seconds - captured:.0f} s")
            self._save(number + 1, optimizer)

    def _set_rate(self, optimizer: torch.optim.Optimizer, passes: float) -> None:
        """The rate after so many passes: cosine decay from the first rate to the last."""
        recipe, share = self.recipe, passes / self.recipe.passes
        for group in optimizer.param_groups:
            group["lr"] = recipe.last_rate + (recipe.rate - recipe.last_rate) * 0.5 * (1 + math.cos(math.pi * share))

    def _save(self, done: int, optimizer: torch.optim.Optimizer) -> None:
        # The curve is kept with the weights, so that a resumed run does not write a line twice.
        self.trained_on = trained_on(self.trained_on, self.threads, self.device, self.render)
        state = {"net": self.net.state_dict(), "done": done, "curve": self.curve, "seconds": self.seconds,
                 "trained_on": self.trained_on, "optimizer": optimizer.state_dict(), **self._state()}
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        self.folder.keep_text("curve.csv", "pass,loss\n" + "".join(f"{row[0]},{row[1]:.6f}\n" for row in self.curve))

    def load(self, optimizer: torch.optim.Optimizer | None = None) -> int:
        """Loads the checkpoint, if there is one.

        Returns:
            Number of passes that are done; more if something after the last one is done, too.
        """
        path = self.folder / "checkpoint.pt"
        if not path.is_file():
            return 0
        with reading(path):
            state: dict[str, Any] = torch.load(path, weights_only=True, map_location=self.device)
            self.net.load_state_dict(state["net"])
            self.curve, self.seconds = state["curve"], state["seconds"]
            self.trained_on = state.get("trained_on", {})
            self._restore(state)
            if optimizer:
                optimizer.load_state_dict(state["optimizer"])
            done: int = state["done"]
        self.log(f"resuming after pass {min(done, self.recipe.passes)}")
        return done
