#include "records/manifest_check.h"

#include <gmock/gmock.h>

#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"

namespace relign::records {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kSecret(64, 'a'), kOther(64, 'b');

Json made_manifest(Json suite) {
  return {{"suite", suite.dump()},
          {"seed", 7U},
          {"instances", 2U},
          {"first_instance", 0U},
          {"scenes", {{{"name", "s"}}}},
          {"noise_levels", {{{"name", "a"}}, {{"name", "b"}}}},
          {"trials", 4U},
          {"order", {"t0", "t1", "t2", "t3"}}};
}

Json open_suite() {
  return {{"seed", 7U}, {"instances", 2U}, {"first_instance", 0U}, {"scenes", {"s"}}, {"noise_levels", {"a", "b"}}};
}

Json sealed_suite() {
  Json suite = open_suite();
  suite["commitment"] = commitment_to(kSecret);
  return suite;
}

std::string message_on(const Json& manifest) {
  try {
    require_consistent(manifest, "results");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(ManifestCheck, AcceptsAnOpenAndASealedSuite) {
  EXPECT_EQ(message_on(made_manifest(open_suite())), "");
  Json sealed = made_manifest(sealed_suite());
  sealed["commitment"] = commitment_to(kSecret);
  EXPECT_EQ(message_on(sealed), "");
  sealed["secret"] = kSecret;
  EXPECT_EQ(message_on(sealed), "");
  EXPECT_EQ(message_on(Json::object()), "");
}

TEST(ManifestCheck, RefusesAnOpenSuiteThatClaimsToBeSealed) {
  Json forged = made_manifest(open_suite());
  forged["commitment"] = commitment_to(kSecret);
  EXPECT_THAT(message_on(forged), AllOf(HasSubstr("results/manifest.json"), HasSubstr("the suite is open")));
  forged["secret"] = kSecret;
  EXPECT_THAT(message_on(forged), HasSubstr("the suite is open"));
  forged.erase("suite");
  EXPECT_THAT(message_on(forged), HasSubstr("the suite is open")) << "removed";
  forged["suite"] = "{";
  EXPECT_THAT(message_on(forged), HasSubstr("the text of the suite is not a JSON object"));
}

TEST(ManifestCheck, RefusesAnotherCommitmentOrSecret) {
  Json forged = made_manifest(sealed_suite());
  EXPECT_THAT(message_on(forged), HasSubstr("the suite has the commitment")) << "removed";
  forged["commitment"] = commitment_to(kOther);
  forged["secret"] = kOther;
  EXPECT_THAT(message_on(forged), HasSubstr("but 'commitment' is '" + commitment_to(kOther)));
  forged["commitment"] = commitment_to(kSecret);
  EXPECT_THAT(message_on(forged), HasSubstr("'secret' has the commitment '" + commitment_to(kOther)));
}

TEST(ManifestCheck, ChecksEverySuiteOfAMergedFolder) {
  Json forged = made_manifest(sealed_suite());
  forged["commitment"] = commitment_to(kSecret);
  forged["suites"] = {{{"text", sealed_suite().dump()}}, {{"text", open_suite().dump()}}};
  EXPECT_THAT(message_on(forged), HasSubstr("the suite is open"));
}

TEST(ManifestCheck, RefusesOtherNumbersThanTheSuite) {
  for (const auto& [key, value, message] :
       {std::tuple("instances", 1U, "'instances' is 2 in the suite and 1 in the manifest"),
        std::tuple("first_instance", 1U, "'first_instance' is 0 in the suite and 1"),
        std::tuple("seed", 8U, "'seed' is 7 in the suite and 8")}) {
    Json forged = made_manifest(open_suite());
    forged[key] = value;
    EXPECT_THAT(message_on(forged), HasSubstr(message));
  }
  Json forged = made_manifest(open_suite());
  forged["spec"] = {{"rmse", 0.5}};
  EXPECT_THAT(message_on(forged), HasSubstr("'spec' is null in the suite and {\"rmse\":0.5} in the manifest"));
  forged = made_manifest(open_suite());
  forged["noise_levels"].erase(0);
  EXPECT_THAT(message_on(forged), HasSubstr("the suite has 2 'noise_levels', the manifest 1"));
}

TEST(ManifestCheck, RefusesFewerMethodsThanTheSuite) {
  Json suite = open_suite();
  suite["algorithms"] = {"a", "b"};
  Json manifest = made_manifest(suite);
  manifest["algorithms"] = {{{"name", "a"}}, {{"name", "b"}}, {{"name", "home"}, {"added", true}}};
  EXPECT_EQ(message_on(manifest), "");
  manifest["algorithms"].erase(1);
  EXPECT_THAT(message_on(manifest), HasSubstr("the suite has 2 'algorithms', the manifest 1"));
}

TEST(ManifestCheck, RefusesAnAnalysisPlanThatWasInsertedChangedOrRemoved) {
  const Json plan = {{"primary", "rmse"}, {"rule", "own"}, {"smallest_relevant_ratio", 1.1}};
  Json planned = open_suite();
  planned["analysis"] = {{"primary", "rmse"}};
  Json manifest = made_manifest(planned);
  EXPECT_THAT(message_on(manifest), HasSubstr("the suite has an analysis plan, the manifest has none"));
  manifest["analysis"] = plan;
  EXPECT_THAT(message_on(manifest), HasSubstr("'analysis_hash' is not the SHA-256 of the analysis plan"));
  manifest["analysis_hash"] = sha256_hex(canonical_json(plan));
  EXPECT_EQ(message_on(manifest), "");
  planned["analysis"]["primary"] = "yield";
  manifest["suite"] = planned.dump();
  EXPECT_THAT(message_on(manifest), HasSubstr("'primary' of the analysis plan is \"yield\" in the suite and"));
  manifest["suite"] = open_suite().dump();
  EXPECT_THAT(message_on(manifest), HasSubstr("the manifest has an analysis plan, the suite has none"));
}

TEST(ManifestCheck, RefusesAShortenedOrRepeatedOrder) {
  Json forged = made_manifest(open_suite());
  forged["order"].erase(0);
  EXPECT_THAT(message_on(forged), HasSubstr("'trials' is 4, but 'order' has 3"));
  forged["order"].push_back("t1");
  EXPECT_THAT(message_on(forged), HasSubstr("'order' repeats 1 trial"));
}

}  // namespace
}  // namespace relign::records
