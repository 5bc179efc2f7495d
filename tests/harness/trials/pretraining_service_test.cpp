// "relign.prepared/1" within one trial: what is loaded, who may save, and what an inner algorithm gets.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>

#include "trials/fakes.h"
#include "trials/pretraining.h"

namespace relign::trials {
namespace {

using testing::HasSubstr;

struct LearnerTrial : TrialWithServices {
  explicit LearnerTrial(const std::string& script, const std::string& folder = "service_user_learner",
                        const Json& then = "../fake_optimizer")
      : TrialWithServices(folder, {{"script", Json::parse(script)}, {"then", absolute(then)}}, Json::object()) {}
  // Given parameters are not relative to the plugin's folder.
  static Json absolute(Json then) {
    const std::string plugins = RELIGN_TASK_TEST_PLUGINS;
    Json& path = then.is_object() ? then.at("use") : then;
    path = plugins + path.get<std::string>().substr(2);
    return then;
  }
  void give(const plugin_host::Choice& to, const std::string& bytes) {
    prepared[to.identity].bytes = std::make_shared<const std::string>(bytes);
  }
};

// The same algorithm as a library and as a process.
class PretrainingService : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::string(GetParam()).find("python") != std::string::npos &&
        std::system("python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))' >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "python3 (3.9 or later) is not installed";
  }
};

INSTANTIATE_TEST_SUITE_P(Learners, PretrainingService,
                         testing::Values("service_user_learner", "service_user_python/service_user_learner.py"),
                         [](const auto& learner) { return learner.index == 0 ? "Library" : "Process"; });

TEST_P(PretrainingService, TrialLoadsButDoesNotSave) {
  const std::string bytes("a\0b", 3);
  LearnerTrial trial(R"([["load"], ["save", "mine"], ["load"]])", GetParam());
  trial.give(trial.algorithm, bytes);
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::finished) << result.message;
  EXPECT_EQ(trial.answer("load"), Json({false, bytes}));
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("cannot save in a benchmark trial"));
  EXPECT_EQ(trial.answer("load", 1), Json({false, bytes}));
}

TEST_P(PretrainingService, ReportsFailureButNotMissingData) {
  LearnerTrial nothing(R"([["load"]])", GetParam());
  nothing.run();
  EXPECT_EQ(nothing.answer("load"), Json({false, nullptr}));
  LearnerTrial empty(R"([["load"]])", GetParam());
  empty.give(empty.algorithm, "");
  empty.run();
  EXPECT_EQ(empty.answer("load"), Json({false, ""}));
  LearnerTrial failed(R"([["load"]])", GetParam());
  failed.prepared[failed.algorithm.identity].failure = "source 3 failed";
  failed.run();
  EXPECT_THAT(failed.answer("refused").get<std::string>(), HasSubstr("source 3 failed"));
}

TEST_P(PretrainingService, RequiresDeclarationInTheManifest) {
  const bool library = std::string(GetParam()) == "service_user_learner";
  LearnerTrial trial(R"([["load"], ["save", "x"]])", library ? "service_user" : "service_user_python/service_user.py");
  trial.give(trial.algorithm, "not for it");
  trial.run();
  EXPECT_EQ(trial.answer("load"), Json({false, nullptr}));
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("this host pretrains nothing"));
}

TEST_P(PretrainingService, PretrainingLoadsSavedDataAndNeedsNoGroundTruth) {
  LearnerTrial trial(R"([["load"], ["save", "one"], ["load"], ["step", [0.5, 0.5, 0.5]], ["save", "two"]])",
                     GetParam());
  trial.give(trial.algorithm, "of trials");
  PretrainingState state;
  state.sources = 2;
  trial.pretraining = &state;
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  EXPECT_EQ(trial.answer("load"), Json({true, nullptr}));
  EXPECT_EQ(trial.answer("load", 1), Json({true, "one"}));
  ASSERT_TRUE(state.bytes);
  EXPECT_EQ(*state.bytes, "two");
  EXPECT_TRUE(std::isnan(result.steps.back().commanded_mse));
  EXPECT_TRUE(trial.seeds("truth").empty()) << "ground truth is costly and not needed here";
}

TEST_P(PretrainingService, InnerAlgorithmLoadsItsOwnDataAndNeverSaves) {
  const std::string inner =
      R"({"use": "../service_user_learner", "parameters": {"script": [["load"], ["save", "x"]]}})";
  LearnerTrial trial(R"([["run", "then", 1], ["load"]])", GetParam(), Json::parse(inner));
  ASSERT_EQ(trial.algorithm.algorithms.size(), 1U);
  trial.give(*trial.algorithm.algorithms.at("then"), "inner");
  PretrainingState state;
  state.sources = 1;
  trial.pretraining = &state;
  trial.run();
  EXPECT_EQ(trial.answer("load"), Json({false, "inner"})) << "the inner algorithm is not pretrained here";
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("cannot save in a benchmark trial"));
  EXPECT_EQ(trial.answer("load", 1), Json({true, nullptr}));
  EXPECT_FALSE(state.bytes);
}

}  // namespace
}  // namespace relign::trials
