"""Finds includes and links that core/dependencies.txt does not allow.

The compiler refuses an include from a wing that a target does not depend on; this finds the rest: modules of one wing, plugins
that reach into each other, circles."""

import pathlib
import re

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^>"]+)[>"]')
LINK = re.compile(r"(?:relign_add_module|relign_add_plugin|target_link_libraries)[ \t]*\(([^)]*)\)")
SOURCES = {".h", ".hpp", ".c", ".cpp", ".inc"}


class Table:
    """Lines "module -> module module/header.h ..."; `#` starts a comment. Raises ValueError for other lines."""

    def __init__(self, text):
        self.direct = {}
        for line in text.splitlines():
            words = line.partition("#")[0].split()
            if words and (len(words) < 3 or words[1] != "->"):
                raise ValueError(f"expected 'module -> module ...', found '{line}'")
            if words:
                self.direct.setdefault(words[0], []).extend(words[2:])
        self.modules = set(self.direct) | {right.partition("/")[0] for rights in self.direct.values() for right in rights}

    def reachable(self, module):
        """Modules and single headers that `module` may use, itself only where the table has a circle."""
        found, unexplored = set(), [module]
        while unexplored:
            for right in self.direct.get(unexplored.pop(), []):
                if right not in found:
                    found.add(right)
                    unexplored.append(right)
        return found

    def circles(self):
        return sorted(module for module in self.direct if module in self.reachable(module))


def units(root):
    """(folder, module) of every folder whose files may include each other."""
    for folder in sorted(path for path in (root / "core").glob("*") if path.is_dir()):
        if (folder / "CMakeLists.txt").exists():
            yield folder, folder.name
        else:
            yield from ((module, module.name) for module in sorted(folder.iterdir()) if module.is_dir())
    for kind in sorted(path for path in (root / "plugins").glob("*") if path.is_dir()):
        if (kind / "CMakeLists.txt").exists():
            yield kind, kind.name  # a library that several plugins share
        else:
            yield from ((plugin, kind.name) for plugin in sorted(kind.iterdir()) if plugin.is_dir())
    yield from ((example, "examples") for example in sorted((root / "examples").glob("*")) if example.is_dir())


def is_test(file):
    return file.stem.endswith("_test") or {"test", "tests"} & set(file.parts)


def included(root, table, folders, unit, file, header):
    """The header as the table names it ("optics/trace.h"); None for a header of the unit itself or of another project."""
    beside = (file.parent / header).resolve()
    if beside.exists():
        for folder, module in folders:
            if beside.is_relative_to(folder):
                return None if folder == unit else f"{module}/{beside.relative_to(folder)}"
        return str(beside.relative_to(root))
    if header.startswith("relign/"):
        return f"plugin_api/{header}"
    return header if "/" in header and header.partition("/")[0] in table.modules else None


def forbidden(root, table):
    """One sentence for each forbidden include and link in core/, plugins/ and examples/, sorted by place."""
    root = root.resolve()
    folders, wrong = list(units(root)), []
    for unit, module in folders:
        if module not in table.modules:
            wrong.append(f"{unit.relative_to(root)}: '{module}' has no line in core/dependencies.txt")
            continue
        allowed = table.reachable(module) | {module}
        for file in sorted(path for path in unit.rglob("*") if path.is_file() and not is_test(path.relative_to(unit))):
            place = file.relative_to(root)
            if file.suffix in SOURCES:
                for number, line in enumerate(file.read_text().splitlines(), 1):
                    match = INCLUDE.match(line)
                    header = match and included(root, table, folders, unit, file, match[1])
                    own = header and header.partition("/")[0] == module and unit.is_relative_to(root / "core")
                    if header and not own and not allowed & {header, header.partition("/")[0]} - {module}:
                        wrong.append(f"{place}:{number}: {module} must not include {header}")
            elif file.name == "CMakeLists.txt":
                text = re.sub("#[^\n]*", "", file.read_text())
                modules_used = {right.partition("/")[0] for right in allowed}
                for words in (match[1].split() for match in LINK.finditer(text)):
                    for word in words[1:] if not words[0].startswith("test_") else []:
                        name = "plugin_api" if word == "relign::plugin_api" else word.removeprefix("relign_")
                        if name != word and name in table.modules and name not in modules_used:
                            wrong.append(f"{place}: {module} must not link {word}")
    return sorted(wrong)
