"""Makes from services.toml what repeats it.

    python3 core/plugin_api/generate.py            # rewrites the files of the tree
    python3 core/plugin_api/generate.py --check    # exit status 1 if one of them would change
    python3 core/plugin_api/generate.py --messages FOLDER    # what the build includes: messages to and from processes
"""

import pathlib
import re
import sys
import textwrap
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WIDTH = 120
MADE = "made by core/plugin_api/generate.py from services.toml"

# By kind: parameters of the C function, type in C++, expression that passes the C++ value to C, type in Python.
ARGUMENTS = {
    "text": ("relign_text {n}", "std::string_view", "to_text({n})", "str"),
    "object": ("relign_text {n}_json", "std::string_view", "to_text({n}_json)", "Mapping[str, Any] | None"),
    "integer": ("uint64_t {n}", "std::uint64_t", "{n}", "int"),
    "count": ("uint32_t {n}", "std::uint32_t", "{n}", "int"),
    "numbers": ("const double* {n}, uint32_t axes", "const Pose&", "{n}.data(), count_of({n})", "Iterable[float]"),
    "regions": ("const uint32_t* {n}, uint32_t count", "const std::vector<Region>&", "to_numbers({n}).data(), count_of({n})",
                "Iterable[Sequence[int]]"),
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
    "lens": ("relign_model_lens** {n}", None, None),
    "bytes": ("const relign_text_sink* {n}", None, None),
    "outcome": ("relign_run_outcome* {n}", None, None),
}
MEMBERS = {"count": "uint32_t {n}", "json": "relign_text {n}_json", "image": "const relign_image* {n}"}
# What the C++ side of a process needs for an argument: how the host reads it and passes it on, how the process sends it.
MESSAGES = {
    "text": ("const std::string {n} = in.text(\"{n}\")", "view({n})", "to_json({n})"),
    "object": ("const std::string {n} = in.object(\"{n}\")", "view({n})", "object_of({n}_json)"),
    "integer": ("const auto {n} = in.integer<std::uint64_t>(\"{n}\")", "{n}", "{n}"),
    "count": ("const auto {n} = in.integer<std::uint32_t>(\"{n}\")", "{n}", "{n}"),
    "numbers": ("const std::vector<double> {n} = in.numbers(\"{n}\")", "{n}.data(), count_of({n})", "to_json({n}, axes)"),
    "regions": ("const std::vector<std::uint32_t> {n} = in.regions(\"{n}\")", "{n}.data(), count_of({n}) / 4",
                "regions_of({n}, count)"),
    "lens": ("relign_model_lens* const {n} = in.lens(\"{n}\")", "{n}", "number_of({n})"),
    "bytes": ("const relign_text {n} = in.bytes(\"{n}\")", "{n}", "{n}.size"),
}
# And for a result: the host's variable, how it is passed, its JSON; how the process takes the JSON.
ANSWERS = {
    "json": ("TextSink {n}", "{n}.sink()", "parsed_json({n}.text())", "write({n}, {a}.dump())"),
    "number": ("double {n} = 0", "&{n}", "{n}", "*{n} = number_or_nan({a})"),
    "numbers": ("std::vector<double> {n}(in.axes())", "{n}.data(), count_of({n})", "{n}", "remote.take({a}, {n}, axes)"),
    "table": ("{rows} {n} = empty<{rows}>()", "&{n}", "to_json({n})", "take(remote.columns, {a}, *{n})"),
    "pixels": ("float* const {n} = in.pixels(table.image_width, table.image_height)", "{n}", "in.place_of_pixels()",
               "remote.take({a}, {n}, std::uint64_t{{remote.tables.{s}.image_width}} * remote.tables.{s}.image_height)"),
    "lens": ("relign_model_lens* {n} = nullptr", "&{n}", "in.keep({n})", "*{n} = lens_of({a})"),
    "bytes": ("TextSink {n}", "{n}.sink()", "in.give({n}.text())", "write({n}, remote.bytes({a}))"),
}


class Function:
    def __init__(self, service, given):
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


# ---- C tables ---------------------------------------------------------------------------------


