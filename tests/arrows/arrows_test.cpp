// The rooms of core/ stay rooms: no include and no link against the arrows of core/arrows.txt.
#include "arrows/arrows.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

namespace relign::arrows {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string read(const fs::path& file) {
  std::ifstream stream(file);
  if (!stream) ADD_FAILURE() << "cannot read " << file;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// Without comments and empty lines.
std::string table_lines(const std::string& text) {
  std::istringstream lines(text);
  std::string line, kept;
  while (std::getline(lines, line))
    if (!line.empty() && line.front() != '#') kept += line + "\n";
  return kept;
}

TEST(Arrows, TheTreeHasNoWrongOne) {
  const fs::path root = RELIGN_SOURCE_DIR;
  EXPECT_THAT(wrong_arrows(root, Arrows(read(root / "core/arrows.txt"))), IsEmpty());
}

TEST(Arrows, TheMapQuotesTheTable) {
  const fs::path root = RELIGN_SOURCE_DIR;
  EXPECT_THAT(read(root / "core/README.md"),
              HasSubstr("```text\n" + table_lines(read(root / "core/arrows.txt")) + "```"));
}

// A small tree of its own, so that the test above is known to be able to fail.
class SmallTree : public testing::Test {
 protected:
  SmallTree() : root_(fs::path(testing::TempDir()) / "relign_arrows_test") {
    fs::remove_all(root_);
    write("core/base/text.h", "#include <relign/random.hpp>\n#include <string>\n");
    write("core/optics/trace.h", "#include \"base/text.h\"\n");
    write("core/stats/curves.h", "#include \"base/text.h\"\n");
    write("core/report/report.cpp", "#include \"report/report.h\"\n#include \"stats/curves.h\"\n");
    write("core/report/report.h", "");
    write("plugins/optimizers/compass/compass.cpp", "#include <relign/plugin.hpp>\n#include \"stride.h\"\n");
    write("plugins/optimizers/compass/stride.h", "");
    write("core/report/CMakeLists.txt",
          "relign_add_room(report SOURCES report.cpp DEPENDS relign_stats relign_base)\n");
  }
  ~SmallTree() override { fs::remove_all(root_); }

