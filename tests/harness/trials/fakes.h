// Helpers for tests that use the fake plugins of this folder.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"
#include "trials/trial.h"

namespace relign::trials {

inline plugin_host::Choice fake(plugin_host::Kind kind, const std::string& folder, const Json& parameters = {}) {
  plugin_host::Catalog catalog;
  return catalog.resolve_or_throw(kind, (std::filesystem::path(RELIGN_TASK_TEST_PLUGINS) / folder).string(),
                                  parameters);
}

// One trial of a scripted algorithm (see fake_algorithm.cpp) on the fake scene. Tests may change every part before it
// runs and read it afterwards.
struct TrialFixture {
  explicit TrialFixture(const std::string& script_json, const std::string& algorithm_folder = "fake_optimizer",
                        const Json& scene_parameters = Json::object()) {
    services.log = [this](int, const std::string& message) { scene_log.push_back(message); };
    scene_choice = fake(plugin_host::Kind::scene, "fake_scene", scene_parameters);
    scene = std::make_unique<plugin_host::Scene>(scene_choice, services);
    level = std::make_unique<plugin_host::NoiseLevel>(fake(plugin_host::Kind::noise_level, "fake_level"), services);
    facts = read_scene_facts(scene->describe(), "fake-scene");
    instance.number = 3;
    instance.seed = 77;
    instance.perturbations = {{0.3, 0.58, 0.5}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, "{}"};
    algorithm = fake(plugin_host::Kind::optimizer, algorithm_folder, {{"script", Json::parse(script_json)}});
    algorithm_services.log = [this](int, const std::string& message) { algorithm_log.push_back(message); };
    terms.budget = 4;
    terms.algorithm_seed = 5;
    terms.machine_time = facts.machine_time;
  }
  TrialFixture(const TrialFixture&) = delete;
  TrialFixture& operator=(const TrialFixture&) = delete;

  TrialResult run() {
    plugin_host::MountedAssembly assembly = scene->mount(instance.perturbations.elements_json);
    ModelScene model(*scene, scene_choice, services);
    return run_trial({.stage = SimulatedLens{assembly, model, *level},
                      .reference = scene->reference(),
                      .scene = facts,
                      .instance = instance,
                      .algorithm = algorithm,
                      .terms = terms,
                      .purpose = pretraining ? Purpose(Pretraining{*pretraining}) : Scoring{},
                      .prepared = prepared,
                      .services = algorithm_services,
                      .callbacks = callbacks});
  }

  // The values logged under a word: the algorithm's observations ("seen"), answers ("answer") and task ("task").
  std::vector<Json> logged(const std::string& word) const {
    std::vector<Json> values;
    for (const std::string& line : algorithm_log)
      if (line.rfind(word + " ", 0) == 0) values.push_back(Json::parse(line.substr(word.size() + 1)));
    return values;
  }
  // All of them, by word; a line of another form fails the test.
  std::map<std::string, std::vector<Json>> logged() const {
    std::map<std::string, std::vector<Json>> values;
    for (const std::string& line : algorithm_log) {
      const std::string word = line.substr(0, line.find(' '));
      values[word].push_back(Json::parse(line.substr(std::min(word.size() + 1, line.size())), nullptr, false));
      EXPECT_FALSE(values[word].back().is_discarded()) << line;
    }
    return values;
  }
  // Seeds of the scene's captures ("capture") or noise-free scores ("truth"), in order.
  std::vector<std::uint64_t> seeds(const std::string& word) const { return scene_numbers(word); }
  // Addresses to which the scene wrote its captures.
  std::vector<std::uint64_t> buffers() const { return scene_numbers("buffer"); }
  std::vector<std::uint64_t> scene_numbers(const std::string& word) const {
    std::vector<std::uint64_t> values;
    for (const std::string& line : scene_log)
      if (line.rfind(word + " ", 0) == 0) values.push_back(std::stoull(line.substr(word.size() + 1)));
    return values;
  }

  plugin_host::HostServices services;
  std::vector<std::string> scene_log, algorithm_log;
  plugin_host::Choice scene_choice;
  std::unique_ptr<plugin_host::Scene> scene;
  std::unique_ptr<plugin_host::NoiseLevel> level;
  SceneFacts facts;
  Instance instance;
  plugin_host::Choice algorithm;
  Terms terms;
  PretrainingState* pretraining = nullptr;  // null: a benchmark trial
  PreparedByIdentity prepared;
  plugin_host::HostServices algorithm_services;
  Callbacks callbacks;
};

// A trial with every service that the host offers, for the algorithm in `folder`.
struct TrialWithServices : TrialFixture {
  TrialWithServices(const std::string& folder, const Json& parameters, const Json& scene_parameters)
      : TrialFixture("[]", "fake_optimizer", scene_parameters) {
    algorithm = fake(plugin_host::Kind::optimizer, folder, parameters);
  }
  // A value logged under a word; fails the test when it is missing.
  Json answer(const std::string& word, std::size_t which = 0) const {
    const auto values = logged(word);
    EXPECT_GT(values.size(), which) << word << " was not logged; refused: " << Json(logged("refused")).dump();
    return which < values.size() ? values[which] : Json();
  }
};

}  // namespace relign::trials
