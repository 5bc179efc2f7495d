"""The binary layout of relign/plugin.h, compared by abidiff with that of the frozen version 1.0.

Each header is compiled into a small library with debug information that uses every struct and every constant of version 1.0.
Members that the current header appends are left out first, since structs that have `struct_size` may grow at the end. Any other
difference fails.
"""

import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
FROZEN = HERE / "frozen_1_0" / "relign" / "plugin.h"
CURRENT = HERE.parents[1] / "core" / "plugin_api" / "relign" / "plugin.h"

COMMENT = re.compile(r"/\*.*?\*/", re.S)
INCLUDE = re.compile(r'^#include "(.+)"$', re.M)
STRUCT = re.compile(r"typedef struct (relign_\w+) \{(.*?)\n\} \1;", re.S)


def text_of(header, seen=None):
    """The text of a header, with the headers of its own folder that it includes."""
    seen = seen if seen is not None else {header}

    def included(found):
        file = (header.parent / found[1]).resolve()
        if file in seen:
            return ""
        seen.add(file)
        return text_of(file, seen)

    return INCLUDE.sub(included, header.read_text())


def uses_of(header):
    """C source with a function for each struct and an array for each constant of the header, whose length encodes the value."""
    text = COMMENT.sub("", header)
    structs = [name for name, _ in STRUCT.findall(text)]
    constants = re.findall(r"^\s+(RELIGN_\w+) =|\b(?:enum \{|,) (RELIGN_\w+) =", text, re.M)
    lines = ["#include <relign/plugin.h>"]
    lines += [f"void use_{name}({name}* given) {{ (void)given; }}" for name in structs]
    lines += [f"char value_{name}[1000 + {name}];" for name in sorted({first or second for first, second in constants})]
    return "\n".join(lines) + "\n", structs


def without_growth(header, frozen):
    """`header` without the members that it appends to structs of `frozen`. relign_text has no size and never grows."""
    members = {name: body.count(";") for name, body in STRUCT.findall(COMMENT.sub("", frozen))}

    def cut(found):
        name, body = found.groups()
        if name == "relign_text" or name not in members:
            return found[0]
        return f"typedef struct {name} {{" + "".join(f"{one};" for one in body.split(";")[:members[name]]) + f"\n}} {name};"

    return STRUCT.sub(cut, COMMENT.sub("", header))


def compare(frozen, current):
    """Exit status and output of abidiff for two texts of plugin.h, both used as the frozen one is."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not shutil.which("abidiff") or not compiler:
        raise unittest.SkipTest("abidiff or a C compiler is not installed (Debian and Ubuntu: abigail-tools)")
    source, _ = uses_of(frozen)
    with tempfile.TemporaryDirectory() as scratch:
        libraries = []
        for name, header in (("frozen", frozen), ("current", without_growth(current, frozen))):
            folder = pathlib.Path(scratch) / name
            (folder / "relign").mkdir(parents=True)
            (folder / "relign" / "plugin.h").write_text(header)
            (folder / "uses.c").write_text(source)
            libraries.append(folder / "uses.so")
            subprocess.run([compiler, "-std=c11", "-g", "-O0", "-w", "-shared", "-fPIC", "-I", folder, folder / "uses.c", "-o",
                            libraries[-1]], check=True)
        done = subprocess.run(["abidiff", *libraries], check=False, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.returncode, done.stdout


class Abi(unittest.TestCase):
    def test_current_header_keeps_the_layout_of_version_1_0(self):
        status, output = compare(text_of(FROZEN), text_of(CURRENT))
        self.assertEqual(status, 0, output)

    def test_every_struct_that_may_grow_has_a_size(self):
        structs = dict(STRUCT.findall(COMMENT.sub("", text_of(CURRENT))))
        without = [name for name, body in structs.items() if not body.lstrip().startswith("uint32_t struct_size;")]
        self.assertEqual(without, ["relign_text"])


class TheCheckItself(unittest.TestCase):
    def compare_changed(self, old, new):
        frozen = text_of(FROZEN)
        self.assertEqual(frozen.count(old), 1, f"choose a line that occurs once: {old}")
        return compare(frozen, frozen.replace(old, new))[0]

    def test_uses_all_structs_and_constants(self):
        frozen = text_of(FROZEN)
        source, structs = uses_of(frozen)
        self.assertEqual(len(structs), COMMENT.sub("", frozen).count("typedef struct relign_") - len(
            re.findall(r"^typedef struct (relign_\w+) \1;", frozen, re.M)))
        for name in ("RELIGN_OK", "RELIGN_UNSUPPORTED", "RELIGN_SAMPLE_FLOAT32", "RELIGN_LOG_WARNING", "RELIGN_OBSERVES_LEVEL"):
            self.assertIn(f"value_{name}[", source)

    def test_accepts_an_appended_member_and_constant(self):
        self.assertEqual(self.compare_changed("} relign_scene_noise_free;", "  uint64_t more;\n} relign_scene_noise_free;"), 0)
        self.assertEqual(self.compare_changed("RELIGN_LOG_WARNING = 2 }", "RELIGN_LOG_WARNING = 2, RELIGN_LOG_MORE = 3 }"), 0)

    def test_rejects_incompatible_changes(self):
        row_stride = "  uint64_t row_stride_bytes; /* from one row to the next */\n"
        pixels = "  const float* pixels;       /* row-major */\n"
        for kind, old, new in (
            ("member removed", row_stride, ""),
            ("relign_text grown", "  uint64_t size;\n} relign_text;", "  uint64_t size;\n  uint64_t more;\n} relign_text;"),
            ("member with another type", pixels, pixels.replace("float", "double")),
            ("members swapped", pixels + row_stride, row_stride + pixels),
            ("member inserted", pixels, "  uint64_t inserted;\n" + pixels),
            ("parameter of another type", "(*log)(void* context, int32_t level,", "(*log)(void* context, int64_t level,"),
            ("constant with another value", "RELIGN_LOG_WARNING = 2 }", "RELIGN_LOG_WARNING = 3 }"),
        ):
            with self.subTest(kind):
                self.assertNotEqual(self.compare_changed(old, new), 0)


if __name__ == "__main__":
    unittest.main()
