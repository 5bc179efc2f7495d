#include "records/manifest_check.h"

#include <gmock/gmock.h>

#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"
#include "results/records/made_manifest.h"

namespace relign::records {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kSecret(64, 'a'), kOther(64, 'b');

Json method(const std::string& name) { return {{"name", name}, {"steps", 50U}, {"merit", "combined"}}; }

// What a run of the suite writes.
Json of_suite(const Json& suite) {
  Json methods = Json::array();
  for (const Json& name : suite.value("algorithms", Json::array())) methods.push_back(method(name));
  return {{"suite", suite.dump()},
          {"seed", 7U},
          {"instances", 2U},
          {"first_instance", 0U},
          {"scenes", {{{"name", "s"}}}},
          {"noise_levels", {{{"name", "a"}}, {{"name", "b"}}}},
          {"algorithms", methods},
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
    require_consistent(made_manifest(manifest), "results");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(ManifestCheck, AcceptsAnOpenAndASealedSuite) {
  EXPECT_EQ(message_on(of_suite(open_suite())), "");
  Json sealed = of_suite(sealed_suite());
  sealed["commitment"] = commitment_to(kSecret);
  EXPECT_EQ(message_on(sealed), "");
  sealed["secret"] = kSecret;
  EXPECT_EQ(message_on(sealed), "");
  EXPECT_EQ(message_on(Json::object()), "");
}

TEST(ManifestCheck, RefusesAnOpenSuiteThatClaimsToBeSealed) {
  Json forged = of_suite(open_suite());
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
  Json forged = of_suite(sealed_suite());
  EXPECT_THAT(message_on(forged), HasSubstr("the suite has the commitment")) << "removed";
  forged["commitment"] = commitment_to(kOther);
  forged["secret"] = kOther;
  EXPECT_THAT(message_on(forged), HasSubstr("but 'commitment' is '" + commitment_to(kOther)));
  forged["commitment"] = commitment_to(kSecret);
  EXPECT_THAT(message_on(forged), HasSubstr("'secret' has the commitment '" + commitment_to(kOther)));
}

TEST(ManifestCheck, ChecksEverySuiteOfAMergedFolder) {
  Json forged = of_suite(sealed_suite());
  forged["commitment"] = commitment_to(kSecret);
  forged["suites"] = {{{"text", sealed_suite().dump()}}, {{"text", open_suite().dump()}}};
  EXPECT_THAT(message_on(forged), HasSubstr("the suite is open"));
}

TEST(ManifestCheck, RefusesOtherNumbersThanTheSuite) {
  for (const auto& [key, value, message] :
       {std::tuple("instances", 1U, "'instances' is 2 in the suite and 1 in the manifest"),
        std::tuple("first_instance", 1U, "'first_instance' is 0 in the suite and 1"),
        std::tuple("seed", 8U, "'seed' is 7 in the suite and 8")}) {
    Json forged = of_suite(open_suite());
    forged[key] = value;
    EXPECT_THAT(message_on(forged), HasSubstr(message));
  }
  Json forged = of_suite(open_suite());
  forged["spec"] = {{"rmse", 0.5}};
  EXPECT_THAT(message_on(forged), HasSubstr("'spec' is null in the suite and {\"rmse\":0.5} in the manifest"));
  forged = of_suite(open_suite());
  forged["noise_levels"].erase(0);
  EXPECT_THAT(message_on(forged), HasSubstr("the suite has 2 'noise_levels', the manifest 1"));
}

TEST(ManifestCheck, RefusesOtherTermsThanTheSuite) {
  Json suite = open_suite();
  suite["algorithms"] = {"a"};
  Json honest = of_suite(suite);
  honest.update({{"limits", "soft"}, {"targets", Json::array()}, {"machine_time", Json::object()}});
  EXPECT_EQ(message_on(honest), "");
  for (const auto& [key, value, message] :
       {std::tuple("limits", Json("hard"), "'limits' is \"soft\" in the suite and \"hard\" in the manifest"),
        std::tuple("targets", Json({0.1}), "'targets' is [] in the suite and [0.1] in the manifest"),
        std::tuple("cost", Json({{"station_per_hour", 1}}), "'cost' is null in the suite and {\"module\":0.0,"),
        std::tuple("cycle", Json({{"load_s", 1}}), "'cycle' is null in the suite and"),
        std::tuple("machine_time", Json({{"settle_ms", 1}}), "'machine_time' is {} in the suite and")}) {
    Json forged = honest;
    forged[key] = value;
    EXPECT_THAT(message_on(forged), HasSubstr(message));
    suite[key] = value;
    forged["suite"] = suite.dump();
    EXPECT_EQ(message_on(forged), "") << key;
    suite.erase(key);
  }
}

// A suite that does not state a number has the usual one.
TEST(ManifestCheck, ComparesWithTheDefaultsOfTheSuite) {
  for (const auto& [key, usual] :
       {std::pair("seed", 1U), std::pair("instances", 100U), std::pair("first_instance", 0U)}) {
    Json suite = open_suite();
    suite["algorithms"] = {"a"};
    suite.erase(key);
    Json manifest = of_suite(suite);
    manifest[key] = usual;
    EXPECT_EQ(message_on(manifest), "");
    manifest[key] = 5U;
    EXPECT_THAT(message_on(manifest), HasSubstr("'" + std::string(key) + "' is " + std::to_string(usual) +
                                                " in the suite and 5 in the manifest"));
  }
}

TEST(ManifestCheck, RefusesNamesThatOccurTwice) {
  Json forged = of_suite(open_suite());
  forged["algorithms"] = {{{"name", "a"}, {"protocol", "paper"}}, {{"name", "a"}, {"protocol", "blind"}}};
  EXPECT_EQ(message_on(forged), "");
  forged["algorithms"].push_back({{"name", "a"}, {"protocol", "blind"}});
  EXPECT_THAT(message_on(forged), HasSubstr("'algorithms' has 'a' twice"));
}

TEST(ManifestCheck, KnowsWhetherTheSuiteIsThere) {
  Json suite = open_suite();
  const auto has_suites = [](const Json& manifest) { return made_manifest(manifest).has_suites(); };
  EXPECT_FALSE(has_suites(of_suite(suite))) << "no methods";
  suite["algorithms"] = {"a"};
  EXPECT_TRUE(has_suites(of_suite(suite)));
  Json merged = of_suite(suite);
  merged["suites"] = {{{"text", suite.dump()}}, {{"name", "other"}}};
  EXPECT_FALSE(has_suites(merged));
  for (const char* text : {"", "{", "[]", "{}"}) EXPECT_FALSE(has_suites({{"suite", text}})) << text;
  EXPECT_FALSE(has_suites(Json::object()));
}

TEST(ManifestCheck, KnowsSandboxesOfMergedFolders) {
  const auto ran_in_sandbox = [](const Json& manifest) { return made_manifest(manifest).ran_in_sandbox(); };
  EXPECT_FALSE(ran_in_sandbox(Json::object()));
  EXPECT_TRUE(ran_in_sandbox({{"sandbox", {{"memory_bytes", 1}}}}));
  Json merged;
  merged["sources"] = Json::array({{{"folder", "a"}}, {{"folder", "b"}, {"sandbox", Json::object()}}});
  EXPECT_TRUE(ran_in_sandbox(merged));
}

TEST(ManifestCheck, RefusesFewerMethodsThanTheSuite) {
  Json suite = open_suite();
  suite["algorithms"] = {"a", "b"};
  Json manifest = of_suite(suite);
  manifest["algorithms"].push_back({{"name", "home"}, {"added", true}});
  EXPECT_EQ(message_on(manifest), "");
  manifest["algorithms"].erase(1);
  EXPECT_THAT(message_on(manifest), HasSubstr("the suite has 2 'algorithms', the manifest 1"));
}

TEST(ManifestCheck, RefusesAnAnalysisPlanThatWasInsertedChangedOrRemoved) {
  AnalysisPlan full;
  full.smallest_relevant_ratio = 1.1;
  const Json plan = json_of(full);
  Json planned = open_suite();
  planned["analysis"] = {{"primary", "rmse"}};
  Json manifest = of_suite(planned);
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
  Json forged = of_suite(open_suite());
  forged["order"].erase(0);
  EXPECT_THAT(message_on(forged), HasSubstr("'trials' is 4, but 'order' has 3"));
  forged["order"].push_back("t1");
  EXPECT_THAT(message_on(forged), HasSubstr("'order' repeats 1 trial"));
}

}  // namespace
}  // namespace relign::records
