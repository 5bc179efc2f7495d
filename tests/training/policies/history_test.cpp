#include "policies/history.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "policies/model.hpp"
#include "policies/onnx_writer.h"

namespace relign::policies {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;
using Json = nlohmann::json;

HistoryFormat one_axis_one_reading() {
  HistoryFormat format;
  format.last = 2;
  format.best = 1;
  format.axes = 1;
  format.fine_move = 0.1;
  format.readings = {"loss"};
  format.mean = {10};
  format.deviation = {5};
  format.fine = {2};
  format.score = 0;
  return format;
}

testing::Matcher<float> near(double value) { return FloatNear(static_cast<float>(value), 1e-6F); }

TEST(History, FillsLatestSlotsFromTheEndAndBestOnesFromTheFront) {
  const HistoryFormat format = one_axis_one_reading();
  History history(format);
  history.add({0.5}, {20});
  EXPECT_THAT(history.input(),
              ElementsAre(1, 0, 0, 2, near(std::log(11)), 0, 0, 0, 0, 0, 1, 0, 0, 2, near(std::log(11))));
  history.add({0.2}, {4});
  history.add({0.3}, {4});  // as good: the first one counts
  EXPECT_EQ(history.best(), Pose{0.2});
  EXPECT_THAT(history.input(),
              ElementsAre(1, near(-0.1), near(-std::log(2)), near(-1.2), near(std::log(3)), 1, near(-0.1),
                          near(-std::log(2)), near(-1.2), near(std::log(3)), 1, 0, 0, near(-1.2), near(std::log(3))));
}

TEST(History, KeepsPosesAloneOfScenesWithImages) {
  HistoryFormat format;
  format.last = 2;
  format.axes = 2;
  format.fine_move = 0.1;
  History history(format);
  history.add({0, 0.1}, {});
  history.add({0, 0}, {});
  EXPECT_THAT(history.input(), ElementsAre(1, 0, 0, near(0.1), near(std::log(2)), 1, 0, 0, 0, 0));
}

// A network whose output is the first reading of the newest slot, and its side file.
class SideFileOfReadings : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("relign-history-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::vector<float> weights(15, 0.0F);
    weights[13] = 1;
    const std::string graph =
        test::Chain::of_row(15).weight("w", {1, 15}, weights).then("Gemm", {"w"}, test::integer("transB", 1)).file();
    std::ofstream(folder_ / "net.onnx", std::ios::binary) << graph;
    side_ = {{"format", 1},
             {"scene", "toy"},
             {"axes", {"u"}},
             {"observation",
              {{"kind", "readings"},
               {"readings", {{{"name", "loss"}, {"unit", "dB"}}}},
               {"mean", {10}},
               {"deviation", {5}},
               {"fine", {2}},
               {"score", "loss"},
               {"history", {{"last", 2}, {"best", 1}, {"fine_move", 0.1}}}}},
             {"output", "way"},
             {"largest_move", 0.2},
             {"command", "relign-train imitate --scene toy -o FOLDER"},
             {"weights_sha256", sha256_hex(graph)},
             {"reference", {{"readings", {0.5}}}},
             {"parity", {{"inputs", {std::string(26, '8') + "a0" + "80"}}, {"answers", {{1.0}}}}}};
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string onnx() const { return (folder_ / "net.onnx").string(); }
  std::string refusal(const Json& side) const {
    std::ofstream(folder_ / "net.json") << side.dump();
    try {
      Model model(onnx());
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
  Json side_;
};

TEST_F(SideFileOfReadings, DescribesNetworkAndProbes) {
  side_["probes"] = {{"poses", {{0.25}, {-0.25}}}, {"until", 30}};
  ASSERT_EQ(refusal(side_), "");
  Model model(onnx());
  EXPECT_EQ(model.about().frames, 0);
  EXPECT_EQ(model.about().history->score, 0);
  EXPECT_EQ(model.about().probes.poses.size(), 2u);
  std::vector<float> input(15, 0.0F);
  input[13] = 0.375F;
  EXPECT_THAT(model.answer(input), ElementsAre(0.375));
}

TEST_F(SideFileOfReadings, MayHaveImagesToo) {
  Json& observation = side_["observation"];
  observation["kind"] = "images";
  observation.update({{"size", 10}, {"frames", 1}, {"white", 0.5}, {"byte_whites", 3}});
  side_["reference"] = {{"blocks", 1}, {"means", {0.5}}};
  EXPECT_THAT(refusal(side_), HasSubstr("parity: inputs must have 115 bytes, found 15"));
  observation.erase("history");
  EXPECT_THAT(refusal(side_), HasSubstr("history"));
}

TEST_F(SideFileOfReadings, IsRefusedWhereInconsistent) {
  const auto with = [this](const char* pointer, const Json& value) {
    Json side = side_;
    side[Json::json_pointer(pointer)] = value;
    return refusal(side);
  };
  EXPECT_THAT(with("/observation/kind", "numbers"), HasSubstr("kind: must be 'images' or 'readings', found 'numbers'"));
  EXPECT_THAT(with("/observation/history/last", 0), HasSubstr("last: must be an integer from 1 to 1000, found 0"));
  EXPECT_THAT(with("/observation/history/lost", 1),
              HasSubstr("unknown key 'lost' in 'history'; allowed: last, best, fine_move"));
  EXPECT_THAT(with("/observation/history/last", 3), HasSubstr("parity: inputs must have 20 bytes, found 15"));
  EXPECT_THAT(with("/observation/score", "gain"), HasSubstr("score: 'gain' is not one of the readings"));
  EXPECT_THAT(with("/observation/deviation", {0}), HasSubstr("deviation: must be positive"));
  EXPECT_THAT(with("/observation/fine", {1, 2}), HasSubstr("fine: must have 1 numbers, found 2"));
  EXPECT_THAT(with("/scales", {1}), HasSubstr("history: cannot be combined with 'doubt' or 'scales'"));
  EXPECT_THAT(with("/probes", {{"poses", {{0.1, 0.1}}}, {"until", 1}}), HasSubstr("must have 1 numbers, found 2"));
  EXPECT_THAT(with("/reproducible", "this_cpu"), HasSubstr("history"));
  Json unscored = side_;
  unscored["observation"].erase("score");
  EXPECT_THAT(refusal(unscored), HasSubstr("history.best: requires a reading that measures the score"));
}

}  // namespace
}  // namespace relign::policies
