"""What authors of algorithms derive from."""

from .base import Plugin


class _Algorithm(Plugin):
    knows = ()

    def run(self, talk):
        """Drives one whole trial: returns when talk.step gives None, or earlier to declare itself finished."""
        raise self._lacks("run(self, talk)")


class Optimizer(_Algorithm):
    """Searches. Without a recommendation of its own, the best measured pose counts."""

    kind = "optimizer"
    knows = ("merit", "start", "box")


class Agent(_Algorithm):
    """Has learnt, or owns a model. Without a recommendation of its own, the current pose counts."""

    kind = "agent"
    knows = ("images",)
