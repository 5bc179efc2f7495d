#include "records/instance_checks.h"

#include <gmock/gmock.h>

#include "records/sample_records.h"

namespace relign::records {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TrialRecord of_method(const std::string& name) {
  TrialRecord trial = sample_trial(name + "0");
  trial.algorithm = name;
  trial.own_optimum = {1e-5, {0.5, 0.25}, {}};
  return trial;
}

class InstanceCheck : public testing::Test {
 protected:
  std::string add(const TrialRecord& trial) { return checks_.add(trial, numbers_of(trial)); }
  InstanceChecks checks_{false, false};
};

TEST_F(InstanceCheck, StartsAreEqualUnderOneProtocol) {
  EXPECT_EQ(add(of_method("a")), "");
  TrialRecord other = of_method("b");
  other.steps[0].measured *= 1 + 1e-9;
  EXPECT_EQ(add(other), "") << "the digits of another processor";
  other.steps[0].measured = 0.05;
  EXPECT_EQ(add(other), "starts with another 'measured' than a on toy calm #7, although it is the same start");
  other.protocol = "blind";
  EXPECT_EQ(add(other), "") << "of other coordinates";
  other = of_method("c");
  other.steps[0].true_pose[1] += 1e-3;
  EXPECT_THAT(add(other), HasSubstr("starts with another 'true_pose' than"));
  other = of_method("d");
  other.instance = 8;
  other.steps[0].measured = 0.05;
  EXPECT_EQ(add(other), "");
}

TEST_F(InstanceCheck, OptimaAreEqualUnderAnyProtocol) {
  EXPECT_EQ(add(of_method("a")), "");
  TrialRecord other = of_method("b");
  other.protocol = "blind";
  EXPECT_EQ(add(other), "");
  other.own_optimum.pose[1] = 0.26;
  EXPECT_EQ(add(other), "has another 'own_optimum_pose' than a on toy calm #7, although it is the same lens");
  other.own_optimum.mse = 0.97e-5;
  other.own_optimum.pose[1] = 0.25;
  EXPECT_THAT(add(other), HasSubstr("has another 'own_optimum_mse' than"));

  InstanceChecks several_processors(true, false);
  const TrialRecord first = of_method("a");
  several_processors.add(first, numbers_of(first));
  other.own_optimum = {1e-5, {0.5, 0.26}, {}};
  EXPECT_EQ(several_processors.add(other, numbers_of(other)), "") << "where a search may end elsewhere";
}

TEST_F(InstanceCheck, StandardErrorsAreAlike) {
  for (const char* name : {"a", "b", "c"}) add(of_method(name));
  TrialRecord other = of_method("d");
  other.steps[2].recommended_mse_error = 2e-6;
  add(other);
  EXPECT_THAT(checks_.findings(), IsEmpty());
  other = of_method("e");
  other.steps[2].recommended_mse_error = 1;
  add(other);
  EXPECT_THAT(checks_.findings(), ElementsAre(HasSubstr("e on toy calm #7 has the standard error 1 of an MSE")));
}

TEST_F(InstanceCheck, ScoresAreThoseOfTheScene) {
  for (const char* name : {"a", "b", "c"}) add(of_method(name));
  EXPECT_THAT(checks_.findings(), IsEmpty());
  TrialRecord other = of_method("d");
  other.scores.by_step[Rule::best] = {{1e-4, 1e-4, 1e-4}, {1e-7, 1e-7, 1e-7}};
  other.scores.mtf[Rule::own][Curing::after].centre = 0.9;
  add(other);
  EXPECT_THAT(checks_.findings(),
              ElementsAre(HasSubstr("has 'best_mse', which 3 other trials on this scene and noise level lack"),
                          HasSubstr("has 'best_mse_error'"),
                          HasSubstr("has 'mtf_centre', which most methods on this scene and noise level lack")));
  InstanceChecks several_terms(false, true);
  for (const TrialRecord& trial : {of_method("a"), other}) several_terms.add(trial, numbers_of(trial));
  EXPECT_THAT(several_terms.findings(), IsEmpty());
}

}  // namespace
}  // namespace relign::records
