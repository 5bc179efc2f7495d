// Exported symbols, read from the file without loading it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <relign/plugin.h>
#include <unistd.h>

#include "base/error.h"
#include "base/files.h"
#include "conformance/elf_symbols.h"

namespace relign::conformance {
namespace {

using testing::Contains;
using testing::ElementsAre;

const std::filesystem::path kSaboteurs = RELIGN_SABOTEURS;

TEST(ExportedSymbols, PluginExportsOnlyItsEntry) {
  EXPECT_THAT(exported_symbols(kSaboteurs / "sound/sound.so"), ElementsAre(RELIGN_PLUGIN_ENTRY_SYMBOL));
}

TEST(ExportedSymbols, ListsAllSymbolsWithoutAVersionScript) {
  const auto symbols = exported_symbols(kSaboteurs / "two_symbols/two_symbols.so");
  EXPECT_THAT(symbols, Contains(RELIGN_PLUGIN_ENTRY_SYMBOL));
  EXPECT_THAT(symbols, Contains("helper_of_two_symbols"));
  EXPECT_THAT(symbols, testing::Not(Contains("malloc")));  // used, not defined
}

TEST(ExportedSymbols, RejectsTruncatedAndOtherFiles) {
  const std::string whole = read_file(kSaboteurs / "sound/sound.so");
  const auto copy = std::filesystem::temp_directory_path() / ("relign-symbols-" + std::to_string(::getpid()) + ".so");
  for (const std::size_t size : {std::size_t{0}, std::size_t{40}, std::size_t{4000}, whole.size() / 2}) {
    write_file_atomically(copy, whole.substr(0, size));
    EXPECT_THROW(exported_symbols(copy), Error) << size;
  }
  std::string twisted = whole;
  for (std::size_t i = whole.size() - 2000; i < whole.size(); ++i) twisted[i] = '\xff';  // the section table
  write_file_atomically(copy, twisted);
  EXPECT_THROW(exported_symbols(copy), Error);
  EXPECT_THROW(exported_symbols(RELIGN_SOURCE_DIR "/README.md"), Error);
  std::filesystem::remove(copy);
}

}  // namespace
}  // namespace relign::conformance
