#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "conformance/conduct.h"
#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign::hand_over {
namespace {

using plugin_host::Algorithm;
using plugin_host::Choice;
using plugin_host::Kind;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

plugin_host::Catalog& catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->scan(RELIGN_PLUGIN_DIR);  // includes the default algorithms
    return fresh;
  }();
  return *catalog;
}

Choice choice(const Json& parameters = {}) {
  return catalog().resolve_or_throw(Kind::optimizer, "hand-over", parameters);
}

// Behaviour of the stand-in for `first` or `then`.
struct Script {
  std::vector<Pose> visits;  // limited by its steps; then it finishes
  std::optional<Pose> recommendation;
  bool fails = false;
};

// A trial with three axes whose merit is the squared distance to (0.3, 0.3, 0.3), with scripted algorithms.
struct ScriptedTrial {
  ScriptedTrial() : trial(make_setup()) {
    service.struct_size = sizeof service;
    service.context = this;
    service.run = [](void* self, relign_text parameter, relign_text, std::uint32_t steps, relign_run_outcome* outcome) {
      return static_cast<ScriptedTrial*>(self)->play({parameter.data, std::size_t(parameter.size)}, steps, *outcome);
    };
  }

  void run(const Json& parameters) {
    Algorithm algorithm(choice(parameters), {});
    algorithm.run(trial.handle());
  }

  std::vector<Pose> visited() const {
    std::vector<Pose> poses;
    for (const auto& visit : trial.steps) poses.push_back(visit.pose);
    return poses;
  }

  std::map<std::string, Script> scripts;
  std::vector<std::string> calls;  // "first 10"
  FakeTrial trial;

 private:
  FakeSetup make_setup() {
    FakeSetup setup;
    setup.axes = 3;
    setup.budget = 10;
    setup.merit = [](const Pose& pose, std::uint32_t) {
      double sum = 0;
      for (const double value : pose) sum += (value - 0.3) * (value - 0.3);
      return sum;
    };
    setup.service = [this](std::string_view id) -> const void* {
      return id == RELIGN_SERVICE_RUN ? &service : nullptr;
    };
    setup.why = [] { return "the stand-in is broken"; };
    return setup;
  }

  relign_status play(const std::string& name, std::uint32_t most, relign_run_outcome& outcome) {
    calls.push_back(name + " " + std::to_string(most));
    const Script& script = scripts[name];
    if (script.fails) return RELIGN_FAILED;
    const relign_trial& handle = trial.handle();
    const std::size_t before = trial.steps.size();
    for (std::size_t i = 0; i < std::min<std::size_t>(most, script.visits.size()); ++i) {
      relign_observation observation{};
      observation.struct_size = sizeof observation;
      if (handle.step(handle.context, script.visits[i].data(), 3, &observation) != RELIGN_OK) break;
    }
    outcome.steps = std::uint32_t(trial.steps.size() - before);
    outcome.end = outcome.steps < most && !trial.stopped ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
    last_ = trial.last();
    best_ = last_;
    best_pose_ = trial.best_pose();
    best_.pose = best_pose_.data();
    outcome.last = &last_;
    outcome.best = &best_;
    outcome.recommendation = script.recommendation ? script.recommendation->data() : nullptr;
    return RELIGN_OK;
  }

  relign_run_service service{};
  relign_observation last_{}, best_{};
  Pose best_pose_;
};

const Pose kFar = {-0.4, 0, 0}, kNear = {0.3, 0.2, 0.3}, kMiddle = {0.1, 0.1, 0.1}, kAdvice = {0.25, 0.25, 0.25};

TEST(HandOver, StartsSecondAtConfiguredPose) {
  const struct {
    const char* from;
    std::optional<Pose> recommendation;
    std::vector<Pose> before_then;
    const char* then;
  } cases[] = {{"recommendation", kAdvice, {kFar, kNear, kMiddle, kAdvice}, "then 6"},
               {"recommendation", std::nullopt, {kFar, kNear, kMiddle, kNear}, "then 6"},
               {"best", kAdvice, {kFar, kNear, kMiddle, kNear}, "then 6"},
               {"last", kAdvice, {kFar, kNear, kMiddle}, "then 7"}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.from);
    ScriptedTrial trial;
    trial.scripts["first"] = {{kFar, kNear, kMiddle, kFar}, one.recommendation};
    trial.run({{"first_steps", 3}, {"from", one.from}});
    EXPECT_EQ(trial.visited(), one.before_then);
    EXPECT_EQ(trial.calls, (std::vector<std::string>{"first 3", one.then}));
  }
}

