#include "leaderboard/board.h"

#include <gmock/gmock.h>

#include <sstream>

#include "error_text.h"
#include "leaderboard/feed.h"
#include "leaderboard/made_evaluations.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"
#include "resealed.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class LeaderboardBoard : public MadeEvaluations {
 protected:
  static std::vector<std::string> methods_in(const BoardClass& of_class) {
    std::vector<std::string> names;
    for (const Standing& standing : of_class.standings) names.push_back(standing.method);
    return names;
  }
  // Why the second of two folders is left out; "" if it is not.
  static std::string reason(const std::vector<fs::path>& folders) {
    const Board board = board_of(folders);
    std::string text;
    for (const LeftOut& one : board.left_out)
      for (const std::string& each : one.reasons) text += each + "\n";
    return text;
  }
  // The only folder, which is left out.
  std::string refused(const std::vector<MadeMethod>& methods, const Json& change, const Json& in_manifest = {}) {
    const fs::path folder = evaluation("e", methods, change, in_manifest.is_null() ? Json::object() : in_manifest);
    return error_text(ErrorKind::bad_input, [&] { board_of({folder}); });
  }
};

TEST_F(LeaderboardBoard, RanksMethodsThatObserveTheSameUnderTheSameProtocol) {
  const Board board = board_of({evaluation("e", {{"good", {"merit", "box"}, 0.02, true},
                                                 {"bad", {"box", "merit"}, 0.18},
                                                 random(),
                                                 {"sees", {"images"}, 0.01},
                                                 {"starts", {"images", "start"}, 0.03},
                                                 {"good", {"merit", "box"}, 0.04, true, {}, "paper"}})});
  ASSERT_EQ(board.rounds.size(), 1U);
  const std::vector<BoardClass>& classes = board.rounds[0].classes;
  ASSERT_EQ(classes.size(), 3U);
  EXPECT_THAT(classes[0].observes, ElementsAre("images")) << "protocol blind withholds the start";
  EXPECT_THAT(methods_in(classes[0]), ElementsAre("sees", "starts"));
  EXPECT_THAT(classes[1].observes, ElementsAre("merit", "box")) << "in any order of the manifest";
  EXPECT_THAT(methods_in(classes[1]), ElementsAre("good", "random", "bad"));
  EXPECT_EQ(classes[2].protocol, "paper");
  EXPECT_THAT(methods_in(classes[2]), ElementsAre("good"));
  const Standing& good = classes[1].standings[0];
  EXPECT_EQ(good.rank, 1U);
  EXPECT_TRUE(good.submitted);
  EXPECT_EQ(board.entries[*good.entry].submission.licence, "MIT");
  EXPECT_LT(good.error.interval.low, good.error.estimate + 1e-12);
  EXPECT_DOUBLE_EQ(good.images, 3);
  EXPECT_FALSE(classes[1].standings[2].submitted);
}

TEST_F(LeaderboardBoard, StatesProbabilitiesAgainstBaselineAndBest) {
  const Board board =
      board_of({evaluation("e", {{"good", {"merit", "box"}, 0.02, true}, {"bad", {"merit", "box"}, 0.18}, random()})});
  const std::vector<Standing>& standings = board.rounds[0].classes[0].standings;
  EXPECT_DOUBLE_EQ(standings[0].beats_baseline.estimate, 1);
  EXPECT_EQ(standings[0].beaten_by_best.n, 0U) << "it is the best";
  EXPECT_EQ(standings[1].beats_baseline.n, 0U) << "it is the baseline";
  EXPECT_DOUBLE_EQ(standings[1].beaten_by_best.estimate, 1);
  EXPECT_DOUBLE_EQ(standings[2].beats_baseline.estimate, 0);
  EXPECT_LE(standings[2].beats_baseline.interval.low, standings[2].beats_baseline.interval.high);
}

// More methods than a report compares in pairs: the board still has the two comparisons of every method.
TEST_F(LeaderboardBoard, ComparesEveryOneOfManyMethods) {
  std::vector<MadeMethod> methods = {{"mine", {"images"}, 0.05, true}, random()};
  for (int i = 0; i < 14; ++i)
    methods.push_back({"other-" + std::to_string(i), {i % 2 ? "images" : "merit"}, 0.06 + 0.004 * i});
  const Board board = board_of({evaluation("e", methods)});
  for (const BoardClass& of_class : board.rounds[0].classes)
    for (const Standing& standing : of_class.standings) {
      EXPECT_EQ(standing.beats_baseline.n > 0, standing.method != "random") << standing.method;
      EXPECT_EQ(standing.beaten_by_best.n > 0, standing.rank > 1) << standing.method;
    }
}

