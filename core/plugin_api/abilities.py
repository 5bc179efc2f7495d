"""What follows from the description of a scene's abilities (scene.toml)."""

import re

import tomllib
from description import ARGUMENTS, HERE, c_comment, check, wrapped

MADE = "Made by core/plugin_api/generate.py from scene.toml"
KINDS = {"number": ("double {n}", "double", "{n}", "float")} | {
    kind: ARGUMENTS[kind] for kind in ("numbers", "integer", "count", "counts", "regions")}
FROM_C = {"numbers": "Pose({n}, {n} + axes)", "counts": "{{{n}, {n} + count}}", "regions": "to_regions({n}, count)"}
PYTHON = {"numbers": "Pose", "regions": "Sequence[tuple[int, int, int, int]]"}
# By kind of a result: C parameter, C++ type, Python type.
NUMBER, INTEGER = ("double* {n}", "double", "float"), ("uint64_t* {n}", "std::uint64_t", "int")
RESULTS = {"number": NUMBER, "finite": NUMBER, "fraction": NUMBER, "error": NUMBER, "integer": INTEGER,
           "pose": ("double* {n}, uint32_t axes", "Pose", "Pose")}
IMAGES = {"pixels": "1", "pixels of axes + 1 + 5 elements images": "{numbers}.size() + 1 + 5 * {counts}.size()"}
KEYS = {"name", "id", "purpose", "about", "arguments", "results", "struct", "each", "offered"}


def joined(parameters):
    """For `unbroken`, which breaks lines between parameters only."""
    return ", ".join(parameter.replace(" ", "\0") for parameter in parameters)


def unbroken(text, first, rest):
    return wrapped(text, first, rest).replace("\0", " ")


class Ability:
    def __init__(self, given):
        where = f"ability '{given.get('name')}'"
        check(given, KEYS, "key", where)
        check(given["arguments"].values(), KINDS, "kind of an argument", where)
        check((result["kind"] for result in given["results"].values()), RESULTS | IMAGES, "kind of a result", where)
        self.name, self.id, self.purpose = given["name"], given["id"], given["purpose"]
        self.arguments, self.each, self.offered = given["arguments"], given.get("each", ""), given.get("offered", "")
        self.about = " ".join(given.get("about", "").split())
        self.plain = re.sub(r"\[(.*?)\]\(.*?\)", r"\1", self.purpose).replace("`", "")
        short = self.id.split(".")[-1].split("/")[0].replace("-", "_")
        self.macro, self.table = f"RELIGN_SCENE_{short.upper()}", f"relign_scene_{short}"
        self.pixels = {name: result for name, result in given["results"].items() if result["kind"] in IMAGES}
        self.values = {name: result for name, result in given["results"].items() if result["kind"] in RESULTS}
        self.results = self.pixels | self.values
        named = {kind: name for name, kind in self.arguments.items()}
        self.images = "".join(IMAGES[result["kind"]] for result in self.pixels.values()).format_map(named)
        self.struct = given.get("struct", "")
        if not self.struct and (len(self.values) > 1 or self.each):
            raise SystemExit(f"scene.toml: {where}: expected 'struct', the name of its results")
        self.returned, self.nothing = "bool", "false"
        if self.values:
            value = self.struct or RESULTS[next(iter(self.values.values()))["kind"]][1]
            kind = "vector" if self.each else "optional"
            self.returned, self.nothing = f"std::{kind}<{value}>", "{}" if self.each else "std::nullopt"
        names = [word for parameter in self.c_parameters().split(", ") for word in parameter.split("\0")[-1:]]
        if len(set(names)) < len(names):
            raise SystemExit(f"scene.toml: {where}: expected different names, at most one of numbers and pose, at most one "
                             "list")

    def of_result(self, name, found="found"):
        """A value of what the C++ function returned."""
        return f"{found}->{name}" if self.struct and not self.each else f"*{found}"

    def declaration(self, end, scope="", named=True):
        shown = "{} {}" if named else "{} /*{}*/"
        parameters = [shown.format(KINDS[kind][1], name) for name, kind in self.arguments.items()]
        parameters += [shown.format("float*", name) for name in self.pixels]
        returned = self.returned.replace(self.struct, scope + self.struct) if self.struct else self.returned
        return f"{returned} {scope}{self.name}({joined(parameters)}){end}"

    def call(self):
        """Arguments of the C++ function."""
        return ", ".join([*self.arguments, *self.pixels])

    def c_parameters(self):
        given = ["relign_assembly* assembly"] + [KINDS[kind][0].format(n=name) for name, kind in self.arguments.items()]
        given += [f"float* {name}" for name in self.pixels]
        return joined(given + [RESULTS[result["kind"]][0].format(n=name) for name, result in self.values.items()])

    def sentences(self, values=True):
        """Purpose, explanation and results as text."""
        results = self.results if values else self.pixels
        what = [f"{name}: {result['about']}." for name, result in results.items() if "about" in result]
        each = [f"One row of results for each of `{self.each}`."] if self.each and values else []
        return [f"{self.plain[0].upper()}{self.plain[1:]}. {self.about}".strip(), *each, *what]


