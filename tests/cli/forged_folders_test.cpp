// Forged results folders on a scene that knows the optimum of its instances, and forged files beside the records.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "cli/forged_results.h"
#include "cli/program.h"

namespace relign::cli_test::forged {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

TEST_F(ForgedFolders, ReplaysCountForTheirRecordsOnly) {
  evaluate("lens", "relign_od");  // whose instances have an optimum, so that methods are ranked
  forge([](Results&) {}, "lens");
  const auto replayed = [](const std::string& method) {
    const Json feed = Json::parse(place_->read("site/feed.json"));
    for (const Json& of_class : feed["rounds"][0]["classes"])
      for (const Json& standing : of_class["methods"])
        if (standing["method"] == method) return standing["replayed"];
    return Json();
  };
  const auto build = [] { return call({"leaderboard", "build", "forged", "-o", "site"}); };
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn), Json({{"by", nullptr}, {"of", 0}, {"trials", 0}}));
  EXPECT_THAT(place_->read("site/index.html"), HasSubstr("not replayed"));

  ASSERT_EQ(call({"verify", "forged/results", "--by", "A. Referee"}).exit_code, 0);
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn)["trials"], 2);
  EXPECT_EQ(replayed(kRival)["of"], 2);
  EXPECT_THAT(replayed(kOwn)["by"].get<std::string>(), HasSubstr("by A. Referee with "));
  EXPECT_THAT(place_->read("site/index.html"), AllOf(HasSubstr("2 of 2"), HasSubstr("by A. Referee with ")));

  // Other records, with the same file beside them.
  const std::string stated = place_->read("forged/results/verify.json");
  const auto better = [](Results& of) {
    Json& error = of.of(kOwn)[0]->steps.back()["recommended_mse"];
    error = 0.97 * error.get<double>();
  };
  forge(better, "lens");
  place_->write("forged/results/verify.json", stated);
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn)["trials"], 0);

  // The file states that records differ.
  forge(better, "lens");
  EXPECT_EQ(call({"verify", "forged/results"}).exit_code, 4);
  EXPECT_THAT(build().err, HasSubstr("replay: 1 of 8 replayed trials gave different numbers"));
}

// Where a scene computes the optimum of its instances, a method without it would vanish from the ranking.
TEST_F(ForgedFolders, MethodsDoNotVanish) {
  evaluate("lens", "relign_od");
  forge(closing("own_optimum_mse", nullptr), "lens");
  const Outcome built = call({"leaderboard", "build", "lens", "forged", "-o", "site"});
  EXPECT_EQ(built.exit_code, 4);
  EXPECT_THAT(built.err, HasSubstr("lacks 'own_optimum_mse', which 7 other trials on this scene and noise level have"));
}

// A lens cannot be better than at its own optimum, which is the same for every method.
TEST_F(ForgedFolders, OptimaAreOfTheInstance) {
  evaluate("lens", "relign_od");
  const std::vector<Forgery> forged = {
      {"huge uncertainty",
       [](Results& of) {
         Json& last = of.of(kOwn)[0]->steps.back();
         last["recommended_mse"] = -9e-5;
         last["recommended_mse_error"] = 1.0;
       },
       "has the standard error 1 of an MSE"},
      {"error of a pose that was captured",
       [](Results& of) {
         Json& last = of.of("random")[0]->steps.back();
         last["recommended_mse"] = last["recommended_mse"].get<double>() / 100;
       },
       "at the same true pose"},
      {"the same, at a true pose that nothing equals",
       [](Results& of) {
         Json& last = of.of("random")[0]->steps.back();
         last["recommended_mse"] = last["recommended_mse"].get<double>() / 100;
         last["recommended_true_pose"][0] = nullptr;
       },
       "has 'recommended_true_pose' with an unknown value at step 4"},
      {"optimum", closing("own_optimum_mse", 1e-3), "has another 'own_optimum_mse' than"},
      {"its pose", [](Results& of) { of.of(kRival)[0]->closing["own_optimum_pose"][0] = 0.25; },
       "has another 'own_optimum_pose' than"},
      {"its axes", closing("own_optimum_pose", {0.5, 0.5}), "has 'own_optimum_pose' of 2 instead of 5 axes"},
      {"below it",
       [](Results& of) {
         for (Trial& trial : of.trials) trial.closing["own_optimum_mse"] = 0.01;
       },
       "clearly below 'own_optimum_mse' 0.01"}};
  for (const Forgery& forgery : forged) {
    SCOPED_TRACE(forgery.name);
    forge(forgery.change, "lens");
    const Outcome built = call({"leaderboard", "build", "lens", "forged", "-o", "site"});
    EXPECT_EQ(built.exit_code, 4);
    EXPECT_THAT(built.err, AllOf(HasSubstr("left out: 'forged'"), HasSubstr(forgery.finding)));
    EXPECT_EQ(call({"report", "forged/results"}).exit_code, 4);
  }
}

// Its numbers are possible alone, but would take the ranking from every other folder of the round.
TEST_F(ForgedFolders, OptimaDoNotVanishFromARound) {
  evaluate("lens", "relign_od");
  forge(
      [](Results& of) {
        for (Trial& trial : of.trials) trial.closing["own_optimum_mse"] = nullptr;
      },
      "lens");
  for (const auto& [first, second] : {std::pair("lens", "forged"), {"forged", "lens"}}) {
    const Outcome built = call({"leaderboard", "build", first, second, "-o", "site"});
    EXPECT_EQ(built.exit_code, 4);
    EXPECT_THAT(built.err, HasSubstr("left out: 'forged': its records lack the optima of the instances"));
    EXPECT_THAT(built.out, HasSubstr("evaluations  1 of 2"));
  }
}

TEST_F(ForgedFolders, LinksAndOtherFilesAreNoRecords) {
  forge([](Results&) {});
  place_->write("forged/results/trials/copy.jsonl", "");
  EXPECT_THAT(call({"report", "forged/results"}).err, HasSubstr("'trials/copy.jsonl' is not a file of records"));
  forge([](Results&) {});
  ASSERT_EQ(::mkfifo(place_->path("forged/results/trials/0001.jsonl").c_str(), 0600), 0);
  EXPECT_THAT(call({"report", "forged/results"}).err, HasSubstr("'trials/0001.jsonl' is not a file of records"));
  forge([](Results&) {});
  fs::rename(place_->path("forged/results/trials/0000.jsonl"), place_->path("elsewhere"));
  fs::create_symlink(place_->path("elsewhere"), place_->path("forged/results/trials/0000.jsonl"));
  const Outcome reported = call({"report", "forged/results"});
  EXPECT_EQ(reported.exit_code, 4);
  EXPECT_THAT(reported.err, HasSubstr("'trials/0000.jsonl' is a link, not a file"));
}

TEST_F(ForgedFolders, ReportWarnsOfMissingTrialsAndFailedReplays) {
  forge([](Results& of) {
    of.trials.pop_back();
    of.times.pop_back();
  });
  const Outcome missing = call({"report", "forged/results"});
  EXPECT_EQ(missing.exit_code, 0) << "a run that goes on may be looked at";
  EXPECT_THAT(missing.err, HasSubstr("warning: Only 7/8 trials have ended."));
}

}  // namespace
}  // namespace relign::cli_test::forged
