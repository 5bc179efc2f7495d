#include "policies/model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "base/hash.h"
#include "policies/onnx_writer.h"

namespace relign::policies {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A copy of the golden network in a temporary folder, which the tests damage.
class ModelFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("relign-model-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    take("tiny");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void take(const std::string& name) {
    for (const char* end : {".onnx", ".json"})
      std::filesystem::copy_file(golden() / (name + end), folder_ / (std::string("net") + end),
                                 std::filesystem::copy_options::overwrite_existing);
  }
  static std::filesystem::path golden() { return std::filesystem::path(RELIGN_SOURCE_DIR) / "tests/golden/policies"; }
  std::string onnx() const { return (folder_ / "net.onnx").string(); }
  void write(const char* file, const std::string& bytes) const {
    std::ofstream(folder_ / file, std::ios::binary) << bytes;
  }
  nlohmann::json side() const { return nlohmann::json::parse(read_file(folder_ / "net.json")); }
  void write_side(nlohmann::json side) const {
    side["weights_sha256"] = sha256_file(folder_ / "net.onnx");
    write("net.json", side.dump());
  }
  // The error message of Model, empty when it accepts the files.
  std::string refusal() const {
    try {
      Model model(onnx());
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

TEST_F(ModelFiles, ReproducesParityOutputs) {
  Model model(onnx());
  EXPECT_EQ(model.about().frames, 2);
  std::vector<float> pictures(2 * 20 * 20, 51.0F);  // a fifth of 255
  std::fill(pictures.begin() + 400, pictures.end(), 102.0F);
  const std::vector<double> answer = model.answer(pictures);
  ASSERT_EQ(answer.size(), 2u);
  EXPECT_NEAR(answer[0], 0.4, 1e-5);
  EXPECT_NEAR(answer[1], 0.1, 1e-5);
}

TEST_F(ModelFiles, ShowsIrradianceInTheUnitsOfTheScene) {
  nlohmann::json side = this->side();
  side["observation"]["values"] = "irradiance";
  // The network divides by 255, so that irradiances give smaller outputs than bytes.
  const double unit = 3.0 * 0.1 / 255;  // byte_whites x white / 255
  for (auto& answer : side["parity"]["answers"])
    for (auto& value : answer) value = value.get<double>() * unit;
  write_side(side);
  Model model(onnx());
  EXPECT_TRUE(model.about().irradiance);
  EXPECT_NEAR(model.about().shown(model.about().parity[1])[0], 37 * unit, 1e-7);
  EXPECT_NEAR(model.answer(std::vector<float>(800, 51.0F))[0], 0.2, 1e-5);
  side["observation"]["values"] = "floats";
  write_side(side);
  EXPECT_THAT(refusal(), HasSubstr("values: must be 'bytes' or 'irradiance', found 'floats'"));
}

TEST_F(ModelFiles, RejectsWrongDoubt) {
  nlohmann::json side = this->side();
  side["doubt"] = {{"directions", {{1, 0}, {0, 1}}}, {"effects", {1, 1}}, {"floor", {0, 0}}, {"drift", 0.01}};
  for (auto& answer : side["parity"]["answers"]) answer.insert(answer.end(), {0, 0});
  write_side(side);
  EXPECT_THAT(refusal(), HasSubstr("returns 2 values, its side file has 2 axes and 'doubt', which need twice as many"));
  nlohmann::json wrong = side;
  wrong["doubt"]["directions"][1] = {1};
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("doubt.directions: must have 2 numbers, found 1"));
  wrong = side;
  wrong["doubt"]["floor"][0] = -1;
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("doubt.floor: found -1"));
  wrong = side;
  wrong["output"] = "move";
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("doubt: requires output 'way', found 'move'"));
}

TEST_F(ModelFiles, ConcurrentModelsReturnTheSameOutput) {
  Model one(onnx());
  Model other(onnx());
  const std::vector<float> bright(800, 204.0F), dark(800, 51.0F);
  const std::vector<double> first = one.answer(bright);
  EXPECT_NE(other.answer(dark), first);
  EXPECT_EQ(one.answer(bright), first);
  EXPECT_EQ(other.answer(bright), first);
}

TEST_F(ModelFiles, RejectsTruncatedNetwork) {
  const std::string whole = read_file(folder_ / "net.onnx");
  write("net.onnx", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("net.onnx"), HasSubstr("the network is damaged")));
  // Also when the side file has the hash of the truncated file.
  write_side(side());
  EXPECT_NE(refusal(), "");
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{100}, whole.size() - 1}) {
    write("net.onnx", whole.substr(0, length));
    write_side(side());
    EXPECT_NE(refusal(), "") << length;
  }
}