TEST_F(LeaderboardBoard, CountsFailedTrialsAndKeepsTheirMethods) {
  const Board board = board_of({evaluation("e", {{"breaks", {"merit"}, 0.02, true, {1, 4}},
                                                 {"never-works", {"merit"}, 0.02, false, {0, 1, 2, 3, 4, 5, 6, 7}},
                                                 {"works", {"merit"}, 0.02}})});
  const BoardClass& of_class = board.rounds[0].classes[0];
  EXPECT_THAT(methods_in(of_class), ElementsAre("works", "breaks", "never-works"));
  EXPECT_EQ(of_class.standings[1].failed, 2U);
  EXPECT_EQ(of_class.standings[1].trials, 8U);
  EXPECT_NEAR(of_class.standings[1].mean_error.estimate, 0.25 + 0.75 * of_class.standings[0].mean_error.estimate, 0.003)
      << "two of eight count as 1";
  EXPECT_EQ(of_class.standings[2].failed, 8U);
  EXPECT_DOUBLE_EQ(of_class.standings[2].error.estimate, 1) << "each failure counts as the start";
  EXPECT_EQ(of_class.standings[2].rank, 3U);
}

TEST_F(LeaderboardBoard, DoesNotRankOracles) {
  const Board board = board_of({evaluation("e", {{"mine", {"merit"}, 0.05, true}, {"home", {"start"}, 0.01}})});
  const BoardClass& last = board.rounds[0].classes.back();
  EXPECT_TRUE(last.oracles);
  EXPECT_EQ(last.standings[0].rank, 0U);
  EXPECT_THAT(last.standings[0].not_ranked, HasSubstr("oracle"));
}

TEST_F(LeaderboardBoard, RefusesBaselinesMarkedAsSubmitted) {
  const fs::path folder = evaluation("e", {{"mine", {"merit"}, 0.05, true}, {"other", {"merit"}, 0.04}});
  Json file = Json::parse(read_file(folder / "evaluation.json"));
  file["methods"][1]["submitted"] = true;
  write_file_atomically(folder / "evaluation.json", file.dump());
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { board_of({folder}); }),
              HasSubstr("'other' (protocol 'blind') is marked as submitted, but the submission is 'mine'"));
}

TEST_F(LeaderboardBoard, RefusesCostsBudgetsAndParametersOtherThanTheRecordedOnes) {
  const std::vector<MadeMethod> methods = {
      {"mine", {"merit"}, 0.05, true, {}, "blind", {{"points", 4}, {"fast", true}}}};
  EXPECT_THAT(refused(methods, {{"budget", {{"steps", 1}}}}),
              HasSubstr("the budget is 1 step in evaluation.json, but 'mine' (protocol 'blind') had 2"));
  int made = 0;
  const auto with = [&](const Json& training, const Json& submission) {
    const fs::path folder = evaluation("s" + std::to_string(made++), methods);
    Json file = Json::parse(read_file(folder / "evaluation.json"));
    file["methods"][0]["training"] = training;
    write_file_atomically(folder / "evaluation.json", file.dump());
    file = Json::parse(read_file(folder / "submission.json"));
    file.merge_patch(submission);
    write_file_atomically(folder / "submission.json", file.dump());
    return folder;
  };
  const auto mistake = [&](const Json& training, const Json& submission) {
    return error_text(ErrorKind::bad_input, [&] { board_of({with(training, submission)}); });
  };
  const Json hours = {{"hours", 3}};
  EXPECT_THAT(mistake(hours, Json::object()), HasSubstr("the cost of training of 'mine' (protocol 'blind') in "
                                                        "evaluation.json is not that in the results' manifest"));
  EXPECT_THAT(mistake(hours, {{"training", {{"hours", 30}}}}), HasSubstr("is not that in submission.json"));
  EXPECT_THAT(mistake(nullptr, {{"training", hours}}), HasSubstr("is not that in submission.json"));
  EXPECT_THAT(
      mistake(nullptr, {{"algorithm", {{"parameters", {{"points", 5}}}}}}),
      HasSubstr("parameter 'points' of 'mine' (protocol 'blind') is 5 in submission.json and 4 in the results'"));
  EXPECT_EQ(board_of({with(hours, {{"training", hours},
                                   {"algorithm", {{"parameters", {{"points", 4}, {"fast", true}, {"file", "a"}}}}}})})
                .rounds.size(),
            1U);
}

