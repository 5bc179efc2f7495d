"""Algorithms for relign-bench in Python: derive from Optimizer or Agent, end the file with serve(YourClass).

    from relign_bench.plugin import Optimizer, parameter, serve

    class Guess(Optimizer):
        "Tries the middle of the box."

        def run(self, talk):
            talk.step(talk.box.centre())

    if __name__ == "__main__":
        serve(Guess)

`relign-bench try ./guess.py` runs it as a process of its own: it may print, fail or die, and costs its trial at
most. The class is the manifest (`python3 guess.py --manifest`): its name is the id, its docstring (or the module's)
the summary, and these class attributes say the rest:

    knows         what it is shown: "images", "merit", "start", "box", "design", "level"
    presets       {"guess-wide": {"first_stride": 0.3}}
    id, summary, license, citation, reproducible ("anywhere" or "this_cpu")

This module needs the standard library alone; with numpy, images are numpy arrays. The messages that it exchanges with
the host are described in docs/process_plugins.md.
"""

import inspect
import json
import math
import mmap
import os
import re
import sys
import traceback

__all__ = ["Agent", "Box", "Image", "Observation", "Optimizer", "Parameter", "Talk", "manifest_of", "parameter", "serve"]

PROTOCOL = 1
TO_HOST_FD = "RELIGN_TO_HOST_FD"
FROM_HOST_FD = "RELIGN_FROM_HOST_FD"


# ---- parameters -------------------------------------------------------------------------------------


class Parameter:
    """A parameter's declaration; the instance's attribute of the same name holds the effective value."""

    def __init__(self, default, type, minimum, maximum, allowed, unit, description):
        self.default = default
        self.type = type
        self.minimum = minimum
        self.maximum = maximum
        self.allowed = allowed
        self.unit = unit
        self.description = description

    def declaration(self):
        """The parameter as the manifest states it."""
        entry = {"type": self.type}
        for key in ("default", "minimum", "maximum", "allowed", "unit", "description"):
            value = getattr(self, key)
            if value is not None:
                entry[key] = value
        return entry

    def convert(self, value):
        return float(value) if self.type == "number" else value


def parameter(default=None, *, minimum=None, maximum=None, allowed=None, unit=None, description=None, type=None):
    """Declares a parameter as a class attribute.

    The type follows from the default: float "number", int "integer", bool "boolean", str "text", list and dict
    "json". `type` says otherwise: "file" (the value is an absolute path) or "algorithm". Without a default the user
    must give a value, and `type` is needed.
    """
    if type is None:
        if default is None:
            raise TypeError('parameter: without a default, say type="number" (or integer, boolean, text, file, json)')
        by_class = {bool: "boolean", int: "integer", float: "number", str: "text", list: "json", dict: "json"}
        type = by_class.get(default.__class__)
        if type is None:
            raise TypeError("parameter: the default's class %s has no type; say type=..." % default.__class__.__name__)
    return Parameter(default, type, minimum, maximum, allowed, unit, description)


def _parameters_of(cls):
    found = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Parameter):
                found[name] = value
    return found


# ---- what authors derive from -------------------------------------------------------------------------


class _Algorithm:
    kind = None
    knows = ()
    presets = {}

    def __init__(self, **given):
        """Sets the parameters: those given, else what is set already, else the defaults. A class may have an
        __init__ without arguments instead; its parameters are set before it is called."""
        _set_parameters(self, given)

    def run(self, talk):
        """Drives one whole trial: returns when talk.step gives None, or earlier to declare itself finished."""
        raise NotImplementedError("%s has no run(self, talk)" % type(self).__name__)


class Optimizer(_Algorithm):
    """Searches. Without a recommendation of its own, the best measured pose counts."""

    kind = "optimizer"
    knows = ("merit", "start", "box")


class Agent(_Algorithm):
    """Has learnt, or owns a model. Without a recommendation of its own, the current pose counts."""

    kind = "agent"
    knows = ("images",)


def _set_parameters(made, given):
    declared = _parameters_of(type(made))
    for name in given:
        if name not in declared:
            raise TypeError("%s declares no parameter '%s'" % (type(made).__name__, name))
    for name, entry in declared.items():
        if name in given:
            setattr(made, name, entry.convert(given[name]))
        elif name not in vars(made):
            setattr(made, name, entry.default)


def _create(cls, given):
    made = cls.__new__(cls)
    _set_parameters(made, given)
    made.__init__()
    return made


def manifest_of(cls):
    """The manifest that the class is, as a dictionary (see docs/plugins.md)."""
    summary = getattr(cls, "summary", None) or cls.__dict__.get("__doc__")
    if not summary:
        summary = getattr(sys.modules.get(cls.__module__), "__doc__", None)
    if not summary:
        raise TypeError("%s needs a docstring: its first paragraph is the plugin's summary" % cls.__name__)
    words = re.sub(r"(?<=[a-z0-9])([A-Z])|(?<=[A-Z])([A-Z])(?=[a-z])", r"_\1\2", cls.__name__)
    manifest = {
        "id": getattr(cls, "id", None) or words.strip("_").lower(),
        "kind": cls.kind,
        "summary": " ".join(inspect.cleandoc(summary).split("\n\n")[0].split()),
        "knows": list(cls.knows),
        "parameters": {name: entry.declaration() for name, entry in _parameters_of(cls).items()},
    }
    if cls.presets:
        manifest["presets"] = {name: {"parameters": dict(values)} for name, values in cls.presets.items()}
    for key in ("license", "citation", "reproducible", "oracle"):
        value = getattr(cls, key, None)
        if value is not None:
            manifest[key] = value
    return manifest