TEST_F(ModelFiles, RejectsMissingOrMalformedSideFile) {
  std::filesystem::remove(folder_ / "net.json");
  EXPECT_THAT(refusal(), HasSubstr("net.json: file not found"));
  write("net.json", "{");
  EXPECT_THAT(refusal(), HasSubstr("not a side file of relign-train"));
  write("net.json", "{\"format\": 2}");
  EXPECT_THAT(refusal(), HasSubstr("format: must be 1, found 2"));
  write("net.json", "{\"format\": 1, \"a\": {\"b\": 1}, \"format\": 1}");
  EXPECT_THAT(refusal(), HasSubstr("duplicate key 'format'"));
}

// "diviation" would leave the deviation 1, and the network would be shown other values than it was trained with.
TEST_F(ModelFiles, RejectsUnknownKeys) {
  const nlohmann::json right = side();
  nlohmann::json wrong = right;
  wrong["observation"]["diviation"] = 255;
  write_side(wrong);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("net.json: unknown key 'diviation' in 'observation'; allowed: size, frames"),
                               HasSubstr("mean, deviation")));
  wrong = right;
  wrong["scale"] = {1, 1};
  write_side(wrong);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("unknown key 'scale'; allowed: use, format"), HasSubstr("scales")));
  wrong = right;
  wrong["trained"] = {{"hour", 3}};
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("unknown key 'hour' in 'trained'; allowed: recipe, hours"));
  wrong["trained"] = {{"hours", 3}, {"steps", 1}, {"machine", "one GPU"}};
  wrong["use"] = "network";
  write_side(wrong);
  EXPECT_EQ(refusal(), "");
}

TEST_F(ModelFiles, RejectsInconsistentSizes) {
  const nlohmann::json right = side();
  nlohmann::json wrong = right;
  wrong["observation"]["size"] = 30;
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("does not accept an input of 1 x 2 x 30 x 30"));
  wrong = right;
  wrong["axes"] = {"u", "v", "w"};
  for (auto& answer : wrong["parity"]["answers"]) answer.push_back(0.0);
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("returns 2 values, its side file has 3 axes"));
  wrong = right;
  wrong["observation"]["size"] = 100000;
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("size: must be an integer from 10 to 1024, found 100000"));
  wrong["observation"]["size"] = 20.5;
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("size: must be an integer from 10 to 1024, found 20.5"));
}

TEST_F(ModelFiles, RejectsOutputsThatDifferFromParity) {
  nlohmann::json wrong = side();
  wrong["parity"]["answers"][2][1] = wrong["parity"]["answers"][2][1].get<double>() + 2e-4;
  write_side(wrong);
  EXPECT_THAT(refusal(), HasSubstr("on axis 'v' for a parity input"));
}

TEST_F(ModelFiles, RejectsNonFiniteWeights) {
  take("tiny-nan");
  EXPECT_THAT(refusal(), HasSubstr("not finite: its weights are damaged"));
}

TEST_F(ModelFiles, OpenCvRunsNetworksMarkedThisCpu) {
  nlohmann::json marked = side();
  marked["reproducible"] = "this_cpu";
  write_side(marked);
  if (const std::string why = refusal(); why.find("lacks the optional part") != std::string::npos) GTEST_SKIP() << why;
  Model model(onnx());
  EXPECT_NEAR(model.answer(std::vector<float>(800, 51.0F))[0], 0.2, 1e-5);
  // An operator outside the portable set.
  write("net.onnx", test::Chain(2, 20).then("Abs").then("GlobalAveragePool").then("Flatten").file());
  write_side(side());
  EXPECT_THAT(refusal(), HasSubstr("on axis 'u' for a parity input"));  // OpenCV ran it
  marked["reproducible"] = "anywhere";
  write_side(marked);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("operator Abs"), HasSubstr("\"reproducible\": \"this_cpu\"")));
  marked["reproducible"] = "nowhere";
  write_side(marked);
  EXPECT_THAT(refusal(), HasSubstr("found 'nowhere'"));
}

TEST_F(ModelFiles, ReloadsReplacedFile) {
  EXPECT_EQ(refusal(), "");
  const std::string whole = read_file(folder_ / "net.onnx");
  write("net.onnx", "nonsense");
  EXPECT_NE(refusal(), "");
  write("net.onnx", whole);
  EXPECT_EQ(refusal(), "");
}

// Flipped bits either leave a valid side file or raise std::runtime_error.
TEST_F(ModelFiles, DamagedSideFileNeverCrashes) {
  const std::string whole = read_file(folder_ / "net.json");
  unsigned refused = 0;
  for (std::size_t place = 0; place < whole.size(); place += 7) {
    std::string damaged = whole;
    damaged[place] = static_cast<char>(damaged[place] ^ (1 << (place % 7)));
    write("net.json", damaged);
    refused += refusal().empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 30u);
}

}  // namespace
}  // namespace relign::policies
