#include "report/compare.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "report/made_results.h"

namespace relign::report {
namespace {

using test::error_text;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class Compare : public MadeResults {
 protected:
  // Eight instances; the final error of b is `factor` times that of a.
  void write_methods(double factor, const std::string& a = "a", const std::string& b = "b") {
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < 8; ++i) {
      const double lens = 0.01 * (1 + 0.1 * static_cast<double>(i));
      trials.push_back(trial(a, i, {0.1, 0.05, lens}));
      trials.push_back(trial(b, i, {0.1, 0.05, factor * lens}));
    }
    write(trials);
  }
  ComparedSide side(const std::string& method = "") const { return {folder_, method}; }
  static CompareOptions gate(const std::string& text) {
    CompareOptions options;
    options.gates = {parse_gate(text)};
    return options;
  }
};

TEST_F(Compare, ComparesBWithAOnTheSameInstances) {
  write_methods(0.5);
  const Comparison compared = compare(side("a"), side("b"), {});
  const Json result = to_json(compared);
  ASSERT_EQ(result["pairs"].size(), 1U);
  const Json& pair = result["pairs"][0];
  EXPECT_EQ(pair["n"], 8);
  EXPECT_EQ(pair["step"], 2);
  EXPECT_NEAR(pair["ratio"].get<double>(), 0.5, 1e-9);
  EXPECT_NEAR(pair["median_a"].get<double>(), 0.0135, 1e-9);
  EXPECT_EQ(pair["verdict"], "better");
  EXPECT_EQ(to_json(compare(side("b"), side("a"), {}))["pairs"][0]["verdict"], "worse");
  CompareOptions early;
  early.step = 1;
  EXPECT_EQ(to_json(compare(side("a"), side("b"), early))["pairs"][0]["verdict"], "practically equal");
  EXPECT_THAT(comparison_text(compared),
              AllOf(HasSubstr("a (A) and b (B)"), HasSubstr("B is better"),
                    HasSubstr("ratio B / A over 8 common instances 0.500 (95 % CI 0.500 to 0.500)")));
}

TEST_F(Compare, UsesTheRule) {
  write_methods(0.5);
  CompareOptions current;
  current.rule = statistics::Rule::current;
  const Comparison compared = compare(side("a"), side("b"), current);
  const Json result = to_json(compared);
  EXPECT_EQ(result["rule"], "current");
  const Json& rules = result["pairs"][0]["rules"];
  EXPECT_EQ(rules["own"]["verdict"], "better");
  EXPECT_NEAR(rules["current"]["ratio"].get<double>(), 0.5, 1e-9) << "recommended and commanded pose are the same here";
  EXPECT_THAT(comparison_text(compared),
              HasSubstr("by rule: own better (0.500), best better (0.500), current better (0.500)"));
  add_plan({{"rule", "best"}, {"smallest_relevant_ratio", 3}});
  const Json planned = to_json(compare(side("a"), side("b"), {}));
  EXPECT_EQ(planned["rule"], "best");
  EXPECT_EQ(planned["pairs"][0]["verdict"], "practically equal") << "within the plan's ratio";
}

TEST_F(Compare, StatesWhyItIsUndecided) {
  write({trial("a", 0, {0.1, 0.01}), trial("b", 0, {0.1, 0.001}), trial("a", 1, {0.1, 0.01}),
         trial("b", 1, {0.1, 0.001})});
  const Comparison compared = compare(side("a"), side("b"), {});
  const Json result = to_json(compared);
  EXPECT_EQ(result["pairs"][0]["verdict"], "undecided");
  EXPECT_THAT(comparison_text(compared), HasSubstr("reason: at least 6 common instances are needed, found 2"));
}

TEST_F(Compare, ChecksGates) {
  write_methods(1.05);
  const auto holds = [&](const std::string& text) {
    return to_json(compare(side("a"), side("b"), gate(text)))["holds"];
  };
  EXPECT_EQ(holds("recommended@2<=1.06x"), true);
  EXPECT_EQ(holds("recommended@2<=1.04x"), false);
  EXPECT_EQ(holds("rmse<=1.06x"), true) << "at the last step, by the synonym";
  EXPECT_EQ(holds("recommended@1<=1.001x"), true) << "equal at step 1";
  EXPECT_EQ(holds("commanded@2<=0.015"), true) << "B's median is 0.0142";
  EXPECT_EQ(holds("commanded@2<=0.014"), false);
  EXPECT_EQ(holds("excess<=1x"), false) << "own optima are unknown";
  EXPECT_THAT(comparison_text(compare(side("a"), side("b"), gate("rmse<=1.04x"))),
              HasSubstr("FAILED  rmse<=1.04x  1.050  "));
}

TEST_F(Compare, ComparesYields) {
  // Final errors of a are 0.0100, 0.0110, ..., 0.0170, those of b 90 % of them.
  write_methods(0.9);
  EXPECT_EQ(to_json(compare(side("a"), side("b"), {}))["pairs"][0]["yield"], nullptr) << "no specification";
  EXPECT_EQ(to_json(compare(side("a"), side("b"), gate("yield>=0")))["holds"], false)
      << "an unknown yield does not pass";
  add_to_manifest({{"spec", {{"rmse", 0.01305}}}});
  const Comparison compared = compare(side("a"), side("b"), {});
  const Json result = to_json(compared);
  EXPECT_EQ(result["pairs"][0]["yield"],
            Json({{"n", 8}, {"a", 4}, {"b", 5}, {"a_alone", 0}, {"b_alone", 1}, {"p", 1.0}}));
  EXPECT_THAT(comparison_text(compared),
              HasSubstr("in specification: A 4, B 5 of 8 instances; only A 0, only B 1, p 1"));
  const auto holds = [&](const char* a, const char* b, const std::string& text) {
    return to_json(compare(side(a), side(b), gate(text)))["holds"];
  };
  EXPECT_EQ(holds("a", "b", "yield>=0.625"), true);
  EXPECT_EQ(holds("a", "b", "yield>=0.626"), false);
  EXPECT_EQ(holds("a", "b", "yield>=A"), true);
  EXPECT_EQ(holds("b", "a", "yield>=A"), false);
  EXPECT_EQ(holds("b", "a", "yield>=A-0.125"), true) << "4 of 8 is 0.125 below 5 of 8";
  EXPECT_EQ(holds("b", "a", "yield>=A-0.12"), false);
}

TEST_F(Compare, CountsFailedTrialsAsMissed) {
  records::TrialRecord failed = trial("b", 1, {0.001});
  failed.end = "timeout";
  write({trial("a", 0, {0.01}), trial("b", 0, {0.01}), trial("a", 1, {0.01}), failed, trial("a", 2, {0.01})});
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  const Json yield = to_json(compare(side("a"), side("b"), {}))["pairs"][0]["yield"];
  EXPECT_EQ(yield["n"], 2) << "only A has the third instance";
  EXPECT_EQ(yield["a"], 2);
  EXPECT_EQ(yield["b"], 1);
}

TEST_F(Compare, DoesNotCompareYieldsOfDifferentSpecifications) {
  write_methods(1);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  const std::filesystem::path before = folder_.string() + "-before";
  std::filesystem::remove_all(before);
  std::filesystem::copy(folder_, before, std::filesystem::copy_options::recursive);
  EXPECT_EQ(to_json(compare({before, "a"}, side("a"), {}))["pairs"][0]["yield"]["b"], 8);
  add_to_manifest({{"spec", {{"rmse", 0.01}}}});
  EXPECT_EQ(to_json(compare({before, "a"}, side("a"), {}))["pairs"][0]["yield"], nullptr);
  std::filesystem::remove_all(before);
}

TEST_F(Compare, ComparesCommonMethodsOfTwoFolders) {
  write_methods(1.5);
  add_to_manifest({{"instance_set", "same"}});
  const std::filesystem::path before = folder_.string() + "-before";
  std::filesystem::remove_all(before);
  std::filesystem::rename(folder_, before);
  write_methods(1, "a", "new");
  add_to_manifest({{"instance_set", "same"}});
  const Comparison compared = compare({before, ""}, side(), {});
  const Json result = to_json(compared);
  ASSERT_EQ(result["pairs"].size(), 1U);
  EXPECT_EQ(result["pairs"][0]["b"], "a");
  EXPECT_THAT(result["unmatched"], ElementsAre("b (relign_od, rho0, paper)"));
  add_to_manifest({{"instance_set", "longer"}, {"instances", 7}});
  EXPECT_EQ(to_json(compare({before, ""}, side(), {}))["pairs"].size(), 1U) << "the same instances and more";
  add_to_manifest({{"instance_set", "other"}, {"seed", 2}});
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] {
                           compare({before, ""}, side(), {});
                         }),
              AllOf(HasSubstr("have different instances"), HasSubstr("seed: 0 in ")));
  std::filesystem::remove_all(before);
}

