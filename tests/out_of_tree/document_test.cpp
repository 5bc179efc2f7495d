// The tutorials, followed like a reader: runs every ```sh block in order, in one shell, in a folder that looks like a
// built clone; compares every listing after a comment <!-- file --> with that file.
//
// docs/tutorial_policy.md trains for a minute or two if RELIGN_TRAINING is set and torch is installed. Otherwise
// relign-train only parses its arguments and copies the shipped network to the place of the trained one, so that the
// rest can run.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>
#include <vector>

#include "base/files.h"
#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = RELIGN_SOURCE_DIR;

struct Block {
  std::string language;
  std::string file;  // named in the comment above; empty: none
  std::string text;
};

std::vector<Block> blocks_of(const std::string& document) {
  std::vector<Block> blocks;
  std::istringstream lines(document);
  std::string line, above;
  bool inside = false;
  while (std::getline(lines, line)) {
    const bool fence = line.rfind("```", 0) == 0;
    if (fence && !inside) {
      const bool named = above.rfind("<!-- ", 0) == 0;
      blocks.push_back({line.substr(3), named ? above.substr(5, above.find(" -->") - 5) : "", ""});
    }
    if (fence) inside = !inside;
    if (!fence && inside) blocks.back().text += line + "\n";
    above = line;
  }
  EXPECT_FALSE(inside) << "unclosed block";
  return blocks;
}

// Creates the folders that the documents use: build/release, examples/.
void look_like_a_clone(const Workplace& place) {
  fs::create_directories(place.path("build"));
  fs::create_directory_symlink(RELIGN_BUILD_DIR, place.path("build/release"));
  fs::create_directory_symlink(kSource / "examples", place.path("examples"));
}

// Runs all commands of the document after `before`. Returns their output.
std::string follow(const Workplace& place, const std::string& document, const std::string& before = "") {
  look_like_a_clone(place);
  std::string script = "set -eu\nexport HOME='" + place.folder().string() + "'\n" + before;
  std::vector<Block> listings;
  int commands = 0;
  for (const Block& block : blocks_of(read_file(kSource / "docs" / document))) {
    if (block.language == "sh") {
      script += block.text;
      ++commands;
    } else {
      EXPECT_NE(block.file, "") << "a listing without a file, or a block that is not run:\n" << block.text;
      listings.push_back(block);
    }
  }
  EXPECT_GE(commands, 5);
  const Outcome outcome = shell(place, script);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  for (const Block& listing : listings) EXPECT_EQ(listing.text, place.read(listing.file)) << listing.file;
  return outcome.out + outcome.err;
}

TEST(PluginsDocument, RunsEveryCommandAndMatchesEveryListing) {
  const Workplace place;
  const std::string said = follow(place, "plugins.md");
  EXPECT_TRUE(fs::exists(place.path("my_search/my_search.cpp"))) << said;
  EXPECT_TRUE(fs::exists(place.path("my_search/results/report.html"))) << said;
}

TEST(LensTutorial, RunsEveryCommandAndMatchesTheReport) {
  const Workplace place;
  const std::string said = follow(place, "tutorial_lens.md");
  const std::string page = place.read("results/triplet/report.html");
  ASSERT_NE(page, "") << said;
  const std::string document = read_file(kSource / "docs/tutorial_lens.md");
  const std::string reading = document.substr(document.find("## 5."));
  for (const std::string section : {"Verdict", "Ranking", "Error after each step", "Pairwise comparisons", "Pictures",
                                    "Run status", "Methods", "Provenance"}) {
    EXPECT_NE(page.find("<h2>" + section + "<"), std::string::npos) << "the page has no section " << section;
    EXPECT_NE(reading.find("**" + section + "**"), std::string::npos) << "the tutorial does not explain " << section;
  }
  // The picture in the tutorial shows this report: the same suite on the same instances.
  EXPECT_NE(page.find("<b>through-focus-quick</b> has the lowest median error, 0.000779"), std::string::npos)
      << "docs/images/triplet_report.png and the tutorial's text show another run";
}

TEST(ProblemTutorial, RunsEveryCommandAndNamesTheScore) {
  const Workplace place;
  const std::string said = follow(place, "tutorial_problem.md");
  EXPECT_NE(said.find("loss in dB"), std::string::npos) << said;
  EXPECT_EQ(said.find("RMSE"), std::string::npos) << said;
  const std::string page = place.read("pinhole/results/report.html");
  EXPECT_NE(page.find("loss in dB"), std::string::npos);
}