def read_abilities():
    return [Ability(given) for given in tomllib.loads((HERE / "scene.toml").read_text())["ability"]]


# ---- C tables ---------------------------------------------------------------------------------

C_HEADER = '''/*
 * relign/scene/abilities.h: the optional abilities of a scene's assemblies. get_extension of relign_scene_interface
 * returns their tables by id.
 *
 * All are pure functions of their arguments. pose: a true pose (`axes` values). pixels: whole images. Images and arrays
 * are memory of the caller. RELIGN_UNSUPPORTED: this assembly does not offer it; or RELIGN_FAILED.
 * {made}.
 */
/* clang-format off */
#ifndef RELIGN_SCENE_ABILITIES_H
#define RELIGN_SCENE_ABILITIES_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {{
#endif

{tables}#ifdef __cplusplus
}}
#endif

#endif /* RELIGN_SCENE_ABILITIES_H */
'''


def c_table(ability):
    text = c_comment(f'"{ability.id}": ' + " ".join(ability.sentences()))
    text += f'#define {ability.macro} "{ability.id}"\n'
    text += f"typedef struct {ability.table} {{\n  uint32_t struct_size;\n  uint32_t reserved;\n"
    text += "  /* [object-thread] */\n"
    text += unbroken(f"relign_status (*{ability.name})({ability.c_parameters()});", "  ", " " * 6)
    return text + f"}} {ability.table};\n\n"


# ---- C++: the class that assemblies override, and its tables -----------------------------------

CPP_HEADER = '''// relign/abilities.hpp: the optional abilities of a scene's assemblies. Comes with relign/plugin.hpp.
// {made}.
// clang-format off
#ifndef RELIGN_ABILITIES_HPP
#define RELIGN_ABILITIES_HPP

#include <cstdint>
#include <optional>
#include <relign/basics.hpp>
#include <vector>

namespace relign {{

// Override what the scene offers. Each function returns nothing (false, an empty list) when this assembly does not
// offer it, and is a pure function of its arguments. Poses are true poses. Pixels are whole images,
// memory of the caller.
class Abilities {{
 public:
  virtual ~Abilities() = default;
{functions}}};

// What the scene says beforehand about its assemblies.
class SceneAbilities {{
 public:
  virtual ~SceneAbilities() = default;
{offered}}};

}}  // namespace relign

#endif  // RELIGN_ABILITIES_HPP
'''


def cpp_function(ability):
    text = "\n"
    if ability.struct:
        members = ""
        for name, result in ability.values.items():
            member = f"{RESULTS[result['kind']][1]} {name}{'' if result['kind'] == 'pose' else ' = 0'};"
            members += wrapped(f"{member}  // {result['about']}" if "about" in result else member, "    ", "    // ")
        text += f"  struct {ability.struct} {{\n{members}  }};\n"
    text += wrapped(" ".join(ability.sentences(values=not ability.struct)), "  // ", "  // ")
    end = f" {{\n    return {ability.nothing};\n  }}\n"
    return text + unbroken("virtual " + ability.declaration("", named=False), "  ", " " * 6).rstrip("\n") + end


