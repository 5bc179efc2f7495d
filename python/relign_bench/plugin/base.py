"""What plugins of every kind share: the class is the manifest, parameters are class attributes."""

from .parameters import set_parameters


class Plugin:
    kind = None
    presets = {}

    def __init__(self, **given):
        """Sets the parameters: those given, else what is set already, else the defaults. A class may have an
        __init__ without arguments instead; its parameters are set before it is called."""
        set_parameters(self, given)

    def _lacks(self, method):
        return NotImplementedError("%s has no %s" % (type(self).__name__, method))
