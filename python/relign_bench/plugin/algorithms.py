"""What authors of algorithms derive from."""

from .parameters import set_parameters


class _Algorithm:
    kind = None
    knows = ()
    presets = {}

    def __init__(self, **given):
        """Sets the parameters: those given, else what is set already, else the defaults. A class may have an
        __init__ without arguments instead; its parameters are set before it is called."""
        set_parameters(self, given)

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