TABLES_HEADER = '''// relign/ability_tables.hpp: the tables of an assembly's abilities, for relign/border.hpp.
// {made}.
// clang-format off
#ifndef RELIGN_ABILITY_TABLES_HPP
#define RELIGN_ABILITY_TABLES_HPP

#include <relign/plugin.h>

#include <relign/handle.hpp>
#include <relign/scene.hpp>

namespace relign::border {{

{tables}// The table of an ability by its id; null when the scene does not offer it.
inline const void* ability_table([[maybe_unused]] const Scene& scene, std::string_view id) {{
{found}  return nullptr;
}}

}}  // namespace relign::border

#endif  // RELIGN_ABILITY_TABLES_HPP
'''


def cpp_types(text):
    return re.sub(r"\b(uint32_t|uint64_t)\b", r"std::\1", text)


def table_function(ability):
    passed = [FROM_C.get(kind, "{n}").format(n=name) for name, kind in ability.arguments.items()] + list(ability.pixels)
    text = f"inline const {ability.table}* {ability.table[7:]}() {{\n  static const {ability.table} table = {{\n"
    text += f"      sizeof({ability.table}), 0,\n"
    text += unbroken(f"[]({cpp_types(ability.c_parameters())}) -> relign_status\0{{", " " * 6, " " * 10)
    text += "        auto* mine = handle<Assembly>(assembly);\n        return guard(mine->host, [&] {\n"
    text += unbroken(f"const auto found = mine->object->{ability.name}({joined(passed)});", " " * 10, " " * 14)
    text += f"          if ({'found.empty()' if ability.each else '!found'}) return RELIGN_UNSUPPORTED;\n"
    if ability.each:
        text += f'          check_count("{ability.name}", found.size(), count);\n'
        text += "          for (std::size_t i = 0; i < found.size(); ++i) {\n"
        text += "".join(f"            {name}[i] = found[i].{name};\n" for name in ability.values) + "          }\n"
    for name, result in ({} if ability.each else ability.values).items():
        value = ability.of_result(name)
        if result["kind"] == "pose":
            text += f'          check_count("{ability.name}", {value}.size(), axes);\n'
            text += f"          std::copy({value}.begin(), {value}.end(), {name});\n"
        else:
            text += f"          *{name} = {value};\n"
    return text + "          return RELIGN_OK;\n        });\n      }};\n  return &table;\n}\n\n"


def tables_header(abilities):
    found = ""
    for ability in abilities:
        table = f"{ability.table[7:]}()"
        table = f"scene.{ability.offered}() ? {table} : nullptr" if ability.offered else table
        found += f"  if (id == {ability.macro}) return {table};\n"
    return TABLES_HEADER.format(made=MADE, tables="".join(map(table_function, abilities)), found=found)


# ---- the host, included by the build -----------------------------------------------------------


def host_tables(abilities):
    text = f"// {MADE}.\nstruct AbilityTables {{\n"
    text += "".join(f"  const {ability.table}* {ability.name} = nullptr;\n" for ability in abilities)
    text += "};\n\n// Calls `visit` with name, id, table and function of each ability.\n"
    text += "template <class Visit>\nvoid for_each_ability(AbilityTables& tables, Visit&& visit) {\n"
    text += "".join(f'  visit("{a.name}", {a.macro}, tables.{a.name}, &{a.table}::{a.name});\n' for a in abilities)
    return text + "}\n"