def c_rows(function):
    columns = "".join(f"  {'const relign_text*' if column['kind'] == 'text' else 'const double*'} {name}; /* {column['about']} */\n"
                      for name, column in function.columns.items())
    return (c_comment(f"Arrays with `count` values, valid until the next call of `{function.name}`.") +
            f"typedef struct {function.rows} {{\n  uint32_t struct_size;\n  uint32_t count;\n{columns}}} {function.rows};\n\n")


def c_table(service):
    needs = f"Needs RELIGN_OBSERVES_{service.needs.upper()}." if service.needs else ""
    text = c_comment(f'"{service.id}": {service.plain}. {needs} {service.about}'.replace("  ", " ").strip())
    text += f'#define {service.macro} "{service.id}"\n'
    text += service.before + "\n\n" if service.before else ""
    text += "".join(c_rows(function) for function in service.functions if function.kind == "table")
    text += f"typedef struct {service.struct} {{\n  uint32_t struct_size;\n  uint32_t reserved;\n  void* context;\n"
    for name, member in service.members.items():
        text += f"  {MEMBERS[member['kind']].format(n=name)}; /* {member['about']} */\n"
    for function in service.functions:
        text += c_comment(function.c_comment(), "  ")
        text += wrapped(f"relign_status (*{function.name})({', '.join(['void* context', *function.parameters()])});", "  ",
                        " " * 6)
    return text + f"}} {service.struct};\n\n"


def c_header(services):
    return (f"/*\n * relign/services.h: what a trial offers besides steps. The rules of all services are in relign/plugin.h.\n"
            f" * {MADE[0].upper()}{MADE[1:]}.\n */\n/* clang-format off */\n#ifndef RELIGN_SERVICES_H\n#define RELIGN_SERVICES_H\n\n"
            '#include "types.h"\n\n#ifdef __cplusplus\nextern "C" {\n#endif\n\n' +
            "".join(map(c_table, services)) + "#ifdef __cplusplus\n}\n#endif\n\n#endif /* RELIGN_SERVICES_H */\n")


# ---- C++ classes ------------------------------------------------------------------------------


def cpp_function(function):
    *_, last = [*function.arguments, ""] if not function.arguments else list(function.arguments)
    parameters = []
    for name, kind in function.arguments.items():
        shown = f"{name}_json" if kind == "object" else name
        parameters.append(f"{ARGUMENTS[kind][1]} {shown}" + (" = {}" if kind == "object" and name == last else ""))
    kind, result = function.kind, function.result
    made = function.fill(RESULTS[kind][1], result) if kind else ""
    returned = (f"std::optional<{made}>" if made else "bool") if function.unsupported else made or "void"
    passed = ["table_->context"] + [ARGUMENTS[kind][2].format(n=name) for name, kind in function.arguments.items()]
    before = {"json": f"border::Collector {result}", "number": "double value = 0".replace("value", result),
              "numbers": f"Pose {result}(axes())", "table": f"auto {result} = empty<{function.rows}>()", "": ""}[kind]
    passed += {"json": [f"{result}.sink()"], "number": [f"&{result}"], "numbers": [f"{result}.data()", f"count_of({result})"],
               "table": [f"&{result}"], "": []}[kind]
    call = f"table_->{function.name}({', '.join(passed)}), \"{function.service.name}.{function.name}\""
    text = wrapped(function.about + (f" Nothing: {function.unsupported}." if function.unsupported and made else "") +
                   (f" False: {function.unsupported}." if function.unsupported and not made else ""), "  // ", "  // ")
    text += f"  {returned} {function.name}({', '.join(parameters)}) const {{\n" + (f"    {before};\n" if before else "")
    if function.unsupported:
        text += f"    if (!done({call})) return std::nullopt;\n" if made else f"    return done({call});\n"
    else:
        text += f"    check({call});\n"
    if kind == "table":
        fields = ", ".join(f"std::string(to_view({result}.{name}[i]))" if column["kind"] == "text" else f"{result}.{name}[i]"
                           for name, column in function.columns.items())
        text += (f"    {made} rows;\n    for (std::uint32_t i = 0; i < {result}.count; ++i) rows.push_back({{{fields}}});\n"
                 "    return rows;\n")
    elif kind:
        text += f"    return {result + '.text()' if kind == 'json' else result};\n"
    return text + "  }\n"


