"""The description of the services (services.toml) as objects, and the kinds of their arguments and results."""

import pathlib
import re
import textwrap

import tomllib

HERE = pathlib.Path(__file__).resolve().parent
WIDTH = 120
MADE = "Made by core/plugin_api/generate.py from services.toml"

# By kind: parameters of the C function, type in C++, expression that passes the C++ value to C, type in Python.
ARGUMENTS = {
    "text": ("relign_text {n}", "std::string_view", "to_text({n})", "str"),
    "object": ("relign_text {n}_json", "std::string_view", "to_text({n}_json)", "Mapping[str, Any] | None"),
    "integer": ("uint64_t {n}", "std::uint64_t", "{n}", "int"),
    "count": ("uint32_t {n}", "std::uint32_t", "{n}", "int"),
    "numbers": ("const double* {n}, uint32_t axes", "const Pose&", "{n}.data(), count_of({n})", "Iterable[float]"),
    "regions": ("const uint32_t* {n}, uint32_t count", "const std::vector<Region>&", "to_numbers({n}).data(), count_of({n})",
                "Iterable[Sequence[int]]"),
    "counts": ("const uint32_t* {n}, uint32_t count", "const std::vector<std::uint32_t>&", "{n}.data(), count_of({n})",
               "Sequence[int]"),
    "lens": ("relign_model_lens* {n}", None, None, None),
    "bytes": ("relign_text {n}", None, None, None),
}
# By kind: parameters of the C function, type in C++, type in Python.
RESULTS = {
    "json": ("const relign_text_sink* {n}", "std::string", "Any"),
    "number": ("double* {n}", "double", "float"),
    "numbers": ("double* {n}, uint32_t axes", "Pose", "tuple[float, ...]"),
    "table": ("{rows}* {n}", "std::vector<{row}>", "Sequence[dict[str, Any]]"),
    "pixels": ("float* {n}", None, None),
    "slopes": ("float* {n}", None, None),
    "lens": ("relign_model_lens** {n}", None, None),
    "bytes": ("const relign_text_sink* {n}", None, None),
    "outcome": ("relign_run_outcome* {n}", None, None),
}
MEMBERS = {"count": "uint32_t {n}", "json": "relign_text {n}_json", "image": "const relign_image* {n}"}

SERVICE_KEYS = {"name", "id", "needs", "offered", "summary", "about", "before", "wrapper", "messages", "members", "function"}
FUNCTION_KEYS = {"name", "arguments", "result", "row", "columns", "about", "refused", "failed", "unsupported", "stops", "frees"}


def check(found, allowed, what, where):
    for name in found:
        if name not in allowed:
            raise SystemExit(f"{where}: unknown {what} '{name}'; expected one of: {', '.join(sorted(allowed))}")


class Function:
    def __init__(self, service, given):
        where = f"function '{given.get('name')}' of '{service.name}'"
        check(given, FUNCTION_KEYS, "key", where)
        check(given.get("arguments", {}).values(), ARGUMENTS, "kind of an argument", where)
        check(given.get("result", {}).values(), RESULTS, "kind of a result", where)
        self.service, self.name, self.about = service, given["name"], " ".join(given["about"].split())
        self.arguments = given.get("arguments", {})
        (self.result, self.kind), = given.get("result", {"": ""}).items()
        self.row, self.columns = given.get("row", ""), given.get("columns", {})
        self.rows = "relign_" + re.sub(r"(?<!^)(?=[A-Z])", "_", self.row).lower() + "s"
        self.stops, self.frees = given.get("stops", False), given.get("frees", "")
        self.refused, self.failed, self.unsupported = (given.get(key, "") for key in ("refused", "failed", "unsupported"))

    def fill(self, text, name):
        return text.format(n=name, row=self.row, rows=self.rows, s=self.service.name, a=f'answer.at("{name}")')

    def parameters(self):
        """Of the C function, without the context."""
        given = [ARGUMENTS[kind][0].format(n=name) for name, kind in self.arguments.items()]
        return given + ([self.fill(RESULTS[self.kind][0], self.result)] if self.result else [])

    def c_comment(self):
        sentences = [f"{status}: {text}." for status, text in (
            ("RELIGN_UNSUPPORTED", self.unsupported), ("RELIGN_BAD_ARGUMENT", self.refused), ("RELIGN_FAILED", self.failed),
        ) if text] + ["RELIGN_STOP."] * self.stops
        return f"{self.about} {' '.join(sentences)}".strip() + " [run-thread]"


class Service:
    def __init__(self, given):
        check(given, SERVICE_KEYS, "key", f"service '{given.get('name')}'")
        kinds = (member["kind"] for member in given.get("members", {}).values())
        check(kinds, MEMBERS, "kind of a member", f"service '{given['name']}'")
        self.name, self.id, self.summary = given["name"], given["id"], given["summary"]
        self.about, self.before = " ".join(given.get("about", "").split()), given.get("before", "").strip()
        self.plain = re.sub(r"\[(.*?)\]\(.*?\)", r"\1", self.summary).replace("`", '"')  # without links
        self.needs = given.get("needs", "")
        self.offered = f"`{self.needs}`" if self.needs else given.get("offered", "")
        self.members = given.get("members", {})
        self.wrapper, self.messages = given.get("wrapper", True), given.get("messages", True)
        self.functions = [Function(self, function) for function in given.get("function", [])]
        self.macro, self.struct = f"RELIGN_SERVICE_{self.name.upper()}", f"relign_{self.name}_service"
        self.class_name = "".join(word.capitalize() for word in self.name.split("_"))


def wrapped(text, first, rest, end=""):
    """The text as lines of at most WIDTH characters."""
    return "\n".join(textwrap.wrap(text + end, WIDTH, initial_indent=first, subsequent_indent=rest, break_long_words=False,
                                   break_on_hyphens=False)) + "\n"


def c_comment(text, indent=""):
    return wrapped(text, indent + "/* ", indent + " * ", " */")


def read_services():
    return [Service(given) for given in tomllib.loads((HERE / "services.toml").read_text())["service"]]
