"""What a trial shows to an algorithm."""

import json
import math
import mmap

from .images import Box, as_image


class Observation:
    """One step as the algorithm sees it: a move and the capture after it.

    step             0 = the capture at the start pose
    pose             commanded, one value per axis
    merit            smaller is better; NaN unless the class knows "merit"
    limits           per axis: -1 met its lower limit during this move, +1 its upper limit, 0 neither
    machine_seconds  simulated machine time since the start
    image            float32, height x width, row 0 on top, read-only: a numpy array, without numpy an Image. Look at
                     it before the next step; what was looked at may be kept.
    """

    __slots__ = ("step", "pose", "merit", "limits_low", "limits_high", "machine_seconds", "_talk", "_image")

    def __init__(self, message, talk):
        merit = message["merit"]
        self.step = message["step"]
        self.pose = tuple(message["pose"])
        self.merit = math.nan if merit is None else merit
        self.limits_low = message["limits_low"]
        self.limits_high = message["limits_high"]
        self.machine_seconds = message["machine_seconds"]
        self._talk = talk
        self._image = None

    @property
    def limits(self):
        return tuple(
            -1 if self.limits_low >> axis & 1 else 1 if self.limits_high >> axis & 1 else 0
            for axis in range(len(self.pose))
        )

    @property
    def image(self):
        if self._image is None:
            self._image = self._talk._pixels_of(self)
        return self._image

    def __repr__(self):
        return "Observation(step=%d, pose=%r, merit=%r)" % (self.step, self.pose, self.merit)


class Talk:
    """The host's side of one trial.

    axes          [{"name": "x", "unit": "mm", "travel": 2.0}, ...]: travel = length of [0, 1]
    budget        steps granted after step 0
    seed          the algorithm's own seed: same seed, same trial
    knows         what this trial shows, a frozenset of words
    largest_move  per axis and step, share of the travel; infinity when unlimited. Longer moves are cut
    box           the box to search, in commanded coordinates
    first         step 0: the capture at the start pose; costs nothing
    """

    def __init__(self, host, task):
        self._host = host
        self.axes = task["axes"]
        self.budget = task["budget"]
        self.seed = task["seed"]
        self.knows = frozenset(task["knows"])
        largest_move = task.get("largest_move")
        self.largest_move = math.inf if largest_move is None else largest_move
        box = task.get("box")
        self._box = Box(box["lower"], box["upper"]) if box else None
        self._first = None
        self._reference = None
        self._latest = 0
        self._pixels = None
        image = task.get("image")
        if image:
            self._shape = (image["height"], image["width"])
            self._file = image["file"]
            with open(image["file"], "rb") as file:
                size = 4 * image["height"] * image["width"]
                self._pixels = mmap.mmap(file.fileno(), size, access=mmap.ACCESS_READ)

    @property
    def box(self):
        if self._box is None:
            raise RuntimeError('no box was granted: add "box" to the class\'s knows')
        return self._box

    @property
    def first(self):
        if self._first is None:
            self._first = self._seen(self._host.ask('{"message":"first"}\n'))
        return self._first

    def step(self, pose):
        """One move to an absolute commanded pose and one capture: an Observation, or None once the budget is spent
        or the run was stopped; then return soon (the host waits some seconds)."""
        return self._seen(self._host.ask('{"message":"step","pose":[%s]}\n' % self._numbers(pose)))

    def move(self, delta):
        """The same for a move relative to where the stage is."""
        return self._seen(self._host.ask('{"message":"move","delta":[%s]}\n' % self._numbers(delta)))

    def recommend(self, pose):
        """"I would glue here now": a commanded pose. Costs nothing; stays until the next one."""
        self._host.ask('{"message":"recommend","pose":[%s]}\n' % self._numbers(pose))

    @property
    def reference(self):
        """The image to be reached (O*), like seen.image; needs "images" in knows."""
        if self._pixels is None:
            raise RuntimeError('no image was granted: add "images" to the class\'s knows')
        if self._reference is None:
            self._offered(self._host.ask('{"message":"reference"}\n'))
            with open(self._file, "rb") as file:
                size = len(self._pixels)
                file.seek(size)
                self._reference = as_image(file.read(size), *self._shape)
        return self._reference

    def measures(self):
        """What `measure` can tell: [{"name": "mtf", "summary": "...", "arguments": {...}}, ...]."""
        return self._service("relign.measures/1", "list")["measures"]

    def measure(self, name, **arguments):
        """One measure of the last capture; NaN when this capture does not allow it. Needs "images" in knows."""
        value = self._service("relign.measures/1", "measure", name=name, arguments=arguments)["value"]
        return math.nan if value is None else value

    def draw_prior(self, number):
        """Draw `number` of the noise level's distribution, never this trial's: {"start", "distortion", "elements"}.
        Needs "level" in knows."""
        return self._service("relign.prior/1", "draw", number=number)["drawn"]

    def _service(self, service, call, **arguments):
        request = dict(arguments, message="service", service=service, call=call)
        return self._offered(self._host.ask(json.dumps(request, allow_nan=False) + "\n"))

    @staticmethod
    def _offered(answer):
        if answer["message"] == "unsupported":
            raise RuntimeError(answer.get("text", "the host does not offer this"))
        return answer

    def _numbers(self, pose):
        text = ",".join([repr(float(value)) for value in pose])
        if "n" in text:  # nan, inf
            raise ValueError("a pose must be finite, found [%s]" % text)
        if len(pose) != len(self.axes):
            raise ValueError("a pose has %d values, one per axis, found %d" % (len(self.axes), len(pose)))
        return text

    def _seen(self, answer):
        if answer["message"] == "stop":
            return None
        self._latest = answer["step"]
        return Observation(answer, self)

    def _pixels_of(self, seen):
        if self._pixels is None:
            raise RuntimeError('no image was granted: add "images" to the class\'s knows')
        if seen.step != self._latest:
            raise RuntimeError(
                "the pixels of step %d are gone (this is step %d): look at seen.image before the next step"
                % (seen.step, self._latest)
            )
        return as_image(self._pixels[:], *self._shape)
