// Tests of the global methods and of properties of all methods.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "nlopt_test.h"

namespace relign::nlopt_global {
namespace {

using test::bowl_setup;
using test::FakeSetup;
using test::FakeTrial;
using test::nlopt_local_presets;
using test::nlopt_presets;
using test::Pose;
using test::run_nlopt;

const std::vector<std::string> random_presets = {"nlopt-crs2", "nlopt-isres"};

TEST(Nlopt, GlobalMethodsSpendBudgetOnConstantAndNonFiniteMerits) {
  for (const std::string& id : nlopt_presets()) {
    if (std::count(nlopt_local_presets.begin(), nlopt_local_presets.end(), id)) continue;
    for (const std::uint32_t axes : {1u, 2u, 5u, 10u})
      for (const double merit : {0.03, double(NAN), double(INFINITY)}) {
        SCOPED_TRACE(id + ", " + std::to_string(axes) + " axes, merit " + std::to_string(merit));
        FakeSetup setup = bowl_setup(axes);
        setup.merit = [merit](const Pose&, std::uint32_t) { return merit; };
        setup.budget = 500;
        FakeTrial trial(setup);
        run_nlopt(id, trial);
        EXPECT_EQ(trial.steps.size(), 500u);
        EXPECT_TRUE(trial.recommendations.empty());
      }
  }
}

// The two bounded functions of NLopt's own tests, to within 2e-2 of their minima.
TEST(Nlopt, EveryMethodSolvesNloptTestFunctions) {
  struct Function {
    const char* name;
    std::function<double(double, double)> value;
    double lower[2];
    double upper[2];
    Pose start;
    double lowest;
  };
  const Function functions[] = {
      {"Rosenbrock",
       [](double x, double y) { return 100 * (y - x * x) * (y - x * x) + (1 - x) * (1 - x); },
       {-2, -2},
       {2, 2},
       {-1.2, 1},
       0},
      {"McCormick",
       [](double x, double y) { return std::sin(x + y) + (x - y) * (x - y) - 1.5 * x + 2.5 * y + 1; },
       {-1.5, -3},
       {4, 4},
       {0, 0},
       -1.9132229549810367}};
  for (const std::string& id : nlopt_presets())
    for (const Function& function : functions) {
      SCOPED_TRACE(id + ", " + function.name);
      FakeSetup setup;
      setup.axes = 2;
      setup.budget = 3000;
      // Poses are shares of the box, -0.5 to 0.5.
      const auto value_at = [&function](const Pose& pose) {
        const double x = (pose[0] + 0.5) * (function.upper[0] - function.lower[0]) + function.lower[0];
        const double y = (pose[1] + 0.5) * (function.upper[1] - function.lower[1]) + function.lower[1];
        return function.value(x, y);
      };
      setup.merit = [value_at](const Pose& pose, std::uint32_t) { return value_at(pose); };
      for (std::size_t axis = 0; axis < 2; ++axis)
        setup.start.push_back(
            (function.start[axis] - function.lower[axis]) / (function.upper[axis] - function.lower[axis]) - 0.5);
      FakeTrial trial(setup);
      run_nlopt(id, trial, {{"tolerance", 0.00001}});
      EXPECT_NEAR(value_at(trial.best_pose()), function.lowest, 0.02);
      EXPECT_GE(value_at(trial.best_pose()), function.lowest - 1e-9);
    }
}

std::vector<Pose> steps_of(
    const std::string& id, std::uint64_t seed, const std::function<void()>& between = [] {}) {
  FakeSetup setup = bowl_setup(3);
  setup.seed = seed;
  setup.budget = 300;
  const auto bowl = setup.merit;
  setup.merit = [bowl, between](const Pose& pose, std::uint32_t step) {
    between();
    return bowl(pose, step);
  };
  FakeTrial trial(setup);
  run_nlopt(id, trial, {{"population", 20}});
  std::vector<Pose> poses;
  for (const auto& visit : trial.steps) poses.push_back(visit.pose);
  return poses;
}

// Makes two threads alternate, capture by capture.
class Turns {
 public:
  void take(int who) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return turn_ == who || gone_[1 - who]; });
    exchanges_ += last_ != who;
    last_ = who;
    turn_ = 1 - who;
    changed_.notify_all();
  }
  void leave(int who) {
    const std::lock_guard lock(mutex_);
    gone_[who] = true;
    changed_.notify_all();
  }
  int exchanges() const { return exchanges_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int turn_ = 0;
  int last_ = 1;
  int exchanges_ = 0;
  bool gone_[2] = {};
};

TEST(Nlopt, ConcurrentTrialsHaveIndependentRandomNumbers) {
  for (const std::string& id : random_presets) {
    SCOPED_TRACE(id);
    const std::vector<Pose> alone[] = {steps_of(id, 1), steps_of(id, 2)};
    EXPECT_NE(alone[0], alone[1]);
    EXPECT_EQ(steps_of(id, 1), alone[0]);  // independent of earlier draws in the thread
    Turns turns;
    std::vector<Pose> beside[2];
    std::vector<std::thread> threads;
    for (int who = 0; who < 2; ++who)
      threads.emplace_back([&, who] {
        beside[who] = steps_of(id, static_cast<std::uint64_t>(who) + 1, [&turns, who] { turns.take(who); });
        turns.leave(who);
      });
    for (std::thread& thread : threads) thread.join();
    EXPECT_GT(turns.exchanges(), 500);
    for (int who = 0; who < 2; ++who) EXPECT_EQ(beside[who], alone[who]);
  }
}

TEST(Nlopt, AcceptsNarrowBox) {
  for (const std::string& id : nlopt_presets()) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(3);
    setup.lower = {-0.5, 0.1, -0.001};
    setup.upper = {0.5, 0.1, 0.001};
    FakeTrial trial(setup);
    run_nlopt(id, trial);
    EXPECT_FALSE(trial.steps.empty());
    for (const auto& visit : trial.steps)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_GE(visit.pose[axis], setup.lower[axis]);
        EXPECT_LE(visit.pose[axis], setup.upper[axis]);
      }
  }
}

TEST(Nlopt, RejectsTooSmallPopulation) {
  FakeTrial trial(bowl_setup(5));
  try {
    run_nlopt("nlopt-crs2", trial, {{"population", 5}});
    FAIL() << "no exception";
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("at least 6"));
  }
}

}  // namespace
}  // namespace relign::nlopt_global
