"""Services of a trial, besides moving and capturing (docs/services.md)."""

from __future__ import annotations

import os

from .images import SharedImage
from .pixels import write_all

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    from .scenes import Offsets
    from .trial import Observation, Trial


class Stopped(BaseException):
    """Raised by long-running services (draw_prior, the model) once the user has stopped the run.

    Let it pass: it ends `run` and is not a failure. It is not an Exception, so that an `except Exception` does not continue
    by mistake.
    """


class Outcome:
    """Result of `Trial.run`: what another algorithm did with some of the steps. Poses are in the caller's coordinates.

    Args:
        steps: Steps used of the caller's budget; 0 when none was left.
        finished: Whether the algorithm returned before its steps were used up.
        last: Observation of the current pose; None when no step was left.
        best: Observation with the lowest merit; None unless the caller observes "merit". It has an image only if it is `last`.
        recommendation: The pose that the algorithm recommended, or None. It counts only if the caller recommends it.
    """

    __slots__ = ("steps", "finished", "last", "best", "recommendation")

    def __init__(self, steps: int = 0, finished: bool = False, last: Observation | None = None,
                 best: Observation | None = None, recommendation: tuple[float, ...] | None = None) -> None:
        self.steps = steps
        self.finished = finished
        self.last = last
        self.best = best
        self.recommendation = recommendation

    def __repr__(self) -> str:
        return (f"Outcome(steps={self.steps}, finished={self.finished!r}, last={self.last!r}, best={self.best!r}, "
                f"recommendation={self.recommendation!r})")


class Model:
    """A simulator of the scene's design, independent of the trial's instance. `Trial.model` makes it.

    Attributes:
        scene: The scene's description: axes, nominal_pose, elements, image.
        width: Columns of its images.
        height: Rows of its images.
    """

    SERVICE = "relign.model/1"

    def __init__(self, trial: Trial, answer: dict[str, Any]) -> None:
        self.scene: dict[str, Any] = answer["scene"]
        self.width: int = answer["image"]["width"]
        self.height: int = answer["image"]["height"]
        self._trial = trial
        self._pixels = SharedImage(answer["image"])

    def mount(self, offsets: Offsets | None = None) -> Lens:
        """Assembles a lens; at most 16 at a time. Use it in a `with` statement, or call its `unmount`.

        Args:
            offsets: Offsets by element: {"L2": {"shift_mm": [0.01, 0, 0]}}; None: the perfect lens.

        Raises:
            ValueError: An element is unknown, or 16 lenses are mounted.
        """
        return Lens(self, self._ask("mount", offsets=offsets or {})["lens"])

    def _ask(self, call: str, **arguments: Any) -> dict[str, Any]:
        return self._trial._service(self.SERVICE, call, **arguments)


class Lens:
    """A lens in the model. Poses are true poses, 0 to 1 per axis; there is no stage."""

    def __init__(self, model: Model, number: int) -> None:
        self._model = model
        self._number: int | None = number

    def capture(self, pose: Iterable[float], seed: int) -> Any:
        """A noisy image. Equal offsets, pose and seed give equal pixels in every trial.

        Returns:
            float32, shape (height, width), as Observation.image.
        """
        return self._image("capture", pose, seed=seed)

    def noise_free(self, pose: Iterable[float]) -> Any:
        """A noise-free image, as from `capture`; None where the scene does not offer it."""
        return self._image("noise_free", pose)

    def unmount(self) -> None:
        """Frees the lens; a second call has no effect."""
        if self._number is not None:
            number, self._number = self._number, None
            self._model._ask("unmount", lens=number)

    def __enter__(self) -> Lens:
        return self

    def __exit__(self, *_: object) -> None:
        self.unmount()

    def _image(self, call: str, pose: Iterable[float], **arguments: Any) -> Any:
        if self._number is None:
            raise ValueError("this lens is no longer mounted")
        model = self._model
        request = dict(arguments, lens=self._number, pose=model._trial._finite(pose))
        answer = model._trial._answer(model.SERVICE, call, request)
        if call == "noise_free" and answer["message"] == "unsupported":
            return None
        model._trial._offered(answer)
        return model._pixels.image()


class Pretraining:
    """Pretraining: what the algorithm learns on source instances, which are not instances of trials.

    Needs the class attribute `prepare`. Where the host pretrains nothing, `active` is False and `load` returns None.

    Attributes:
        active: Whether this trial is on a source instance: step through it and save.
        source: Number of the source instance, from 0; 0 unless active.
        sources: How many source instances there are; 0 unless active.
    """

    SERVICE = "relign.prepared/1"

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        answer = trial._answer(self.SERVICE, "source", {})
        self._offered = answer["message"] != "unsupported"
        self.active: bool = answer["active"] if self._offered else False
        self.source: int = answer["source"] if self._offered else 0
        self.sources: int = answer["sources"] if self._offered else 0

    def load(self) -> bytes | None:
        """The saved bytes: in a trial those of the whole pretraining, while active those of the earlier sources.

        They come from a file that others can write to: validate them.

        Returns:
            None if nothing was saved.

        Raises:
            RuntimeError: The pretraining failed.
        """
        if not self._offered:
            return None
        place = self._trial._service(self.SERVICE, "load")
        if place["bytes"] is None:
            return None
        with open(place["file"], "rb") as file:
            file.seek(place["offset"])
            return file.read(place["bytes"])

    def save(self, data: bytes | bytearray | memoryview) -> None:
        """Replaces the saved bytes.

        Args:
            data: At most 1 GiB.

        Raises:
            ValueError: The trial is not on a source instance.
        """
        view = memoryview(data).cast("B")
        if not self._offered:
            raise ValueError("this host pretrains nothing for a class without `prepare`; check `active` first")
        place = self._trial._service(self.SERVICE, "room", bytes=len(view))
        descriptor = os.open(place["file"], os.O_WRONLY | os.O_CLOEXEC)
        try:
            write_all(descriptor, view, place["offset"])
        finally:
            os.close(descriptor)
        self._trial._service(self.SERVICE, "save", bytes=len(view))