TEST_F(LeaderboardBoard, RefusesImpossibleScores) {
  for (const std::string key : {"recommended_mse", "machine_seconds"}) {
    const fs::path folder = evaluation(key, {{"mine", {"merit"}, 0.05, true}});
    const fs::path trials = fs::directory_iterator(folder / "results/trials")->path();
    std::string text, forged;
    std::istringstream lines(read_file(trials));
    for (std::string line; std::getline(lines, line);) {
      forged = line;
      const std::size_t at = forged.find("\"" + key + "\":");
      if (at != std::string::npos) {
        const std::size_t begin = forged.find(':', at) + 1;
        forged.replace(begin, forged.find_first_of(",}", begin) - begin, "-1");
      }
      text += forged + "\n";
    }
    write_file_atomically(trials, records::resealed(text));
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { board_of({folder}); }),
                HasSubstr("(mine on relign_od rho0 #0) has '" + key + "' -1 at step 0"));
  }
}

TEST_F(LeaderboardBoard, MergesEvaluationsOnTheSameInstances) {
  const Board board = board_of({evaluation("a", {{"first", {"merit"}, 0.05, true}, random()}),
                                evaluation("b", {{"second", {"merit"}, 0.04, true}, random()})});
  ASSERT_EQ(board.rounds.size(), 1U);
  EXPECT_EQ(board.rounds[0].entries.size(), 2U);
  EXPECT_THAT(methods_in(board.rounds[0].classes[0]), ElementsAre("second", "first"));
  EXPECT_THAT(board.left_out, IsEmpty());
}

TEST_F(LeaderboardBoard, SeparatesRoundsByInstances) {
  const Json other = {{"suite", {{"instance_set", "set-2"}}}, {"date", "2026-12-01"}};
  const Board board =
      board_of({evaluation("a", {{"first", {"merit"}, 0.05, true}}),
                evaluation("b", {{"second", {"merit"}, 0.04, true}}, other, {{"instance_set", "set-2"}})});
  ASSERT_EQ(board.rounds.size(), 2U);
  EXPECT_EQ(board.rounds[0].suite.instance_set, "set-2") << "latest first";
}

TEST_F(LeaderboardBoard, RanksTheLatestVersionAndKeepsTheHistory) {
  const auto version = [&](const std::string& number, const std::string& date, double error) {
    return evaluation("v" + number, {{"mine", {"merit"}, error, true, {}, "blind", {{"tuned", error}}}, random()},
                      {{"version", number}, {"date", date}, {"archive_sha256", std::string(64, number[0])}});
  };
  const Board board = board_of(
      {version("2", "2026-11-20", 0.03), version("3", "2026-11-24", 0.05), version("1", "2026-11-10T10:00:00Z", 0.15)});
  ASSERT_EQ(board.rounds.size(), 1U);
  const Standing* standing = find_standing(board.rounds[0], "mine", "blind");
  ASSERT_TRUE(standing);
  EXPECT_EQ(board.entries[*standing->entry].evaluation.version, "3") << "the latest, not the best";
  ASSERT_EQ(board.histories.size(), 1U);
  const std::vector<Version>& versions = board.histories[0].versions;
  ASSERT_EQ(versions.size(), 3U);
  std::vector<double> errors;
  for (const Version& one : versions) errors.push_back(one.results.at(0).error.estimate);
  EXPECT_EQ(board.entries[versions[2].entry].evaluation.version, "1");
  EXPECT_LT(errors[1], errors[0]);
  EXPECT_LT(errors[0], errors[2]);
  EXPECT_EQ(versions[0].results[0].of, 1U) << "random observes something else";
}

TEST_F(LeaderboardBoard, FlagsOpenInstancesAndMissingSandboxes) {
  const auto tags = [&](const Json& change, const Json& manifest, const Json& suite) {
    const Board board = board_of({evaluation("e", {{"mine", {"merit"}, 0.05, true}}, change, manifest, suite)});
    std::vector<std::string> found;
    for (const Caution& caution : board.entries[0].cautions) found.emplace_back(caution.tag);
    return found;
  };
  EXPECT_THAT(tags(Json::object(), Json::object(), Json::object()), ElementsAre("not sealed", "no sandbox"));
  fs::remove_all(folder_ / "e");
  const std::string commitment = "sha256:" + std::string(64, '1');
  EXPECT_THAT(tags({{"sealed", true}, {"sandbox", true}},
                   {{"commitment", commitment}, {"sandbox", {{"memory_bytes", 1}}}}, {{"commitment", commitment}}),
              IsEmpty());
}

