"""Modules of core/ and plugins depend on each other as core/dependencies.txt says."""

import pathlib
import re
import tempfile
import unittest

from dependencies import Table, forbidden

ROOT = pathlib.Path(__file__).resolve().parents[2]


class TheTree(unittest.TestCase):
    table = (ROOT / "core/dependencies.txt").read_text()

    def test_has_no_forbidden_include_or_link(self):
        self.assertEqual(forbidden(ROOT, Table(self.table)), [])

    def test_has_no_circle(self):
        self.assertEqual(Table(self.table).circles(), [])

    def test_readme_quotes_the_table(self):
        lines = [line for line in self.table.splitlines() if line and not line.startswith("#")]
        self.assertIn("```text\n" + "\n".join(lines) + "\n```", (ROOT / "core/README.md").read_text())

    def test_json_is_read_by_functions_that_refuse_a_key_twice(self):
        base = ROOT / "core/foundation/base"
        policies = ROOT / "core/training/policies"  # needs the plugin interface alone, as agents do
        found = [str(file.relative_to(ROOT)) for file in (ROOT / "core").rglob("*.cpp")
                 if file.parent not in (base, policies) and re.search(r"\bjson::(sax_)?parse\(", file.read_text(), re.IGNORECASE)]
        self.assertEqual(found, [], "use valid_json or parsed_json of base/json_source.h")


class SmallTree(unittest.TestCase):
    """A tree made for the test, so that the checks above are known to be able to fail."""

    table = Table("""
        base -> plugin_api/relign/random.hpp
        optics -> base
        records -> base
        statistics -> records base
        report -> statistics base
        agents -> plugin_api
        surrogates -> plugin_api/relign/random.hpp
        optimizers -> plugin_api surrogates  # nothing else
    """)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("core/foundation/base/text.h", "#include <relign/random.hpp>\n#include <string>\n")
        self.write("core/simulator/optics/trace.h", '#include "base/text.h"\n')
        self.write("core/analysis/statistics/curves.h", '#include "base/text.h"\n')
        self.write("core/analysis/report/report.cpp", '#include "report/report.h"\n#include "statistics/curves.h"\n')
        self.write("core/analysis/report/report.h", "")
        self.write("plugins/optimizers/compass/compass.cpp", '#include <relign/plugin.hpp>\n#include "stride.h"\n')
        self.write("plugins/optimizers/compass/stride.h", "")
        self.write("core/analysis/report/CMakeLists.txt",
                   "relign_add_module(report SOURCES report.cpp DEPENDS relign_statistics relign_base)\n")

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text)

    def expect(self, *sentences):
        self.assertEqual(forbidden(self.root, self.table), list(sentences))

    def test_accepts_allowed_dependencies(self):
        self.expect()

    def test_finds_a_forbidden_include_with_its_line(self):
        self.write("core/analysis/report/page.cpp", '#include <string>\n#include "optics/trace.h"\n')
        self.expect("core/analysis/report/page.cpp:2: report must not include optics/trace.h")

    def test_finds_a_relative_include(self):
        self.write("core/analysis/statistics/sum.cpp", '#  include "../report/report.h"\n')
        self.expect("core/analysis/statistics/sum.cpp:1: statistics must not include report/report.h")

    def test_follows_dependencies_but_not_beyond_a_single_header(self):
        self.write("core/analysis/report/far.cpp", '#include "records/record.h"\n#include <relign/random.hpp>\n')
        self.expect()
        self.write("core/analysis/report/far.cpp", "#include <relign/plugin.h>\n")
        self.expect("core/analysis/report/far.cpp:1: report must not include plugin_api/relign/plugin.h")

    def test_exempts_tests_beside_a_plugin(self):
        self.write("plugins/optimizers/compass/compass.cpp", '#include "base/text.h"\n')
        self.write("plugins/optimizers/compass/compass_test.cpp", '#include "base/text.h"\n')
        self.expect("plugins/optimizers/compass/compass.cpp:1: optimizers must not include base/text.h")

    def test_keeps_plugins_apart(self):
        self.write("plugins/optimizers/wide/wide.cpp", '#include "../compass/stride.h"\n')
        self.expect("plugins/optimizers/wide/wide.cpp:1: optimizers must not include optimizers/stride.h")

    def test_treats_a_library_of_plugins_as_a_module(self):
        self.write("plugins/surrogates/CMakeLists.txt", "target_link_libraries(relign_surrogates PUBLIC relign::plugin_api)\n")
        self.write("plugins/surrogates/kernel.hpp", "")
        self.write("plugins/surrogates/kernel.cpp", '#include <relign/plugin.hpp>\n#include "base/text.h"\n')
        self.write("plugins/optimizers/compass/compass.cpp", '#include "surrogates/kernel.hpp"\n')
        self.write("plugins/agents/net/net.cpp", '#include "surrogates/kernel.hpp"\n')
        self.write("plugins/agents/net/CMakeLists.txt", "relign_add_plugin(net net.cpp LIBRARIES relign_surrogates)\n")
        self.expect("plugins/agents/net/CMakeLists.txt: agents must not link relign_surrogates",
                    "plugins/agents/net/net.cpp:1: agents must not include surrogates/kernel.hpp",
                    "plugins/surrogates/kernel.cpp:1: surrogates must not include plugin_api/relign/plugin.hpp",
                    "plugins/surrogates/kernel.cpp:2: surrogates must not include base/text.h")

    def test_finds_a_forbidden_link(self):
        self.write("core/analysis/statistics/CMakeLists.txt",
                   "# relign_report in a comment\nrelign_add_module(statistics\n  SOURCES a.cpp\n  DEPENDS relign_report)\n")
        self.expect("core/analysis/statistics/CMakeLists.txt: statistics must not link relign_report")

    def test_asks_for_a_line_for_a_new_module(self):
        self.write("core/simulator/magic/wand.h", "")
        self.expect("core/simulator/magic: 'magic' has no line in core/dependencies.txt")


class TheTable(unittest.TestCase):
    def test_refuses_a_line_without_an_arrow(self):
        for line in ("base plugin_api", "base ->"):
            with self.assertRaises(ValueError):
                Table(line)

    def test_finds_a_circle(self):
        self.assertEqual(Table("a -> b\nb -> c\nc -> a\nd -> a").circles(), ["a", "b", "c"])


if __name__ == "__main__":
    unittest.main()
