"""The learning curves as they grow, for TensorBoard, MLflow and Weights & Biases, beside curve.csv.

Values are logged before the checkpoint that follows them. A run that was killed in between repeats them, and logs none twice.
"""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, Callable, Union

from .._errors import check_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .folder import RunFolder

Logger = Callable[[int, Mapping[str, float]], object]
"""Gets the number of the step, or of the pass over the data, and values by name; none is NaN or infinite."""

Loggers = Sequence[Union[str, Logger]]
"""Names of NEEDS, or functions."""

NEEDS = {"tensorboard": "tensorboard", "mlflow": "mlflow", "wandb": "wandb"}
"""Packages by name of a log."""


def check_loggers(loggers: Loggers) -> None:
    """Checks that the packages of loggers are installed.

    Raises:
        ImportError: One is not.
        ValueError: A name is unknown.
    """
    for name in loggers:
        if isinstance(name, str):
            check_name(name, NEEDS, "log")
            _package(name)


def _package(name: str) -> Any:
    try:
        return import_module(NEEDS[name])
    except ImportError as problem:
        raise ImportError(f"--log {name} needs {NEEDS[name]}: pip install {NEEDS[name]} ({problem})") from None


@contextlib.contextmanager
def opened(loggers: Loggers, folder: RunFolder, recipe: Mapping[str, Any], last: int,
           say: Callable[[str], object]) -> Iterator[Callable[[int, Mapping[str, Any]], None]]:
    """One function for all loggers; what is not a finite number is left out. Must be inside `folder.alone()`.

    Args:
        loggers: The loggers.
        folder: Folder of the run.
        recipe: Its settings.
        last: Step of the checkpoint from which the run continues; 0 at its beginning.
        say: Gets a line where a logger fails, which does not end the training.
    """
    check_loggers(loggers)
    with contextlib.ExitStack() as stack:
        opening = {"tensorboard": _tensorboard, "mlflow": _mlflow, "wandb": _wandb}
        functions = {str(one): stack.enter_context(opening[one](folder, recipe, last)) if isinstance(one, str) else one
                     for one in loggers}

        def log(step: int, values: Mapping[str, Any]) -> None:
            numbers = {name: float(value) for name, value in values.items() if _is_finite(value)}
            for name, function in functions.items():
                try:
                    function(step, numbers)
                except Exception as problem:  # whatever happens to a server shall not end a training of days
                    say(f"warning: {name} did not log step {step}: {' '.join(str(problem).split())}")

        yield log


def _is_finite(value: Any) -> bool:
    try:
        return math.isfinite(value)
    except (TypeError, OverflowError):
        return False


@contextlib.contextmanager
def _tensorboard(folder: RunFolder, recipe: Mapping[str, Any], last: int) -> Iterator[Logger]:
    from torch.utils.tensorboard import SummaryWriter

    # TensorBoard hides the events that a killed run has written after its checkpoint.
    with SummaryWriter(str(folder / "tensorboard"), purge_step=last + 1 if last else None) as writer:
        def log(step: int, values: Mapping[str, float]) -> None:
            for name, value in values.items():
                writer.add_scalar(name, value, step)
            writer.flush()

        yield log


@contextlib.contextmanager
def _mlflow(folder: RunFolder, recipe: Mapping[str, Any], last: int) -> Iterator[Logger]:
    mlflow = _package("mlflow")
    kept = _kept(folder, "mlflow")
    try:
        run = mlflow.start_run(run_id=kept, run_name=None if kept else folder.path.name)
    except Exception as problem:  # of many kinds, by the kind of the store
        raise ValueError(f"MLflow cannot {'resume' if kept else 'begin'} a run at '{mlflow.get_tracking_uri()}': {problem}; "
                         + (f"set MLFLOW_TRACKING_URI as before, or remove '{folder / 'mlflow.json'}'" if kept else
                            "set MLFLOW_TRACKING_URI to a store that it can use")) from None
    with run:
        if not kept:
            mlflow.log_params(dict(recipe))
            _keep(folder, "mlflow", run.info.run_id)
        client, logged = mlflow.MlflowClient(), {}

        def log(step: int, values: Mapping[str, float]) -> None:
            for name in values:
                if name not in logged:  # a killed run may have logged what follows its checkpoint
                    there = client.get_metric_history(run.info.run_id, name) if kept else []
                    logged[name] = max((metric.step for metric in there), default=-1)
            new = {name: value for name, value in values.items() if step > logged[name]}
            if new:
                mlflow.log_metrics(new, step=step)
            logged.update(dict.fromkeys(new, step))

        yield log


@contextlib.contextmanager
def _wandb(folder: RunFolder, recipe: Mapping[str, Any], last: int) -> Iterator[Logger]:
    kept = _kept(folder, "wandb")
    wandb = _package("wandb")
    try:
        begun = wandb.init(id=kept, resume="allow", name=folder.path.name, dir=str(folder.path), config=dict(recipe))
    except Exception as problem:  # of many kinds: no login, no network
        raise ValueError(f"Weights & Biases cannot begin a run: {problem}; run wandb login, or set "
                         "WANDB_MODE=offline") from None
    with begun as run:
        _keep(folder, "wandb", run.id)
        yield lambda step, values: run.log(dict(values), step=step)


def _kept(folder: RunFolder, name: str) -> str | None:
    file = folder / f"{name}.json"
    try:
        return str(json.loads(file.read_text())["run"]) if file.is_file() else None
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"'{file}' is damaged; restore it from a copy, or remove it for a new run of {name}") from None


def _keep(folder: RunFolder, name: str, run: str) -> None:
    folder.keep_text(f"{name}.json", json.dumps({"run": run}) + "\n")