TEST_F(LeaderboardBoard, LeavesOutFoldersThatContradictThemselves) {
  const std::vector<MadeMethod> mine = {{"mine", {"merit"}, 0.05, true}};
  EXPECT_THAT(refused(mine, {{"sealed", true}}), HasSubstr("the results have no commitment"));
  fs::remove_all(folder_ / "e");
  EXPECT_THAT(refused(mine, {{"sealed", true}}, {{"commitment", "sha256:" + std::string(64, '1')}}),
              HasSubstr("the suite is open, since it has no commitment"));
  fs::remove_all(folder_ / "e");
  EXPECT_THAT(refused(mine, {{"sandbox", true}}), HasSubstr("no algorithm of the results ran in a sandbox"));
  fs::remove_all(folder_ / "e");
  EXPECT_THAT(refused(mine, {{"suite", {{"instance_set", "other"}}}}),
              HasSubstr("the instance set is 'other' in evaluation.json and 'set-1' in the results' manifest"));
  fs::remove_all(folder_ / "e");
  EXPECT_THAT(refused(mine, {{"program_version", "9.9"}}), HasSubstr("no trial was recorded by relign-bench '9.9'"));
  fs::remove_all(folder_ / "e");
  EXPECT_THAT(refused(mine, {{"class", {"images"}}}), HasSubstr("the class is 'images', but 'mine'"));
}

// A class with less competition would be a gain.
TEST_F(LeaderboardBoard, ComparesStatedAndRecordedObservations) {
  const fs::path folder = evaluation("e", {{"mine", {"images", "design"}, 0.05, true}});
  Json file = Json::parse(read_file(folder / "evaluation.json"));
  file["methods"][0]["observes"] = file["class"] = {"merit"};
  write_file_atomically(folder / "evaluation.json", file.dump());
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { board_of({folder}); }),
              HasSubstr("observes 'merit' by evaluation.json and 'design, images' by the results"));
}

TEST_F(LeaderboardBoard, LeavesOutResultsWithoutAllTrials) {
  const std::vector<MadeMethod> mine = {{"mine", {"merit"}, 0.05, true}};
  EXPECT_THAT(refused(mine, Json::object(), {{"instances", kInstances + 1}}),
              HasSubstr("'mine' (protocol 'blind') has 8 trials instead of 9"));
  fs::remove_all(folder_ / "e");
  // A bad trial that was removed from the records.
  const fs::path folder = evaluation("e", mine);
  const std::string records = read_file(folder / "results/trials/0000.jsonl");
  const std::size_t first_end = records.find("\"end\"");
  ASSERT_NE(first_end, std::string::npos);
  write_file_atomically(folder / "results/trials/0000.jsonl", records.substr(records.find('\n', first_end) + 1));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { board_of({folder}); }),
              HasSubstr("1 of 8 planned trials are not in the results"));
}

TEST_F(LeaderboardBoard, LeavesOutWhatContradictsAnotherFolder) {
  const fs::path first = evaluation("a", {{"mine", {"merit"}, 0.05, true}, random()});
  EXPECT_THAT(
      reason({first, evaluation("b", {{"mine", {"merit"}, 0.05, true}}, {{"archive_sha256", std::string(64, 'e')}})}),
      HasSubstr("version '1.0' of 'mine' is another archive in"));
  EXPECT_THAT(reason({first, evaluation("c", {{"mine", {"merit"}, 0.01, true}}, {{"name", "thief"}})}),
              HasSubstr("the method 'mine' is submitted as 'mine' in"));
  MadeMethod weaker = random();
  weaker.parameters = {{"weak", true}};
  EXPECT_THAT(reason({first, evaluation("d", {{"other", {"merit"}, 0.1, true}, weaker})}),
              HasSubstr("the method 'random' is another one in"));
  EXPECT_THAT(reason({first, folder_ / "none"}), HasSubstr("is not an evaluation folder"));
}

TEST_F(LeaderboardBoard, ShowsRecordsThatDifferBetweenFolders) {
  MadeMethod changed = random();
  changed.error = 0.1;
  const Board board = board_of({evaluation("a", {{"first", {"merit"}, 0.05, true}, random()}),
                                evaluation("b", {{"second", {"merit"}, 0.04, true}, changed})});
  ASSERT_EQ(board.rounds.size(), 1U);
  ASSERT_FALSE(board.rounds[0].alarms.empty());
  EXPECT_THAT(board.rounds[0].alarms[0],
              AllOf(HasSubstr("records differ: random on relign_od rho0"), HasSubstr("/a/")));
}