TEST(HandOver, SkipsMoveToCurrentPose) {
  ScriptedTrial trial;
  trial.scripts["first"] = {{kFar, kNear}, kNear};
  trial.run({{"first_steps", 2}});
  EXPECT_EQ(trial.visited(), (std::vector<Pose>{kFar, kNear}));
  EXPECT_EQ(trial.calls.back(), "then 8");
}

TEST(HandOver, GivesUnusedStepsToSecond) {
  ScriptedTrial trial;
  trial.scripts["first"] = {{kNear}, std::nullopt};
  trial.run({{"first_steps", 5}});
  EXPECT_EQ(trial.calls, (std::vector<std::string>{"first 5", "then 9"}));
}

TEST(HandOver, ForwardsRecommendationOfSecondOnly) {
  ScriptedTrial trial;
  trial.scripts["first"] = {{kFar, kNear}, kMiddle};
  trial.scripts["then"] = {{kFar, kFar}, kAdvice};
  trial.run({{"first_steps", 2}});
  ASSERT_EQ(trial.trial.recommendations.size(), 1u);
  EXPECT_EQ(trial.trial.recommendations[0].pose, kAdvice);
  EXPECT_EQ(trial.trial.recommendations[0].steps_made, 5u);
}

TEST(HandOver, ForwardsRecommendationOfFirstThatSpendsTheBudget) {
  for (const unsigned first_steps : {10u, 50u}) {
    ScriptedTrial trial;
    trial.scripts["first"] = {std::vector<Pose>(20, kFar), kAdvice};
    trial.run({{"first_steps", first_steps}});
    EXPECT_EQ(trial.calls, std::vector<std::string>{"first 10"});
    ASSERT_EQ(trial.trial.recommendations.size(), 1u);
    EXPECT_EQ(trial.trial.recommendations[0].pose, kAdvice);
    EXPECT_FALSE(trial.trial.stopped);
  }
}

TEST(HandOver, LastStepMayBeTheMoveBetween) {
  ScriptedTrial trial;
  trial.scripts["first"] = {std::vector<Pose>(9, kFar), kAdvice};
  trial.run({{"first_steps", 9}});
  EXPECT_EQ(trial.calls, std::vector<std::string>{"first 9"});
  EXPECT_EQ(trial.visited().back(), kAdvice);
  EXPECT_EQ(trial.trial.recommendations.size(), 1u);
}

TEST(HandOver, FailureOfEitherFailsTheTrial) {
  for (const char* broken : {"first", "then"}) {
    ScriptedTrial trial;
    trial.scripts["first"] = {{kNear}, std::nullopt};
    trial.scripts[broken].fails = true;
    try {
      trial.run({{"first_steps", 1}});
      FAIL() << "no exception";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("the stand-in is broken"));
    }
  }
}

TEST(HandOver, ClampsRecommendationToTheBox) {
  ScriptedTrial trial;
  trial.scripts["first"] = {{kNear}, Pose{0.7, 0, -0.9}};
  trial.run({{"first_steps", 1}});
  EXPECT_EQ(trial.visited().back(), (Pose{0.5, 0, -0.5}));
}

TEST(HandOver, PresetsResolve) {
  for (const auto& preset : choice().plugin->presets) {
    SCOPED_TRACE(preset.id);
    const Choice chosen = catalog().resolve_or_throw(Kind::optimizer, preset.id);
    EXPECT_EQ(chosen.algorithms.size(), 2u);
  }
}

TEST(HandOver, RejectsUnknownAlgorithmAndZeroSteps) {
  EXPECT_THROW(choice({{"first", "no-such-algorithm"}}), Error);
  EXPECT_THROW(choice({{"first_steps", 0}}), Error);
  EXPECT_THROW(choice({{"from", "elsewhere"}}), Error);
}

}  // namespace
}  // namespace relign::hand_over
