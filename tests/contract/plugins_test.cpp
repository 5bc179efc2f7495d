// The contract of every plugin of the tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "base/error.h"
#include "base/files.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"
#include "tree_catalog.h"

namespace relign::plugin_host {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;

std::vector<std::string> exported_symbols(const std::filesystem::path& library) {
  std::vector<std::string> symbols;
  FILE* pipe = ::popen(("nm -D --defined-only '" + library.string() + "'").c_str(), "r");
  if (!pipe) return symbols;
  std::array<char, 512> line{};
  while (std::fgets(line.data(), line.size(), pipe)) {
    std::string text = line.data();
    while (!text.empty() && text.back() == '\n') text.pop_back();
    symbols.push_back(text.substr(text.rfind(' ') + 1));
  }
  ::pclose(pipe);
  return symbols;
}

TEST(PluginContract, LoadsEveryPluginOfTheTree) {
  EXPECT_THAT(test::tree_catalog().refused(), IsEmpty());
  EXPECT_THAT(test::tree_catalog().ids(Kind::optimizer),
              IsSupersetOf({"compass", "home", "random", "nlopt", "nlopt-sbplx", "nlopt-bobyqa", "nlopt-cobyla",
                            "nlopt-neldermead"}));
  EXPECT_THAT(test::tree_catalog().ids(Kind::noise_level),
              IsSupersetOf({"rho", "rho0", "rho0.25", "rho0.5", "rho0-package", "rho0.25-package", "rho0.5-package"}));
}

TEST(PluginContract, EveryPluginExportsExactlyOneSymbol) {
  for (const auto& plugin : test::tree_catalog().plugins()) {
    SCOPED_TRACE(plugin->id);
    EXPECT_THAT(exported_symbols(plugin->library), ElementsAre(RELIGN_PLUGIN_ENTRY_SYMBOL));
  }
}

TEST(PluginContract, EveryEntryContainsTheManifestBesideIt) {
  for (const auto& plugin : test::tree_catalog().plugins()) {
    SCOPED_TRACE(plugin->id);
    const relign_plugin_description& entry = load_library(*plugin);
    EXPECT_EQ(plugin->text, entry.manifest_json);
    EXPECT_EQ(entry.abi_major, std::uint32_t{RELIGN_ABI_MAJOR});
    EXPECT_EQ(entry.abi_minor, std::uint32_t{RELIGN_ABI_MINOR});
    EXPECT_STRNE(entry.build_info, "");
    EXPECT_FALSE(plugin->license.empty() && plugin->id != "compass") << "the manifest must name a license";
  }
}

TEST(PluginContract, CreatesEveryPluginAndPreset) {
  Catalog& catalog = test::tree_catalog();
  for (const auto& plugin : catalog.plugins()) {
    std::vector<std::string> ids = {plugin->id};
    for (const Preset& preset : plugin->presets) ids.push_back(preset.id);
    for (const std::string& id : ids) {
      SCOPED_TRACE(id);
      std::vector<Problem> problems;
      const Choice choice = catalog.resolve(plugin->kind, id, {}, ".", problems);
      for (const Problem& problem : problems) {
        // A plugin without preset may need a file from the user; its presets must not.
        EXPECT_EQ(id, plugin->id) << problem.to_string();
        EXPECT_THAT(problem.message, testing::HasSubstr("missing parameter"));
      }
      if (!problems.empty()) continue;
      try {
        if (is_algorithm(plugin->kind))
          Algorithm made(choice, {});
        else if (plugin->kind == Kind::noise_level)
          NoiseLevel made(choice, {});
        else
          Scene made(choice, {});
      } catch (const Error& error) {
        ADD_FAILURE() << error.what();
      }
    }
  }
}

TEST(PluginContract, DocumentsEveryAlgorithmFolder) {
  for (const char* kind : {"optimizers", "agents"}) {
    const std::filesystem::path algorithms = std::filesystem::path(RELIGN_SOURCE_DIR) / "plugins" / kind;
    const std::string page = read_file(algorithms / "README.md");
    for (const auto& folder : std::filesystem::directory_iterator(algorithms)) {
      if (!folder.is_directory()) continue;
      EXPECT_THAT(page, testing::HasSubstr("](" + folder.path().filename().string() + ")"));
    }
  }
}

TEST(PluginContract, EveryFolderHasReadmeAndCMakeLists) {
  const std::filesystem::path tree = std::filesystem::path(RELIGN_SOURCE_DIR) / "plugins";
  int folders = 0;
  for (const char* kind : {"scenes", "noise_levels", "optimizers", "agents"}) {
    if (!std::filesystem::exists(tree / kind)) continue;
    for (const auto& folder : std::filesystem::directory_iterator(tree / kind)) {
      SCOPED_TRACE(folder.path().string());
      if (!folder.is_directory()) continue;
      ++folders;
      EXPECT_TRUE(std::filesystem::exists(folder.path() / "README.md"));
      EXPECT_TRUE(std::filesystem::exists(folder.path() / "relign-plugin.json"));
      EXPECT_TRUE(std::filesystem::exists(folder.path() / "CMakeLists.txt"));
    }
  }
  EXPECT_GE(folders, 4);
}

}  // namespace
}  // namespace relign::plugin_host