TEST(CameraTutorial, RunsEveryCommandAndExplainsTheReport) {
  const Workplace place;
  const std::string said = follow(place, "tutorial_camera.md");
  const std::string page = place.read("results/module/report.html");
  ASSERT_NE(page, "") << said;
  for (const std::string section : {">Verdict</h2>", ">Ranking</h2>", ">To specification</h3>", ">Cost</h3>"})
    EXPECT_NE(page.find(section), std::string::npos) << section;
  EXPECT_TRUE(fs::exists(place.path("results/module/costs.csv"))) << said;
}

// Parses its arguments with the program's own parser, and copies the shipped network to the place of the trained one.
const char* const kStandIn = R"(
import pathlib, shutil, sys
from relign_bench.training.cli import make_parser

given = make_parser().parse_args(sys.argv[1:])
out = pathlib.Path(given.out)
if given.verb == "export":
    assert pathlib.Path(given.folder).is_dir(), given.folder
else:
    out.mkdir(parents=True, exist_ok=True)
    out = out / ("imitation.onnx" if given.verb == "imitate" else "ppo.onnx")
for ending in (".onnx", ".json"):
    shutil.copyfile(f"{sys.path[0]}/shipped{ending}", out.with_suffix(ending))
)";

// relign-train on the PATH, as pip would install it: the package of the build, or its stand-in.
std::string training_program(const Workplace& place, bool trains) {
  place.write("bin/stand_in.py", kStandIn);
  for (const std::string ending : {".onnx", ".json"})
    fs::copy_file(kSource / ("plugins/agents/imitation/imitation" + ending), place.path("bin/shipped" + ending));
  place.write("bin/relign-train",
              "#!/bin/sh\nexport PYTHONPATH='" RELIGN_BUILD_DIR
              "/python' PYTHONDONTWRITEBYTECODE=1\nexec '" RELIGN_TRAINING_PYTHON "' " +
                  (trains ? "-m relign_bench.training" : "'" + place.path("bin/stand_in.py").string() + "'") +
                  " \"$@\"\n");
  fs::permissions(place.path("bin/relign-train"), fs::perms::owner_all);
  return "export PATH=\"$PWD/bin:$PATH\"\n";
}

TEST(PolicyTutorial, RunsEveryCommandWithTheShippedNetwork) {
  const Workplace place;
  const std::string said = follow(place, "tutorial_policy.md", training_program(place, false));
  EXPECT_TRUE(fs::exists(place.path("results/policy/report.html"))) << said;
  EXPECT_TRUE(fs::exists(place.path("my_agent.json")));
}

TEST(PolicyTutorial, RunsEveryCommandWithTraining) {
  if (std::getenv("RELIGN_TRAINING") == nullptr) GTEST_SKIP() << "RELIGN_TRAINING is not set: trains for minutes";
  if (std::system("'" RELIGN_TRAINING_PYTHON "' -c 'import torch, onnx' 2>/dev/null") != 0)
    GTEST_SKIP() << "training needs torch and onnx, from the Python index";
  const Workplace place;
  const std::string said = follow(place, "tutorial_policy.md", training_program(place, true));
  EXPECT_TRUE(fs::exists(place.path("training/small/tuning.csv"))) << said;
  EXPECT_TRUE(fs::exists(place.path("results/policy/report.html"))) << said;
}

// [text](path) and [text](path#place) of every document link to a file of the tree.
TEST(Documents, HaveNoBrokenLinks) {
  std::vector<fs::path> documents = {kSource / "README.md", kSource / "CONTRIBUTING.md"};
  for (const char* root : {"docs", "core", "plugins", "examples", "python", "results", "tests"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSource / root))
      if (entry.path().extension() == ".md") documents.push_back(entry.path());
  ASSERT_GE(documents.size(), 30U);
  const std::regex link(R"(\]\(([^)#:\s]+)(#[^)\s]*)?\))");
  for (const fs::path& document : documents) {
    const std::string text = read_file(document);
    for (std::sregex_iterator found(text.begin(), text.end(), link), end; found != end; ++found)
      EXPECT_TRUE(fs::exists(document.parent_path() / (*found)[1].str())) << document << " links to " << (*found)[1];
  }
}

}  // namespace
}  // namespace relign::cli_test
