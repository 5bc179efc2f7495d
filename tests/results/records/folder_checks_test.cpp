#include "records/folder_checks.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/seeds.h"
#include "records/sample_records.h"
#include "results/records/made_manifest.h"

namespace relign::records {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class FolderCheck : public testing::Test {
 protected:
  FolderCheck() {
    manifest_ = {{"seed", 1U},
                 {"first_instance", 7U},
                 {"instances", 2U},
                 {"scenes", {{{"name", "toy"}, {"truth", true}, {"owns_stage", false}}}},
                 {"noise_levels", {{{"name", "calm"}}}},
                 {"algorithms", {{{"name", "walker"}, {"id", "toy-walker"}, {"protocol", "paper"}, {"steps", 2U}}}},
                 {"order", {"a0", "b1"}}};
    trial_ = sample_trial("a0");
    trial_.instance_seed = instance_seed(1, SeedDomain::benchmark, 7);
  }
  // "" without a finding.
  std::string finding(const std::vector<TrialRecord>& trials) {
    const Manifest manifest = made_manifest(manifest_);
    FolderChecks checks(manifest, {});
    for (const TrialRecord& trial : trials) checks.add(trial, numbers_of(trial));
    for (const TrialRecord& trial : trials)
      checks.add(sample_times(trial.trial, static_cast<unsigned>(std::max<std::size_t>(trial.steps.size(), 1)) - 1));
    const std::vector<std::string> found = findings_of(checks.result(made_by({}, manifest)));
    return found.empty() ? "" : found.front();
  }
  std::string finding() { return finding({trial_}); }

  Json manifest_;
  TrialRecord trial_;
};

TEST_F(FolderCheck, AcceptsASample) {
  EXPECT_EQ(finding(), "");
  EXPECT_EQ(finding({}), "") << "a shard or a sample lacks trials";
  TrialRecord other = trial_;
  other.trial = "b1";
  other.instance = 8;
  other.instance_seed = instance_seed(1, SeedDomain::benchmark, 8);
  EXPECT_EQ(finding({trial_, other}), "");
  EXPECT_EQ(finding({other, trial_}), "") << "as a run that has not ended writes them";
  other.trial = "of another plan";
  other.budget = 9;
  EXPECT_EQ(finding({trial_, other}), "");
}

TEST_F(FolderCheck, AcceptsHowTrialsEnd) {
  for (const char* end : {"failed", "crashed(SIGSEGV)", "timeout", "out_of_memory", "protocol_error"})
    for (std::size_t steps : {0U, 1U, 3U}) {
      TrialRecord ended = trial_;
      ended.end = end;
      ended.steps.resize(steps);
      EXPECT_EQ(finding({ended}), "") << end << " " << steps;
    }
  trial_.end = "overspent";
  EXPECT_EQ(finding(), "");
  trial_.end = "finished";
  trial_.steps.pop_back();
  EXPECT_EQ(finding(), "");
}

TEST_F(FolderCheck, AcceptsAStationWithoutScores) {
  manifest_["scenes"][0]["owns_stage"] = true;
  for (StepRecord& step : trial_.steps)
    step.commanded_mse = step.recommended_mse = step.recommended_seconds = std::nan("");
  EXPECT_EQ(finding(), "");
  trial_.steps[1].commanded_mse = 1e-4;
  EXPECT_THAT(finding(), HasSubstr("has 'commanded_mse' at step 1, but its scene has no ground truth"));
}

TEST_F(FolderCheck, AcceptsImagesOfRegions) {
  trial_.steps[1].measured = std::nan("");
  EXPECT_THAT(finding(), HasSubstr("lacks 'measured' at step 1"));
  trial_.steps[1].regions = {{0, 0, 8, 8}};
  EXPECT_EQ(finding(), "");
}

TEST_F(FolderCheck, SealedRecordsStateNoSeed) {
  manifest_["commitment"] = "sha256:1";
  EXPECT_THAT(finding(), HasSubstr("states the seed of its instance, although the suite is sealed"));
  trial_.instance_seed = 0;
  EXPECT_EQ(finding(), "");
}

TEST_F(FolderCheck, NamesTheTrial) {
  trial_.budget = 3;
  EXPECT_EQ(finding(), "trials: trial a0 (walker on toy calm #7) has a budget of 3 steps, the manifest 2");
}

TEST_F(FolderCheck, AllOrNoTrialsOfASceneHaveAnOptimum) {
  TrialRecord other = trial_;
  other.own_optimum.mse = 1e-5;
  other.trial = "b1";
  other.instance = 8;
  other.instance_seed = instance_seed(1, SeedDomain::benchmark, 8);
  EXPECT_THAT(finding({trial_, other}), HasSubstr("a0 (walker on toy calm #7) lacks 'own_optimum_mse'"));
}

TEST(Check, ListsTheFirstFindings) {
  Check check;
  check.name = "steps";
  for (std::size_t i = 0; i < Check::kMostFindings + 5; ++i) check.add(std::to_string(i));
  const std::vector<std::string> texts = findings_of({check});
  ASSERT_EQ(texts.size(), Check::kMostFindings + 1);
  EXPECT_EQ(texts.front(), "steps: 0");
  EXPECT_EQ(texts.back(), "steps: and 5 more");
}

}  // namespace
}  // namespace relign::records