def cpp_class(service):
    text = ""
    for function in (f for f in service.functions if f.kind == "table"):
        columns = "".join(f"  {'std::string' if column['kind'] == 'text' else 'double'} {name}"
                          f"{'' if column['kind'] == 'text' else ' = 0'};  // {column['about']}\n"
                          for name, column in function.columns.items())
        text += f"struct {function.row} {{\n{columns}}};\n\n"
    text += wrapped(f'"{service.id}": {service.plain}. {service.about}'.strip(), "// ", "// ")
    text += f"class {service.class_name} : public border::Service<{service.struct}> {{\n public:\n  using Service::Service;\n\n"
    for name, member in service.members.items():
        kind, value = {"count": ("std::uint32_t", f"table_->{name}"),
                       "json": ("std::string", f"std::string(to_view(table_->{name}_json))")}[member["kind"]]
        text += wrapped(member["about"][0].upper() + member["about"][1:] + ".", "  // ", "  // ")
        text += f"  {kind} {name}() const {{ return {value}; }}\n"
    return text + "".join(map(cpp_function, service.functions)) + "};\n\n"


def cpp_header(services):
    text = (f"// relign/services.hpp: what a trial offers besides steps, as C++ classes. Comes with relign/plugin.hpp.\n"
            f"// {MADE[0].upper()}{MADE[1:]}.\n//\n"
            "// All of it is valid during run, in the thread of run. Failures are thrown as std::exception with the host's message;\n"
            "// services that work for long throw Stopped after the user stopped the run.\n// clang-format off\n"
            "#ifndef RELIGN_SERVICES_HPP\n#define RELIGN_SERVICES_HPP\n\n#include <cstdint>\n#include <optional>\n"
            "#include <relign/service.hpp>\n#include <string>\n#include <string_view>\n#include <vector>\n\nnamespace relign {\n\n")
    wrappers = [service for service in services if service.wrapper]
    text += "".join(map(cpp_class, wrappers))
    text += ("// The services as members of Trial. Each throws std::logic_error when the host does not offer it; the message names what\n"
             "// the manifest lacks.\nclass TrialServices : public border::TrialTable {\n public:\n  using TrialTable::TrialTable;\n\n")
    for service in wrappers:
        bits = f'RELIGN_OBSERVES_{service.needs.upper()}, "{service.needs}"' if service.needs else '0, ""'
        text += (f"  {service.class_name} {service.name}() const {{ return {{*this, offered<{service.struct}>({service.macro}, "
                 f"{bits})}}; }}\n")
    return text + "};\n\n}  // namespace relign\n\n#endif  // RELIGN_SERVICES_HPP\n"


# ---- messages to and from processes -----------------------------------------------------------


def tables_text(services):
    """One table of each service; what the host, its guard and the far side of a process share."""
    members = "".join(f"  {service.struct} {service.name}{{}};\n" for service in services)
    text = f"// {MADE}.\nstruct ServiceTables {{\n{members}}};\n\n"
    text += ("// Calls `fill` with the table of a service, which returns whether the service is offered. Null: it is not.\n"
             "template <class Fill>\nconst void* find_service(ServiceTables& tables, std::string_view id, Fill&& fill) {\n")
    for service in services:
        text += f"  if (id == {service.macro}) return fill(tables.{service.name}) ? &tables.{service.name} : nullptr;\n"
    text += "  return nullptr;\n}\n\n// Calls `visit` with each function of a table, as a pointer to the member.\n"
    for service in services:
        calls = "".join(f"  visit(Member<&{service.struct}::{function.name}>());\n" for function in service.functions)
        visit = "Visit&& visit" if calls else "Visit&&"
        text += f"template <class Visit>\nvoid for_each_function(const {service.struct}&, {visit}) {{\n{calls}}}\n"
    return text