# ---- what a trial shows -------------------------------------------------------------------------------


class Box:
    """Axis-aligned box in commanded coordinates: `lower` and `upper`, one value per axis."""

    def __init__(self, lower, upper):
        self.lower = tuple(lower)
        self.upper = tuple(upper)

    def clamp(self, pose):
        """The pose of the box nearest to `pose`, as a list."""
        return [low if x < low else high if high < x else x for x, low, high in zip(pose, self.lower, self.upper)]

    def centre(self):
        return [0.5 * (low + high) for low, high in zip(self.lower, self.upper)]


class Image:
    """Pixels without numpy: image[y, x] and image[y] (a row), float32, read-only, row 0 on top."""

    def __init__(self, data, width, height):
        self._values = memoryview(data).cast("f")
        self.width = width
        self.height = height
        self.shape = (height, width)

    def __len__(self):
        return self.height

    def __getitem__(self, place):
        if isinstance(place, tuple):
            y, x = place
            return self[y][x]
        if not -self.height <= place < self.height:
            raise IndexError("row %d of %d" % (place, self.height))
        first = (place % self.height) * self.width
        return self._values[first : first + self.width]

    def __iter__(self):
        return (self[y] for y in range(self.height))

    def tolist(self):
        return [row.tolist() for row in self]


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
                self._reference = self._as_image(file.read(size))
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
        return self._as_image(self._pixels[:])

    def _as_image(self, data):
        numpy = _numpy()
        if numpy is None:
            return Image(data, self._shape[1], self._shape[0])
        return numpy.frombuffer(data, dtype=numpy.float32).reshape(self._shape)


def _numpy():
    try:
        import numpy
    except ImportError:
        return None
    return numpy


# ---- the process ----------------------------------------------------------------------------------------


class _Host:
    """Messages to and from the host, one JSON object a line."""

    def __init__(self, to_host, from_host):
        os.set_inheritable(to_host, False)
        os.set_inheritable(from_host, False)
        self._to_host = to_host
        self._from_host = open(from_host, "rb")
        self.read_line = self._from_host.readline

    def send(self, line):
        data = line.encode("utf-8")
        while data:
            data = data[os.write(self._to_host, data) :]

    def tell(self, **message):
        self.send(json.dumps(message, allow_nan=False) + "\n")

    def receive(self):
        line = self.read_line()
        if not line.endswith(b"\n"):  # the host is gone, or has had enough
            raise SystemExit(1)
        return json.loads(line)

    def ask(self, line):
        self.send(line)
        answer = self.receive()
        if answer["message"] == "refused":
            raise ValueError(answer.get("text", "the host refused the request"))
        if answer["message"] == "failed":
            raise RuntimeError(answer.get("text", "the host reports a failure"))
        return answer


def _sentence(error):
    """What went wrong in one line, with the place in the author's file."""
    text = "".join(traceback.format_exception_only(type(error), error)).strip().splitlines()[-1]
    if isinstance(error, SystemExit):
        text = "it called sys.exit(%r) during the trial" % (error.code,)
    own = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if os.path.abspath(frame.filename) != os.path.abspath(__file__)
    ]
    if own:
        text += " (%s, line %d)" % (os.path.basename(own[-1].filename), own[-1].lineno)
    return text


def _talk_to_host(cls, host):
    hello = host.receive()
    identity = manifest_of(cls)["id"]
    if PROTOCOL not in hello.get("protocols", []):
        host.tell(message="failed", text="it speaks protocol %d, the host %s" % (PROTOCOL, hello.get("protocols")))
        return 1
    if hello.get("needs"):
        host.tell(message="failed", text="the host needs abilities unknown to relign_bench.plugin: %s" % hello["needs"])
        return 1
    host.tell(message="hello", protocol=PROTOCOL, id=identity, needs=[])
    while True:
        message = host.receive()
        name = message["message"]
        try:
            if name == "create":
                algorithm = _create(cls, message["parameters"])
                if "images" in cls.knows:
                    _numpy()  # slow to import: before the trial's clock starts
                host.tell(message="created")
            elif name == "run":
                algorithm.run(Talk(host, message["task"]))
                sys.stdout.flush()
                host.tell(message="done")
            elif name == "bye":
                return 0
            else:
                host.tell(message="unsupported")
        except BaseException as error:  # SystemExit and KeyboardInterrupt too: the host must hear of it
            if not isinstance(error, SystemExit):
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            host.tell(message="failed", text=_sentence(error))
            return 1


def serve(cls):
    """Makes this file a plugin: answers the host that started it. Call it under `if __name__ == "__main__":`."""
    to_host = os.environ.pop(TO_HOST_FD, None)
    from_host = os.environ.pop(FROM_HOST_FD, None)
    if "--manifest" in sys.argv[1:]:
        if to_host is None:
            print(json.dumps(manifest_of(cls), indent=2, allow_nan=False))
        else:
            _Host(int(to_host), int(from_host)).tell(**manifest_of(cls))
        return
    if to_host is None or from_host is None:
        script = os.path.relpath(sys.argv[0])
        print("This is a plugin of relign-bench. Run it with: relign-bench try ./%s" % script, file=sys.stderr)
        sys.exit(2)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # what a process that dies has printed is in its log
    try:
        status = _talk_to_host(cls, _Host(int(to_host), int(from_host)))
    except BrokenPipeError:
        status = 1
    sys.exit(status)
