// Compares every --help with the approved texts in tests/cli/golden, and with docs/commands.md, which consists of them.
// After an intended change:
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

// Runs the program once per verb.
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

TEST(CliHelp, MatchesApprovedTextForEveryVerb) {
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
    EXPECT_EQ(text, approved.str()) << file << ": approve an intended change with RELIGN_UPDATE_GOLDEN=1";
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(kGolden))
    EXPECT_EQ(expected_files.count(entry.path().filename()), 1U) << entry.path() << " has no verb";
}

// docs/commands.md: every help text, with the global options only once, and the list of `explain`.
std::string document(const std::vector<std::vector<std::string>>& verbs) {
  std::string text =
      "# The command line\n\nThe output of `relign-bench VERB --help` for every verb. The global options of the first "
      "block are allowed after every verb.\nA test generates this page (`RELIGN_UPDATE_GOLDEN=1 ctest --test-dir "
      "build/release -R cli_help`) and fails if it is out of date.\n";
  for (const std::vector<std::string>& verb : verbs) {
    std::string name = "relign-bench";
    for (const std::string& word : verb) name += " " + word;
    std::string shown = help(verb);
    const std::size_t global = shown.find("\nGlobal options:\n");
    if (global != std::string::npos) shown.erase(global, shown.find("\n\n", global) + 1 - global);
    text += "\n## " + name + "\n\n```text\n" + shown + "```\n";
  }
  const Outcome codes = relign_bench(Workplace(), {"explain"});
  EXPECT_EQ(codes.exit_code, 0);
  return text + "\n## Exit codes and ends of trials\n\n```text\n" + codes.out + "```\n";
}

TEST(CliHelp, MatchesCommandsDocument) {
  std::vector<std::vector<std::string>> verbs;
  collect({}, verbs);
  const fs::path file = fs::path(RELIGN_SOURCE_DIR) / "docs/commands.md";
  const std::string text = document(verbs);
  if (std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr) std::ofstream(file) << text;
  std::ifstream stream(file);
  std::ostringstream written;
  written << stream.rdbuf();
  EXPECT_EQ(text, written.str()) << file << ": approve an intended change with RELIGN_UPDATE_GOLDEN=1";
}

TEST(CliHelp, HasExampleAndSeeAlsoForEveryVerb) {
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

TEST(CliHelp, IsPrintedToStderrWithoutArguments) {
  const Outcome outcome = relign_bench(Workplace(), {});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, testing::StartsWith("Expected a verb. Five things to do next:\n\n  "));
  EXPECT_THAT(outcome.err, HasSubstr("relign-bench run suites/quick.json\n"));
}

TEST(CliVersion, NamesProgramAndPluginInterface) {
  const Outcome outcome = relign_bench(Workplace(), {"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, testing::MatchesRegex("relign-bench [0-9.]+ \\(plugin interface [0-9.]+\\)\n"));
}

}  // namespace
}  // namespace relign::cli_test
