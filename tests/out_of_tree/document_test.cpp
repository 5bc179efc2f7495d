// docs/plugins.md as its reader meets it: every ```sh block is run, in order, in one shell, with an installed program;
// every listing behind a comment <!-- file --> is compared with that file.
#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "base/files.h"
#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;

struct Block {
  std::string language;
  std::string file;  // what the comment above names; empty: none
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
  EXPECT_FALSE(inside) << "a block is not closed";
  return blocks;
}

TEST(PluginsDocument, EveryCommandRunsAndEveryListingIsTheFile) {
  const Workplace place;
  std::string script = "set -eu\nexport HOME='" + place.folder().string() + "'\n";
  std::vector<Block> listings;
  int commands = 0;
  for (const Block& block : blocks_of(read_file(fs::path(RELIGN_SOURCE_DIR) / "docs/plugins.md"))) {
    if (block.language == "sh") {
      script += block.text;
      ++commands;
    } else {
      ASSERT_NE(block.file, "") << "a listing without a file, or a block that nothing runs:\n" << block.text;
      listings.push_back(block);
    }
  }
  ASSERT_GE(commands, 5);
  ASSERT_GE(listings.size(), 3U);

  // The document speaks of build/release in a clone.
  fs::create_directories(place.path("build"));
  fs::create_directory_symlink(RELIGN_BUILD_DIR, place.path("build/release"));
  const Outcome outcome = shell(place, script);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  for (const Block& listing : listings) EXPECT_EQ(listing.text, place.read(listing.file)) << listing.file;
  EXPECT_TRUE(fs::exists(place.path("my_search/results/report.html"))) << outcome.out << outcome.err;
}

}  // namespace
}  // namespace relign::cli_test
