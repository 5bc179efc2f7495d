// Names of files and users go into scripts, so shells must return every quoted word byte for byte.
#include "base/shell_words.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "cli/program.h"

namespace relign {
namespace {

// A second word follows, so that a lost empty word is detected.
std::string echoed(const std::string& shell, const std::string& word) {
  const cli_test::Workplace place;
  const cli_test::Outcome outcome =
      cli_test::Running(place, {shell, "-c", "printf '[%s]' " + shell_quoted(word) + " end"}).wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  return outcome.out;
}

std::string every_byte() {
  std::string bytes;
  for (int byte = 1; byte < 256; ++byte) bytes += static_cast<char>(byte);  // a word cannot contain a zero byte
  return bytes;
}

class ShellWords : public testing::TestWithParam<const char*> {};

TEST_P(ShellWords, SurviveTheShell) {
  if (!std::filesystem::exists(GetParam())) GTEST_SKIP() << GetParam() << " is not installed";
  for (const std::string& word : {std::string(),
                                  std::string(" "),
                                  std::string("plain-name_1.json"),
                                  std::string("two words"),
                                  std::string("the gate's open"),
                                  std::string("'"),
                                  std::string("''"),
                                  std::string("\\'"),
                                  std::string("\"$HOME\""),
                                  std::string("$(echo no)"),
                                  std::string("`echo no`"),
                                  std::string("${HOME}"),
                                  std::string("a\nb"),
                                  std::string("\n"),
                                  std::string("ends with a newline\n"),
                                  std::string("-n"),
                                  std::string("--"),
                                  std::string("*"),
                                  std::string("~"),
                                  std::string("~root/x"),
                                  std::string("{a,b}"),
                                  std::string("[a-z]?"),
                                  std::string("!!"),
                                  std::string("#no comment"),
                                  std::string("a;b&c|d>e<f"),
                                  std::string("back\\slash\\"),
                                  std::string("%s%n"),
                                  std::string("K\xc3\xb6ln"),
                                  std::string("\xff\xfe not UTF-8 \xc3"),
                                  every_byte()})
    EXPECT_EQ(echoed(GetParam(), word), "[" + word + "][end]") << "as " << shell_quoted(word);
}

INSTANTIATE_TEST_SUITE_P(Shells, ShellWords, testing::Values("/bin/sh", "/bin/bash"),
                         [](const auto& shell) { return std::filesystem::path(shell.param).filename().string(); });

TEST(ShellWords, AreQuotedOnlyWhereNeeded) {
  EXPECT_EQ(shell_quoted("results/quick-2.json"), "results/quick-2.json");
  EXPECT_EQ(shell_quoted("two words"), "'two words'");
}

}  // namespace
}  // namespace relign
