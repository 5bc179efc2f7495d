// Training cost and break-even points, by hand calculation.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "base/json_members.h"
#include "report/made_results.h"
#include "report/page_json.h"
#include "report/report.h"
#include "report/training_data.h"

namespace relign::report {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

TEST(PaysAfter, DividesTrainingTimeBySavingsPerLens) {
  EXPECT_EQ(pays_after(0.45, 1.4, 3.6), 737);  // 1620 s / 2.2 s = 736.4
  EXPECT_EQ(pays_after(1, 2, 4), 1800);
  EXPECT_EQ(pays_after(0, 2, 4), 0);
  EXPECT_EQ(pays_after(1, 4, 4), kNever) << "saves nothing";
  EXPECT_EQ(pays_after(1, 5, 4), kNever);
  EXPECT_EQ(pays_after(1, kNever, 4), kNever) << "does not reach the specification";
  EXPECT_EQ(pays_after(1, kNever, kNever), kNever);
  EXPECT_TRUE(std::isnan(pays_after(kUnknown, 2, 4)));
  EXPECT_TRUE(std::isnan(pays_after(1, kUnknown, 4)));
  EXPECT_TRUE(std::isnan(pays_after(1, 2, kUnknown)));
  EXPECT_TRUE(std::isnan(pays_after(1, 2, kNever))) << "no baseline";
}

// In specification (0.05) after one, two and three steps of 0.5 s; the algorithm takes 1 ms per step.
class Training : public MadeResults {
 protected:
  void SetUp() override {
    MadeResults::SetUp();
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < 6; ++i) {
      trials.push_back(trial("agent", i, {0.2, 0.04, 0.03, 0.03}));
      trials.push_back(trial("search", i, {0.2, 0.15, 0.12, 0.04}));
      trials.push_back(trial("oracle", i, {0.2, 0.01, 0.01, 0.01}));
      trials.push_back(trial("learner", i, {0.2, 0.1, 0.04, 0.04}));
      trials.push_back(trial("lost", i, {0.2, 0.19, 0.18, 0.17}));
    }
    for (records::TrialRecord& one : trials) one.protocol = "blind";  // where the oracle is one
    write(trials);
    add_to_manifest({{"spec", {{"rmse", 0.05}}}, {"algorithms", algorithms(0.5)}});
  }
  static Json algorithms(const Json& hours) {
    return {{{"name", "agent"}, {"training", {{"hours", hours}, {"steps", 9000}, {"machine", "four cores"}}}},
            {{"name", "search"}},
            {{"name", "oracle"}, {"oracle", true}, {"observes", {"start"}}},
            {{"name", "learner"}},
            {{"name", "lost"}, {"training", {{"hours", 1}}}}};
  }
  Json of(const std::string& method) {
    const Json data = to_json(page_model(load_results(folder_)));
    for (const Json& entry : list_of(data, "training"))
      if (entry["method"] == method) return entry;
    return nullptr;
  }
};

TEST_F(Training, BreaksEvenAgainstTheFastestUntrainedMethod) {
  add_to_manifest(
      {{"prepared",
        {{{"algorithm", "learner"}, {"protocol", "blind"}, {"sources", 10}, {"steps", 20}, {"failure", ""}}}}});
  const Json agent = of("agent");
  EXPECT_EQ(agent["hours"], 0.5);
  EXPECT_EQ(agent["steps"], 9000);
  ASSERT_EQ(agent["pays_after"].size(), 1U);
  // One step instead of the search's three: 2 * (0.5 + 0.004 / 3) s, since 4 ms are spread over three steps. The
  // pretrained learner's two steps and the oracle's one are no baseline.
  EXPECT_EQ(agent["pays_after"][0]["against"], "search");
  EXPECT_NEAR(agent["pays_after"][0]["saves"].get<double>(), 2 * (0.5 + 0.004 / 3), 1e-9);
  EXPECT_EQ(agent["pays_after"][0]["lenses"], 1796.0);  // 1800 / 1.00267 = 1795.2
  EXPECT_EQ(of("learner")["steps"], 200);
  EXPECT_TRUE(of("learner")["hours"].is_null());
  EXPECT_TRUE(of("learner")["pays_after"][0]["lenses"].is_null());
  EXPECT_EQ(of("lost")["pays_after"][0]["lenses"], "never");
  EXPECT_TRUE(of("search").is_null());

  const std::string page = Report(folder_).html();
  for (const char* words :
       {"Training cost", "<b>1800 lenses</b>", "30 min", "four cores", "<b>never</b>", "<b>unknown</b>"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
}

TEST_F(Training, NeedsHoursForTheBreakEvenPoint) {
  add_to_manifest({{"algorithms", algorithms(nullptr)}});
  EXPECT_TRUE(of("agent")["pays_after"][0]["lenses"].is_null());
  add_to_manifest({{"algorithms", Json::array()}});
  EXPECT_TRUE(of("agent").is_null());
  EXPECT_THAT(Report(folder_).html(), Not(HasSubstr("Training cost")));
}

// Without an untrained method the number is absent.
TEST_F(Training, ReportsAMissingBaseline) {
  std::filesystem::remove_all(folder_);
  write({trial("agent", 0, {0.2, 0.04}), trial("lost", 0, {0.2, 0.19})});
  const Json all = algorithms(0.5);
  add_to_manifest({{"spec", {{"rmse", 0.05}}}, {"algorithms", {all[0], all[4]}}});
  EXPECT_TRUE(of("agent")["pays_after"][0]["lenses"].is_null());
  EXPECT_THAT(Report(folder_).html(),
              HasSubstr("no method without training reaches the specification on half of the instances"));
}

// Without a specification there is no time to specification.
TEST_F(Training, ShowsOnlyTheCostWithoutASpecification) {
  add_to_manifest({{"spec", nullptr}});
  EXPECT_EQ(of("agent")["hours"], 0.5);
  EXPECT_TRUE(of("agent")["pays_after"].empty());
}

}  // namespace
}  // namespace relign::report