def library_function(ability):
    passed = ["object_"] + [KINDS[kind][2].format(n=name) for name, kind in ability.arguments.items()]
    passed += ability.pixels
    text = unbroken(ability.declaration("\0override\0{"), "", " " * 4)
    if ability.each:
        text += f"  std::vector<{ability.struct}> found({ability.each}.size());\n"
        for name, result in ability.values.items():
            text += f"  std::vector<{RESULTS[result['kind']][1]}> {name}(found.size());\n"
        passed += [f"{name}.data()" for name in ability.values]
    elif ability.values:
        text += f"  {ability.returned} found(std::in_place);\n"
    for name, result in ({} if ability.each else ability.values).items():
        value = ability.of_result(name)
        if result["kind"] == "pose":
            text += f"  {value}.resize(axes());\n"
        passed.append(f"{value}.data(), count_of({value})" if result["kind"] == "pose" else f"&{value}")
    call = f'offers(tables_.{ability.name}, "{ability.name}", [&] {{\n'
    call += unbroken(f"return tables_.{ability.name}->{ability.name}({', '.join(passed)});", " " * 4, " " * 8) + "  })"
    if not ability.values:
        return text + f"  return {call};\n}}\n"
    text += f"  const bool offered = {call};\n  if (!offered) return {ability.nothing};\n"
    if ability.each:
        row = ", ".join(f"{name}[i]" for name in ability.values)
        text += f"  for (std::size_t i = 0; i < found.size(); ++i) found[i] = {{{row}}};\n"
    return text + "  return found;\n}\n"


def process_function(ability):
    text = unbroken(ability.declaration("\0override\0{"), "", " " * 4)
    text += f'  Request request = about("{ability.name}");\n'
    text += "".join(f'  request.add("{name}", {name});\n' for name in ability.arguments)
    asked = ", ".join(["request", *ability.pixels, *([ability.images] if ability.images else [])])
    if not ability.values:
        return text + f"  return ask({asked}).has_value();\n}}\n"
    text += f"  const auto answer = ask({asked});\n  if (!answer) return {ability.nothing};\n"
    if ability.each:
        text += f"  std::vector<{ability.struct}> found({ability.each}.size());\n"
        for name, result in ability.values.items():
            kind = RESULTS[result["kind"]][1]
            text += f"  std::vector<{kind}> {name};\n"
            text += f'  take(*answer, "{ability.name}", "{name}", {name}, found.size());\n'
        row = ", ".join(f"{name}[i]" for name in ability.values)
        return text + f"  for (std::size_t i = 0; i < found.size(); ++i) found[i] = {{{row}}};\n  return found;\n}}\n"
    text += f"  {ability.returned} found(std::in_place);\n"
    for name, result in ability.values.items():
        size = ", axes()" if result["kind"] == "pose" else ""
        text += f'  take(*answer, "{ability.name}", "{name}", {ability.of_result(name)}{size});\n'
    return text + "  return found;\n}\n"


def checked_function(ability):
    text = unbroken(ability.declaration("\0{", "MountedAssembly::"), "", " " * 4)
    text += f"  auto found = implementation_->backend->{ability.name}({ability.call()});\n"
    checked = [(name, r["kind"]) for name, r in ability.values.items() if r["kind"] not in ("number", "integer")]
    if checked or ability.offered:
        text += f'  const Checks check{{*implementation_->scene->backend, "{ability.name}"}};\n'
    if ability.offered:
        text += f'  if (!found) check.refuse("its \'{ability.offered}\' is true, but this assembly lacks it");\n'
    text += f"  {'for (const auto& row : found)' if ability.each else 'if (found)'} {{\n" if checked else ""
    text += "".join(f'    check.{kind}("{name}", {f"row.{name}" if ability.each else ability.of_result(name)});\n'
                    for name, kind in checked)
    return text + ("  }\n" if checked else "") + "  return found;\n}\n"


def files_of_build(abilities):
    head = f"// {MADE}.\n"
    return {
        "ability_overrides.inc": head + "".join(unbroken(a.declaration("\0override;"), "", " " * 4) for a in abilities),
        "ability_tables.inc": host_tables(abilities),
        "library_abilities.inc": head + "\n".join(map(library_function, abilities)),
        "process_abilities.inc": head + "\n".join(map(process_function, abilities)),
        "checked_abilities.inc": head + "\n".join(map(checked_function, abilities)),
    }


# ---- Python -----------------------------------------------------------------------------------

PYTHON_MODULE = '''"""Optional abilities of a scene's assemblies.

{made}.
"""

from __future__ import annotations

from .ability import Ability

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    Pose = tuple[float, ...]


class AssemblyAbilities:
    """Optional methods of an assembly; override those that the scene offers.

    Each returns None when this assembly does not offer it. Poses are true poses.
    """
{functions}

class SceneAbilities:
    """What the scene says beforehand about its assemblies."""

{offered}

ABILITIES = {{
{table}}}
"""By name; what the messages to an assembly contain."""
'''


