"""What a trial shows to an algorithm."""

import json
import math

from .images import Box, SharedImage, as_image
from .services import Model, Outcome, Prepared, Stopped


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
        self._model = None
        self._prepared = None
        self._pixels = SharedImage(task["image"]) if task.get("image") else None

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
            self._reference = self._pixels.next_image()
        return self._reference

    def measures(self):
        """What `measure` can tell: [{"name": "mtf", "summary": "...", "arguments": {...}}, ...]."""
        return self._service("relign.measures/1", "list")["measures"]

    def measure(self, name, **arguments):
        """One measure of the last capture; NaN when this capture does not allow it. Needs "images" in knows."""
        value = self._service("relign.measures/1", "measure", name=name, arguments=arguments)["value"]
        return math.nan if value is None else value

    def draw_prior(self, number):
        """Draw `number` of the noise level's distribution, never this trial's: {"start", "distortion", "elements"},
        and "cure_shift" where the level draws one.
        Needs "level" in knows."""
        return self._service("relign.prior/1", "draw", number=number)["drawn"]

    def model(self):
        """A simulator of the scene's design, for lenses and seeds of your own (Model). Needs "design" in knows."""
        if self._model is None:
            self._model = Model(self, self._service("relign.model/1", "scene"))
        return self._model

    def prepared(self):
        """What was learnt beforehand on other instances (Prepared). Needs `prepare` in the class."""
        if self._prepared is None:
            self._prepared = Prepared(self)
        return self._prepared

    def run(self, parameter, steps, /, **parameters):
        """Hand-over: the algorithm that your parameter of type "algorithm" names drives for at most so many of your
        steps, with these changes to its own parameters. Returns an Outcome; raises RuntimeError with its sentence when
        it failed, and you may go on."""
        request = {"parameter": parameter, "steps": steps, "parameters": parameters}
        answer = self._host.exchange(self._request("relign.run/1", "run", request))
        last = answer.get("last")
        if last is not None:  # after a failure too
            self._latest = last["step"]
        answer = self._offered(self._host.checked(answer))
        if answer["message"] == "stop":
            return Outcome()
        return Outcome(
            answer["steps"],
            answer["end"] == "finished",
            *(Observation(seen, self) if seen else None for seen in (last, answer["best"])),
            tuple(answer["recommendation"]) if answer["recommendation"] else None,
        )

    def _service(self, service, call, **arguments):
        return self._offered(self._answer(service, call, arguments))

    def _answer(self, service, call, arguments):
        """What the host says, "unsupported" included."""
        answer = self._host.ask(self._request(service, call, arguments))
        if answer["message"] == "stop":
            raise Stopped()
        return answer

    @staticmethod
    def _request(service, call, arguments):
        request = dict(arguments, message="service", service=service, call=call)
        return json.dumps(request, allow_nan=False) + "\n"

    @staticmethod
    def _offered(answer):
        if answer["message"] == "unsupported":
            raise RuntimeError(answer.get("text", "the host does not offer this"))
        return answer

    def _finite(self, pose):
        values = [float(value) for value in pose]
        if not all(map(math.isfinite, values)):
            raise ValueError("a pose must be finite, found %s" % values)
        if len(values) != len(self.axes):
            raise ValueError("a pose has %d values, one per axis, found %d" % (len(self.axes), len(values)))
        return values

    def _numbers(self, pose):
        return ",".join(map(repr, self._finite(pose)))

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
        return self._pixels.image()