TEST_F(Compare, RejectsInvalidArguments) {
  write_methods(1);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { compare(side("aa"), side("b"), {}); }),
              HasSubstr("unknown method 'aa' in"));
  CompareOptions late;
  late.step = 3;
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { compare(side("a"), side("b"), late); }),
              HasSubstr("step 3 is beyond the last common step 2"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { compared_side("nowhere:a"); }),
              HasSubstr("no results folder 'nowhere:a'"));
  EXPECT_EQ(compared_side(folder_.string() + ":a").method, "a");
  for (const auto& [gate, why] :
       std::vector<std::pair<std::string, std::string>>{{"rmse@20", "missing '<='"},
                                                        {"rmse@x<=1", "step 'x' must be"},
                                                        {"recomended<=1", "recommended"},
                                                        {"rmse<=0x", "must be a positive number"},
                                                        {"rmse<=1.0.2x", "must be a positive number"},
                                                        {"rmse<=nan", "must be a positive number"},
                                                        {"yield<=0.9", "must start with 'yield>='"},
                                                        {"yield@3>=0.9", "must start with 'yield>='"},
                                                        {"yield>=95", "must be a number from 0 to 1"},
                                                        {"yield>=", "must be a number from 0 to 1"},
                                                        {"yield>=A+0.1", "expected '-' after 'A'"},
                                                        {"yield>=A-", "must be a number from 0 to 1"}})
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&, text = gate] { parse_gate(text); }), HasSubstr(why)) << gate;
  EXPECT_EQ(parse_track("rmse"), statistics::Track::recommended);
  EXPECT_EQ(parse_track("best"), statistics::Track::best);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { parse_track("recomended"); }),
              HasSubstr("--track: unknown track 'recomended'; did you mean 'recommended'?"));
}

TEST_F(Compare, IsUndecidedWithFewInstancesAndCountsFailures) {
  records::TrialRecord failed = trial("b", 1, {0.1});
  failed.end = "timeout";
  write({trial("a", 0, {0.1, 0.01}), trial("b", 0, {0.1, 0.02}), trial("a", 1, {0.1, 0.01}), failed});
  const Json pair = to_json(compare(side("a"), side("b"), {}))["pairs"][0];
  EXPECT_EQ(pair["verdict"], "undecided");
  EXPECT_EQ(pair["n"], 1);
  EXPECT_EQ(pair["missing"], 1);
  EXPECT_EQ(pair["failed_b"], 1);
}

}  // namespace
}  // namespace relign::report