def host_function(function):
    names = list(function.arguments.items())
    text = '  if (in.call() == "room") return in.room();\n' if "bytes" in function.arguments.values() else ""
    text += f'  if (in.call() == "{function.name}") {{\n'
    text += "".join(f"    {MESSAGES[kind][0].format(n=name)};\n" for name, kind in names)
    passed, members = ["table.context"] + [MESSAGES[kind][1].format(n=name) for name, kind in names], ""
    if function.kind:
        variable, pointer, json, _ = (function.fill(part, function.result) for part in ANSWERS[function.kind])
        text += f"    {variable};\n"
        passed.append(pointer)
        members = f'{{"{function.result}", {json}}}'
    text += f"    const relign_status status = table.{function.name}({', '.join(passed)});\n"
    text += f'    if (status == RELIGN_OK) in.forget({function.frees});\n' if function.frees else ""
    return text + f"    return status == RELIGN_OK ? result({{{members}}}) : in.failure(status);\n  }}\n"


def host_text(services):
    """The host's side: a request becomes a call of a table, what it wrote becomes the answer."""
    text = f"// {MADE}.\n"
    text += "".join(f"Json to_json(const {f.rows}& rows) {{\n  Json list = Json::array();\n"
                    "  for (std::uint32_t i = 0; i < rows.count; ++i)\n    list.push_back({" +
                    ", ".join(f'{{"{name}", {"to_string(" if column["kind"] == "text" else ""}rows.{name}[i]'
                              f'{")" if column["kind"] == "text" else ""}}}' for name, column in f.columns.items()) +
                    "});\n  return list;\n}\n\n"
                    for service in services for f in service.functions if f.kind == "table" and service.messages)
    text += "".join(f"Json answer(ProcessServices& in, const {service.struct}& table);\n" for service in services)
    for service in (service for service in services if service.messages):
        members = ", ".join(f'{{"{name}", ' + (f"parsed_json(to_string(table.{name}_json))" if member["kind"] == "json" else
                                               f"table.{name}") + "}" for name, member in service.members.items())
        text += f"\nJson answer(ProcessServices& in, const {service.struct}& table) {{\n"
        text += f'  if (in.call() == "open") return result({{{members}}});\n'
        text += "".join(map(host_function, service.functions)) + "  return in.unknown_call();\n}\n"
    text += "\nJson dispatch(ProcessServices& in, std::string_view id, const void* table) {\n"
    text += "".join(f"  if (id == {service.macro}) return answer(in, *static_cast<const {service.struct}*>(table));\n"
                    for service in services)
    return text + "  return in.unknown_call();\n}\n"


def remote_function(service, function):
    parameters = ", ".join(["void* context"] + function.parameters()).replace("uint32_t", "std::uint32_t").replace(
        "uint64_t", "std::uint64_t")
    members = ", ".join(f'{{"{name}", {MESSAGES[kind][2].format(n=name)}}}' for name, kind in function.arguments.items())
    text = f"  table.{function.name} = []({parameters}) -> relign_status {{\n"
    if function.kind:
        text += f"    if (!{function.result}) return RELIGN_BAD_ARGUMENT;\n"
    text += "    RemoteServices& remote = RemoteServices::self(context);\n"
    text += "    if (!remote.has_axes(axes)) return RELIGN_BAD_ARGUMENT;\n" if function.kind == "numbers" else ""
    for name in (name for name, kind in function.arguments.items() if kind == "bytes"):
        text += f"    if (const relign_status status = remote.put({name}); status != RELIGN_OK) return status;\n"
    text += f'    const Json answer = remote.ask({service.macro}, "{function.name}", {{{members}}});\n'
    if function.kind:
        take = function.fill(ANSWERS[function.kind][3], function.result)
        text += f"    if (status_of(answer) == RELIGN_OK) {take};\n"
    return text + "    return status_of(answer);\n  };\n"


def remote_text(services):
    """The side of a library in a process of its own: a call of a table becomes a request."""
    text = f"// {MADE}.\n"
    for function in (f for service in services for f in service.functions if f.kind == "table"):
        text += f"void take(Columns& columns, const Json& list, {function.rows}& rows) {{\n  columns.clear();\n"
        text += "  rows.count = static_cast<std::uint32_t>(list.size());\n"
        text += "".join(f'  rows.{name} = columns.{column["kind"]}s(list, "{name}");\n'
                        for name, column in function.columns.items()) + "}\n\n"
    for service in (service for service in services if service.messages):
        text += f"bool open(RemoteServices& services, {service.struct}& table) {{\n"
        text += f'  const Json members = services.ask({service.macro}, "open", {{}});\n'
        text += "  if (status_of(members) != RELIGN_OK) return false;\n"
        for name, member in service.members.items():
            text += (f'  table.{name}_json = services.keep("{name}", members.at("{name}").dump());\n' if member["kind"] == "json"
                     else f'  table.{name} = members.at("{name}").get<std::uint32_t>();\n')
        text += "".join(remote_function(service, function) for function in service.functions) + "  return true;\n}\n\n"
    return text


