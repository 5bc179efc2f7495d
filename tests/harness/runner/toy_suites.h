// Suites of toy plugins and a temporary folder, for tests of the runner.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/files.h"
#include "error_text.h"
#include "records/results_folder.h"
#include "runner/run.h"

namespace relign::runner {

namespace fs = std::filesystem;
using test::error_text;

class ToyTest : public testing::Test {
 protected:
  void SetUp() override {
    // In memory if possible: on a disk these tests mostly wait for flushes.
    const fs::path memory = "/dev/shm";
    const bool in_memory = ::access(memory.c_str(), W_OK) == 0;
    folder_ = (in_memory ? memory : fs::temp_directory_path()) / ("relign-runner-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Two levels, 6 instances, 5 steps; `algorithms` are JSON entries.
  static std::string suite_text(const std::string& algorithms, const std::string& more = "") {
    return R"({"scenes": ["toy-scene"], "noise_levels": ["toy-level", "toy-wild"], "instances": 6, "steps": 5,
               "algorithms": [)" +
           algorithms + "]" + more + "}";
  }
  // A scene that offers own optima and MTF, and a specification.
  static std::string mtf_suite(const std::string& spec, bool tells = true) {
    return R"({"scenes": [{"use": "toy-scene", "name": "sharp", "parameters": {"tells_optimum": true, "tells_mtf": )" +
           std::string(tells ? "true" : "false") +
           R"(}}], "noise_levels": ["toy-level"], "instances": 3, "steps": 4, "algorithms": ["toy-walker"], "spec": )" +
           spec + "}";
  }
  static constexpr const char* kWalkers =
      R"("toy-walker", "toy-stumbler", {"use": "toy-walker", "name": "short-walker", "steps": 3})";

  static plugin_host::Catalog toys(const std::string& walker = "toy_walker") {
    plugin_host::Catalog catalog;
    const fs::path plugins = RELIGN_RUNNER_TEST_PLUGINS;
    for (const std::string& plugin :
         {std::string("toy_scene"), std::string("toy_level"), walker, std::string("toy_stumbler"),
          std::string("toy_meddler"), std::string("toy_saboteur")})
      catalog.add(plugins / plugin);
    return catalog;
  }
  static PreparedPlan prepared(const std::string& suite, const std::string& walker = "toy_walker") {
    plugin_host::Catalog catalog = toys(walker);
    return prepare(suites::read_suite(JsonSource::from_text(suite, "toy.json"), ".", catalog), {});
  }

  RunOptions options(const std::string& name, unsigned workers = 1) {
    RunOptions options;
    options.results = folder_ / name;
    options.workers = workers;
    options.on_message = [this](const std::string& message) { messages_.push_back(message); };
    return options;
  }

  // Every file below a folder with its bytes; times differ from run to run, so that only their names are compared.
  std::map<std::string, std::string> contents(const std::string& name) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / name)) {
      if (!entry.is_regular_file()) continue;
      const std::string path = fs::relative(entry.path(), folder_ / name).string();
      files[path] = path.rfind("times/", 0) == 0 ? "" : read_file(entry.path());
    }
    if (const auto manifest = files.find("manifest.json"); manifest != files.end()) {
      Json facts = Json::parse(manifest->second);
      if (facts.contains("machine")) facts["machine"].erase("scene_memory_bytes");  // measured
      manifest->second = facts.dump(1);
    }
    return files;
  }

  fs::path folder_;
  std::vector<std::string> messages_;
};

}  // namespace relign::runner
