"""Parameters of a plugin: class attributes that the manifest declares and a trial sets."""


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


def parameters_of(cls):
    found = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Parameter):
                found[name] = value
    return found


def set_parameters(made, given):
    declared = parameters_of(type(made))
    for name in given:
        if name not in declared:
            raise TypeError("%s declares no parameter '%s'" % (type(made).__name__, name))
    for name, entry in declared.items():
        if name in given:
            setattr(made, name, entry.convert(given[name]))
        elif name not in vars(made):
            setattr(made, name, entry.default)


def create(cls, given):
    made = cls.__new__(cls)
    set_parameters(made, given)
    made.__init__()
    return made
