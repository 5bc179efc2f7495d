"""Services of a trial whose classes are written by hand; service_classes.py has the others (docs/services.md)."""

from __future__ import annotations

import operator
import os

from .images import SharedImage
from .pixels import write_all
from .service import Service, TrialWithServices, number_or_nan, rows

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from .scenes import Offsets
    from .trial import Observation


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


class Model(Service):
    """A simulator of the scene's design, independent of the trial's instance. `Trial.model` makes it.

    Attributes:
        scene: The scene's description: axes, nominal_pose, elements, image.
        width: Columns of its images.
        height: Rows of its images.
    """

    ID = "relign.model/1"
    MEMBERS = ("scene", "image_width", "image_height")
    scene: dict[str, Any]
    image_width: int
    image_height: int

    def __init__(self, trial: TrialWithServices) -> None:
        super().__init__(trial)
        self.width: int = self.image_width
        self.height: int = self.image_height
        self._pixels: SharedImage | None = None

    def mount(self, offsets: Offsets | None = None) -> Lens:
        """Assembles a lens; at most 16 at a time. Use it in a `with` statement, or call its `unmount`.

        Args:
            offsets: Offsets by element: {"L2": {"shift_mm": [0.01, 0, 0]}}; None: the perfect lens.

        Raises:
            ValueError: An element is unknown, or 16 lenses are mounted.
        """
        return Lens(self, self._ask("mount", offsets=offsets or {})["lens"])

    def _image(self, place: dict[str, Any]) -> Any:
        if self._pixels is None:
            self._pixels = SharedImage(dict(place, width=self.width, height=self.height))
        return self._pixels.image()


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
        return self._image("capture", pose, seed=operator.index(seed))

    def noise_free(self, pose: Iterable[float]) -> Any:
        """A noise-free image, as from `capture`; None where the scene does not offer it."""
        return self._image("noise_free", pose)

    def slopes(self, pose: Iterable[float], seed: int, samples: int, elements: Sequence[int] = ()) -> Any:
        """A noise-free image and its derivatives, from `samples` rays per pixel; None where the scene offers none.

        Args:
            pose: The true pose.
            seed: Other seeds give independent images.
            samples: Rays per pixel, at least 1.
            elements: Different elements by number, in the order of the scene's "elements".

        Returns:
            float32, shape (1 + axes + 5 * elements, height, width): the image; its derivative by each axis, per whole
            travel; for each element those by its offsets shift_mm x, y, z (per mm) and tilt_deg x, y (per degree).
        """
        pose, chosen = list(pose), [operator.index(element) for element in elements]
        return self._image("slopes", pose, 1 + len(pose) + 5 * len(chosen), seed=operator.index(seed),
                           samples=operator.index(samples), elements=chosen)

    def fields(self, pose: Iterable[float], arguments: dict[str, Any]) -> Sequence[dict[str, Any]] | None:
        """Where this lens images the fields of the scene, in their order, and how sharply, from rays; None: not offered.

        Args:
            pose: The true pose.
            arguments: {"cycles_per_pixel": 0.1} or {"lp_per_mm": 50}.

        Returns:
            For each field {"x_px", "y_px", "tangential", "sagittal"}: the place of its point, from the middle of the first
            column and of the top row, NaN without light; MTF of the lens alone, without pixels.
        """
        answer = self._ask("fields", pose=self._model._trial._finite(pose), arguments=dict(arguments))
        return None if answer["message"] == "unsupported" else rows(self._model._trial._offered(answer)["fields"])

    def measure(self, name: str, arguments: dict[str, Any] | None = None) -> float:
        """One measure of the last image that `capture` or `noise_free` made of this lens, as `Measures.measure`."""
        answer = self._ask("measure", name=name, arguments=dict(arguments or {}))
        return number_or_nan(self._model._trial._offered(answer)["value"])

    def unmount(self) -> None:
        """Frees the lens; a second call has no effect."""
        if self._number is not None:
            number, self._number = self._number, None
            self._model._ask("unmount", lens=number)

    def __enter__(self) -> Lens:
        return self

    def __exit__(self, *_: object) -> None:
        self.unmount()

    def _ask(self, call: str, **arguments: Any) -> Any:
        if self._number is None:
            raise ValueError("this lens is no longer mounted")
        return self._model._trial._answer(self._model.ID, call, lens=self._number, **arguments)

    def _image(self, call: str, pose: Iterable[float], images: int | None = None, **arguments: Any) -> Any:
        model = self._model
        answer = self._ask(call, pose=model._trial._finite(pose), **arguments)
        if call != "capture" and answer["message"] == "unsupported":
            return None
        place = model._trial._offered(answer)["pixels"]
        if images is not None:
            return SharedImage(dict(place, width=model.width, height=model.height)).images(images)
        return model._image(place)


class Pretraining(Service):
    """Pretraining: what the algorithm learns on source instances, which are not instances of trials.

    Needs the class attribute `prepare`. Where the host pretrains nothing, `active` is False and `load` returns None.

    Attributes:
        active: Whether this trial is on a source instance: step through it and save.
        source: Number of the source instance, from 0; 0 unless active.
        sources: How many source instances there are; 0 unless active.
    """

    ID = "relign.prepared/1"

    def __init__(self, trial: TrialWithServices) -> None:
        self._trial = trial
        answer = trial._answer(self.ID, "open")
        self._offered = answer["message"] != "unsupported"
        self.active: bool = self._offered and answer["active"] != 0
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
        answer = self._trial._answer(self.ID, "load")
        if answer["message"] == "unsupported":
            return None
        place = answer["data"]
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
        place = self._ask("room", bytes=len(view))["room"]
        descriptor = os.open(place["file"], os.O_WRONLY | os.O_CLOEXEC)
        try:
            write_all(descriptor, view, place["offset"])
        finally:
            os.close(descriptor)
        self._ask("save", data=len(view))
