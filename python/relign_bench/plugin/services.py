"""What a trial offers besides moving and looking (docs/services.md)."""

import os

from .images import SharedImage
from .pixels import write_all


class Stopped(BaseException):
    """Raised by what works for long (draw_prior, the model) once the user stopped the run. Let it pass: it ends run and
    is no failure. Not an Exception, so that whoever handles failures does not go on by mistake."""


class Outcome:
    """What another algorithm did with some of your steps. Poses are yours to use.

    steps           used of your budget; 0 when none was left
    finished        it returned before its steps were used up
    last            Observation of where the stage is now; None when no step was left
    best            Observation of the lowest merit; None unless "merit" is granted. It has an image only when it is last
    recommendation  what it would glue at, or None; counts only when you recommend it
    """

    __slots__ = ("steps", "finished", "last", "best", "recommendation")

    def __init__(self, steps=0, finished=False, last=None, best=None, recommendation=None):
        self.steps = steps
        self.finished = finished
        self.last = last
        self.best = best
        self.recommendation = recommendation

    def __repr__(self):
        return "Outcome(steps=%d, finished=%r, last=%r, best=%r, recommendation=%r)" % (
            self.steps,
            self.finished,
            self.last,
            self.best,
            self.recommendation,
        )


class Model:
    """A simulator of the scene's design; it knows nothing of this trial's lens.

    scene   the scene's description: axes, nominal_pose, elements, image
    width   of its images, pixels
    height
    """

    SERVICE = "relign.model/1"

    def __init__(self, talk, answer):
        self.scene = answer["scene"]
        self.width = answer["image"]["width"]
        self.height = answer["image"]["height"]
        self._talk = talk
        self._pixels = SharedImage(answer["image"])

    def mount(self, offsets=None):
        """A Lens of your own: {"L2": {"shift_mm": [0.01, 0, 0]}}; without offsets the perfect one. 16 at a time; use it
        with `with`, or unmount it."""
        return Lens(self, self._ask("mount", offsets=offsets or {})["lens"])

    def _ask(self, call, **arguments):
        return self._talk._service(self.SERVICE, call, **arguments)


class Lens:
    """A lens in the model. Poses are true poses: 0..1 per axis, without any stage."""

    def __init__(self, model, number):
        self._model = model
        self._number = number

    def capture(self, pose, seed):
        """A noisy image: the same offsets, pose and seed are the same pixels in every trial."""
        return self._image("capture", pose, seed=seed)

    def noise_free(self, pose):
        """The same without noise; None when the scene does not offer it."""
        return self._image("noise_free", pose)

    def unmount(self):
        """Nothing the second time."""
        if self._number is not None:
            number, self._number = self._number, None
            self._model._ask("unmount", lens=number)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.unmount()

    def _image(self, call, pose, **arguments):
        if self._number is None:
            raise ValueError("this lens is not mounted any more")
        model = self._model
        request = dict(arguments, lens=self._number, pose=model._talk._finite(pose))
        answer = model._talk._answer(model.SERVICE, call, request)
        if call == "noise_free" and answer["message"] == "unsupported":
            return None
        model._talk._offered(answer)
        return model._pixels.image()


class Prepared:
    """What this algorithm learnt beforehand, on source instances that are no trial's. Where the host prepares nothing
    (no `prepare` in the class), preparing is False and nothing can be loaded.

    preparing  True: this conversation is on a source instance; look around and save
    source     number of this source, from 0; sources: how many there are. While preparing, else 0
    """

    SERVICE = "relign.prepared/1"

    def __init__(self, talk):
        self._talk = talk
        answer = talk._answer(self.SERVICE, "source", {})
        self._offered = answer["message"] != "unsupported"
        self.preparing = answer["preparing"] if self._offered else False
        self.source = answer["source"] if self._offered else 0
        self.sources = answer["sources"] if self._offered else 0

    def load(self):
        """bytes: in a trial the prepared data, while preparing what the sources before left. None when there are none;
        a RuntimeError when the preparation failed. They come from a file that anybody may have touched: check them."""
        if not self._offered:
            return None
        place = self._talk._service(self.SERVICE, "load")
        if place["bytes"] is None:
            return None
        with open(place["file"], "rb") as file:
            file.seek(place["offset"])
            return file.read(place["bytes"])

    def save(self, data):
        """Keeps these bytes (at most 1 GiB) in the place of what was there. Only while preparing: a ValueError in a
        trial."""
        data = memoryview(data).cast("B")
        if not self._offered:
            raise ValueError("this host prepares nothing for a class without `prepare`: look at preparing first")
        place = self._talk._service(self.SERVICE, "room", bytes=len(data))
        descriptor = os.open(place["file"], os.O_WRONLY | os.O_CLOEXEC)
        try:
            write_all(descriptor, data, place["offset"])
        finally:
            os.close(descriptor)
        self._talk._service(self.SERVICE, "save", bytes=len(data))
