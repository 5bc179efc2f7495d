#include "runner/provenance.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files.h"

namespace relign::runner {
namespace {

plugin_host::Choice choice_that_promises(const std::string& where) {
  auto plugin = std::make_shared<plugin_host::Manifest>();
  plugin->reproducible = where;
  plugin_host::Choice choice;
  choice.plugin = plugin;
  return choice;
}

TEST(Provenance, AlgorithmIsAsReproducibleAsTheOnesItRuns) {
  const auto anywhere = choice_that_promises("anywhere"), this_cpu = choice_that_promises("this_cpu");
  EXPECT_EQ(reproducible_of(anywhere), "anywhere");
  EXPECT_EQ(reproducible_of(this_cpu), "this_cpu");

  plugin_host::Choice hand_over = anywhere;
  hand_over.algorithms["first"] = std::make_shared<plugin_host::Choice>(anywhere);
  EXPECT_EQ(reproducible_of(hand_over), "anywhere");
  hand_over.algorithms["then"] = std::make_shared<plugin_host::Choice>(this_cpu);
  EXPECT_EQ(reproducible_of(hand_over), "this_cpu");

  plugin_host::Choice outer = anywhere;
  outer.algorithms["first"] = std::make_shared<plugin_host::Choice>(hand_over);
  EXPECT_EQ(reproducible_of(outer), "this_cpu") << "at any depth";
}

TEST(Provenance, SideFileOverridesReproducibilityOfTheManifest) {
  const auto folder = std::filesystem::temp_directory_path() / ("relign-provenance-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  plugin_host::Choice choice = choice_that_promises("anywhere");
  auto plugin = std::make_shared<plugin_host::Manifest>(*choice.plugin);
  plugin->text = R"({"training": "model"})";
  plugin_host::Parameter model;
  model.name = "model";
  model.type = plugin_host::ParameterType::file;
  plugin->parameters.push_back(model);
  choice.plugin = plugin;
  choice.parameters = {{"model", (folder / "net.onnx").string()}};
  EXPECT_EQ(reproducible_of(choice), "anywhere") << "no side file";
  write_file_atomically(folder / "net.json", R"({"reproducible": "anywhere"})");
  EXPECT_EQ(reproducible_of(choice), "anywhere");
  write_file_atomically(folder / "net.json", R"({"reproducible": "this_cpu"})");
  EXPECT_EQ(reproducible_of(choice), "this_cpu");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace relign::runner