  void write(const fs::path& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  std::vector<std::string> wrong() { return wrong_arrows(root_, arrows_); }

  const fs::path root_;
  const Arrows arrows_{
      "base -> plugin_api/relign/random.hpp\n"
      "optics -> base\nrecords -> base\nstats -> records base\nreport -> stats base\n"
      "report/lens.cpp -> optics\nagents -> plugin_api\nsurrogates -> plugin_api/relign/random.hpp\n"
      "optimizers -> plugin_api surrogates  # nothing else\n"};
};

TEST_F(SmallTree, IsFineAsItStands) { EXPECT_THAT(wrong(), IsEmpty()); }

TEST_F(SmallTree, AnIncludeAgainstTheArrowsIsFoundWithItsLine) {
  write("core/report/page.cpp", "#include <string>\n#include \"optics/trace.h\"\n");
  EXPECT_THAT(wrong(), ElementsAre("core/report/page.cpp:2: report must not include optics/trace.h"));
}

TEST_F(SmallTree, ARelativePathIsNoWayAround) {
  write("core/stats/sum.cpp", "#  include \"../report/report.h\"\n");
  EXPECT_THAT(wrong(), ElementsAre("core/stats/sum.cpp:1: stats must not include report/report.h"));
}

TEST_F(SmallTree, ArrowsAreFollowedButASingleFileOpensNoRoom) {
  write("core/report/far.cpp", "#include \"records/record.h\"\n#include <relign/random.hpp>\n");
  EXPECT_THAT(wrong(), IsEmpty());
  write("core/report/far.cpp", "#include <relign/plugin.h>\n");
  EXPECT_THAT(wrong(), ElementsAre("core/report/far.cpp:1: report must not include plugin_api/relign/plugin.h"));
}

TEST_F(SmallTree, AFileMayHaveArrowsOfItsOwn) {
  write("core/report/lens.cpp", "#include \"optics/trace.h\"\n");
  EXPECT_THAT(wrong(), IsEmpty());
  write("core/report/CMakeLists.txt", "target_link_libraries(relign_report PRIVATE relign_optics)\n");
  EXPECT_THAT(wrong(), IsEmpty());
}

TEST_F(SmallTree, AnOptimizerMayNotUseTheRoomsNorItsTestHideThem) {
  write("plugins/optimizers/compass/compass.cpp", "#include \"base/text.h\"\n");
  write("plugins/optimizers/compass/compass_test.cpp", "#include \"base/text.h\"\n");
  EXPECT_THAT(wrong(),
              ElementsAre("plugins/optimizers/compass/compass.cpp:1: optimizers must not include base/text.h"));
}

TEST_F(SmallTree, APluginMayNotReachIntoAnother) {
  write("plugins/optimizers/wide/wide.cpp", "#include \"../compass/stride.h\"\n");
  EXPECT_THAT(wrong(), ElementsAre("plugins/optimizers/wide/wide.cpp:1: optimizers must not include "
                                   "plugins/optimizers/compass/stride.h"));
}

TEST_F(SmallTree, ALibraryOfPluginsIsARoomOfItsOwn) {
  write("plugins/surrogates/CMakeLists.txt", "target_link_libraries(relign_surrogates PUBLIC relign::plugin_api)\n");
  write("plugins/surrogates/kernel.hpp", "");
  write("plugins/surrogates/kernel.cpp", "#include \"kernel.hpp\"\n#include <relign/random.hpp>\n");
  write("plugins/optimizers/compass/compass.cpp", "#include \"surrogates/kernel.hpp\"\n");
  write("plugins/optimizers/compass/CMakeLists.txt",
        "relign_add_plugin(compass compass.cpp LIBRARIES relign_surrogates)\n");
  EXPECT_THAT(wrong(), IsEmpty());
  write("plugins/surrogates/kernel.cpp", "#include <relign/plugin.hpp>\n#include \"base/text.h\"\n");
  write("plugins/agents/net/net.cpp", "#include \"surrogates/kernel.hpp\"\n");
  write("plugins/agents/net/CMakeLists.txt", "relign_add_plugin(net net.cpp LIBRARIES relign_surrogates)\n");
  EXPECT_THAT(wrong(),
              ElementsAre("plugins/agents/net/CMakeLists.txt: agents must not link relign_surrogates",
                          "plugins/agents/net/net.cpp:1: agents must not include surrogates/kernel.hpp",
                          "plugins/surrogates/kernel.cpp:1: surrogates must not include plugin_api/relign/plugin.hpp",
                          "plugins/surrogates/kernel.cpp:2: surrogates must not include base/text.h"));
}

TEST_F(SmallTree, ALinkAgainstTheArrowsIsFound) {
  write("core/stats/CMakeLists.txt",
        "# relign_report may stand in a comment\nrelign_add_room(stats\n  SOURCES a.cpp\n  DEPENDS relign_report)\n");
  write("plugins/optimizers/compass/CMakeLists.txt", "relign_add_plugin(compass compass.cpp LIBRARIES relign_base)\n");
  EXPECT_THAT(wrong(), ElementsAre("core/stats/CMakeLists.txt: stats must not link relign_report",
                                   "plugins/optimizers/compass/CMakeLists.txt: optimizers must not link relign_base"));
}

TEST_F(SmallTree, ANewRoomNeedsALine) {
  write("core/magic/wand.h", "");
  EXPECT_THAT(wrong(), ElementsAre("core/magic: 'magic' has no line in core/arrows.txt"));
}

TEST(ArrowTable, RefusesALineWithoutAnArrow) {
  EXPECT_THROW(Arrows("base plugin_api\n"), std::runtime_error);
  EXPECT_THROW(Arrows("base ->\n"), std::runtime_error);
}

}  // namespace
}  // namespace relign::arrows