# ---- Python -----------------------------------------------------------------------------------


def python_docstring(about, sections, indent):
    """The first sentence alone on its line, as docstrings have it."""
    first, _, rest = re.sub(r"(?<=[^.][.]) ", "\0", about, count=1).partition("\0")
    text = f'{indent}"""{first}'
    if len(text) > WIDTH:
        raise SystemExit(f"services.toml: the first sentence must fit into one line: {first}")
    text += "\n\n" + wrapped(rest, indent, indent).rstrip("\n") if rest else ""
    for title, lines in sections:
        text += f"\n\n{indent}{title}:\n" + "".join(wrapped(line, indent + "    ", indent + "        ") for line in lines).rstrip("\n")
    return text + (f'\n{indent}"""\n' if rest or sections else '"""\n')


def python_function(function):
    result, parameters, passed = function.result, ["self"], [f'"{function.name}"']
    last = list(function.arguments)[-1:]
    for name, kind in function.arguments.items():
        optional = " = None" if kind == "object" and [name] == last else ""
        parameters.append(f"{name}: {ARGUMENTS[kind][3]}{optional}")
        passed.append(f"{name}=" + {"object": f"dict({name} or {{}})", "numbers": f"self._trial._finite({name})",
                                    "regions": f"[[int(value) for value in region] for region in {name}]"}.get(kind, name))
    made = RESULTS[function.kind][2] if function.kind else ""
    returned = (f"{made} | None" if made else "bool") if function.unsupported else made or "None"
    text = f"    def {function.name}({', '.join(parameters)}) -> {returned}:\n"
    returns = [f"{'None' if made else 'False'}: {function.unsupported}."] if function.unsupported else []
    if function.kind == "table":
        returns.append("For each row {" + ", ".join(f'"{name}"' for name in function.columns) + "}: " + "; ".join(
            f"{name}: {column['about']}" for name, column in function.columns.items()) + ".")
    raises = [f"{error}: {why[0].upper()}{why[1:]}." for error, why in (("ValueError", function.refused),
                                                                     ("RuntimeError", function.failed)) if why]
    sections = [pair for pair in (("Returns", returns), ("Raises", raises)) if pair[1]]
    text += python_docstring(function.about.replace("`", ""), sections, "        ")
    if function.unsupported:
        text += f"        answer = self._trial._answer(self.ID, {', '.join(passed)})\n"
        value = 'answer["message"] != "unsupported"'
        if made:
            text += f"        if not ({value}):\n            return None\n"
            value = f'answer["{result}"]'
    else:
        value = f"self._ask({', '.join(passed)})" + (f'["{result}"]' if made else "")
    value = {"number": f"number_or_nan({value})", "numbers": f"tuple(map(float, {value}))", "table": f"rows({value})"}.get(function.kind, value)
    return text + f"        {'return ' if returned != 'None' else ''}{value}\n\n"


def python_module(services):
    wrappers = [service for service in services if service.wrapper]
    text = (f'"""Services of a trial as classes.\n\n{MADE[0].upper()}{MADE[1:]}.\n"""\n\nfrom __future__ import annotations\n\n'
            "from .service import Service, TrialWithServices, number_or_nan, rows\n\nTYPE_CHECKING = False\nif TYPE_CHECKING:\n"
            "    from collections.abc import Iterable, Mapping, Sequence\n    from typing import Any\n\n\n")
    for service in wrappers:
        about = f"{service.plain[0].upper()}{service.plain[1:]}. {service.about}".strip()
        attributes = [("Attributes", [f"{name}: {member['about'][0].upper()}{member['about'][1:]}."
                                      for name, member in service.members.items()])] if service.members else []
        text += f"class {service.class_name}(Service):\n" + python_docstring(about, attributes, "    ")
        text += f'\n    ID = "{service.id}"\n'
        text += "    MEMBERS = (" + " ".join(f'"{name}",' for name in service.members) + ")\n" if service.members else ""
        text += "".join(f"    {name}: {dict(count='int', json='Any')[member['kind']]}\n" for name, member in service.members.items())
        text += "\n" + "".join(map(python_function, service.functions)) + "\n"
    text += 'class TrialServices(TrialWithServices):\n    """The services as members of a trial."""\n'
    for service in wrappers:
        needs = f' Needs "{service.needs}".' if service.needs else ""
        text += (f"\n    def {service.name}(self) -> {service.class_name}:\n"
                 f'        """{service.plain[0].upper()}{service.plain[1:]}.{needs}"""\n        return self._made({service.class_name})\n')
    return text


