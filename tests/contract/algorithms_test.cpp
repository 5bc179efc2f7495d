// The contract of every optimizer and agent of the tree during a trial, with all kinds of merits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <tuple>

#include "base/error.h"
#include "conformance/conduct.h"
#include "tree_catalog.h"

namespace relign::conformance {
namespace {

using plugin_host::Choice;
using plugin_host::Kind;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Every algorithm and preset that needs no file from the user.
std::vector<Choice> algorithms() {
  std::vector<Choice> choices;
  for (const std::string& id : test::tree_catalog().ids(Kind::optimizer)) {
    std::vector<Problem> problems;
    Choice choice = test::tree_catalog().resolve(Kind::optimizer, id, {}, ".", problems);
    if (!choice.plugin) continue;
    // With its "check" parameters for synthetic trials.
    choices.push_back(test::tree_catalog().resolve(Kind::optimizer, id, choice.plugin->check, ".", problems));
  }
  return choices;
}

// Searches that fit a model to all observations take quadratic time per step or more, and agents process whole images:
// they get few steps.
bool is_slow(const Choice& choice) {
  const std::string& id = choice.plugin->id;
  return choice.plugin->kind == Kind::agent || id == "bo-gp" || id == "bo-forest" || id == "bo-turbo" ||
         id == "transfer-gp";
}
constexpr std::uint32_t kFewSteps = 20;  // a search with a model draws ten of them at random

// Agents that were trained for five axes refuse others.
bool takes(const Choice& choice, std::uint32_t axes) { return choice.plugin->check.empty() || axes == 5; }

void expect_sound(const FakeTrial& trial) {
  EXPECT_FALSE(trial.refused);
  EXPECT_EQ(trial.requests_after_stop, 0u);
  EXPECT_LE(trial.steps.size(), trial.setup.budget);
  if (!(trial.setup.observes & RELIGN_OBSERVES_BOX)) return;
  const auto& [lower, upper] = std::tie(trial.setup.lower, trial.setup.upper);
  for (const auto& visit : trial.steps)
    for (std::size_t axis = 0; axis < visit.pose.size(); ++axis) {
      EXPECT_GE(visit.pose[axis], lower[axis]);
      EXPECT_LE(visit.pose[axis], upper[axis]);
    }
}

TEST(AlgorithmContract, KeepsToBoxAndBudgetInAnyDimension) {
  for (const Choice& choice : algorithms())
    for (const std::uint32_t axes : {1u, 2u, 5u, 6u, 10u})
      for (const bool with_noise : {false, true}) {
        if (!takes(choice, axes)) continue;
        SCOPED_TRACE(choice.id + ", " + std::to_string(axes) + " axes" + (with_noise ? ", noisy" : ""));
        FakeSetup setup = setup_for(choice, axes);
        setup.budget = is_slow(choice) ? kFewSteps : 300;
        if (with_noise) setup.merit = noisy(setup.merit);
        FakeTrial trial(setup);
        run_trial(choice, trial);
        expect_sound(trial);
        EXPECT_GE(trial.steps.size(), 1u);
      }
}

TEST(AlgorithmContract, RepeatsStepsForTheSameSeed) {
  for (const Choice& choice : algorithms()) {
    SCOPED_TRACE(choice.id);
    FakeSetup setup = setup_for(choice, 5);
    setup.merit = noisy(setup.merit);
    setup.seed = 77;
    if (is_slow(choice)) setup.budget = kFewSteps;
    FakeTrial one(setup);
    FakeTrial two(setup);
    run_trial(choice, one);
    run_trial(choice, two);
    ASSERT_EQ(one.steps.size(), two.steps.size());
    for (std::size_t step = 0; step < one.steps.size(); ++step) EXPECT_EQ(one.steps[step].pose, two.steps[step].pose);
    ASSERT_EQ(one.recommendations.size(), two.recommendations.size());
    for (std::size_t i = 0; i < one.recommendations.size(); ++i)
      EXPECT_EQ(one.recommendations[i].pose, two.recommendations[i].pose);
  }
}

TEST(AlgorithmContract, ReturnsWhenStoppedAtAnyRequest) {
  for (const Choice& choice : algorithms())
    for (std::uint32_t budget = 0; budget <= 40; ++budget) {
      if (is_slow(choice) && budget > kFewSteps) break;
      SCOPED_TRACE(choice.id + ", budget " + std::to_string(budget));
      FakeSetup setup = setup_for(choice, 5);
      setup.budget = budget;
      FakeTrial trial(setup);
      run_trial(choice, trial);
      expect_sound(trial);
    }
}

TEST(AlgorithmContract, SurvivesUninformativeMerits) {
  const std::vector<std::pair<const char*, std::function<double(const Pose&, std::uint32_t)>>> merits = {
      {"constant", [](const Pose&, std::uint32_t) { return 0.03; }},
      {"zero", [](const Pose&, std::uint32_t) { return 0.0; }},
      {"NaN", [](const Pose&, std::uint32_t) { return kNaN; }},
      {"infinite", [](const Pose&, std::uint32_t) { return kInfinity; }},
      {"minus infinite", [](const Pose&, std::uint32_t) { return -kInfinity; }},
      {"huge", [](const Pose&, std::uint32_t step) { return step % 2 ? 1e300 : -1e300; }},
      {"NaN after step 0", [](const Pose&, std::uint32_t step) { return step == 0 ? 0.03 : kNaN; }},
      {"NaN now and then",
       [](const Pose& pose, std::uint32_t step) { return step % 3 == 1 ? kNaN : pose[0] * pose[0]; }},
  };
  for (const Choice& choice : algorithms())
    for (const auto& [name, merit] : merits)
      for (const std::uint32_t axes : {1u, 5u}) {
        if (!takes(choice, axes)) continue;
        SCOPED_TRACE(choice.id + ", " + name + ", " + std::to_string(axes) + " axes");
        FakeSetup setup = setup_for(choice, axes);
        setup.merit = merit;
        setup.budget = is_slow(choice) ? kFewSteps : 2000;
        FakeTrial trial(setup);
        run_trial(choice, trial);
        expect_sound(trial);
      }
}

// A recommended pose need not have been measured (it may be a model's optimum or a generation's mean), but it must be
// in the box.
TEST(AlgorithmContract, RecommendsPosesInTheBox) {
  for (const Choice& choice : algorithms()) {
    SCOPED_TRACE(choice.id);
    if (choice.plugin->kind != Kind::optimizer) continue;
    FakeSetup setup = setup_for(choice, 5);
    if (is_slow(choice)) setup.budget = kFewSteps;
    FakeTrial trial(setup);
    run_trial(choice, trial);
    const auto& [lower, upper] = std::tie(trial.setup.lower, trial.setup.upper);
    for (const auto& recommendation : trial.recommendations)
      for (std::size_t axis = 0; axis < recommendation.pose.size(); ++axis) {
        EXPECT_GE(recommendation.pose[axis], lower[axis]);
        EXPECT_LE(recommendation.pose[axis], upper[axis]);
      }
  }
}

TEST(AlgorithmContract, RunsConcurrentTrialsIndependently) {
  // Concurrent trials must not affect each other: runs the same trial alone, and together with three others.
  for (const Choice& choice : algorithms()) {
    SCOPED_TRACE(choice.id);
    FakeSetup setup = setup_for(choice, 5);
    setup.merit = noisy(setup.merit);
    if (is_slow(choice)) setup.budget = kFewSteps;
    FakeTrial alone(setup);
    run_trial(choice, alone);
    std::vector<std::unique_ptr<FakeTrial>> together;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) together.push_back(std::make_unique<FakeTrial>(setup));
    for (auto& trial : together) threads.emplace_back([&choice, &trial] { run_trial(choice, *trial); });
    for (std::thread& thread : threads) thread.join();
    for (const auto& trial : together) {
      ASSERT_EQ(trial->steps.size(), alone.steps.size());
      for (std::size_t step = 0; step < alone.steps.size(); ++step)
        EXPECT_EQ(trial->steps[step].pose, alone.steps[step].pose);
    }
  }
}

TEST(AlgorithmContract, CompassFindsTheMinimumAndReturns) {
  std::vector<Problem> problems;
  const Choice choice = test::tree_catalog().resolve(Kind::optimizer, "compass", {}, ".", problems);
  ASSERT_TRUE(choice.plugin);
  FakeSetup setup = setup_for(choice, 5);
  setup.budget = 2000;
  FakeTrial trial(setup);
  run_trial(choice, trial);
  EXPECT_FALSE(trial.stopped);
  ASSERT_FALSE(trial.recommendations.empty());
  EXPECT_LT(setup.merit(trial.recommendations.back().pose, 0), 0.01 + 1e-6);
}

}  // namespace
}  // namespace relign::conformance