// A fake baseline would make every method look good.
TEST_F(LeaderboardBoard, LeavesOutOtherMethodsUnderTheNameOfABaseline) {
  for (const char* name : {"random", "Random", "home"}) {
    MadeMethod fake = random();
    fake.name = name;
    fake.plugin = "stays-at-the-start";
    EXPECT_THAT(refused({{"mine", {"merit", "box"}, 0.1, true}, fake}, Json::object()),
                HasSubstr("'" + std::string(name) + "' (protocol 'blind') reads as the baseline '"));
    fs::remove_all(folder_ / "e");
  }
}

TEST_F(LeaderboardBoard, FindsTheBaselineByWhatItIs) {
  MadeMethod chance = random();
  chance.name = "chance";
  chance.plugin = "random";
  const fs::path folder = evaluation("e", {{"mine", {"merit", "box"}, 0.02, true}, chance});
  const Round round = board_of({folder}).rounds[0];
  EXPECT_EQ(round.baseline, "chance");
  EXPECT_EQ(round.about_baseline, "'chance', which is 'random'");
  EXPECT_DOUBLE_EQ(round.classes[0].standings[0].beats_baseline.estimate, 1);
  EXPECT_THAT(index_html(board_of({folder})), HasSubstr("&#39;chance&#39;, which is &#39;random&#39;"));
  EXPECT_EQ(board_of({folder}, "nosuch").rounds[0].about_baseline, "none, because no method of this round is 'nosuch'");
  MadeMethod short_random = random();
  short_random.steps = 1;
  EXPECT_EQ(board_of({evaluation("s", {{"mine", {"merit"}, 0.02, true}, short_random})}).rounds[0].about_baseline,
            "'random', which has only 1 step per alignment");
  EXPECT_EQ(board_of({evaluation("r", {{"mine", {"merit"}, 0.02, true}, random()})}).rounds[0].about_baseline, "");
}

TEST_F(LeaderboardBoard, LeavesOutResultsWithoutTheirSuite) {
  const std::vector<MadeMethod> mine = {{"mine", {"merit"}, 0.05, true}};
  for (const Json& removed : {Json{{"suite", ""}}, Json{{"suite", "{}"}},
                              Json{{"suites", {{{"name", "made"}, {"file", "made.json"}, {"text", ""}}}}}}) {
    const fs::path folder = evaluation("e", mine);
    Json manifest = Json::parse(read_file(folder / "results/manifest.json"));
    manifest.merge_patch(removed);
    write_file_atomically(folder / "results/manifest.json", manifest.dump());
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { board_of({folder}); }),
                HasSubstr("the results' manifest lacks the text of its suite"))
        << removed;
    fs::remove_all(folder_ / "e");
  }
}

TEST_F(LeaderboardBoard, ShowsWhyNoMethodIsRanked) {
  const Board board = board_of({evaluation("e", {{"home", {"start"}, 0.05, true}})});
  EXPECT_THAT(reasons_without_ranking(board.rounds[0]), ElementsAre("'home' (protocol blind): oracles are not ranked"));
  EXPECT_THAT(index_html(board), AllOf(HasSubstr("No method of this round is ranked:"),
                                       HasSubstr("<li>&#39;home&#39; (protocol blind): oracles are not ranked</li>")));
  EXPECT_EQ(feed(board)["rounds"][0]["not_ranked"].size(), 1U);
  const Board ranked = board_of({evaluation("r", {{"mine", {"merit"}, 0.05, true}, {"home", {"start"}, 0.05}})});
  EXPECT_THAT(reasons_without_ranking(ranked.rounds[0]), IsEmpty());
  EXPECT_FALSE(feed(ranked)["rounds"][0].contains("not_ranked"));
}

TEST_F(LeaderboardBoard, FeedHasEverything) {
  const Json json =
      feed(board_of({evaluation("e", {{"mine", {"merit", "box"}, 0.05, true, {2}}, random()}), folder_ / "missing"}));
  EXPECT_EQ(json["format"], "relign-bench/leaderboard/1");
  const Json& of_class = json["rounds"][0]["classes"][0];
  EXPECT_EQ(of_class["observes"], Json({"merit", "box"}));
  EXPECT_EQ(of_class["methods"][0]["method"], "mine");
  EXPECT_EQ(of_class["methods"][0]["rank"], 1);
  EXPECT_EQ(of_class["methods"][0]["failed"], 1);
  EXPECT_EQ(of_class["methods"][0]["submission"]["version"], "1.0");
  EXPECT_TRUE(of_class["methods"][1]["submission"].is_null());
  EXPECT_EQ(json["submissions"][0]["versions"][0]["results"][0]["failed"], 1);
  EXPECT_EQ(json["left_out"].size(), 1U);
}

}  // namespace
}  // namespace relign::leaderboard