# ---- documents --------------------------------------------------------------------------------


def services_table(services):
    text = "| service | needs | provides |\n|---|---|---|\n"
    return text + "".join(f"| `{s.id}` | {s.offered} | {s.summary} |\n" for s in services)


def functions_table(services):
    """C++ and Python have the same names."""
    text = "| service | functions |\n|---|---|\n"
    for service in (service for service in services if service.wrapper):
        functions = [f"`.{name}`" for name in service.members] + [
            f"`.{function.name}({', '.join(function.arguments)})`" for function in service.functions]
        text += f"| `{service.id}` | `trial.{service.name}()`: {', '.join(functions)} |\n"
    return text


def messages_table(services):
    text = "| service | `call` | arguments | `result` |\n|---|---|---|---|\n"
    for service in (service for service in services if service.messages):
        members = ", ".join(f"`{name}`" for name in service.members)
        text += f"| `{service.id}` | `open` | | {members} |\n"
        for function in service.functions:
            arguments = ", ".join(f"`{name}`" for name in function.arguments)
            result = f"`{function.result}`" if function.result else ""
            if function.kind == "table":
                result += ": a list of " + ", ".join(f"`{name}`" for name in function.columns)
            result += f"{'; ' if result else ''}`unsupported`: {function.unsupported}" if function.unsupported else ""
            if "bytes" in function.arguments.values():
                text += "| | `room` | `bytes` | `room` |\n"
            text += f"| | `{function.name}` | {arguments} | {result} |\n"
    return text.replace("|  |", "| |").replace("|  |", "| |")


def with_tables(path, tables):
    """A document with the text between `<!-- NAME: made ... -->` and `<!-- end -->` replaced."""
    text = path.read_text()
    for name, table in tables.items():
        text, count = re.subn(rf"(<!-- {name}: .*? -->\n\n).*?(\n<!-- end -->)", lambda match: match[1] + table + match[2], text,
                              flags=re.DOTALL)
        if count != 1:
            raise SystemExit(f"{path}: expected one '<!-- {name}: ... -->' with its '<!-- end -->', found {count}")
    return text


def files_of_tree(services):
    return {
        HERE / "relign" / "services.h": c_header(services),
        HERE / "relign" / "services.hpp": cpp_header(services),
        ROOT / "python" / "relign_bench" / "plugin" / "service_classes.py": python_module(services),
        ROOT / "docs" / "services.md": with_tables(ROOT / "docs" / "services.md", {
            "services": services_table(services), "functions": functions_table(services)}),
        ROOT / "docs" / "process_plugins.md": with_tables(ROOT / "docs" / "process_plugins.md",
                                                          {"messages": messages_table(services)}),
    }


def main(words):
    services = [Service(given) for given in tomllib.loads((HERE / "services.toml").read_text())["service"]]
    if words[:1] == ["--messages"]:
        folder = pathlib.Path(words[1])
        folder.mkdir(parents=True, exist_ok=True)
        files = {folder / "service_tables.inc": tables_text(services), folder / "host_messages.inc": host_text(services),
                 folder / "remote_messages.inc": remote_text(services)}
    else:
        files = files_of_tree(services)
    changed = [path for path, text in files.items() if not path.exists() or path.read_text() != text]
    if words == ["--check"]:
        for path in changed:
            print(f"{path.relative_to(ROOT)} differs from core/plugin_api/services.toml; run python3 core/plugin_api/generate.py")
        return 1 if changed else 0
    for path in changed:
        path.write_text(files[path])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