def python_function(ability, docstring):
    parameters = ["self"] + [f"{name}: {PYTHON.get(kind, KINDS[kind][3])}" for name, kind in ability.arguments.items()]
    values = ["Any"] * len(ability.pixels) + [RESULTS[result["kind"]][2] for result in ability.values.values()]
    made = values[0] if len(values) == 1 else f"tuple[{', '.join(values)}]"
    made = f"Sequence[{made}]" if ability.each else made
    names = list(ability.results)
    shown = names[0] if len(names) == 1 else f"({', '.join(names)})"
    returns = [f"{shown}{f', for each of {ability.each}' if ability.each else ''}."]
    returns += [said for said in ability.sentences()[1:] if not said.startswith("One row")]
    title, about = f"{ability.plain[0].upper()}{ability.plain[1:]}.", ability.about.replace("`", "")
    about += f" Only of a scene with {ability.offered} = True." if ability.offered else ""
    first = title if len(title) < 100 else title.split(";", 1)[0] + "."
    text = f"\n    def {ability.name}({', '.join(parameters)}) -> {made if made == 'Any' else made + ' | None'}:\n"
    text += docstring(f"{first} {about}".strip(), [("Returns", [" ".join(returns)])], "        ")
    return text + "        return None\n"


def python_module(abilities, docstring):
    def listed(members):
        return "{" + ", ".join(f'"{name}": "{kind}"' for name, kind in members.items()) + "}"

    table = ""
    for ability in abilities:
        results = {name: result["kind"] for name, result in ability.results.items()}
        table += f'    "{ability.name}": Ability(\n        arguments={listed(ability.arguments)},\n'
        table += f"        results={listed(results)},\n"
        table += f'        each="{ability.each}",\n' if ability.each else ""
        table += f'        offered="{ability.offered}",\n' if ability.offered else ""
        table += "    ),\n"
    offered = "".join(f"    {a.offered} = False  # whether its assemblies have {a.name}\n"
                      for a in abilities if a.offered)
    functions = "".join(python_function(ability, docstring) for ability in abilities)
    return PYTHON_MODULE.format(made=MADE, functions=functions, offered=offered, table=table)


# ---- documents --------------------------------------------------------------------------------


def abilities_table(abilities):
    text = "| function | provides |\n|---|---|\n"
    for ability in abilities:
        condition = f"; only of a scene whose `{ability.offered}` is true" if ability.offered else ""
        text += f"| `{ability.name}({', '.join(ability.arguments)})` | {ability.purpose}{condition} |\n"
    return text


def messages_table(abilities):
    text = "| `ability` | arguments | `result` |\n|---|---|---|\n"
    for ability in abilities:
        values = [f"`{name}`" for name in ability.values]
        result = ", ".join(values) + (f" (lists: a value for each of `{ability.each}`)" if ability.each else "")
        image = "".join(r["kind"].replace("pixels of ", "").replace("pixels", "image") for r in ability.pixels.values())
        result += f"{'; ' if result and image else ''}**{image}**" if image else ""
        text += f"| `{ability.name}` | {', '.join(f'`{name}`' for name in ability.arguments)} | {result} |\n"
    return text


def files_of_tree(abilities, docstring):
    header, python = HERE / "relign", HERE.parents[1] / "python" / "relign_bench" / "plugin"
    offered = "".join(f"  // Whether its assemblies have {a.name}.\n"
                      f"  virtual bool {a.offered}() const {{ return false; }}\n" for a in abilities if a.offered)
    functions = "".join(map(cpp_function, abilities))
    return {
        header / "scene" / "abilities.h": C_HEADER.format(made=MADE, tables="".join(map(c_table, abilities))),
        header / "abilities.hpp": CPP_HEADER.format(made=MADE, offered=offered, functions=functions),
        header / "ability_tables.hpp": tables_header(abilities),
        python / "ability_classes.py": python_module(abilities, docstring),
    }
