// The driver in place of libFuzzer: the same changes everywhere, and a planted mistake is found and kept.
#include "mutate.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <set>

#include "base/files.h"

namespace relign::fuzz {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> inputs(std::uint64_t seed, std::size_t count) {
  const std::vector<std::string> corpus = {R"({"steps": 50, "name": "one"})", R"([1, 2, 3])"};
  Mutator mutator(seed, corpus, words_of(corpus), 200);
  std::vector<std::string> made;
  for (std::size_t i = 0; i < count; ++i) made.push_back(mutator.next());
  return made;
}

TEST(Mutator, EqualSeedsGiveEqualInputs) {
  EXPECT_EQ(inputs(1, 500), inputs(1, 500));
  EXPECT_NE(inputs(1, 500), inputs(2, 500));
}

TEST(Mutator, InputsDifferAndAreBounded) {
  const std::vector<std::string> made = inputs(3, 2000);
  EXPECT_GT(std::set<std::string>(made.begin(), made.end()).size(), 1500u);
  std::size_t with_large_number = 0, with_escape = 0;
  for (const std::string& input : made) {
    EXPECT_LE(input.size(), 200u);
    with_large_number += input.find("18446744073709551615") != std::string::npos;
    with_escape += input.find('\x1b') != std::string::npos;
  }
  EXPECT_GT(with_large_number, 10u);
  EXPECT_GT(with_escape, 10u);
}

TEST(Driver, KeepsTheInputThatEndsTheProgram) {
  const fs::path folder = fs::temp_directory_path() / ("relign-fuzz-driver-" + std::to_string(::getpid()));
  write_file_atomically(folder / "corpus" / "a", "some text");
  const std::string begin =
      std::string(RELIGN_PLANTED) + " " + (folder / "corpus").string() + " --keep " + folder.string() + " --inputs ";
  EXPECT_EQ(std::system((begin + "0 >/dev/null 2>&1").c_str()), 0) << "the corpus alone is sound";
  EXPECT_NE(std::system((begin + "100000 >/dev/null 2>&1").c_str()), 0);
  EXPECT_NE(read_file(folder / "crash-fuzz_planted").find('<'), std::string::npos);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace relign::fuzz
