"""Makes from services.toml and scene.toml what repeats them.

    python3 core/plugin_api/generate.py            # rewrites the files of the tree
    python3 core/plugin_api/generate.py --check    # exit status 1 if one of them would change
    python3 core/plugin_api/generate.py --messages FOLDER    # what the build includes: messages to and from processes
"""

import pathlib
import re
import sys

import abilities
import messages
from description import ARGUMENTS, HERE, MADE, MEMBERS, RESULTS, WIDTH, c_comment, read_services, wrapped

ROOT = HERE.parents[1]

# ---- C tables ---------------------------------------------------------------------------------


def c_rows(function):
    types = {"text": "const relign_text*", "number": "const double*"}
    columns = "".join(f"  {types[column['kind']]} {name}; /* {column['about']} */\n"
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


C_HEADER = '''/*
 * relign/services.h: what a trial offers besides steps. The rules of all services are in relign/plugin.h.
 * {made}.
 */
/* clang-format off */
#ifndef RELIGN_SERVICES_H
#define RELIGN_SERVICES_H

#include "types.h"

#ifdef __cplusplus
extern "C" {{
#endif

{tables}#ifdef __cplusplus
}}
#endif

#endif /* RELIGN_SERVICES_H */
'''


def c_header(services):
    return C_HEADER.format(made=MADE, tables="".join(map(c_table, services)))


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


CPP_HEADER = '''// relign/services.hpp: what a trial offers besides steps, as C++ classes. Comes with relign/plugin.hpp.
// {made}.
//
// All of it is valid during run, in the thread of run. Failures are thrown as std::exception with the host's message;
// services that work for long throw Stopped after the user stopped the run.
// clang-format off
#ifndef RELIGN_SERVICES_HPP
#define RELIGN_SERVICES_HPP

#include <cstdint>
#include <optional>
#include <relign/service.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace relign {{

{classes}// The services as members of Trial. Each throws std::logic_error when the host does not offer it; the message names
// what the manifest lacks.
class TrialServices : public border::TrialTable {{
 public:
  using TrialTable::TrialTable;

{members}}};

}}  // namespace relign

#endif  // RELIGN_SERVICES_HPP
'''


def cpp_header(services):
    wrappers, members = [service for service in services if service.wrapper], ""
    for service in wrappers:
        bits = f'RELIGN_OBSERVES_{service.needs.upper()}, "{service.needs}"' if service.needs else '0, ""'
        members += f"  {service.class_name} {service.name}() const {{\n"
        members += f"    return {{*this, offered<{service.struct}>({service.macro}, {bits})}};\n  }}\n"
    return CPP_HEADER.format(made=MADE, classes="".join(map(cpp_class, wrappers)), members=members)


# ---- Python -----------------------------------------------------------------------------------


def python_docstring(about, sections, indent):
    """The first sentence alone on its line, as docstrings have it."""
    first, _, rest = re.sub(r"(?<=[^.][.]) ", "\0", about, count=1).partition("\0")
    text = f'{indent}"""{first}'
    if len(text) > WIDTH:
        raise SystemExit(f"the first sentence must fit into one line: {first}")
    text += "\n\n" + wrapped(rest, indent, indent).rstrip("\n") if rest else ""
    for title, lines in sections:
        listed = "".join(wrapped(line, indent + "    ", indent + "        ") for line in lines)
        text += f"\n\n{indent}{title}:\n" + listed.rstrip("\n")
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
    value = {"number": f"number_or_nan({value})", "numbers": f"tuple(map(float, {value}))",
             "table": f"rows({value})"}.get(function.kind, value)
    return text + f"        {'return ' if returned != 'None' else ''}{value}\n\n"


PYTHON_MODULE = '''"""Services of a trial as classes.

{made}.
"""

from __future__ import annotations

from .service import Service, TrialWithServices, number_or_nan, rows

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any


'''


def python_module(services):
    wrappers = [service for service in services if service.wrapper]
    text = PYTHON_MODULE.format(made=MADE)
    for service in wrappers:
        about = f"{service.plain[0].upper()}{service.plain[1:]}. {service.about}".strip()
        attributes = [("Attributes", [f"{name}: {member['about'][0].upper()}{member['about'][1:]}."
                                      for name, member in service.members.items()])] if service.members else []
        text += f"class {service.class_name}(Service):\n" + python_docstring(about, attributes, "    ")
        text += f'\n    ID = "{service.id}"\n'
        text += "    MEMBERS = (" + " ".join(f'"{name}",' for name in service.members) + ")\n" if service.members else ""
        text += "".join(f"    {name}: {'int' if member['kind'] == 'count' else 'Any'}\n"
                        for name, member in service.members.items())
        text += "\n" + "".join(map(python_function, service.functions)) + "\n"
    text += 'class TrialServices(TrialWithServices):\n    """The services as members of a trial."""\n'
    for service in wrappers:
        needs = f' Needs "{service.needs}".' if service.needs else ""
        text += (f"\n    def {service.name}(self) -> {service.class_name}:\n"
                 f'        """{service.plain[0].upper()}{service.plain[1:]}.{needs}"""\n'
                 f"        return self._made({service.class_name})\n")
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
        found = re.search(rf"<!-- {name}: .*? -->\n\n(.*?)\n<!-- end -->", text, flags=re.DOTALL)
        if not found:
            raise SystemExit(f"{path}: expected '<!-- {name}: ... -->' and its '<!-- end -->'")
        text = text[: found.start(1)] + table + text[found.end(1) :]
    return text


def files_of_tree(services, able):
    docs = ROOT / "docs"
    return abilities.files_of_tree(able, python_docstring) | {
        HERE / "relign" / "services.h": c_header(services),
        HERE / "relign" / "services.hpp": cpp_header(services),
        ROOT / "python" / "relign_bench" / "plugin" / "service_classes.py": python_module(services),
        docs / "services.md": with_tables(docs / "services.md", {
            "services": services_table(services), "functions": functions_table(services)}),
        docs / "plugins.md": with_tables(docs / "plugins.md", {"abilities": abilities.abilities_table(able)}),
        docs / "process_plugins.md": with_tables(docs / "process_plugins.md", {
            "messages": messages_table(services), "abilities": abilities.messages_table(able)}),
    }


def main(words):
    services, able = read_services(), abilities.read_abilities()
    if words[:1] == ["--messages"]:
        folder = pathlib.Path(words[1])
        folder.mkdir(parents=True, exist_ok=True)
        files = {folder / name: text for name, text in (messages.files(services) | abilities.files_of_build(able)).items()}
    else:
        files = files_of_tree(services, able)
    changed = [path for path, text in files.items() if not path.exists() or path.read_text() != text]
    if words == ["--check"]:
        for path in changed:
            print(f"{path.relative_to(ROOT)} differs from its description; run python3 core/plugin_api/generate.py")
        return 1 if changed else 0
    for path in changed:
        path.write_text(files[path])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
