// Every --help, compared with approved texts in tests/cli/golden, and docs/commands.md, which is made of them. After a
// wanted change:
//   RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R cli_help
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kGolden = fs::path(RELIGN_SOURCE_DIR) / "tests/cli/golden";

// Asked once a verb, however many tests look at it.
const std::string& help(const std::vector<std::string>& verb) {
  static std::map<std::vector<std::string>, std::string> known;
  if (const auto found = known.find(verb); found != known.end()) return found->second;
  std::vector<std::string> arguments = verb;
  arguments.push_back("--help");
  const Outcome outcome = relign_bench(Workplace(), arguments);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  return known[verb] = outcome.out;
}

// The verbs that a help text lists.
std::vector<std::string> listed_verbs(const std::string& text) {
  std::vector<std::string> verbs;
  std::istringstream lines(text);
  std::string line;
  bool inside = false;
  while (std::getline(lines, line)) {
    if (line == "Verbs:") {
      inside = true;
    } else if (line.empty()) {
      inside = false;
    } else if (inside && line.size() > 2 && line[2] != ' ') {
      verbs.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return verbs;
}

// Every path of verbs: {}, {run}, {lens}, {lens, info} ...
void collect(const std::vector<std::string>& path, std::vector<std::vector<std::string>>& all) {
  all.push_back(path);
  for (const std::string& verb : listed_verbs(help(path))) {
    std::vector<std::string> longer = path;
    longer.push_back(verb);
    collect(longer, all);
  }
}

std::string golden_name(const std::vector<std::string>& verb) {
  std::string name = "help";
  for (const std::string& word : verb) name += "_" + word;
  return name + ".txt";
}

TEST(CliHelp, IsAsApprovedForEveryVerb) {
  std::vector<std::vector<std::string>> verbs;
  collect({}, verbs);
  ASSERT_GE(verbs.size(), 8U);
  const bool update = std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr;
  std::set<std::string> expected_files;
  for (const std::vector<std::string>& verb : verbs) {
    const fs::path file = kGolden / golden_name(verb);
    expected_files.insert(file.filename());
    const std::string text = help(verb);
    if (update) {
      fs::create_directories(kGolden);
      std::ofstream(file) << text;
    }
    std::ifstream stream(file);
    std::ostringstream approved;
    approved << stream.rdbuf();
    EXPECT_EQ(text, approved.str()) << file << ": approve a wanted change with RELIGN_UPDATE_GOLDEN=1";
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(kGolden))
    EXPECT_EQ(expected_files.count(entry.path().filename()), 1U) << entry.path() << " belongs to no verb";
}

// docs/commands.md: every help text, the global options once.
std::string document(const std::vector<std::vector<std::string>>& verbs) {
  std::string text =
      "# The command line\n\nWhat `relign-bench VERB --help` prints, for every verb. Every verb takes the global "
      "options of the "
      "first block, too.\nThis page is made by a test (`RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R "
      "cli_help`), "
      "and another run of it fails when it is stale.\n";
  for (const std::vector<std::string>& verb : verbs) {
    std::string name = "relign-bench";
    for (const std::string& word : verb) name += " " + word;
    std::string shown = help(verb);
    const std::size_t global = shown.find("\nGlobal options:\n");
    if (global != std::string::npos) shown.erase(global, shown.find("\n\n", global) + 1 - global);
    text += "\n## " + name + "\n\n```text\n" + shown + "```\n";
  }
  return text;
}

TEST(CliHelp, IsWhatTheDocumentOfCommandsSays) {
  std::vector<std::vector<std::string>> verbs;
  collect({}, verbs);
  const fs::path file = fs::path(RELIGN_SOURCE_DIR) / "docs/commands.md";
  const std::string text = document(verbs);
  if (std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr) std::ofstream(file) << text;
  std::ifstream stream(file);
  std::ostringstream written;
  written << stream.rdbuf();
  EXPECT_EQ(text, written.str()) << file << ": approve a wanted change with RELIGN_UPDATE_GOLDEN=1";
}

TEST(CliHelp, HasAnExampleThatNamesTheVerbAndASeeAlso) {
  std::vector<std::vector<std::string>> verbs;
  collect({}, verbs);
  for (const std::vector<std::string>& verb : verbs) {
    if (verb.empty()) continue;
    const std::string text = help(verb);
    std::string command = "relign-bench";
    for (const std::string& word : verb) command += " " + word;
    const std::string example = text.substr(std::min(text.find("\nExample:\n"), text.size()));
    EXPECT_THAT(example, HasSubstr("  " + command)) << command;
    EXPECT_THAT(text, HasSubstr("\nSee also: ")) << command;
  }
}

TEST(CliHelp, WithoutArgumentsItGoesToStderrAndIsAMistake) {
  const Outcome outcome = relign_bench(Workplace(), {});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, help({}));
}

TEST(CliHelp, TheVersionNamesTheProgram) {
  const Outcome outcome = relign_bench(Workplace(), {"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, testing::MatchesRegex("relign-bench [0-9.]+ \\(plugin interface [0-9.]+\\)\n"));
}

}  // namespace
}  // namespace relign::cli_test
